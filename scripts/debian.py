"""Find programs that tests run and pip can't install, or install them from Debian.

Run as a script, install all that `make test` needs and that is missing, in one go.
"""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

# Whoever installs holds this lock, so that tests in several processes install nothing twice.
LOCK = Path(tempfile.gettempdir()) / "motorcade-tests.lock"
# Pages are in Chinese too, and a Debian without a desktop has no Chinese font.
CHINESE = "fonts-noto-cjk"
# The programs that `make test` runs, and the packages that bring them.
FOR_TESTS = {
    "chromium-headless-shell": ("chromium-headless-shell", CHINESE),
    "WebKitWebDriver": ("webkit2gtk-driver", "xvfb", CHINESE),
    "gcc": ("gcc", "libc6-dev"),
    "g++": ("g++",),
    "avr-gcc": ("gcc", "libc6-dev", "gcc-avr", "avr-libc", "arduino-core-avr", "libsimavr-dev"),
    "simavr": ("simavr",),
    "tshark": ("tshark",),
}

_QUIET: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "check": False}
_SILENT: dict[str, Any] = {**_QUIET, "stderr": subprocess.DEVNULL}


def find_or_install(command: str, *packages: str) -> Path | None:
    """Return the path of the program ``command``, None for none; install ``packages`` first where it is missing."""
    found = shutil.which(command)
    if found is None:
        install(*packages)
        found = shutil.which(command)
    return Path(found) if found else None


def install(*packages: str) -> None:
    """Install Debian's ``packages``; do nothing where this user isn't root or there is no apt-get."""
    if not (hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get")):
        return
    # Packages must ask no questions, and another test may be installing at the same time: wait for its lock.
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    apt_get = ["apt-get", "--quiet=2", "--option", "DPkg::Lock::Timeout=300"]
    for command in (["update"], ["install", "--yes", "--no-install-recommends", *packages]):
        subprocess.run([*apt_get, *command], env=environment, **_QUIET)


def unpack(folder: Path, *packages: str) -> bool:
    """Unpack Debian's ``packages`` into ``folder``, and say whether that worked; root isn't needed.

    For servers: installed, they would start with the computer.
    """
    if not (shutil.which("apt-get") and shutil.which("dpkg-deb")):
        return False
    for package in packages:
        fetched = subprocess.run(["apt-get", "--quiet=2", "download", package], cwd=folder, **_SILENT)
        files = list(folder.glob(f"{package}_*.deb"))
        if fetched.returncode or not files:
            return False
        subprocess.run(["dpkg-deb", "--extract", files[0], folder], **{**_SILENT, "check": True})
    return True


def main() -> None:
    """Install what is missing of `FOR_TESTS`."""
    from filelock import FileLock

    with FileLock(LOCK):
        missing = {package for command in FOR_TESTS if not shutil.which(command) for package in FOR_TESTS[command]}
        if missing:
            install(*sorted(missing))


if __name__ == "__main__":
    main()
