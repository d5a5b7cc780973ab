"""Find cars by multicast DNS (RFC 6762, 6763) and at serial ports."""

import asyncio
import ipaddress
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any

from motorcade.errors import MotorcadeError
from motorcade.extras import install_command
from motorcade.fleet.cars import Cars
from motorcade.fleet.places import CAR, CLASS, DRIVE, SERVICE, STUDIO, Place, network_place, safe_name
from motorcade.upload.serial_port import BOARD, ports

if TYPE_CHECKING:
    from zeroconf.asyncio import AsyncZeroconf

# How many announcements of one host are believed, and how many are looked up at once.
_MOST_OF_A_HOST = 64
_MOST_LOOKED_UP = 32
_MOST_WAITING = 4096
_LOOK_UP_MS = 2000
_PORTS_EVERY_S = 1.0


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
        telemetry_port = int(telemetry) if telemetry.isdecimal() and len(telemetry) < 6 else 0
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
