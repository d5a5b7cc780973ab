"""Compile sketches with Debian's avr-gcc and arduino-core-avr, as the Arduino IDE does."""

import hashlib
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

CORE = Path("/usr/share/arduino/hardware/arduino/avr")
# The IDE's flags (platform.txt); own files must compile without a warning.
_COMMON = ("-g", "-Os", "-DF_CPU=16000000L", "-DARDUINO=10819", "-DARDUINO_ARCH_AVR", "-flto")
_SECTIONS = ("-ffunction-sections", "-fdata-sections")
_C = ("-std=gnu11", "-fno-fat-lto-objects")
_CXX = ("-std=gnu++11", "-fpermissive", "-fno-exceptions", "-fno-threadsafe-statics")
_STRICT = ("-Wall", "-Wextra", "-Werror")
# arduino-core-avr 1.8.7 needs it from <float.h>, which avr-gcc 5.4 doesn't define.
_FOREIGN = ("-w", "-DDECIMAL_DIG=17")


class Target(NamedTuple):
    """A board of the IDE's menu."""

    mcu: str
    variant: str
    board: str


UNO = Target("atmega328p", "standard", "AVR_UNO")
MEGA = Target("atmega2560", "mega", "AVR_MEGA2560")


class ArduinoProgram(NamedTuple):
    """A compiled sketch: its ELF, its symbols' addresses, and the bytes of flash and of static RAM that it takes."""

    elf: Path
    symbols: dict[str, int]
    flash_bytes: int
    ram_bytes: int


def compile_sketch(files: dict[str, bytes], sketch: str, target: Target) -> ArduinoProgram:
    """Compile a sketch with the library.

    The result is kept in the folder of temporary files, under the hash of all that it was made from.

    Args:
        files: the library's files (`motorcade.firmware.arduino_library`).
        sketch: the folder of the sketch among them.
        target: the board.
    """
    made_from = repr((sorted(files.items()), sketch, target, _COMMON, _CXX, _STRICT))
    folder = Path(tempfile.gettempdir()) / "motorcade-arduino" / hashlib.sha256(made_from.encode()).hexdigest()[:16]
    elf = folder / "sketch.elf"
    if not elf.exists():
        _compile(files, sketch, target, folder)
    sizes = {
        name: int(size) for name, size in (line.split()[:2] for line in _run("avr-size", "-A", elf) if line[:1] == ".")
    }
    symbols = {}
    for line in _run("avr-nm", "--defined-only", elf):
        address, kind, name = line.split()
        # avr-gcc puts RAM at 0x800000.
        symbols[name] = int(address, 16) & 0xFFFF if kind in "bBdDAN" else int(address, 16)
    data = sizes.get(".data", 0)
    return ArduinoProgram(elf, symbols, sizes[".text"] + data, data + sizes.get(".bss", 0) + sizes.get(".noinit", 0))


def _compile(files: dict[str, bytes], sketch: str, target: Target, folder: Path) -> None:
    for path, data in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(data)
    library = folder / "src"
    flags = [*_COMMON, *_SECTIONS, f"-mmcu={target.mcu}", f"-DARDUINO_{target.board}", *_includes(target)]
    own = [*flags, f"-I{library}", f"-I{folder / sketch}", f"-I{CORE / 'libraries/EEPROM/src'}"]
    objects = []
    for source in sorted(library.rglob("*.c*")):
        objects.append(_object(source, [*own, *_STRICT, *(_C if source.suffix == ".c" else _CXX)], folder))
    ino = next((folder / sketch).glob("*.ino"))
    objects.append(_object(ino, [*own, *_STRICT, *_CXX, "-x", "c++", "-include", "Arduino.h"], folder))
    link = ["-Os", "-g", "-flto", "-fuse-linker-plugin", "-Wl,--gc-sections", f"-mmcu={target.mcu}"]
    _run("avr-gcc", *link, "-o", folder / "linked.elf", *objects, core_archive(target), "-lm")
    (folder / "linked.elf").rename(folder / "sketch.elf")


def compile_boot_loader(folder: Path) -> tuple[bytes, int]:
    """Compile Optiboot, the boot loader of an Uno, into ``folder``; returns its bytes and where they begin.

    Debian's compiler makes it 20 bytes longer than the 512 that Arduino's fuses reserve, so it begins earlier.
    """
    start = 0x7C00
    flags = ["-Os", "-w", "-fno-inline-small-functions", "-fno-split-wide-types", "-mmcu=atmega328p"]
    defines = ["-DF_CPU=16000000L", "-DLED_START_FLASHES=3", "-DBAUD_RATE=115200"]
    link = [f"-Wl,--section-start=.text={start:#x}", "-Wl,--relax", "-nostartfiles"]
    elf, image = folder / "optiboot.elf", folder / "optiboot.bin"
    _run("avr-gcc", *flags, *defines, *link, CORE / "bootloaders/optiboot/optiboot.c", "-o", elf)
    _run("avr-objcopy", "-j", ".text", "-j", ".data", "-O", "binary", elf, image)
    return image.read_bytes(), start


def core_archive(target: Target) -> Path:
    """Return Arduino's core for a board, compiled once."""
    folder = Path(tempfile.gettempdir()) / "motorcade-arduino" / f"core-{target.board}"
    archive = folder / "core.a"
    if archive.exists():
        return archive
    folder.mkdir(parents=True, exist_ok=True)
    flags = [*_COMMON, *_SECTIONS, *_FOREIGN, f"-mmcu={target.mcu}", f"-DARDUINO_{target.board}", *_includes(target)]
    objects = []
    for source in sorted((CORE / "cores/arduino").iterdir()):
        if source.suffix in (".c", ".cpp"):
            objects.append(_object(source, [*flags, *(_C if source.suffix == ".c" else _CXX)], folder))
    _run("avr-gcc-ar", "rcs", folder / "new.a", *objects)
    (folder / "new.a").rename(archive)
    return archive


def _includes(target: Target) -> list[str]:
    return [f"-I{CORE / 'cores/arduino'}", f"-I{CORE / 'variants' / target.variant}"]


def _object(source: Path, flags: list[str], folder: Path) -> Path:
    made = folder / f"{source.name}.o"
    _run("avr-gcc" if source.suffix == ".c" else "avr-g++", "-c", *flags, source, "-o", made)
    return made


def _run(*command: object) -> list[str]:
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}"
    return done.stdout.splitlines()
