"""All pages' worlds: each lives while its page does, and a minute longer for a page that is loaded again."""

import asyncio
import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

from anyio import CapacityLimiter, to_thread
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.engine.native import telling
from motorcade.errors import MotorcadeError
from motorcade.server.errors import ServerError
from motorcade.server.sockets import heard, until_one_ends
from motorcade.server.studio.manual_control import ManualControl
from motorcade.server.studio.outbox import Outbox
from motorcade.server.studio.settings import Settings
from motorcade.service.errors import StudioError, reason_of
from motorcade.service.exports import Exports
from motorcade.service.messages import (
    Furnish,
    Message,
    Move,
    Pause,
    Play,
    Reset,
    Resume,
    Say,
    Seek,
    Set,
    Shown,
    Step,
    Watch,
    furniture_of,
    world_of,
)
from motorcade.service.playback import PICTURE_S, Playback
from motorcade.timing import RateLimit, to_ticks

GRACE_S = 60.0
_STATE_S, _CAR_S = 0.25, 0.1
# Threads that hand work to each other wait for Python's lock longer than this.
_QUICK_S = 0.002
_KEY = re.compile(r"[0-9a-f]{32}")
T = TypeVar("T")


@dataclass(eq=False)
class Session:
    """A page's place here, whichever connection the page has.

    Attributes:
        key: what the page calls it.
        stage: its world, once the page has set one.
        page: what waits for the page that looks; None while none does.
        left: what forgets the session when no page comes back.
        lock: held by whoever works with the stage, which knows nothing of threads.
        stirred: set whenever there may be something to do.
        hands: those of its cars that somebody drives, or has driven.
        quick: whether the last picture took so little time that a thread of its own would take more.
    """

    key: str
    stage: Playback | None = None
    page: Outbox | None = None
    left: asyncio.TimerHandle | None = None
    lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    stirred: asyncio.Event = field(default_factory=asyncio.Event)
    hands: ManualControl = field(default_factory=ManualControl)
    quick: bool = False


