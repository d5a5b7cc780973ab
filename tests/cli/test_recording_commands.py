"""Commands about recorded runs: replay and plot."""

import json
import re
import subprocess
import sys

import pytest
from PIL import Image

from support.command_line import data, refusal, run
from support.recorded_run import record, world


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """``run.mcap``: two seconds of six cars; and the first half of ten seconds, ``cut.mcap``."""
    folder = tmp_path_factory.mktemp("recordings")
    record([folder / "run.mcap"], world(seeds=7), duration_ms=2000)
    record([folder / "cut.mcap"], world(seeds=7), duration_ms=10_000)
    whole = (folder / "cut.mcap").read_bytes()
    (folder / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    return folder


def lines(*arguments):
    ran = run("--json", *arguments)
    assert (ran.code, ran.err) == (0, "")
    return [json.loads(line) for line in ran.out.splitlines()]


def test_replay_prints_the_run_its_moments_and_its_events(folder):
    first, *others = lines("replay", folder / "run.mcap")
    assert (first["type"], first["mat"]["name"], first["seeds"], first["cars"]) == (
        "run",
        "a table with a wall",
        [7],
        6,
    )
    moments = [line for line in others if line["type"] == "cars"]
    events = [line for line in others if line["type"] == "event"]
    assert [moment["t_ms"] for moment in moments] == list(range(0, 2001, 100))
    assert moments[0]["number"] == [0, 1, 2, 3, 4, 5]
    assert moments[0]["x_m"][0] == 1.0
    assert moments[-1]["counts"]["frames"] == sum(event["kind"] == "frame" for event in events)
    names = {"type", "t_ms", "world", "run", "car", "kind", "why", "word", "other"}
    assert all(set(event) == names for event in events)
    # In the order of time: the events up to a moment are before it, and no others.
    before_ms = -1
    for line in others:
        if line["type"] == "cars":
            assert line["t_ms"] > before_ms
            before_ms = line["t_ms"]
        else:
            assert before_ms < line["t_ms"] <= before_ms + 100


def test_replay_tells_what_the_cars_did_in_sentences(folder):
    begins, *told = run("replay", folder / "run.mcap").out.splitlines()
    assert begins.startswith("6 cars on 'a table with a wall', 2 s.")
    assert told[0] == "    0.000 s  car 0: word 1: forward 200 mm/s 2 s, LED 0 1 s"
    events = [line for line in lines("replay", folder / "run.mcap") if line["type"] == "event"]
    assert len(told) == sum(event["kind"] not in ("frame", "heard") for event in events)
    assert "parity" in {event["why"] for event in events}
    assert any(line.endswith("lost a frame: bits flipped on the way") for line in told)


DECIDING = """from motorcade import *

laps = 0

def leader():
    while laps < 2:
        forward(1, until=obstacle(2))
        laps += 1
        tell(led(1, 1))
    wait(8)
"""


def test_replay_tells_what_a_leader_decided(tmp_path):
    program = tmp_path / "laps.py"
    program.write_text(DECIDING, encoding="utf-8")
    simulated = data("simulate", program, "--seconds", "3", "--record", tmp_path / "run.mcap")["events"]
    _, *told = run("replay", tmp_path / "run.mcap").out.splitlines()
    of_leader = [re.sub(r"^ *[0-9.]+ s  ", "", line) for line in told if "car 0:" in line]
    assert of_leader[:5] == [
        "car 0: word 1: go on with leader word 6, if not: counter 1 is below 2; next is word 2",
        "car 0: word 2: forward 200 mm/s 1 s, until something is nearer than 300 mm",
        "car 0: word 3: add 1 to counter 1; next is word 4",
        "car 0: word 4: tell the followers their word 1; next is word 5",
        "car 0: word 5: go on with leader word 1; next is word 1",
    ]
    decided = [(event["index"], event["next"]) for event in simulated if event["kind"] == "flow"]
    assert decided[:4] == [(0, 1), (2, 3), (3, 4), (4, 0)]


def test_events_of_tagged_words_show_the_control_word_and_its_tag(tmp_path):
    image = tmp_path / "tagged.image"
    image.write_bytes(bytes.fromhex("01020201 40280000 c0280000 c0500000"))
    options = ("--followers", "2", "--seconds", "5", "--record", tmp_path / "run.mcap")
    simulated = data("simulate", image, *options)["events"]
    replayed = [line for line in lines("replay", tmp_path / "run.mcap") if line["type"] == "event"]
    for events in (simulated, replayed):
        tags = {}
        for event in events:
            if event["kind"] in ("start", "frame", "heard"):
                tags.setdefault((event["word"], event["kind"]), set()).add(event["tag"])
            else:
                assert "tag" not in event
        for kind in ("start", "frame", "heard"):
            assert (tags[0xC0280000, kind], tags[0xC0500000, kind]) == ({1, 3}, {2})


def test_events_of_bare_words_have_no_tag(tmp_path):
    image = tmp_path / "bare.image"
    image.write_bytes(bytes.fromhex("01010200 40280000 c0280000"))
    events = data("simulate", image, "--followers", "2", "--seconds", "3")["events"]
    assert {"start", "frame", "heard"} <= {event["kind"] for event in events}
    assert not any("tag" in event for event in events)


def test_plot_draws_a_film(folder, tmp_path):
    film = tmp_path / "film.gif"
    images = []
    for speed in ("1", "4"):
        ran = run("plot", folder / "run.mcap", "-o", film, "--speed", speed)
        assert (ran.code, ran.out) == (0, f"The run is drawn in {film}.\n")
        with Image.open(film) as opened:
            images.append(opened.n_frames)
    assert images[0] > 3 * images[1] > 0


def test_plot_draws_the_tracks(folder, tmp_path):
    path = tmp_path / "tracks.png"
    assert data("plot", folder / "run.mcap", "-o", path, "--json") == {"picture": str(path)}
    with Image.open(path) as picture:
        assert picture.size == (960, 720)


@pytest.mark.parametrize("arguments", [("replay",), ("plot", "-o", "{folder}/cut.png")])
def test_a_cut_off_file_is_read_as_far_as_possible_and_reported(arguments, folder):
    command, *options = (argument.format(folder=folder) for argument in arguments)
    ran = run(command, folder / "cut.mcap", *options)
    assert ran.code == 0
    assert len(ran.out) > 10
    (line,) = ran.err.splitlines()
    said = re.fullmatch(r"motorcade: .*cut\.mcap is cut off or damaged: what came after ([\d.]+) s is missing", line)
    assert 2 < float(said[1]) < 9


@pytest.mark.skipif(sys.platform == "win32", reason="a pipe that was left is another error on Windows")
def test_replay_ends_quietly_when_its_reader_leaves(folder):
    command = [sys.executable, "-m", "motorcade", "replay", str(folder / "cut.mcap"), "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as replay:
        assert replay.stdout.readline().startswith(b'{"type": "run"')
        replay.stdout.close()
        assert (replay.stderr.read(), replay.wait(60)) == (b"", 0)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("replay", "gone.mcap"), "gone.mcap can't be read: there is no such file or folder"),
        (("replay", "{folder}/other.mcap"), "is no MCAP file"),
        (("plot", "{folder}/run.mcap", "-o", "a.gif", "--speed", "0"), "--speed is 0; allowed: 0.001 to 100000"),
        (("plot", "{folder}/run.mcap", "-o", "a.gif", "--speed", "nan"), "--speed is nan; allowed: 0.001 to 100000"),
        (("plot", "{folder}/run.mcap", "-o", "a.txt"), "its name must end in .gif, .png, .svg or .pdf"),
        (("plot", "{folder}/run.mcap", "-o", "gone/a.png"), "there is no folder gone"),
    ],
)
def test_a_refusal_is_one_sentence(arguments, sentence, folder):
    (folder / "other.mcap").write_bytes(b"GIF89a and so on, nothing to replay")
    assert sentence in refusal(2, *(argument.format(folder=folder) for argument in arguments))
