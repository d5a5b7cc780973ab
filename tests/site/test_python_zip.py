"""python.zip has what the worker imports, its data, and nothing else."""

import io
import os
import subprocess
import sys
import zipfile

import pytest

from motorcade.browser.site import SHELL, python_zip, reached_modules

# A package in which the shell reaches a module by each kind of import, and three that it doesn't reach.
SOURCES = {
    "__init__.py": "",
    "browser/__init__.py": "",
    "browser/preload.py": "",
    "browser/site.py": "from motorcade import unreached",
    "browser/shell.py": "from motorcade.near import thing\nimport motorcade.deep.plain\n",
    "near.py": "def f():\n    from motorcade.deep import late\n",
    "deep/__init__.py": "",
    "deep/plain.py": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from motorcade import for_types\n",
    "deep/late.py": "try:\n    import motorcade.tried\nexcept ImportError:\n    pass\n",
    "tried.py": "",
    "for_types.py": "",
    "unreached.py": "",
    "elsewhere/__init__.py": "",
    "deep/texts/en.json": "{}",
    "deep/__pycache__/kernel.nbc": "",
    "elsewhere/texts/en.json": "{}",
}
NOT_REACHED = {"browser/site.py", "for_types.py", "unreached.py", "elsewhere/__init__.py"}


@pytest.fixture
def package(tmp_path):
    for name, text in SOURCES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def test_modules_are_found_by_imports(package):
    found = {path.relative_to(package).as_posix() for path in reached_modules(package)}
    assert found == {name for name in SOURCES if name.endswith(".py")} - NOT_REACHED


def test_data_comes_with_the_package_that_has_it(package):
    with zipfile.ZipFile(io.BytesIO(python_zip(package))) as archive:
        names = {name.removeprefix("motorcade/") for name in archive.namelist()}
    assert names == set(SOURCES) - NOT_REACHED - {"elsewhere/texts/en.json", "deep/__pycache__/kernel.nbc"}


def test_it_is_enough_for_the_shell(tmp_path):
    """The shell's modules are imported from it alone, where nothing that only a server needs can be imported."""
    with zipfile.ZipFile(io.BytesIO(python_zip())) as archive:
        archive.extractall(tmp_path)
    program = f"""
import sys
for name in ("numpy", "numba", "starlette", "psutil", "wasmtime", "serial"):
    sys.modules[name] = None
import importlib, motorcade
assert motorcade.__file__.startswith({str(tmp_path)!r}), motorcade.__file__
for name in {SHELL!r}:
    importlib.import_module("motorcade." + name.removesuffix(".py").replace("/", "."))
"""
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
