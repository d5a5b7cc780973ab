"""Cars whose terminal takes no output, or whose command is ended in any way: nothing holds the wheels up."""

import contextlib
import os
import shlex
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from scripts.studio_process import free_port

from motorcade import BlockingDriveClient, Program, compile_program, forward, led
from motorcade.boards.computer import ImageStore
from motorcade.words.request import STOP, car_request
from motorcade.words.upload import ok_line
from support.command_line import INSTALLED, OWN_GROUP, started
from support.mock_pi import ENABLED, HEAD
from support.waiting import DEADLINE_S, wait_until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and pseudo-terminals are POSIX's")
NOTED = Path(__file__).parent / "noted_pi_car.py"
AHEAD = compile_program(Program([forward(3, speed=3)])).image
# Each state is noted: the shortest ones make most lines.
BLINKS = compile_program(Program([led(1, 0), led(2, 0)])).image
XOFF = b"\x13"


@contextlib.contextmanager
def full_pipe() -> Iterator[int]:
    """The end of a pipe that is full, and that nobody reads."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(writer, b"x" * 4096)
    os.set_blocking(writer, True)
    try:
        yield writer
    finally:
        os.close(writer)
        os.close(reader)


@contextlib.contextmanager
def stopped_terminal() -> Iterator[int]:
    """A terminal in which somebody has typed Ctrl-S."""
    import pty

    ours, theirs = pty.openpty()
    os.write(ours, XOFF)
    try:
        yield theirs
    finally:
        os.close(theirs)
        os.close(ours)


@contextlib.contextmanager
def silenced(output: int, *arguments: object) -> Iterator[subprocess.Popen]:
    command = [INSTALLED, *map(str, arguments)]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=output) as process:
        try:
            yield process
        finally:
            process.kill()


def connected(port: int, process: subprocess.Popen) -> socket.socket:
    def connect() -> socket.socket | None:
        with contextlib.suppress(OSError):
            return socket.create_connection(("127.0.0.1", port), DEADLINE_S)
        return None

    return wait_until(connect, process)


@pytest.mark.parametrize("kind", [full_pipe, stopped_terminal])
def test_a_car_whose_output_nobody_takes_runs_on_takes_orders_and_ends(kind, tmp_path: Path) -> None:
    ImageStore(tmp_path / "car.image").save(BLINKS)
    port = free_port()
    options = ("--board", "simulated", "--tcp", f"127.0.0.1:{port}", "--store", tmp_path / "car.image")
    with kind() as output, silenced(output, "car", "run", *options) as process, connected(port, process) as line:
        for number in range(3):
            line.sendall(car_request(STOP, number))
            assert b"state=stopped" in line.recv(1000)
        process.send_signal(signal.SIGTERM)
        assert process.wait(DEADLINE_S) == 0


@pytest.mark.parametrize("kind", [full_pipe, stopped_terminal])
def test_a_served_car_whose_output_nobody_takes_is_driven_and_ends(kind) -> None:
    port = free_port()
    with kind() as output, silenced(output, "drive", "serve", "--port", port) as process:
        connected(port, process).close()
        with BlockingDriveClient("127.0.0.1", port) as driver:
            wait_until(lambda: driver.drive(0.5) or driver.telemetry.speed, process)
        process.send_signal(signal.SIGTERM)
        assert process.wait(DEADLINE_S) == 0


@contextlib.contextmanager
def moving_car(tmp_path: Path) -> Iterator[tuple[subprocess.Popen, Path]]:
    """`motorcade car run` on mock pins, whose wheels turn, and the file that has what the pins show."""
    noted, pins = tmp_path / "pins.txt", tmp_path / "pins.toml"
    pins.write_text(HEAD + ENABLED, encoding="utf-8")
    ImageStore(tmp_path / "car.image").save(AHEAD)
    arguments = ("car", "run", "--pins", pins, "--store", tmp_path / "car.image", "--tcp", "127.0.0.1:0")
    with started(*arguments, program=(sys.executable, NOTED, noted)) as (process, told):
        wait_until(lambda: noted.exists() and last(noted).get("GPIO12") == "255", process)
        yield process, noted
    assert told["role"] == "leader"


def last(noted: Path) -> dict[str, str]:
    return dict(line.split() for line in noted.read_text(encoding="ascii").splitlines())


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_every_signal_ends_a_car_with_still_wheels(name: str, tmp_path: Path) -> None:
    with moving_car(tmp_path) as (process, noted):
        process.send_signal(getattr(signal, name))
        _, said = process.communicate(timeout=DEADLINE_S)
        assert (process.returncode, said) == (0, "")
        assert set(last(noted).values()) == {"0"}
        assert "rescued" not in last(noted)


def test_the_guard_stops_the_wheels_of_a_car_that_is_killed(tmp_path: Path) -> None:
    with moving_car(tmp_path) as (process, noted):
        process.kill()
        wait_until(lambda: "rescued" in last(noted))


def test_a_car_under_nohup_goes_on_when_its_terminal_is_closed(tmp_path: Path) -> None:
    port = free_port()
    command = ["car", "run", "--board", "simulated", "--tcp", f"127.0.0.1:{port}", "--store", str(tmp_path / "image")]
    shell = ["sh", "-c", f"trap '' HUP; exec {shlex.join([INSTALLED, *command])}"]
    with subprocess.Popen(shell, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            connected(port, process).close()
            process.send_signal(signal.SIGHUP)
            with connected(port, process) as line:
                line.sendall(AHEAD)
                assert line.recv(100) == ok_line(AHEAD)
        finally:
            process.kill()


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_driver_who_waits_for_a_car_ends_quietly_by_every_signal(name: str, code: int) -> None:
    """The car's port takes the connection, and nobody ever answers."""
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        port = deaf.getsockname()[1]
        command = [INSTALLED, "drive", "send", "127.0.0.1:1", "--telemetry-port", str(port), "throttle=0.1"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, creationflags=OWN_GROUP) as sent:
            deaf.settimeout(DEADLINE_S)
            line, _ = deaf.accept()
            sent.send_signal(getattr(signal, name))
            out, said = sent.communicate(timeout=DEADLINE_S)
            line.close()
    assert (sent.returncode, out, said) == (code, b"", b"")
