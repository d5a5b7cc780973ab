"""Start a car on a microcontroller: open the board that ``car.json`` describes, and run the loop.

Portable. MicroPython's modules are passed as Modules; ``main`` passes the real ones.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

import gc
import json
from binascii import crc32, unhexlify
from collections import namedtuple

from motorcade.boards.micropython import MicroPythonBoard
from motorcade.boards.on_chip.image_file import ImageFile
from motorcade.boards.on_chip.infrared import PioSender, RmtSender
from motorcade.boards.on_chip.lines import UartLine, UsbLine
from motorcade.boards.voice import SerialVoice, VoiceSource
from motorcade.car.loop import Car
from motorcade.errors import MotorcadeError
from motorcade.words.ticks import elapsed_ms

SETTINGS_FORMAT = "motorcade-car/1"
SETTINGS_FILE = "car.json"
IMAGE_FILE = "car.image"
TICK_MS = 1
# Garbage is collected this often, but not while a frame is on the air: the frame would be lost.
COLLECT_EVERY_MS = 500
RESTART_AFTER_MS = 2000

Modules = namedtuple(
    "Modules",
    ("platform", "machine", "clock", "micropython", "chip", "files", "open_file", "stdin", "stdout", "poll"),
)
"""MicroPython's modules and streams.

``platform`` is sys.platform; ``machine``, ``clock`` (time), ``micropython`` and ``files`` (os) are its modules, and
``chip`` is esp32 or rp2; ``open_file`` is open; ``stdin`` and ``stdout`` are the prompt's byte streams, and ``poll``
a select.poll that ``stdin`` is registered with.
"""


def load_settings(open_file: "Callable[..., Any]") -> "dict[str, Any]":
    """Return what `motorcade install-firmware` wrote into car.json.

    Raises:
        MotorcadeError: car.json isn't there or isn't of this version.
    """
    try:
        with open_file(SETTINGS_FILE, "r") as file:
            settings: dict[str, Any] = json.loads(file.read())
        if settings["format"] == SETTINGS_FORMAT:
            return settings
    except (OSError, ValueError, KeyError, TypeError):
        pass
    raise MotorcadeError("car-settings-missing", file=SETTINGS_FILE, command="motorcade install-firmware")


def open_board(settings: "dict[str, Any]", modules: Modules) -> MicroPythonBoard:
    """Open the board that ``settings`` describe, with its wheels and LEDs off."""
    machine, clock = modules.machine, modules.clock
    if settings["number"] is None:
        settings["number"] = crc32(machine.unique_id()) & 0xFFFFFFFF
    # UARTs first: some claim a pin that isn't theirs, and the part at that pin then takes it back.
    line = _line(settings, modules)
    voice = _voice(settings, machine)
    store = ImageFile(IMAGE_FILE, modules.files, modules.open_file)
    sender, interrupt = (RmtSender, {}) if modules.platform == "esp32" else (PioSender, {"hard": True})

    def make_sender(pin: int, unit_us: int) -> "Any":
        return sender(machine, modules.chip, pin, unit_us)

    return MicroPythonBoard(settings, machine, clock, line, store, make_sender, interrupt, voice)


def run(board: MicroPythonBoard, clock: "Any", stops: "Callable[[], bool]") -> None:
    """Run the car until ``stops()`` is true; its wheels stop however that ends."""
    car = Car(board)
    collected_ms = clock.ticks_ms()
    try:
        while not stops():
            car.tick()
            if elapsed_ms(clock.ticks_ms(), collected_ms) >= COLLECT_EVERY_MS and not board.senses_carrier():
                gc.collect()
                collected_ms = clock.ticks_ms()
            clock.sleep_ms(TICK_MS)
    finally:
        board.close()


def start(modules: Modules, stops: "Callable[[], bool]") -> None:
    """Run a car until ``stops()`` is true or somebody asks for the prompt; start again after a failure."""
    try:
        run(open_board(load_settings(modules.open_file), modules), modules.clock, stops)
    except KeyboardInterrupt:
        print("The car stands still. Ctrl-D starts it again.")
    except MotorcadeError as problem:
        print("motorcade:", problem)
    except Exception as problem:  # noqa: BLE001 - nobody watches the car, so it restarts itself
        print("motorcade: the car failed and starts again:", repr(problem))
        modules.clock.sleep_ms(RESTART_AFTER_MS)
        modules.machine.reset()


def main() -> None:
    """Run a car for ever. The board's main.py calls this."""
    import os
    import select
    import sys
    import time

    platform = sys.platform
    machine, micropython = __import__("machine"), __import__("micropython")
    poll = select.poll()
    poll.register(sys.stdin, select.POLLIN)
    streams = (sys.stdin.buffer, sys.stdout.buffer, poll)
    chip = __import__("esp32" if platform == "esp32" else "rp2")
    start(Modules(platform, machine, time, micropython, chip, os, open, *streams), lambda: False)


def _line(settings: "dict[str, Any]", modules: Modules) -> "Any":
    if "serial" in settings["pins"]:
        return UartLine(modules.machine, settings["uarts"]["serial"], settings["pins"]["serial"], settings["baud"])
    return UsbLine(modules.clock, modules.micropython, modules.stdin, modules.stdout, modules.poll)


def _voice(settings: "dict[str, Any]", machine: "Any") -> VoiceSource:
    if "voice" not in settings:
        return VoiceSource()
    voice = settings["voice"]
    line = UartLine(machine, settings["uarts"]["voice"], settings["pins"]["voice"], voice["baud"])
    return SerialVoice(line.read, [(unhexlify(pattern), word) for pattern, word in voice["patterns"]])
