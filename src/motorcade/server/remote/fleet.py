"""The cars that a server offers to pages, and what a page needs of its connection to one of them.

The connection to a car of this process is a `motorcade.drive.session.ControlSession`, that to a car behind a network a
`motorcade.server.remote.remote_cars.RemoteControl`.
"""

from typing import Any, Literal, Protocol

from motorcade.cameras.broadcast import Camera
from motorcade.drive.session import CarControl
from motorcade.errors import MotorcadeError
from motorcade.server.remote.messages import ListedCar

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

    def steer(self, throttle: float, steering: float, **switches: int) -> None:
        """Set the stick's position, both axes -1 to 1, and switches, 0 or 1 by name.

        A car that can't be reached stands still. Raises MotorcadeError: others have all places at the car, or there is
        no such switch.
        """

    async def act(self, action: Action) -> None:
        """Request an action of the car; this may take a while. Raises MotorcadeError where the car refuses."""

    def telemetry(self) -> dict[str, Any]:
        """The fields of `motorcade.server.remote.messages.CarTelemetry` that are known of the car and this page."""

    def leave(self) -> None:
        """End the connection; the car stands still if this page drove it."""


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

    def is_paused(self, car: str) -> bool:
        """Whether a car's world is paused; real time never is."""
        return False

    async def start(self) -> None:
        """Run the cars' world where it is paused."""
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
        return self._car.session(page, address_of(page))

    async def camera(self, car: str) -> Camera | None:
        """The car's camera, also where no car is named. Raises MotorcadeError for any other car."""
        if car:
            self._check(car)
        return self._camera

    def _check(self, car: str) -> None:
        if car != self._NAME:
            raise MotorcadeError("car-not-listed", car=car)


class CombinedFleet(Fleet):
    """The cars of a world, whose names are numbers, then real cars, whose names are none."""

    def __init__(self, simulated: Fleet, real: Fleet) -> None:
        self._simulated = simulated
        self._real = real

    async def listed(self) -> list[ListedCar]:
        return await self._simulated.listed() + await self._real.listed()

    async def connect(self, car: str, page: str) -> PageControl:
        return await self._of(car).connect(car, page)

    async def stop(self, car: str, page: str) -> None:
        await self._of(car).stop(car, page)

    async def camera(self, car: str) -> Camera | None:
        return await self._of(car).camera(car)

    def is_paused(self, car: str) -> bool:
        return self._of(car).is_paused(car)

    async def start(self) -> None:
        await self._simulated.start()

    def _of(self, car: str) -> Fleet:
        return self._simulated if car.isdecimal() else self._real
