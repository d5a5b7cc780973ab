"""The studio's server: its routes, the events of a run as a file, and the trials of its pages in one thread."""

import asyncio
import os
import threading
from collections.abc import Callable, Coroutine, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar
from weakref import WeakValueDictionary

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from motorcade.errors import MotorcadeError
from motorcade.server.fleet import CombinedFleet, Fleet, RemoteCars
from motorcade.server.http import EXCEPTION_HANDLERS, page_routes
from motorcade.server.page_socket import PageSocket, accepted
from motorcade.server.remote import routes as remote_routes
from motorcade.server.request_filter import RequestFilter
from motorcade.server.studio.cars import CarList
from motorcade.server.studio.sessions import CARS, PageWorlds, Settings, Visitors
from motorcade.server.studio.uploads import Uploads
from motorcade.server.studio.workers import Workers
from motorcade.service.history import table_texts
from motorcade.service.library import export_answer
from motorcade.service.trials import Luck, TrialMessage, TrialSession

_EXPORT = "projects/export"
# A longer answer is sent compressed: the first ones are part of what a page loads.
_LONG = 4096
_T = TypeVar("_T")
# The worlds that pages look at come first, where the system can do that for a thread.
_POLITENESS = 10


def make_app(settings: Settings) -> ASGIApp:
    """Return the whole server, as an ASGI application."""
    visitors = Visitors(settings)
    worlds = PageWorlds(visitors)
    cars = CarList(settings)
    app = Starlette(
        routes=[
            *routes(visitors, worlds, RemoteCars(settings.cars, settings.keys, settings.trust)),
            WebSocketRoute(CARS, cars.serve),
            *page_routes(settings.page),
        ],
        exception_handlers=EXCEPTION_HANDLERS,
    )
    return RequestFilter(app, settings)


def routes(visitors: Visitors, worlds: PageWorlds, real: RemoteCars) -> list[BaseRoute]:
    """Return the routes of the studio without its pages.

    Args:
        visitors: who may do what.
        worlds: the visitors' worlds.
        real: the real cars.
    """
    uploads = Uploads(visitors.settings, visitors.virtual_car)
    return [
        WebSocketRoute("/api/upload", uploads.serve),
        WebSocketRoute("/api/serial", uploads.serve_page_port),
        WebSocketRoute("/api/world", worlds.serve),
        WebSocketRoute("/api/trials", Trials(visitors).serve),
        _timeline_route(visitors, worlds),
        _request_route(visitors),
        *_remote_routes(visitors, worlds, real),
    ]


def _request_route(visitors: Visitors) -> Route:
    """Return the route of all `motorcade.service.requests.REQUESTS`: ``POST /api/<name>``.

    A request is read when its turn has come, and given up when its sender leaves.
    """
    workers = Workers()

    async def endpoint(request: Request) -> Response:
        visitor = visitors.visitor(request)
        name = request.path_params["name"]
        context = visitors.context(visitor)
        async with visitors.answering(visitor, name) as most_s:
            if name == _EXPORT:
                return StreamingResponse(export_answer(context.storage, context.owner), media_type="application/json")
            async with visitors.bodies.loaded(request) as data:
                job = partial(workers.answer, name, data, context, most_s)
                answer = await unless_left(request, job)
        return Response(answer, media_type="application/json")

    compressed = Middleware(GZipMiddleware, minimum_size=_LONG, compresslevel=1)
    return Route("/api/{name:path}", endpoint, methods=["POST"], middleware=[compressed])


def _remote_routes(visitors: Visitors, worlds: PageWorlds, real: RemoteCars) -> list[BaseRoute]:
    """Return the remote's routes: for the world of the session in the address, or the only world, and real cars."""

    def fleet_of(connection: HTTPConnection) -> Fleet:
        key = connection.query_params.get("session", "")
        visitor = visitors.visitor(connection)
        simulated = None
        try:
            simulated = worlds.named_or_only(key, visitor).fleet
        except MotorcadeError:
            if key or not visitors.settings.cars:
                raise
        return CombinedFleet(simulated, real, partial(visitors.may_drive, visitor))

    return remote_routes(visitors.settings, fleet_of)


def _timeline_route(visitors: Visitors, worlds: PageWorlds) -> Route:
    """Return the route of the events of a run as CSV."""

    async def download(request: Request) -> Response:
        session = worlds.session(request.path_params["session"], visitors.visitor(request))
        batches = await session.alone(session.events)
        headers = {"Content-Disposition": 'attachment; filename="timeline.csv"'}
        return StreamingResponse(table_texts(batches), media_type="text/csv; charset=utf-8", headers=headers)

    return Route("/api/world/{session}/timeline.csv", download)


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


class Trials:
    """The trials of a server's pages.

    One thread computes for all, a little at a time and for one visitor after the other: however many pages a visitor
    has, only one of them waits for the thread.
    """

    def __init__(self, visitors: Visitors) -> None:
        self._settings = visitors.settings
        self._limits = visitors.settings.sessions
        self._visitors = visitors
        self._thread = ThreadPoolExecutor(1, "trials", initializer=_be_polite)
        self._pages = 0
        # Whose page has a job in the thread, or the next one.
        self._turns: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()

    async def serve(self, socket: WebSocket) -> None:
        """Serve a page's connection until it ends."""
        async with accepted(socket, self._settings, (Luck,)) as page:
            visitor = self._visitors.visitor(socket)
            if self._pages >= self._limits.most:
                raise MotorcadeError("too-many-sessions", most=self._limits.most)
            self._pages += 1
            try:
                turn = self._turns.get(visitor) or self._turns.setdefault(visitor, asyncio.Lock())
                await self._serve(page, turn)
            finally:
                self._pages -= 1

    async def _serve(self, page: PageSocket, turn: asyncio.Lock) -> None:
        session = TrialSession(self._limits.most_cars)
        asked = asyncio.Event()
        loop = asyncio.get_running_loop()

        async def do(job: Callable[..., Iterable[object]], *message: TrialMessage) -> None:
            async with turn:
                for answer in await loop.run_in_executor(self._thread, job, *message):
                    page.put(answer)

        async def handle(message: TrialMessage) -> None:
            await do(session.receive, message)
            asked.set()

        async def work() -> None:
            while True:
                await asked.wait()
                await do(session.advance)
                if not session.is_busy:
                    asked.clear()

        await page.serve(TrialMessage, handle, [work])


def _be_polite() -> None:
    """Give this thread less of the processors than others; on Linux a thread has a priority of its own."""
    if hasattr(os, "setpriority") and os.uname().sysname == "Linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _POLITENESS)
