"""A stick of this computer: drive serve --stick, which drives the car itself, and drive connect --stick."""

import contextlib
import json
import re
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from motorcade.drive.blocking_client import BlockingDriveClient
from motorcade.errors import MotorcadeError
from support import virtual_pad
from support.command_line import refusal
from support.driven_car import PATIENT, DrivenCar, wait_until
from support.terminal_seat import seated
from support.virtual_pad import DOWN, LEFT_X, LEFT_Y, RIGHT_BUTTON, START, UP

posix_only = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
# A simulated car's world may have to be compiled first.
DEADLINE_S = 180


class RemotePad:
    """A virtual gamepad at the computer of another process."""

    def __init__(self):
        try:
            virtual_pad.load_sdl()
        except MotorcadeError as problem:
            pytest.skip(str(problem))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(DEADLINE_S)
        self._line = None
        port = self._listener.getsockname()[1]
        self.program = (sys.executable, virtual_pad.__file__, str(port))

    def happens(self, order):
        """``plug`` and so on, as `support.virtual_pad` says."""
        self._line = self._line or self._listener.accept()[0]
        self._line.sendall(order.encode() + b"\n")

    def close(self):
        self._listener.close()
        if self._line:
            self._line.close()


@pytest.fixture
def pad(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[1]))
    with contextlib.closing(RemotePad()) as pad:
        yield pad


class Log:
    """The lines that a car prints, as they come."""

    def __init__(self, process):
        self._process = process

    def until(self, text):
        # The car's end ends a wait for a line that never comes.
        alarm = threading.Timer(DEADLINE_S, self._process.kill)
        alarm.start()
        try:
            for line in self._process.stderr:
                if text in line:
                    return
        finally:
            alarm.cancel()
        pytest.fail(f"never printed: {text}")


def tells(client, **expected):
    """Whether a car tells this, as far as it can be heard."""
    told = client.telemetry
    return told and all(getattr(told, name) == value for name, value in expected.items())


def test_a_gamepad_at_a_served_car_comes_before_the_network(pad):
    command = [*pad.program, "drive", "serve", "--port", "0", "--telemetry-port", "0", "--json", "--stick", "gamepad"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            ports, log = json.loads(process.stdout.readline()), Log(process)
            address = {"port": ports["port"], "telemetry_port": ports["telemetry_port"]}
            with BlockingDriveClient("127.0.0.1", **address, patience_s=DEADLINE_S) as network:
                network.drive_for(0.2, throttle=0.5)
                pad.happens("plug")
                log.until("is connected")
                pad.happens(f"push {LEFT_X} {UP}")
                wait_until(lambda: tells(network, angle_deg=180, driver="Pad of the tests at the car"), DEADLINE_S)
                pad.happens(f"hold {RIGHT_BUTTON}")
                wait_until(lambda: tells(network, state="stopped"), DEADLINE_S)
                pad.happens("unplug")
                log.until("is gone")
        finally:
            process.kill()


@posix_only
def test_the_keys_of_the_car_s_own_terminal_drive_it_and_end_it():
    serve = ("drive", "serve", "--port", "0", "--telemetry-port", "0", "--stick", "keyboard")
    with seated(*serve) as seat:
        seat.look("Ctrl-C ends")
        # A key that is down before the first look at the keyboard counts only when it is pressed again.
        seat.look("keyboard is connected")
        ports = re.search(rb"port (\d+), telemetry is at (\d+)", seat.seen)
        port, telemetry_port = map(int, ports.groups())
        with BlockingDriveClient("127.0.0.1", port, telemetry_port=telemetry_port, patience_s=DEADLINE_S) as network:
            seat.hold(b"a", lambda: tells(network, angle_deg=180, driver="keyboard at the car"))
            seat.hold(b" ", lambda: tells(network, state="stopped"))
            # Keys that are at rest arm it at once.
            seat.hold(b"c", lambda: network.telemetry and network.telemetry.state != "stopped")
        seat.type(b"q")
        seat.look("The car stands still")
        seat.wait(lambda: seat.process.poll() is not None)
        assert seat.process.returncode == 0


@posix_only
def test_a_driver_s_gamepad_drives_and_the_keys_give_orders(pad):
    with DrivenCar(profile=PATIENT) as car:
        connect = ("drive", "connect", f"127.0.0.1:{car.port}", "--telemetry-port", car.telemetry_port)
        with seated(*connect, "--stick", "gamepad", "--language", "en", program=pad.program) as seat:
            seat.look("No gamepad is connected")
            pad.happens("plug")
            seat.look("gamepad: Pad of the tests")
            pad.happens(f"push {LEFT_Y} {DOWN}")
            seat.wait(lambda: car.board.setpoint == (90, 0, 255))
            seat.type(b"g")
            seat.look("Release the keys or the stick")
            seat.wait(lambda: car.control.telemetry().driver is None)
            for _ in range(1000):
                # Between the two it may not have looked.
                pad.happens(f"push {LEFT_Y} 0")
                seat.glance()
                pad.happens(f"push {LEFT_Y} {DOWN}")
                seat.glance()
                if car.board.moves:
                    break
            assert car.board.setpoint == (90, 0, 255)
            pad.happens(f"push {LEFT_Y} 0")
            seat.wait(lambda: not car.board.moves)
            pad.happens(f"hold {RIGHT_BUTTON}")
            seat.look("EMERGENCY STOP")
            seat.type(b"c")
            seat.wait(lambda: car.control.telemetry().state != "stopped")
            pad.happens(f"push {LEFT_Y} {UP}")
            seat.wait(lambda: car.board.setpoint == (90, 1, 255))
            pad.happens("unplug")
            seat.wait(lambda: not car.board.moves)
            pad.happens("plug")
            pad.happens(f"hold {START}")
            seat.type(b"q")
            seat.wait(lambda: seat.process.poll() is not None)
            assert seat.process.returncode == 0


@pytest.mark.parametrize("command", [("serve", "--port", "0"), ("connect", "127.0.0.1")])
def test_keys_need_a_terminal(command):
    assert "needs a terminal" in refusal(2, "drive", *command, "--stick", "keyboard")


def test_where_no_gamepad_can_be_read_the_sentence_says_what_is_missing(monkeypatch, tmp_path):
    serve = ("drive", "serve", "--port", "0", "--stick", "gamepad")
    monkeypatch.setitem(sys.modules, "sdl2", None)
    assert "pip install 'motorcade[gamepad]'" in refusal(2, *serve)
    monkeypatch.delitem(sys.modules, "sdl2")
    (tmp_path / "sdl2.py").write_text("raise ImportError('could not find any library for SDL2')")
    monkeypatch.syspath_prepend(tmp_path)
    assert "sudo apt install libsdl2-2.0-0" in refusal(3, *serve)


def test_the_command_line_starts_without_sdl():
    script = "import sys, motorcade.cli; sys.exit(bool({'sdl2', 'blessed'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
