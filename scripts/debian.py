"""Find programs that tests run and pip can't install, or install them from Debian."""

import os
import shutil
import subprocess
from pathlib import Path

_QUIET = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "check": False}


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
