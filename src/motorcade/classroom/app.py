"""The server of a class: all routes, who may ask for which, and what pages are sent while they are connected."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from functools import partial
from inspect import isawaitable
from typing import Any

import msgspec
from anyio import to_thread
from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from motorcade.classroom.folder import ClassFolder, ReportOrder, class_report, work_file
from motorcade.classroom.handlers import Asks, Handlers
from motorcade.classroom.messages import ClassView, Goodbye, MatView, PairView, PupilRow, PupilView, exchanges_of
from motorcade.classroom.pairs import Pairs
from motorcade.classroom.record import TEACHER, Presence, Pupil
from motorcade.classroom.room import Classroom
from motorcade.classroom.running import ClassServerSettings, EmergencyStop, RunningClass
from motorcade.classroom.shared_mat import SharedMat
from motorcade.classroom.wall import Walls
from motorcade.errors import MotorcadeError
from motorcade.locales import FIRST, languages
from motorcade.missions.document import built_in_mission
from motorcade.server.fleet import RemoteCars
from motorcade.server.http import EXCEPTION_HANDLERS, json_response, page_file, page_routes
from motorcade.server.page_socket import PageSocket, accepted
from motorcade.server.request_filter import RequestFilter
from motorcade.server.studio.app import routes as studio_routes
from motorcade.server.studio.cars import CarList
from motorcade.server.studio.sessions import TEACHERS_CARS, PageWorlds
from motorcade.service.messages import Nothing, Sentence, decode, sentences
from motorcade.service.missions import mission_in
from motorcade.sockets import network_of

_API = "/api/"
_TEACHER = "/api/teacher/"
# What the browser builds of a class has at these paths; the files hold no secret.
PAGES = ("/join", "/teacher", "/wall", "/mat", "/privacy")
AUTHORITY = "/authority.crt"
# By name, with the class whose method answers.
REQUESTS = {
    exchange.name: (kind, exchange)
    for kind in (Classroom, SharedMat, Pairs, Handlers)
    for exchange in exchanges_of(kind)
}
# A page is sent the class at most so often; the teacher's at least every few seconds, since it shows ages.
_PUPIL_EVERY_S = 0.1
_TEACHER_EVERY_S = 0.25
_TEACHER_LATEST_S = 5.0


def make_class_app(settings: ClassServerSettings, folder: ClassFolder) -> ASGIApp:
    """Return the whole server of a class, as an ASGI application; the folder is locked for this process."""
    cars = RemoteCars(settings.cars, settings.keys, settings.trust)
    running = RunningClass(settings, folder)
    worlds = PageWorlds(running)
    room_cars = CarList(settings, running.is_teacher)
    handlers = Handlers(running, worlds, EmergencyStop(cars), room_cars)
    walls = Walls(running, worlds)
    mat = running.mat

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        with suppress(MotorcadeError):
            await running.delete_strays()
        # On a full disk the class begins all the same: the teacher's page says why nothing is stored.
        with suppress(MotorcadeError):
            await running.settle()
        await running.count_stars([pupil.id for pupil in running.room.record.pupils])
        async with settings.network.announced():
            time = asyncio.create_task(running.pass_time())
            yield
            time.cancel()

    app = Starlette(
        routes=[
            WebSocketRoute("/api/class/stream", partial(_serve_pupil, running)),
            WebSocketRoute(f"{_TEACHER}stream", partial(_serve_teacher, running)),
            WebSocketRoute(f"{_TEACHER}wall", walls.serve),
            WebSocketRoute(f"{_TEACHER}watch", walls.watch),
            WebSocketRoute(f"{_TEACHER}mat", lambda socket: worlds.serve_shared(socket, mat.session, mat.wall())),
            WebSocketRoute(TEACHERS_CARS, room_cars.serve),
            Route(f"{_TEACHER}work.zip", partial(_work, running)),
            Route(f"{_TEACHER}report.html", partial(_report, running), methods=["POST"]),
            *(
                Route(f"{_API}{path}/{{name:path}}", partial(_answer, running, handlers), methods=["POST"])
                for path in ("class", "teacher")
            ),
            *studio_routes(running, worlds, cars),
            *_pages(running),
            *page_routes(settings.page),
        ],
        exception_handlers=EXCEPTION_HANDLERS,
        lifespan=lifespan,
    )
    return RequestFilter(app, settings, partial(admit, running), partial(_holder, running))


def _holder(running: RunningClass, connection: HTTPConnection) -> tuple[str, bool]:
    """Who holds a connection; the teacher's keep their places, so that everything can be stopped at any time."""
    if running.is_teacher(connection):
        return TEACHER, True
    pupil = running.pupil(connection)
    return (pupil.id if pupil else ""), False


