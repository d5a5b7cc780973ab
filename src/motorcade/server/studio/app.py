"""The studio's server: its routes, and the events of a run as a file."""

import asyncio
import ssl
from collections.abc import Callable, Coroutine, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeVar
from weakref import WeakKeyDictionary

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp

from motorcade.errors import MotorcadeError
from motorcade.fleet.places import Place
from motorcade.server.http import PAGE, exception_handlers, page_routes
from motorcade.server.remote.app import routes as remote_routes
from motorcade.server.remote.fleet import CombinedFleet, Fleet
from motorcade.server.remote.remote_cars import RemoteCar, RemoteCars
from motorcade.server.request_filter import RequestFilter, ServerSettings
from motorcade.server.studio import trials, uploads
from motorcade.server.studio.cars import CarList
from motorcade.server.studio.driving import PageWorld, SessionFleet
from motorcade.server.studio.sessions import SESSIONS, PageWorlds, SessionLimits, Visitors
from motorcade.server.studio.workers import Workers
from motorcade.service.exchange import export_answer
from motorcade.service.history import table_text
from motorcade.service.messages import Capabilities

_EXPORT = "projects/export"
# The list of cars: in a class for the teacher alone.
CARS, TEACHERS_CARS = "/api/cars", "/api/teacher/cars"
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(ServerSettings):
    """The settings of a studio.

    Attributes:
        library: the folder that projects are stored in.
        page: the folder of the built page.
        sessions: the most worlds at once, and the most cars in one of them.
        cars, keys, trust: real cars, as `motorcade.server.remote.remote_cars.RemoteCars` takes them.
        places: of cars that the list of cars shows besides those that are found.
    """

    library: Path
    page: Path = PAGE
    sessions: SessionLimits = SESSIONS
    cars: tuple[RemoteCar, ...] = ()
    keys: ssl.SSLContext | None = None
    trust: ssl.SSLContext | None = None
    places: tuple[Place, ...] = ()


def make_app(settings: Settings) -> ASGIApp:
    """Return the whole server, as an ASGI application."""
    visitors = Visitors(settings.library, capabilities(settings))
    worlds = PageWorlds(settings, settings.sessions, visitors)
    cars = CarList(settings, settings.places, settings.keys)
    app = Starlette(
        routes=[
            *routes(settings, visitors, worlds),
            WebSocketRoute(CARS, cars.serve),
            *page_routes(settings.page),
        ],
        exception_handlers=exception_handlers(),
    )
    return RequestFilter(app, settings)


def routes(
    settings: Settings, visitors: Visitors, worlds: PageWorlds, real: Callable[[str], Fleet] | None = None
) -> list[BaseRoute]:
    """Return the routes of the studio without its pages.

    Args:
        settings: of the server.
        visitors: who may do what.
        worlds: the visitors' worlds.
        real: the real cars that a visitor may drive; None for those of the settings.
    """
    if real is None and settings.cars:
        cars = RemoteCars(settings.cars, settings.keys, settings.trust)

        def everybodys(visitor: str) -> Fleet:
            return cars

        real = everybodys
    return [
        *uploads.routes(settings, visitors.virtual_car),
        WebSocketRoute("/api/world", worlds.serve),
        trials.route(settings, settings.sessions, visitors),
        _timeline_route(visitors, worlds),
        _request_route(settings, visitors),
        *_remote_routes(settings, visitors, worlds, real),
    ]


def capabilities(settings: Settings, classroom: Literal["", "pupil", "teacher"] = "") -> Capabilities:
    """What the server can do."""
    return Capabilities(
        serial_ports=True,
        downloads=True,
        driving=True,
        real_cars=bool(settings.cars),
        most_cars=settings.sessions.most_cars,
        classroom=classroom,
        cars={"": CARS, "teacher": TEACHERS_CARS, "pupil": ""}[classroom],
    )


def _request_route(settings: Settings, visitors: Visitors) -> Route:
    """Return the route of all `motorcade.service.requests.REQUESTS`: ``POST /api/<name>``.

    A request is read when its turn has come, and given up when its sender leaves.
    """
    workers = Workers()

    async def endpoint(request: Request) -> Response:
        visitor = visitors.visitor(request)
        visitors.check_request(visitor, settings.clock())
        name, context = request.path_params["name"], visitors.context(visitor)
        async with visitors.in_turn(visitor, name):
            if name == _EXPORT:
                return StreamingResponse(export_answer(context.storage, context.owner), media_type="application/json")
            async with visitors.bodies.loaded(request) as data:
                job = partial(workers.answer, name, data, context, visitors.most_s(name))
                answer = await unless_left(request, job)
        visitors.note_answered(visitor, name)
        return Response(answer, media_type="application/json")

    return Route("/api/{name:path}", endpoint, methods=["POST"])


def _remote_routes(
    settings: Settings, visitors: Visitors, worlds: PageWorlds, real: Callable[[str], Fleet] | None
) -> list[BaseRoute]:
    """Return the remote's routes: for the world of the session in the address, or the only world, and real cars."""
    fleets: WeakKeyDictionary[PageWorld, SessionFleet] = WeakKeyDictionary()

    def fleet_of(connection: HTTPConnection) -> Fleet:
        key = connection.query_params.get("session", "")
        visitor = visitors.visitor(connection)
        try:
            session = worlds.named_or_only(key, visitor)
        except MotorcadeError:
            if real is None or key:
                raise
            return real(visitor)
        simulated = fleets.setdefault(session, SessionFleet(session))
        return CombinedFleet(simulated, real(visitor)) if real else simulated

    return remote_routes(settings, fleet_of)


def _timeline_route(visitors: Visitors, worlds: PageWorlds) -> Route:
    """Return the route of the events of a run as CSV."""

    async def download(request: Request) -> Response:
        session = worlds.session(request.path_params["session"], visitors.visitor(request))
        batches = await session.alone(lambda: session.events())
        headers = {"Content-Disposition": 'attachment; filename="timeline.csv"'}
        return StreamingResponse(timeline(batches), media_type="text/csv; charset=utf-8", headers=headers)

    return Route("/api/world/{session}/timeline.csv", download)


def timeline(batches: Iterable[bytes]) -> Iterator[str]:
    """Yield rows of events as CSV: the header, then a text for each batch."""
    yield table_text(b"", has_head=True)
    yield from map(table_text, batches)


async def unless_left(request: Request, job: Callable[[], Coroutine[Any, Any, _T]]) -> _T | None:
    """Do a job; where the client leaves before, cancel it and return None."""

    async def leave() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass

    tasks: list[asyncio.Task[Any]] = [asyncio.create_task(job()), asyncio.create_task(leave())]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        return tasks[0].result() if tasks[0].done() else None
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
