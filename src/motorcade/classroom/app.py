"""The server of a class: all routes, and who may ask for which."""

import asyncio
import tempfile
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from functools import partial
from pathlib import Path

import msgspec
from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.requests import HTTPConnection, Request
from starlette.responses import FileResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp

from motorcade.classroom.desk_messages import DESK_REQUESTS
from motorcade.classroom.desk_requests import DeskRequests
from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.messages import PUPIL_REQUESTS, Exchange
from motorcade.classroom.pupil_requests import PupilRequests, method_for
from motorcade.classroom.running_class import TEACHER, ClassServerSettings, RunningClass
from motorcade.classroom.shared_mat import SharedMat
from motorcade.classroom.streams import Streams
from motorcade.classroom.visitors import ClassVisitors, TurnFleet
from motorcade.classroom.wall import Walls
from motorcade.classroom.work import write_work
from motorcade.errors import MotorcadeError
from motorcade.locales import FIRST, languages
from motorcade.server.http import exception_handlers, json_response, page_not_built, page_routes
from motorcade.server.remote.remote_cars import RemoteCars
from motorcade.server.request_filter import RequestFilter
from motorcade.server.studio.app import routes as studio_routes
from motorcade.server.studio.sessions import PageWorlds
from motorcade.service.messages import Nothing, decode

_PUPILS, _DESK = "/api/class/", "/api/desk/"
# What the browser builds of a class has at these paths; the files hold no secret.
PAGES = ("/join", "/desk", "/wall", "/mat", "/privacy")
AUTHORITY = "/authority.crt"


def make_class_app(settings: ClassServerSettings, folder: ClassFolder) -> ASGIApp:
    """Return the whole server of a class, as an ASGI application; the folder is locked for this process."""
    cars = RemoteCars(settings.cars, settings.keys, settings.trust) if settings.cars else None
    running = RunningClass(settings, folder, tuple(car.name for car in settings.cars))
    visitors = ClassVisitors(running)
    worlds = PageWorlds(settings, settings.sessions, visitors)
    mat = SharedMat()
    pupils, desk = PupilRequests(running, mat), DeskRequests(running, worlds, mat, cars)
    drivers = (lambda visitor: TurnFleet(cars, running, visitor)) if cars else None
    streams, walls = Streams(running, mat), Walls(running, worlds, mat)

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        with suppress(MotorcadeError):
            await running.delete_shelves()
        # On a full disk the class begins all the same: the desk says why nothing is stored.
        with suppress(MotorcadeError):
            await running.settle()
        await visitors.count_stars([pupil.id for pupil in running.room.record.pupils])
        async with settings.network.announced():
            time = asyncio.create_task(running.pass_time())
            yield
            time.cancel()

    app = Starlette(
        routes=[
            WebSocketRoute(f"{_PUPILS}stream", streams.serve_pupil),
            WebSocketRoute(f"{_DESK}stream", streams.serve_desk),
            WebSocketRoute(f"{_DESK}wall", walls.serve),
            WebSocketRoute(f"{_DESK}watch", walls.watch),
            WebSocketRoute(f"{_DESK}mat", walls.serve_mat),
            Route(f"{_DESK}work.zip", partial(_work, running)),
            _table_route(_PUPILS, partial(_answer, running, visitors, PUPIL_REQUESTS, pupils)),
            _table_route(_DESK, partial(_answer, running, visitors, DESK_REQUESTS, desk)),
            *studio_routes(settings, visitors, worlds, drivers),
            *_pages(running),
            *page_routes(settings.page),
        ],
        exception_handlers=exception_handlers(),
        lifespan=lifespan,
    )
    return RequestFilter(app, settings, partial(admit, running), partial(_holder, running))


def _holder(running: RunningClass, connection: HTTPConnection) -> tuple[str, bool]:
    """Who holds a connection; the teacher's keep their places, so that everything can be stopped at any time."""
    if running.is_teacher(connection):
        return TEACHER, True
    pupil = running.pupil(connection)
    return (pupil.id if pupil else ""), False


def admit(running: RunningClass, connection: HTTPConnection) -> None:
    """Let a request to what pages only ask for pass, or raise MotorcadeError.

    All that the desk asks for is refused to who isn't signed in as the teacher, and everything else to who has no
    session, except the requests that are open to everybody.
    """
    path = connection.scope["path"]
    for prefix, requests in ((_PUPILS, PUPIL_REQUESTS), (_DESK, DESK_REQUESTS)):
        exchange = requests.get(path.removeprefix(prefix)) if path.startswith(prefix) else None
        if exchange and exchange.is_open:
            if running.pupil(connection) is None and not running.is_teacher(connection):
                running.check_stranger(connection)
            return
    if path.startswith(_DESK):
        if not running.is_teacher(connection):
            raise MotorcadeError("teacher-session-needed")
        return
    running.visitor(connection)


def _table_route(prefix: str, endpoint: Callable[[Request], Awaitable[Response]]) -> Route:
    return Route(f"{prefix}{{name:path}}", endpoint, methods=["POST"])


async def _answer(
    running: RunningClass,
    visitors: ClassVisitors,
    requests: Mapping[str, Exchange],
    methods: object,
    request: Request,
) -> Response:
    """Answer a request of a table: what it changes is stored before the answer is sent."""
    name = request.path_params["name"]
    if name not in requests:
        raise MotorcadeError("not-found")
    exchange = requests[name]
    if not exchange.is_open:
        visitors.check_request(running.visitor(request), running.now_s())
    async with visitors.bodies.loaded(request) as data:
        message = Nothing() if exchange.message is Nothing and not data else decode(data, exchange.message)
    response, since = json_response(None), running.room.revision
    try:
        answer = await method_for(methods, name)(request, message, response)
    except MotorcadeError:
        # Also what a refused request has changed, such as the count of wrong numbers.
        running.show_changes()
        raise
    try:
        await running.settle(since)
    except MotorcadeError:
        if exchange.stores:
            raise
    response.body = msgspec.json.encode(answer)
    response.headers["content-length"] = str(len(response.body))
    return response


async def _work(running: RunningClass, request: Request) -> Response:
    """Answer with the work of all pupils as a ZIP file; the query's ``language`` is that of its page."""
    asked = request.query_params.get("language", FIRST)
    language = asked if asked in languages() else FIRST
    pupils, title = list(running.room.record.pupils), running.room.record.title

    def write() -> Path:
        with tempfile.NamedTemporaryFile(prefix="motorcade-", suffix=".zip", delete=False) as file:
            write_work(file, running.folder, pupils, title, language)  # type: ignore[arg-type]
        return Path(file.name)

    path = await running.with_files(write)
    after = BackgroundTask(path.unlink, missing_ok=True)
    return FileResponse(path, media_type="application/zip", filename="class.zip", background=after)


def _pages(running: RunningClass) -> list[BaseRoute]:
    """The pages of a class; the studio's only for who has a session."""
    page = running.settings.page

    async def start(request: Request) -> Response:
        if running.pupil(request) is None and not running.is_teacher(request):
            return RedirectResponse("/join", 303)
        return _file(page / "index.html")

    async def of_the_class(request: Request) -> Response:
        return _file(page / "class.html")

    async def authority(request: Request) -> Response:
        file = running.settings.authority
        if file is None or not file.is_file():
            raise MotorcadeError("not-found")
        return FileResponse(file, media_type="application/x-x509-ca-cert", filename="motorcade-class.crt")

    return [Route("/", start), *(Route(path, of_the_class) for path in PAGES), Route(AUTHORITY, authority)]


def _file(path: Path) -> Response:
    return FileResponse(path) if path.is_file() else page_not_built()
