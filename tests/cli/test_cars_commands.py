"""The commands for many cars: their JSON and exit codes, and an uploader that is killed."""

import json
import os
import sys

import pytest

from motorcade.fleet.places import list_text
from motorcade.upload import serial_port
from support.command_line import data, refusal, run, started
from support.rooms import FIRST_CRC32, SECOND, SECOND_CRC32, simulated_cars
from support.terminal_process import WHERE_QUERY, terminal


@pytest.fixture(autouse=True)
def no_ports(monkeypatch, tmp_path):
    """This computer's own ports are left alone, and its folder has no list."""
    monkeypatch.setattr(serial_port.list_ports, "comports", list)
    monkeypatch.chdir(tmp_path)


def listed(folder, cars, *more):
    file = folder / "room.toml"
    places = [(f"car-{number}", car.address) for number, car in enumerate(cars)]
    file.write_text(list_text([*places, *more]), encoding="utf-8")
    return file


def image_file(folder, image):
    file = folder / "it.image"
    file.write_bytes(image)
    return file


def test_cars_are_shown_loaded_stopped_named_and_loaded_again(tmp_path):
    with simulated_cars(3) as cars:
        room = listed(tmp_path, cars)
        rows = data("cars", "--list", room)
        assert [(row["name"], row["crc32"], row["away"]) for row in rows] == [
            (f"car-{number}", FIRST_CRC32, False) for number in range(3)
        ]
        assert data("cars", "stop", "--list", room) == {"cars": 3, "missing": []}
        assert {car.wheels for car in cars} == {(0, 0)}
        assert run("cars", "name", cars[1].address, "阿达", "--list", room).code == 0
        assert cars[1].named == "阿达"
        assert "blinks for 5 s" in run("cars", "blink", "阿达", "--list", room).out
        program = image_file(tmp_path, SECOND)
        some = data("upload", program, "--to", "car-0", "--to", "阿达", "--list", room)
        assert [(each["car"], each["holds"], each["error"]) for each in some] == [
            ("car-0", "new", None),
            ("阿达", "new", None),
        ]
        assert data("cars", "go", "--list", room)["missing"] == []
        assert [each["holds"] for each in data("upload", program, "--to", "all", "--resume", "--list", room)] == [
            "new"
        ] * 3
        assert [car.image for car in cars] == [SECOND] * 3
        # A program has the name of its file in the current folder.
        (tmp_path / "broken.motorcade.json").write_text("{", encoding="utf-8")
        assert [row["program"] for row in data("cars", "--list", room)] == ["it"] * 3


def test_an_upload_that_some_cars_miss_ends_with_their_code(tmp_path):
    away = ("gone", "127.0.0.1:1")
    with simulated_cars(1) as cars:
        room = listed(tmp_path, cars, away)
        ran = run("upload", image_file(tmp_path, SECOND), "--to", "all", "--list", room, "--seconds", "2", "--json")
        assert ran.code == 5
        assert {each["car"]: each["holds"] for each in json.loads(ran.out)} == {"car-0": "new", "gone": "away"}
        ran = run("cars", "stop", "--list", room, "--seconds", "1", "--json")
        assert (ran.code, json.loads(ran.out)["missing"]) == (5, ["gone"])


def test_what_was_typed_wrong_is_a_sentence(tmp_path):
    program = image_file(tmp_path, SECOND)
    assert "no car bo" in refusal(3, "cars", "blink", "bo", "--seconds", "0.2")
    for command in (("name", "COM7", "x"), ("blink", "COM7")):
        assert "There is no port COM7. Is the cable in?" in refusal(3, "cars", *command)
    room = listed(tmp_path, [], ("ada", "COM7"))
    ran = run("cars", "stop", "--list", room, "--seconds", "0.5", "--json")
    assert (ran.code, json.loads(ran.out)) == (5, {"cars": 1, "missing": ["ada"]})
    (verdict,) = json.loads(run("upload", program, "--to", "all", "--list", room, "--seconds", "1", "--json").out)
    assert (verdict["holds"], verdict["error"]["code"]) == ("away", "no-such-port")
    assert "No car was found" in refusal(3, "upload", program, "--to", "all", "--seconds", "1")
    assert "--to and --port exclude" in refusal(2, "upload", program, "--to", "all", "--port", "COM3")
    assert "for several cars" in refusal(2, "upload", program, "--resume")
    assert "no name for a car" in refusal(2, "cars", "name", "COM3", "a b")
    assert "for simulated cars" in refusal(2, "car", "run", "--board", "simulated", "--count", "2", "--port", "P")
    (tmp_path / "cars.toml").write_text("ada = 1", encoding="utf-8")
    assert "ada has to be text" in refusal(2, "cars")