def admit(running: RunningClass, connection: HTTPConnection, holder: str) -> None:
    """Let a request of a holder to what pages only ask for pass, or raise MotorcadeError.

    All that the teacher asks for is refused to who isn't signed in as the teacher, and everything else to who has no
    session, except the requests that are open to everybody.
    """
    path = connection.scope["path"]
    _, exchange = REQUESTS.get(path.removeprefix(_API), (None, None))
    if exchange and exchange.is_open:
        if not holder:
            running.rates.count(_address(connection), running.settings.clock())
    elif path.startswith(_TEACHER):
        if holder != TEACHER:
            raise MotorcadeError("teacher-session-needed")
    elif not holder:
        raise MotorcadeError("class-session-needed")


def _address(connection: HTTPConnection) -> str:
    return network_of(connection.client.host if connection.client else "")


def _asker(running: RunningClass, request: Request) -> str:
    """Return who asks, a pupil's id or the teacher. Raises MotorcadeError where they may not ask for that now."""
    if request.scope["path"].startswith(_TEACHER) and not running.is_teacher(request):
        raise MotorcadeError("teacher-session-needed")
    return running.visitor(request)


async def _answer(running: RunningClass, handlers: Handlers, request: Request) -> Response:
    """Answer a request of `REQUESTS`: what it changes is stored before the answer is sent."""
    name = request.scope["path"].removeprefix(_API)
    if name not in REQUESTS:
        raise MotorcadeError("not-found")
    kind, exchange = REQUESTS[name]
    owner = next(part for part in (running.room, running.mat, running.pairs, handlers) if isinstance(part, kind))
    if not exchange.is_open:
        running.check_request(running.visitor(request))
    async with running.bodies.loaded(request) as data:
        arguments = exchange.request.arguments(data)
    # The body may have come late, and had to wait for its turn: the right is asked now, and the deed is the next line.
    who = ""
    if not exchange.is_open:
        who = _asker(running, request)
    now_s = running.settings.clock()
    response = json_response(None)
    since = running.room.revision
    asks = Asks(request, response)
    given = {"self": owner, "asks": asks, "client": _address(request), "who": who, "now_s": now_s}
    try:
        answer = exchange.request.function(**{name: given[name] for name in exchange.request.given}, **arguments)
        if isawaitable(answer):
            answer = await answer
    except MotorcadeError:
        # Also what a refused request has changed.
        running.show_changes()
        raise
    try:
        await running.settle(since)
    except MotorcadeError:
        if exchange.stores:
            raise
    if answer is None:
        answer = Nothing()
    response.body = msgspec.json.encode(answer)
    response.headers["content-length"] = str(len(response.body))
    return response


def _language(request: Request) -> str:
    """The language of the page that asks, by the query."""
    asked = request.query_params.get("language", FIRST)
    if asked in languages():
        return asked
    return FIRST


async def _report(running: RunningClass, request: Request) -> Response:
    """Answer with the report that a ReportOrder asks for; the query's ``language`` is that of its page."""
    language = _language(request)
    async with running.bodies.loaded(request) as data:
        order = decode(data, ReportOrder)
    if order.mission is None:
        mission = mission_in(order.text)
    else:
        mission = built_in_mission(order.mission)
    async with running.reporting:
        _asker(running, request)
        pupils = list(running.room.record.pupils)
        page = await to_thread.run_sync(class_report, running.folder, order.files or pupils, mission, language)
    return HTMLResponse(page)


async def _work(running: RunningClass, request: Request) -> Response:
    """Answer with the work of all pupils as a ZIP file; the query's ``language`` is that of its page."""
    language = _language(request)
    pupils = list(running.room.record.pupils)
    title = running.room.record.title
    file = await to_thread.run_sync(work_file, running.folder, pupils, title, language)

    def parts() -> Iterator[bytes]:
        with file:
            while part := file.read(1 << 16):
                yield part

    headers = {"content-disposition": 'attachment; filename="class.zip"'}
    return StreamingResponse(parts(), media_type="application/zip", headers=headers)


def _pages(running: RunningClass) -> list[BaseRoute]:
    """The pages of a class; the studio's only for who has a session."""
    page = running.settings.page

    async def start(request: Request) -> Response:
        if _holder(running, request)[0]:
            return page_file(page / "index.html")
        return RedirectResponse("/join", 303)

    async def of_the_class(request: Request) -> Response:
        return page_file(page / "class.html")

    async def authority(request: Request) -> Response:
        file = running.settings.authority
        if file is None or not file.is_file():
            raise MotorcadeError("not-found")
        return FileResponse(file, media_type="application/x-x509-ca-cert", filename="motorcade-class.crt")

    return [Route("/", start), *(Route(path, of_the_class) for path in PAGES), Route(AUTHORITY, authority)]


