"""Which files a board gets: what its main.py needs, directly or through others, and its settings."""

import ast
import json
from pathlib import Path
from typing import Any

from motorcade.boards.on_chip.power_on import SETTINGS_FILE

MAIN = "main.py"
_LIBRARY = "lib"
_PACKAGE = "motorcade"
_SOURCE = Path(__file__).parents[1]
# The checker of boards is for whoever changes one and tries it at the prompt.
_ALSO = ("motorcade.car.check",)
# Sentences and exit codes are for a computer: on a board an error is its code and details.
_STAYS = ("motorcade.locales", "motorcade.outcomes")


def templates() -> Path:
    """The folder of main.py and of the pin files: in the package, or beside the sources where it runs from those."""
    packaged = Path(__file__).with_name("micropython")
    return packaged if packaged.is_dir() else _SOURCE.parents[1] / "firmware" / "micropython"


def board_files(settings: dict[str, Any]) -> dict[str, bytes]:
    """Each file's path on the board, and its bytes; main.py is the last, for without it nothing starts."""
    main = (templates() / MAIN).read_bytes()
    modules: dict[str, bytes] = {}
    for name in (*_imported(main), *_ALSO):
        _collect(name, modules)
    files = {f"{_LIBRARY}/{path}": modules[path] for path in sorted(modules)}
    files[SETTINGS_FILE] = json.dumps(settings).encode()
    files[MAIN] = main
    return files


def _collect(name: str, modules: dict[str, bytes]) -> None:
    """Add the module ``name`` and all that it imports of the house."""
    path = _SOURCE.joinpath(*name.split(".")[1:])
    source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    key = f"{_PACKAGE}/{source.relative_to(_SOURCE).as_posix()}"
    if key in modules or not source.is_file() or name.startswith(_STAYS):
        return
    # The house's own __init__ finds the public names by CPython's importlib.
    modules[key] = b"" if name == _PACKAGE else source.read_bytes()
    package = name.rpartition(".")[0]
    for other in (*([package] if package else []), *_imported(modules[key])):
        _collect(other, modules)


def _imported(source: bytes) -> list[str]:
    """The house's modules that ``source`` imports; names in a module count as modules too, and are none."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == _PACKAGE:
            found += [str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)]
    return found
