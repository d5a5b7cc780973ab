"""The line that uploads come by, read without waiting: the USB cable or a UART.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Mapping
    from typing import Any

from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import SILENCE_MS

_MAX_BYTES = 256
# Room for the 2,044 bytes of the largest image: none is lost however long a tick takes.
_BUFFER_BYTES = 2048
_WIRES = {"transmit": "tx", "receive": "rx"}
# Tools that need MicroPython's prompt send Ctrl-C, often after a carriage return.
_CTRL_C = b"\x03"
_INTERRUPT_BYTES = (_CTRL_C, b"\r")
_INTERRUPT_LENGTH = 3


class UsbLine:
    """The USB line of MicroPython's prompt; while a car runs, it carries uploads.

    Ctrl-C is an ordinary byte then. But three bytes of Ctrl-C and carriage return after a silence can't begin an image
    (the third would be its dwell, with more than one bit set). They end the car, so that Thonny, mpremote and
    `motorcade install-firmware` get the prompt.

    Args:
        clock: MicroPython's time module.
        interrupts: MicroPython's module micropython.
        stdin, stdout: MicroPython's byte streams ``sys.stdin.buffer`` and ``sys.stdout.buffer``.
        poll: its ``poll(0)`` is true where ``stdin`` has a byte.
    """

    def __init__(self, clock: "Any", interrupts: "Any", stdin: "Any", stdout: "Any", poll: "Any") -> None:
        self._clock = clock
        self._interrupts = interrupts
        self._stdin = stdin
        self._stdout = stdout
        self._poll = poll
        self._last_byte_ms = clock.ticks_ms()
        self._interrupt: list[bytes] | None = []
        interrupts.kbd_intr(-1)

    def read(self) -> bytes:
        """Return the bytes that are there, at most 256. Raises KeyboardInterrupt where a tool asks for the prompt."""
        data = b""
        while len(data) < _MAX_BYTES and self._poll.poll(0):
            # One byte at a time: reading more would block.
            byte = self._stdin.read(1)
            if not byte:
                break
            self._check_interrupt(byte)
            data += byte
        return data

    def write(self, data: bytes) -> None:
        """Send ``data``."""
        self._stdout.write(data)

    def close(self) -> None:
        """Make Ctrl-C interrupt programs again."""
        self._interrupts.kbd_intr(3)

    def _check_interrupt(self, byte: bytes) -> None:
        now_ms = self._clock.ticks_ms()
        if elapsed_ms(now_ms, self._last_byte_ms) >= SILENCE_MS:
            self._interrupt = []
        self._last_byte_ms = now_ms
        if self._interrupt is None:
            return
        self._interrupt.append(byte)
        if byte not in _INTERRUPT_BYTES:
            self._interrupt = None
        elif len(self._interrupt) == _INTERRUPT_LENGTH:
            if _CTRL_C in self._interrupt:
                raise KeyboardInterrupt
            self._interrupt = None


class UartLine:
    """A UART for uploads alone, or for a voice module alone.

    Args:
        machine: MicroPython's module.
        uart: the UART's number.
        pins: ``transmit`` and ``receive``, GPIO numbers; a voice module has ``receive`` alone.
        baud: always 8 data bits, no parity, 1 stop bit.
    """

    def __init__(self, machine: "Any", uart: int, pins: "Mapping[str, int]", baud: int) -> None:
        wires = {_WIRES[key]: machine.Pin(pin) for key, pin in pins.items()}
        self._uart = machine.UART(uart, baudrate=baud, rxbuf=_BUFFER_BYTES, **wires)

    def read(self) -> bytes:
        """Return the bytes that are there."""
        return self._uart.read() or b""

    def write(self, data: bytes) -> None:
        """Send ``data``."""
        self._uart.write(data)

    def close(self) -> None:
        """There is nothing to close."""
