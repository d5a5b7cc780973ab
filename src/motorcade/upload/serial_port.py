"""The serial ports of this computer: where a car is likely, an upload to one, and a readback.

A port is a device such as ``/dev/ttyUSB0`` or ``COM3``, or ``socket://HOST:PORT``, such as a simulated car's. Nothing
else is opened, whoever names it: pyserial would also write files (``spy://``), and open any file as a port. The USB ids
are those of makers of serial converters and boards; products are listed where a maker has others that are no serial
port of a board.
"""

import errno
import os
import re
import secrets
import socket
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import serial
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

try:
    from termios import error as TerminalError  # noqa: N812 - named as an error is
except ImportError:  # Windows
    TerminalError = OSError  # type: ignore[assignment, misc]

from motorcade.errors import MotorcadeError, Phrase, TransferError
from motorcade.sockets import host_and_port
from motorcade.timing import monotonic_ms
from motorcade.upload.transfer import (
    OLD,
    ReadbackTransfer,
    Transfer,
    UploadTransfer,
    holds_phrase,
    readback_error,
    upload_error,
)
from motorcade.words.uploader import Outcome

# The name; its vendor's number; its products' numbers, none for all of them.
_BOARDS: tuple[tuple[str, int, tuple[int, ...]], ...] = (
    ("CH340", 0x1A86, (0x7522, 0x7523, 0x5523)),
    ("CH343", 0x1A86, (0x55D3,)),
    ("CH9102", 0x1A86, (0x55D4,)),
    ("CP210x", 0x10C4, (0xEA60, 0xEA70, 0xEA71)),
    ("FTDI", 0x0403, (0x6001, 0x6010, 0x6011, 0x6014, 0x6015)),
    ("PL2303", 0x067B, (0x2303, 0x23A3, 0x23C3, 0x23D3)),
    ("Arduino Uno", 0x2341, (0x0001, 0x0043, 0x0243)),
    ("Arduino Mega", 0x2341, (0x0010, 0x0042, 0x0242)),
    ("Arduino", 0x2341, ()),
    ("Arduino Uno", 0x2A03, (0x0043,)),
    ("Arduino Mega", 0x2A03, (0x0010, 0x0042)),
    ("Arduino", 0x2A03, ()),
    ("Raspberry Pi Pico", 0x2E8A, ()),
    ("Espressif", 0x303A, ()),
    ("Adafruit", 0x239A, ()),
    ("SparkFun", 0x1B4F, ()),
    ("Seeed", 0x2886, ()),
    ("Teensy", 0x16C0, (0x0483,)),
    ("micro:bit", 0x0D28, (0x0204,)),
    ("MicroPython", 0xF055, (0x9800,)),
    ("STM32", 0x0483, (0x5740, 0x374B, 0x374E)),
)
# What pyserial returns where nothing is known.
_NOTHING = "n/a"
_USUAL_GROUP = "dialout"

_COM = re.compile(r"(\\\\\.\\)?COM[0-9]{1,3}", re.IGNORECASE)

# How likely a car is at a port, the likeliest first.
BOARD, USB, OTHER, BARE = range(4)

# The numbers that Windows gives, which pyserial keeps in its text alone: access is denied, a sharing violation; there
# is no such file, or path.
_WINDOWS_BUSY = (5, 32)
_WINDOWS_MISSING = (2, 3)
_WINDOWS_NUMBER = re.compile(r"Error\(\d+, .*, None, (\d+)\)")
_WINDOWS_TEXT = re.compile(r"Error\(\d+, ['\"](.*?)['\"], None")
_ERRNO = re.compile(r"\[Errno (\d+)\]")

_READ_TIMEOUT_S = 0.02
_WRITE_TIMEOUT_S = 5


class PortInfo(NamedTuple):
    """A serial port of this computer.

    Attributes:
        device: its name, such as /dev/ttyUSB0.
        description, hardware: what the system knows of it, or empty.
        board: the name that belongs to its USB id; empty where that is unknown.
        rank: BOARD, USB, OTHER (such as Bluetooth), or BARE for a mainboard's port, which mostly has nothing on it.
    """

    device: str
    description: str
    hardware: str
    board: str = ""
    rank: int = OTHER

    @property
    def title(self) -> str:
        """What is connected, as far as it is known."""
        if self.board in self.description:
            return self.description
        if not self.description:
            return self.board
        return f"{self.board} ({self.description})"


