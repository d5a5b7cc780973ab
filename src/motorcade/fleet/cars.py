"""Many cars: all are asked, loaded, stopped and let go side by side; nobody waits for those that are away.

They are found by multicast DNS (RFC 6762, 6763) and at serial ports.

An announcement is a stranger's word: it says where something may be, and the address itself has to answer what that is.
So each address that was ever announced is asked as a car and as a drive server, whatever it was announced as, until it
answers in one of these ways; no later announcement or withdrawal changes that. Only so many are asked at once, hosts in
turn (`motorcade.fleet.found`). Whoever announces more than is kept gives up places before others do, and
`Cars.problem` says that the list isn't whole.
"""

import asyncio
import ipaddress
import re
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from contextlib import asynccontextmanager, nullcontext, suppress
from functools import partial
from time import monotonic
from typing import TYPE_CHECKING, Any, Self

from motorcade.drive.keys import DriverContext
from motorcade.errors import MotorcadeError
from motorcade.extras import install_command
from motorcade.fleet.contact import CarStatus, Contact, DriveContact, Verdict
from motorcade.fleet.found import Found, Turns
from motorcade.fleet.places import CLASS, DRIVE, SERVICE, STUDIO, Place, check_name, network_place, safe_name
from motorcade.sockets import LAST_PORT
from motorcade.upload.serial_port import BOARD, ports
from motorcade.upload.transfer import NEW
from motorcade.words.request import NAME

if TYPE_CHECKING:
    from zeroconf.asyncio import AsyncZeroconf

# So many places that somebody named are kept, and so many addresses that were announced.
MOST_CARS = 2048
MOST_FOUND = 2 * MOST_CARS
_MOST_AT_ONCE = 128
# So many of them begin at once, so that others who use the event loop notice nothing.
_BEGIN_AT_ONCE = 64
# So many cars are loaded at once; more doesn't pay (`benchmarks/room.py`).
_AT_ONCE = 64
_LOOK_S = 0.02
# So many classes and studios are shown.
_MOST_OTHERS = 64
# So many announcements wait until they are looked up; an incomplete one, for which others have to be asked, waits for
# one of the places where that is done.
_MOST_WAITING = 4096
_MOST_LOOKED_UP = 32
_LOOK_UP_MS = 2000
# So many addresses of one record are believed.
_MOST_HOSTS = 16
_PORTS_EVERY_S = 1.0
ALL = "all"


class NoSuchCarError(MotorcadeError):
    """No car of that name was found."""