class PlaybackSessions:
    """The sessions of a server, and the threads that work for them."""

    def __init__(self, settings: Settings):
        self._settings = settings
        self._sessions: dict[str, Session] = {}
        # The kernels let go of Python's lock, so a heavy world keeps one of these busy and no more.
        self._workers = CapacityLimiter(max(os.cpu_count() or 1, 2))

    def session(self, key: str) -> Session:
        """The session of that key, which has a stage. Raises StudioError."""
        session = self._sessions.get(key)
        if session is None or session.stage is None:
            raise StudioError("no-world", 404)
        return session

    def named_or_only(self, key: str) -> Session:
        """The session of that key; without a key the only one. Raises StudioError."""
        if not key and len(self._sessions) == 1:
            key = next(iter(self._sessions))
        return self.session(key)

    async def serve(self, socket: WebSocket) -> None:
        """Be a page's world for as long as it is connected."""
        await socket.accept()
        page = Outbox()
        try:
            session = self._enter(socket.query_params.get("session", ""), page)
        except ServerError as problem:
            page.refuse(problem, closing=True)
            with suppress(WebSocketDisconnect):
                await page.send_to(socket)
            return
        jobs = (
            partial(self._greet_and_listen, socket, session, page),
            partial(page.send_to, socket),
            partial(self._show, session, page),
        )
        try:
            await until_one_ends(jobs)
        finally:
            self._leave(session, page)

    async def work(self, session: Session, job: Callable[[Playback], T]) -> T:
        """Do something with the session's stage, which nobody else has meanwhile, in a worker unless it is quick.

        Raises StudioError.
        """
        async with session.lock:
            if session.stage is None:
                raise StudioError("no-world", 404)
            if session.quick:
                return job(session.stage)
            return await self._in_worker(partial(job, session.stage))

    async def _in_worker(self, job: Callable[[], T]) -> T:
        return await to_thread.run_sync(job, limiter=self._workers)

    def _enter(self, key: str, page: Outbox) -> Session:
        if not _KEY.fullmatch(key):
            raise StudioError("bad-session")
        session = self._sessions.get(key)
        if session is None:
            self._make_room()
            session = self._sessions[key] = Session(key)
        if session.left:
            session.left.cancel()
            session.left = None
        if session.page:
            session.page.refuse(StudioError("taken-over"), closing=True)
        session.page = page
        return session

    def _make_room(self) -> None:
        most = self._settings.most_sessions
        if len(self._sessions) < most:
            return
        idle = [session for session in self._sessions.values() if session.left]
        if not idle:
            raise StudioError("too-many-sessions", 503, most=most)
        self._forget(min(idle, key=lambda each: each.left.when() if each.left else 0.0))

    def _leave(self, session: Session, page: Outbox) -> None:
        if session.page is page:
            session.page = None
            session.left = asyncio.get_running_loop().call_later(GRACE_S, self._forget, session)

    def _forget(self, session: Session) -> None:
        if session.left:
            session.left.cancel()
        self._sessions.pop(session.key, None)

    def _greet(self, session: Session, page: Outbox, resumed: bool) -> None:
        """Say who is there; only while the session's lock is held."""
        stage = session.stage
        page.put("hello", {"session": session.key, "resumed": resumed} | (stage.hello() if stage else {"cars": 0}))
        if stage:
            stage.look_anew()
            page.put("state", stage.state())
            session.stirred.set()

    async def _greet_and_listen(self, socket: WebSocket, session: Session, page: Outbox) -> None:
        async with session.lock:
            self._greet(session, page, resumed=session.stage is not None)
        settings = self._settings
        rate = RateLimit(2 * settings.messages_a_second, 2000)
        while True:
            try:
                message: Message = await heard(socket, Message, settings.most_body)  # type: ignore[arg-type]  # a union
                if isinstance(message, Shown):
                    page.shown(message.frame)
                else:
                    await self._obey(session, page, message)
            except ServerError as problem:
                page.refuse(problem)
            if not rate.allows(to_ticks(settings.clock())):
                page.refuse(StudioError("too-many-messages", most=settings.messages_a_second), closing=True)
                await asyncio.Event().wait()

    async def _begin(self, session: Session, page: Outbox, message: Set) -> None:
        most_cars = self._settings.most_cars
        async with session.lock:
            session.stage = await self._in_worker(lambda: Playback(world_of(message, most_cars), session.hands.boards))
            session.hands.give_back_all()
            self._greet(session, page, resumed=False)

    async def _obey(self, session: Session, page: Outbox, message: Message) -> None:
        most_cars = self._settings.most_cars
        if isinstance(message, Set):
            with telling(partial(asyncio.get_running_loop().call_soon_threadsafe, page.put, "compiling", {})):
                await self._begin(session, page, message)
            return
        if isinstance(message, Reset):
            session.hands.give_back_all()
        elif isinstance(message, Resume):
            session.hands.give_back(message.car)
        session.quick = False
        told = await self.work(session, lambda stage: _done(stage, message, most_cars))
        # A picture that was measured meanwhile knew nothing of this.
        session.quick = False
        for kind, values in told:
            page.put(kind, values)
        session.stirred.set()

    async def _show(self, session: Session, page: Outbox) -> None:
        """Let time go on, and show it, for as long as the page looks."""
        clock = self._settings.clock
        due_s = state_due_s = car_due_s = clock()
        while True:
            await session.stirred.wait()
            stage = session.stage
            if stage is None or not (stage.playing or stage.changed):
                session.stirred.clear()
                continue
            await asyncio.sleep(max(due_s - clock(), 0))
            now_s = clock()
            due_s = max(due_s + PICTURE_S, now_s)
            beat = partial(_beat, clock, page.next_picture, now_s >= state_due_s, now_s >= car_due_s)
            picture, state, car = await self.work(session, beat)
            session.quick = clock() - now_s < _QUICK_S
            if picture is not None:
                page.put_picture(picture)
            if state is not None:
                page.put("state", state)
                state_due_s = now_s + _STATE_S
            if car is not None:
                page.put("car", car)
                car_due_s = now_s + _CAR_S


Told = dict[str, Any] | None


def _beat(
    clock: Callable[[], float], number: int | None, wants_state: bool, wants_car: bool, stage: Playback
) -> tuple[bytes | None, Told, Told]:
    now_s = clock()
    stage.advance(now_s)
    stage.took(clock() - now_s)
    picture = stage.picture(number) if number is not None and stage.changed else None
    return picture, stage.state() if wants_state else None, stage.car() if wants_car else None


def _done(stage: Playback, message: Message, most_cars: int) -> list[tuple[str, dict[str, Any]]]:
    """Do what a page says; gives what it is told at once. Raises StudioError."""
    try:
        match message:
            case Play():
                stage.play(message.speed)
            case Pause():
                stage.pause()
            case Step():
                stage.step(message.ticks)
            case Reset():
                stage.reset(message.seed)
            case Say():
                stage.say(message.word)
            case Furnish():
                stage.furnish(furniture_of(message.mat, most_cars), message.range_mm)
            case Move():
                stage.move(message.car, message.x_m, message.y_m, message.heading_deg)
            case Watch():
                stage.watch(message.car)
            case Seek():
                stage.seek(message.t_ms)
    except MotorcadeError as problem:
        raise StudioError("bad-world", reason=reason_of(problem)) from None
    car = stage.car()
    return [("state", stage.state()), *([("car", car)] if car else [])]


def routes(stages: PlaybackSessions) -> list[BaseRoute]:
    """The WebSocket of worlds, and what can be downloaded of their runs."""
    exports = Exports()

    async def download(request: Request) -> Response:
        session = stages.session(request.path_params["session"])
        return await exports.answer(request, partial(stages.work, session))

    return [
        WebSocketRoute("/api/world", stages.serve),
        Route("/api/world/{session}/{file}", download),
    ]
