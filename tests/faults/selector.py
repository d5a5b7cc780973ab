"""What simulated programs wait for: files, which are sockets, and selectors of them."""

from collections.abc import Callable
from functools import partial
from selectors import EVENT_READ, EVENT_WRITE, SelectorKey, SelectSelector
from socket import SOCK_STREAM
from typing import Any

from tests.faults.world import Thread, World

# A program that is never idle takes this long for so many rounds.
_ROUNDS, _ROUNDS_S = 50, 0.001


class File:
    """What a program has a number for, and a `Selector` waits for.

    Attributes:
        changed: called when there is something to read, or room to send.
    """

    family, type, proto = 0, SOCK_STREAM, 0
    changed: Callable[[], None]
    is_readable = is_writable = False

    def __init__(self, world: World) -> None:
        self._number = len(world.files)
        world.files.append(self)
        self.changed = lambda: None

    def fileno(self) -> int:
        return self._number

    def setblocking(self, blocks: bool) -> None:
        assert not blocks


class Selector(SelectSelector):
    """A selector of simulated sockets."""

    def __init__(self, world: World) -> None:
        super().__init__()
        self._world = world
        self._waiting: Thread | None = None
        self._rounds = 0
        # The files that may be ready, in an order that is the same in each run.
        self._changed: dict[int, None] = {}

    def register(self, fileobj: Any, events: int, data: Any = None) -> SelectorKey:
        key = super().register(fileobj, events, data)
        self._world.files[key.fd].changed = partial(self.wake, key.fd)
        self._changed[key.fd] = None
        return key

    def unregister(self, fileobj: Any) -> SelectorKey:
        key = super().unregister(fileobj)
        self._world.files[key.fd].changed = lambda: None
        self._changed.pop(key.fd, None)
        return key

    def wake(self, file: int | None = None) -> None:
        """End `select`, for a file that may be ready or without one."""
        if file is not None:
            self._changed[file] = None
        if self._waiting:
            self._world.wake(self._waiting)

    def select(self, timeout: float | None = None) -> list[tuple[SelectorKey, int]]:
        ready = self._ready()
        if ready or (timeout is not None and timeout <= 0):
            self._rounds = (self._rounds + 1) % _ROUNDS
            if not self._rounds:
                self._world.wait(_ROUNDS_S)
            return ready
        self._rounds, self._waiting = 0, self._world.current
        self._world.wait(timeout)
        self._waiting = None
        return self._ready()

    def _ready(self) -> list[tuple[SelectorKey, int]]:
        ready: list[tuple[SelectorKey, int]] = []
        if not self._changed:
            return ready
        # Not by `get_key`, which looks for a number among all of them.
        keys = self._fd_to_key  # type: ignore[attr-defined]
        for number in list(self._changed):
            key, file = keys[number], self._world.files[number]
            events = (EVENT_READ if file.is_readable else 0) | (EVENT_WRITE if file.is_writable else 0)
            if events & key.events:
                ready.append((key, events & key.events))
            else:
                del self._changed[number]
        return ready
