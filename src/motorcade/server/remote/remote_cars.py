"""Cars that are served elsewhere, by address: the only addresses that a page can make this server connect to."""

import asyncio
import re
import ssl
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable
from typing import Any, NamedTuple

from motorcade.cameras.broadcast import Camera
from motorcade.cameras.web import WebCamera
from motorcade.drive.client import DriveClient
from motorcade.drive.connection import CarError, CarRefusesError
from motorcade.drive.session import MOST_SESSIONS, DriveError
from motorcade.server.remote.control import PageControl
from motorcade.server.remote.errors import RemoteError, said
from motorcade.server.remote.fleet import Fleet, Listed

_AGAIN_S = 0.1
_NAME = re.compile(r"\w[\w-]{0,39}")
# What is shown of a car that tells nothing.
_UNKNOWN = {
    "state": "away",
    "angle_deg": 90,
    "direction": 1,
    "speed": 0,
    "driver": None,
    "wanted_by": None,
    "age_ms": None,
    "battery_mv": None,
    "last_fault": "",
    "you": {"drives": False, "waits": False},
}


class RemoteCar(NamedTuple):
    """Where a car is.

    Attributes:
        name: what its owner calls it; where drivers have keys, also what its own keys call it.
        host, port, telemetry_port: as `motorcade.drive.client.DriveClient` has them; None: the port behind.
        camera: the address of its pictures, http:// or https://, if it has a camera.
    """

    name: str
    host: str
    port: int
    telemetry_port: int | None = None
    camera: str | None = None


def is_name(text: str) -> bool:
    """Whether a far car may be called so: up to 40 letters, digits and hyphens, but no number, as those are others'."""
    return bool(_NAME.fullmatch(text)) and not text.isdecimal()


class RemoteControl:
    """A page's seat at a far car: a connection of its own, so that the car sees who drives and who watches.

    Args:
        client: for this page alone; begun already.
        left: called when the seat is given back, to end the client.
    """

    def __init__(self, client: DriveClient, left: Callable[[], None]) -> None:
        self._client = client
        self._left = left
        self._owes_stop = False

    def steer(self, throttle: float, steering: float) -> None:
        """As `PageControl.steer`."""
        if not self._owes_stop:
            self._client.steer(throttle, steering)

    async def request(self) -> None:
        """As `PageControl.request`."""
        await _asked(self._client.request())

    async def release(self) -> None:
        """As `PageControl.release`."""
        await _asked(self._client.release())

    async def stop(self) -> None:
        """As `PageControl.stop`; a car that is away is stopped as soon as it is back."""
        if self._owes_stop:
            return
        self._owes_stop = True
        while self._owes_stop:
            try:
                await self._client.stop()
                self._owes_stop = False
            except CarRefusesError as problem:
                self._owes_stop = False
                raise said(problem) from None
            except CarError:
                await asyncio.sleep(_AGAIN_S)

    async def clear(self) -> None:
        """As `PageControl.clear`."""
        self._owes_stop = False
        await _asked(self._client.clear())

    async def resume_program(self) -> None:
        """As `PageControl.resume_program`."""
        await _asked(self._client.resume_program())

    def told(self) -> dict[str, Any]:
        """As `PageControl.told`."""
        told = self._client.telemetry
        more = {"paused": False, "silent_ms": self._client.silent_ms}
        if told is None:
            return _UNKNOWN | more | {"why": self._why()}
        you = self._client.you
        waits = told.wanted_by is not None and told.wanted_by == you.get("name")
        shown = told._asdict() | more | {"why": None, "you": {"drives": False} | you | {"waits": waits}}
        if self._client.waits_for_release and told.state in ("ready", "standing"):
            # The car has forgotten the hand that held the stick while the connection broke; its client hasn't.
            shown["state"] = "failsafe"
        return shown

    def leave(self) -> None:
        """As `PageControl.leave`."""
        self._owes_stop = False
        self._client.steer(0, 0)
        self._left()

    def _why(self) -> dict[str, str] | None:
        problem = self._client.problem
        if problem is None:
            return None
        # Seconds that count up would be read aloud once a second.
        is_gone = problem.code == "away"
        error = RemoteError("car-away", 409, detail=problem.details["detail"]) if is_gone else said(problem)
        sentences: dict[str, str] = error.as_dict()["message"]
        return sentences


async def _asked(asking: Awaitable[object]) -> None:
    try:
        await asking
    except CarError as problem:
        raise said(problem) from None


class RemoteCars:
    """The garage of cars by address.

    Args:
        cars: no two of one name.
        keys: the TLS context of a driver's keys (`motorcade.drive.tls.keys.client_context`), where the cars want keys.
        trust: whom HTTPS cameras have to be; what this computer trusts, unless given.
    """

    def __init__(
        self, cars: Iterable[RemoteCar], keys: ssl.SSLContext | None = None, trust: ssl.SSLContext | None = None
    ) -> None:
        self._cars = {car.name: car for car in cars}
        self._keys = keys
        self._trust = trust
        self._pages: Counter[str] = Counter()
        # Tasks live only as long as somebody knows them.
        self._ending: set[asyncio.Task[None]] = set()
        self._cameras: dict[str, Camera] = {}

    def __contains__(self, car: str) -> bool:
        return car in self._cars

    async def listed(self) -> list[Listed]:
        """All of them, as their owner named them."""
        return [Listed(car.name, None, car.camera is not None, car.name) for car in self._cars.values()]

    async def enter(self, car: str, page: str) -> PageControl:
        """A seat at a car, whether or not the car is there. Raises RemoteError."""
        there = self._car(car)
        if self._pages[car] >= MOST_SESSIONS:
            raise said(DriveError("full", seats=MOST_SESSIONS))
        client = DriveClient(
            there.host,
            there.port,
            telemetry_port=there.telemetry_port,
            keys=self._keys,
            car=car if self._keys else None,
            rearm=False,
        )
        client.begin()
        self._pages[car] += 1
        return RemoteControl(client, lambda: self._left(car, client))

    async def camera(self, car: str) -> Camera | None:
        """The car's camera, one for all who look. Raises RemoteError."""
        url = self._car(car).camera
        if url is not None and car not in self._cameras:
            self._cameras[car] = Camera(WebCamera(url, self._trust))
        return self._cameras.get(car)

    async def start(self) -> None:
        """Their time is everybody's."""

    def _left(self, car: str, client: DriveClient) -> None:
        self._pages[car] -= 1
        ending = asyncio.create_task(client.end())
        self._ending.add(ending)
        ending.add_done_callback(self._ending.discard)

    def _car(self, car: str) -> RemoteCar:
        if car not in self._cars:
            raise RemoteError("no-such-car", 404, car=car)
        return self._cars[car]


class CombinedFleet:
    """The cars of another garage, then those by address."""

    def __init__(self, near: Fleet, far: RemoteCars) -> None:
        self._near = near
        self._far = far

    async def listed(self) -> list[Listed]:
        """All of them."""
        return await self._near.listed() + await self._far.listed()

    async def enter(self, car: str, page: str) -> PageControl:
        """As `Fleet.enter`."""
        return await self._of(car).enter(car, page)

    async def camera(self, car: str) -> Camera | None:
        """As `Fleet.camera`."""
        return await self._of(car).camera(car)

    async def start(self) -> None:
        """As `Fleet.start`."""
        await self._near.start()

    def _of(self, car: str) -> Fleet:
        return self._far if car in self._far else self._near
