"""python.zip: the part of the package motorcade that runs in the browser, and nothing else of it."""

import ast
import io
import zipfile
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
# What the worker imports; all else is found by its imports.
SHELL = ("browser/preload.py", "browser/shell.py")
# The time of every file in it: the same input gives the same bytes.
_TIME = (1980, 1, 1, 0, 0, 0)
# engine.wasm is a file of its own, so that the browser compiles it while it arrives.
_LEFT_OUT = ("py.typed", "engine.wasm")


def python_zip(package: Path = PACKAGE) -> bytes:
    """Return python.zip. The same files give the same bytes.

    Args:
        package: the folder of the package motorcade.
    """
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for file in sorted({*reached_modules(package), *_data_files(package)}):
            info = zipfile.ZipInfo((Path("motorcade") / file.relative_to(package)).as_posix(), _TIME)
            info.external_attr = 0o644 << 16
            # The same on every system.
            info.create_system = 3
            archive.writestr(info, file.read_bytes(), zipfile.ZIP_DEFLATED, 9)
    return packed.getvalue()


def reached_modules(package: Path = PACKAGE) -> set[Path]:
    """Return the files of the modules that the shell in the browser reaches by imports, its own files included.

    An import inside a function counts; one for the type checker doesn't.
    """
    reached: set[Path] = set()
    waiting = [package / name for name in SHELL]
    while waiting:
        file = waiting.pop()
        if file in reached:
            continue
        reached.add(file)
        waiting += (folder / "__init__.py" for folder in file.parents if folder.is_relative_to(package))
        for name in _imported(ast.parse(file.read_bytes())):
            path = package.joinpath(*name.split(".")[1:])
            waiting += [each for each in (path.with_suffix(".py"), path / "__init__.py") if each.is_file()]
    return reached


def _imported(tree: ast.AST) -> Iterator[str]:
    """Yield what a file imports of the package: names of modules, and of what may be a module."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "MYPY"):
            continue
        if isinstance(node, ast.ImportFrom):
            names = [str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            names = []
        yield from (name for name in names if name.startswith("motorcade."))
        yield from _imported(node)


def _data_files(package: Path) -> Iterator[Path]:
    """Yield the data of the packages that are reached: files beside their modules, and folders without modules."""
    for folder in {file.parent for file in reached_modules(package)}:
        for path in folder.iterdir():
            # Python's caches of this computer, and machine code, which no browser runs.
            if path.name in ("__pycache__", "libraries"):
                continue
            if path.is_file():
                files = [path]
            else:
                files = [] if any(path.rglob("*.py")) else [each for each in path.rglob("*") if each.is_file()]
            yield from (each for each in files if each.name not in _LEFT_OUT and each.suffix not in (".py", ".pyc"))
