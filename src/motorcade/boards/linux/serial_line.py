"""A serial port as a car sees it: it is read without waiting, and may go away and come back."""

import contextlib
import time
from collections.abc import Callable

import serial

_RETRY_S = 1.0


class SerialLine:
    """A port of a car, such as a UART, a USB gadget's or a voice module's.

    Args:
        open_port: opens the port with a read timeout of 0. Raises serial.SerialException where it isn't there.
        clock_s: a clock in seconds. A port that went away, as a USB cable does, is opened anew once a second.

    Raises:
        serial.SerialException: the port isn't there at the start.
    """

    def __init__(self, open_port: Callable[[], serial.Serial], clock_s: Callable[[], float]) -> None:
        self._open_port = open_port
        self._clock_s = clock_s
        self._tried_s = clock_s()
        self._port: serial.Serial | None = open_port()

    def wait(self, seconds: float) -> None:
        """Until ``seconds`` have gone: a car's tick is shorter than any that would wake it."""
        time.sleep(seconds)

    def read(self) -> bytes:
        """The bytes that are there, ``b""`` where none are or the port is away."""
        port = self._present()
        if port is None:
            return b""
        try:
            return bytes(port.read(port.in_waiting or 1))
        except (serial.SerialException, OSError):
            self._lose()
            return b""

    def write(self, data: bytes) -> None:
        """Send ``data``; lost where the port is away or nobody takes it."""
        port = self._present()
        if port is None:
            return
        try:
            port.write(data)
        except serial.SerialTimeoutException:
            return
        except (serial.SerialException, OSError):
            self._lose()

    def close(self) -> None:
        """Give the port up."""
        if self._port is not None:
            self._port.close()

    def _present(self) -> serial.Serial | None:
        now_s = self._clock_s()
        if self._port is None and now_s - self._tried_s >= _RETRY_S:
            self._tried_s = now_s
            with contextlib.suppress(serial.SerialException, OSError):
                self._port = self._open_port()
        return self._port

    def _lose(self) -> None:
        if self._port is not None:
            with contextlib.suppress(serial.SerialException, OSError):
                self._port.close()
        self._port = None
        self._tried_s = self._clock_s()
