"""The cars that a server lets pages drive."""

from typing import NamedTuple, Protocol

from motorcade.cameras.broadcast import Camera
from motorcade.drive.session import CarControl
from motorcade.server.remote.control import LocalControl, PageControl
from motorcade.server.remote.errors import RemoteError


class Listed(NamedTuple):
    """A car as pages list it.

    Attributes:
        car: what it is called in messages.
        leads: whether it leads others; None where that means nothing.
        sees: whether it has a camera.
        name: what its owner calls it, where it has a name.
    """

    car: str
    leads: bool | None
    sees: bool
    name: str | None = None


class Fleet(Protocol):
    """Some cars, and the time in which they live. Every method may raise ServerError."""

    async def listed(self) -> list[Listed]:
        """All of them, the first ones first."""

    async def enter(self, car: str, page: str) -> PageControl:
        """A seat at a car for a page of that name."""

    async def camera(self, car: str) -> Camera | None:
        """A car's camera, if it has one."""

    async def start(self) -> None:
        """Let time go on for them."""


class SingleCar:
    """The garage of a car that serves its own page.

    Args:
        drive: the car; somebody else calls its ``beat``.
        camera: its camera, if it has one.
    """

    _NAME = "1"

    def __init__(self, drive: CarControl, camera: Camera | None = None) -> None:
        self._drive = drive
        self._camera = camera

    async def listed(self) -> list[Listed]:
        """The car itself."""
        return [Listed(self._NAME, None, self._camera is not None)]

    async def enter(self, car: str, page: str) -> PageControl:
        """The car itself. Raises RemoteError for any other."""
        self._check(car)
        return LocalControl(self._drive, page)

    async def camera(self, car: str) -> Camera | None:
        """The car's camera, also where no car is named. Raises RemoteError for any other."""
        if car:
            self._check(car)
        return self._camera

    async def start(self) -> None:
        """Its time goes on already."""

    def _check(self, car: str) -> None:
        if car != self._NAME:
            raise RemoteError("no-such-car", 404, car=car)
