"""Programs that tests run and pip can't install: found on this machine, or installed from Debian."""

import os
import shutil
import subprocess
from pathlib import Path

_QUIET = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "check": False}


def find_or_install(command: str, *packages: str) -> Path | None:
    """The program called ``command``; installed first where it is missing and that can be done, else None."""
    found = shutil.which(command)
    if found is None:
        install(*packages)
        found = shutil.which(command)
    return Path(found) if found else None


def install(*packages: str) -> None:
    """Installs Debian's ``packages`` where that can be done: by root, on Debian and its kin."""
    if not (hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get")):
        return
    # Nobody is there to answer a package's questions, and another test may be installing too.
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    waiting = ["apt-get", "--quiet=2", "--option", "DPkg::Lock::Timeout=300"]
    for command in (["update"], ["install", "--yes", "--no-install-recommends", *packages]):
        subprocess.run([*waiting, *command], env=environment, **_QUIET)