@pytest.mark.skipif(sys.platform == "win32", reason="FIFOs, and names that are no UTF-8")
def test_what_lies_in_the_current_folder_neither_ends_nor_hangs_the_command(tmp_path):
    """Its programs are read unasked. Nobody writes into the FIFO."""
    (tmp_path / "d.image").mkdir()
    os.mkfifo(tmp_path / "f.image")
    os.mkfifo(tmp_path / "p.toml")
    project = {"format": "motorcade-program/1", "profile": "p.toml", "leader": [{"led": {"which": 1, "seconds": 1}}]}
    (tmp_path / "p.motorcade.json").write_text(json.dumps(project), encoding="utf-8")
    (tmp_path / "gone.image").symlink_to("nowhere")
    (tmp_path / "zero.image").symlink_to("/dev/zero")
    (tmp_path / os.fsdecode(b"\xff.image")).write_bytes(SECOND)
    with simulated_cars(1, image=SECOND) as cars:
        (row,) = data("cars", "--list", listed(tmp_path, cars))
    assert row["program"] == os.fsdecode(b"\xff")


@pytest.mark.parametrize("kind", ["stop", "go"])
def test_an_order_is_for_all_cars(kind):
    assert "is for all cars at once" in refusal(2, "cars", kind, "9.9.9.9", "ada")


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX's devices")
def test_a_list_that_is_no_file_is_refused():
    assert "no file but a pipe or a device" in refusal(2, "cars", "--list", "/dev/zero")


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
def test_many_simulated_cars_are_one_process_and_a_list(tmp_path):
    room = tmp_path / "many.toml"
    command = ("car", "run", "--board", "simulated", "--count", 5, "--number", 7, "--list", room, "--store", tmp_path)
    for expected in (FIRST_CRC32, SECOND_CRC32):
        with started(*command) as (process, told):
            assert told["cars"] == 5
            rows = data("cars", "--list", room)
            assert [row["number"] for row in rows] == [10, 11, 7, 8, 9]
            if expected == SECOND_CRC32:
                assert {row["crc32"] for row in rows} == {SECOND_CRC32}
            assert run("upload", image_file(tmp_path, SECOND), "--to", "all", "--list", room).code == 0
            process.terminate()
            assert process.wait() == 0


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
def test_a_table_in_a_terminal_is_live_stops_all_by_a_key_and_leaves_the_terminal_as_it_was(tmp_path):
    import termios

    def echoes():
        return bool(termios.tcgetattr(user.handle)[3] & termios.ECHO)

    with simulated_cars(2) as cars:
        room = listed(tmp_path, cars, ("cable", "/dev/nowhere"))
        with terminal("cars", "--list", room) as user:
            user.wait_for("There is no port /dev/nowhere")
            user.wait_for("2 here, 1 away")
            user.wait(lambda: not echoes())
            # No other key ends them: no text, an arrow, one that a terminal sends with Alt in eight bits.
            user.type(b"\xff\xf3\xc3\x1b[A\x1bOBs")
            user.wait_for("stopped")
            user.type(b"q")
            user.wait(lambda: user.process.poll() is not None)
            assert (user.process.returncode, echoes()) == (0, True)
            # Where a terminal is asked what it is, and gives no answer, the keys of ten seconds are lost.
            assert WHERE_QUERY not in user.seen
