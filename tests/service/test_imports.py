"""The service can be imported in a browser, which has few modules."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import motorcade.service

FILES = sorted(Path(motorcade.service.__file__).parent.glob("*.py"))
# Threads, event loops, clocks, files and ports are the shell's.
SHELLS = {"asyncio", "multiprocessing", "os", "pathlib", "select", "socket", "tempfile", "threading", "time"}
# Of these a browser's Python has none, or not at once.
MISSING = ("anyio", "matplotlib", "numba", "numpy", "serial", "starlette", "uvicorn", "websockets")


def test_every_module_can_be_imported_without_a_web_framework_and_numpy() -> None:
    modules = [f"motorcade.service.{file.stem}" for file in FILES if file.stem != "__init__"]
    code = f"""
import importlib, sys
for name in {(*MISSING, "asyncio")!r}:
    sys.modules[name] = None
for name in {modules!r}:
    importlib.import_module(name)
"""
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_module_uses_no_thread_clock_file_or_port(file: Path) -> None:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        assert not {name.partition(".")[0] for name in names} & {*SHELLS, *MISSING}
