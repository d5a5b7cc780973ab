"""Start a car on a microcontroller: open the board that ``car.json`` describes, and run the loop.

Portable. MicroPython's modules are passed as Modules; ``main`` passes the real ones.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

    from motorcade.boards.on_chip.wifi_line import WifiLine

import json
from binascii import crc32, unhexlify
from collections import namedtuple

from motorcade.boards.micropython import MicroPythonBoard
from motorcade.boards.on_chip.lines import UartLine, UploadLine, UsbLine
from motorcade.boards.on_chip.parts import SerialVoice
from motorcade.car.brain import NO_VOICE
from motorcade.car.loop import Car
from motorcade.errors import MotorcadeError
from motorcade.words.ticks import elapsed_ms

SETTINGS_FORMAT = "motorcade-car/1"
SETTINGS_FILE = "car.json"
TICK_MS = 1
# How often garbage is collected where it costs no frame, and how often anyway while the air is free.
COLLECT_EVERY_MS = 2000
COLLECT_AT_LEAST_MS = 6000
# An ESP32 begins with 160 MHz.
_ESP32_HZ = 240_000_000
RESTART_AFTER_MS = 2000
# The first MicroPython whose PWM takes frequency and duty at once.
NEEDED_VERSION = (1, 21, 0)
# The first whose module tls has what keys need.
KEYS_NEED_VERSION = (1, 24, 0)
# Longer than any tick: writing an image to a flash that has to be erased first takes some tenths of a second.
_RESETS_AFTER_MS = 2000
# An ESP32's watchdog can't be switched off, but it takes any timeout.
_AT_THE_PROMPT_MS = 24 * 3600 * 1000
# An RP2040's and RP2350's is off without the bit ENABLE of its register CTRL. The third alias of a register clears
# bits. Source: their data sheets, chapters 4.7 and 12.9.
_RP2_CTRL = {"RP2040": 0x40058000, "RP2350": 0x400D8000}
_RP2_CLEARS = 0x3000
_RP2_ENABLE = 1 << 30

Modules = namedtuple(
    "Modules",
    "platform implementation machine clock micropython collector chip files open_file stdin stdout poll network",
)
"""MicroPython's modules and streams.

``platform`` and ``implementation`` are of its module sys; ``machine``, ``clock`` (time), ``micropython``,
``collector`` (gc) and ``files`` (os) are its modules, and ``chip`` is esp32 or rp2; ``open_file`` is open; ``stdin``
and ``stdout`` are the prompt's byte streams, and ``poll`` a select.poll that ``stdin`` is registered with.
``network`` is the modules network, socket, select and tls of a chip with Wi-Fi, None of another.
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
    machine = modules.machine
    if modules.platform == "esp32":
        try:
            machine.freq(_ESP32_HZ)
        except ValueError:
            # Some chips of the family are slower.
            pass
    if settings["number"] is None:
        settings["number"] = crc32(machine.unique_id()) & 0xFFFFFFFF
    # UARTs first: some claim a pin that isn't theirs, and the part at that pin then takes it back.
    pins = settings["pins"]
    if "serial" in pins:
        line: UploadLine = UartLine(machine, settings["uarts"]["serial"], pins["serial"], settings["baud"])
    else:
        line = UsbLine(modules)
    if "wifi" in settings and modules.network:
        line = _wifi_line(line, settings, modules)
    board: type[MicroPythonBoard] = MicroPythonBoard
    if "options" in settings:
        from motorcade.boards.on_chip.any_board import AnyBoard

        board = AnyBoard
    return board(settings, modules, line, _voice(settings, machine))


class Loop:
    """A car's loop: a tick, or a collection of garbage at a time that costs no infrared frame; and the watchdog.

    A collection takes some milliseconds, in which soft interrupts wait for its end. `MicroPythonBoard.has_time` says
    when none is needed for so long.
    """

    def __init__(self, board: MicroPythonBoard, modules: Modules) -> None:
        self._board = board
        self._car = Car(board)
        self._modules = modules
        self._clock = modules.clock
        # It resets the chip where it isn't fed for 2 s, and the motors stop.
        self._watchdog = modules.machine.WDT(timeout=_RESETS_AFTER_MS)
        self._collected_ms = modules.clock.ticks_ms()

    def turn(self) -> None:
        """Do one tick, or collect garbage where that is due and the board has time."""
        waited_ms = elapsed_ms(self._clock.ticks_ms(), self._collected_ms)
        if waited_ms >= COLLECT_EVERY_MS and self._board.has_time(waited_ms >= COLLECT_AT_LEAST_MS):
            self._modules.collector.collect()
            self._collected_ms = self._clock.ticks_ms()
        else:
            self._car.tick()
        self._watchdog.feed()
        self._clock.sleep_ms(TICK_MS)

    def close(self) -> None:
        """Stop the wheels; put the watchdog's reset off for a day or for ever, for somebody who works at the prompt."""
        self._board.close()
        machine = self._modules.machine
        if self._modules.platform == "esp32":
            machine.WDT(timeout=_AT_THE_PROMPT_MS)
        else:
            chip = "RP2350" if "RP2350" in self._modules.implementation._machine else "RP2040"
            machine.mem32[_RP2_CTRL[chip] + _RP2_CLEARS] = _RP2_ENABLE


