"""Serial ports: moves the bytes of `motorcade.words.upload` and says in a sentence what went wrong.

A port is a device such as ``/dev/ttyUSB0`` or ``COM3``, or one of pyserial's
URLs, such as ``socket://127.0.0.1:7000`` for a virtual car.
"""

import errno
import time
from collections.abc import Callable
from typing import NamedTuple

import serial
from serial.tools import list_ports

try:
    from termios import error as TerminalError  # noqa: N812 - named as an error is
except ImportError:  # Windows
    TerminalError = OSError  # type: ignore[assignment, misc]

from motorcade.link.failures import (
    NoAnswerError,
    PortBusyError,
    PortError,
    PortNotFoundError,
    readback_failure,
    upload_failure,
)
from motorcade.words.upload import NOT_VERIFIED, READBACK_REQUEST, SILENCE_MS, Outcome, ReadbackEnd, UploaderEnd

_CHUNK_BYTES = 64
_READ_TIMEOUT_S = 0.02
_WRITE_TIMEOUT_S = 5
_SETTLE_S = SILENCE_MS / 1000 + 0.1
_LONGEST_SETTLE_S = 3.0


class PortInfo(NamedTuple):
    """A serial port of this computer."""

    device: str
    description: str
    hardware: str


def ports() -> list[PortInfo]:
    """The serial ports that are there now."""
    return [PortInfo(each.device, each.description or "", each.hwid or "") for each in sorted(list_ports.comports())]


def upload(
    port: str,
    image: bytes,
    baud: int,
    verify: bool = True,
    progress: Callable[[int], None] = lambda sent_bytes: None,
) -> str:
    """Send ``image`` to the car at ``port`` and compare its answer.

    Args:
        progress: called with the number of bytes sent so far.
        verify: wait for the car's answer; without it the image is sent, not verified.

    Returns:
        The car's answer, or 'sent, not verified'.

    Raises:
        PortNotFoundError, PortBusyError, NoAnswerError, VerificationError
    """
    end = UploaderEnd(image, verify)
    with _open(port, baud) as line:
        try:
            _settle(line)
            for begin in range(0, len(image), _CHUNK_BYTES):
                line.write(image[begin : begin + _CHUNK_BYTES])
                _drain(line)
                progress(min(begin + _CHUNK_BYTES, len(image)))
            end.finish_sending(_now_ms())
            outcome = _outcome(line, end)
        except (serial.SerialException, OSError) as problem:
            raise _gone(port, problem) from None
    if failure := upload_failure(port, outcome.kind, outcome.detail):
        raise failure
    return outcome.detail if outcome.kind != NOT_VERIFIED else "sent, not verified"


def readback(port: str, baud: int) -> bytes:
    """The image that the car at ``port`` holds.

    Raises:
        PortNotFoundError, PortBusyError, NoAnswerError, VerificationError
    """
    with _open(port, baud) as line:
        try:
            _settle(line)
            line.write(READBACK_REQUEST)
            outcome = _outcome(line, ReadbackEnd(_now_ms()))
        except (serial.SerialException, OSError) as problem:
            raise _gone(port, problem) from None
    if failure := readback_failure(port, outcome.kind, outcome.detail):
        raise failure
    image: bytes = outcome.detail
    return image


def _drain(line: serial.Serial) -> None:
    """Wait until the bytes have left, so that progress and the answer's deadline are the line's, not the buffer's."""
    try:
        line.flush()
    except TerminalError as problem:
        raise serial.SerialException(str(problem)) from None


def _settle(line: serial.Serial) -> None:
    """Wait until the car has forgotten whatever reached it before, and told so.

    Bytes of an upload that broke off would else become the beginning of this one.
    """
    begin_s = quiet_since_s = time.monotonic()
    while (now_s := time.monotonic()) - quiet_since_s < _SETTLE_S and now_s - begin_s < _LONGEST_SETTLE_S:
        if line.read(max(1, line.in_waiting)):
            quiet_since_s = now_s


def _outcome(line: serial.Serial, end: UploaderEnd | ReadbackEnd) -> Outcome:
    outcome: Outcome | None = end.next_event()
    while outcome is None:
        end.receive_data(line.read(max(1, line.in_waiting)), _now_ms())
        outcome = end.next_event()
    return outcome


def _open(port: str, baud: int) -> serial.Serial:
    if not port.strip():
        raise PortNotFoundError("no-port-named")
    try:
        return serial.serial_for_url(
            port, baudrate=baud, timeout=_READ_TIMEOUT_S, write_timeout=_WRITE_TIMEOUT_S, exclusive=True
        )
    except ValueError:
        raise PortNotFoundError("not-a-port-name", port=port) from None
    except (serial.SerialException, OSError) as problem:
        raise _not_opened(port, problem) from None
    except TerminalError as problem:
        raise _gone(port, problem) from None


def _not_opened(port: str, problem: Exception) -> PortError:
    """The sentence for a port that didn't open; pyserial tells some cases apart in its text only."""
    code, text = getattr(problem, "errno", None), str(problem)
    if code in (errno.EACCES, errno.EPERM) and "denied" in text and "PermissionError" not in text:
        return PortBusyError("port-forbidden", port=port)
    if code in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text or "PermissionError" in text:
        return PortBusyError("port-busy", port=port)
    if code in (errno.ENOTTY, errno.EISDIR) or "Inappropriate ioctl" in text:
        return PortNotFoundError("no-serial-port", port=port)
    return PortNotFoundError("no-such-port", port=port)


def _gone(port: str, problem: Exception) -> PortError:
    if isinstance(problem, serial.SerialTimeoutException):
        return NoAnswerError("takes-no-bytes", port=port)
    return NoAnswerError("went-away", port=port)


def _now_ms() -> int:
    return int(time.monotonic() * 1000)
