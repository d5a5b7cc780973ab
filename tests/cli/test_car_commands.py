"""Commands about cars: simulate, ports, upload, readback and virtual-car, with their exit codes."""

import contextlib
import json
import os
import select
import socket
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest
import serial
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from command_line import INSTALLED, PARADE, Terminal, data, refusal, run
from motorcade.link import serial_port
from motorcade.words import upload as protocol

DEADLINE_S = 10
# One state: forward at 200 mm/s for 1 s; and a follower's word.
LEADER_ONLY = bytes.fromhex("01000000 64800000")
MATS = Path(__file__).parents[2] / "examples" / "mats"
IMAGE = bytes.fromhex("01010100 64800000 E4800000")
OK = b"OK words=3 crc32=aaa3b7a2\n"
EVENT_KINDS = {"state", "start", "over", "frame", "heard", "lost"}
posix_only = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


@pytest.fixture(autouse=True)
def no_settling(monkeypatch):
    monkeypatch.setattr(serial_port, "_SETTLE_S", 0, raising=False)


@pytest.fixture
def image(tmp_path):
    path = tmp_path / "it.image"
    path.write_bytes(IMAGE)
    return path


# simulate


def test_simulate_tells_where_cars_end_and_what_happened():
    printed = data("simulate", PARADE, "--followers", "2", "--seconds", "1.5", "--json")
    assert set(printed) == {"cars", "counts", "events"}
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
    ran = run("simulate", PARADE, "--seconds", "0.5", "--followers", "1", "--picture", picture, stdout=Terminal())
    assert ran.code == 0
    assert "leader" in ran.out
    assert "{" not in ran.out
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("option", ["--picture", "--record", "--video"])
@pytest.mark.parametrize("name", ["tracks.nonsense", "missing/tracks.png"])
def test_a_file_that_cannot_be_written_is_a_usage_error(tmp_path, option, name):
    assert "can't be written" in refusal(2, "simulate", PARADE, "--seconds", "0", option, tmp_path / name)


def test_simulate_drives_on_a_mat_and_records_the_run(tmp_path):
    recording = tmp_path / "run.parquet"
    ran = run("simulate", PARADE, "--mat", MATS / "pillars.toml", "--seconds", "1", "--record", recording)
    told = json.loads(ran.out)
    assert len(told["cars"]) > 6
    assert told["counts"]["frames"] > 0
    lines = run("replay", recording).out.splitlines()
    assert json.loads(lines[0])["mat"] != "open table"


def test_a_mat_says_which_cars_there_are():
    told = refusal(2, "simulate", PARADE, "--mat", MATS / "maze.toml", "--followers", "3")
    assert "exclude each other" in told


def test_a_mat_with_a_mistake_is_refused_in_a_sentence(tmp_path):
    wrong = tmp_path / "wrong.toml"
    text = 'format = "motorcade-mat/1"\nname = "w"\n[[wall]]\nfrom_m = [0, 0]\nto_m = [0, 0]\n'
    wrong.write_text(text, encoding="utf-8")
    assert "wall[0] has no length" in refusal(1, "simulate", PARADE, "--mat", wrong)


OUT_OF_RANGE = ("--followers -1", "--followers 10001", "--seed -1", "--seconds -1", "--seconds inf", "--seconds nan")


@pytest.mark.parametrize("option", OUT_OF_RANGE)
def test_an_option_out_of_range_is_a_usage_error(option):
    ran = run("simulate", PARADE, *option.split())
    assert (ran.code, ran.out) == (2, "")
    assert option.split()[0] in ran.err
    assert "Traceback" not in ran.err


def test_simulating_needs_no_drawing_library_without_a_picture():
    reporting = {**os.environ, "PYTHONPROFILEIMPORTTIME": "1"}
    command = [INSTALLED, "simulate", str(PARADE), "--seconds", "0"]
    ran = subprocess.run(command, env=reporting, capture_output=True, text=True, check=True, timeout=60)
    imported = {line.rpartition("|")[2].strip() for line in ran.stderr.splitlines() if line.startswith("import time:")}
    assert "motorcade.sim.world" in imported
    assert not imported & {"matplotlib", "pyarrow", "mcap", "imageio_ffmpeg", "serial"}


