"""Driving the cars of a page's world by hand: who drives which car, and which wait to go on with their program."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol
from weakref import WeakValueDictionary

from motorcade.boards.simulated_drive import DrivenCars
from motorcade.cameras.broadcast import Camera
from motorcade.config.profile import Profile
from motorcade.drive.session import CarControl
from motorcade.errors import MotorcadeError
from motorcade.server.remote.fleet import MOST_CARS, LocalControl, PageControl
from motorcade.server.remote.messages import ListedCar
from motorcade.server.studio.simulation import StudioWorld
from motorcade.timing import monotonic_ms

_MOST_LISTED = 200
_BEAT_S = 0.05


@dataclass(eq=False, slots=True)
class _Held:
    """A car to which pages are connected, or which stands still since they left."""

    control: CarControl
    beating: asyncio.Task[None] | None = None
    pages: int = 0


class ManualControl:
    """The cars of one world that somebody drives, or drove and has not given back to their program.

    Attributes:
        boards: what drivers do with the cars, for the world.
    """

    def __init__(self) -> None:
        self.boards = DrivenCars()
        self._held: dict[int, _Held] = {}

    def connect(self, car: int, profile: Profile, page: str, is_paused: Callable[[], bool]) -> LocalControl:
        """Connect a page to a car, which runs its program until somebody drives. Raises MotorcadeError."""
        held = self._held.get(car)
        if held is None:
            control = CarControl(self.boards.board(car, has_program=True), monotonic_ms, profile)
            held = self._held[car] = _Held(control)
            _resume(control)
        local = LocalControl(held.control, page, partial(self._left, car), is_paused)
        held.pages += 1
        if held.beating is None:
            held.beating = asyncio.create_task(_beat(held.control))
        return local

    def give_back(self, car: int) -> None:
        """Give a car back to its program; lift its emergency stop where no page is connected that could.

        Raises:
            MotorcadeError: somebody drives it.
        """
        held = self._held.get(car)
        if held is None:
            return
        if not held.pages:
            held.control.clear()
        _resume(held.control)
        self._forget_where_idle(car)

    def give_back_all(self) -> None:
        """Give back all cars to which no page is connected, except those that the emergency stop holds."""
        for car, held in list(self._held.items()):
            if not held.pages and held.control.telemetry().state != "stopped":
                self.give_back(car)

    def _left(self, car: int) -> None:
        held = self._held[car]
        held.pages -= 1
        if not held.pages and held.beating:
            # Nothing becomes due any more: the car stands still, or its program drives.
            held.beating.cancel()
            held.beating = None
        self._forget_where_idle(car)

    def _forget_where_idle(self, car: int) -> None:
        held = self._held[car]
        if not held.pages and held.control.telemetry().state == "program":
            del self._held[car]


async def _beat(control: CarControl) -> None:
    while True:
        await asyncio.sleep(min(control.beat() / 1000, _BEAT_S))


def _resume(control: CarControl) -> None:
    """Give the car to its own program. Raises MotorcadeError."""
    session = control.join("program")
    try:
        session.resume_program()
    finally:
        session.leave()


class DrivableSession(Protocol):
    """A session whose cars can be driven; see `motorcade.server.studio.sessions.PageWorld`."""

    control: ManualControl

    def is_paused(self) -> bool:
        """Whether the world stands still, or its page has left."""

    async def play(self) -> None:
        """Go on. Raises MotorcadeError."""

    def work(self, job: Callable[[StudioWorld], Any]) -> Awaitable[Any]:
        """Do a job with the world, which nobody else uses meanwhile. Raises MotorcadeError."""


class SessionFleet:
    """The cars of one page's world."""

    def __init__(self, session: DrivableSession) -> None:
        self._session = session
        # A camera exists for as long as somebody looks through it.
        self._cameras: WeakValueDictionary[int, Camera] = WeakValueDictionary()

    async def listed(self) -> list[ListedCar]:
        """The leaders, then the followers, at most 200. Raises MotorcadeError."""
        leaders = set(await self._session.work(StudioWorld.leads))
        order = sorted(range(await self._count()), key=lambda car: (car not in leaders, car))
        return [ListedCar(str(car), car in leaders, True) for car in order[:_MOST_LISTED]]

    async def connect(self, car: str, page: str) -> PageControl:
        """Connect a page to a car. Raises MotorcadeError."""
        number = await self._number(car)
        profile = await self._session.work(lambda world: world.profile)
        return self._session.control.connect(number, profile, page, self._session.is_paused)

    async def camera(self, car: str) -> Camera:
        """The camera of a car. Raises MotorcadeError."""
        number = await self._number(car)
        camera = self._cameras.get(number)
        if camera is None:
            if len(self._cameras) >= MOST_CARS:
                raise MotorcadeError("at-too-many-cars", most=MOST_CARS)
            camera = self._cameras[number] = Camera(_WorldCamera(self._session, number))
        return camera

    async def start(self) -> None:
        """Have the world go on. Raises MotorcadeError."""
        await self._session.play()

    async def _count(self) -> int:
        count: int = await self._session.work(lambda world: world.cars)
        return count

    async def _number(self, car: str) -> int:
        if not car.isdecimal() or not car.isascii() or int(car) >= await self._count():
            raise MotorcadeError("car-not-listed", car=car)
        return int(car)


class _WorldCamera:
    """A simulated camera for a thread: it asks the loop for each picture, as only one task at a time uses a world."""

    def __init__(self, session: DrivableSession, car: int) -> None:
        self._session = session
        self._car = car
        self._loop = asyncio.get_running_loop()

    def jpeg(self) -> bytes:
        """What the car sees now. Raises OSError."""
        try:
            return asyncio.run_coroutine_threadsafe(self._view(), self._loop).result()
        except MotorcadeError as problem:
            raise OSError(str(problem)) from None

    async def _view(self) -> bytes:
        picture: bytes = await self._session.work(partial(StudioWorld.view, car=self._car))
        return picture

    def close(self) -> None:
        """Nothing is to be released."""
