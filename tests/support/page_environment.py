"""The environment that a page of the documentation makes: a virtual environment with what its extras bring.

The packages are those of the Python that runs the tests, by links, so that nothing is downloaded or copied.
"""

import sysconfig
import venv
from collections.abc import Iterable, Iterator
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement


def make_environment(folder: Path, extras: Iterable[str]) -> Path:
    """Make a virtual environment with Motorcade and ``extras``. Returns the folder of its programs."""
    venv.create(folder, symlinks=True)
    paths = {"base": str(folder), "platbase": str(folder)}
    packages = Path(sysconfig.get_path("purelib", "venv", paths))
    for each in _installed("motorcade", frozenset(extras), set()):
        for name in {file.parts[0] for file in each.files or ()} - {"..", "__pycache__"}:
            if not (packages / name).is_symlink():
                (packages / name).symlink_to(Path(str(each.locate_file(name))))
    programs = Path(sysconfig.get_path("scripts", "venv", paths))
    command = programs / "motorcade"
    command.write_text(f"#!{programs / 'python'}\nfrom motorcade.__main__ import main\nmain()\n", encoding="utf-8")
    command.chmod(0o755)
    return programs


def _installed(name: str, extras: frozenset[str], seen: set[tuple[str, frozenset[str]]]) -> Iterator[Distribution]:
    """Yield a package with extras and, each once, what it requires."""
    if (name, extras) in seen:
        return
    seen.add((name, extras))
    package = distribution(name)
    yield package
    for line in package.requires or ():
        wanted = Requirement(line)
        if wanted.marker is None or any(wanted.marker.evaluate({"extra": extra}) for extra in extras or ("",)):
            yield from _installed(wanted.name, frozenset(wanted.extras), seen)
