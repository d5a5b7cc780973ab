"""Use MicroPython's prompt on a board by mpremote: ask for facts, copy files; each failure is a MotorcadeError."""

import contextlib
import io
import re
import struct
from ast import literal_eval
from collections.abc import Callable, Iterator
from threading import Timer
from typing import NamedTuple

import msgspec
import serial
from mpremote.transport import TransportError, TransportExecError
from mpremote.transport_serial import SerialTransport

from motorcade.config.chips import MICROPYTHON
from motorcade.errors import MotorcadeError, TransferError
from motorcade.upload.serial_port import open_error, port_name, serial_line

_BAUD = 115200
# Few enough for the memory of a small board, which gets them as a literal of up to four times the length.
_CHUNK_BYTES = 1024
_ANSWER_WITHIN_S = 5
# mpremote reads until a device pauses; one that never does is hung up, while it is to show its prompt, and later.
_PROMPT_WITHIN_S, _DONE_WITHIN_S = 15, 120
# What pyserial raises where a port is closed meanwhile.
_CLOSED = (OSError, AttributeError, TypeError, ValueError)
_FACTS = """import os, sys
space = os.statvfs('/')
bytecode = getattr(sys.implementation, '_mpy', 0) & 255
machine = getattr(sys.implementation, '_machine', '')
print([sys.platform, list(sys.implementation[1]), space[0], space[0] * space[3], bytecode, machine])
"""
_OTHER_ESP32 = re.compile("ESP32-?[SCHP][0-9]")
_LISTING = """import os
def show(folder):
    for entry in os.ilistdir(folder):
        path = folder + '/' + entry[0]
        if entry[1] == 0x4000:
            show(path)
        else:
            print([path, os.stat(path)[6]])
try:
    show({!r})
except OSError:
    pass
"""


class Facts(NamedTuple):
    """A board's sys.platform, MicroPython's version, flash block and free flash, the version of .mpy, and its machine.

    The version of .mpy is 0 where the board reads none. The machine is a text such as ``Raspberry Pi Pico 2 with
    RP2350``, empty on an old MicroPython.
    """

    platform: str
    version: tuple[int, ...]
    block_bytes: int
    free_bytes: int
    bytecode: int
    machine: str = ""

    @property
    def chip(self) -> str:
        """The chip's name in pin files, or what the board calls its chip where that is another one.

        All of the ESP32's family have its platform, but other pins.
        """
        if relative := _OTHER_ESP32.search(self.machine):
            return relative[0]
        for name, (firmware, _) in MICROPYTHON.items():
            if self.platform == firmware.platform and firmware.machine in self.machine:
                return name
        return self.platform


