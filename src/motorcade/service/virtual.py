"""The server's own virtual car: a leader to upload to where there is none."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from motorcade.boards.computer import ImageStore, StoreError, simulated_car
from motorcade.boards.lines import LineError, PseudoTerminal, TcpPort
from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError
from motorcade.service.errors import StudioError

VIRTUAL = "virtual"


class VirtualCar:
    """A car that keeps its image in the file ``store``, and is awake only while somebody talks to it."""

    def __init__(self, store: Path):
        self._store = store
        self._taken = threading.Lock()

    @contextmanager
    def at_a_port(self, profile: Profile) -> Iterator[str]:
        """The car at a port of its own until the context is left. Raises MotorcadeError, StudioError."""
        if not self._taken.acquire(blocking=False):
            raise MotorcadeError("car-busy", port=VIRTUAL, holds="")
        try:
            # A pseudo-terminal is nobody's but ours, while every user of this computer may come to a TCP port.
            line = TcpPort("127.0.0.1", 0) if sys.platform == "win32" else PseudoTerminal()
            try:
                with simulated_car(line, ImageStore(self._store), profile):
                    yield line.address
            finally:
                line.close()
        except (StoreError, LineError):
            raise StudioError("virtual-car", 500, path=self._store) from None
        finally:
            self._taken.release()
