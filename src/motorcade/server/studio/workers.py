"""Answer requests in processes of their own: one that takes too much CPU time, or whose sender left, is killed.

Such a process computes, and has no folder, port or network: what it needs of these it asks this process for.
"""

import asyncio
import multiprocessing
import os
import signal
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from threading import Event
from typing import Any, cast

import psutil
from anyio import CapacityLimiter, to_thread

from motorcade.errors import MotorcadeError
from motorcade.service.messages import Nothing
from motorcade.service.missions import warm_up
from motorcade.service.requests import REQUESTS, Context, respond

# Each process that computes delays the pictures of all worlds, so few requests are answered at once; those that may
# take longer than others keep no other waiting.
_AT_ONCE = 2
CHECK = "missions/check"
_LOOK_EVERY_S = 0.05
_POLITENESS = 5
_SPAWN = multiprocessing.get_context("spawn")


class _Worker:
    """A process that answers one request after another."""

    def __init__(self) -> None:
        self.pipe, theirs = _SPAWN.Pipe()
        self._process = _SPAWN.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()
        try:
            self._usage = psutil.Process(self._process.pid)
            # It is ready.
            self.pipe.recv()
        except BaseException:
            self.kill()
            raise

    def cpu_s(self) -> float:
        """The CPU time that it has used."""
        times = self._usage.cpu_times()
        return times.user + times.system

    def kill(self) -> None:
        self._process.kill()
        self._process.join()
        self.pipe.close()


# They hold nothing of a request, so all servers of this process share those that wait.
_waiting: list[_Worker] = []


class Workers:
    """The processes of a server."""

    def __init__(self) -> None:
        self._limiter = CapacityLimiter(_AT_ONCE)
        self._light = CapacityLimiter(_AT_ONCE)
        self._checks = CapacityLimiter(1)
        self._starting: asyncio.Task[None] | None = None

    async def answer(self, name: str, data: bytes, context: Context, most_s: float) -> bytes:
        """Answer a request of `motorcade.service.requests` within ``most_s`` seconds of CPU time.

        Cancelling kills the process. Raises MotorcadeError, "request-too-heavy" where the time isn't enough.
        """
        if name not in REQUESTS or REQUESTS[name].message is Nothing:
            # Such a request holds nothing that takes long; a page begins with some, and the processes start meanwhile.
            if not _waiting and self._starting is None:
                self._starting = asyncio.create_task(to_thread.run_sync(_start_early, limiter=self._checks))
            return await to_thread.run_sync(respond, name, data, context, limiter=self._light)
        given_up = Event()
        job = partial(answer_in_process, name, data, context, most_s, given_up)
        try:
            return await to_thread.run_sync(job, limiter=self._checks if name == CHECK else self._limiter)
        finally:
            given_up.set()


def answer_in_process(name: str, data: bytes, context: Context, most_s: float, given_up: Event) -> bytes:
    """Answer a request in a process; wait for it. Raises MotorcadeError."""
    if given_up.is_set():
        return b""
    try:
        worker = _idle_or_new()
        try:
            kind, value = _ask(worker, name, data, context, most_s, given_up)
        except BaseException:
            worker.kill()
            raise
    except (EOFError, OSError, psutil.Error):
        # The system has ended the process, for its memory say, or starts none.
        raise MotorcadeError("request-too-heavy", seconds=most_s) from None
    _waiting.append(worker)
    if kind == "answer":
        return cast(bytes, value)
    raise value if isinstance(value, MotorcadeError) else RuntimeError(value)


def _start_early() -> None:
    # Where it fails, the request that needs it says so.
    with suppress(EOFError, OSError, psutil.Error):
        _waiting.append(_Worker())


def _idle_or_new() -> _Worker:
    try:
        return _waiting.pop()
    except IndexError:
        return _Worker()


def _ask(
    worker: _Worker, name: str, data: bytes, context: Context, most_s: float, given_up: Event
) -> tuple[str, object]:
    """Return what a process answers: its kind, and bytes, an error or a traceback. Raises MotorcadeError."""
    worker.pipe.send((name, context.capabilities, context.owner))
    worker.pipe.send_bytes(data)
    began_s = worker.cpu_s()
    while True:
        while not worker.pipe.poll(_LOOK_EVERY_S):
            if given_up.is_set() or worker.cpu_s() - began_s > most_s:
                raise MotorcadeError("request-too-heavy", seconds=most_s)
        kind, *values = worker.pipe.recv()
        if kind != "call":
            return kind, values[0]
        called, arguments, named = values
        if called == "ports":
            function = context.ports
        else:
            function = getattr(context.storage, called)
        try:
            worker.pipe.send((True, function(*arguments, **named)))
        except MotorcadeError as problem:
            worker.pipe.send((False, problem))


class _FarStorage:
    """The storage of the process that asks."""

    def __init__(self, pipe: Any) -> None:
        self._pipe = pipe

    def __getattr__(self, name: str) -> Callable[..., Any]:
        return partial(_call, self._pipe, name)


def _call(pipe: Any, name: str, *arguments: object, **named: object) -> Any:
    pipe.send(("call", name, arguments, named))
    is_done, value = pipe.recv()
    if not is_done:
        raise value
    return value


def _serve(pipe: Any) -> None:
    """Answer requests, in a process that ends with the server."""
    # Ctrl-C is for the server.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(_POLITENESS)
    # The first check of a program would count the time in which the engine is loaded.
    warm_up()
    with suppress(EOFError, OSError):
        pipe.send(None)
        while True:
            name, capabilities, owner = pipe.recv()
            data = pipe.recv_bytes()
            context = Context(capabilities, cast(Any, _FarStorage(pipe)), partial(_call, pipe, "ports"), owner)
            pipe.send(_answered(name, data, context))


def _answered(name: str, data: bytes, context: Context) -> tuple[str, object]:
    try:
        return "answer", respond(name, data, context)
    except MotorcadeError as problem:
        return "problem", problem
    except Exception:  # noqa: BLE001  # the server raises and logs it
        return "fault", traceback.format_exc()
