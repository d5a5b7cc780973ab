"""AVR chips on simavr, several at a time, with one clock and infrared light between them (tests/arduino/chips.c)."""

import ctypes
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

CYCLES_A_MS = 16_000
# Which log of a chip.
RECEIVED, EDGES, EEPROM, LIGHT, OUTPUTS = range(5)
_OVERRUNS, _LONGEST_AWAKE, _AWAKE, _RESET_LONGEST = range(4)
PAINT = 0xC5


class _Record(ctypes.Structure):
    _fields_ = [("cycle", ctypes.c_uint64), ("what", ctypes.c_uint32), ("value", ctypes.c_uint32)]


class ChipKind(NamedTuple):
    """A kind of chip: simavr's name, its EEPROM, where its RAM begins and ends, and its infrared pins."""

    mcu: str
    eeprom_bytes: int
    ram_begin: int
    ram_end: int
    sender: tuple[str, int]
    receiver: tuple[str, int]


UNO = ChipKind("atmega328p", 1024, 0x100, 0x900, ("B", 3), ("D", 2))
# An Uno's chip on another board.
MBOT = UNO._replace(sender=("D", 3))
MEGA = ChipKind("atmega2560", 4096, 0x200, 0x2200, ("B", 4), ("E", 4))


class ChipWorld:
    """Chips and their common clock.

    Args:
        library: chips.c as a shared library.
    """

    def __init__(self, library: Path) -> None:
        self._library = ctypes.CDLL(str(library))
        self._library.world_new.restype = ctypes.c_void_p
        self._library.chip_log.restype = ctypes.c_uint64
        self._library.chip_number.restype = ctypes.c_uint64
        self._world = ctypes.c_void_p(self._library.world_new())
        self.cycle = 0
        self.chips: list[Chip] = []

    def add(self, kind: ChipKind, elf: Path, symbols: dict[str, int], eeprom: bytes | None = None) -> "Chip":
        """Add a chip that is switched on now, with the program ``elf`` and an erased EEPROM or the one given."""
        content = eeprom if eeprom is not None else b"\xff" * kind.eeprom_bytes
        index = self._library.world_add(
            self._world, kind.mcu.encode(), str(elf).encode(), content, len(content), symbols["_end"]
        )
        assert index >= 0, f"simavr can't load {elf}"
        chip = Chip(self, index, kind, symbols)
        self.chips.append(chip)
        return chip

    def run(self, duration_ms: float) -> None:
        """Let all chips run."""
        self.cycle += round(duration_ms * CYCLES_A_MS)
        stopped = self._library.world_run(self._world, ctypes.c_uint64(self.cycle))
        assert stopped == 0, f"chip {stopped - 1} stopped"

    @property
    def now_ms(self) -> int:
        """The time in ms since the world began."""
        return self.cycle // CYCLES_A_MS

    def close(self) -> None:
        """Free all chips."""
        self._library.world_free(self._world)

    def call(self, function: str, *arguments: object) -> int:
        """Call a function of chips.c for this world."""
        result: int = getattr(self._library, function)(self._world, *arguments)
        return result


class Chip:
    """One chip of a world."""

    def __init__(self, world: ChipWorld, index: int, kind: ChipKind, symbols: dict[str, int]) -> None:
        self._world = world
        self._index = index
        self.kind = kind
        self.symbols = symbols
        self._taken = 0
        self._boot_at = 0
        (out_port, out_bit), (in_port, in_bit) = kind.sender, kind.receiver
        self._call("chip_infrared", ctypes.c_char(out_port.encode()), out_bit, ctypes.c_char(in_port.encode()), in_bit)

    def send(self, data: bytes) -> None:
        """Send bytes to the UART, behind those that are still on their way."""
        self._call("chip_send", data, len(data))

    def install_boot_loader(self, code: bytes, start: int) -> None:
        """Write a boot loader into the flash and begin with it, as after an external reset."""
        self._boot_at = start
        self._call("chip_boot", code, len(code), start)

    def restart(self) -> None:
        """Reset the chip, as a port's DTR does when it is opened."""
        self._call("chip_boot", b"", 0, self._boot_at)

    def received(self) -> bytes:
        """The bytes that came out of the UART since the last call."""
        records = self.log(RECEIVED, self._taken)
        self._taken += len(records)
        return bytes(value for _, _, value in records)

    def hears(self, chips: "Iterable[Chip]") -> None:
        """Let the chip's receiver see the light of ``chips`` only."""
        self._call("chip_hears", sum(1 << chip._index for chip in chips))

    def set_pin(self, port: str, bit: int, level: int, in_us: float = 0) -> None:
        """Set an input pin in so many µs; calls come in the order of time."""
        self._call("chip_set_pin", ctypes.c_char(port.encode()), bit, level, round(in_us * CYCLES_A_MS / 1000))

    def set_voltage(self, channel: int, millivolts: int) -> None:
        """Set the voltage at an analog input; each has 0 V at power-on."""
        self._call("chip_set_voltage", channel, millivolts)

    def watch(self, port: str, bit: int) -> None:
        """Log the edges of one output as OUTPUTS from now on."""
        self._call("chip_watch", ctypes.c_char(port.encode()), bit)

    def record_edges(self) -> None:
        """Log the edges at the infrared pin from now on."""
        self._call("chip_record_edges", 1)

    def read(self, address: int, count: int) -> bytes:
        """Bytes of the data memory."""
        data = ctypes.create_string_buffer(count)
        self._call("chip_read", address, data, count)
        return data.raw

    def eeprom(self) -> bytes:
        """The whole EEPROM."""
        data = ctypes.create_string_buffer(self.kind.eeprom_bytes)
        self._call("chip_eeprom", data)
        return data.raw

    def log(self, which: int, begin: int = 0) -> list[tuple[int, int, int]]:
        """The records of a log from the ``begin``-th on: cycle, what (an address) and value."""
        count = self._call("chip_log", which, ctypes.c_uint64(begin), None, ctypes.c_uint64(0)) - begin
        records = (_Record * count)()
        self._call("chip_log", which, ctypes.c_uint64(begin), records, ctypes.c_uint64(count))
        return [(each.cycle, each.what, each.value) for each in records]

    @property
    def overruns(self) -> int:
        """How many bytes a real UART would have lost because the program fetched them too late."""
        return self._call("chip_number", _OVERRUNS)

    @property
    def longest_awake_us(self) -> float:
        """How long the chip was awake at a stretch at most, since ``forget_longest``: its longest tick."""
        return self._call("chip_number", _LONGEST_AWAKE) / 16

    def forget_longest(self) -> None:
        """Measure ``longest_awake_us`` anew."""
        self._call("chip_number", _RESET_LONGEST)

    @property
    def awake_ms(self) -> float:
        """How long the chip was awake in all."""
        return self._call("chip_number", _AWAKE) / CYCLES_A_MS

    def stack_bytes(self) -> int:
        """How many bytes of RAM the stack has used at most."""
        begin = self.symbols["_end"]
        free = self.read(begin, self.kind.ram_end - begin)
        unused = len(free) - len(free.lstrip(bytes([PAINT])))
        return len(free) - unused

    def _call(self, function: str, *arguments: object) -> int:
        return self._world.call(function, self._index, *arguments)
