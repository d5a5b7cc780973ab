"""The corpus of each harness: inputs in base64, one a line. What they mean depends on the version of Hypothesis."""

import sys
from base64 import b64decode, b64encode
from collections.abc import Iterable
from pathlib import Path
from types import FrameType
from typing import Any

import motorcade

_FOLDER = Path(__file__).parent / "corpora"
_PACKAGE = str(Path(motorcade.__file__).parent)
# Enough for the paths that matter, and few enough for `make test`.
_MOST_KEPT, _LONGEST = 12, 400


def corpus(name: str) -> list[bytes]:
    """The inputs of a harness."""
    file = _FOLDER / f"{name}.txt"
    return [b64decode(line) for line in file.read_text(encoding="ascii").split()] if file.exists() else []


def add(name: str, inputs: Iterable[bytes]) -> None:
    """Add inputs that failed."""
    _write(name, [*corpus(name), *inputs])


def keep(name: str, inputs: Iterable[bytes]) -> None:
    """Replace a corpus: by those inputs, each time the one that reaches most lines that none before it has reached."""
    from tests.fuzz.harnesses import HARNESSES

    run = HARNESSES[name].hypothesis.fuzz_one_input
    reached = {data: _lines_of(run, data) for data in inputs if len(data) <= _LONGEST}
    kept: list[bytes] = []
    seen: set[tuple[str, int]] = set()
    while len(kept) < _MOST_KEPT and reached:
        best = max(reached, key=lambda data: (len(reached[data] - seen), -len(data)))
        if not (new := reached.pop(best) - seen):
            break
        seen |= new
        kept.append(best)
    _write(name, kept)


def _write(name: str, inputs: Iterable[bytes]) -> None:
    _FOLDER.mkdir(exist_ok=True)
    lines = dict.fromkeys(b64encode(data).decode() for data in inputs)
    (_FOLDER / f"{name}.txt").write_text("".join(f"{line}\n" for line in lines), encoding="ascii")


def _lines_of(run: Any, data: bytes) -> set[tuple[str, int]]:
    """The lines of Motorcade that an input reaches."""
    lines: set[tuple[str, int]] = set()

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        name = frame.f_code.co_filename
        if not name.startswith(_PACKAGE):
            return None
        lines.add((name, frame.f_lineno))
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        run(data)
    except Exception:  # noqa: BLE001 - it failed before, and is added by itself
        return set()
    finally:
        sys.settrace(before)
    return lines
