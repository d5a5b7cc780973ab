"""Start servers in processes of their own for `benchmarks/drive.py`: cars, and an echo to compare them with."""

import asyncio
import multiprocessing
import socket
import ssl
import time
from collections.abc import Iterator
from contextlib import AsyncExitStack, contextmanager, suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, cast

from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import Profile, built_in_profile
from motorcade.drive.channels import Clients
from motorcade.drive.keys import server_context
from motorcade.drive.listener import bind
from motorcade.drive.server import serving, watched
from motorcade.drive.session import CarControl
from motorcade.timing import monotonic_ms

NEUTRAL = (90, 1, 0)
CLASSROOM = built_in_profile("classroom")
# For measurements of commands alone: a busy machine must not stop these cars.
_LONG_MS = 3_600_000
_LIMITS: dict[str, Any] = {
    "watchdog_ms": _LONG_MS,
    "failsafe_ms": _LONG_MS,
    "hand_over_ms": 2 * _LONG_MS,
    "commands_per_s": 10_000_000,
}
ENDLESS = replace(CLASSROOM, drive=replace(CLASSROOM.drive, **_LIMITS))
Note = tuple[float, tuple[int, int, int]]


class RecordingBoard(DriveBoard):
    """Store each command, and when it came."""

    def __init__(self) -> None:
        self.notes: list[Note] = []

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self.notes.append((time.perf_counter(), (angle_deg, direction, speed)))

    def neutral(self) -> None:
        self.notes.append((time.perf_counter(), NEUTRAL))


class IdleBoard(DriveBoard):
    """Accept commands and do nothing."""

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        pass

    def neutral(self) -> None:
        pass


class AnsweringBoard(IdleBoard):
    """Send a byte to its only client for each command, over the connection on which commands come."""

    server: Clients
    _connection: asyncio.Transport | None = None

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        if self._connection is None:
            self._connection = self.server.commands[0].line
            assert self._connection is not None
        self._connection.write(b"\x00")


class Echo(asyncio.BufferedProtocol):
    """Answer four bytes with one: the least that a server can do."""

    def __init__(self) -> None:
        self._view = memoryview(bytearray(4096))

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)

    def get_buffer(self, sizehint: int) -> memoryview:
        return self._view

    def buffer_updated(self, nbytes: int) -> None:
        self._transport.write(self._view[:1])


async def _serve_echo(pipe: Connection, keys: Path | None) -> None:
    tls = server_context(keys) if keys else None
    async with await asyncio.get_running_loop().create_server(Echo, "127.0.0.1", 0, ssl=tls) as server:
        pipe.send([server.sockets[0].getsockname()[1]])
        await _wait_for_end(pipe)


async def _serve_cars(pipe: Connection, keys: Path | None, boards: list[DriveBoard], profile: Profile) -> None:
    tls = server_context(keys) if keys else None
    async with AsyncExitStack() as stack:
        ports: list[int] = []
        for board in boards:
            sockets = [stack.enter_context(bind("127.0.0.1", 0)) for _ in range(2)]
            drive = CarControl(board, monotonic_ms, profile)
            server = Clients(drive)
            if isinstance(board, AnsweringBoard):
                board.server = server
            await stack.enter_async_context(watched(drive))
            await stack.enter_async_context(serving(server, sockets[0], sockets[1], tls))
            ports += [each.getsockname()[1] for each in sockets]
        pipe.send(ports)
        await _wait_for_end(pipe)
    pipe.send([board.notes for board in boards if isinstance(board, RecordingBoard)])


async def _wait_for_end(pipe: Connection) -> None:
    ended = asyncio.Event()
    asyncio.get_running_loop().add_reader(pipe.fileno(), ended.set)
    await ended.wait()
    asyncio.get_running_loop().remove_reader(pipe.fileno())
    pipe.recv()


def _run(what: str, pipe: Connection, keys: Path | None, cars: int) -> None:
    if what == "echo":
        asyncio.run(_serve_echo(pipe, keys))
        return
    kind, profile = KINDS[what]
    asyncio.run(_serve_cars(pipe, keys, [kind() for _ in range(cars)], profile))


KINDS: dict[str, tuple[type[DriveBoard], Profile]] = {
    "answering": (AnsweringBoard, ENDLESS),
    "idle": (IdleBoard, CLASSROOM),
    "recording": (RecordingBoard, CLASSROOM),
}


class ServerProcess:
    """A process that serves cars or an echo.

    Args:
        what: ``"echo"`` or one of KINDS.
        keys: the car's keys, for TLS; None for plain connections.
        cars: how many cars.

    Attributes:
        ports: the port of the echo, or those of each car for commands and for telemetry.
        notes: what each board stored; after ``end``.
        pid: the process's number.
    """

    def __init__(self, what: str, keys: Path | None = None, cars: int = 1) -> None:
        spawn = multiprocessing.get_context("spawn")
        self._pipe, child_end = spawn.Pipe()
        self._process = spawn.Process(target=_run, args=(what, child_end, keys, cars), daemon=True)
        self._process.start()
        child_end.close()
        self._ports: list[int] | None = None
        self.notes: list[list[Note]] = []

    @property
    def ports(self) -> list[int]:
        if self._ports is None:
            self._ports = self._pipe.recv()
        return self._ports

    @property
    def pid(self) -> int:
        assert self._process.pid
        return self._process.pid

    def end(self) -> None:
        self._pipe.send("end")
        # An echo has no notes.
        with suppress(EOFError):
            self.notes = self._pipe.recv()
        self._process.join()


@contextmanager
def server_process(what: str, keys: Path | None = None, cars: int = 1) -> Iterator[ServerProcess]:
    """Start a ServerProcess, and end it with the ``with`` block."""
    process = ServerProcess(what, keys, cars)
    try:
        yield process
    finally:
        process.end()


def connect(port: int, tls: ssl.SSLContext | None = None) -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", port))
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return tls.wrap_socket(connection, server_hostname="127.0.0.1") if tls else connection
