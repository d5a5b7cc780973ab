"""The commands drive connect, drive send and drive keys, against a running car."""

import shlex
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from motorcade.cli.options import own_folder
from motorcade.drive.blocking_client import BlockingDriveClient
from motorcade.drive.keys import server_context
from support.command_line import INSTALLED, Terminal, data, refusal, run
from support.driven_car import PATIENT, DrivenCar, deaf_port
from support.mock_board import NEUTRAL
from support.terminal_process import terminal
from support.waiting import DEADLINE_S, wait_until

PINS = Path(__file__).parents[2] / "firmware" / "linux" / "pins.toml"
UP, DOWN, LEFT = b"\x1b[A", b"\x1b[B", b"\x1b[D"

posix_only = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


@pytest.fixture
def car():
    with DrivenCar(profile=PATIENT) as car:
        yield car


def at(car, *options):
    """The arguments that name a car."""
    return (f"127.0.0.1:{car.port}", "--telemetry-port", car.telemetry_port, *options)


def moved(car):
    """The setpoints that moved the wheels, without repetitions."""
    setpoints = [setpoint for _, setpoint in car.board.notes if setpoint[2]]
    return [each for number, each in enumerate(setpoints) if each not in setpoints[number - 1 : number]]


# addresses and ports


def test_a_car_without_telemetry_is_driven_by_its_commands_alone(car):
    ran = run("drive", "send", f"drive://127.0.0.1:{car.port}", "--telemetry-port", "0", "throttle=1,seconds=0.3")
    assert (ran.code, ran.err) == (0, "")
    assert moved(car) == [(90, 1, 255)]
    wait_until(lambda: car.board.setpoint == NEUTRAL)


@pytest.mark.parametrize(
    ("code", "arguments", "says"),
    [
        (2, ("send", "127.0.0.1:65535", "throttle=1"), "no port behind 65535"),
        (2, ("serve", "--port", "65535"), "no port behind 65535"),
        (2, ("send", "drive://127.0.0.1:0", "throttle=1"), "127.0.0.1:0"),
    ],
)
def test_a_port_that_cannot_be_is_named(code, arguments, says):
    assert says in refusal(code, "drive", *arguments)


def test_the_sentence_names_the_port_at_which_no_telemetry_comes(car, monkeypatch):
    monkeypatch.setattr("motorcade.drive.client.PATIENCE_S", 0.3)
    with deaf_port() as port:
        where = (f"127.0.0.1:{car.port}", "--telemetry-port", port)
        assert f"no telemetry at port {port} (" in refusal(3, "drive", "send", *where, "throttle=1")
    assert moved(car) == []


def test_an_address_in_brackets_names_a_host_as_pages_show_it():
    sentence = refusal(2, "drive", "serve", "--host", "[2001:db8::1]", "--port", "0")
    assert "[" not in sentence
    assert "2001:db8::1" in sentence


