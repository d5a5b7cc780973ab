"""``motorcade drive serve --board raspberry-pi`` on mock pins: one process is driven and runs its image."""

import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest

from motorcade import BlockingDriveClient, Program, compile_program, forward, led, left, together
from motorcade.boards.computer import ImageStore
from motorcade.drive.certificates import CarKeys, make_keys, revoke_drivers
from motorcade.drive.connection import CarRefusesError
from motorcade.words.upload import ok_line
from support.command_line import refusal, started
from support.mock_pi import ENABLED, HEAD, LEDS
from support.waiting import DEADLINE_S, wait_until

LINUX = Path(__file__).parents[2] / "firmware" / "linux"
NOTED = Path(__file__).parent / "noted_pi_car.py"
AHEAD = compile_program(Program([together(forward(3, speed=3), led(1, 3))])).image
TURNS_LEFT = compile_program(Program([together(left(3, speed=2), led(2, 3))])).image
WHEELS, LEDS_AT = (5, 6, 12, 16, 26, 13), (17, 27, 22, 10)
STILL, STRAIGHT = (0,) * 6, (255, 0, 255) * 2
TURNING_LEFT = (0, 255, 34, 255, 0, 34)
ONE_LIT, TWO_LIT = (0, 255, 0, 0), (0, 0, 255, 0)


class RealPins:
    """The state of a car's pins, from the changes that it wrote to a file."""

    def __init__(self, file: Path, process: subprocess.Popen) -> None:
        self._file = file
        self._process = process

    def show(self, numbers: tuple[int, ...]) -> tuple[int, ...]:
        lines = self._file.read_text(encoding="ascii").splitlines() if self._file.exists() else []
        last = dict(line.split() for line in lines)
        return tuple(int(last.get(f"GPIO{number}", 0)) for number in numbers)

    def until(self, numbers: tuple[int, ...], shown: tuple[int, ...]) -> None:
        wait_until(lambda: self.show(numbers) == shown, self._process)


@pytest.fixture
def wired(tmp_path: Path) -> Path:
    """A pin file."""
    file = tmp_path / "pins.toml"
    file.write_text(HEAD + ENABLED + LEDS, encoding="utf-8")
    return file


@contextmanager
def served(tmp_path: Path, wired: Path, *options: str) -> Iterator[tuple[subprocess.Popen, dict, RealPins]]:
    noted = tmp_path / "pins.txt"
    command = ["--pins", wired, "--port", "0", *options]
    command += ["--store", tmp_path / "car.image", "--upload-tcp", "127.0.0.1:0"]
    program = sys.executable, NOTED, noted
    with started("drive", "serve", "--board", "raspberry-pi", *command, program=program) as (process, told):
        yield process, told, RealPins(noted, process)


def upload(told: dict, image: bytes) -> None:
    host, port = told["uploads"].removeprefix("socket://").split(":")
    with socket.create_connection((host, int(port)), DEADLINE_S) as line, line.makefile("rb") as answers:
        line.sendall(image)
        assert answers.readline() == ok_line(image)


def test_a_car_runs_a_program_obeys_its_driver_and_continues_the_program(tmp_path: Path, wired: Path) -> None:
    with served(tmp_path, wired) as (process, told, pins):
        assert told["store"] == str(tmp_path / "car.image")
        with BlockingDriveClient(told["host"], told["port"], telemetry_port=told["telemetry_port"]) as driver:
            with pytest.raises(CarRefusesError, match="holds no program"):
                driver.resume_program()
            upload(told, AHEAD)
            pins.until(LEDS_AT, ONE_LIT)
            assert pins.show(WHEELS) == STILL
            driver.resume_program()
            pins.until(WHEELS, STRAIGHT)
            # Half a turn to the left: the inner motor has half the duty.
            driver.drive(throttle=-200 / 255, steering=-0.5)
            pins.until(WHEELS, (0, 255, 100, 0, 255, 200))
            upload(told, TURNS_LEFT)
            pins.until(LEDS_AT, TWO_LIT)
            assert pins.show(WHEELS) == (0, 255, 100, 0, 255, 200)
            driver.resume_program()
            pins.until(WHEELS, TURNING_LEFT)
            driver.stop()
            pins.until(WHEELS, STILL)
            assert pins.show(LEDS_AT) == TWO_LIT
            driver.clear()
            driver.resume_program()
            pins.until(WHEELS, TURNING_LEFT)
        if os.name == "posix":
            process.send_signal(signal.SIGTERM)
            _, said = process.communicate(timeout=DEADLINE_S)
            assert process.returncode == 0
            assert f"took an image of {len(AHEAD)} bytes" in said
            assert pins.show(WHEELS + LEDS_AT) == (0,) * 10
    assert ImageStore(tmp_path / "car.image").load() == TURNS_LEFT


