"""Find cars by multicast DNS (RFC 6762, 6763) and at serial ports."""

import asyncio
import ipaddress
from collections import Counter
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any

from motorcade.errors import MotorcadeError
from motorcade.extras import install_command
from motorcade.fleet.announcing import SERVICE
from motorcade.fleet.cars import Cars
from motorcade.fleet.places import CAR, CLASS, DRIVE, STUDIO, Place, network_place, safe_name
from motorcade.upload.ports import BOARD, ports

if TYPE_CHECKING:
    from zeroconf.asyncio import AsyncZeroconf

# How many announcements of one host are believed, and how many are looked up at once.
_MOST_OF_A_HOST = 64
_MOST_LOOKED_UP = 32
_MOST_WAITING = 4096
_LOOK_UP_MS = 2000
_PORTS_EVERY_S = 1.0


@asynccontextmanager
async def finding(finder: "Finder", interfaces: Sequence[str] = ()) -> AsyncIterator[None]:
    """Look for cars at this computer's serial ports and in the network, while the block runs.

    Args:
        finder: what looks.
        interfaces: addresses of this computer at which to look in the network; all where none are given.
    """
    tasks = [asyncio.create_task(finder.watch_ports()), asyncio.create_task(finder.watch_network(interfaces))]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


class Finder:
    """Find cars, and add them to ``cars``.

    Attributes:
        others: names and addresses of classes and studios in the network.
        problem: why the network can't be looked through; None where it can.
    """

    def __init__(self, cars: Cars) -> None:
        self.others: dict[str, Place] = {}
        self.problem: MotorcadeError | None = None
        self._cars = cars
        self._hosts: Counter[str] = Counter()
        self._found: asyncio.Queue[str] = asyncio.Queue(_MOST_WAITING)

    async def watch_ports(self) -> None:
        """Ask at each serial port with a known board, once after it is plugged in; until cancelled."""
        known: set[str] = set()
        while True:
            there = {port.device for port in await asyncio.to_thread(ports) if port.rank == BOARD}
            for device in known - there:
                self._cars.remove(device)
            for device in there - known:
                self._cars.add(Place(device))
            known = there
            await asyncio.sleep(_PORTS_EVERY_S)

    async def watch_network(self, interfaces: Sequence[str]) -> None:
        """Add what announces itself, until cancelled; a record that outlives its car does no harm."""
        try:
            from zeroconf import InterfaceChoice
            from zeroconf.asyncio import AsyncServiceBrowser, AsyncZeroconf
        except ModuleNotFoundError:
            self.problem = MotorcadeError("finding-needs-zeroconf", command=install_command("fleet"))
            return

        def note(name: str, state_change: Any, **_: Any) -> None:
            with suppress(asyncio.QueueFull):
                self._found.put_nowait(name)

        try:
            network = AsyncZeroconf(interfaces=list(interfaces) or InterfaceChoice.All)
        except OSError as problem:
            self.problem = MotorcadeError("network-not-searched", reason=problem.strerror or problem)
            return
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
        host = next((each for each in hosts if _is_near(each)), None)
        kind, name = properties.get("kind") or "", safe_name(properties.get("name") or "")
        if host is None or kind not in (CAR, DRIVE, CLASS, STUDIO):
            return
        self._hosts[host] += 1
        if self._hosts[host] > _MOST_OF_A_HOST and not ipaddress.ip_address(host).is_loopback:
            return
        telemetry = properties.get("telemetry") or ""
        telemetry_port = int(telemetry) if telemetry.isdecimal() and len(telemetry) < 6 else 0
        # A car says its own name; what announces it may be older.
        place = network_place(host, port, name if kind != CAR else "", kind, telemetry_port)
        if kind in (CAR, DRIVE):
            self._cars.add(place)
        elif len(self.others) < _MOST_OF_A_HOST:
            self.others[place.address] = place


def _is_near(host: str) -> bool:
    """Whether an address is one of a room's network: an announcement can't send us elsewhere."""
    address = ipaddress.ip_address(host.partition("%")[0])
    return address.is_private or address.is_link_local or address.is_loopback
