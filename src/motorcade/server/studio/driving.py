"""A page's world in the server, and its cars that somebody drives, or drove and that stand still."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar
from weakref import WeakValueDictionary

from anyio import CapacityLimiter, to_thread

from motorcade.cameras.broadcast import Camera
from motorcade.drive.session import CarControl, ControlSession
from motorcade.engine.simulated_camera import Scene, to_jpeg
from motorcade.engine.simulated_drive import DrivenCars, SimulatedCamera
from motorcade.errors import MotorcadeError
from motorcade.mats import Mat
from motorcade.server.fleet import MOST_CARS, Fleet, address_of
from motorcade.server.page_socket import PageSocket
from motorcade.server.remote_messages import ListedCar
from motorcade.service.history import PAST_BYTES
from motorcade.service.messages import MatDocument
from motorcade.service.studio_world import StudioWorld, open_world
from motorcade.service.world_messages import WorldAnswer
from motorcade.service.world_session import WorldSession
from motorcade.timing import monotonic_ms

_MOST_LISTED = 200
_BEAT_S = 0.05
_T = TypeVar("_T")


@dataclass(eq=False, slots=True)
class _DrivenCar:
    """A car to which pages are connected, or that stands still after they left."""

    control: CarControl
    beating: asyncio.Task[None] | None = None
    pages: int = 0


async def _beat(control: CarControl) -> None:
    while True:
        await asyncio.sleep(min(control.beat() / 1000, _BEAT_S))


def _resume(control: CarControl, clears: bool = False) -> None:
    """Give the car to its own program; ``clears``: lift its emergency stop first. Raises MotorcadeError."""
    session = ControlSession(control, "program")
    try:
        if clears:
            session.clear()
        session.resume_program()
    finally:
        session.leave()


class PageWorld(WorldSession):
    """A session of the server.

    Args:
        visitor: the address of the page that began it.
        most_cars: the most cars in its world.
        workers: how many threads may work for all sessions.
        past_bytes: as `motorcade.service.world_session.WorldSession` takes it.
        allowed: the messages that its page may send.

    Attributes:
        page: the answers to the connected page; None while no page is connected.
        used_s: when its page last sent something or left, in s of the server's clock.
        forget_timer: removes the session unless a page connects again.
        lock: for the task that uses the session, which is not safe for threads.
        changed: set when there may be something to show.
        fleet: its cars, for pages of the remote.
        mat: the document of its mat, as it is now; None before there is a world.
        sent: the last answer of each type that its page was sent, pictures as bytes; for others who watch.
        took_s: how long making the last picture took.
        is_quick: whether making the last two pictures, or one of them, took less time than passing it to a thread.
    """

    def __init__(
        self,
        key: str,
        visitor: str,
        most_cars: int,
        workers: CapacityLimiter,
        past_bytes: tuple[int, int] = PAST_BYTES,
        allowed: tuple[type, ...] = (object,),
    ) -> None:
        self.fleet = SessionFleet(self)
        super().__init__(key, partial(open_world, most_cars=most_cars, steering=self.fleet.boards), past_bytes)
        self._workers = workers
        self.visitor, self.allowed = visitor, allowed
        self.mat: MatDocument | None = None
        self._scene: tuple[Mat, Scene] | None = None
        self.sent: dict[type, WorldAnswer | bytes] = {}
        self.page: PageSocket | None = None
        self.used_s = 0.0
        self.forget_timer: asyncio.TimerHandle | None = None
        self.lock = asyncio.Lock()
        self.changed = asyncio.Event()
        self.is_quick = False
        self.took_s = float("inf")

    async def alone(self, job: Callable[[], _T]) -> _T:
        """Do a job while nothing else uses the session; in a thread unless that takes longer."""
        async with self.lock:
            if self.is_quick:
                return job()
            return await self.in_thread(job)

    async def in_thread(self, job: Callable[[], _T], limiter: CapacityLimiter | None = None) -> _T:
        """Do a job in a thread, one of the workers or of ``limiter``; the caller has acquired the lock."""
        return await to_thread.run_sync(job, limiter=limiter or self._workers)

    async def work(self, job: Callable[[StudioWorld], _T]) -> _T:
        """Do a job with the world, as `alone`. Raises MotorcadeError where there is no world."""
        return await self.alone(lambda: job(self.world))

    def is_paused(self) -> bool:
        """Whether the world is paused, or its page has left."""
        return self.page is None or not self.playing

    async def view(self, car: int) -> bytes:
        """Return what a car's camera sees now, as a JPEG file. Raises MotorcadeError where there is no such car."""

        def draw(world: StudioWorld) -> bytes:
            world.check_car(car)
            simulation = world.simulation
            if self._scene is None or self._scene[0] is not simulation.mat:
                self._scene = simulation.mat, Scene(simulation)
            return to_jpeg(self._scene[1].draw(simulation.snapshot(), car))

        return await self.work(draw)


