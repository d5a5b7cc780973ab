"""pyserial's ``chip://``: the UART of an emulated chip. Time passes only while somebody waits for bytes."""

from typing import Any

from serial.serialutil import SerialBase

from support.emulated_chips import Chip, World

# The chip at the other end.
plugged: list[tuple[World, Chip]] = []


class Serial(SerialBase):
    """A port at the chip that is plugged in."""

    def open(self) -> None:
        """Open the port."""
        self._came = bytearray()
        self.is_open = True

    def close(self) -> None:
        """Close the port."""
        self.is_open = False

    def _reconfigure_port(self) -> None:
        pass

    def _update_dtr_state(self) -> None:
        pass

    _update_rts_state = _update_dtr_state

    @property
    def in_waiting(self) -> int:
        """How many bytes came."""
        return len(self._came)

    def read(self, size: int = 1) -> bytes:
        """Return what came; wait for at most the timeout."""
        world, chip = plugged[-1]
        waited_ms = 0
        assert self.timeout is not None
        while not self._came and waited_ms < self.timeout * 1000:
            world.run(1)
            waited_ms += 1
            self._came += chip.received()
        data = bytes(self._came[:size])
        del self._came[:size]
        return data

    def write(self, data: Any) -> int:
        """Send bytes."""
        plugged[-1][1].send(data)
        return len(data)

    def flush(self) -> None:
        """Let the bytes leave."""
        world, chip = plugged[-1]
        while chip.unsent:
            world.run(1)
            self._came += chip.received()
