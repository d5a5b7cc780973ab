"""The line that uploads come by, read without waiting: the USB cable or a UART.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Mapping
    from typing import Any

from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import SILENCE_MS

# Bytes a call. An ESP32's line holds 260 bytes and loses the others. An RP2040 takes about 0.1 ms for a byte, and its
# sender waits.
_MAX_BYTES = {"esp32": 160, "rp2": 32}
# Of a UART fewer, since its buffer holds the rest.
_MAX_UART_BYTES = 48
# Room for the 2,044 bytes of the largest image: none is lost however long a tick takes.
_BUFFER_BYTES = 2048
_WIRES = {"transmit": "tx", "receive": "rx"}
# What tools that need MicroPython's prompt send: Ctrl-A, -B, -C, -D and carriage return.
_KEYS = b"\x01\x02\x03\x04\r"
_CTRL_C = 3
# The third byte of a header is its dwell, which has one bit; the fourth is its reserved field.
_DWELL_AT, _RESERVED_AT = 3, 4
_MOST_RESERVED = 3
_IS_DATA = -1


class UploadLine:
    """The car's end of a line that uploads come by. This class has no other end.

    Attributes:
        sender: see `motorcade.car.board.Board`, as answer_requests, needs_rest and work_at_rest.
    """

    sender = 0

    def read(self) -> bytes:
        """Return bytes that are there, a bounded number, ``b""`` for none. Never wait."""
        return b""

    def write(self, data: bytes) -> None:
        """Send ``data``; it is lost where nobody is connected."""

    def answer_requests(self, answer: "Callable[[bytes], bytes]") -> bool:
        """Answer requests that came beside the line."""
        return False

    def needs_rest(self) -> bool:
        """Return whether work waits that takes long."""
        return False

    def work_at_rest(self) -> None:
        """Do some of that work."""

    def close(self) -> None:
        """Close the line."""


class UsbLine(UploadLine):
    """The USB line of MicroPython's prompt; while a car runs, it carries uploads.

    Ctrl-C is an ordinary byte then: it may be a number of words in a header, as other keys of the prompt may be its
    dwell. The car ends, so that a tool gets the prompt, where nothing but such keys came since the last silence, one of
    them Ctrl-C, and they are no upload: the third or the fourth can't stand there in a header, or another silence
    follows. The words of each upload hold other bytes, and what comes after a silence doesn't belong to it.

    Args:
        modules: MicroPython's, `motorcade.boards.on_chip.power_on.Modules`.
    """

    def __init__(self, modules: "Any") -> None:
        self._clock = modules.clock
        self._interrupts = modules.micropython
        self._stdin = modules.stdin
        self._stdout = modules.stdout
        self._poll = modules.poll
        self._byte = bytearray(1)
        self._buffer = bytearray(_MAX_BYTES[modules.platform])
        # A slice of it copies nothing.
        self._view = memoryview(self._buffer)
        self._last_byte_ms = self._clock.ticks_ms()
        # How many keys came since the last silence; _IS_DATA after another byte.
        self._keys = 0
        # Whether one of them was Ctrl-C, and whether they are no header.
        self._has_ctrl_c = False
        self._is_no_header = False
        self._interrupts.kbd_intr(-1)

    def read(self) -> bytes:
        """See UploadLine. Raises KeyboardInterrupt where a tool asks for the prompt."""
        poll, read = self._poll.ipoll, self._stdin.readinto
        byte, buffer = self._byte, self._buffer
        count = 0
        for place in range(len(buffer)):
            for _ in poll(0):
                # One byte at a time: reading more would block.
                read(byte)
                break
            else:
                break
            buffer[place] = byte[0]
            count = place + 1
            if self._keys != _IS_DATA:
                self._check_key(byte[0])
        if count:
            self._last_byte_ms = self._clock.ticks_ms()
            return bytes(self._view[:count])
        if self._keys and elapsed_ms(self._clock.ticks_ms(), self._last_byte_ms) >= SILENCE_MS:
            self._end_by_silence()
        return b""

    def write(self, data: bytes) -> None:
        self._stdout.write(data)

    def close(self) -> None:
        """Make Ctrl-C interrupt programs again."""
        self._interrupts.kbd_intr(3)

    def _check_key(self, byte: int) -> None:
        if byte not in _KEYS:
            self._keys = _IS_DATA
            return
        self._keys += 1
        if byte == _CTRL_C:
            self._has_ctrl_c = True
        if self._keys == _DWELL_AT:
            self._is_no_header = byte & (byte - 1) != 0
        elif self._keys == _RESERVED_AT and byte > _MOST_RESERVED:
            self._is_no_header = True
        if self._is_no_header and self._has_ctrl_c:
            raise KeyboardInterrupt

    def _end_by_silence(self) -> None:
        asks_for_prompt = self._has_ctrl_c and self._keys != _IS_DATA
        self._keys = 0
        self._has_ctrl_c = self._is_no_header = False
        if asks_for_prompt:
            raise KeyboardInterrupt


class UartLine(UploadLine):
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
        # Without a number an RP2040 reads until the line is silent.
        count = min(self._uart.any(), _MAX_UART_BYTES)
        return self._uart.read(count) or b"" if count else b""

    def write(self, data: bytes) -> None:
        self._uart.write(data)
