"""The commands of a car itself: car run, car neutral and car wiring, with their sentences and exit codes."""

import contextlib
import json
import os
import signal
import socket
import sys
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest

from motorcade.boards.computer import ImageStore
from support.command_line import Terminal, data, refusal, run, started
from support.waiting import DEADLINE_S

PINS = Path(__file__).parents[2] / "firmware" / "linux" / "pins.toml"
VOICES = PINS.parent / "voice.toml"
# Two leader states of 1 s with voice control, and a follower's word.
IMAGE = bytes.fromhex("02000000 60802000 24802000")
OK = b"OK words=3 crc32="
posix_only = pytest.mark.skipif(sys.platform == "win32", reason="signals and pseudo-terminals are POSIX's")


@contextlib.contextmanager
def car(tmp_path, *options):
    """Run a simulated car in its own process; give its first line and the further lines as they come."""
    store = ("--store", tmp_path / "car.image")
    with started("car", "run", "--board", "simulated", *store, *options) as (process, begin):

        def until(kind):
            """Return the next line of that kind."""
            return next(line for line in map(json.loads, process.stdout) if line["kind"] == kind)

        yield SimpleNamespace(process=process, begin=begin, until=until)


def upload(address):
    host, port = address.removeprefix("socket://").split(":")
    with socket.create_connection((host, int(port)), timeout=DEADLINE_S) as line:
        line.sendall(IMAGE)
        assert line.makefile("rb").readline().startswith(OK)


def assert_ends(process, number):
    """A signal ends a car with exit code 0, and nothing is complained of."""
    if os.name == "posix":
        process.send_signal(number)
        assert process.wait(DEADLINE_S) == 0


def test_a_simulated_leader_stores_a_program_in_place_of_a_damaged_one_and_runs_it_after_a_restart(tmp_path):
    (tmp_path / "car.image").write_bytes(b"\x01\x02")
    with car(tmp_path, "--tcp", "127.0.0.1:0") as leader:
        assert leader.begin["role"] == "leader"
        assert leader.begin["store"] == str(tmp_path / "car.image")
        upload(leader.begin["port"])
        assert leader.until("state")["detail"] == 0
        assert leader.until("state")["detail"] == 1
        assert_ends(leader.process, signal.SIGINT)
        leader.process.kill()
        (said,) = leader.process.stderr.read().splitlines()
        assert "begins without a program and waits for an upload" in said
    assert ImageStore(tmp_path / "car.image").load() == IMAGE
    with car(tmp_path) as again:
        assert again.begin["port"] == ""
        assert again.until("state")["word"] == 0x60802000


def test_a_follower_stores_an_image_and_does_not_run_it(tmp_path):
    with car(tmp_path, "--role", "follower", "--number", "7", "--tcp", "127.0.0.1:0") as follower:
        assert follower.begin["role"] == "follower"
        for _ in range(2):
            upload(follower.begin["port"])
        # A leader would print a state after each image.
        assert [json.loads(follower.process.stdout.readline())["kind"] for _ in range(2)] == ["image", "image"]
    assert ImageStore(tmp_path / "car.image").load() == IMAGE


@posix_only
def test_a_car_takes_uploads_at_a_serial_port_and_words_of_a_keyboard(tmp_path):
    import pty
    import tty

    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    with car(tmp_path, "--port", os.ttyname(theirs), "--voice", "keyboard") as leader:
        assert leader.begin["port"] == os.ttyname(theirs)
        # What is typed need not be text.
        leader.process.stdin.buffer.write(b"\xff\nstop\n")
        leader.process.stdin.buffer.flush()
        os.write(ours, IMAGE)
        leader.until("image")
        assert os.read(ours, 100).startswith(OK)
        assert_ends(leader.process, signal.SIGTERM)
        assert leader.process.stderr.read() == ""
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize(
    ("code", "options", "says"),
    [
        (2, (), "--pins is missing"),
        (2, ("--board", "simulated", "--port", "P", "--tcp", "127.0.0.1:0"), "--port and --tcp exclude each other"),
        *(
            (2, ("--board", "simulated", "--tcp", address), "not HOST:PORT")
            for address in ("7000", ":1", "a:", "a:65536")
        ),
        (2, ("--board", "simulated", "--tcp", "0.0.0.0:0"), "can reach this car's uploads"),
        (2, ("--board", "simulated", "--voice", "/dev/ttyS9"), "--voice-map is missing"),
        (3, ("--board", "simulated", "--port", "/dev/there-is-none"), "There is no port /dev/there-is-none"),
        (3, ("--board", "simulated", "--voice", "/dev/there-is-none", "--voice-map", VOICES), "There is no port"),
        (3, ("--board", "simulated", "--watchdog", "/dev/there-is-none"), "can't be used"),
        (2, ("--board", "simulated", "--profile", "none"), "there is no profile 'none'"),
        (2, ("--board", "simulated", "--voice", "p", "--voice-map", PINS), 'format is "motorcade-pins/1"'),
        (2, ("--pins", VOICES), 'format is "motorcade-voice/1"'),
    ],
)
def test_a_car_that_cannot_start_says_why(tmp_path, code, options, says):
    assert says in refusal(code, "car", "run", "--store", tmp_path / "car.image", *options)


def test_a_tcp_port_in_use_is_exit_code_4_and_a_computer_without_pins_is_3(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        options = ("--board", "simulated", "--store", tmp_path / "car.image", "--tcp", address)
        assert f"Can't wait at {address}" in refusal(4, "car", "run", *options)
    for command in ("run", "neutral") if not Path("/dev/gpiochip0").exists() else ():
        assert "--board simulated" in refusal(3, "car", command, "--pins", PINS)


def test_a_pin_file_of_a_microcontroller_is_refused(tmp_path):
    pico = PINS.parents[1] / "micropython" / "rp2040.toml"
    assert "install-firmware" in refusal(2, "car", "run", "--store", tmp_path / "car.image", "--pins", pico)
    assert "install-firmware" in refusal(2, "car", "neutral", "--pins", pico)


def test_the_wiring_is_a_table_json_and_a_drawing(tmp_path):
    rows = data("car", "wiring", PINS, "--language", "en")
    assert rows[0] == {
        "part": "Left motor, by an L298N",
        "terminal": "IN1",
        "pin": 5,
        "label": "GPIO5 (29)",
        "supply": "6–12 V, GND",
        "components": "",
    }
    shown = run("car", "wiring", PINS, "--language", "zh", stdout=Terminal()).out
    assert "超声波传感器" in shown
    assert all(row["label"] in shown for row in rows)
    drawing = tmp_path / "car.svg"
    said = run("car", "wiring", PINS, "-o", drawing, stdout=Terminal())
    assert said.out == f"{len(rows)} wires are drawn in {drawing}\n"
    assert ElementTree.parse(drawing).getroot().tag.endswith("svg")


def test_a_drawing_never_replaces_its_pin_file(tmp_path):
    copy = tmp_path / "pins.toml"
    copy.write_text(PINS.read_text(encoding="utf-8"), encoding="utf-8")
    assert "choose another name" in refusal(2, "car", "wiring", copy, "-o", copy)
    assert copy.read_text(encoding="utf-8") == PINS.read_text(encoding="utf-8")