class BoardPrompt:
    """The prompt of the board at ``port``; close it at the end.

    Raises:
        MotorcadeError: the port can't be opened, or no MicroPython answers there.
    """

    def __init__(self, port: str):
        self.port = port
        self._folders: set[str] = set()
        self._transport = _opened(port)
        try:
            with self._within(_PROMPT_WITHIN_S):
                self._enter()
        except BaseException:
            self.close()
            raise

    def facts(self) -> Facts:
        """Return the board's facts. Raises MotorcadeError, as all methods below do."""
        with self._converting_errors("/"):
            platform, version, *others = literal_eval(self._transport.exec(_FACTS).decode())
            return msgspec.convert([platform, version[:3], *others], Facts)

    def sizes(self, folder: str) -> dict[str, int]:
        """Return the path of each file under ``folder`` and its number of bytes."""
        with self._converting_errors(folder):
            lines = self._transport.exec(_LISTING.format(folder)).decode().splitlines()
            return dict(literal_eval(line) for line in lines)

    def checksum(self, path: str) -> bytes | None:
        """Return SHA-256 of the file at ``path``; None where there is none."""
        with self._converting_errors(path), contextlib.suppress(FileNotFoundError):
            return bytes(self._transport.fs_hashfile(path, "sha256"))
        return None

    def read(self, path: str) -> bytes | None:
        """Return the file's bytes; None where there is none."""
        with self._converting_errors(path), contextlib.suppress(FileNotFoundError):
            return bytes(self._transport.fs_readfile(path))
        return None

    def write(self, path: str, data: bytes, progress: Callable[[int], None]) -> None:
        """Write ``data`` to ``path``; call ``progress`` with the number of bytes written so far."""
        with self._converting_errors(path):
            for folder in _folders(path):
                if folder not in self._folders and not self._transport.fs_exists(folder):
                    self._transport.fs_mkdir(folder)
                self._folders.add(folder)
            self._transport.fs_writefile(path, data, _CHUNK_BYTES, lambda written, total: progress(written))

    def rename(self, old: str, new: str) -> None:
        """Rename a file."""
        with self._converting_errors(old):
            self._transport.exec(f"import os\nos.rename({old!r}, {new!r})")

    def remove(self, path: str) -> None:
        """Remove a file, if it is there."""
        with self._converting_errors(path), contextlib.suppress(FileNotFoundError):
            self._transport.fs_rmfile(path)

    def restart(self) -> None:
        """Reset the board, which then runs its main.py."""
        with self._converting_errors("main.py"):
            self._transport.exec_raw_no_follow("import machine\nmachine.reset()")

    def close(self) -> None:
        """Close the port."""
        # mpremote sets two lines of the port first, which fails where the port has gone.
        for close in (self._transport.close, self._transport.serial.close):
            with contextlib.suppress(OSError, serial.SerialException):
                close()

    def _enter(self) -> None:
        # Opening the port may have reset the board, which then didn't listen yet.
        for is_last in (False, True):
            try:
                # Hide what mpremote prints about a failure.
                with contextlib.redirect_stdout(io.StringIO()):
                    self._transport.enter_raw_repl(timeout_overall=_ANSWER_WITHIN_S)
            except (TransportError, *_CLOSED) as problem:
                if is_last or isinstance(problem, _CLOSED):
                    raise TransferError("no-micropython-answers", port=self.port) from None
            else:
                return

    @contextlib.contextmanager
    def _within(self, seconds: float) -> Iterator[None]:
        """Close the port where the block takes longer."""
        late = Timer(seconds, self.close)
        late.start()
        try:
            yield
        finally:
            late.cancel()

    @contextlib.contextmanager
    def _converting_errors(self, path: str) -> Iterator[None]:
        try:
            with self._within(_DONE_WITHIN_S):
                yield
        except FileNotFoundError:
            raise
        except TransportExecError as problem:
            reason = problem.error_output.strip().splitlines()[-1:]
            raise TransferError(
                "install-failed", port=self.port, path=path, reason=reason[0] if reason else "?"
            ) from None
        except (
            TransportError,
            serial.SerialException,
            struct.error,
            SyntaxError,
            ValueError,
            AttributeError,
            TypeError,
            RecursionError,
            MemoryError,
            msgspec.ValidationError,
        ):
            raise TransferError("install-cut-off", port=self.port) from None
        except OSError as problem:
            if isinstance(problem, ConnectionError) or not problem.errno or problem.errno == 5:
                raise TransferError("install-cut-off", port=self.port) from None
            raise TransferError("install-failed", port=self.port, path=path, reason=problem) from None


def _opened(port: str) -> SerialTransport:
    try:
        transport = SerialTransport(port_name(port), baudrate=_BAUD, timeout=_ANSWER_WITHIN_S)
    except ValueError:
        raise TransferError("not-a-port-name", port=port) from None
    except (TransportError, OSError):
        raise _why_closed(port) from None
    transport.serial.write_timeout = _ANSWER_WITHIN_S
    return transport


def _why_closed(port: str) -> MotorcadeError:
    """Open the port once more to find out why it can't be opened, since mpremote gives no reason."""
    try:
        serial_line(port).close()
    except (serial.SerialException, OSError) as problem:
        return open_error(port, problem)
    return TransferError("no-micropython-answers", port=port)


def _folders(path: str) -> list[str]:
    parts = path.split("/")[:-1]
    return ["/".join(parts[:depth]) for depth in range(2, len(parts) + 1)]
