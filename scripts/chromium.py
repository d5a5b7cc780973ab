"""Find a Chromium on this machine, or install Debian's; run as a script, print its path.

The browser tests, the benchmarks of pages and `scripts/screenshots.py` use it.
"""

import os
import shutil
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))
from scripts import debian

CHOICE = "MOTORCADE_CHROMIUM"
HOW_TO = f"install Chromium or Chrome (on Debian: apt-get install chromium fonts-noto-cjk), or name one in {CHOICE}"
_COMMANDS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
_MAC_PLACES = (
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)
_WINDOWS_PLACES = (r"Google\Chrome\Application\chrome.exe", r"Chromium\Application\chrome.exe")
_WINDOWS_ROOTS = ("PROGRAMFILES", "PROGRAMFILES(X86)", "LOCALAPPDATA")
_WITHOUT_WINDOWS = "chromium-headless-shell"


def find() -> Path | None:
    """Return the browser that MOTORCADE_CHROMIUM names, or one from the system's usual places; None for none."""
    chosen = os.environ.get(CHOICE)
    if chosen:
        return Path(chosen)
    on_path = (shutil.which(command) for command in _COMMANDS)
    roots = (os.environ[name] for name in _WINDOWS_ROOTS if name in os.environ)
    on_windows = (str(Path(root) / place) for root in roots for place in _WINDOWS_PLACES)
    places = (*(path for path in on_path if path), *_MAC_PLACES, *on_windows)
    return next((Path(place) for place in places if Path(place).is_file()), None)


def find_or_install() -> Path | None:
    """Return a browser, None for none; install Debian's first where there is none (see debian.install)."""
    found = find()
    if found is None:
        debian.install("chromium", debian.CHINESE)
        found = find()
    return found


def find_or_install_for_tests() -> Path | None:
    """Return Debian's Chromium without windows, which opens a page with half the work; else as `find_or_install`."""
    if CHOICE in os.environ:
        return find()
    return debian.find_or_install(_WITHOUT_WINDOWS, *debian.FOR_TESTS[_WITHOUT_WINDOWS]) or find_or_install()


if __name__ == "__main__":
    path = find_or_install()
    print(path or f"No browser was found: {HOW_TO}.")
    sys.exit(path is None)