class Cars:
    """The cars at many places, connected while the block runs: ``async with Cars(places) as cars: ...``.

    Args:
        places: where cars are known to be; `add` takes more.
        tls: a driver's keys, for cars that require them (`motorcade.drive.keys.client_context`).
        baud: of serial ports, bits a second.

    Attributes:
        most_at_once: how many announced addresses are asked at once; few, since others may use this process too.
        incomplete: names that were announced without an address, which `Finder` has to look up.
        contacts: by port or address: the places that somebody named, serial ports, and each way in which an address
            that was announced is asked.
    """

    def __init__(self, places: Iterable[Place] = (), tls: DriverContext | None = None, baud: int = 115200) -> None:
        self.most_at_once = _MOST_AT_ONCE
        self._tls = tls
        self._baud = baud
        self._places = list(places)
        # STOP or GO, the last order; empty where there was none.
        self._ordered = ""
        self.contacts: dict[str, Contact] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}
        # The address that the host of a named place has.
        self._reached: dict[str, str] = {}
        self._found: dict[str, Found] = {}
        self._by_host: dict[str, dict[str, Found]] = {}
        self._turns = Turns()
        self._has_turn = asyncio.Event()
        self._was_left_out = False
        self.incomplete = asyncio.Queue[str](_MOST_WAITING)

    async def __aenter__(self) -> Self:
        for place in self._places:
            self.add(place)
        self._tasks[""] = asyncio.create_task(self._take_turns())
        return self

    async def __aexit__(self, *_: object) -> None:
        for found in self._found.values():
            found.cancel()
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        if tasks:
            # Not by gather, which would make another's cancellation its own.
            await asyncio.wait(tasks)

    @property
    def problem(self) -> MotorcadeError | None:
        """Why the list isn't whole; None where it is."""
        if self._was_left_out or self._has_untried() or self.incomplete.qsize():
            return MotorcadeError("list-not-whole", count=len(self._found), most=MOST_FOUND)
        return None

    def add(self, place: Place) -> None:
        """Ask also at ``place``; `problem` says it where there are too many."""
        if place.found and place.host:
            self._add_found(place)
            return
        self._forget(place.address)
        at = place.address
        if at in self.contacts:
            return
        if len(self.contacts) - 2 * len(self._found) >= MOST_CARS:
            self.leave_out()
            return
        contact = (DriveContact if place.kind == DRIVE else Contact)(place, self._tls, self._baud)
        if not place.found:
            contact.reached = partial(self._reach, at)
        if self._ordered:
            contact.order(self._ordered)
        self.contacts[at] = contact
        task = asyncio.create_task(contact.run())
        self._tasks[at] = task
        # What proves to be no car is forgotten.
        task.add_done_callback(lambda ended: self.remove(at) if self._tasks.get(at) is ended else None)

    def remove(self, address: str) -> None:
        """Forget a place that was found, such as a serial port that was unplugged; one that somebody named stays."""
        self._forget(address)
        if address in self.contacts and self.contacts[address].place.found:
            del self.contacts[address]
            self._tasks.pop(address).cancel()

    def _reach(self, named: str, address: str) -> None:
        """Forget a car that was found at the address of one that somebody named, such as ``car.local:7001``."""
        self._reached[named] = address
        if address != named:
            self.remove(address)

    def leave_out(self) -> None:
        """Note that something was announced which isn't asked."""
        self._was_left_out = True

    # What was announced

    def _add_found(self, place: Place) -> None:
        at = network_place(place.host, place.port).address
        is_named = at in self.contacts or f"drive://{at}" in self.contacts or at in self._reached.values()
        found = self._found.get(at)
        if found is None:
            if is_named or not self._make_place(place.host):
                return
            found = self._found[at] = Found(place, self._tls and self._tls.any_car, self._baud)
            self._by_host.setdefault(place.host, {})[at] = found
            for way in found.ways:
                self.contacts[way.place.address] = way
                if self._ordered:
                    way.order(self._ordered)
            self._wait(found)
        found.announce(place)

    def _make_place(self, host: str) -> bool:
        """Forget an address where all places are taken: one of whoever has most. False where none gives way."""
        if len(self._found) < MOST_FOUND:
            return True
        self.leave_out()
        most = max(self._by_host.values(), key=len)
        if len(most) > len(self._by_host.get(host, ())) + 1:
            # The last first: so many that have not answered are not all cars.
            leaving = next((found for found in reversed(most.values()) if not found.has_answered), None)
        else:
            leaving = next((found for found in self._found.values() if found.again and not found.has_answered), None)
        if leaving:
            self._forget(leaving.address)
        return leaving is not None

    def _forget(self, address: str) -> None:
        found = self._found.pop(address.removeprefix("drive://"), None)
        if found:
            found.cancel()
            for way in found.ways:
                del self.contacts[way.place.address]
            of_host = self._by_host[found.host]
            del of_host[found.address]
            if not of_host:
                del self._by_host[found.host]
            self._turns.forget(found.host, found.address)
            self._has_turn.set()
            if task := self._tasks.pop(found.address, None):
                task.cancel()

    def _wait(self, found: Found) -> None:
        """Let an address wait for its turn."""
        found.cancel()
        self._turns.wait(found.host, found.address)
        self._has_turn.set()

    async def _take_turns(self) -> None:
        while True:
            self._has_turn.clear()
            for _ in range(_BEGIN_AT_ONCE):
                if not self._turns.host or not self._has_slot():
                    break
                self._begin(self._found[self._turns.begin()])
            else:
                self._has_turn.set()
            await asyncio.sleep(_LOOK_S)
            await self._has_turn.wait()

    def _has_slot(self) -> bool:
        """Whether one more may be asked; where all are used by others, one of whoever has most is asked later."""
        if len(self._turns) < self.most_at_once:
            return True
        asked = self._turns.most()
        if asked:
            at = next((address for address in asked if not self._found[address].has_answered), asked[-1])
            self._tasks.pop(at).cancel()
            self._wait(self._found[at])
        return bool(asked)

    def _begin(self, found: Found) -> None:
        task = self._tasks[found.address] = asyncio.create_task(found.attempt())

        def end(ended: asyncio.Task[None]) -> None:
            if self._tasks.get(found.address) is not ended:
                return
            del self._tasks[found.address]
            self._turns.forget(found.host, found.address)
            self._has_turn.set()
            found.again = asyncio.get_running_loop().call_later(found.pause_s, self._wait, found)

        task.add_done_callback(end)

    def _has_untried(self) -> bool:
        """Whether an address has neither answered nor failed yet: a car may be there, whatever was announced."""
        return any(not found.was_tried for found in self._found.values())

    def _shown(self) -> list[Contact]:
        """Return all places that somebody named, serial ports, and what was announced as a car or answered."""
        named = [contact for contact in self.contacts.values() if not (contact.place.found and contact.place.host)]
        return named + [way for found in self._found.values() for way in found.shown()]

    # What is known of them, and orders

    def statuses(self) -> list[CarStatus]:
        """Return what is known of each car, by name."""
        return sorted((contact.status() for contact in self._shown()), key=lambda status: (status.name, status.where))

    async def known(self, within_s: float) -> None:
        """Wait until each car has answered or failed once, at most ``within_s``."""
        await self._until(
            lambda: not self._has_untried() and all(contact.is_known.is_set() for contact in self._shown()), within_s
        )

    async def confirmed(self, within_s: float) -> list[CarStatus]:
        """Wait until each car has confirmed the last order, at most ``within_s``; return those that haven't."""
        await self._until(
            lambda: not (self._has_untried() or any(contact.wanted for contact in self._shown())), within_s
        )
        return sorted(
            (contact.status() for contact in self._shown() if contact.wanted),
            key=lambda status: (status.name, status.where),
        )

    def named(self, names: Sequence[str]) -> list[Contact]:
        """Return the cars of these names or addresses; ``all`` is every car that takes programs.

        Raises MotorcadeError: nobody has a name, or two cars have it.
        """
        if ALL in names:
            return [contact for contact in self._shown() if contact.place.kind != DRIVE]
        return [self._named(name) for name in dict.fromkeys(names)]

    def _named(self, name: str) -> Contact:
        # What somebody wrote counts before what a car, maybe a stranger's, says; what a stranger announces doesn't.
        known = self._shown()
        written = [
            contact
            for contact in known
            if name in (contact.place.address, contact.place.name) and not contact.place.found
        ]
        answered = [contact for contact in known if contact.has_answered or not contact.place.found]
        found = written or [contact for contact in answered if name in (contact.place.address, contact.name)]
        if not found:
            raise NoSuchCarError("no-such-car", car=safe_name(name))
        if len(found) > 1:
            where = ", ".join(sorted(contact.place.address for contact in found))
            raise MotorcadeError("name-of-two-cars", car=safe_name(name), list=where)
        return found[0]

    def order(self, kind: str) -> None:
        """STOP all cars at once, or let them GO: each begins its program anew.

        Those that are away, or found later, get the last order as soon as they can be reached.
        """
        self._ordered = kind
        for contact in self.contacts.values():
            contact.order(kind)
        for found in self._found.values():
            if found.again:
                self._wait(found)

    async def ask(self, names: Sequence[str], kind: str, new: str = "") -> None:
        """Make cars BLINK for 5 s, or give one the NAME ``new``, which it keeps. Raises MotorcadeError."""
        if kind == NAME:
            check_name(new)
        asked = [contact.ask(kind, new) for contact in self.named(names)]
        for result in await asyncio.gather(*asked, return_exceptions=True):
            if isinstance(result, BaseException):
                raise result

    async def load(
        self,
        image: bytes,
        names: Sequence[str],
        progress: Callable[[Contact, int], None] = lambda contact, sent: None,
        skips: str = "",
    ) -> list[Verdict]:
        """Upload an image to cars side by side. Returns a verdict for each.

        Args:
            image: its bytes.
            names: of cars, or ``all``.
            progress: called with a car and the number of bytes sent to it so far.
            skips: cars that hold an image with this CRC-32 have it already.
        """
        free = asyncio.Semaphore(_AT_ONCE)

        async def load(contact: Contact) -> Verdict:
            status = contact.status()
            if skips and status.crc32 == skips and not status.away:
                return Verdict(status.name, status.where, NEW)
            # One that is away needs no place.
            async with nullcontext() if status.away else free:
                return await contact.load(image, progress)

        return list(await asyncio.gather(*map(load, self.named(names))))

    async def _until(self, condition: Callable[[], bool], within_s: float) -> None:
        end_s = monotonic() + within_s
        while not condition() and monotonic() < end_s:
            await asyncio.sleep(_LOOK_S)


