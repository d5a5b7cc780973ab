"""Many cars: all are asked, loaded, stopped and let go side by side; nobody waits for those that are away.

They are found by multicast DNS (RFC 6762, 6763) and at serial ports.
"""

import asyncio
import ipaddress
import re
import ssl
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from contextlib import asynccontextmanager, nullcontext, suppress
from functools import partial
from time import monotonic
from typing import TYPE_CHECKING, Any, Self

from motorcade.errors import MotorcadeError
from motorcade.extras import install_command
from motorcade.fleet.contact import CarStatus, Contact, DriveContact, Verdict
from motorcade.fleet.places import CAR, CLASS, DRIVE, SERVICE, STUDIO, Place, check_name, network_place, safe_name
from motorcade.sockets import LAST_PORT
from motorcade.upload.serial_port import BOARD, ports
from motorcade.upload.transfer import NEW
from motorcade.words.request import NAME

if TYPE_CHECKING:
    from zeroconf.asyncio import AsyncZeroconf

# How many places are kept; announcements of a hostile host fill no more.
MOST_CARS = 2048
# So many cars are loaded at once; more doesn't pay (`benchmarks/room.py`).
_AT_ONCE = 64
_LOOK_S = 0.02
# How many announcements of one host are believed, and how many are looked up at once.
_MOST_OF_A_HOST = 64
_MOST_LOOKED_UP = 32
_MOST_WAITING = 4096
_LOOK_UP_MS = 2000
_PORTS_EVERY_S = 1.0
ALL = "all"