async def _serve_pupil(running: RunningClass, socket: WebSocket) -> None:
    """Serve a pupil's page until it leaves, or the pupil is no longer in the class."""
    async with accepted(socket, running.settings, (PupilView,)) as page:
        pupil = running.pupil(socket)
        if pupil is None:
            raise MotorcadeError("class-session-needed")
        running.room.connect(pupil.id, running.settings.clock())
        running.show_changes()
        try:
            await page.serve(Nothing, _ignore, [partial(_show_pupil, running, socket, page, pupil.id)])
        finally:
            running.room.disconnect(pupil.id, running.settings.clock())
            running.show_changes()


async def _show_pupil(running: RunningClass, socket: WebSocket, page: PageSocket, pupil_id: str) -> None:
    room = running.room
    shown = b""
    ended = room.ended
    with running.watching() as changed:
        while pupil := running.pupil(socket):
            view = pupil_view(room, pupil, running.mat.view(), running.pairs.view(pupil_id, running.settings.clock()))
            if (data := msgspec.json.encode(view)) != shown:
                shown = data
                page.put(view)
            await asyncio.sleep(_PUPIL_EVERY_S)
            await changed.wait()
            changed.clear()
    if pupil_id in room.presence:
        goodbye = Goodbye("left")
    elif room.ended != ended:
        goodbye = Goodbye("ended")
    else:
        goodbye = Goodbye("removed")
    await page.say_last(goodbye)


async def _serve_teacher(running: RunningClass, socket: WebSocket) -> None:
    """Serve a teacher's page until it leaves, or the teacher is signed out."""
    async with accepted(socket, running.settings, (ClassView,)) as page:
        await page.serve(Nothing, _ignore, [partial(_show_teacher, running, socket, page)])


async def _show_teacher(running: RunningClass, socket: WebSocket, page: PageSocket) -> None:
    with running.watching() as changed:
        while running.is_teacher(socket):
            problem = running.folder.problem
            disk = None
            if problem:
                disk = sentences(problem)
            page.put(class_view(running.room, running.mat.view(), running.settings.clock(), disk))
            await asyncio.sleep(_TEACHER_EVERY_S)
            with suppress(TimeoutError):
                await asyncio.wait_for(changed.wait(), _TEACHER_LATEST_S)
            changed.clear()
    await page.say_last(Goodbye("left"))


async def _ignore(message: Nothing) -> None:
    """Do nothing: such a page has nothing to say."""


def pupil_view(room: Classroom, pupil: Pupil, mat: MatView, pair: PairView | None = None) -> PupilView:
    """Return what a pupil's page shows of the class; no other pupil's number or progress."""
    hand = room.presence[pupil.id].hand_s is not None
    own: dict[str, Any] = {
        "me": room.self_of(pupil),
        "hand": hand,
        "mission": pupil.mission,
        "news": pupil.news,
        "pair": pair,
    }
    return PupilView(room.frozen, room.shared(), room.stopped, room.cabled, mat, **own)


def class_view(room: Classroom, mat: MatView, now_s: float, disk: Sentence | None = None) -> ClassView:
    """Return what the teacher's page shows; ``disk`` is why work can't be stored at present."""
    pupils = [_row(pupil, room.presence[pupil.id], now_s) for pupil in room.record.pupils]
    settings = {name: getattr(room.record, name) for name in ("title", "code", "is_open", "stuck_minutes")}
    return ClassView(room.frozen, room.shared(), room.stopped, room.cabled, mat, pupils=pupils, disk=disk, **settings)


def _row(pupil: Pupil, presence: Presence, now_s: float) -> PupilRow:
    away_s = 0
    hand_s = None
    stuck_s = None
    if not presence.pages:
        away_s = int(now_s - presence.left_s)
    if presence.hand_s is not None:
        hand_s = int(now_s - presence.hand_s)
    if presence.stuck:
        stuck_s = int(now_s - presence.step_s)
    return PupilRow(
        *(pupil.id, pupil.name, pupil.avatar, pupil.number),
        online=presence.pages > 0,
        away_s=away_s,
        hand_s=hand_s,
        stuck_s=stuck_s,
        mission=presence.mission,
        goals_met=presence.met,
        goals=presence.goals,
        stars=presence.stars,
    )