# ports


def test_ports_lists_what_is_plugged_in(monkeypatch):
    second, first = ListPortInfo("/dev/ttyUSB1"), ListPortInfo("/dev/ttyUSB0")
    first.description, first.hwid = "CH340", "USB VID:PID=1A86:7523"
    monkeypatch.setattr(list_ports, "comports", lambda: [second, first])
    found = data("ports")
    assert found[0] == {"device": "/dev/ttyUSB0", "description": "CH340", "hardware": "USB VID:PID=1A86:7523"}
    assert [port["device"] for port in found] == ["/dev/ttyUSB0", "/dev/ttyUSB1"]
    assert run("ports", stdout=Terminal()).out.splitlines()[0] == "/dev/ttyUSB0  CH340"


def test_no_ports_are_an_empty_list_and_on_a_terminal_a_hint(monkeypatch):
    monkeypatch.setattr(list_ports, "comports", list)
    assert data("ports") == []
    assert "`motorcade virtual-car`" in run("ports", stdout=Terminal()).out


# upload, readback and virtual-car together


@contextlib.contextmanager
def virtual_car(*where):
    """A virtual car in a process of its own; gives what it printed first."""
    command = [INSTALLED, "virtual-car", *map(str, where), "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        late = threading.Timer(DEADLINE_S, process.kill)
        late.start()
        try:
            yield json.loads(process.stdout.readline())
        finally:
            late.cancel()
            process.terminate()
            process.stdout.read()


@pytest.mark.parametrize(
    "where", [pytest.param(["--pty"], marks=posix_only), ["--tcp", "127.0.0.1:0"]], ids=["pty", "tcp"]
)
def test_upload_and_readback_with_a_virtual_car(tmp_path, image, where):
    store, fetched = tmp_path / "car.image", tmp_path / "fetched.image"
    with virtual_car(*where, "--store", store) as car:
        assert set(car) == {"port", "store"}
        port = car["port"]
        assert (
            run("upload", image, "--port", port).out == f"12 bytes to {port}: verified, the car answered {OK.decode()}"
        )
        uploaded = data("upload", image, "--port", port, "--json")
        assert uploaded == {"port": port, "bytes": 12, "verified": True, "answer": OK.decode().strip()}
        assert data("readback", "-p", port, "-o", fetched, "--json") == {
            "port": port,
            "bytes": 12,
            "file": str(fetched),
        }
        assert "can't be written" in refusal(2, "readback", "-p", port, "-o", tmp_path / "missing" / "it")
    assert fetched.read_bytes() == IMAGE
    assert store.read_bytes() == IMAGE


def test_a_project_is_compiled_and_then_uploaded(tmp_path):
    with virtual_car("--tcp", "127.0.0.1:0", "--store", tmp_path / "car.image") as car:
        assert "28 bytes" in run("upload", PARADE, "--port", car["port"]).out
    compiled = tmp_path / "parade.image"
    assert run("compile", PARADE, "-o", compiled).code == 0
    assert (tmp_path / "car.image").read_bytes() == compiled.read_bytes()


# When the car or its port isn't as it should be


@pytest.fixture
def board():
    """Both ends of a pseudo-terminal, the car's end played by the test."""
    import pty
    import tty

    car, client = pty.openpty()
    tty.setraw(client)
    yield SimpleNamespace(car=car, port=os.ttyname(client))
    os.close(car)
    os.close(client)


@posix_only
def test_a_silent_board_is_exit_code_5_and_no_verify_promises_nothing(board, image, tmp_path, monkeypatch):
    monkeypatch.setattr(protocol, "ANSWER_WITHIN_MS", 60)
    assert "--no-verify" in refusal(5, "upload", image, "--port", board.port)
    assert "switched on" in refusal(5, "readback", "--port", board.port, "-o", tmp_path / "fetched")
    assert not (tmp_path / "fetched").exists()
    said = run("upload", image, "--port", board.port, "--no-verify")
    assert (said.code, said.out) == (0, f"12 bytes to {board.port}: sent, not verified\n")
    told = data("upload", image, "--port", board.port, "--no-verify", "--json")
    assert told == {"port": board.port, "bytes": 12, "verified": False, "answer": "sent, not verified"}


@posix_only
@pytest.mark.parametrize(
    ("answer", "says"), [(OK.replace(b"a2", b"00"), "holds something else"), (b"ERR full\n", "full")]
)
def test_a_wrong_checksum_and_a_refusal_are_exit_code_6(board, image, answer, says):
    def play():
        data = b""
        while len(data) < len(IMAGE) and select.select([board.car], [], [], DEADLINE_S)[0]:
            data += os.read(board.car, len(IMAGE))
        os.write(board.car, answer)

    player = threading.Thread(target=play)
    player.start()
    assert says in refusal(6, "upload", image, "--port", board.port)
    player.join(DEADLINE_S)


@posix_only
def test_a_busy_port_is_exit_code_4(board, image, tmp_path):
    with serial.Serial(board.port, exclusive=True):
        assert "is busy" in refusal(4, "upload", image, "--port", board.port)
        assert "is busy" in refusal(4, "readback", "--port", board.port, "-o", tmp_path / "fetched")


def test_a_port_that_one_may_not_use_is_exit_code_4(image, monkeypatch):
    def denied(*arguments, **options):
        raise serial.SerialException(13, "could not open port P: [Errno 13] Permission denied: 'P'")

    monkeypatch.setattr(serial, "serial_for_url", denied)
    assert "may not use P" in refusal(4, "upload", image, "--port", "P")


def test_a_missing_port_is_exit_code_3(image, tmp_path):
    for command in (("upload", image), ("readback", "-o", tmp_path / "fetched")):
        assert "`motorcade ports`" in refusal(3, *command, "--port", "/dev/there-is-none")
    assert not (tmp_path / "fetched").exists()


@pytest.mark.parametrize("address", ["7000", ":7000", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:-1", "127.0.0.1:65536"])
def test_a_virtual_car_waits_only_at_a_host_and_port(address, tmp_path):
    assert refusal(2, "virtual-car", "--tcp", address, "--store", tmp_path / "car.image")


def test_a_virtual_car_that_cannot_start_says_why(tmp_path):
    store = tmp_path / "notes.txt"
    store.write_text("my notes")
    assert "notes.txt holds no image" in refusal(2, "virtual-car", "--store", store)
    assert store.read_text() == "my notes"
    assert "can't be read" in refusal(2, "virtual-car", "--store", tmp_path)
    assert "exclude each other" in refusal(2, "virtual-car", "--pty", "--tcp", "127.0.0.1:0")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        where = f"127.0.0.1:{taken.getsockname()[1]}"
        assert f"an't wait at {where}" in refusal(4, "virtual-car", "--tcp", where, "--store", tmp_path / "car.image")


@pytest.mark.parametrize("language", ["en", "zh"])
def test_ports_and_images_are_complained_of_in_the_language_that_was_asked_for(tmp_path, language):
    broken = tmp_path / "broken.image"
    broken.write_bytes(b"\x01")
    missing = run("upload", PARADE, "--port", "/dev/there-is-none", "--language", language)
    fetched = run("readback", "--port", "/dev/there-is-none", "-o", tmp_path / "x", "--language", language)
    shown = run("inspect", broken, "--language", language)
    says = {"en": ("There is no port", "1 bytes are"), "zh": ("没有端口 /dev/there-is-none", "1 个字节")}[language]
    assert says[0] in missing.err
    assert says[0] in fetched.err
    assert says[1] in shown.err
    assert (missing.code, fetched.code, shown.code) == (3, 3, 1)
