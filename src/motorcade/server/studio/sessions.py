"""The studio's worlds over WebSockets: threads, real time and bounded queues around `motorcade.service.world_session`.

A session exists while its page is connected, and a minute longer for a page that is loaded again.
"""

import asyncio
import os
import re
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TypeVar

import msgspec
from anyio import CapacityLimiter, to_thread
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.engine.native import on_compiling
from motorcade.errors import MotorcadeError
from motorcade.server.http import next_message, until_one_ends
from motorcade.server.request_filter import ServerSettings
from motorcade.server.studio.driving import ManualControl
from motorcade.server.studio.simulation import StudioWorld, build_world
from motorcade.service import world_messages
from motorcade.service.playback import Playback
from motorcade.service.world_messages import WorldAnswer, WorldMessage
from motorcade.service.world_session import WorldSession, refused
from motorcade.timing import to_ticks

GRACE_S = 60.0
# Passing a job to another thread takes longer than this.
_QUICK_S = 0.002
_KEY = re.compile(r"[0-9a-f]{32}")
_MOST_WAITING = 64
_POLICY_VIOLATION = 1008
_T = TypeVar("_T")


class Outbox:
    """Answers that wait to be sent to a page, in order; at most 64.

    A newer state replaces one that waits; so do newer details of a car. Pictures are few: the session makes none
    while the page has two that it hasn't drawn.
    """

    def __init__(self) -> None:
        self._waiting: deque[tuple[type, str | bytes]] = deque()
        self._changed = asyncio.Event()
        self._closing = False

    def put(self, answer: WorldAnswer | bytes, closing: bool = False) -> None:
        """Send an answer; ``closing`` ends the connection with it."""
        kind = type(answer)
        if isinstance(answer, world_messages.State | world_messages.CarDetails):
            self._waiting = deque(each for each in self._waiting if each[0] is not kind)
        if len(self._waiting) < _MOST_WAITING or isinstance(answer, bytes):
            data = answer if isinstance(answer, bytes) else msgspec.json.encode(answer).decode()
            self._waiting.append((kind, data))
        self._closing = self._closing or closing
        self._changed.set()

    async def send_to(self, socket: WebSocket) -> None:
        """Send the answers as they come, until the connection is to be closed."""
        while not self._closing or self._waiting:
            await self._changed.wait()
            self._changed.clear()
            while self._waiting:
                _, data = self._waiting.popleft()
                if isinstance(data, bytes):
                    await socket.send_bytes(data)
                else:
                    await socket.send_text(data)
        await socket.close(_POLICY_VIOLATION)


class PageWorld(WorldSession):
    """A session of the server.

    Args:
        most_cars: the most cars in its world.
        workers: how many threads may work for all sessions.

    Attributes:
        page: the answers to the connected page; None while no page is connected.
        forget_timer: removes the session unless a page connects again.
        lock: for the task that uses the session, which is not safe for threads.
        changed: set when there may be something to show.
        control: the cars that somebody drives, or drove.
        is_quick: whether making the last picture took less time than passing it to a thread.
    """

    def __init__(self, key: str, most_cars: int, workers: CapacityLimiter) -> None:
        self.control = ManualControl()
        super().__init__(key, lambda message: build_world(message, self.control.boards, most_cars))
        self._workers = workers
        self.page: Outbox | None = None
        self.forget_timer: asyncio.TimerHandle | None = None
        self.lock = asyncio.Lock()
        self.changed = asyncio.Event()
        self.is_quick = False

    async def alone(self, job: Callable[[], _T]) -> _T:
        """Do a job while nothing else uses the session; in a thread unless that takes longer."""
        async with self.lock:
            return job() if self.is_quick else await self.in_thread(job)

    async def in_thread(self, job: Callable[[], _T]) -> _T:
        """Do a job in a thread; the caller has acquired the lock."""
        return await to_thread.run_sync(job, limiter=self._workers)

    async def work(self, job: Callable[[StudioWorld], _T]) -> _T:
        """Do a job with the world, as `alone`. Raises MotorcadeError where there is no world."""

        def do() -> _T:
            world = self.current().world
            assert isinstance(world, StudioWorld)
            return job(world)

        return await self.alone(do)

    def current(self) -> Playback:
        """The world in play. Raises MotorcadeError where there is none."""
        if self.playback is None:
            raise MotorcadeError("no-world")
        return self.playback

    def is_paused(self) -> bool:
        """Whether the world is paused, or its page has left."""
        return self.page is None or self.playback is None or not self.playback.playing

    async def play(self) -> None:
        """Go on. Raises MotorcadeError where there is no world."""
        await self.alone(lambda: self.current().play(self.current().speed))
        self.changed.set()


