"""The computer's own watchdog, which restarts it where its programs hang; source: the kernel's watchdog-api."""

import os
from pathlib import Path

from motorcade.boards.linux.errors import WatchdogError

_FED = b"\0"
# What says that nobody will feed it any more, on purpose.
_FAREWELL = b"V"


class HardwareWatchdog:
    """Bites unless it is fed: the computer restarts, and its pins are as at power-on.

    Args:
        path: the watchdog's device; it is armed from now on.

    Raises:
        WatchdogError: it isn't there, another program has it, or this user may not use it.
    """

    def __init__(self, path: Path = Path("/dev/watchdog")) -> None:
        try:
            self._device = os.open(path, os.O_WRONLY)
        except OSError as problem:
            raise WatchdogError(
                f"The watchdog {path} can't be used: {problem.strerror}. Only one program may have it, "
                "and as a rule it has to run as root"
            ) from None

    def feed(self) -> None:
        """All is well; due again within some 15 s, the kernel's usual patience."""
        os.write(self._device, _FED)

    def close(self) -> None:
        """Disarm it."""
        os.write(self._device, _FAREWELL)
        os.close(self._device)
