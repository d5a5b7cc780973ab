"""Find programs that tests run and pip can't install, or install them from Debian."""

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

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
