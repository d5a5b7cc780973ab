"""A leader car that exists only in this process: real bytes in, real answer out.

It runs the loop of a real car behind a pseudo-terminal or a TCP port, which
pyserial reaches as ``socket://HOST:PORT``, and keeps its image in a file.
"""

import contextlib
import os
import select
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from motorcade.car.board import Board
from motorcade.car.loop import Car
from motorcade.config.files import replace_file
from motorcade.config.profile import Profile, levels_of
from motorcade.words.image import ImageError, parse_image_bytes
from motorcade.words.ticks import TICKS_MASK
from motorcade.words.upload import error_line

TICK_S = 0.005
_CHUNK_BYTES = 4096
_MOST_TURNED_AWAY = 16


class StoreError(Exception):
    """A file that can't serve as a car's store."""


class LineError(Exception):
    """A line that the car can't wait at."""


class ImageStore:
    """An image in a file. A crash at any moment leaves the old image or the new one, whole."""

    def __init__(self, path: Path):
        self.path = path

    def load(self) -> bytes | None:
        """The image's bytes, None where there is no file yet. Raises StoreError."""
        try:
            data = self.path.read_bytes()
            parse_image_bytes(data)
        except FileNotFoundError:
            return None
        except OSError as problem:
            raise StoreError(f"{self.path} can't be read: {problem.strerror}") from None
        except ImageError as problem:
            raise StoreError(f"{self.path} holds no image: {problem}. Choose another file with --store") from None
        return data

    def save(self, data: bytes) -> None:
        """Replace the image. Raises OSError; the old one is kept then."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(self.path, data)


class Line(Protocol):
    """The car's end of a serial line."""

    address: str

    def wait(self, seconds: float) -> None:
        """Until bytes may be there, or ``seconds`` have gone."""

    def read(self) -> bytes:
        """The bytes that are there."""

    def write(self, data: bytes) -> None:
        """Send ``data``; lost where nobody is connected."""

    def close(self) -> None:
        """Give the line up."""


class PseudoTerminal:
    """A serial port of this computer that leads to the car; POSIX only."""

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise LineError("Windows has no pseudo-terminals: use --tcp 127.0.0.1:7000")
        import pty
        import tty

        # The car keeps the other end open too: else the line would hang up with
        # every client that leaves.
        self._car_end, self._client_end = pty.openpty()
        tty.setraw(self._client_end)
        os.set_blocking(self._car_end, False)
        self.address = os.ttyname(self._client_end)

    def wait(self, seconds: float) -> None:
        select.select([self._car_end], [], [], seconds)

    def read(self) -> bytes:
        try:
            return os.read(self._car_end, _CHUNK_BYTES)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        while data:
            try:
                data = data[os.write(self._car_end, data) :]
            except BlockingIOError:
                return

    def close(self) -> None:
        os.close(self._car_end)
        os.close(self._client_end)


class TcpPort:
    """A TCP port that leads to the car, for one client at a time; others are told that it is busy."""

    def __init__(self, host: str, port: int):
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            self._listener = socket.create_server((host, port), family=family)
        except OSError as problem:
            reason = os.strerror(problem.errno) if problem.errno and problem.errno > 0 else problem.strerror
            raise LineError(f"Can't wait at {host}:{port}: {reason}. Try another port.") from None
        self._client: socket.socket | None = None
        self._turned_away: list[socket.socket] = []
        bound_host, bound_port = self._listener.getsockname()[:2]
        self.address = f"socket://{f'[{bound_host}]' if ':' in bound_host else bound_host}:{bound_port}"

    def wait(self, seconds: float) -> None:
        watched = [self._listener, *self._turned_away]
        if self._client is not None:
            watched.append(self._client)
        ready, _, _ = select.select(watched, [], [], seconds)
        for refused in [each for each in self._turned_away if each in ready]:
            self._answer_busy(refused)
        if self._listener in ready:
            with contextlib.suppress(OSError):
                self._accept()

    def read(self) -> bytes:
        if self._client is None:
            return b""
        data = _received(self._client)
        if data is None:
            return b""
        if not data:
            self._hang_up()
        return data

    def write(self, data: bytes) -> None:
        if self._client is None:
            return
        try:
            self._client.sendall(data)
        except OSError:
            self._hang_up()

    def close(self) -> None:
        self._hang_up()
        for refused in self._turned_away:
            refused.close()
        self._listener.close()

    def _accept(self) -> None:
        client, _ = self._listener.accept()
        client.setblocking(False)
        if self._client is not None and _received(self._client, socket.MSG_PEEK) == b"":
            self._hang_up()
        if self._client is None:
            self._client = client
            return
        self._turned_away.append(client)
        if len(self._turned_away) > _MOST_TURNED_AWAY:
            self._turned_away.pop(0).close()

    def _answer_busy(self, client: socket.socket) -> None:
        """Tell a client that sent something; it is kept until it leaves, for closing first could lose the line."""
        if _received(client):
            with contextlib.suppress(OSError):
                client.sendall(error_line("busy with another uploader"))
            return
        self._turned_away.remove(client)
        client.close()

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None


def _received(client: socket.socket, flags: int = 0) -> bytes | None:
    """What came from ``client``: None for nothing yet, no bytes where it has left."""
    try:
        return client.recv(_CHUNK_BYTES, flags)
    except BlockingIOError:
        return None
    except OSError:
        return b""


class VirtualBoard(Board):
    """The board of a virtual leader. ``observe(kind, at_ms, word, detail)`` hears what a car's loop notes."""

    def __init__(
        self,
        line: Line,
        store: ImageStore,
        profile: Profile,
        observe: Callable[[str, int, int, int | str], None],
        clock_s: Callable[[], float],
    ):
        self.is_leader = True
        self.levels = levels_of(profile)
        self._line = line
        self._store = store
        self._observe = observe
        self._clock_s = clock_s
        self._image = store.load()

    def now_ms(self) -> int:
        return int(self._clock_s() * 1000) & TICKS_MASK

    def load_image(self) -> bytes | None:
        return self._image

    def store_image(self, data: bytes) -> None:
        self._store.save(data)
        self._image = data

    def read_serial(self) -> bytes:
        return self._line.read()

    def write_serial(self, data: bytes) -> None:
        self._line.write(data)

    def note(self, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        self._observe(kind, at_ms, word, detail)


def serve(board: VirtualBoard, line: Line, stops: Callable[[], bool]) -> None:
    """Run the car until ``stops()``."""
    car = Car(board)
    while not stops():
        line.wait(TICK_S)
        car.tick()


def monotonic_clock() -> Callable[[], float]:
    """A clock in seconds that starts at 0 now."""
    begin = time.monotonic()
    return lambda: time.monotonic() - begin
