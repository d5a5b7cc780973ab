"""A simulated computer room: one clock, and processes whose threads run one at a time, in an order that a seed gives.

A thread is a greenlet: it runs until it waits, and then the next one runs whose time has come. No thread of the system,
no clock and no chance beside the seed takes part, so the same seed gives the same run. A process can be frozen or
killed at any of its waits; what a killed process would still do never happens.
"""

import asyncio
import sys
from collections import Counter, deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from hashlib import sha256
from heapq import heappop, heappush
from random import Random
from typing import Any, Protocol

from greenlet import GreenletExit, getcurrent, greenlet

_now: "World | None" = None
# So many steps without a change of time are no work, but a circle.
_MOST_STEPS_AT_ONCE = 20_000
_LOOK_S = 0.25


# What goes wrong, and its chance.
Faults = Sequence[tuple[float, Callable[[], object]]]


class BrokenPromiseError(AssertionError):
    """A promise did not hold; ``promise`` names it."""

    def __init__(self, promise: str, what: str) -> None:
        super().__init__(f"{promise}: {what}")
        self.promise = promise


class Loop(Protocol):
    """An event loop that runs in a thread."""

    def enter(self) -> None:
        """Be the loop that runs now."""


class Process:
    """A program that runs, its threads, and what the system closes when it ends.

    Attributes:
        offset_s: what its clock shows at the beginning: clocks of two computers differ.
        lateness_s: so much later than it asked for a thread may be woken.
        at_end: called when it ends, however that happens.
        at_close: called when the world ends.
    """

    def __init__(self, world: "World", name: str, lateness_s: float = 0.001, offset_s: float = 0.0) -> None:
        self.world = world
        self.name = name
        self.offset_s = offset_s
        self.lateness_s = lateness_s
        self.random = Random(f"{world.seed} {name}")
        self.is_dead = False
        self.frozen_until_s = 0.0
        self.threads: list[Thread] = []
        self.at_end: list[Callable[[], None]] = []
        self.at_close: list[Callable[[], None]] = []
        world.processes.append(self)

    def start(self, target: Callable[[], object], name: str = "main") -> "Thread":
        """Start a thread."""
        thread = Thread(self, target, name)
        self.threads.append(thread)
        self.world.wake(thread)
        return thread

    def freeze(self, seconds: float) -> None:
        """Run none of its threads for a time."""
        self.world.note("freeze", self.name, round(seconds, 4))
        self.frozen_until_s = max(self.frozen_until_s, self.world.now_s + seconds)

    def end(self) -> None:
        """End at once, as a killed process does."""
        if self.is_dead:
            return
        self.world.note("end", self.name)
        self.is_dead = True
        for act in list(self.at_end):
            act()


class Thread:
    """A thread of a process; it waits, or runs now."""

    def __init__(self, process: Process, target: Callable[[], object], name: str) -> None:
        self.process = process
        self.name = name
        self.is_over = False
        self.token = 0
        self.waits = True
        self.joining: list[Thread] = []
        # The event loop that runs in it.
        self.loop: Loop | None = None
        self._target = target
        self.greenlet = greenlet(self._run, process.world.hub)

    def _run(self, woken: object = None) -> None:
        world = self.process.world
        try:
            self._target()
        except GreenletExit:
            raise
        except BaseException as problem:  # noqa: BLE001 - whatever ends a thread is a fault of the program
            if not self.process.is_dead:
                world.problem(f"{self.process.name}, {self.name}", problem)
        self.is_over = True
        for thread in self.joining:
            world.wake(thread)


