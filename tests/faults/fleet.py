"""A room of cars in the simulated room: a computer that finds, loads and stops all of them, and all faults."""

import asyncio
from binascii import crc32
from contextlib import suppress
from random import Random
from types import SimpleNamespace
from typing import Any

from tests.faults.disk import Disk
from tests.faults.liars import URLS, Liar, Moved, Opened, announcements, check_text, check_work
from tests.faults.loop import SimulatedLoop
from tests.faults.network import Network, Socket
from tests.faults.ports import check_places
from tests.faults.room_cars import BACK_S, PORT, STOP_S, RoomCar, moving_image, multicast, multicast_of
from tests.faults.system import Replaced, Time, on_disk, replaced
from tests.faults.world import Faults, Process, World, here

from motorcade.boards import lines as car_lines
from motorcade.boards.computer import sealed
from motorcade.errors import MotorcadeError
from motorcade.fleet import cars as fleet_cars
from motorcade.fleet import contact as fleet_contact
from motorcade.fleet import link as fleet_link
from motorcade.fleet.cars import ALL, Cars, Finder
from motorcade.fleet.places import CAR, Place, network_place
from motorcade.upload import serial_port
from motorcade.upload.transfer import EITHER, NEW, OLD
from motorcade.words.request import BLINK, GO, NAME, REQUEST_BYTES, STOP, read_request

_FAULTS_S = 14.0
# What a healthy car in a quiet network may take to hold a new program.
_LOAD_S = 4.0
# Three tries, each with 5 s for a car to be back, and the longest upload.
_MOST_LOAD_S = 60.0
# For a car that is switched off meanwhile: 5 s for it to be back.
_DEAD_S = 7.0
_STRANGE_HOST = "10.0.1.66"
_LONGEST_NAME = 40