def test_wrong_options_are_refused_with_a_sentence(wired: Path, tmp_path: Path) -> None:
    real = ("drive", "serve", "--port", "0", "--board", "raspberry-pi", "--pins", wired)
    assert "a simulated one leads" in refusal(2, "drive", "serve", "--port", "0", "--role", "follower")
    both = ("--upload-tcp", "127.0.0.1:0", "--upload-serial", "/dev/ttyS9")
    assert "--upload-serial and --upload-tcp exclude" in refusal(2, *real, *both)
    assert "others can reach this car" in refusal(2, *real, "--store", tmp_path / "i", "--upload-tcp", "0.0.0.0:0")
    assert "no receiver in [infrared]" in refusal(2, *real, "--store", tmp_path / "i", "--role", "follower")


def values_of(service: str, key: str) -> list[str]:
    """What a delivered unit says of a key."""
    unit = (LINUX / f"motorcade-{service}.service").read_text(encoding="utf-8").splitlines()
    return [line.removeprefix(f"{key}=") for line in unit if line.startswith(f"{key}=")]


@pytest.mark.skipif(Path("/dev/gpiochip0").exists(), reason="this computer has pins")
@pytest.mark.parametrize(("service", "start"), [("car", ["car", "run"]), ("drive", ["drive", "serve", "--port", "0"])])
def test_a_service_starts_a_car_and_stops_its_wheels(service: str, start: list[str], tmp_path: Path) -> None:
    make_keys(tmp_path, [CarKeys("ada", ("127.0.0.1",))], [], datetime.now(UTC))
    installed = {
        "/etc/motorcade/pins.toml": str(LINUX / "pins.toml"),
        "${CREDENTIALS_DIRECTORY}/car.pem": str(tmp_path / "car-ada.pem"),
        "/var/lib/motorcade/car.image": str(tmp_path / "car.image"),
        "/var/lib/motorcade/activity.jsonl": str(tmp_path / "activity.jsonl"),
        "/etc/motorcade/revoked.txt": str(tmp_path / "revoked.txt"),
        "7700": "0",
    }
    for key, begins in (("ExecStart", start), ("ExecStopPost", ["car", "neutral"])):
        (line,) = values_of(service, key)
        program, *arguments = shlex.split(line)
        assert program.endswith("/bin/motorcade")
        assert arguments[:2] == begins[:2]
        # Only the hardware is missing here.
        assert refusal(3, *begins, *[installed.get(argument, argument) for argument in arguments[2:]])


def installed_service(tmp_path: Path) -> list[str]:
    """The arguments that the delivered unit starts the car with, its folders being in ``tmp_path``."""
    (tmp_path / "credentials").mkdir()
    for credential in values_of("drive", "LoadCredential"):
        name, _, source = credential.partition(":")
        shutil.copy(tmp_path / Path(source).name, tmp_path / "credentials" / name)
    (line,) = values_of("drive", "ExecStart")
    for folder in ("/etc/motorcade", "/var/lib/motorcade"):
        line = line.replace(folder, str(tmp_path))
    arguments = shlex.split(line.replace("${CREDENTIALS_DIRECTORY}", str(tmp_path / "credentials")))[1:]
    # What a test has not: a serial port, and fixed ports for the page and commands.
    at = arguments.index("--upload-serial")
    del arguments[at : at + 2]
    arguments[arguments.index("--web") + 1] = "0"
    return [*arguments, "--port", "0"]


def test_the_service_refuses_a_driver_whose_keys_are_revoked_and_says_where_its_list_is_missing(
    tmp_path: Path, wired: Path
) -> None:
    make_keys(tmp_path, [CarKeys("ada", ("127.0.0.1",))], ["lin"], datetime.now(UTC))
    shutil.copy(tmp_path / "car-ada.pem", tmp_path / "car.pem")
    lost = shutil.copy(tmp_path / "driver-lin.pem", tmp_path / "lost.pem")
    program = sys.executable, NOTED, tmp_path / "pins.txt"
    with started(*installed_service(tmp_path), program=program) as (process, told):
        assert "revoked.txt can't be read" in told["revoked_problem"]
        port = {"port": told["port"], "telemetry_port": told["telemetry_port"]}
        with BlockingDriveClient("127.0.0.1", **port, keys=lost, car="ada") as driver:
            assert "revoked.txt can't be read" in driver.next_telemetry().last_fault
            revoke_drivers(tmp_path, ["lin"])
            wait_until(lambda: not driver.connected, process)
        with (
            pytest.raises(CarRefusesError),
            BlockingDriveClient("127.0.0.1", **port, keys=lost, car="ada", patience_s=1) as driver,
        ):
            wait_until(driver.next_telemetry, process)
