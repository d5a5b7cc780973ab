"""A simulated serial port of this computer, at whose end a test's car or another device is; POSIX only."""

import os
import select

from motorcade.boards.lines import WaitingLine


class PseudoTerminal(WaitingLine):
    """A pseudo-terminal. ``address`` is its device's path."""

    def __init__(self) -> None:
        import pty
        import tty

        # The car keeps the client's end open too: without it the line would hang up with each client that leaves.
        self._car_end, self._client_end = pty.openpty()
        tty.setraw(self._client_end)
        os.set_blocking(self._car_end, False)
        self.address = os.ttyname(self._client_end)

    def wait(self, seconds: float) -> None:
        select.select([self._car_end], [], [], seconds)

    def read(self) -> bytes:
        try:
            return os.read(self._car_end, 4096)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        os.write(self._car_end, data)

    def close(self) -> None:
        os.close(self._car_end)
        os.close(self._client_end)
