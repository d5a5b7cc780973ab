"""A shelf of cars at a quiet network: what is told of each, and done with each, is compared with the cars themselves.

One act follows another. `tests.faults.fleet` and `tests.faults.uploads` have networks, disks and programs that fail.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from random import Random
from types import SimpleNamespace
from typing import Any

from serial import SerialException
from tests.faults import shelf_loads, shelf_orders, shelf_uploads
from tests.faults.liars import Opened
from tests.faults.lines import SocketPort
from tests.faults.loop import SimulatedLoop
from tests.faults.network import Network
from tests.faults.room_cars import multicast, multicast_of
from tests.faults.shelf_cars import BAUD, PORT, ShelfCar, ShelfDriveCar
from tests.faults.system import THREADS, Time, in_threads, replaced
from tests.faults.world import Process, World

from motorcade.drive import client as drive_client
from motorcade.drive import server as drive_server
from motorcade.drive import session as drive_session
from motorcade.errors import TransferError
from motorcade.fleet import cars as fleet_cars
from motorcade.fleet import contact as fleet_contact
from motorcade.fleet import link as fleet_link
from motorcade.fleet.cars import Cars, Finder
from motorcade.fleet.places import Place
from motorcade.upload import serial_port
from motorcade.upload.serial_port import BOARD, PortInfo
from motorcade.words.ticks import TICKS_MASK

# Few places, so that a crowd of few fills them.
MOST_FOUND, MOST_NAMED, _AT_ONCE = 24, 8, 8
_MOST_ACTS = 4
ACTS = (*shelf_orders.ACTS, *shelf_loads.ACTS, *shelf_uploads.ACTS)


class Shelf:
    """One run: cars, and a computer that finds, loads and stops them."""

    def __init__(self, room: World) -> None:
        self.world = room
        self.keep = room.keep
        self.random = Random(f"{room.seed} plan")
        self.network = Network(room)
        self.people = Process(room, "people", 0.001)
        self.people.offset_s = self.random.uniform(0, 1e5)
        self.network.link("people", 0.003)
        # What is found by multicast DNS next.
        self.announced: list[tuple[str, str, int, str]] = []
        self.cars: list[ShelfCar] = []
        self.drive_cars: list[ShelfDriveCar] = []
        self.loop = SimulatedLoop(self.people, self.network)
        self.finder: Finder | None = None
        # Serial devices that are plugged in.
        self.plugged: list[str] = []
        self._hosts = 0

    def new_host(self) -> str:
        self._hosts += 1
        return f"10.0.{self._hosts // 200}.{self._hosts % 200 + 2}"

    def car(self, name: str = "", starts: bool = True, host: str = "", port: int = PORT) -> ShelfCar:
        """A new car in the network, at a host of its own unless one is given, or at a cable."""
        host = host or self.new_host()
        car = ShelfCar(self.world, self.network, self.random, host, name or f"car-{len(self.cars)}", port)
        self.cars.append(car)
        if starts:
            car.start()
        return car

    def drive_car(self, telemetry: int = 5006) -> ShelfDriveCar:
        """A new drive server."""
        car = ShelfDriveCar(self.world, self.network, self.new_host(), telemetry=telemetry)
        self.drive_cars.append(car)
        car.start()
        return car

    def announce(self, car: ShelfCar | ShelfDriveCar, kind: str) -> None:
        """Let a car be found."""
        self.announced.append((f"{car.host}.{len(self.announced)}.", car.host, car.port, kind))

    @asynccontextmanager
    async def fleet(self, places: Sequence[Place] = (), within_s: float = 6.0) -> AsyncIterator[Cars]:
        """Look for cars while the block runs; it begins when all that there is has been asked."""
        with multicast_of(multicast(self.announced, self.random)):
            async with Cars(places) as fleet:
                self.finder = Finder(fleet)
                async with self.finder.looking():
                    await asyncio.sleep(2.2 if self.announced else 0.0)
                    await fleet.known(within_s)
                    yield fleet
        for car in [*self.cars, *self.drive_cars]:
            if car.process and not car.process.is_dead:
                car.end()
        self.cars, self.drive_cars, self.announced, self.plugged = [], [], [], []

    async def in_thread(self, job: Callable[[], Any]) -> Any:
        """Do a job that waits, such as an upload by the command line."""
        return await self.loop.run_in_executor(None, job)

    def open_device(self, port: str, baud: int) -> Any:
        """Open a serial device: whatever is plugged in there."""
        try:
            line: Any = SocketPort(self.network, port, PORT)._socket
        except SerialException as problem:
            raise TransferError("port-fails", port=port, reason=problem) from None
        del line.changed
        line.getpeername = lambda: ""
        return line

    def ports(self) -> list[PortInfo]:
        return [PortInfo(device, "", "", "CH340", BOARD) for device in self.plugged]

    def opened(self, port: str, **options: object) -> Any:
        """What pyserial opens."""
        self.keep("only-ports", options.get("baudrate") == BAUD, f"{port} is opened with {options}")
        return SocketPort(self.network, self.cars[-1].host, self.cars[-1].port)


def run_shelf(room: World) -> None:
    """Run the scenario; raises the first promise that is broken."""
    run = Shelf(room)

    async def live() -> None:
        for act in run.random.sample(ACTS, min(_MOST_ACTS, len(ACTS))):
            room.note("act", act.__name__)
            await act(run)
        room.is_over = True

    ticks = SimpleNamespace(randbelow=run.random.randrange)
    names = in_threads() | {
        (drive_session, "threading"): THREADS,
        (drive_server, "threading"): THREADS,
        (drive_client, "random"): SimpleNamespace(uniform=run.random.uniform),
        (fleet_cars, "MOST_FOUND"): MOST_FOUND,
        (fleet_cars, "MOST_CARS"): MOST_NAMED,
        (fleet_cars, "_MOST_AT_ONCE"): _AT_ONCE,
        (fleet_cars, "monotonic"): Time.monotonic,
        (fleet_cars, "ports"): run.ports,
        (fleet_link, "open_port"): run.open_device,
        (fleet_link, "_socket_of"): lambda line: line,
        (fleet_contact, "monotonic"): Time.monotonic,
        (fleet_link, "monotonic"): Time.monotonic,
        (fleet_link, "monotonic_ms"): lambda: int(Time.monotonic() * 1000) & TICKS_MASK,
        (fleet_link, "secrets"): ticks,
        (serial_port, "serial"): Opened(run.opened),
        (serial_port, "monotonic_ms"): lambda: int(Time.monotonic() * 1000) & TICKS_MASK,
        (serial_port, "secrets"): ticks,
    }
    with replaced(names):
        run.loop.run(live)
        room.run(2000.0)
        room.keep("goes-on", room.is_over, "the last act never ended")
