"""The cars that a server offers to pages, and a page's connection to one of them, simulated or real."""

from collections.abc import Callable
from typing import Any, Literal, Protocol

from motorcade.cameras.broadcast import Camera
from motorcade.drive.input.deadman import stick_word
from motorcade.drive.session import CarControl
from motorcade.errors import MotorcadeError
from motorcade.server.remote.messages import CarTelemetry, ListedCar

# The most cars that a page may be connected to at once, and the most open cameras of a world.
MOST_CARS = 16
# Operations of a session of `motorcade.drive`, by their names there.
Action = Literal["request", "release", "stop", "clear", "resume_program"]


class PageControl(Protocol):
    """One page's connection to one car."""

    def steer(self, throttle: float, steering: float) -> None:
        """Set the stick's position, both axes -1 to 1; a car that can't be reached stands still."""

    async def act(self, action: Action) -> None:
        """Request an action of the car; this may take a while. Raises MotorcadeError where the car refuses."""

    def telemetry(self) -> CarTelemetry:
        """The car's telemetry, and what concerns this page."""

    def leave(self) -> None:
        """End the connection; the car stands still if this page drove it."""


class LocalControl:
    """A page's connection to a car of this process.

    Args:
        car: the car.
        page: the page's name there.
        left: called when the page leaves.
        is_paused: whether the car's world is paused.

    Raises:
        MotorcadeError: too many are connected to the car.
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
        self._session = car.join(page)

    def steer(self, throttle: float, steering: float) -> None:
        """Set the stick's position."""
        self._session.command(stick_word(throttle, steering))

    async def act(self, action: Action) -> None:
        """Request an action of the car. Raises MotorcadeError where it refuses."""
        getattr(self._session, action)()

    def telemetry(self) -> CarTelemetry:
        """The car's telemetry, and what concerns this page."""
        telemetry = self._car.telemetry()
        you: dict[str, Any] = {"drives": self._session.drives, "waits": telemetry.wanted_by == self._page}
        you |= self._session.counts.as_dict()
        return CarTelemetry(**telemetry._asdict(), paused=self._is_paused(), silent_ms=0, you=you)

    def leave(self) -> None:
        """End the connection."""
        self._session.leave()
        self._left()


class Fleet(Protocol):
    """The cars that a page may drive. Every method may raise MotorcadeError."""

    async def listed(self) -> list[ListedCar]:
        """All cars, in the order of the page's list."""

    async def connect(self, car: str, page: str) -> PageControl:
        """Connect a page of that name to a car."""

    async def camera(self, car: str) -> Camera | None:
        """A car's camera; None where it has none."""

    async def start(self) -> None:
        """Run their world where it is paused."""


class SingleCar:
    """The fleet of a car that serves its own page.

    Args:
        car: the car; the caller calls its ``beat``.
        camera: its camera; None where it has none.
    """

    _NAME = "1"

    def __init__(self, car: CarControl, camera: Camera | None = None) -> None:
        self._car = car
        self._camera = camera

    async def listed(self) -> list[ListedCar]:
        """The car itself."""
        return [ListedCar(self._NAME, None, self._camera is not None)]

    async def connect(self, car: str, page: str) -> PageControl:
        """Connect a page to the car. Raises MotorcadeError for any other car."""
        self._check(car)
        return LocalControl(self._car, page)

    async def camera(self, car: str) -> Camera | None:
        """The car's camera, also where no car is named. Raises MotorcadeError for any other car."""
        if car:
            self._check(car)
        return self._camera

    async def start(self) -> None:
        """Do nothing: real time can't be paused."""

    def _check(self, car: str) -> None:
        if car != self._NAME:
            raise MotorcadeError("car-not-listed", car=car)


class CombinedFleet:
    """The cars of a world, then real cars.

    Args:
        simulated: the cars of a world.
        real: the real cars; their names differ from those of ``simulated``.
    """

    def __init__(self, simulated: Fleet, real: Fleet) -> None:
        self._simulated = simulated
        self._real = real

    async def listed(self) -> list[ListedCar]:
        """All of them."""
        return await self._simulated.listed() + await self._real.listed()

    async def connect(self, car: str, page: str) -> PageControl:
        """Connect a page to a car."""
        return await (await self._of(car)).connect(car, page)

    async def camera(self, car: str) -> Camera | None:
        """A car's camera; None where it has none."""
        return await (await self._of(car)).camera(car)

    async def start(self) -> None:
        """Run the world where it is paused."""
        await self._simulated.start()

    async def _of(self, car: str) -> Fleet:
        return self._real if car in {each.car for each in await self._real.listed()} else self._simulated
