"""The cars that a server lets pages drive."""

from typing import NamedTuple, Protocol

from motorcade.link.camera import Camera
from motorcade.link.driving.drive import Drive
from motorcade.remote.errors import RemoteError


class Listed(NamedTuple):
    """A car as pages list it.

    Attributes:
        car: what it is called in messages.
        leads: whether it leads others; None where that means nothing.
        sees: whether it has a camera.
    """

    car: str
    leads: bool | None
    sees: bool


class Garage(Protocol):
    """Some cars, and the time in which they live. Every method may raise ServerError."""

    async def listed(self) -> list[Listed]:
        """All of them, the first ones first."""

    async def enter(self, car: str) -> Drive:
        """A car for somebody who will sit there; somebody else calls its ``beat``."""

    async def leave(self, car: str) -> None:
        """Whoever entered a car has left their seat."""

    async def camera(self, car: str) -> Camera | None:
        """A car's camera, if it has one."""

    async def is_running(self) -> bool:
        """Whether time goes on for them."""

    async def start(self) -> None:
        """Let time go on for them."""


class OneCar:
    """The garage of a car that serves its own page.

    Args:
        drive: the car.
        camera: its camera, if it has one.
    """

    _NAME = "1"

    def __init__(self, drive: Drive, camera: Camera | None = None) -> None:
        self._drive = drive
        self._camera = camera

    async def listed(self) -> list[Listed]:
        """The car itself."""
        return [Listed(self._NAME, None, self._camera is not None)]

    async def enter(self, car: str) -> Drive:
        """The car itself. Raises RemoteError for any other."""
        self._check(car)
        return self._drive

    async def leave(self, car: str) -> None:
        """It stays where it is."""

    async def camera(self, car: str) -> Camera | None:
        """The car's camera, also where no car is named. Raises RemoteError for any other."""
        if car:
            self._check(car)
        return self._camera

    async def is_running(self) -> bool:
        """Its time is everybody's."""
        return True

    async def start(self) -> None:
        """It goes on already."""

    def _check(self, car: str) -> None:
        if car != self._NAME:
            raise RemoteError("no-such-car", 404, car=car)