class World:
    """Time, chance, processes and what happened.

    Args:
        seed: what all chance comes from.
        kind: of the scenario.

    Attributes:
        now_s: the time.
        random: for what isn't drawn by a process or a connection of its own.
        checks: called whenever time has passed, with what was so until now; they raise `BrokenPromiseError`.
        is_healed: whether nothing goes wrong any more.
        is_over: whether all has been done.
        tried: how often each promise was tried, by its name.
        asked: which requests were sent, and how each of them ended.
        broken: the promise that was broken first.
    """

    def __init__(self, seed: int, kind: str) -> None:
        self.seed = f"{kind} {seed}"
        self.random = Random(self.seed)
        self.now_s = 0.0
        self.current: Thread | None = None
        self.checks: list[Callable[[], None]] = []
        self.tried = Counter[str]()
        self.counts = Counter[str]()
        # What programs have copied of a peer's bytes.
        self.moved_bytes = 0
        self.asked: set[tuple[str, str]] = set()
        self.is_over = self.is_healed = False
        self.broken: BaseException | None = None
        self.processes: list[Process] = []
        # Sockets, by their numbers.
        self.files: list[Any] = []
        self.last: deque[str] = deque(maxlen=400)
        self._digest = sha256()
        self._due: list[tuple[float, int, Callable[..., None], tuple[Any, ...]]] = []
        self._number = 0
        self.hub = getcurrent()
        self._hooks = sys.get_asyncgen_hooks()
        self.running_loop: Loop | None = None

    # What happened.

    def note(self, *what: object) -> None:
        """Write a line into the trace."""
        line = f"{self.now_s:.6f} {' '.join(map(str, what))}"
        self.last.append(line)
        self._digest.update(line.encode())

    def digest(self) -> str:
        """Two runs that have the same one did the same."""
        return self._digest.hexdigest()[:16]

    def count(self, what: str, times: int = 1) -> None:
        """Count a fault that was made."""
        self.counts[what] += times

    def keep(self, promise: str, holds: bool, what: object = "", *values: object) -> None:
        """Try a promise; raises `BrokenPromiseError` where it doesn't hold, with ``what``, a format of ``values``."""
        self.tried[promise] += 1
        if not holds:
            problem = BrokenPromiseError(promise, str(what).format(*values) if values else str(what))
            # The program in which it is noticed may catch all errors.
            self.broken = self.broken or problem
            raise problem

    def problem(self, where: str, problem: BaseException) -> None:
        """Note an error that a program didn't handle."""
        if isinstance(problem, BrokenPromiseError):
            self.broken = self.broken or problem
        if self.broken is None:
            error = BrokenPromiseError("no-traceback", f"{where}: {type(problem).__name__}: {problem}")
            error.__cause__ = problem
            self.broken = error

    # Time.

    def at(self, when_s: float, act: Callable[..., None], *arguments: object) -> None:
        """Do something at a time."""
        self._number += 1
        heappush(self._due, (when_s, self._number, act, arguments))

    def after(self, seconds: float, act: Callable[..., None], *arguments: object) -> None:
        """Do something after a time."""
        self.at(self.now_s + seconds, act, *arguments)

    def plan(self, random: Random, faults: Faults, begin_s: float, end_s: float) -> None:
        """Draw which of ``faults`` happen, by the chance of each, and when; none does once all is healed."""
        for chance, act in faults:
            if random.random() < chance:
                self.at(random.uniform(begin_s, end_s), self.unless_healed, act)

    def unless_healed(self, act: Callable[[], object]) -> None:
        """Do something that goes wrong, unless nothing does any more."""
        if not self.is_healed:
            act()

    def run(self, until_s: float) -> None:
        """Let time pass, until a time or until all is over. Raises the first promise that is broken."""
        global _now
        _now, due, at_once = self, self._due, 0
        while due and due[0][0] <= until_s and self.broken is None and not self.is_over:
            when_s, _, act, arguments = heappop(due)
            if when_s > self.now_s:
                self.now_s, at_once = when_s, 0
                self._check()
            at_once += 1
            if at_once > _MOST_STEPS_AT_ONCE:
                raise BrokenPromiseError("goes-on", f"nothing passes at {self.now_s}: {self.last[-1]}")
            act(*arguments)
        if self.broken is None:
            self._check()
        if self.broken is not None:
            raise self.broken

    def _check(self) -> None:
        for check in self.checks:
            check()

    def close(self) -> None:
        """End all that is left; nothing of it does anything any more."""
        global _now
        asyncio.events._set_running_loop(None)
        self._due.clear()
        for process in self.processes:
            process.is_dead = True
        for thread in [each for process in self.processes for each in process.threads]:
            if thread.greenlet and not thread.is_over:
                # Whatever it would still do at its end concerns nobody.
                with suppress(BaseException):
                    thread.greenlet.throw()
        for process in self.processes:
            for act in process.at_close:
                act()
        # Each loop has set its own.
        sys.set_asyncgen_hooks(*self._hooks)
        _now = None

    # Threads.

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait until somebody wakes the thread that runs now, or for a time. Returns whether it was woken."""
        thread = self.current
        if thread is None or thread.process.is_dead:
            raise GreenletExit
        thread.token += 1
        thread.waits = True
        if timeout_s is not None:
            late_s = thread.process.random.random() * thread.process.lateness_s
            self.at(self.now_s + (max(0.0, timeout_s) + late_s), self._resume, thread, thread.token, False)
        return bool(self.hub.switch())

    def wait_for(self, holds: Callable[[], bool], waiting: list[Thread], timeout_s: float | None = None) -> bool:
        """Wait until ``holds``, or for a time; who makes it so wakes the threads in ``waiting``. Returns whether."""
        end_s = None if timeout_s is None else self.now_s + timeout_s
        while not holds():
            left_s = None if end_s is None else end_s - self.now_s
            if left_s is not None and left_s <= 0:
                return False
            assert self.current
            waiting.append(self.current)
            self.wait(left_s)
            waiting.remove(self.current)
        return True

    def sleep(self, seconds: float) -> None:
        """Wait for a time that nobody ends."""
        end_s = self.now_s + seconds
        while self.now_s < end_s:
            self.wait(end_s - self.now_s)

    def wake(self, thread: Thread) -> None:
        """Wake a thread that waits."""
        if thread.waits and not thread.is_over and not thread.process.is_dead:
            thread.waits = False
            thread.token += 1
            self.at(self.now_s, self._resume, thread, thread.token, True)

    def _resume(self, thread: Thread, token: int, woken: bool) -> None:
        process = thread.process
        if thread.token != token or thread.is_over or process.is_dead:
            return
        if process.frozen_until_s > self.now_s:
            # It may be thawed before.
            again_s = min(process.frozen_until_s, self.now_s + _LOOK_S)
            self.at(again_s, self._resume, thread, token, woken)
            return
        thread.waits = False
        thread.token += 1
        self.current = thread
        if thread.loop is not None and thread.loop is not self.running_loop:
            self.running_loop = thread.loop
            thread.loop.enter()
        try:
            thread.greenlet.switch(woken)
        finally:
            self.current = None


def world() -> World:
    """The world that runs now."""
    assert _now is not None, "no world runs"
    return _now


def current() -> World | None:
    """The world that runs now; None where none does."""
    return _now


def here() -> Process:
    """The process that runs now."""
    thread = world().current
    assert thread is not None
    return thread.process


class Lock:
    """A lock of threads, as `threading.Lock` is one."""

    def __init__(self) -> None:
        self._owner: Thread | None = None
        self._waiting: list[Thread] = []

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        room = world()
        limit_s = 0.0 if not blocking else None if timeout < 0 else timeout
        if not room.wait_for(lambda: self._owner is None, self._waiting, limit_s):
            return False
        self._owner = room.current
        return True

    def release(self) -> None:
        self._owner = None
        if self._waiting and _now is not None:
            _now.wake(self._waiting[0])

    def locked(self) -> bool:
        return self._owner is not None

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()


class Event:
    """A flag that threads wait for, as `threading.Event` is one."""

    def __init__(self) -> None:
        self._is_set = False
        self._waiting: list[Thread] = []

    def is_set(self) -> bool:
        return self._is_set

    def set(self) -> None:
        self._is_set = True
        for thread in self._waiting:
            world().wake(thread)

    def clear(self) -> None:
        self._is_set = False

    def wait(self, timeout: float | None = None) -> bool:
        return world().wait_for(self.is_set, self._waiting, timeout)
