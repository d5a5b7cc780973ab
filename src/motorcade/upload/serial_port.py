"""Serial ports: moves the bytes of `motorcade.words.upload` and says in a sentence what went wrong.

A port is a device such as ``/dev/ttyUSB0`` or ``COM3``, or one of pyserial's
URLs, such as ``socket://127.0.0.1:7000`` for a virtual car.
"""

import errno
import secrets
import time
from collections.abc import Callable

import serial

try:
    from termios import error as TerminalError  # noqa: N812 - named as an error is
except ImportError:  # Windows
    TerminalError = OSError  # type: ignore[assignment, misc]

from motorcade.upload.failures import (
    NoAnswerError,
    PortBusyError,
    PortError,
    PortForbiddenError,
    PortNotFoundError,
    WentAwayError,
    readback_failure,
    upload_failure,
)
from motorcade.upload.ports import group_of
from motorcade.upload.transfer import OLD, ReadbackTransfer, Retry, Transfer, UploadTransfer
from motorcade.words.ticks import TICKS_MASK
from motorcade.words.upload import Outcome

_READ_TIMEOUT_S = 0.02
_WRITE_TIMEOUT_S = 5


def upload(
    port: str,
    image: bytes,
    baud: int,
    verify: bool = True,
    progress: Callable[[int], None] = lambda sent_bytes: None,
    retrying: Callable[[Retry], None] = lambda retry: None,
) -> str:
    """Send ``image`` to the car at ``port`` until the car says that it holds it.

    Args:
        progress: called with the number of bytes sent so far.
        retrying: called before each further try (`motorcade.upload.transfer`).
        verify: wait for the car's answer; without it the image is sent, not verified.

    Returns:
        The car's answer, or 'sent, not verified'.

    Raises:
        PortNotFoundError, PortBusyError, PortForbiddenError, NoAnswerError,
        RefusedError, VerificationError, WentAwayError: each says what the car holds.
    """
    talk = UploadTransfer(image, baud, verify, secrets.randbelow(256), progress, retrying)
    outcome = _held(talk, port, baud)
    if failure := upload_failure(port, outcome, talk.holds):
        raise failure
    return str(outcome.detail)


def readback(port: str, baud: int, retrying: Callable[[Retry], None] = lambda retry: None) -> bytes:
    """The image that the car at ``port`` holds.

    Raises:
        PortNotFoundError, PortBusyError, PortForbiddenError, NoAnswerError, VerificationError, WentAwayError
    """
    outcome = _held(ReadbackTransfer(baud, retrying), port, baud)
    if failure := readback_failure(port, outcome):
        raise failure
    image: bytes = outcome.detail
    return image


def _held(talk: Transfer, port: str, baud: int) -> Outcome:
    """The outcome of ``talk`` through ``port``."""
    with _open(port, baud) as line:
        try:
            data = b""
            while True:
                message = talk.step(data, _now_ms())
                if talk.outcome is not None:
                    return talk.outcome
                if message:
                    line.write(message)
                    _drain(line)
                data = line.read(max(1, line.in_waiting))
        except (serial.SerialException, OSError) as problem:
            raise _gone(port, problem, talk.holds) from None


def _drain(line: serial.Serial) -> None:
    """Wait until the bytes have left, so that progress and the answer's deadline are the line's, not the buffer's."""
    try:
        line.flush()
    except TerminalError as problem:
        raise serial.SerialException(str(problem)) from None


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
        raise not_opened(port, problem) from None
    except TerminalError as problem:
        raise _gone(port, problem, OLD) from None


def not_opened(port: str, problem: Exception) -> PortError:
    """The sentence for a port that didn't open; pyserial tells some cases apart in its text only."""
    code, text = getattr(problem, "errno", None), str(problem)
    if code in (errno.EACCES, errno.EPERM) and "denied" in text and "PermissionError" not in text:
        return PortForbiddenError("port-forbidden", port=port, group=group_of(port))
    if code in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text or "PermissionError" in text:
        return PortBusyError("port-busy", port=port)
    if code in (errno.ENOTTY, errno.EISDIR) or "Inappropriate ioctl" in text:
        return PortNotFoundError("no-serial-port", port=port)
    return PortNotFoundError("no-such-port", port=port)


def _gone(port: str, problem: Exception, holds: str) -> PortError:
    if isinstance(problem, serial.SerialTimeoutException):
        return NoAnswerError("takes-no-bytes", port=port, holds=holds)
    return WentAwayError("went-away", port=port, holds=holds)


def _now_ms() -> int:
    return int(time.monotonic() * 1000) & TICKS_MASK
