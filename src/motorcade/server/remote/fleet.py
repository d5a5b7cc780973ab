"""The cars that a server offers to pages, and a page's connection to one of them, simulated or real.

A page can't make the server connect to any address: it chooses from the cars in the server's settings.
"""

import asyncio
import re
import ssl
from collections.abc import Callable, Iterable
from typing import Any, Literal, NamedTuple, Protocol

from motorcade.cameras.broadcast import Camera
from motorcade.cameras.web import WebCamera
from motorcade.car.arbiter import NEUTRAL
from motorcade.drive.client import DriveClient
from motorcade.drive.connection import CarError, CarRefusesError
from motorcade.drive.input.deadman import stick_word
from motorcade.drive.session import MOST_SESSIONS, CarControl, ControlSession, DriveError, Who
from motorcade.drive.wire import Counts
from motorcade.errors import MotorcadeError
from motorcade.server.remote.messages import CarTelemetry, ListedCar
from motorcade.service.messages import sentences

_AGAIN_S = 0.1
# A page that has not used a real car for so long gives its place to another page.
IDLE_S = 5.0
_NAME = re.compile(r"\w[\w-]{0,39}")
# The most cars that a page may be connected to at once, and the most open cameras of a world.
MOST_CARS = 16
# Operations of a session of `motorcade.drive`, by their names there.
Action = Literal["request", "release", "stop", "clear", "resume_program"]


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
            who = Who(self._page.rpartition(":")[0], replaced=self._forget_session)
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


class RemoteCar(NamedTuple):
    """Where a car is.

    Attributes:
        name: the name that its owner gave it; where drivers have keys, also the name in its own keys.
        host, port, telemetry_port: as `motorcade.drive.client.DriveClient` has them; None: the port behind.
        camera: the address of its pictures, http:// or https://, if it has a camera.
    """

    name: str
    host: str
    port: int
    telemetry_port: int | None = None
    camera: str | None = None


def is_name(text: str) -> bool:
    """Whether a real car may have this name: up to 40 letters, digits and hyphens; numbers are simulated cars."""
    return bool(_NAME.fullmatch(text)) and not text.isdecimal()


class RemoteControl(PageControl):
    """A page's connection to a real car, by a client of its own, so that the car distinguishes drivers and watchers.

    Args:
        begin: makes and begins a client for this page alone. Raises DriveError where there are too many.
        end: ends it.
        left: called when the page leaves.
    """

    def __init__(
        self, begin: Callable[[], DriveClient], end: Callable[[DriveClient], None], left: Callable[[], None]
    ) -> None:
        self._begin = begin
        self._end = end
        self._left = left
        self._client: DriveClient | None = begin()
        self._used_s = _now_s()
        self._stop_pending = False

    @property
    def idle_s(self) -> float:
        """Time since the page last used the car; 0 while it drives, waits for the wheel, or has no client."""
        you = self._client.you if self._client else {"drives": True}
        waits = self._client is not None and self._waits(self._client)
        return 0.0 if you.get("drives") or waits or self._stop_pending else _now_s() - self._used_s

    def give_up_client(self) -> None:
        """End the client; the page gets a new one when it uses the car again."""
        if self._client:
            self._end(self._client)
        self._client = None

    def steer(self, throttle: float, steering: float) -> None:
        """Set the stick's position; do nothing while an emergency stop is pending. Raises DriveError."""
        if not self._stop_pending:
            self._used().steer(throttle, steering)

    async def act(self, action: Action) -> None:
        """Request an action of the car. Raises MotorcadeError where it refuses.

        A car out of reach is stopped as soon as it can be reached again, unless the stop is lifted before.
        """
        if action == "stop":
            await self._stop()
            return
        if action == "clear":
            self._stop_pending = False
        await getattr(self._used(), action)()

    def _used(self) -> DriveClient:
        self._used_s = _now_s()
        if self._client is None:
            self._client = self._begin()
        return self._client

    async def _stop(self) -> None:
        if self._stop_pending:
            return
        self._stop_pending = True
        while self._stop_pending:
            try:
                await self._used().stop()
                self._stop_pending = False
            except CarRefusesError:
                self._stop_pending = False
                raise
            except CarError:
                await asyncio.sleep(_AGAIN_S)

    def telemetry(self) -> CarTelemetry:
        """The last telemetry, and what concerns this page."""
        client = self._client
        if client is None:
            return CarTelemetry(silent_ms=0, why=sentences(MotorcadeError("place-given-up")))
        telemetry = client.telemetry
        if telemetry is None:
            return CarTelemetry(silent_ms=client.silent_ms, why=_why(client))
        you = {"drives": False} | client.you | {"waits": self._waits(client)}
        shown = CarTelemetry(**telemetry._asdict(), silent_ms=client.silent_ms, you=you)
        if client.waits_for_release and shown.state in ("ready", "standing"):
            # The car no longer knows that the stick was held when the connection broke; its client does.
            shown.state = "failsafe"
        return shown

    def leave(self) -> None:
        self._stop_pending = False
        if self._client:
            self._client.steer(0, 0)
        self.give_up_client()
        self._left()

    @staticmethod
    def _waits(client: DriveClient) -> bool:
        wanted_by = client.telemetry and client.telemetry.wanted_by
        return wanted_by is not None and wanted_by == client.you.get("name")


