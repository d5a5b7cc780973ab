"""Addresses that were announced: how each is asked, and which of them is asked next."""

import asyncio
import ssl
from collections import Counter
from contextlib import suppress

from motorcade.fleet.contact import Contact, DriveContact
from motorcade.fleet.places import CAR, DRIVE, Place, network_place
from motorcade.sockets import LAST_PORT

# What has answered is asked in the same way so often before others are tried again.
_TRIES_ALIKE = 5
# Other ways are tried beside the first after so long without an answer, so long where it takes keys.
_ALONE_S = 0.5
_TLS_ALONE_S = 2.0
# The longest time between two tries where nothing has answered yet.
_LONGEST_PAUSE_S = 8.0


class Found:
    """An address that was announced.

    Attributes:
        host, address: where it is; HOST:PORT.
        ways: how it is asked: as a car, and as a drive server.
        announced: as what it was announced, besides classes and studios.
        tries: how many have begun since anything answered.
        again: begins the next one; None while it waits for its turn or is asked.
    """

    def __init__(self, place: Place, tls: ssl.SSLContext | None, baud: int) -> None:
        self.host = place.host
        where = network_place(place.host, place.port, place.name)._replace(found=True)
        self.address = where.address
        telemetry_port = place.telemetry_port or min(place.port + 1, LAST_PORT)
        drive = network_place(place.host, place.port, place.name, DRIVE, telemetry_port)
        self.drive = DriveContact(drive._replace(found=True), tls, baud)
        self.ways: tuple[Contact, Contact] = (Contact(where, tls, baud), self.drive)
        if tls:
            self._alone_s = _TLS_ALONE_S
        else:
            self._alone_s = _ALONE_S
        self.announced: set[str] = set()
        self.tries = 0
        self.again: asyncio.TimerHandle | None = None

    @property
    def was_tried(self) -> bool:
        return any(way.is_known.is_set() for way in self.ways)

    @property
    def has_answered(self) -> bool:
        return any(way.has_answered for way in self.ways)

    @property
    def pause_s(self) -> float:
        """How long until the next try: ever longer where nothing has answered yet."""
        pause_s = max(way.pause_s for way in self.ways)
        if self.has_answered:
            return pause_s
        return min(pause_s * 2.0**self.tries, _LONGEST_PAUSE_S)

    def announce(self, place: Place) -> None:
        if place.kind in (CAR, DRIVE):
            self.announced.add(place.kind)
        if place.kind == DRIVE:
            self.drive.add_telemetry_port(place.telemetry_port)

    def shown(self) -> list[Contact]:
        """Return what it answers as; else as what it was announced."""
        answered = [way for way in self.ways if way.has_answered]
        return answered or [way for way in self.ways if way.place.kind in self.announced]

    async def attempt(self) -> None:
        """Ask once in each way, until it answers one and while it does; first as what it answered, or was announced."""
        shown = self.shown()
        changed = asyncio.Event()
        ways = sorted(self.ways, key=lambda way: way not in shown)
        if self.has_answered and self.tries < _TRIES_ALIKE:
            ways = shown
        self.tries += 1
        asking: dict[Contact, asyncio.Task[None]] = {}

        async def until_answered(within_s: float | None) -> None:
            with suppress(TimeoutError):
                async with asyncio.timeout(within_s):
                    while not all(task.done() for task in asking.values()) and not any(way.answers for way in asking):
                        changed.clear()
                        await changed.wait()

        try:
            for way in ways:
                # The next one begins beside it.
                way.answered = changed.set
                asking[way] = asyncio.create_task(way.attempt())
                asking[way].add_done_callback(lambda _: changed.set())
                await until_answered(self._alone_s)
                if way.answers or not way.was_reached:
                    break
            await until_answered(None)
            if answering := [task for way, task in asking.items() if way.answers]:
                self.tries = 0
                for task in asking.values():
                    if task is not answering[0]:
                        task.cancel()
                await asyncio.wait(answering)
        finally:
            for task in asking.values():
                task.cancel()
            await asyncio.wait(asking.values())

    def cancel(self) -> None:
        if self.again:
            self.again.cancel()
            self.again = None


class Turns:
    """Addresses by their hosts, those that wait for a try and those that have one. Pure.

    It is the turn of one host after the other, and at each of the address that waited longest. So whoever announces
    much, or first, waits as long as all others do.
    """

    def __init__(self) -> None:
        # Dicts keep their order: the host, and its address, whose turn comes next is the first.
        self._waiting: dict[str, dict[str, None]] = {}
        self._running: dict[str, dict[str, None]] = {}
        self._counts: Counter[str] = Counter()

    def __len__(self) -> int:
        """How many addresses have a try now."""
        return self._counts.total()

    @property
    def host(self) -> str:
        """The host whose turn is next; empty where none waits."""
        return next(iter(self._waiting), "")

    def wait(self, host: str, address: str) -> None:
        """Let an address wait for its turn, behind the others of its host."""
        self.forget(host, address)
        self._waiting.setdefault(host, {})[address] = None

    def begin(self) -> str:
        """Return the address whose turn it is; it has a try from now on, until it waits or is forgotten."""
        host = self.host
        waiting = self._waiting.pop(host)
        address = next(iter(waiting))
        del waiting[address]
        if waiting:
            self._waiting[host] = waiting
        self._running.setdefault(host, {})[address] = None
        self._counts[host] += 1
        return address

    def forget(self, host: str, address: str) -> None:
        """Forget an address, whether it waits or has a try."""
        for places in (self._waiting, self._running):
            found = places.get(host, {})
            if address in found:
                del found[address]
                self._counts[host] -= places is self._running
            if not found:
                places.pop(host, None)

    def most(self) -> list[str]:
        """Return the addresses that have a try of the host that has most, the longest first.

        Empty where the host whose turn is next would have as many if one of them gave way to it.
        """
        ((host, count),) = self._counts.most_common(1) or [("", 0)]
        if count > self._counts[self.host] + 1:
            return list(self._running[host])
        return []
