"""The cars that a server offers to pages, and a page's connection to one of them, simulated or real.

The page's connection to a real car is in `motorcade.server.remote.remote_cars`.
"""

from collections.abc import Callable
from typing import Any, Literal, Protocol

from motorcade.cameras.broadcast import Camera
from motorcade.car.arbiter import NEUTRAL
from motorcade.drive.deadman import stick_word
from motorcade.drive.session import CarControl, ControlSession, Who
from motorcade.drive.wire import Counts
from motorcade.errors import MotorcadeError
from motorcade.server.remote.messages import CarTelemetry, ListedCar

# The most cars that a page may be connected to at once, and the most open cameras of a world.
MOST_CARS = 16
# No user's name has this character, so nobody can pose as somebody at another address.
_BEFORE_ADDRESS = " · "
# Operations of a session of `motorcade.drive`, by their names there.
Action = Literal["request", "release", "stop", "clear", "resume_program"]


def named_page(user: str, address: str) -> str:
    """The name of a page, which others are shown: its user's name, if there is one, and where it comes from."""
    return f"{user}{_BEFORE_ADDRESS}{address}" if user else address


def address_of(page: str) -> str:
    """The address, without its port, in a page's name: one client, whatever its users call themselves."""
    return page.rpartition(_BEFORE_ADDRESS)[2].rpartition(":")[0]


def has_user(page: str) -> bool:
    """Whether a page's name has its user's."""
    return _BEFORE_ADDRESS in page


class PageControl(Protocol):
    """One page's connection to one car."""

    def steer(self, throttle: float, steering: float) -> None:
        """Set the stick's position, both axes -1 to 1; a car that can't be reached stands still.

        Raises MotorcadeError where others have all places at the car.
        """

    async def act(self, action: Action) -> None:
        """Request an action of the car; this may take a while. Raises MotorcadeError where the car refuses."""

    def telemetry(self) -> CarTelemetry:
        """The car's telemetry, and what concerns this page."""

    def leave(self) -> None:
        """End the connection; the car stands still if this page drove it."""


class LocalControl(PageControl):
    """A page's connection, under the name ``page``, to a car of this process; ``left`` is called when it leaves.

    A page that only looks needs no session, so any number of pages may be connected. One that steers has a session,
    until others need its place and it is silent. It arms the car first, unless the car has stopped by itself.
    """

    def __init__(
        self,
        car: CarControl,
        page: str,
        left: Callable[[], None] = lambda: None,
        is_paused: Callable[[], bool] = lambda: False,
    ) -> None:
        self._car = car
        self._page = page
        self._left = left
        self._is_paused = is_paused
        self._session: ControlSession | None = None
        self._counts = Counts()

    def steer(self, throttle: float, steering: float) -> None:
        is_new, session = self._session is None, self._joined()
        if is_new and throttle and self._car.telemetry().state != "failsafe":
            session.command(NEUTRAL)
        session.command(stick_word(throttle, steering))

    async def act(self, action: Action) -> None:
        if action == "stop":
            self._car.stop(self._page)
        else:
            getattr(self._joined(), action)()

    def telemetry(self) -> CarTelemetry:
        telemetry = self._car.telemetry()
        drives = self._session is not None and self._session.drives
        you: dict[str, Any] = {"drives": drives, "waits": telemetry.wanted_by == self._page} | self._counts.as_dict()
        return CarTelemetry(**telemetry._asdict(), paused=self._is_paused(), silent_ms=0, you=you)

    def leave(self) -> None:
        if self._session:
            self._session.leave()
        self._left()

    def _joined(self) -> ControlSession:
        """The session, which begins where there is none. Raises DriveError where all places are taken."""
        if self._session is None:
            who = Who(address_of(self._page), replaced=self._forget_session)
            self._session = self._car.join(self._page, who, counts=self._counts)
        return self._session

    def _forget_session(self) -> None:
        self._session = None


class Fleet(Protocol):
    """The cars that a page may drive. Every method may raise MotorcadeError."""

    async def listed(self) -> list[ListedCar]:
        """All cars, in the order of the page's list."""

    async def connect(self, car: str, page: str) -> PageControl:
        """Connect a page of that name, such as ``192.168.1.7:53124``, to a car."""

    async def stop(self, car: str, page: str) -> None:
        """Emergency stop, by a page that is not connected to the car."""
        control = await self.connect(car, page)
        try:
            await control.act("stop")
        finally:
            control.leave()

    async def camera(self, car: str) -> Camera | None:
        """A car's camera; None where it has none."""

    async def start(self) -> None:
        """Run the cars' world where it is paused."""
        # Real time can't be paused: real cars have nothing to do.
        return


class SingleCar(Fleet):
    """The fleet of a car that serves its own page; the caller calls the car's ``beat``."""

    _NAME = "1"

    def __init__(self, car: CarControl, camera: Camera | None = None) -> None:
        self._car = car
        self._camera = camera

    async def listed(self) -> list[ListedCar]:
        return [ListedCar(self._NAME, None, self._camera is not None)]

    async def connect(self, car: str, page: str) -> PageControl:
        self._check(car)
        return LocalControl(self._car, page)

    async def camera(self, car: str) -> Camera | None:
        """The car's camera, also where no car is named. Raises MotorcadeError for any other car."""
        if car:
            self._check(car)
        return self._camera

    def _check(self, car: str) -> None:
        if car != self._NAME:
            raise MotorcadeError("car-not-listed", car=car)


class CombinedFleet(Fleet):
    """The cars of a world, then real cars, whose names differ from theirs."""

    def __init__(self, simulated: Fleet, real: Fleet) -> None:
        self._simulated = simulated
        self._real = real

    async def listed(self) -> list[ListedCar]:
        return await self._simulated.listed() + await self._real.listed()

    async def connect(self, car: str, page: str) -> PageControl:
        return await (await self._of(car)).connect(car, page)

    async def stop(self, car: str, page: str) -> None:
        await (await self._of(car)).stop(car, page)

    async def camera(self, car: str) -> Camera | None:
        return await (await self._of(car)).camera(car)

    async def start(self) -> None:
        await self._simulated.start()

    async def _of(self, car: str) -> Fleet:
        return self._real if car in {each.car for each in await self._real.listed()} else self._simulated