def _now_s() -> float:
    return asyncio.get_running_loop().time()


def _why(client: DriveClient) -> dict[str, str] | None:
    problem = client.problem
    if problem is None:
        return None
    if problem.code == "away":
        # Its own sentence has a count of seconds, which a screen reader would read aloud every second.
        return sentences(MotorcadeError("car-out-of-reach", detail=problem.details["detail"]))
    return sentences(problem)


class RemoteCars(Fleet):
    """The fleet of real cars.

    Args:
        cars: no two of one name.
        keys: the TLS context of a driver's keys (`motorcade.drive.tls.keys.client_context`), where the cars need keys.
        trust: the certificates that HTTPS cameras may have; None for those that this computer trusts.
    """

    def __init__(
        self, cars: Iterable[RemoteCar], keys: ssl.SSLContext | None = None, trust: ssl.SSLContext | None = None
    ) -> None:
        self._cars = {car.name: car for car in cars}
        self._keys = keys
        self._trust = trust
        self._controls: dict[str, list[RemoteControl]] = {car: [] for car in self._cars}
        self._clients: dict[str, list[DriveClient]] = {car: [] for car in self._cars}
        # A task that nothing refers to may be collected before it ends.
        self._ending: set[asyncio.Task[None]] = set()
        self._cameras: dict[str, Camera] = {}

    async def listed(self) -> list[ListedCar]:
        return [ListedCar(car.name, None, car.camera is not None, car.name) for car in self._cars.values()]

    async def connect(self, car: str, page: str) -> PageControl:
        """Connect a page to a car, whether or not the car can be reached. Raises MotorcadeError.

        Where nine pages are connected, the one that has not used the car for longest gives up its client, if that is
        longer than IDLE_S.
        """
        found = self._car(car)
        controls = self._controls[car]
        control = RemoteControl(
            lambda: self._begin(found), lambda client: self._end(car, client), lambda: controls.remove(control)
        )
        controls.append(control)
        return control

    async def stop(self, car: str, page: str) -> None:
        """Emergency stop, by a page that is not connected to the car; where nine are, by one of their clients."""
        self._car(car)
        if reached := [client for client in self._clients[car] if client.connected]:
            await reached[0].stop()
        else:
            await super().stop(car, page)

    def _begin(self, found: RemoteCar) -> DriveClient:
        clients = self._clients[found.name]
        if len(clients) >= MOST_SESSIONS:
            idlest = max(self._controls[found.name], key=lambda control: control.idle_s)
            if idlest.idle_s <= IDLE_S:
                raise DriveError("full", sessions=MOST_SESSIONS)
            idlest.give_up_client()
        client = DriveClient(
            found.host,
            found.port,
            telemetry_port=found.telemetry_port,
            keys=self._keys,
            car=found.name if self._keys else None,
            rearm=False,
        )
        client.begin()
        clients.append(client)
        return client

    async def camera(self, car: str) -> Camera | None:
        """The car's camera, one for all pages. Raises MotorcadeError."""
        url = self._car(car).camera
        if url is not None and car not in self._cameras:
            self._cameras[car] = Camera(WebCamera(url, self._trust))
        return self._cameras.get(car)

    def _end(self, car: str, client: DriveClient) -> None:
        self._clients[car].remove(client)
        ending = asyncio.create_task(client.end())
        self._ending.add(ending)
        ending.add_done_callback(self._ending.discard)

    def _car(self, car: str) -> RemoteCar:
        if car not in self._cars:
            raise MotorcadeError("car-not-listed", car=car)
        return self._cars[car]