class SessionFleet(Fleet):
    """The cars of one page's world; some are driven, or were and have not been given back to their program.

    Attributes:
        boards: for the world, the setpoints of the cars that somebody drives.
    """

    def __init__(self, session: PageWorld) -> None:
        self._session = session
        self.boards = DrivenCars()
        self._cars: dict[int, _DrivenCar] = {}
        # A camera exists while a page shows it.
        self._cameras: WeakValueDictionary[int, Camera] = WeakValueDictionary()

    async def listed(self) -> list[ListedCar]:
        """The leaders, then the followers, at most 200. Raises MotorcadeError."""
        leads, cars = await self._session.work(lambda world: (world.leads(), world.cars))
        leaders = set(leads)
        order = sorted(range(cars), key=lambda car: (car not in leaders, car))
        return [ListedCar(str(car), car in leaders, True) for car in order[:_MOST_LISTED]]

    async def connect(self, car: str, page: str) -> ControlSession:
        """Connect a page to a car, which runs its program until somebody drives. Raises MotorcadeError."""
        number = await self._number(car)
        profile = await self._session.work(lambda world: world.simulation.profile)
        driven = self._cars.get(number)
        if driven is None:
            control = CarControl(self.boards.board(number, has_program=True), monotonic_ms, profile)
            driven = self._cars[number] = _DrivenCar(control)
            _resume(control)
        driven.pages += 1
        if driven.beating is None:
            driven.beating = asyncio.create_task(_beat(driven.control))
        return ControlSession(driven.control, page, address_of(page), left=partial(self._leave, number))

    def give_back(self, car: int) -> None:
        """Give a car back to its program; lift its emergency stop where no page is connected that could.

        Raises MotorcadeError where somebody drives it.
        """
        if driven := self._cars.get(car):
            _resume(driven.control, clears=not driven.pages)
            self._remove_if_idle(car)

    def give_back_all(self) -> None:
        """Give back all cars to which no page is connected, except those that the emergency stop holds."""
        for car, driven in list(self._cars.items()):
            if not driven.pages and driven.control.telemetry().state != "stopped":
                self.give_back(car)

    def _leave(self, car: int) -> None:
        driven = self._cars[car]
        driven.pages -= 1
        if not driven.pages and driven.beating:
            # No deadline remains: the car stands still, or its program runs.
            driven.beating.cancel()
            driven.beating = None
        self._remove_if_idle(car)

    def _remove_if_idle(self, car: int) -> None:
        driven = self._cars[car]
        if not driven.pages and driven.control.telemetry().state == "program":
            del self._cars[car]

    def is_paused(self, car: str) -> bool:
        return self._session.is_paused()

    async def camera(self, car: str) -> Camera:
        number = await self._number(car)
        camera = self._cameras.get(number)
        if camera is None:
            if len(self._cameras) >= MOST_CARS:
                raise MotorcadeError("at-too-many-cars", most=MOST_CARS)
            jpeg = partial(self._view_in_thread, asyncio.get_running_loop(), number)
            camera = self._cameras[number] = Camera(SimulatedCamera(jpeg))
        return camera

    def _view_in_thread(self, loop: asyncio.AbstractEventLoop, car: int) -> bytes:
        """Return what a car sees now, to a thread: the loop makes each picture, as one task at a time uses a world.

        Raises OSError.
        """
        try:
            return asyncio.run_coroutine_threadsafe(self._session.view(car), loop).result()
        except MotorcadeError as problem:
            raise OSError(str(problem)) from None

    async def start(self) -> None:
        await self._session.alone(self._session.play)
        self._session.changed.set()

    async def _number(self, car: str) -> int:
        cars = await self._session.work(lambda world: world.cars)
        if not car.isdecimal() or not car.isascii() or int(car) >= cars:
            raise MotorcadeError("car-not-listed", car=car)
        return int(car)