class Finder:
    """Find cars, and add them to ``cars``.

    Attributes:
        others: names and addresses of classes and studios in the network.
        problem: why the network can't be looked through, or not all that is announced is shown; None otherwise.
    """

    def __init__(self, cars: Cars) -> None:
        self.others: dict[str, Place] = {}
        self._problem: MotorcadeError | None = None
        self._cars = cars
        self._announced: asyncio.Queue[str] = asyncio.Queue(_MOST_WAITING)

    @property
    def problem(self) -> MotorcadeError | None:
        return self._problem or self._cars.problem

    @asynccontextmanager
    async def looking(self, interfaces: Sequence[str] = ()) -> AsyncIterator[None]:
        """Look at this computer's serial ports and in the network, while the block runs.

        ``interfaces`` are addresses of this computer at which to look in the network; all where none are given.
        """
        tasks = [asyncio.create_task(self._watch_ports()), asyncio.create_task(self._watch_network(interfaces))]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)

    async def _watch_ports(self) -> None:
        """Ask at each serial port with a known board, once after it is plugged in."""
        known: set[str] = set()
        while True:
            there = {port.device for port in await asyncio.to_thread(ports) if port.rank == BOARD}
            for device in known - there:
                self._cars.remove(device)
            for device in there - known:
                self._cars.add(Place(device, found=True))
            known = there
            await asyncio.sleep(_PORTS_EVERY_S)

    async def _watch_network(self, interfaces: Sequence[str]) -> None:
        """Add what announces itself; a record that outlives its car does no harm."""
        try:
            from zeroconf import InterfaceChoice
            from zeroconf.asyncio import AsyncServiceBrowser, AsyncZeroconf

            network = AsyncZeroconf(interfaces=list(interfaces) or InterfaceChoice.All)
        except ModuleNotFoundError:
            self._problem = MotorcadeError("finding-needs-zeroconf", command=install_command("fleet"))
            return
        except OSError as problem:
            self._problem = MotorcadeError("network-not-searched", reason=problem)
            return

        def note(name: str, **_: Any) -> None:
            self._put(self._announced, name)

        browser = AsyncServiceBrowser(network.zeroconf, SERVICE, handlers=[note])
        asked = (self._look_up(network) for _ in range(_MOST_LOOKED_UP))
        try:
            await asyncio.gather(self._read(network), *asked)
        finally:
            await browser.async_cancel()
            await network.async_close()

    def _put(self, queue: asyncio.Queue[str], name: str) -> None:
        try:
            queue.put_nowait(name)
        except asyncio.QueueFull:
            self._cars.leave_out()

    async def _read(self, network: "AsyncZeroconf") -> None:
        """Take what is announced with its address; the rest has to be looked up, and keeps nobody waiting."""
        while True:
            name = await self._announced.get()
            if not await self._take_record(network, name, 0):
                self._put(self._cars.incomplete, name)
            # Else a flood of records would leave others who use the event loop no turn.
            await asyncio.sleep(0)

    async def _look_up(self, network: "AsyncZeroconf") -> None:
        while True:
            await self._take_record(network, await self._cars.incomplete.get(), _LOOK_UP_MS)

    async def _take_record(self, network: "AsyncZeroconf", name: str, within_ms: int) -> bool:
        """Take the address that belongs to a name, if it is known ``within_ms``."""
        from zeroconf.asyncio import AsyncServiceInfo

        # zeroconf refuses what a hostile host makes of a name.
        with suppress(Exception):
            info = AsyncServiceInfo(SERVICE, name)
            if not await info.async_request(network.zeroconf, within_ms):
                return False
            if info.port:
                self._take(info.parsed_addresses(), info.port, info.decoded_properties)
        return True

    def _take(self, hosts: list[str], port: int, properties: dict[str, str | None]) -> None:
        kind, name, telemetry = (properties.get(key) or "" for key in ("kind", "name", "telemetry"))
        telemetry_port = 0
        if re.fullmatch("[0-9]{1,5}", telemetry):
            telemetry_port = int(telemetry)
        if not 0 < telemetry_port <= LAST_PORT:
            # The place is asked all the same: what a stranger says hides no car.
            telemetry_port = min(port + 1, LAST_PORT)
        for host in filter(_is_near, hosts[:_MOST_HOSTS]):
            place = network_place(host, port, safe_name(name), kind, telemetry_port)._replace(found=True)
            self._cars.add(place)
            if kind in (CLASS, STUDIO) and place.address not in self.others:
                if len(self.others) < _MOST_OTHERS:
                    self.others[place.address] = place
                else:
                    self._cars.leave_out()


def _is_near(host: str) -> bool:
    """Whether an address is one of a room's network: an announcement can't send us elsewhere."""
    address = ipaddress.ip_address(host.partition("%")[0])
    return address.is_private or address.is_link_local or address.is_loopback
