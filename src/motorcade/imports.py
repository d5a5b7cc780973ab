"""Which of Motorcade's files a file needs: read from the imports in their sources, without running any of them.

A chip, the site, and the digest of the engine have what this finds, so a new file needs no list.
"""

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

PACKAGE = Path(__file__).parent
# The names of what is true only for a type checker.
FOR_TYPES = ("TYPE_CHECKING", "MYPY")
# Only these hold imports: to look into expressions would take most of the time.
_STATEMENTS = (ast.stmt, ast.excepthandler, ast.match_case)


def needed_files(
    starts: Iterable[Path], package: Path = PACKAGE, *, lazily: bool = True, within: tuple[str, ...] = ()
) -> set[Path]:
    """Return these files, what they import of the package, what that imports, and so on.

    Imports for a type checker alone don't count. The ``__init__.py`` of a needed file's folders is needed too.

    Args:
        starts: Python files, in the package or elsewhere.
        package: the folder of the package motorcade.
        lazily: whether imports inside functions count.
        within: the folders and modules of the package into which imports are followed; empty for all.
    """
    needed: set[Path] = set()
    waiting = list(starts)
    while waiting:
        file = waiting.pop()
        if file in needed:
            continue
        needed.add(file)
        # A folder of data in the package has none.
        inits = [folder / "__init__.py" for folder in file.parents if folder.is_relative_to(package)]
        waiting += [init for init in inits if init.is_file()]
        for name in _imported(ast.parse(file.read_bytes()), lazily):
            parts = name.split(".")[1:]
            if within and parts[0] not in within and ".".join(parts) not in within:
                continue
            path = package.joinpath(*parts)
            waiting += [found for found in (path.with_suffix(".py"), path / "__init__.py") if found.is_file()]
    return needed


def _imported(tree: ast.AST, lazily: bool) -> Iterator[str]:
    """Yield what a file imports of the package: names of modules, and of what may be a module."""
    for node in ast.iter_child_nodes(tree):
        if not isinstance(node, _STATEMENTS):
            continue
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id in FOR_TYPES:
            continue
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and not lazily:
            continue
        names: list[str] = []
        if isinstance(node, ast.ImportFrom):
            names = [str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        yield from (name for name in names if name.startswith("motorcade."))
        yield from _imported(node, lazily)
