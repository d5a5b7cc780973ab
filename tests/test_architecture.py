"""The house's arrows point one way, and no file in or around it grows too long."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
HOUSE = ROOT / "src" / "motorcade"
FILES = sorted(HOUSE.rglob("*.py"))
# What is written by hand around it; tests/ also holds what npm installs.
AROUND = sorted(
    file
    for folder in ("tests", "benchmarks", "scripts")
    for file in (ROOT / folder).rglob("*.py")
    if "node_modules" not in file.parts
)
LONGEST_LINES = 400

# Everything may fail, and say so.
COMMON = ("errors", "locales", "outcomes")
# What each room imports of the house, itself aside. A new room needs a line here first.
ARROWS = {
    "__init__": ("car", "cli", "config", "drive", "engine", "mats", "program", "runs", "words"),
    "__main__": ("cli",),
    "boards": ("cameras", "car", "config", "engine", "errors", "runs", "words"),
    "cameras": ("engine", "errors", "runs"),
    "car": ("words",),
    "cli": ("",),
    "config": ("boards", "car", "errors", "export", "locales", "words"),
    "drive": ("car", "config", "errors", "words"),
    "engine": ("car", "config", "errors", "mats", "words"),
    "errors": (),
    "locales": (),
    "outcomes": (),
    "experiments": ("car", "config", "engine", "errors", "mats", "words"),
    "export": ("config", "words"),
    "firmware": ("boards", "config", "errors", "upload"),
    "mats": ("config", "engine", "errors"),
    "program": ("config", "errors", "locales", "words"),
    "runs": ("config", "engine", "errors", "mats", "words"),
    "server": ("boards", "cameras", "config", "drive", "engine", "errors", "mats", "program", "service", "words"),
    "service": (
        "boards",
        "cameras",
        "car",
        "config",
        "engine",
        "errors",
        "mats",
        "program",
        "runs",
        "server",
        "upload",
        "words",
    ),
    "upload": ("errors", "words"),
    "words": (),
}


def name_of(file):
    return ".".join(file.relative_to(HOUSE).with_suffix("").parts)


def imported_by(file):
    """What ``file`` imports of the house, such as ``words.image`` or ``car.loop.Car``; inside functions too."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports here are absolute"
            full = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            full = [alias.name for alias in node.names]
        else:
            continue
        yield from (
            name.removeprefix("motorcade").removeprefix(".") for name in full if f"{name}.".startswith("motorcade.")
        )


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_a_room_imports_only_what_its_arrows_point_at(file):
    room = name_of(file).partition(".")[0]
    assert room in ARROWS, f"say in ARROWS what {room} may import"
    reachable = tuple(f"{name}.".lstrip(".") for name in (room, *COMMON, *ARROWS[room]))
    assert [name for name in imported_by(file) if not f"{name}.".startswith(reachable)] == []


@pytest.mark.parametrize("file", [*FILES, *AROUND], ids=lambda file: file.relative_to(ROOT).as_posix())
def test_a_file_stays_short_enough_to_read(file):
    lines = len(file.read_text(encoding="utf-8").splitlines())
    assert lines <= LONGEST_LINES, "something in it wants a room of its own"
