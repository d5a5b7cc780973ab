"""asyncio's event loop in a simulated process: its clock, timers, threads and sockets are the world's.

Everything else is asyncio's own: the same code runs tasks and callbacks as with real sockets.
"""

import asyncio
from asyncio import BufferedProtocol, Future, Handle
from collections import deque
from collections.abc import Callable, Coroutine
from contextlib import suppress
from functools import partial
from typing import Any

from tests.faults.network import ListeningSocket, Network, Socket, system_error
from tests.faults.world import Process, Thread, World

_MOST_BYTES = 1 << 18
# asyncio's own limits of what waits to be sent.
_HIGH_BYTES = 1 << 16
# A loop that is never idle takes this long for so many rounds.
_ROUNDS, _ROUNDS_S = 50, 0.001
_MOST_CLOSINGS = 20
# How often memory is looked at.
_LOOK_S = 0.25


class SimulatedLoop(asyncio.BaseEventLoop):
    """The loop of a process, which `run` begins in a thread of its own.

    Attributes:
        transports: the open connections.
    """

    def __init__(self, process: Process, network: Network) -> None:
        super().__init__()
        self.process = process
        self.world = process.world
        self.network = network
        self._selector = self  # type: ignore[attr-defined]
        self._clock_resolution = 1e-6
        self.transports: set[Transport] = set()
        self._main: Thread | None = None
        self._rounds = 0
        self._is_woken = False
        # The tasks of a process that was killed: they do nothing, but the garbage collector would end them noisily.
        self._left: list[asyncio.Task[Any]] = []
        process.at_end.append(lambda: self._left.extend(asyncio.all_tasks(self)))
        process.at_close.append(self.abandon)

    def run(self, main: Callable[[], Coroutine[Any, Any, Any]]) -> None:
        """Run a coroutine in the process."""

        def begin() -> None:
            # No loop runs in this thread yet.
            asyncio.events._set_running_loop(None)
            assert self._main
            self._main.loop = self.world.running_loop = self
            self.run_until_complete(main())

        self._main = self.process.start(begin, "loop")

    def abandon(self) -> None:
        """Forget all tasks without a word."""
        asyncio.events._set_running_loop(self)
        for task in [*self._left, *asyncio.all_tasks(self)]:
            task._log_destroy_pending = False  # type: ignore[attr-defined]
            coroutine: Any = task.get_coro()
            # A coroutine that waits at its end has to be closed again.
            for _ in range(_MOST_CLOSINGS):
                if coroutine.cr_frame is None:
                    break
                with suppress(BaseException):
                    coroutine.close()
        asyncio.events._set_running_loop(None)
        self._ready.clear()  # type: ignore[attr-defined]
        self._scheduled.clear()  # type: ignore[attr-defined]

    def call_exception_handler(self, context: dict[str, Any]) -> None:
        """An error that nobody handled breaks a promise."""
        problem = context.get("exception")
        if not self.process.is_dead and problem is not None:
            self.world.problem(f"{self.process.name}: {context['message']}", problem)

    def __del__(self) -> None:
        """There is nothing to close."""

    # Time.

    def time(self) -> float:
        return self.world.now_s + self.process.offset_s

    # asyncio asks for every handle and future. This answers False, without a call of Python's.
    get_debug = bool  # type: ignore[assignment]

    def select(self, timeout: float | None) -> tuple[()]:
        """Wait for sockets and timers."""
        world = self.world
        if timeout is not None and timeout <= 0:
            self._rounds += 1
            if self._rounds >= _ROUNDS:
                self._rounds = 0
                world.wait(_ROUNDS_S)
            return ()
        self._rounds = 0
        if not self._is_woken:
            world.wait(timeout)
        self._is_woken = False
        return ()

    def _process_events(self, events: tuple[()]) -> None:
        pass

    def _write_to_self(self) -> None:
        self._is_woken = True
        if self._main:
            self.world.wake(self._main)

    def soon(self, act: Callable[[], None]) -> None:
        """Do something in the next round, whoever asks for it."""
        if not self.process.is_dead:
            self._ready.append(Handle(act, (), self))  # type: ignore[attr-defined]
            self._write_to_self()

    def run_in_executor(self, executor: Any, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Do a job in a thread of the process."""
        future = self.create_future()

        def work() -> None:
            try:
                result = function(*arguments)
            except Exception as problem:  # noqa: BLE001 - the future has it
                done = partial(self._end_job, future, None, problem)
            else:
                done = partial(self._end_job, future, result, None)
            self.soon(done)

        self.process.start(work, "job")
        return future

    @staticmethod
    def _end_job(future: "Future[Any]", result: Any, problem: Exception | None) -> None:
        if future.done():
            return
        if problem:
            future.set_exception(problem)
        else:
            future.set_result(result)

    # Sockets.

    async def create_connection(self, protocol_factory, host=None, port=None, **options):  # type: ignore[no-untyped-def, override]
        assert not options.get("ssl"), "TLS isn't simulated"
        waiting = self.create_future()

        self.network.connect(self.process, host, port, partial(self._found, waiting))
        try:
            socket = await waiting
        except asyncio.CancelledError:
            if waiting.done() and not waiting.cancelled() and not waiting.exception():
                waiting.result().close()
            raise
        finally:
            # Its error refers to this call, so it would wait for the garbage collector.
            del waiting
        return await self._connected(protocol_factory, socket)

    def _found(self, waiting: "Future[Socket]", found: Socket | OSError) -> None:
        """A connection that ``waiting`` is for has been made, or not."""
        if isinstance(found, OSError):
            self.soon(lambda: self._end_job(waiting, None, found))
        elif waiting.cancelled() or self.process.is_dead:
            found.close()
        else:
            self.soon(lambda: self._end_job(waiting, found, None))

    async def connect_accepted_socket(self, protocol_factory, sock, **options):  # type: ignore[no-untyped-def, override]
        assert not options.get("ssl"), "TLS isn't simulated"
        return await self._connected(protocol_factory, sock)

    async def _connected(self, protocol_factory: Callable[[], Any], socket: Socket) -> tuple[Any, Any]:
        protocol = protocol_factory()
        waiting = self.create_future()
        transport = Transport(self, socket, protocol, waiting)
        try:
            await waiting
        except BaseException:
            transport.close()
            raise
        return transport, protocol

    async def sock_accept(self, sock: ListeningSocket) -> tuple[Socket, tuple[str, int]]:  # type: ignore[override]
        while True:
            with suppress(BlockingIOError):
                return sock.accept()
            waiting = self.create_future()
            sock.changed = lambda waiting=waiting: self.soon(lambda: self._end_job(waiting, None, None))  # type: ignore[misc]
            await waiting

    def remove_reader(self, fd: Any) -> bool:
        fd.changed = lambda: None
        return True


def check_connections(network: Network, newest: Socket, most_of_one: int, most: int) -> None:
    """Check how many connections the listener of the ``newest`` keeps besides those that wait: all, and of one."""
    assert newest.peer
    at = newest.peer.address
    ends = (each for link in network.links.values() for each in link.sockets)
    kept = [each for each in ends if not each.is_first and each.address == at]
    of_one, waiting = sum(each.link is newest.link for each in kept), network.listening[at].count
    network.world.keep("connections-bounded", of_one - waiting <= most_of_one, of_one)
    network.world.keep("connections-bounded", len(kept) - waiting <= most, len(kept))


def watch_memory(room: World, loop: Callable[[], SimulatedLoop | None], most_bytes: int) -> None:
    """Check again and again that whoever doesn't read costs ``loop``'s process little memory."""
    now = loop()
    if now and not now.process.is_dead:
        sizes = [each.get_write_buffer_size() for each in now.transports]
        room.keep("memory-bounded", max(sizes, default=0) <= most_bytes, sizes)
    room.after(_LOOK_S, watch_memory, room, loop, most_bytes)


class Transport(asyncio.Transport):
    """A connection of a loop, as asyncio's for sockets is one."""

    def __init__(self, loop: SimulatedLoop, socket: Socket, protocol: Any, waiting: "Future[None]") -> None:
        names = {"socket": socket, "sockname": socket.getsockname()}
        if socket.peer is not None:
            names["peername"] = socket.getpeername()
        super().__init__(names)
        self._loop = loop
        self._socket = socket
        self._protocol = protocol
        self._buffer: deque[bytes] = deque()
        self._size = 0
        self._high, self._low = _HIGH_BYTES, _HIGH_BYTES // 4
        self._is_slow = self._is_closing = self._is_lost = self._is_paused = self._is_due = self._has_ended = False
        loop.transports.add(self)
        loop.call_soon(protocol.connection_made, self)
        loop.call_soon(self._begin)
        loop.call_soon(lambda: waiting.done() or waiting.set_result(None))

    def get_protocol(self) -> Any:
        return self._protocol

    def set_protocol(self, protocol: Any) -> None:
        self._protocol = protocol

    def is_closing(self) -> bool:
        return self._is_closing

    def is_reading(self) -> bool:
        return not self._is_paused and not self._is_closing

    def pause_reading(self) -> None:
        self._is_paused = True

    def resume_reading(self) -> None:
        if self._is_paused:
            self._is_paused = False
            self._changed()

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        if high is None:
            high = _HIGH_BYTES if low is None else 4 * low
        self._high, self._low = high, high // 4 if low is None else low

    def get_write_buffer_size(self) -> int:
        return self._size

    def write(self, data: bytes | bytearray | memoryview) -> None:
        if not data or self._is_lost:
            return
        if not self._buffer:
            data = bytes(data)[self._send(bytes(data)) :]
            if not data or self._is_lost:
                return
        self._buffer.append(bytes(data))
        self._size += len(data)
        if self._size > self._high and not self._is_slow:
            self._is_slow = True
            self._protocol.pause_writing()

    def can_write_eof(self) -> bool:
        return False

    def close(self) -> None:
        if not self._is_closing:
            self._is_closing = True
            if not self._buffer:
                self._lose(None)

    def abort(self) -> None:
        self._lose(None)

    def _begin(self) -> None:
        self._socket.changed = self._changed
        self._changed()

    def _changed(self) -> None:
        """Something may be read or sent: look in the next round."""
        if not self._is_due and not self._is_lost:
            self._is_due = True
            self._loop.soon(self._look)

    def _look(self) -> None:
        self._is_due = False
        if self._is_lost:
            return
        if self._buffer:
            self._flush()
        socket = self._socket
        if self._is_lost or self._is_paused or self._is_closing:
            return
        if socket.received:
            self._read()
            if socket.received or socket.error or socket.has_ended:
                self._changed()
        elif socket.error:
            self._lose(system_error(socket.error))
        elif socket.has_ended and not self._has_ended:
            self._has_ended = True
            if not self._protocol.eof_received():
                self.close()

    def _read(self) -> None:
        socket = self._socket
        if isinstance(self._protocol, BufferedProtocol):
            buffer = self._protocol.get_buffer(-1)
            count = min(len(buffer), len(socket.received))
            buffer[:count] = socket.received[:count]
            socket.skip(count)
            self._protocol.buffer_updated(count)
        else:
            data = bytes(socket.received[:_MOST_BYTES])
            socket.skip(len(data))
            self._protocol.data_received(data)

    def _send(self, data: bytes) -> int:
        try:
            return self._socket.send(data)
        except BlockingIOError:
            return 0
        except OSError as problem:
            self._lose(problem)
            return 0

    def _flush(self) -> None:
        while self._buffer and not self._is_lost:
            first = self._buffer.popleft()
            count = self._send(first)
            self._size -= count
            if count < len(first):
                self._buffer.appendleft(first[count:])
            if self._is_slow and self._size <= self._low:
                self._is_slow = False
                self._protocol.resume_writing()
            if count < len(first):
                return
        if not self._buffer and self._is_closing:
            self._lose(None)

    def _lose(self, problem: Exception | None) -> None:
        if self._is_lost:
            return
        self._is_lost = self._is_closing = True
        self._buffer.clear()
        self._size = 0
        self._loop.transports.discard(self)
        self._loop.call_soon(self._end, problem)

    def _end(self, problem: Exception | None) -> None:
        try:
            self._protocol.connection_lost(problem)
        finally:
            self._socket.close()
