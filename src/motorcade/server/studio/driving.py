"""The cars of a page's world as a remote drives them, and beside them those that the studio's owner named."""

import asyncio
from functools import partial
from weakref import WeakKeyDictionary, WeakValueDictionary

from starlette.requests import HTTPConnection
from starlette.routing import BaseRoute

from motorcade.cameras.broadcast import Camera
from motorcade.errors import MotorcadeError
from motorcade.server.remote.app import routes as remote_routes
from motorcade.server.remote.control import PageControl
from motorcade.server.remote.errors import RemoteError
from motorcade.server.remote.fleet import Fleet, Listed
from motorcade.server.remote.page_session import MOST_CARS
from motorcade.server.remote.remote_cars import CombinedFleet, RemoteCars
from motorcade.server.studio.sessions import PlaybackSessions, Session
from motorcade.server.studio.settings import Settings
from motorcade.service.errors import StudioError, reason_of
from motorcade.service.playback import Playback

_MOST_LISTED = 200


class SessionFleet:
    """The garage of one page's world."""

    def __init__(self, stages: PlaybackSessions, session: Session) -> None:
        self._stages = stages
        self._session = session
        # A camera lives for as long as somebody looks through it.
        self._cameras: WeakValueDictionary[int, Camera] = WeakValueDictionary()

    async def listed(self) -> list[Listed]:
        """The leaders, then the followers, as far as a list is of use. Raises StudioError."""
        hello = await self._stages.work(self._session, Playback.hello)
        leads = set(hello["leads"])
        order = sorted(range(hello["cars"]), key=lambda car: (car not in leads, car))
        return [Listed(str(car), car in leads, True) for car in order[:_MOST_LISTED]]

    async def enter(self, car: str, page: str) -> PageControl:
        """A seat at a car. Raises StudioError, RemoteError."""
        number = await self._number(car)
        profile = await self._stages.work(self._session, lambda stage: stage.profile)
        return self._session.hands.sit(number, profile, page, self._is_paused)

    async def camera(self, car: str) -> Camera:
        """What the car sees. Raises StudioError, RemoteError."""
        number = await self._number(car)
        camera = self._cameras.get(number)
        if camera is None:
            if len(self._cameras) >= MOST_CARS:
                raise RemoteError("too-many-cars", 409, most=MOST_CARS)
            camera = self._cameras[number] = Camera(_Eye(self._stages, self._session, number))
        return camera

    async def start(self) -> None:
        """Play. Raises StudioError."""
        await self._stages.work(self._session, lambda stage: stage.play(stage.speed))
        self._session.stirred.set()

    def _is_paused(self) -> bool:
        """Whether the page is gone, or doesn't play."""
        stage = self._session.stage
        return self._session.page is None or stage is None or not stage.playing

    async def _number(self, car: str) -> int:
        cars = (await self._stages.work(self._session, Playback.hello))["cars"]
        if not car.isdecimal() or not car.isascii() or int(car) >= cars:
            raise RemoteError("no-such-car", 404, car=car)
        return int(car)


class _Eye:
    """A simulated camera, which asks the loop for each picture, since only there a stage has its turn."""

    def __init__(self, stages: PlaybackSessions, session: Session, car: int) -> None:
        self._stages = stages
        self._session = session
        self._car = car
        self._loop = asyncio.get_running_loop()

    def jpeg(self) -> bytes:
        """What the car sees now. Raises OSError."""
        seeing = self._stages.work(self._session, partial(Playback.view, car=self._car))
        try:
            return asyncio.run_coroutine_threadsafe(seeing, self._loop).result()
        except MotorcadeError as problem:
            raise OSError(reason_of(problem)["en"]) from None
        except StudioError as problem:
            raise OSError(str(problem)) from None

    def close(self) -> None:
        """There is nothing to give up."""


def routes(settings: Settings, stages: PlaybackSessions) -> list[BaseRoute]:
    """The remote's, for the world of the page whose session the address names, or of the only one; and the far cars."""
    garages: WeakKeyDictionary[Session, SessionFleet] = WeakKeyDictionary()
    far = RemoteCars(settings.cars, settings.keys, settings.trust) if settings.cars else None

    def cars(asked: HTTPConnection) -> Fleet:
        key = asked.query_params.get("session", "")
        try:
            session = stages.named_or_only(key)
        except StudioError:
            if far is None or key:
                raise
            return far
        near = garages.setdefault(session, SessionFleet(stages, session))
        return CombinedFleet(near, far) if far else near

    return remote_routes(settings, cars)
