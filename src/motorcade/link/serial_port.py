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

from motorcade.words.upload import (
    IMAGE,
    MISMATCH,
    NOT_VERIFIED,
    READBACK_REQUEST,
    REFUSED,
    SILENCE_MS,
    SILENT,
    Outcome,
    ReadbackEnd,
    UploaderEnd,
)

_CHUNK_BYTES = 64
_READ_TIMEOUT_S = 0.02
_WRITE_TIMEOUT_S = 5
_SETTLE_S = SILENCE_MS / 1000 + 0.1
_LONGEST_SETTLE_S = 3.0


class PortError(Exception):
    """Something between here and the car."""


class PortNotFoundError(PortError):
    """There is no such port."""


class PortBusyError(PortError):
    """The port is in use by someone else, or this user may not use it."""


class NoAnswerError(PortError):
    """The car said nothing, or went away."""


class VerificationError(PortError):
    """The car refused the image or holds another one than was sent."""


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
    if outcome.kind == SILENT:
        hint = "Is the car switched on, and the baud rate right? For a board that never answers use --no-verify"
        raise NoAnswerError(f"The car at {port} gave {outcome.detail}. {hint}.")
    if outcome.kind == REFUSED:
        raise _refused(port, f"refused: {outcome.detail}. It keeps the image that it had.", outcome.detail)
    if outcome.kind == MISMATCH:
        raise VerificationError(
            f"The car at {port} holds something else than was sent: {outcome.detail}. Upload again."
        )
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
    if outcome.kind == SILENT:
        raise NoAnswerError(f"Nothing to read at {port}: {outcome.detail}. Is the car switched on?")
    if outcome.kind != IMAGE:
        raise _refused(port, f"sent no image: {outcome.detail}.", outcome.detail)
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
        raise PortNotFoundError("No port is named. `motorcade ports` lists those that are there.")
    try:
        return serial.serial_for_url(
            port, baudrate=baud, timeout=_READ_TIMEOUT_S, write_timeout=_WRITE_TIMEOUT_S, exclusive=True
        )
    except ValueError:
        raise PortNotFoundError(f"'{port[:60]}' is not the name of a port. `motorcade ports` lists them.") from None
    except (serial.SerialException, OSError) as problem:
        raise _not_opened(port, problem) from None
    except TerminalError as problem:
        raise _gone(port, problem) from None


def _not_opened(port: str, problem: Exception) -> PortError:
    """The sentence for a port that didn't open; pyserial tells some cases apart in its text only."""
    code, text = getattr(problem, "errno", None), str(problem)
    if code in (errno.EACCES, errno.EPERM) and "denied" in text and "PermissionError" not in text:
        return PortBusyError(
            f"You may not use {port}. On Linux join the group that owns it (often dialout): "
            "sudo usermod -aG dialout $USER, then log in again."
        )
    if code in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text or "PermissionError" in text:
        return PortBusyError(f"The port {port} is busy: close the other program that uses it.")
    if code in (errno.ENOTTY, errno.EISDIR) or "Inappropriate ioctl" in text:
        return PortNotFoundError(f"{port} is no serial port. `motorcade ports` lists those that are.")
    return PortNotFoundError(f"There is no port {port}. Is the cable in? `motorcade ports` lists what is there.")


def _refused(port: str, sentence: str, reason: str) -> PortError:
    if reason.startswith("busy"):
        return PortBusyError(f"The car at {port} is busy with another uploader. Try again when it is done.")
    return VerificationError(f"The car at {port} {sentence}")


def _gone(port: str, problem: Exception) -> PortError:
    if isinstance(problem, serial.SerialTimeoutException):
        return NoAnswerError(f"The car at {port} takes no more bytes. Is it switched on?")
    return NoAnswerError(
        f"The car at {port} went away in the middle: it holds the old image or the new one. Try again."
    )


def _now_ms() -> int:
    return int(time.monotonic() * 1000)
