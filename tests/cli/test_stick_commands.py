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
from support.driven_car import PATIENT, DrivenCar
from support.terminal_process import terminal
from support.virtual_pad import DOWN, LEFT_X, LEFT_Y, RIGHT_BUTTON, START, UP
from support.waiting import DEADLINE_S, wait_until

posix_only = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


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

    def do(self, order):
        """Do ``plug`` and so on, see `support.virtual_pad`."""
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


def shows(client, **expected):
    """Whether the last telemetry has these values."""
    telemetry = client.telemetry
    return telemetry and all(getattr(telemetry, name) == value for name, value in expected.items())


def test_a_gamepad_at_a_served_car_has_priority_over_the_network(pad):
    command = [*pad.program, "drive", "serve", "--port", "0", "--telemetry-port", "0", "--json", "--stick", "gamepad"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            ports, log = json.loads(process.stdout.readline()), Log(process)
            address = {"port": ports["port"], "telemetry_port": ports["telemetry_port"]}
            with BlockingDriveClient("127.0.0.1", **address, patience_s=DEADLINE_S) as network:
                network.drive_for(0.2, throttle=0.5)
                pad.do("plug")
                log.until("is connected")
                pad.do(f"push {LEFT_X} {UP}")
                wait_until(lambda: shows(network, angle_deg=180, driver="Pad of the tests at the car"), process)
                pad.do(f"hold {RIGHT_BUTTON}")
                wait_until(lambda: shows(network, state="stopped"), process)
                pad.do("unplug")
                log.until("is gone")
        finally:
            process.kill()


@posix_only
def test_the_keys_of_the_car_s_own_terminal_drive_it_and_end_it():
    serve = ("drive", "serve", "--port", "0", "--telemetry-port", "0", "--stick", "keyboard")
    with terminal(*serve) as user:
        user.wait_for("Ctrl-C ends")
        # A key that is down before the first look at the keyboard counts only when it is pressed again.
        user.wait_for("keyboard is connected")
        ports = re.search(rb"port (\d+), telemetry is at (\d+)", user.seen)
        port, telemetry_port = map(int, ports.groups())
        with BlockingDriveClient("127.0.0.1", port, telemetry_port=telemetry_port, patience_s=DEADLINE_S) as network:
            user.hold(b"a", lambda: shows(network, angle_deg=180, driver="keyboard at the car"))
            user.hold(b" ", lambda: shows(network, state="stopped"))
            # Keys that are at rest arm it at once.
            user.hold(b"c", lambda: network.telemetry and network.telemetry.state != "stopped")
        user.type(b"q")
        user.wait_for("The car stands still")
        user.wait(lambda: user.process.poll() is not None)
        assert user.process.returncode == 0


@posix_only
def test_a_driver_s_gamepad_drives_and_the_keys_give_orders(pad):
    with DrivenCar(profile=PATIENT) as car:
        connect = ("drive", "connect", f"127.0.0.1:{car.port}", "--telemetry-port", car.telemetry_port)
        with terminal(*connect, "--stick", "gamepad", "--language", "en", program=pad.program) as user:
            user.wait_for("No gamepad is connected")
            pad.do("plug")
            user.wait_for("gamepad: Pad of the tests")
            pad.do(f"push {LEFT_Y} {DOWN}")
            user.wait(lambda: car.board.setpoint == (90, 0, 255))
            user.type(b"g")
            user.wait_for("Release the keys or the stick")
            user.wait(lambda: car.control.telemetry().driver is None)
            for _ in range(1000):
                # It may not have read the pad between the two.
                pad.do(f"push {LEFT_Y} 0")
                user.read()
                pad.do(f"push {LEFT_Y} {DOWN}")
                user.read()
                if car.board.moves:
                    break
            assert car.board.setpoint == (90, 0, 255)
            pad.do(f"push {LEFT_Y} 0")
            user.wait(lambda: not car.board.moves)
            pad.do(f"hold {RIGHT_BUTTON}")
            user.wait_for("EMERGENCY STOP")
            user.type(b"c")
            user.wait(lambda: car.control.telemetry().state != "stopped")
            pad.do(f"push {LEFT_Y} {UP}")
            user.wait(lambda: car.board.setpoint == (90, 1, 255))
            pad.do("unplug")
            user.wait(lambda: not car.board.moves)
            pad.do("plug")
            pad.do(f"hold {START}")
            user.type(b"q")
            user.wait(lambda: user.process.poll() is not None)
            assert user.process.returncode == 0


@pytest.mark.parametrize("command", [("serve", "--port", "0"), ("connect", "127.0.0.1")])
def test_keys_need_a_terminal(command):
    assert "needs a terminal" in refusal(2, "drive", *command, "--stick", "keyboard")


def test_without_a_gamepads_library_the_sentence_says_what_is_missing(monkeypatch, tmp_path):
    serve = ("drive", "serve", "--port", "0", "--stick", "gamepad")
    monkeypatch.setitem(sys.modules, "sdl2", None)
    assert 'pip install "motorcade[gamepad]"' in refusal(2, *serve)
    monkeypatch.delitem(sys.modules, "sdl2")
    (tmp_path / "sdl2.py").write_text("raise ImportError('could not find any library for SDL2')")
    monkeypatch.syspath_prepend(tmp_path)
    assert "sudo apt install libsdl2-2.0-0" in refusal(3, *serve)


def test_the_command_line_starts_without_sdl():
    script = "import sys, motorcade.cli; sys.exit(bool({'sdl2', 'blessed'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
