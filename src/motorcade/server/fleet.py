"""The cars that a server offers to pages, and what a page needs of its connection to one of them.

The connection to a car of this process is a `motorcade.drive.session.ControlSession`, that to a car behind a network a
`RemoteControl`. A page can't make the server connect to any address: it chooses from the cars in the server's settings.
"""

import asyncio
import re
import ssl
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any, Literal, NamedTuple

from motorcade.cameras.broadcast import Camera, WebCamera
from motorcade.drive.client import DriveClient
from motorcade.drive.connection import AwayError, CarRefusesError
from motorcade.drive.session import MOST_SESSIONS, CarControl, ControlSession
from motorcade.drive.wire import SessionError
from motorcade.errors import DriveError, MotorcadeError
from motorcade.server.remote_messages import ListedCar
from motorcade.service.messages import sentences

# The most cars that a page may be connected to at once, and the most open cameras of a world.
MOST_CARS = 16
# No user's name has this character, so nobody can pose as somebody at another address.
_BEFORE_ADDRESS = " · "
# Operations of a session of `motorcade.drive`, by their names there.
Action = Literal["request", "release", "stop", "clear", "resume_program"]
_AGAIN_S = 0.1
# A page that has not used a real car for so long gives its place to another page.
IDLE_S = 5.0
_NAME = re.compile(r"\w[\w-]{0,39}")


def named_page(user: str, address: str) -> str:
    """The name of a page, which others are shown: its user's name, if there is one, and where it comes from."""
    if user:
        return f"{user}{_BEFORE_ADDRESS}{address}"
    return address


def address_of(page: str) -> str:
    """The address, without its port, in a page's name: one client, whatever its users call themselves."""
    return page.rpartition(_BEFORE_ADDRESS)[2].rpartition(":")[0]


class Fleet:
    """The cars that a page may drive. Every method may raise MotorcadeError."""

    async def listed(self) -> list[ListedCar]:
        """All cars, in the order of the page's list."""
        raise NotImplementedError

    async def connect(self, car: str, page: str) -> "PageControl":
        """Connect a page of that name, such as ``192.168.1.7:53124``, to a car."""
        raise NotImplementedError

    async def stop(self, car: str, page: str) -> None:
        """Emergency stop, by a page that is not connected to the car."""
        control = await self.connect(car, page)
        try:
            await control.act("stop")
        finally:
            control.leave()

    async def camera(self, car: str) -> Camera | None:
        """A car's camera; None where it has none."""
        return None

    def is_paused(self, car: str) -> bool:
        """Whether a car's world is paused; real time never is."""
        return False

    def may_drive(self, car: str) -> bool:
        """Whether the page may drive a car now; it may stop any of them."""
        return True

    async def start(self) -> None:
        """Run the cars' world where it is paused."""

    def of(self, car: str) -> "Fleet":
        """The fleet that a car belongs to."""
        return self


class SingleCar(Fleet):
    """The fleet of a car that serves its own page; the caller calls the car's ``beat``."""

    _NAME = "1"

    def __init__(self, car: CarControl, camera: Camera | None = None) -> None:
        self._car = car
        self._camera = camera

    async def listed(self) -> list[ListedCar]:
        return [ListedCar(self._NAME, None, self._camera is not None)]

    async def connect(self, car: str, page: str) -> ControlSession:
        self._check(car)
        return ControlSession(self._car, page, address_of(page))

    async def camera(self, car: str) -> Camera | None:
        """The car's camera, also where no car is named. Raises MotorcadeError for any other car."""
        if car:
            self._check(car)
        return self._camera

    def _check(self, car: str) -> None:
        if car != self._NAME:
            raise MotorcadeError("car-not-listed", car=car)


