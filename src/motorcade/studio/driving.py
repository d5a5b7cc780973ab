"""The cars of a page's world as a remote drives them, each made ready when somebody first sits at it."""

import asyncio
from dataclasses import dataclass
from functools import partial
from weakref import WeakKeyDictionary, WeakValueDictionary

from starlette.requests import HTTPConnection
from starlette.routing import BaseRoute

from motorcade.link.camera import Camera
from motorcade.link.clock import monotonic_ms
from motorcade.link.drive_failures import DriveError
from motorcade.link.driving.drive import Drive
from motorcade.remote.app import routes as remote_routes
from motorcade.remote.cockpit import MOST_CARS
from motorcade.remote.errors import RemoteError
from motorcade.remote.garage import Garage, Listed
from motorcade.server.settings import ServerSettings
from motorcade.sim.errors import WorldError
from motorcade.studio.errors import StudioError, reason_of
from motorcade.studio.stage import Stage
from motorcade.studio.stages import Session, Stages

_MOST_LISTED = 200
_BEAT_S = 0.05


@dataclass(eq=False, slots=True)
class _Used:
    """A car at which somebody sits."""

    drive: Drive
    beating: asyncio.Task[None]
    sitting: int = 0


class SessionGarage:
    """The garage of one page's world."""

    def __init__(self, stages: Stages, session: Session) -> None:
        self._stages = stages
        self._session = session
        self._used: dict[int, _Used] = {}
        # A camera lives for as long as somebody looks through it.
        self._cameras: WeakValueDictionary[int, Camera] = WeakValueDictionary()

    async def listed(self) -> list[Listed]:
        """The leaders, then the followers, as far as a list is of use. Raises StudioError."""
        hello = await self._stages.work(self._session, Stage.hello)
        leads = set(hello["leads"])
        order = sorted(range(hello["cars"]), key=lambda car: (car not in leads, car))
        return [Listed(str(car), car in leads, True) for car in order[:_MOST_LISTED]]

    async def enter(self, car: str) -> Drive:
        """A car, which runs its program until somebody drives. Raises StudioError, RemoteError."""
        number = await self._number(car)
        profile = await self._stages.work(self._session, lambda stage: stage.profile)
        used = self._used.get(number)
        if used is None:
            drive = Drive(self._session.driven.board(number, has_program=True), monotonic_ms, profile)
            used = self._used[number] = _Used(drive, asyncio.create_task(_beat(drive)))
            _to_program(drive)
        used.sitting += 1
        return used.drive

    async def leave(self, car: str) -> None:
        """Where nobody sits at the car any more, it takes up its program again, unless the emergency stop holds it."""
        used = self._used[int(car)]
        used.sitting -= 1
        if not used.sitting and _to_program(used.drive):
            used.beating.cancel()
            del self._used[int(car)]

    async def camera(self, car: str) -> Camera:
        """What the car sees. Raises StudioError, RemoteError."""
        number = await self._number(car)
        camera = self._cameras.get(number)
        if camera is None:
            if len(self._cameras) >= MOST_CARS:
                raise RemoteError("too-many-cars", 409, most=MOST_CARS)
            camera = self._cameras[number] = Camera(_Eye(self._stages, self._session, number))
        return camera

    async def is_running(self) -> bool:
        """Whether the page is there and plays."""
        stage = self._session.stage
        return self._session.page is not None and stage is not None and stage.playing

    async def start(self) -> None:
        """Play. Raises StudioError."""
        await self._stages.work(self._session, lambda stage: stage.play(stage.speed))
        self._session.stirred.set()

    async def _number(self, car: str) -> int:
        cars = (await self._stages.work(self._session, Stage.hello))["cars"]
        if not car.isdecimal() or not car.isascii() or int(car) >= cars:
            raise RemoteError("no-such-car", 404, car=car)
        return int(car)


class _Eye:
    """A simulated camera, which asks the loop for each picture, since only there a stage has its turn."""

    def __init__(self, stages: Stages, session: Session, car: int) -> None:
        self._stages = stages
        self._session = session
        self._car = car
        self._loop = asyncio.get_running_loop()

    def jpeg(self) -> bytes:
        """What the car sees now. Raises OSError."""
        seeing = self._stages.work(self._session, partial(Stage.view, car=self._car))
        try:
            return asyncio.run_coroutine_threadsafe(seeing, self._loop).result()
        except WorldError as problem:
            raise OSError(reason_of(problem)["en"]) from None
        except StudioError as problem:
            raise OSError(str(problem)) from None

    def close(self) -> None:
        """There is nothing to give up."""


async def _beat(drive: Drive) -> None:
    while True:
        await asyncio.sleep(min(drive.beat() / 1000, _BEAT_S))


def _to_program(drive: Drive) -> bool:
    """Let the car's own program drive; False where the emergency stop forbids it."""
    nobody = drive.join("program")
    try:
        nobody.resume_program()
    except DriveError:
        return False
    finally:
        nobody.leave()
    return True


def routes(settings: ServerSettings, stages: Stages) -> list[BaseRoute]:
    """The remote's, for the world of the page whose session the address names, or of the only one."""
    garages: WeakKeyDictionary[Session, SessionGarage] = WeakKeyDictionary()

    def cars(asked: HTTPConnection) -> Garage:
        session = stages.named_or_only(asked.query_params.get("session", ""))
        if session not in garages:
            garages[session] = SessionGarage(stages, session)
        return garages[session]

    return remote_routes(settings, cars)