class Cars:
    """The cars at many places, connected while the block runs: ``async with Cars(places) as cars: ...``.

    Args:
        places: where cars are known to be; `add` takes more.
        tls: a driver's keys, for cars that require them (`motorcade.drive.keys.client_context`).
        baud: of serial ports, bits a second.
    """

    def __init__(self, places: Iterable[Place] = (), tls: ssl.SSLContext | None = None, baud: int = 115200) -> None:
        self._tls = tls
        self._baud = baud
        self._places = list(places)
        # STOP or GO, the last order; empty where there was none.
        self._ordered = ""
        # By port or address.
        self.contacts: dict[str, Contact] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}
        # The address that the host of a named place has.
        self._reached: dict[str, str] = {}

    async def __aenter__(self) -> Self:
        for place in self._places:
            self.add(place)
        return self

    async def __aexit__(self, *_: object) -> None:
        for task in self._tasks.values():
            task.cancel()
        if self._tasks:
            # Not by gather, which would make another's cancellation its own.
            await asyncio.wait(list(self._tasks.values()))

    def add(self, place: Place) -> None:
        """Ask also at ``place``; at most `MOST_CARS` places are kept."""
        at = place.address
        is_known = at in self.contacts or (place.found and at in self._reached.values())
        if not is_known and len(self.contacts) < MOST_CARS:
            contact = (DriveContact if place.kind == DRIVE else Contact)(place, self._tls, self._baud)
            if not place.found:
                contact.reached = partial(self._reach, at)
            if self._ordered:
                contact.order(self._ordered)
            self.contacts[at], task = contact, asyncio.create_task(contact.run())
            self._tasks[at] = task
            # What proves to be no car is forgotten.
            task.add_done_callback(lambda ended: self.remove(at) if self._tasks.get(at) is ended else None)

    def remove(self, address: str) -> None:
        """Forget a place that was found, such as a serial port that was unplugged; one that somebody named stays."""
        if address in self.contacts and self.contacts[address].place.found:
            del self.contacts[address]
            self._tasks.pop(address).cancel()

    def _reach(self, named: str, address: str) -> None:
        """Forget a car that was found at the address of one that somebody named, such as ``car.local:7001``."""
        self._reached[named] = address
        if address != named:
            self.remove(address)

    def statuses(self) -> list[CarStatus]:
        """Return what is known of each car, by name."""
        return sorted((each.status() for each in self.contacts.values()), key=lambda each: (each.name, each.where))

    async def known(self, within_s: float) -> None:
        """Wait until each car has answered or failed once, at most ``within_s``."""
        await self._until(lambda: all(each.is_known.is_set() for each in self.contacts.values()), within_s)

    async def confirmed(self, within_s: float) -> list[CarStatus]:
        """Wait until each car has confirmed the last order, at most ``within_s``; return those that haven't."""
        await self._until(lambda: not any(each.wanted for each in self.contacts.values()), within_s)
        wanting = {each.place.address for each in self.contacts.values() if each.wanted}
        return [each for each in self.statuses() if each.where in wanting]

    def named(self, names: Sequence[str]) -> list[Contact]:
        """Return the cars of these names or addresses; ``all`` is every car that takes programs.

        Raises MotorcadeError: nobody has a name, or two cars have it.
        """
        if ALL in names:
            return [each for each in self.contacts.values() if each.place.kind != DRIVE]
        return [self._named(name) for name in dict.fromkeys(names)]

    def _named(self, name: str) -> Contact:
        # What somebody wrote counts before what a car, maybe a stranger's, says.
        known = self.contacts.values()
        written = [each for each in known if name in (each.place.address, each.place.name) and not each.place.found]
        found = written or [each for each in known if name in (each.place.address, each.name)]
        if not found:
            raise MotorcadeError("no-such-car", car=safe_name(name))
        if len(found) > 1:
            where = ", ".join(sorted(each.place.address for each in found))
            raise MotorcadeError("name-of-two-cars", car=safe_name(name), list=where)
        return found[0]

    def order(self, kind: str) -> None:
        """STOP all cars at once, or let them GO: each begins its program anew.

        Those that are away, or found later, get the last order as soon as they can be reached.
        """
        self._ordered = kind
        for contact in self.contacts.values():
            contact.order(kind)

    async def ask(self, names: Sequence[str], kind: str, new: str = "") -> None:
        """Make cars BLINK for 5 s, or give one the NAME ``new``, which it keeps. Raises MotorcadeError."""
        if kind == NAME:
            check_name(new)
        asked = [each.ask(kind, new) for each in self.named(names)]
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
        problem: why the network can't be looked through, or not all that is announced is believed; None otherwise.
    """

    def __init__(self, cars: Cars) -> None:
        self.others: dict[str, Place] = {}
        self.problem: MotorcadeError | None = None
        self._cars = cars
        self._found: asyncio.Queue[str] = asyncio.Queue(_MOST_WAITING)

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
            self.problem = MotorcadeError("finding-needs-zeroconf", command=install_command("fleet"))
            return
        except OSError as problem:
            self.problem = MotorcadeError("network-not-searched", reason=problem)
            return

        def note(name: str, **_: Any) -> None:
            with suppress(asyncio.QueueFull):
                self._found.put_nowait(name)

        browser = AsyncServiceBrowser(network.zeroconf, SERVICE, handlers=[note])
        try:
            await asyncio.gather(*(self._look_up(network) for _ in range(_MOST_LOOKED_UP)))
        finally:
            await browser.async_cancel()
            await network.async_close()

    async def _look_up(self, network: "AsyncZeroconf") -> None:
        from zeroconf.asyncio import AsyncServiceInfo

        while True:
            name = await self._found.get()
            # zeroconf refuses what a hostile host makes of a name.
            with suppress(Exception):
                info = AsyncServiceInfo(SERVICE, name)
                if await info.async_request(network.zeroconf, _LOOK_UP_MS) and info.port:
                    self._take(info.parsed_addresses(), info.port, info.decoded_properties)

    def _take(self, hosts: list[str], port: int, properties: dict[str, str | None]) -> None:
        host = next((each for each in hosts if _is_near(each)), "")
        kind, name, telemetry = (properties.get(key) or "" for key in ("kind", "name", "telemetry"))
        known = [*(each.place for each in self._cars.contacts.values()), *self.others.values()]
        others = [each for each in known if each.host == host]
        if not host or port in [each.port for each in others]:
            return
        if len(others) >= _MOST_OF_A_HOST:
            self.problem = MotorcadeError("announces-too-many", host=host, count=_MOST_OF_A_HOST)
            return
        telemetry_port = int(telemetry) if re.fullmatch("[0-9]{1,5}", telemetry) else 0
        if telemetry_port > LAST_PORT:
            return
        place = network_place(host, port, safe_name(name), kind, telemetry_port)
        place = place._replace(keys=properties.get("keys") or "", found=True)
        if kind in (CAR, DRIVE):
            self._cars.add(place)
        elif kind in (CLASS, STUDIO) and len(self.others) < _MOST_OF_A_HOST:
            self.others[place.address] = place


def _is_near(host: str) -> bool:
    """Whether an address is one of a room's network: an announcement can't send us elsewhere."""
    address = ipaddress.ip_address(host.partition("%")[0])
    return address.is_private or address.is_link_local or address.is_loopback