class PageWorlds:
    """The sessions of a server, and the threads that work for them.

    Args:
        settings: the limits for a page.
        most_sessions: the most worlds at once.
        most_cars: the most cars in one of them.
    """

    def __init__(self, settings: ServerSettings, most_sessions: int, most_cars: int) -> None:
        self._settings = settings
        self._most_sessions = most_sessions
        self._most_cars = most_cars
        self._sessions: dict[str, PageWorld] = {}
        # The kernels release Python's lock, so a large world occupies only one of these threads.
        self._workers = CapacityLimiter(max(os.cpu_count() or 1, 2))

    def session(self, key: str) -> PageWorld:
        """Return the session of that key. Raises MotorcadeError where it has no world."""
        session = self._sessions.get(key)
        if session is None or session.playback is None:
            raise MotorcadeError("no-world")
        return session

    def named_or_only(self, key: str) -> PageWorld:
        """Return the session of that key, or the only one where ``key`` is empty. Raises MotorcadeError."""
        if not key and len(self._sessions) == 1:
            key = next(iter(self._sessions))
        return self.session(key)

    async def serve(self, socket: WebSocket) -> None:
        """Serve a page's connection until it ends."""
        await socket.accept()
        page = Outbox()
        try:
            session = self._enter(socket.query_params.get("session", ""), page)
        except MotorcadeError as problem:
            page.put(refused(problem), closing=True)
            with suppress(WebSocketDisconnect):
                await page.send_to(socket)
            return
        jobs = (
            partial(self._receive, socket, session, page),
            partial(page.send_to, socket),
            partial(self._show, session, page),
        )
        try:
            await until_one_ends(jobs)
        finally:
            self._leave(session, page)

    def _enter(self, key: str, page: Outbox) -> PageWorld:
        if not _KEY.fullmatch(key):
            raise MotorcadeError("bad-session")
        session = self._sessions.get(key)
        if session is None:
            self._make_room()
            session = self._sessions[key] = PageWorld(key, self._most_cars, self._workers)
        if session.forget_timer:
            session.forget_timer.cancel()
            session.forget_timer = None
        if session.page:
            session.page.put(refused(MotorcadeError("taken-over")), closing=True)
        session.page = page
        return session

    def _make_room(self) -> None:
        if len(self._sessions) < self._most_sessions:
            return
        idle = {session.forget_timer.when(): session for session in self._sessions.values() if session.forget_timer}
        if not idle:
            raise MotorcadeError("too-many-sessions", most=self._most_sessions)
        self._forget(idle[min(idle)])

    def _leave(self, session: PageWorld, page: Outbox) -> None:
        if session.page is page:
            session.page = None
            session.forget_timer = asyncio.get_running_loop().call_later(GRACE_S, self._forget, session)

    def _forget(self, session: PageWorld) -> None:
        if session.forget_timer:
            session.forget_timer.cancel()
        self._sessions.pop(session.key, None)

    async def _receive(self, socket: WebSocket, session: PageWorld, page: Outbox) -> None:
        settings = self._settings
        async with session.lock:
            _put_all(session, page, session.connect())
        rate = settings.message_rate()
        while True:
            try:
                message: WorldMessage = await next_message(socket, WorldMessage, settings.most_body)  # type: ignore[arg-type]  # a union
                await self._handle(session, page, message)
            except MotorcadeError as problem:
                page.put(refused(problem))
            if not rate.allows(to_ticks(settings.clock())):
                too_many = MotorcadeError("too-many-messages", most=settings.messages_a_second)
                page.put(refused(too_many), closing=True)
                await asyncio.Event().wait()

    async def _handle(self, session: PageWorld, page: Outbox, message: WorldMessage) -> None:
        if isinstance(message, world_messages.Shown):
            # Without the lock, as the page's acknowledgement needn't wait for a picture in the making.
            if session.page is page:
                session.receive(message)
        elif isinstance(message, world_messages.SetWorld):
            notify = partial(asyncio.get_running_loop().call_soon_threadsafe, page.put, world_messages.Compiling())
            with on_compiling(notify):
                async with session.lock:
                    world = await session.in_thread(lambda: session.make_world(message))
                    session.control.give_back_all()
                    _put_all(session, page, session.begin(world))
        else:
            if isinstance(message, world_messages.Reset):
                session.control.give_back_all()
            elif isinstance(message, world_messages.Resume):
                session.control.give_back(message.car)
            session.is_quick = False
            answers = await session.alone(lambda: session.receive(message))
            # A picture that was made and timed meanwhile didn't show this change.
            session.is_quick = False
            _put_all(session, page, answers)

    async def _show(self, session: PageWorld, page: Outbox) -> None:
        """Advance the world while the page is connected, and send its answers."""
        clock = self._settings.clock
        while True:
            await session.changed.wait()
            wait_s = session.wait_s(clock())
            if wait_s is None:
                session.changed.clear()
                continue
            await asyncio.sleep(wait_s)
            began_s = clock()
            answers = await session.alone(partial(_advance, session, clock))
            session.is_quick = clock() - began_s < _QUICK_S
            for answer in answers:
                page.put(answer)


def _advance(session: PageWorld, clock: Callable[[], float]) -> list[WorldAnswer | bytes]:
    now_s = clock()
    answers = session.advance(now_s)
    session.adapt_to(clock() - now_s)
    return answers


def _put_all(session: PageWorld, page: Outbox, answers: list[WorldAnswer]) -> None:
    for answer in answers:
        page.put(answer)
    session.changed.set()
