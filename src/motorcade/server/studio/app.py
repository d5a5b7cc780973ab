"""The studio's server: its routes, and the downloads of a run."""

import asyncio
import os
import ssl
import tempfile
import threading
import time
from collections.abc import Callable, Coroutine, Iterable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from anyio import BrokenWorkerProcess, to_process
from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp

from motorcade.engine.moment import NO_INDEX, RUNS, SENDS, to_moment, unpack_moment
from motorcade.errors import MotorcadeError
from motorcade.runs.recording import Description, InMemoryRecording
from motorcade.server.http import PAGE, exception_handlers, page_routes
from motorcade.server.remote.app import routes as remote_routes
from motorcade.server.remote.fleet import CombinedFleet, Fleet
from motorcade.server.remote.remote_cars import RemoteCar, RemoteCars
from motorcade.server.request_filter import RequestFilter, ServerSettings
from motorcade.server.studio import uploads
from motorcade.server.studio.driving import PageWorld, SessionFleet
from motorcade.server.studio.sessions import SESSIONS, PageWorlds, SessionLimits, Visitors
from motorcade.server.studio.workers import Workers
from motorcade.service.exchange import export_answer
from motorcade.service.history import EVERY_MS, table_text
from motorcade.service.messages import Capabilities
from motorcade.service.world_session import WorldSession
from motorcade.words.image import bytes_to_words

_EXPORT = "projects/export"
_FILM = "run.gif"
# Films that wait while one is drawn.
_MOST_WAITING = 3
_PARENT_CHECK_S = 0.5
_T = TypeVar("_T")
_SECONDS, _MOST_SECONDS = 10.0, 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(ServerSettings):
    """The settings of a studio.

    Attributes:
        library: the folder that projects are stored in.
        page: the folder of the built page.
        sessions: the most worlds at once, and the most cars in one of them.
        cars, keys, trust: real cars, as `motorcade.server.remote.remote_cars.RemoteCars` takes them.
    """

    library: Path
    page: Path = PAGE
    sessions: SessionLimits = SESSIONS
    cars: tuple[RemoteCar, ...] = ()
    keys: ssl.SSLContext | None = None
    trust: ssl.SSLContext | None = None


def make_app(settings: Settings) -> ASGIApp:
    """Return the whole server, as an ASGI application."""
    visitors = Visitors(settings.library, capabilities(settings))
    worlds = PageWorlds(settings, settings.sessions, visitors)
    app = Starlette(
        routes=[*routes(settings, visitors, worlds), *page_routes(settings.page)],
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
        _download_route(visitors, worlds),
        _request_route(settings, visitors),
        *_remote_routes(settings, visitors, worlds, real),
    ]


def capabilities(settings: Settings, classroom: Literal["", "pupil", "teacher"] = "") -> Capabilities:
    """What the server can do."""
    return Capabilities(
        serial_ports=True,
        downloads=True,
        # With the extra "sim".
        films=find_spec("matplotlib") is not None,
        driving=True,
        real_cars=bool(settings.cars),
        most_cars=settings.sessions.most_cars,
        classroom=classroom,
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


def _download_route(visitors: Visitors, worlds: PageWorlds) -> Route:
    """Return the route of downloads: events of a run as CSV, and films of its last seconds.

    One film is drawn at a time, three more wait, and none is drawn for a client that has left.
    """
    drawing = asyncio.Semaphore(1)
    waiting = 0

    async def film(request: Request, session: PageWorld, file: str) -> bytes | None:
        nonlocal waiting
        seconds = _seconds(request.query_params.get("seconds", ""))
        if waiting > _MOST_WAITING:
            raise MotorcadeError("too-many-films")
        waiting += 1
        try:
            return await unless_left(request, partial(drawn, session, file, seconds))
        finally:
            waiting -= 1

    async def drawn(session: PageWorld, file: str, seconds: float) -> bytes:
        async with drawing:
            # A recording takes much memory, so it is made when its turn has come.
            return await _film(await session.alone(partial(recording_of, session, seconds)), file)

    async def download(request: Request) -> Response:
        session = worlds.session(request.path_params["session"], visitors.visitor(request))
        file = request.path_params["file"]
        headers = {"Content-Disposition": f'attachment; filename="{file}"'}
        if file == "timeline.csv":
            batches = await session.alone(lambda: session.events())
            return StreamingResponse(timeline(batches), media_type="text/csv; charset=utf-8", headers=headers)
        if file != _FILM:
            raise MotorcadeError("no-world")
        content = await film(request, session, file)
        return Response(content, media_type="image/gif", headers=headers)

    return Route("/api/world/{session}/{file}", download)


def timeline(batches: Iterable[bytes]) -> Iterator[str]:
    """Yield rows of events as CSV: the header, then a text for each batch."""
    yield table_text(b"", has_head=True)
    yield from map(table_text, batches)


def recording_of(session: WorldSession, seconds: float) -> InMemoryRecording:
    """Return a recording of the last simulated seconds of a session's run."""
    world = session.world.simulation
    words = np.array(bytes_to_words(world.images[0]), np.uint32)
    run = InMemoryRecording(Description.of(world, EVERY_MS))
    for t_ms, data in session.moments(seconds):
        columns = unpack_moment(data, world.cars)
        index, flags = np.asarray(columns["index"]), np.asarray(columns["flags"])
        word = np.where(index == NO_INDEX, 0, words[np.where(index == NO_INDEX, 0, index)])
        shown = to_moment(t_ms, data, world.cars)._replace(word=word, runs=flags & RUNS > 0, sends=flags & SENDS > 0)
        # An empty dict, not the default: a mappingproxy can't be sent to the process that draws.
        run.write(shown.map(lambda name, column: np.array(column))._replace(counts={}))
    return run


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


async def _film(run: InMemoryRecording, file: str) -> bytes:
    if run.last_ms == 0:
        raise MotorcadeError("nothing-to-draw")
    try:
        # Drawing holds Python's lock for long, so it would stop all worlds in this process.
        return await to_process.run_sync(draw, run, file, cancellable=True)
    except (MotorcadeError, BrokenWorkerProcess) as problem:
        raise MotorcadeError("film-failed", reason=problem) from None


def draw(run: InMemoryRecording, file: str) -> bytes:
    """Draw a film, in a process that ends with the studio; return its bytes. Raises MotorcadeError."""
    _follow_parent()
    # Matplotlib takes longer to load than the rest of the server.
    from motorcade.runs.plots import draw_film

    with tempfile.TemporaryDirectory(prefix="motorcade-", ignore_cleanup_errors=True) as folder:
        draw_film(run, Path(folder) / file)
        return (Path(folder) / file).read_bytes()


@cache
def _follow_parent() -> None:
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()


def _end_with(parent_pid: int) -> None:
    """End this process when its parent has ended; on Windows it ends by itself, after its film."""
    while os.getppid() == parent_pid:
        time.sleep(_PARENT_CHECK_S)
    os._exit(1)


def _seconds(text: str) -> float:
    try:
        seconds = float(text or _SECONDS)
    except ValueError:
        seconds = 0.0
    if not 0 < seconds <= _MOST_SECONDS:
        reason = f"seconds is {text[:20]!r}; allowed: above 0, up to {_MOST_SECONDS:g}"
        raise MotorcadeError("bad-message", reason=reason)
    return seconds