class SeveralPortsError(MotorcadeError):
    """A car may be at several ports: somebody has to choose.

    Attributes:
        ports: pairs of a device and its title.
    """

    def __init__(self, ports: list[tuple[str, str]]) -> None:
        self.ports = ports
        super().__init__("several-ports", list=", ".join(f"{device} ({title})" for device, title in ports))


def ports() -> list[PortInfo]:
    """The serial ports of this computer now, the likeliest first."""
    return sorted(map(_described, list_ports.comports()), key=lambda port: (port.rank, port.device))


def likely_port(found: list[PortInfo]) -> PortInfo:
    """The one port at which a car may be.

    Raises:
        MotorcadeError: "no-car-found", there is none.
        SeveralPortsError: there are several.
    """
    for rank in (BOARD, USB):
        likely = [port for port in found if port.rank == rank]
        if len(likely) > 1:
            raise SeveralPortsError([(port.device, port.title) for port in likely])
        if likely:
            return likely[0]
    raise TransferError("no-car-found")


def group_of(device: str) -> str:
    """The group whose members may use a port of a POSIX system; the usual one where it is unknown."""
    try:
        from grp import getgrgid

        name = getgrgid(os.stat(device).st_gid).gr_name  # noqa: PTH116 - a port is no path
    except (ImportError, OSError, KeyError):
        return _USUAL_GROUP
    if name == "root":
        return _USUAL_GROUP
    return name


def _described(port: ListPortInfo) -> PortInfo:
    description = _known(port.description)
    hardware = _known(port.hwid)
    if port.vid is None:
        rank = OTHER
        # A mainboard's port has its own name for a description, or none.
        if (description in ("", port.name) and "/rfcomm" not in port.device) or hardware.startswith("ACPI"):
            rank = BARE
        return PortInfo(port.device, description, hardware, rank=rank)
    for name, vendor, products in _BOARDS:
        if vendor == port.vid and (not products or port.pid in products):
            return PortInfo(port.device, description, hardware, name, BOARD)
    return PortInfo(port.device, description, hardware, rank=USB)


def _known(text: str | None) -> str:
    """Return what pyserial says, empty where it knows nothing."""
    if text is None or text == _NOTHING:
        return ""
    return text