class CombinedFleet(Fleet):
    """The cars of a visitor: those of a world, whose names are numbers, then real cars, whose names are none.

    To connect, to stop, for a camera and for a pause ask the fleet that `of` returns: this one has none of them.

    Args:
        simulated: the cars of the visitor's world; None where there is no world.
        real: the real cars.
        may_drive: whether the visitor may drive a real car now.
    """

    def __init__(self, simulated: Fleet | None, real: Fleet, may_drive: Callable[[str], bool]) -> None:
        self._simulated = simulated
        self._real = real
        self._may_drive = may_drive

    async def listed(self) -> list[ListedCar]:
        simulated = []
        if self._simulated:
            simulated = await self._simulated.listed()
        return simulated + await self._real.listed()

    def may_drive(self, car: str) -> bool:
        return self.of(car) is self._simulated or self._may_drive(car)

    async def start(self) -> None:
        if self._simulated:
            await self._simulated.start()

    def of(self, car: str) -> Fleet:
        if self._simulated and car.isdecimal():
            return self._simulated
        return self._real


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


class RemoteControl:
    """A page's connection to a real car, by a client of its own, so that the car distinguishes drivers and watchers.

    A car that can't be reached stands still.

    Args:
        cars: begin and end its client. Raises SessionError where the car has too many.
        car: to which it connects.
        page: its name.

    Attributes:
        client: of this page alone; None while another page has its place.
    """

    def __init__(self, cars: "RemoteCars", car: RemoteCar, page: str) -> None:
        self.page = page
        self._cars = cars
        self._car = car
        self.client: DriveClient | None = cars.begin(car)
        self._used_s = _now_s()
        self._stop_pending = False

    @property
    def idle_s(self) -> float:
        """Time since the page last used the car; 0 while it drives, waits for the wheel, or has no client."""
        if self.client:
            you = self.client.you
        else:
            you = {"drives": True}
        is_used = you.get("drives") or you.get("waits") or self._stop_pending
        if is_used:
            return 0.0
        return _now_s() - self._used_s

    def give_up_client(self) -> None:
        """End the client; the page gets a new one when it uses the car again."""
        if self.client:
            self._cars.end(self.client)
        self.client = None

    def steer(self, throttle: float, steering: float, **switches: int) -> None:
        """Set the stick's position, both axes -1 to 1, and switches, 0 or 1 by name.

        Do nothing while an emergency stop is pending. Raises MotorcadeError: others have all places at the car, or
        there is no such switch.
        """
        if not self._stop_pending:
            self._used().steer(throttle, steering, **switches)

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
        if self.client is None:
            self.client = self._cars.begin(self._car)
        return self.client

    async def _stop(self) -> None:
        self._cars.stops[self._car.name] += 1
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
            except DriveError:
                await asyncio.sleep(_AGAIN_S)

    def telemetry(self) -> dict[str, Any]:
        """The last telemetry and what concerns this page, by name: also all of `remote_messages.CarTelemetry`."""
        if not (client := self.client):
            return {"why": sentences(MotorcadeError("place-given-up"))}
        telemetry = client.telemetry
        if telemetry is None:
            return {"silent_ms": client.silent_ms, "why": _why(client)}
        shown = telemetry._asdict() | {
            "silent_ms": client.silent_ms,
            "you": {"drives": False, "waits": False} | client.you,
        }
        # A car knows whose keys a client has; only this server knows whose page it is.
        names = self._cars.page_names(self._car)
        for role in ("driver", "wanted_by"):
            shown[role] = names.get(shown[role], shown[role])
        if client.waits_for_release and telemetry.state in ("ready", "standing"):
            # The car no longer knows that the stick was held when the connection broke; its client does.
            shown["state"] = "failsafe"
        return shown

    def leave(self) -> None:
        """End the connection; the car stands still if this page drove it."""
        self._stop_pending = False
        try:
            if self.client:
                self.client.steer(0, 0)
        finally:
            self.give_up_client()
            self._cars.leave(self._car, self)


# A page's connection to a car: of this process, or behind a network.
PageControl = ControlSession | RemoteControl