def start(modules: Modules, stops: "Callable[[], bool]") -> None:
    """Run a car until ``stops()`` is true or somebody asks for the prompt; start again after a failure."""
    try:
        check_version(modules.implementation.version)
        loop = Loop(open_board(load_settings(modules.open_file), modules), modules)
        try:
            while not stops():
                loop.turn()
        finally:
            loop.close()
    except KeyboardInterrupt:
        print("The car stands still. Ctrl-D starts it again.")
    except MotorcadeError as problem:
        print("motorcade:", problem)
    except Exception as problem:  # noqa: BLE001 - nobody watches the car, so it restarts itself
        print("motorcade: the car failed and starts again:", repr(problem))
        modules.clock.sleep_ms(RESTART_AFTER_MS)
        modules.machine.reset()


def check_version(version: "tuple[Any, ...]", needed_version: "tuple[int, ...]" = NEEDED_VERSION) -> None:
    """Raise MotorcadeError where this MicroPython is too old for a car, or for one with keys."""
    if tuple(version[:3]) < needed_version:
        found = ".".join([str(part) for part in version[:3]])
        needed = ".".join([str(part) for part in needed_version])
        raise MotorcadeError("micropython-too-old", found=found, needed=needed)


def main() -> None:
    """Run a car for ever. The board's main.py calls this."""
    start(_modules(), lambda: False)


def check(modules: "Modules | None" = None, **given: "Any") -> None:
    """Check the board at its prompt, with its wheels off the ground, and print what breaks the contract of boards.

    Args:
        modules: MicroPython's own, unless given.
        given: further arguments of `motorcade.car.check.check_board`, such as ``observe``.

    Raises:
        MotorcadeError: the checker isn't on this board.
    """
    try:
        from motorcade.car.check import check_board
    except ImportError:
        raise MotorcadeError("checker-missing", command="motorcade install-firmware --check")
    modules = modules or _modules()
    board = open_board(load_settings(modules.open_file), modules)
    try:
        for breach in check_board(board, **given):
            print(breach)
    finally:
        board.close()


def _modules() -> Modules:
    """Return this chip's modules and streams."""
    import gc
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
    network = None
    if platform == "esp32":
        tls = __import__("tls") if sys.implementation.version[:3] >= KEYS_NEED_VERSION else None
        network = (__import__("network"), __import__("socket"), select, tls)
    return Modules(platform, sys.implementation, machine, time, micropython, gc, chip, os, open, *streams, network)


def _wifi_line(cable: UploadLine, settings: "dict[str, Any]", modules: Modules) -> "WifiLine":
    # Other cars don't need the memory for it.
    from motorcade.boards.on_chip.wifi_line import Announcer, WifiLine, join_network

    network, sockets, select, tls = modules.network
    number = "%08x" % settings["number"]  # noqa: UP031 - f-strings lack this there
    station = join_network(network, settings["wifi"], number)
    keys = settings.get("keys")
    name = keys["name"] if keys else ""
    announcer = Announcer(station, sockets, modules.clock, number, keys=name)
    arguments = (cable, sockets, select, modules.clock, announcer)
    if not keys:
        return WifiLine(*arguments)
    check_version(modules.implementation.version, KEYS_NEED_VERSION)
    # The chip's clock begins in 2000, before any certificate is valid.
    date, clock = tuple(keys["date"]), modules.machine.RTC()
    if tuple(clock.datetime()) < date:
        clock.datetime(date)
    from motorcade.boards.on_chip.secure_line import Keys, SecureLine

    return SecureLine(Keys(tls, keys), *arguments)


def _voice(settings: "dict[str, Any]", machine: "Any") -> "Callable[[], int]":
    if "voice" not in settings:
        return lambda: NO_VOICE
    voice = settings["voice"]
    line = UartLine(machine, settings["uarts"]["voice"], settings["pins"]["voice"], voice["baud"])
    patterns = [(unhexlify(pattern), word) for pattern, word in voice["patterns"]]
    return SerialVoice(line.read, patterns).heard_voice