def upload(
    port: str,
    image: bytes,
    baud: int,
    verify: bool = True,
    progress: Callable[[int], None] = lambda sent_bytes: None,
    retrying: Callable[[Phrase], None] = lambda retry: None,
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
    outcome = run(transfer, port, baud)
    if error := upload_error(port, outcome, transfer.holds, in_network=_is_in_network(port)):
        raise error
    return str(outcome.detail)


def readback(port: str, baud: int, retrying: Callable[[Phrase], None] = lambda retry: None) -> bytes:
    """The image that the car at ``port`` holds. Raises MotorcadeError."""
    outcome = run(ReadbackTransfer(baud, retrying), port, baud)
    if error := readback_error(port, outcome):
        raise error
    image: bytes = outcome.detail
    return image


def run(transfer: Transfer, port: str, baud: int) -> Outcome:
    """Run ``transfer`` through ``port``. Returns its outcome. Raises MotorcadeError where the port fails."""
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


def port_name(port: str) -> str:
    """Return a port's name as pyserial takes it.

    Raises:
        MotorcadeError: it is neither ``socket://HOST:PORT``, ``HOST:PORT`` nor the name of a device, or a file that is
            no port.
    """
    name = port.strip()
    if not name:
        raise TransferError("no-port-named")
    scheme, separator, address = name.rpartition("://")
    if separator and scheme.lower() != "socket":
        raise TransferError("not-a-port-name", port=port)
    if _is_in_network(name):
        return _socket_url(address)
    is_port = _may_be_port
    if sys.platform == "win32":
        is_port = _is_windows_port
    # ValueError: no file can have that name.
    with suppress(ValueError):
        if is_port(name):
            return name
    raise TransferError("no-serial-port", port=port)


def _is_in_network(port: str) -> bool:
    """Whether a port is ``socket://HOST:PORT`` or ``HOST:PORT``, as cars are printed."""
    host, _, number = port.strip().rpartition(":")
    # A path such as /dev/serial/by-id/… may have a colon, too.
    return "://" in port or (bool(host) and number.isdecimal() and not host.startswith("/"))


def _socket_url(address: str) -> str:
    host, number = host_and_port(address)
    if ":" in host:
        host = f"[{host}]"
    return f"socket://{host}:{number}"


def _is_windows_port(name: str) -> bool:
    return _COM.fullmatch(name) is not None or name in [port.device for port in list_ports.comports()]


def _may_be_port(name: str) -> bool:
    """Whether a file is a device, and none that Linux knows to be something else; so is one that isn't there.

    To open a watchdog, for one, would start it. Raises ValueError.
    """
    try:
        found = os.stat(name)  # noqa: PTH116 - a port is no path
    except OSError:
        return True
    number = f"{os.major(found.st_rdev)}:{os.minor(found.st_rdev)}"
    subsystem = Path(f"/sys/dev/char/{number}/subsystem")
    return stat.S_ISCHR(found.st_mode) and (not subsystem.exists() or subsystem.resolve().name == "tty")


def serial_line(port: str, **settings: Any) -> serial.Serial:
    """Open a port with pyserial's settings, for this process alone.

    Raises MotorcadeError where it can't be a port, and what pyserial raises.
    """
    return serial.serial_for_url(port_name(port), exclusive=True, **settings)


def open_port(port: str, baud: int) -> serial.Serial:
    """Open a port for this process alone. Raises MotorcadeError."""
    try:
        return serial_line(port, baudrate=baud, timeout=_READ_TIMEOUT_S, write_timeout=_WRITE_TIMEOUT_S)
    except ValueError:
        raise TransferError("not-a-port-name", port=port) from None
    except (serial.SerialException, OSError) as problem:
        raise open_error(port, problem) from None
    except TerminalError as problem:
        raise _gone(port, problem, OLD) from None


def open_error(port: str, problem: Exception) -> MotorcadeError:
    """The error for a port that can't be opened, with the driver's own reason."""
    text = str(problem)
    if _is_in_network(port):
        return TransferError("no-car-at-address", port=port, reason=_reason(problem))
    number = _windows_number(text)
    code = None
    if not number:
        code = getattr(problem, "errno", None)
    if code == errno.EACCES:
        return TransferError("port-forbidden", port=port, group=group_of(port))
    # pyserial tells of a port that another process has locked in its text only.
    if number in _WINDOWS_BUSY or code in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text:
        return TransferError("port-busy", port=port)
    if code in (errno.ENOTTY, errno.EISDIR) or "Inappropriate ioctl" in text:
        return TransferError("no-serial-port", port=port)
    is_missing = number in _WINDOWS_MISSING or code == errno.ENOENT
    if is_missing and port not in [listed.device for listed in list_ports.comports()]:
        return TransferError("no-such-port", port=port)
    return TransferError("port-fails", port=port, reason=_reason(problem))


def _windows_number(text: str) -> int:
    """Return the number of Windows' error in pyserial's text, 31 in "PermissionError(13, '…', None, 31)"; or 0."""
    found = _WINDOWS_NUMBER.search(text)
    if found is None:
        return 0
    return int(found[1])


def _reason(problem: Exception) -> object:
    """Return the driver's reason for a sentence: what Windows says with its number, or what the system refused."""
    text = str(problem)
    if isinstance(problem.__context__, socket.gaierror):
        return Phrase("no-such-address")
    if number := _windows_number(text):
        said = _WINDOWS_TEXT.search(text)
        return Phrase("windows-says", number=number, text=said[1] if said else text)
    code = getattr(problem, "errno", None)
    if code is None:
        # pyserial hides it in the text of its own error: "[Errno 5] Input/output error".
        found = _ERRNO.search(text)
        if found is None:
            return text
        code = int(found[1])
    return OSError(code, os.strerror(code))


def _gone(port: str, problem: Exception, holds: str) -> MotorcadeError:
    holding = holds_phrase(holds)
    if isinstance(problem, serial.SerialTimeoutException):
        return TransferError("takes-no-bytes", port=port, holds=holding)
    if _is_in_network(port):
        return TransferError("connection-broke", port=port, reason=_reason(problem), holds=holding)
    return TransferError("port-broke", port=port, reason=_reason(problem), holds=holding)
