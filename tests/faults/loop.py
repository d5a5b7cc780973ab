"""asyncio's event loop in a simulated process: its clock, timers, threads and sockets are the world's.

Everything else is asyncio's own: the same code runs tasks, callbacks and transports as with real sockets.
"""

import asyncio
import sys
from asyncio import Future
from asyncio.selector_events import BaseSelectorEventLoop
from collections.abc import Callable, Coroutine
from contextlib import AbstractContextManager, nullcontext, suppress
from functools import partial
from typing import Any

from tests.faults.network import Network, Socket
from tests.faults.selector import Selector
from tests.faults.world import Lock, Process, World

_MOST_CLOSINGS = 20
# How often memory is looked at.
_LOOK_S = 0.25


class SimulatedLoop(BaseSelectorEventLoop):
    """The loop of a process, which `run` begins in a thread of its own."""

    def __init__(self, process: Process, network: Network) -> None:
        self.process = process
        self.world = process.world
        self.network = network
        self._files = Selector(process.world)
        super().__init__(self._files)
        self._clock_resolution = 1e-6
        # The tasks of a process that was killed: they do nothing, but the garbage collector would end them noisily.
        self._left: list[asyncio.Task[Any]] = []
        self._turns: dict[int, Lock] = {}
        # Jobs begin so much later: the computer is busy.
        self.late_s = 0.0
        process.at_end.append(lambda: self._left.extend(asyncio.all_tasks(self)))
        process.at_close.append(self.abandon)

    def run(self, main: Callable[[], Coroutine[Any, Any, Any]]) -> None:
        """Run a coroutine in the process."""

        def begin() -> None:
            # No loop runs in this thread yet. Were the hooks of another one set, this one would keep them for its end,
            # in a tuple that the garbage collector doesn't see: whatever they refer to would stay for ever.
            asyncio.events._set_running_loop(None)
            sys.set_asyncgen_hooks(None, None)
            assert self.world.current
            self.world.current.loop = self.world.running_loop = self
            self.run_until_complete(main())

        self.process.start(begin, "loop")

    def enter(self) -> None:
        """Be the loop that runs now: all loops of a world share one thread of the system."""
        asyncio.events._set_running_loop(self)
        sys.set_asyncgen_hooks(self._asyncgen_firstiter_hook, self._asyncgen_finalizer_hook)  # type: ignore[attr-defined]

    def abandon(self) -> None:
        """Forget all tasks without a word."""
        asyncio.events._set_running_loop(self)
        for transport in self.transports():
            transport._sock = None
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

    def _make_self_pipe(self) -> None:
        """Nothing of the system wakes it."""

    def _write_to_self(self) -> None:
        self._files.wake()

    def soon(self, act: Callable[[], None]) -> None:
        """Do something in the next round, whoever asks for it."""
        if not self.process.is_dead:
            self.call_soon_threadsafe(act)

    def run_in_executor(self, executor: Any, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Do a job in a thread of the process."""
        future = self.create_future()
        turn = self._turn_of(executor)
        late_s = self.late_s

        def work() -> None:
            try:
                if late_s:
                    self.world.sleep(late_s)
                with turn:
                    result = function(*arguments)
            except Exception as problem:  # noqa: BLE001 - the future has it
                done = partial(self._end_job, future, None, problem)
            else:
                done = partial(self._end_job, future, result, None)
            self.soon(done)

        self.process.start(work, "job")
        return future

    def _turn_of(self, executor: Any) -> AbstractContextManager[Any]:
        """What the jobs of an executor with one thread take turns by; others wait for none."""
        if getattr(executor, "_max_workers", 0) != 1:
            return nullcontext()
        return self._turns.setdefault(id(executor), Lock())

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
        if (opened := options.get("sock")) is not None:
            return await self.connect_accepted_socket(protocol_factory, opened)
        waiting = self.create_future()

        name = (options.get("local_addr") or [self.process.name])[0]
        self.network.connect(self.process, host, port, partial(self._found, waiting), name)
        try:
            socket = await waiting
        except asyncio.CancelledError:
            if waiting.done() and not waiting.cancelled() and not waiting.exception():
                waiting.result().close()
            raise
        finally:
            # Its error refers to this call, so it would wait for the garbage collector.
            del waiting
        if tls := options.get("ssl"):
            limits = {name: options.get(name) for name in ("ssl_handshake_timeout", "ssl_shutdown_timeout")}
            name = options.get("server_hostname") or host
            return await self._create_connection_transport(socket, protocol_factory, tls, name, **limits)  # type: ignore[attr-defined]
        return await self.connect_accepted_socket(protocol_factory, socket)

    def _found(self, waiting: "Future[Socket]", found: Socket | OSError) -> None:
        """A connection that ``waiting`` is for has been made, or not."""
        if isinstance(found, OSError):
            self.soon(lambda: self._end_job(waiting, None, found))
        elif waiting.cancelled() or self.process.is_dead:
            found.close()
        else:
            self.soon(lambda: self._end_job(waiting, found, None))

    def transports(self) -> list[Any]:
        """The open connections."""
        return list(self._transports.values())  # type: ignore[attr-defined]


def _host_of(socket: Socket | None) -> str:
    return socket.address[0] if socket else ""


def check_connections(network: Network, newest: Socket, most_of_one: int, most: int) -> None:
    """Check how many connections the listener of the ``newest`` keeps besides those that wait: all, and of one."""
    assert newest.peer
    at = newest.peer.address
    ends = (each for link in network.links.values() for each in link.sockets)
    kept = [each for each in ends if not each.is_first and each.address == at]
    # Browsers of a room share its network, and each has an address of its own.
    of_one = sum(each.link is newest.link and _host_of(each.peer) == _host_of(newest) for each in kept)
    waiting = network.listening[at].count
    network.world.keep("connections-bounded", of_one - waiting <= most_of_one, of_one)
    network.world.keep("connections-bounded", len(kept) - waiting <= most, len(kept))


def watch_memory(room: World, loop: Callable[[], SimulatedLoop | None], most_bytes: int) -> None:
    """Check again and again that whoever doesn't read costs ``loop``'s process little memory."""
    now = loop()
    if now and not now.process.is_dead:
        sizes = [each.get_write_buffer_size() for each in now.transports()]
        room.keep("memory-bounded", max(sizes, default=0) <= most_bytes, sizes)
    room.after(_LOOK_S, watch_memory, room, loop, most_bytes)
