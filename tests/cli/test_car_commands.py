"""The command simulate, with its exit codes."""

import json
from importlib.resources import files
from pathlib import Path

import pytest

from support.command_line import PARADE, Terminal, data, refusal, run

# One state: forward at 200 mm/s for 1 s.
LEADER_ONLY = bytes.fromhex("01000000 64800000")
MATS = Path(__file__).parents[2] / "examples" / "mats"
EVENT_KINDS = {"state", "start", "over", "frame", "heard", "lost"}


def test_simulate_tells_where_cars_end_and_what_happened():
    printed = data("simulate", PARADE, "--followers", "2", "--seconds", "1.5", "--json")
    assert set(printed) == {"cars", "counts", "slots", "events"}
    assert [set(car) for car in printed["cars"]] == [{"id", "x", "y", "heading"}] * 3
    assert [car["id"] for car in printed["cars"]] == [0, 1, 2]
    # The leader drives straight on at 200 mm/s.
    assert printed["cars"][0] == {"id": 0, "x": pytest.approx(0.3), "y": 0, "heading": 0}
    assert all({"t_ms", "car", "kind", "word"} <= set(event) for event in printed["events"])
    assert {"state", "frame", "heard", "start"} <= {event["kind"] for event in printed["events"]} <= EVENT_KINDS


def test_five_followers_come_unless_nothing_is_said_to_them(image):
    assert len(data("simulate", image, "--seconds", "0")["cars"]) == 6
    image.write_bytes(LEADER_ONLY)
    assert len(data("simulate", image, "--seconds", "0")["cars"]) == 1
    assert len(data("simulate", image, "--seconds", "0", "--followers", "3")["cars"]) == 4


def test_a_project_and_its_image_drive_alike_and_a_seed_repeats(tmp_path):
    roaming, image = tmp_path / "roaming.motorcade.json", tmp_path / "roaming.image"
    step = {"drive": {"direction": "random", "speed": 2, "seconds": 3}}
    roaming.write_text(json.dumps({"format": "motorcade-program/1", "leader": [step]}), encoding="utf-8")
    assert run("compile", roaming, "-o", image).code == 0
    first = data("simulate", roaming, "--seconds", "3", "--seed", "4")
    assert data("simulate", image, "--seconds", "3", "--seed", "4") == first
    assert data("simulate", image, "--seconds", "3", "--seed", "5")["cars"] != first["cars"]


def test_simulate_draws_a_picture_and_on_a_terminal_a_table(tmp_path):
    picture = tmp_path / "tracks.png"
    ran = run("simulate", PARADE, "--seconds", "0.5", "--followers", "1", "--record", picture, stdout=Terminal())
    assert ran.code == 0
    assert "leader" in ran.out
    assert "{" not in ran.out
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_project_names_its_profile_so_the_option_may_name_no_other(tmp_path):
    text = files("motorcade").joinpath("profiles", "classroom.toml").read_text(encoding="utf-8")
    (tmp_path / "fast.toml").write_text(text.replace("[0, 100, 200, 300]", "[0, 150, 300, 450]"), encoding="utf-8")
    options = ("--seconds", "0", "--profile")
    told = refusal(2, "simulate", PARADE, *options, tmp_path / "fast.toml")
    assert "names its own profile, classroom; leave --profile" in told
    assert data("simulate", PARADE, *options, "classroom")["cars"]
    own = tmp_path / "own.motorcade.json"
    own.write_text(PARADE.read_text(encoding="utf-8").replace('"classroom"', '"fast.toml"'), encoding="utf-8")
    assert data("simulate", own, *options, tmp_path / "fast.toml")["cars"]


@pytest.fixture
def walled(tmp_path):
    """A project whose leader drives at a wall of the project's own mat."""
    mat = {"format": "motorcade-mat/1", "name": "Walled", "size_m": [8, 4]}
    mat |= {"wall": [{"from_m": [2, 0], "to_m": [2, 4]}], "car": [{"at_m": [1, 2], "role": "leader"}]}
    steps = [{"drive": {"direction": "forward", "speed": 3, "seconds": 3}}]
    view = {"range_mm": 1234}
    path = tmp_path / "walled.motorcade.json"
    project = {"format": "motorcade-program/1", "leader": steps, "mat": mat, "view": view}
    path.write_text(json.dumps(project), encoding="utf-8")
    return path


def test_a_project_is_simulated_on_its_own_mat_unless_another_is_named(walled, tmp_path):
    assert data("simulate", walled, "--seconds", "20")["cars"][0]["x"] < 2
    assert "'Walled'" in run("simulate", walled, "--seconds", "1").out
    recorded = tmp_path / "run.mcap"
    run("simulate", walled, "--seconds", "1", "--record", recorded)
    about = json.loads(run("replay", recorded, "--json").out.splitlines()[0])
    assert about["profile"]["infrared"]["range_mm"] == 1234
    # Its mat can be used for another program.
    assert data("simulate", PARADE, "--mat", walled, "--seconds", "20")["cars"][0]["x"] < 2
    pillars = data("simulate", walled, "--mat", MATS / "pillars.toml", "--seconds", "1")
    assert len(pillars["cars"]) > 1
    assert "without a mat of its own" in refusal(2, "simulate", walled, "--mat", PARADE)


def test_what_does_not_use_a_projects_own_mat_says_so(walled):
    ran = run("simulate", walled, "--followers", "2", "--seconds", "20", "--json")
    assert "the project's own mat 'Walled' is not used" in ran.err
    assert json.loads(ran.out)["cars"][0]["x"] > 2
    assert "the project's mat 'Walled' is not used" in run("check", "forward-and-stop", walled).err


def test_simulate_drives_on_a_mat_and_records_the_run(tmp_path):
    recording = tmp_path / "run.mcap"
    ran = run("simulate", PARADE, "--mat", MATS / "pillars.toml", "--seconds", "1", "--record", recording, "--json")
    told = json.loads(ran.out)
    assert len(told["cars"]) > 6
    assert told["counts"]["frames"] > 0
    lines = run("replay", recording, "--json").out.splitlines()
    assert json.loads(lines[0])["mat"]["name"] != "open table"


@pytest.mark.parametrize(
    "option", ["--followers 10001", "--seed -1", "--seconds nan", f"--mat {MATS}/maze.toml --followers 3"]
)
def test_an_option_out_of_range_is_a_usage_error(option):
    assert option.split()[0] in refusal(2, "simulate", PARADE, *option.split())
