"""The service can be imported in a browser, which has few modules; `tests/site/test_python_zip.py` imports it so."""

import ast
from pathlib import Path

import pytest

import motorcade.service

FILES = sorted(Path(motorcade.service.__file__).parent.glob("*.py"))
# Threads, event loops, clocks, files and ports are the shell's.
NOT_HERE = {"asyncio", "multiprocessing", "os", "pathlib", "select", "socket", "tempfile", "threading", "time"}
# Of these a browser's Python has none, or not at once.
NOT_HERE |= {"anyio", "matplotlib", "numba", "numpy", "serial", "starlette", "uvicorn", "websockets"}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_module_uses_no_thread_clock_file_port_or_web_framework(file: Path) -> None:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        assert not {name.partition(".")[0] for name in names} & NOT_HERE
