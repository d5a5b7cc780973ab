"""Commands that reach a car through a port: ports, upload and readback, with their exit codes."""

import contextlib
import json
import sys

import pytest
import serial
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from motorcade.boards.computer import ImageStore
from motorcade.upload import transfer as talk
from motorcade.words import upload as protocol
from support.command_line import PARADE, Terminal, data, refusal, run, started
from support.impatience import give_up_after
from support.played_car import PlayedCar

OK = b"OK words=3 crc32=aaa3b7a2\n"
posix_only = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


@pytest.fixture(autouse=True)
def no_settling(monkeypatch):
    monkeypatch.setattr(talk, "SETTLE_MS", 0)
    monkeypatch.setattr(talk, "BOOT_MS", 0)


# Which port


def a_port(device, vid=None, pid=None, description="n/a"):
    """A port as pyserial tells of it."""
    port = ListPortInfo(device)
    port.description = description
    if vid:
        port.vid, port.pid, port.hwid = vid, pid, f"USB VID:PID={vid:04X}:{pid:04X}"
    return port


BARE = a_port("/dev/ttyS0")
CONVERTER = a_port("/dev/ttyUSB1", 0x1A86, 0x7523, "USB Serial")
PICO = a_port("/dev/ttyACM0", 0x2E8A, 0x0005, "Board in FS mode")
STRANGER = a_port("/dev/ttyACM7", 0x1234, 0x0001, "Multimeter")


@pytest.fixture
def plugged_in(monkeypatch):
    return lambda *found: monkeypatch.setattr(list_ports, "comports", lambda: [*found])


def test_ports_lists_those_first_at_which_a_car_is_likely(plugged_in):
    plugged_in(BARE, STRANGER, CONVERTER, PICO)
    found = data("ports")
    assert [port["device"] for port in found] == ["/dev/ttyACM0", "/dev/ttyUSB1", "/dev/ttyACM7", "/dev/ttyS0"]
    assert found[1] == {
        "device": "/dev/ttyUSB1",
        "description": "USB Serial",
        "hardware": "USB VID:PID=1A86:7523",
        "board": "CH340",
    }
    shown = run("ports", stdout=Terminal()).out.splitlines()
    assert shown[1] == "/dev/ttyUSB1  CH340 (USB Serial)"
    assert shown[3].startswith("/dev/ttyS0  ")
    assert "n/a" not in shown[3]


@pytest.mark.parametrize("found", [[], [BARE]])
def test_where_no_car_is_plugged_in_ports_gives_a_hint_and_uploads_end_with_3(plugged_in, image, tmp_path, found):
    plugged_in(*found)
    assert len(data("ports")) == len(found)
    assert "`motorcade car run --board simulated --tcp 127.0.0.1:7000`" in run("ports", stdout=Terminal()).out
    for command in (("upload", image, "--dry-run"), ("readback", "-o", tmp_path / "fetched")):
        assert "No car is found" in refusal(3, *command)
    plugged_in(*found, CONVERTER)
    assert data("upload", image, "--dry-run", "--json")["port"] == "/dev/ttyUSB1"


def test_of_several_ports_one_must_be_named_where_nobody_can_be_asked(plugged_in, image):
    plugged_in(CONVERTER, PICO)
    said = refusal(2, "upload", image)
    assert "/dev/ttyACM0 (Raspberry Pi Pico (Board in FS mode)), /dev/ttyUSB1 (CH340 (USB Serial))" in said
    assert "--port" in said
    assert run("upload", image, "--language", "zh").err.startswith("motorcade: 小车可能在以下任一端口")


@pytest.mark.parametrize(("typed", "chosen"), [("\n", "/dev/ttyACM0"), ("5\nx\n2\n", "/dev/ttyUSB1")])
def test_of_several_ports_somebody_at_a_terminal_chooses(plugged_in, image, typed, chosen):
    plugged_in(CONVERTER, PICO)
    ran = run("upload", image, "--dry-run", "--json", typed=typed)
    assert (ran.code, json.loads(ran.out)["port"]) == (0, chosen)
    assert "  1  /dev/ttyACM0  Raspberry Pi Pico" in ran.err
    assert ran.err.count("At which of them is the car") == len(typed.splitlines())


def test_a_dry_run_says_what_would_go_where_and_opens_nothing(monkeypatch, image):
    monkeypatch.setattr(serial, "serial_for_url", None)
    told = data("upload", image, "--port", "COM9", "--dry-run", "--json")
    assert told == {"port": "COM9", "bytes": 12, "words": 3, "crc32": "aaa3b7a2", "baud": 115200, "sent": False}
    said = run("upload", PARADE, "--port", "COM9", "--dry-run").out
    assert said.startswith("28 bytes (7 words, crc32=")
    assert "would go to COM9 at 115200 baud; nothing was opened or sent" in said


# Upload and readback with a simulated car


def test_upload_and_readback_with_a_simulated_car(tmp_path, image, monkeypatch):
    # What follows an image at once the car skips.
    monkeypatch.setattr(talk, "SETTLE_MS", protocol.SILENCE_MS + 50)
    store, fetched = tmp_path / "car.image", tmp_path / "fetched.image"
    options = ("--board", "simulated", "--tcp", "127.0.0.1:0", "--store", store)
    with started("car", "run", *options) as (_, car):
        assert set(car) == {"role", "port", "store"}
        port = car["port"]
        told = f"12 bytes to {port}: verified, the car answered {OK.decode()}"
        assert run("upload", image, "--port", port).out == told
        uploaded = data("upload", image, "--port", port, "--json")
        assert uploaded == {"port": port, "bytes": 12, "verified": True, "answer": OK.decode().strip()}
        read = data("readback", "-p", port, "-o", fetched, "--json")
        assert read == {"port": port, "bytes": 12, "file": str(fetched)}
        assert "can't be written" in refusal(2, "readback", "-p", port, "-o", tmp_path / "missing" / "it")
    assert fetched.read_bytes() == ImageStore(store).load() == image.read_bytes()


# When the car or its port isn't as it should be


@posix_only
def test_a_silent_board_is_exit_code_5_and_no_verify_promises_nothing(image, tmp_path, monkeypatch):
    give_up_after(monkeypatch, 60)
    with contextlib.closing(PlayedCar("pty")) as board:
        said = refusal(5, "upload", image, "--port", board.port)
        assert "--no-verify" in said
        assert "keeps the image that it had" in said
        assert "switched on" in refusal(5, "readback", "--port", board.port, "-o", tmp_path / "fetched")
        assert not (tmp_path / "fetched").exists()
        sent = run("upload", image, "--port", board.port, "--no-verify")
        assert (sent.code, sent.out) == (0, f"12 bytes to {board.port}: sent, not verified\n")
        told = data("upload", image, "--port", board.port, "--no-verify", "--json")
        assert told == {"port": board.port, "bytes": 12, "verified": False, "answer": "sent, not verified"}


def test_another_try_is_told_to_somebody_who_waits(image):
    with contextlib.closing(PlayedCar("tcp")) as car:
        car.take(b"ERR the checksum is 0badcafe, aaa3b7a2 was announced\n", OK, image=image.read_bytes())
        ran = run("upload", image, "--port", car.port, typed="")
    assert ran.code == 0
    assert "Sending it again, 2 of 3." in ran.err


def test_a_missing_port_is_exit_code_3(image, tmp_path):
    for command in (("upload", image), ("readback", "-o", tmp_path / "fetched")):
        assert "`motorcade ports`" in refusal(3, *command, "--port", "/dev/there-is-none")
    assert not (tmp_path / "fetched").exists()