class Fleet:
    """One run: cars, a computer that loads and stops them, which may be killed, and who announces what."""

    def __init__(self, room: World) -> None:
        self.world = room
        self.random = random = Random(f"{room.seed} plan")
        self.disk = Disk(room, random)
        self.disk.failed = self._failed
        self.folder = self.disk.path("/var")
        self.disk.root.entries["var"] = self.disk.create(self.folder, True)
        self.network = Network(room)
        self.network.watch = self._connected
        self.network.knocks = self._knocks
        self.cars = [RoomCar(self, number) for number in range(random.randint(2, 5))]
        self.disk.settle()
        self.disk.after = self._check_disk
        for car in self.cars:
            delay_s, jitter_s = random.choice((0.002, 0.02)), random.choice((0.0, 0.02))
            self.network.link(f"teacher to {car.host}", delay_s, jitter_s, random.choice((0, 0, 0, 0.02)))
        self.network.link("teacher", 0.002)
        self._came_bytes = 0
        # The list names some cars; the others announce themselves.
        self.listed = random.randint(0, len(self.cars))
        self.announced = [(f"car {each.number}.", each.host, PORT, CAR) for each in self.cars[self.listed :]]
        if random.random() < 0.1:
            self.world.count("stranger")
            self.announced += [(f"strange {number}.", _STRANGE_HOST, 2000 + number, CAR) for number in range(90)]
        # A draw of its own: without it the other seeds would be other runs.
        hostile = Random(f"{room.seed} hostile")
        self.spoofs, self.is_flood = [], False
        self.liars: list[Liar] = []
        if hostile.random() < 0.4:
            self.spoofs, self.is_flood = announcements(self)
        if hostile.random() < 0.35:
            self.liars = [Liar(self, f"10.0.3.{number}", "car-0") for number in range(hostile.randint(1, 2))]
            self.announced += [(f"liar {each.host}.", each.host, PORT, CAR) for each in self.liars]
        # Some are announced before the cars, some behind them.
        self.announced = [*self.spoofs[::2], *self.announced, *self.spoofs[1::2]]
        self.urls = [url for url in URLS if hostile.random() < 0.05]
        room.checks.append(check_work(room, lambda: self._came_bytes))
        self.disk.fail_at = {random.randrange(1, 60) for _ in range(random.choice((0, 0, 1, 3)))}
        self.disk.slow_s = random.choice((0.0, 0.0, 0.1))
        self.teacher: Process | None = None
        self.fleet: Cars | None = None

    # The disk.

    def _failed(self, what: str) -> None:
        car = next(each for each in self.cars if each.process is here())
        car.disturb(_LOAD_S)
        if what == "fsync of a folder":
            # The one error after which either file may be there.
            car.failed_late_s = self.world.now_s

    def _check_disk(self) -> None:
        for car in self.cars:
            for content in self.disk.possible(car.path):
                self.world.keep(
                    "image-whole", content in [sealed(image) for image in car.known], "{!r} may be left", content
                )

    # The network.

    def _connected(self, name: str, port: int, socket: Socket) -> None:
        """What is sent first to a car that has to be stopped, or let go, is that order."""
        assert socket.peer
        host = socket.peer.address[0]
        fleet = self.fleet

        def tap(data: bytes) -> None:
            socket.tap = None
            contact = fleet.contacts.get(f"{host}:{port}") if fleet else None
            car = next((each for each in self.cars if each.host == host), None)
            order = contact.wanted if contact and contact.wanted else car.awaits if car else ""
            if order:
                request = read_request(data[:REQUEST_BYTES])
                is_first = request is not None and request.kind == order
                self.world.keep("away-first", is_first, f"{host} gets {data[:60]!r} before {order}")

        socket.tap = tap
        if name == "teacher":
            socket.make = self._counted

    def _knocks(self, name: str, host: str, port: int) -> None:
        self.world.keep("near-only", host.startswith("10."), f"{name} connects to {host}")

    def _counted(self, data: bytes) -> bytes:
        self._came_bytes += len(data)
        return Moved(data)

    def contact_of(self, fleet: Cars, car: RoomCar) -> Any:
        """What the program knows of a car at its own place; None where it hasn't found that."""
        here = [each for each in fleet.contacts.values() if (each.place.host, each.place.port) == (car.host, car.port)]
        return next((each for each in here if each.place.kind == CAR), None)

    # The computer of the teacher.

    def start_teacher(self) -> None:
        """Start the program that loads and stops all cars."""
        for car in self.cars:
            car.awaits = ""
        process = self.teacher = Process(self.world, "teacher", self.random.choice((0.001, 0.02)))
        process.offset_s = self.random.uniform(0, 1e5)
        self.world.note("teacher")

        async def main() -> None:
            places = [network_place(each.host, PORT, f"list-{each.number}") for each in self.cars[: self.listed]]
            places += [Place(url) for url in self.urls]
            async with Cars(places) as fleet, Finder(fleet).looking():
                self.fleet = fleet
                begin_s = self.world.now_s
                await fleet.known(3.0)
                self.check_names(fleet)
                is_soon = self.world.now_s < begin_s + 3.3 or process.frozen_until_s > begin_s
                self.world.keep("nobody-waits", is_soon, "for those that don't answer")
                while not self.world.is_healed:
                    await self._act(fleet)
                await self._end(fleet)

        SimulatedLoop(process, self.network).run(main)

    async def _act(self, fleet: Cars) -> None:
        """Do what a teacher does: load all, stop all, let all go, find a car by its light."""
        random, what = self.random, self.random.random()
        if what < 0.4:
            # Sometimes one load follows the other at once.
            for _ in range(random.choice((1, 1, 1, 8))):
                await self._load_and_stop(fleet)
                await asyncio.sleep(random.uniform(0.0, 0.1))
        elif what < 0.7:
            self._order(fleet, STOP)
        elif what < 0.9:
            self._order(fleet, GO)
        else:
            kind = random.choice((BLINK, NAME))
            with suppress(MotorcadeError):
                await fleet.ask(["car-0"] if kind == NAME else [ALL], kind, "car-0" if kind == NAME else "")
        await asyncio.sleep(random.choice((0.05, 0.5, 2.0)))

    async def _load_and_stop(self, fleet: Cars) -> None:
        """Load all cars; sometimes all are stopped meanwhile, or one is switched off."""
        random = self.random
        loading = asyncio.ensure_future(self._load(fleet, moving_image(random)))
        while not loading.done():
            await asyncio.wait([loading], timeout=random.uniform(0.02, 1.0))
            if random.random() < 0.3:
                self._order(fleet, STOP)
            if random.random() < 0.12 and not self.world.is_healed:
                random.choice(self.cars).end()
        loading.result()

    def _order(self, fleet: Cars, kind: str) -> None:
        self.world.note("order", kind)
        for car in self.cars:
            car.awaits = kind
            if kind == GO:
                car.is_halted, car.stop_due = False, None
            elif self._is_reached(fleet, car):
                # While a car stores an image it does nothing else.
                car.stop_due = self.world.now_s, self.world.now_s + STOP_S + 6 * self.disk.slow_s
        fleet.order(kind)

    def check_names(self, fleet: Cars) -> None:
        """What somebody wrote counts before what a stranger says, and no text of a stranger changes a line."""
        for car in self.cars[: self.listed]:
            (found,) = fleet.named([f"list-{car.number}"])
            self.world.keep("safe-text", found.place.host == car.host, f"list-{car.number} is {found.place}")
        for car in self.cars:
            contact = self.contact_of(fleet, car)
            if contact is not None and not contact.status().away:
                self._check_name(fleet, car, contact)
        for status in fleet.statuses():
            # One that has told no name is called by its place.
            is_short = len(status.name) <= _LONGEST_NAME or status.name == status.where
            self.world.keep("safe-text", is_short, f"a car is called {status.name!r}")
            for text in status[:1] + status[4:8]:
                check_text(self.world, status.where, text)
            if status.problem:
                check_text(self.world, status.where, str(status.problem)[:300])

    def _check_name(self, fleet: Cars, car: RoomCar, contact: Any) -> None:
        """A car is found by its address and by its name, unless another one says that it has that name."""
        (found,) = fleet.named([contact.place.address])
        self.world.keep("found", found is contact, f"{contact.place.address} is {found.place}")
        # One that is away now may be the one that is meant.
        alike = [other for other in fleet.contacts.values() if other.name == car.name and other.has_answered]
        try:
            (found,) = fleet.named([car.name])
        except MotorcadeError as problem:
            is_right = problem.code in ("name-of-two-cars", "no-such-car") and len(alike) != 1
            self.world.keep("found", is_right, f"{car.name}: {problem.code}, though {len(alike)} have that name")
        else:
            self.world.keep("found", found.place.host == car.host or bool(self.liars), f"{car.name} is {found.place}")

    def _is_reached(self, fleet: Cars, car: RoomCar) -> bool:
        """Whether the car has answered and nothing has disturbed it since."""
        contact = self.contact_of(fleet, car)
        return contact is not None and not contact.status().away and car.is_quiet(self.world.now_s - 2.0)

    async def _load(self, fleet: Cars, image: bytes) -> None:
        """Load all cars; each healthy one has the program soon, whatever becomes of the others."""
        begin_s = self.world.now_s
        reached = [each for each in self.cars if self._is_reached(fleet, each)]
        before = {each.host: (each.holds(), len(each.stored)) for each in self.cars}
        for car in self.cars:
            car.known.add(image)

        def check() -> None:
            for car in reached:
                if car.is_quiet(begin_s - 2.0):
                    took_s = car.stored_s - begin_s
                    has_it = image in car.stored[before[car.host][1] :]
                    self.world.keep("nobody-waits", has_it, f"{car.name} has no program after {took_s:.1f} s")

        self.world.after(_LOAD_S + 6 * self.disk.slow_s, lambda: self.teacher is teacher and check())
        teacher = self.teacher
        for verdict in await fleet.load(image, [ALL]):
            car = next((each for each in self.cars if verdict.where == f"{each.host}:{PORT}"), None)
            self.world.note("verdict", verdict.where, verdict.holds)
            if car in reached and car.is_quiet(begin_s - 2.0):
                self.world.keep("nobody-waits", verdict.holds == NEW, f"{car.name} is healthy: {verdict.holds}")
            if car is None or verdict.holds not in (NEW, OLD, EITHER):
                continue
            old, count = before[car.host]
            if verdict.holds == NEW:
                # After an error at the very end of storing, the car may begin with it; or it had it before.
                is_stored = old == image or image in car.stored[count:] or car.failed_late_s >= begin_s
                self.world.keep("verified", is_stored, f"{car.name} never stored it")
            elif verdict.holds == OLD and car.failed_late_s < begin_s:
                is_old = car.holds() != image or old == image or car.holds() == old
                self.world.keep("says-what-it-holds", is_old, f"{car.name} holds the new program")
        now_s = self.world.now_s
        self.world.keep("nobody-waits", now_s - begin_s < _MOST_LOAD_S, f"all waited for {now_s - begin_s:.0f} s")
        off = [each for each in self.cars if each.ended_s > begin_s]
        is_calm = teacher is not None and teacher.frozen_until_s < begin_s
        # Only the cars that are switched off, and were well until then, keep anybody waiting.
        if is_calm and all(each.was_quiet if each in off else each.is_quiet(begin_s - 2.0) for each in self.cars):
            waited = [each.name for each in off if each.off_until_s() - each.ended_s > _DEAD_S]
            self.world.keep("nobody-waits", not waited, f"the others waited for {waited}, who are off")

    async def _end(self, fleet: Cars) -> None:
        """All faults have ended: all cars are found, stopped and loaded."""
        await asyncio.sleep(BACK_S)
        found = [car for car in self.cars if self.contact_of(fleet, car)]
        missing = [car.name for car in self.cars if car not in found]
        self.world.keep("found", not missing, f"{missing} of {list(fleet.contacts)}")
        self.world.keep("found", self.is_flood or fleet.problem is None, "the list isn't whole")
        known = {self.contact_of(fleet, car).place.address for car in found}
        self.check_names(fleet)
        fleet.order(STOP)
        wanting = [each for each in await fleet.confirmed(BACK_S) if each.where in known]
        self.world.keep("away-first", not wanting, f"{wanting} aren't stopped")
        image = moving_image(self.random)
        for car in self.cars:
            car.known.add(image)
        verdicts = {each.where: each.holds for each in await fleet.load(image, [ALL])}
        statuses = {each.where: each for each in fleet.statuses()}
        for car in found:
            self._check_status(car, statuses[self.contact_of(fleet, car).place.address], image)
            holds = verdicts[self.contact_of(fleet, car).place.address]
            self.world.keep("verified", holds == NEW and car.holds() == image, f"{car.name} after all faults: {holds}")
            self.world.keep("stop-holds", car.speed == 0, f"{car.name} moves at the end")
        self.world.is_over = True

    def _check_status(self, car: RoomCar, status: Any, image: bytes) -> None:
        """The table shows what a car says of itself."""
        shown = status.name, status.number, status.role, status.board, status.state, status.away
        known = car.name, car.number, "leader", "simulated", "stopped", False
        self.world.keep("found", shown == known, f"{shown} in place of {known}")
        # What it holds is told by a heartbeat after the load.
        holds = {f"{crc32(each):08x}" for each in (image, *car.stored[-2:])}
        self.world.keep("found", status.crc32 in holds, f"{car.name} holds {status.crc32}, not {holds}")

    # Faults.

    def plan(self) -> None:
        """Draw what goes wrong, and when."""
        random = self.random
        acts: Faults = [
            (0.6, self._kill_teacher),
            (0.4, self._freeze_teacher),
            (0.6, lambda: random.choice(self.cars).end()),
            (0.6, lambda: self._break(random.choice(self.cars))),
            (0.6, lambda: self._break(random.choice(self.cars))),
            (0.4, lambda: self._freeze(random.choice(self.cars))),
            (0.15, self._lose_power),
            (0.15, self._fill),
        ]
        self.world.plan(random, acts, 1.0, _FAULTS_S)
        self.world.at(_FAULTS_S + 1.0, self._heal)

    def _kill_teacher(self) -> None:
        assert self.teacher
        self.world.count("kill")
        self.fleet = None
        for car in self.cars:
            car.stop_due = None
            car.disturb(1.0)
        self.teacher.end()
        self.world.after(self.random.choice((0.05, 1.5)), self.start_teacher)

    def _freeze_teacher(self) -> None:
        assert self.teacher
        self.world.count("freeze")
        seconds = self.random.choice((0.5, 6.0))
        for car in self.cars:
            car.disturb(seconds + BACK_S)
        self.teacher.freeze(seconds)

    def _break(self, car: RoomCar) -> None:
        link, seconds = car.link, self.random.uniform(0.1, 7.0)
        car.disturb(seconds + BACK_S)
        self.random.choice((link.cut, link.forget_one_end, lambda: link.stall(seconds)))()

    def _freeze(self, car: RoomCar) -> None:
        if car.process and not car.process.is_dead:
            self.world.count("freeze")
            seconds = self.random.choice((0.3, 3.0, 9.0))
            car.disturb(seconds + BACK_S)
            car.process.freeze(seconds)

    def _lose_power(self) -> None:
        """The power of the whole room fails, except that of the teacher's notebook."""
        for car in self.cars:
            car.end()
        self.disk.lose_power()

    def _fill(self) -> None:
        self.disk.fill()
        for car in self.cars:
            car.disturb(1000)

    def _heal(self) -> None:
        self.world.note("heal")
        self.world.is_healed = True
        self.disk.heal()
        for link in self.network.links.values():
            link.down_until_s, link.loss = 0.0, 0.0
        for process in self.world.processes:
            process.frozen_until_s = min(process.frozen_until_s, self.world.now_s)
        for car in self.cars:
            car.start_again()

    def check(self) -> None:
        for car in self.cars:
            car.check()

    def names(self) -> Replaced:
        """What the modules take from the system."""
        ticks = SimpleNamespace(randbelow=self.random.randrange)
        return on_disk(self.disk) | {
            (fleet_cars, "monotonic"): Time.monotonic,
            (fleet_contact, "monotonic"): Time.monotonic,
            (fleet_link, "monotonic"): Time.monotonic,
            (fleet_link, "monotonic_ms"): lambda: int(Time.monotonic() * 1000),
            (fleet_link, "secrets"): ticks,
            (fleet_cars, "ports"): list,
            (serial_port, "serial"): Opened(),
            (car_lines, "listen"): lambda host, port: self.network.listen(here(), host, port),
        }


def run_fleet(room: World) -> None:
    """Run the scenario; raises the first promise that is broken."""
    run_ = Fleet(room)
    with multicast_of(multicast(run_.announced, run_.random)), replaced(run_.names()):
        for car in run_.cars:
            car.start()
        room.checks.append(run_.check)
        run_.plan()
        run_.start_teacher()
        check_places(room, run_.random)
        room.run(300.0)
        room.keep("goes-on", room.is_over, "the last load never ended")
