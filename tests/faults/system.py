"""What production code takes from the system without an argument, replaced at the border of its modules.

Clocks, chance, paths, ports and boards reach production code as arguments. Threads, processes, fsync and serial ports
it imports: while a scenario runs, these names in these modules are the simulated world's.
"""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

from anyio import CancelScope, from_thread
from anyio._backends._asyncio import AsyncIOBackend
from tests.faults.disk import Disk
from tests.faults.world import Event, Lock, Thread, current, here, world

from motorcade.config import files

Replaced = dict[tuple[Any, str], Any]


class _Threads:
    """`threading`, as far as Motorcade uses it."""

    Event = Event
    Lock = Lock

    class Thread:
        def __init__(self, target: Any, name: str = "thread", args: tuple[Any, ...] = (), daemon: bool = False) -> None:
            self._target = lambda: target(*args)
            self._name = name
            self._thread: Thread | None = None

        def start(self) -> None:
            self._thread = here().start(self._target, self._name)

        def is_alive(self) -> bool:
            return self._thread is not None and not self._thread.is_over

        def join(self, timeout: float | None = None) -> None:
            if self._thread is not None:
                world().wait_for(lambda: not self.is_alive(), self._thread.joining, timeout)


THREADS = _Threads()


class Time:
    """`time`: the clock of the process that asks."""

    @staticmethod
    def monotonic() -> float:
        return world().now_s + here().offset_s

    time = monotonic

    @staticmethod
    def monotonic_ns() -> int:
        return int(Time.monotonic() * 1e9)

    @staticmethod
    def sleep(seconds: float) -> None:
        world().sleep(seconds)


def disk_functions(disk: Disk) -> Any:
    """`os`, with files of a simulated disk."""

    def opened(path: Any, flags: int) -> int:
        return disk.open(path)

    return SimpleNamespace(fsync=disk.fsync, open=opened, close=lambda handle: None, O_RDONLY=os.O_RDONLY)


async def _run_in_thread(
    cls: Any, function: Any, arguments: Any, abandon_on_cancel: bool = False, limiter: Any = None
) -> Any:
    """Do a job in a simulated thread, as anyio does it in one of its own."""
    import asyncio

    await cls.checkpoint()
    async with limiter or cls.current_default_thread_limiter():
        with CancelScope(shield=not abandon_on_cancel):
            return await asyncio.get_running_loop().run_in_executor(None, function, *arguments)


def _run_in_loop(function: Any, *arguments: Any) -> Any:
    """Call a function in the loop of the process, for a thread that waits for it, as anyio does."""
    room, thread = world(), world().current
    assert thread is not None
    done: list[tuple[Any, BaseException | None]] = []

    def call() -> None:
        try:
            done.append((function(*arguments), None))
        except Exception as problem:  # noqa: BLE001 - the thread has it
            done.append((None, problem))
        room.wake(thread)

    loop: Any = next(each.loop for each in thread.process.threads if each.loop is not None)
    loop.soon(call)
    while not done:
        room.wait()
    result, problem = done[0]
    if problem is not None:
        raise problem
    return result


@contextmanager
def replaced(names: Replaced) -> Iterator[None]:
    """Replace names of modules while the block runs."""
    before = {(module, name): getattr(module, name) for module, name in names}
    for (module, name), value in names.items():
        setattr(module, name, value)
    try:
        yield
    finally:
        for (module, name), value in before.items():
            setattr(module, name, value)


def on_disk(disk: Disk) -> Replaced:
    """What files need: a disk whose folders are written by fsync, as those of POSIX systems are."""
    return {(files, "os"): disk_functions(disk), (files, "sys"): SimpleNamespace(platform="posix")}


def in_threads() -> Replaced:
    """What jobs in threads need."""
    return {
        (AsyncIOBackend, "run_sync_in_worker_thread"): classmethod(_run_in_thread),
        (from_thread, "run_sync"): _run_in_loop,
    }


class _Log(logging.Handler):
    """What a server logs of its own faults breaks a promise."""

    def emit(self, record: logging.LogRecord) -> None:
        room = current()
        process = room.current.process if room and room.current else None
        if room and record.exc_info and process and not process.is_dead:
            room.problem(f"log: {record.getMessage()}", record.exc_info[1] or RuntimeError(record.getMessage()))


@contextmanager
def logs_read() -> Iterator[None]:
    """Read what servers log; afterwards the loggers are as before, as a killed server would have left them."""
    logs = [logging.getLogger(name) for name in ("asyncio", "uvicorn.error")]
    before = [(log.handlers, log.filters, log.propagate) for log in logs]
    for log in logs:
        log.handlers, log.filters, log.propagate = [_Log()], [], False
    try:
        yield
    finally:
        for log, (handlers, filters, propagate) in zip(logs, before, strict=True):
            log.handlers, log.filters, log.propagate = handlers, filters, propagate
