"""The line that uploads come by: the USB cable or a UART, read without waiting.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Mapping
    from typing import Any

from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import SILENCE_MS

_MOST_BYTES = 256
# The largest image's 2,044 bytes have room: none is lost however long a tick takes.
_BUFFER_BYTES = 2048
_WIRES = {"transmit": "tx", "receive": "rx"}
# What tools that want MicroPython's prompt send: Ctrl-C, often behind a carriage return.
_CTRL_C = b"\x03"
_KNOCKS = (_CTRL_C, b"\r")
_KNOCK_LENGTH = 3


class UsbLine:
    """The line that MicroPython's own prompt is at; while a car runs, it carries uploads.

    Ctrl-C is a byte like any other then. But three bytes of Ctrl-C and carriage return behind a silence are no image's
    beginning (the third would be its dwell, with more than one bit set). They end the car, so that Thonny, mpremote
    and `motorcade install-firmware` find the prompt.

    Args:
        clock: MicroPython's time module.
        interrupts: MicroPython's module micropython.
        stdin, stdout: MicroPython's byte streams ``sys.stdin.buffer`` and ``sys.stdout.buffer``.
        poll: says with ``poll.poll(0)`` whether ``stdin`` has a byte.
    """

    def __init__(self, clock: "Any", interrupts: "Any", stdin: "Any", stdout: "Any", poll: "Any") -> None:
        self._clock = clock
        self._interrupts = interrupts
        self._stdin = stdin
        self._stdout = stdout
        self._poll = poll
        self._last_byte_ms = clock.ticks_ms()
        self._knocks: list[bytes] | None = []
        interrupts.kbd_intr(-1)

    def read(self) -> bytes:
        """The bytes that are there, at most 256. Raises KeyboardInterrupt where somebody wants the prompt."""
        data = b""
        while len(data) < _MOST_BYTES and self._poll.poll(0):
            # One byte at a time: reading more would wait for them.
            byte = self._stdin.read(1)
            if not byte:
                break
            self._listen_for_knocks(byte)
            data += byte
        return data

    def write(self, data: bytes) -> None:
        """Send ``data``."""
        self._stdout.write(data)

    def close(self) -> None:
        """Give Ctrl-C back to the prompt."""
        self._interrupts.kbd_intr(3)

    def _listen_for_knocks(self, byte: bytes) -> None:
        now_ms = self._clock.ticks_ms()
        if elapsed_ms(now_ms, self._last_byte_ms) >= SILENCE_MS:
            self._knocks = []
        self._last_byte_ms = now_ms
        if self._knocks is None:
            return
        self._knocks.append(byte)
        if byte not in _KNOCKS:
            self._knocks = None
        elif len(self._knocks) == _KNOCK_LENGTH:
            if _CTRL_C in self._knocks:
                raise KeyboardInterrupt
            self._knocks = None


class UartLine:
    """A UART of its own.

    Args:
        machine: MicroPython's module.
        uart: which UART.
        pins: ``transmit`` and ``receive``, GPIO numbers; a voice module has ``receive`` alone.
        baud: always 8 data bits, no parity, 1 stop bit.
    """

    def __init__(self, machine: "Any", uart: int, pins: "Mapping[str, int]", baud: int) -> None:
        wires = {_WIRES[key]: machine.Pin(pin) for key, pin in pins.items()}
        self._uart = machine.UART(uart, baudrate=baud, rxbuf=_BUFFER_BYTES, **wires)

    def read(self) -> bytes:
        """The bytes that are there."""
        return self._uart.read() or b""

    def write(self, data: bytes) -> None:
        """Send ``data``."""
        self._uart.write(data)

    def close(self) -> None:
        """Nothing to give back."""