def _now_s() -> float:
    return asyncio.get_running_loop().time()


def _why(client: DriveClient) -> dict[str, str] | None:
    problem: MotorcadeError | None = client.problem
    if isinstance(problem, AwayError):
        # Its own sentence has a count of seconds, which a screen reader would read aloud every second.
        problem = MotorcadeError("car-out-of-reach", detail=problem.details["detail"])
    if problem:
        return sentences(problem)
    return None


class RemoteCars(Fleet):
    """The fleet of real cars.

    Args:
        cars: no two of one name.
        keys: the TLS context of a driver's keys (`motorcade.drive.keys.client_context`), where the cars need keys.
        trust: the certificates that HTTPS cameras may have; None for those that this computer trusts.

    Attributes:
        stops: how often each car was to be stopped.
    """

    def __init__(
        self, cars: Iterable[RemoteCar], keys: ssl.SSLContext | None = None, trust: ssl.SSLContext | None = None
    ) -> None:
        self._cars = {car.name: car for car in cars}
        self._keys = keys
        self._trust = trust
        self._controls: dict[str, list[RemoteControl]] = {car: [] for car in self._cars}
        # A task that nothing refers to may be collected before it ends.
        self._ending: set[asyncio.Task[None]] = set()
        self._cameras: dict[str, Camera] = {}
        self.stops: Counter[str] = Counter()

    async def listed(self) -> list[ListedCar]:
        return [ListedCar(car.name, None, car.camera is not None, car.name) for car in self._cars.values()]

    async def connect(self, car: str, page: str) -> RemoteControl:
        """Connect a page to a car, whether or not the car can be reached. Raises MotorcadeError.

        Where nine pages are connected, the one that has not used the car for longest gives up its client, if that is
        longer than IDLE_S.
        """
        control = RemoteControl(self, self._car(car), page)
        self._controls[car].append(control)
        return control

    def leave(self, car: RemoteCar, control: RemoteControl) -> None:
        """Forget a connection that has ended."""
        self._controls[car.name].remove(control)

    def page_names(self, car: RemoteCar) -> dict[str, str]:
        """The names of this server's pages with a user, by their names at a car; "" where it hasn't said."""
        return {
            str(control.client.you.get("name") or ""): control.page
            for control in self._controls[car.name]
            if control.client and _BEFORE_ADDRESS in control.page
        }

    async def stop(self, car: str, page: str) -> None:
        """Emergency stop, by a page that is not connected to the car; where nine are, by one of their clients."""
        self._car(car)
        self.stops[car] += 1
        if reached := [client for client in self._clients(car) if client.connected]:
            await reached[0].stop()
        else:
            await super().stop(car, page)

    def _clients(self, car: str) -> list[DriveClient]:
        return [control.client for control in self._controls[car] if control.client]

    def begin(self, found: RemoteCar) -> DriveClient:
        """Begin a client of a car. Raises SessionError where it has too many, and all of them are used."""
        if len(self._clients(found.name)) >= MOST_SESSIONS:
            idlest = max(self._controls[found.name], key=lambda control: control.idle_s)
            if idlest.idle_s <= IDLE_S:
                raise SessionError("full", sessions=MOST_SESSIONS)
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
        return client

    async def camera(self, car: str) -> Camera | None:
        """The car's camera, one for all pages. Raises MotorcadeError."""
        url = self._car(car).camera
        if url is not None and car not in self._cameras:
            self._cameras[car] = Camera(WebCamera(url, self._trust))
        return self._cameras.get(car)

    def end(self, client: DriveClient) -> None:
        """End a client, in a task of its own."""
        ending = asyncio.create_task(client.end())
        self._ending.add(ending)
        ending.add_done_callback(self._ending.discard)

    def _car(self, car: str) -> RemoteCar:
        if car not in self._cars:
            raise MotorcadeError("car-not-listed", car=car)
        return self._cars[car]
