"""Upload to a car at a serial port, and read back.

A port is a device such as ``/dev/ttyUSB0`` or ``COM3``, or one of pyserial's URLs, such as
``socket://127.0.0.1:7000`` for a simulated car.
"""

import errno
import secrets
from collections.abc import Callable

import serial

try:
    from termios import error as TerminalError  # noqa: N812 - named as an error is
except ImportError:  # Windows
    TerminalError = OSError  # type: ignore[assignment, misc]

from motorcade.errors import MotorcadeError
from motorcade.timing import monotonic_ms
from motorcade.upload.ports import group_of
from motorcade.upload.transfer import (
    OLD,
    ReadbackTransfer,
    Retry,
    Transfer,
    UploadTransfer,
    holds_phrase,
    readback_error,
    upload_error,
)
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
    """Send ``image`` to the car at ``port`` until the car confirms that it holds it.

    Args:
        port: its name or URL.
        image: its bytes.
        baud: bits a second of the line.
        verify: whether to wait for the car's answer; without it the image is sent, not verified.
        progress: called with the number of bytes sent so far.
        retrying: called before each further try.

    Returns:
        The car's answer, or "sent, not verified".

    Raises:
        MotorcadeError: its sentence includes what the car holds.
    """
    transfer = UploadTransfer(image, baud, verify, secrets.randbelow(256), progress, retrying)
    outcome = _run(transfer, port, baud)
    if error := upload_error(port, outcome, transfer.holds):
        raise error
    return str(outcome.detail)


def readback(port: str, baud: int, retrying: Callable[[Retry], None] = lambda retry: None) -> bytes:
    """The image that the car at ``port`` holds. Raises MotorcadeError."""
    outcome = _run(ReadbackTransfer(baud, retrying), port, baud)
    if error := readback_error(port, outcome):
        raise error
    image: bytes = outcome.detail
    return image


def _run(transfer: Transfer, port: str, baud: int) -> Outcome:
    """Run ``transfer`` through ``port``. Returns its outcome."""
    with open_port(port, baud) as line:
        try:
            data = b""
            while True:
                message = transfer.step(data, monotonic_ms())
                if transfer.outcome is not None:
                    return transfer.outcome
                if message:
                    line.write(message)
                    _drain(line)
                data = line.read(max(1, line.in_waiting))
        except (serial.SerialException, OSError) as problem:
            raise _gone(port, problem, transfer.holds) from None


def _drain(line: serial.Serial) -> None:
    """Wait until the bytes are sent, so that progress and the answer's deadline don't depend on a buffer."""
    try:
        line.flush()
    except TerminalError as problem:
        raise serial.SerialException(str(problem)) from None


def open_port(port: str, baud: int) -> serial.Serial:
    """Open a port for this process alone. Raises MotorcadeError."""
    if not port.strip():
        raise MotorcadeError("no-port-named")
    try:
        return serial.serial_for_url(
            port, baudrate=baud, timeout=_READ_TIMEOUT_S, write_timeout=_WRITE_TIMEOUT_S, exclusive=True
        )
    except ValueError:
        raise MotorcadeError("not-a-port-name", port=port) from None
    except (serial.SerialException, OSError) as problem:
        raise open_error(port, problem) from None
    except TerminalError as problem:
        raise _gone(port, problem, OLD) from None


def open_error(port: str, problem: Exception) -> MotorcadeError:
    """The error for a port that can't be opened; pyserial distinguishes some cases in its text only."""
    code, text = getattr(problem, "errno", None), str(problem)
    if code in (errno.EACCES, errno.EPERM) and "denied" in text and "PermissionError" not in text:
        return MotorcadeError("port-forbidden", port=port, group=group_of(port))
    if code in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text or "PermissionError" in text:
        return MotorcadeError("port-busy", port=port)
    if code in (errno.ENOTTY, errno.EISDIR) or "Inappropriate ioctl" in text:
        return MotorcadeError("no-serial-port", port=port)
    return MotorcadeError("no-car-at-address" if "://" in port else "no-such-port", port=port)


def _gone(port: str, problem: Exception, holds: str) -> MotorcadeError:
    code = "takes-no-bytes" if isinstance(problem, serial.SerialTimeoutException) else "went-away"
    return MotorcadeError(code, port=port, holds=holds_phrase(holds))