@posix_only
def test_an_empty_folder_of_settings_counts_as_none(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    for folder in ("", "relative"):
        monkeypatch.setenv("XDG_CONFIG_HOME", folder)
        assert own_folder() == tmp_path / ".config" / "motorcade"


@posix_only
@pytest.mark.parametrize("arguments", [("--version",), ("ports",), ("car", "wiring", PINS), ("drive", "keys", "made")])
def test_a_closed_standard_output_is_no_fault(arguments, tmp_path):
    command = shlex.join([INSTALLED, *map(str, arguments)])
    options = ["--driver", "lin"] if "keys" in arguments else []
    shell = f"exec {command} {shlex.join(options)} >&-"
    ran = subprocess.run(["sh", "-c", shell], stderr=subprocess.PIPE, cwd=tmp_path, timeout=DEADLINE_S, check=False)
    assert (ran.returncode, ran.stderr) == (0, b"")


# send


def test_send_drives_one_command_after_the_other_and_then_stands(car):
    answer = data("drive", "send", *at(car), "throttle=0.4,steering=-0.2,seconds=0.6", "throttle=-1,seconds=0.6")
    assert (answer["state"], answer["speed"], answer["failsafes"]) == ("standing", 0, 0)
    assert moved(car) == [(108, 1, 102), (90, 0, 255)]
    wait_until(lambda: car.board.setpoint == NEUTRAL)
    ran = run("drive", "send", *at(car), "throttle=0.4,seconds=0.1", "seconds=0.1", stdout=Terminal())
    assert (ran.code, ran.out) == (0, f"0.2 s sent to 127.0.0.1:{car.port}; its state is standing\n")


def test_send_switches_lights_and_horn_for_the_time_of_its_commands(car):
    data("drive", "send", *at(car), "horn=1,head_light=1,seconds=0.2", "throttle=0.2,seconds=0.2")
    wait_until(lambda: len(car.board.switched) == 4)
    switched = car.board.switched
    assert set(switched[:2]) == {("head_light", True), ("horn", True)}
    # The next command sounds no horn; the light stays until the client leaves.
    assert switched[2:] == [("horn", False), ("head_light", False)]


@pytest.mark.parametrize("part", ["horn=2", "head_light=on", "throttle=1.1", "speed=1", "seconds=0", "seconds=nan", ""])
def test_an_invalid_command_is_refused_before_anything_is_sent(car, part):
    sentence = refusal(2, "drive", "send", *at(car), "throttle=0.5", f"steering=0,{part}")
    assert f"'{part}' is no part of a command" in sentence
    assert moved(car) == []


def test_send_to_a_car_that_another_drives_or_that_is_stopped_gives_the_reason(car):
    with BlockingDriveClient("127.0.0.1", car.port, telemetry_port=car.telemetry_port) as other:
        other.drive()
        wait_until(lambda: other.you.get("drives"))
        # Whoever drives keeps the wheel for 5 s after their last command.
        assert other.you["name"] in refusal(8, "drive", "send", *at(car), "throttle=0.5,seconds=0.1")
        other.stop()
        stopped = refusal(8, "drive", "send", *at(car), "throttle=0.5,seconds=0.1", "--language", "zh")
        assert "紧急停止" in stopped
    assert moved(car) == []


@pytest.mark.parametrize("address", ["", ":5005", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:65536", "[]"])
def test_an_invalid_address_is_a_usage_error(address):
    assert "is not HOST or HOST:PORT" in refusal(2, "drive", "send", address, "throttle=0.1")


@pytest.mark.parametrize("address", ["localhost", "127.0.0.1", "[::1]", "::1"])
def test_without_a_car_the_exit_code_is_3(address, monkeypatch):
    monkeypatch.setattr("motorcade.drive.client.PATIENCE_S", 0.1)
    with deaf_port() as port:
        monkeypatch.setattr("motorcade.cli.options.DRIVE_PORT", port)
        assert f"{address.strip('[]')}:{port}" in refusal(3, "drive", "send", address, "throttle=0.1")


# keys


def test_keys_let_a_driver_drive_and_others_not(tmp_path, monkeypatch):
    monkeypatch.setattr("motorcade.drive.client.PATIENCE_S", 3)
    folder, others = tmp_path / "class", tmp_path / "others"
    made = data("drive", "keys", folder, "--car", "ada@192.168.1.20", "--driver", "lin", "--driver", "mei")
    names = ["authority.pem", "authority.crt", "car-ada.pem", "driver-lin.pem", "driver-mei.pem"]
    assert made == [str(folder / name) for name in names]
    assert run("drive", "keys", others, "--driver", "mallory").code == 0
    with DrivenCar(server_context(folder / "car-ada.pem"), profile=PATIENT) as car:
        for driver in ("lin", "mei"):
            key = folder / f"driver-{driver}.pem"
            answer = data("drive", "send", *at(car, "--keys", key), "throttle=0.2,seconds=0.2")
            assert answer["driver"].startswith(driver)
        # Nobody who is refused is refused later.
        monkeypatch.setattr("motorcade.drive.client.PATIENCE_S", 2)
        sentence = refusal(6, "drive", "send", *at(car, "--keys", others / "driver-mallory.pem"), "throttle=0.5")
        assert "one folder of `motorcade drive keys`" in sentence
        assert "--keys" in refusal(9, "drive", "send", *at(car), "throttle=0.5")
        sentence = refusal(6, "drive", "send", *at(car, "--keys", key, "--car", "bob"), "throttle=0.5")
        assert "bob" in sentence
        assert {setpoint[2] for setpoint in moved(car)} == {51}


def test_keys_of_a_folder_that_is_not_there_are_none(tmp_path):
    for options in (("--list",), ("--revoke", "lin")):
        assert f"no keys in {tmp_path / 'none'}" in refusal(2, "drive", "keys", tmp_path / "none", *options)


def test_keys_that_cannot_be_made_or_read_are_usage_errors(tmp_path, car):
    assert "nobody is named" in refusal(2, "drive", "keys", tmp_path)
    assert "no name for a driver" in refusal(2, "drive", "keys", tmp_path, "--driver", "../lin")
    assert "no address of a car" in refusal(2, "drive", "keys", tmp_path, "--car", "ada@no address")
    assert not any(tmp_path.iterdir())
    missing = at(car, "--keys", tmp_path / "none.pem")
    assert "can't be read" in refusal(2, "drive", "send", *missing, "throttle=0.1")
    assert "--keys" in refusal(2, "drive", "send", *at(car, "--car", "ada"), "throttle=0.1")


# connect


def test_connect_needs_a_terminal(car):
    assert "`motorcade drive send`" in refusal(2, "drive", "connect", *at(car))


@posix_only
def test_a_held_key_drives_and_a_released_key_stops(car):
    with terminal("drive", "connect", *at(car)) as user:
        user.wait_for("ready")
        assert moved(car) == []
        # Some terminals send Alt and a letter so; it is no text, and no command.
        user.type(b"\xf3\xc3")
        user.hold(UP, lambda: car.board.setpoint == (90, 1, 102))
        user.hold(LEFT, lambda: car.board.setpoint[0] == 180)
        user.wait(lambda: not car.board.moves)
        user.hold(DOWN, lambda: car.board.setpoint == (90, 0, 102))
        user.hold(b" ", lambda: car.control.telemetry().state == "stopped")
        user.wait_for("EMERGENCY STOP")
        user.wait(lambda: not car.board.moves)
        count = len(moved(car))
        for _ in range(10):
            user.type(UP)
            user.read()
        assert len(moved(car)) == count
        user.hold(b"c", lambda: car.control.telemetry().state != "stopped")
        user.hold(UP, lambda: car.board.setpoint == (90, 1, 102))
        user.type(b"q")
        user.wait(lambda: user.process.poll() is not None)
        assert user.process.returncode == 0
    wait_until(lambda: car.board.setpoint == NEUTRAL)


@posix_only
def test_ctrl_c_ends_in_exit_code_0_and_a_car_that_stands(car):
    with terminal("drive", "connect", *at(car), "--language", "zh") as user:
        user.wait_for("就绪")
        user.hold(UP, lambda: car.board.moves)
        user.process.send_signal(signal.SIGINT)
        user.wait(lambda: user.process.poll() is not None)
        assert user.process.returncode == 0
    wait_until(lambda: not car.board.moves)


@posix_only
def test_connect_to_no_car_ends_in_a_sentence():
    with terminal("drive", "connect", "no.such.host.invalid") as user:
        user.wait_for("no.such.host.invalid")
        user.wait(lambda: user.process.poll() is not None)
        assert user.process.returncode == 3


def test_keys_are_listed_and_revoked(tmp_path):
    folder = tmp_path / "class"
    data("drive", "keys", folder, "--car", "ada", "--driver", "lin")
    revoked = data("drive", "keys", folder, "--revoke", "lin")
    assert revoked == {"revoked": ["lin"], "file": str(folder / "revoked.txt")}
    data("drive", "keys", folder, "--driver", "lin")
    listed = data("drive", "keys", folder, "--list")
    assert [(each["role"], each["name"], each["revoked"]) for each in listed] == [
        ("car", "ada", False),
        ("driver", "lin", True),
        ("driver", "lin", False),
    ]
    shown = run("drive", "keys", folder, "--list", stdout=Terminal()).out
    assert "lin: revoked" in shown
    assert "valid until" in shown
    made = run("drive", "keys", folder, "--driver", "mei", stdout=Terminal()).out
    assert "driver-mei.pem" in made
    assert "keep it to yourself" in made
    assert "--revoke NAME_OR_SERIAL" in refusal(2, "drive", "keys", folder)
    assert "exclude each other" in refusal(2, "drive", "keys", folder, "--list", "--revoke", "lin")
    assert "eve" in refusal(2, "drive", "keys", folder, "--revoke", "eve")
    assert "--keys" in refusal(2, "drive", "serve", "--port", "0", "--revoked", folder / "revoked.txt")


@posix_only
def test_ctrl_c_while_the_car_does_not_answer_is_quiet_and_ends_in_exit_code_130():
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        deaf.settimeout(DEADLINE_S)
        with terminal("drive", "connect", "127.0.0.1:1", "--telemetry-port", deaf.getsockname()[1]) as user:
            line, _ = deaf.accept()
            user.process.send_signal(signal.SIGINT)
            assert user.process.wait(DEADLINE_S) == 130
            while user.read():
                pass
            line.close()
    assert user.seen.strip() in (b"", b"^C")
