"""The studio's worlds over WebSockets: threads, real time and bounded queues around `motorcade.service.world_session`.

A session exists while its page is connected, and a minute longer for a page that is loaded again. Sessions are bounded
in all and for each visitor; where no place is free, a session whose page has left or is idle gives way.
"""

import asyncio
import os
import re
import ssl
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

from anyio import CapacityLimiter
from starlette.requests import HTTPConnection
from starlette.websockets import WebSocket

from motorcade.drive.keys import DriverContext
from motorcade.errors import MotorcadeError
from motorcade.fleet.places import Place
from motorcade.server.fleet import RemoteCar
from motorcade.server.http import PAGE, Bodies
from motorcade.server.page_socket import PageSocket, accepted
from motorcade.server.request_filter import ServerSettings
from motorcade.server.studio.driving import PageWorld
from motorcade.server.studio.library import FolderStorage
from motorcade.server.studio.uploads import VIRTUAL_CAR, VirtualCarImage, listed_ports
from motorcade.server.studio.workers import CHECK
from motorcade.service import world_messages
from motorcade.service.history import PAST_BYTES
from motorcade.service.library import Storage
from motorcade.service.messages import Capabilities
from motorcade.service.requests import Context
from motorcade.service.world_messages import SetWorld, Shown, WorldAnswer, WorldMessage

# The list of cars: in a class for the teacher alone.
CARS = "/api/cars"
TEACHERS_CARS = "/api/teacher/cars"
GRACE_S = 60.0
# A page that sent nothing for so long, not even that it drew a picture, is idle.
IDLE_S = 600.0
# Passing a job to another thread takes longer than this.
_QUICK_S = 0.002
# Answers of which only the newest is of use.
_NEWEST = (world_messages.State, world_messages.CarDetails, world_messages.Thoughts)
# Messages that may take longer than making a picture.
_LONG = (world_messages.Reset, world_messages.Seek, world_messages.SetEnvironment, world_messages.StepWorld)
_KEY = re.compile(r"[0-9a-f]{32}")
_T = TypeVar("_T")
# The CPU time that a request may take in seconds, and those that may take more: a user's own computer may be busy with
# what its user asks for.
REQUEST_S = 1.0
IMPORT = "projects/import"
_MOST_S = {IMPORT: 10.0, CHECK: 30.0}


class SessionLimits(NamedTuple):
    """How many sessions a server keeps.

    Attributes:
        most: in all.
        most_of_one_visitor: for one address, or one pupil.
        newest_wins: whether a visitor who has as many gets another world in place of the one used longest ago, even
            where a page shows that.
        most_cars: the most cars in the world of each.
        past_bytes: how much of the past of each is stored, in bytes of moments and of events.
    """

    most: int = 64
    most_of_one_visitor: int = 16
    most_cars: int = 2_000
    past_bytes: tuple[int, int] = PAST_BYTES
    newest_wins: bool = False


SESSIONS = SessionLimits()


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(ServerSettings):
    """The settings of a studio.

    Attributes:
        library: the folder that projects are stored in.
        page: the folder of the built page.
        sessions: the most worlds at once, and the most cars in one of them.
        cars, keys, trust: real cars, as `motorcade.server.fleet.RemoteCars` takes them.
        places: of cars that the list of cars shows besides those that are found.
    """

    library: Path
    page: Path = PAGE
    sessions: SessionLimits = SESSIONS
    cars: tuple[RemoteCar, ...] = ()
    keys: DriverContext | None = None
    trust: ssl.SSLContext | None = None
    places: tuple[Place, ...] = ()


class Visitors:
    """The visitors of a studio of one user: whoever is let in may do everything, and all share one library.

    A class has others (`motorcade.classroom.running`).

    Args:
        settings: of the server.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.storage: Storage = FolderStorage(settings.library)
        self.bodies = Bodies()

    def capabilities(self, classroom: Literal["", "pupil", "teacher"] = "") -> Capabilities:
        """What the server can do for a page of a class, or of none."""
        return Capabilities(
            serial_ports=True,
            downloads=True,
            driving=True,
            most_cars=self.settings.sessions.most_cars,
            classroom=classroom,
            cars={"": CARS, "teacher": TEACHERS_CARS, "pupil": ""}[classroom],
        )

    def visitor(self, connection: HTTPConnection) -> str:
        """Return whom a connection counts for: its address. Raises MotorcadeError where the visitor is not let in."""
        if connection.client:
            return connection.client.host
        return ""

    def context(self, visitor: str) -> Context:
        """What requests of a visitor work with."""
        return Context(self.capabilities(), self.storage, listed_ports)

    def may_use(self, visitor: str, owner: str) -> bool:
        """Whether a visitor may use a world that another one began: a computer's address may change."""
        return True

    def may_drive(self, visitor: str, car: str) -> bool:
        """Whether a visitor may drive a real car now."""
        return True

    def check_message(self, visitor: str, message: WorldMessage) -> None:
        """Raise MotorcadeError where the visitor's world may not do that at present."""

    def note_answers(self, visitor: str, answers: Iterable[WorldAnswer | bytes]) -> None:
        """See what a visitor's world sends to its page."""

    @asynccontextmanager
    async def answering(self, visitor: str, request: str) -> AsyncIterator[float]:
        """Answer a request of a visitor in the block; yields how many seconds of CPU time it may take.

        An import may hold all projects of years. Raises MotorcadeError where the visitor may not send one more now.
        """
        yield _MOST_S.get(request, REQUEST_S)

    def virtual_car(self, connection: HTTPConnection, port: str) -> VirtualCarImage:
        """The store of a visitor's simulated car. Raises MotorcadeError where the visitor may not use ``port``."""
        return VirtualCarImage(self.settings.library / VIRTUAL_CAR)


async def do_in_turn(turns: asyncio.Lock, job: Callable[[], _T]) -> _T:
    """Do a job after those that were asked for before; between two of them everything else is done.

    So where more is to be done than can be, requests are answered at once, and all worlds get equally few pictures.
    """
    async with turns:
        done = job()
        # What came meanwhile is handled in the loop's next round, and only then the next job.
        await asyncio.sleep(0)
        return done


class PageWorlds:
    """The sessions of a server, and the threads that work for them."""

    def __init__(self, visitors: Visitors) -> None:
        self._settings = visitors.settings
        self._limits = visitors.settings.sessions
        self._visitors = visitors
        self._sessions: dict[str, PageWorld] = {}
        # The kernels release Python's lock, so a large world occupies only one of these threads.
        self._workers = CapacityLimiter(max(os.cpu_count() or 1, 2))
        # What may take long has a thread of its own, so that no picture of another page waits for it.
        self._builder = CapacityLimiter(1)
        self._turns = asyncio.Lock()

    def session(self, key: str, visitor: str) -> PageWorld:
        """Return the session of that key. Raises MotorcadeError where the visitor has none with a world."""
        session = self._sessions.get(key)
        if session is None or not session.has_world or not self._visitors.may_use(visitor, session.visitor):
            raise MotorcadeError("no-world")
        return session

    def named_or_only(self, key: str, visitor: str) -> PageWorld:
        """Return the session of that key, or the visitor's only one where ``key`` is empty. Raises MotorcadeError."""
        own = [session.key for session in self._sessions.values() if self._visitors.may_use(visitor, session.visitor)]
        if not key and len(own) == 1:
            key = own[0]
        return self.session(key, visitor)

    def newest(self) -> dict[str, PageWorld]:
        """For each visitor the session with a world that a connected page used last."""
        found = [session for session in self._sessions.values() if session.page and session.has_world]
        return {session.visitor: session for session in sorted(found, key=lambda session: session.used_s)}

    async def pause_all(self, whose: Callable[[str], bool]) -> None:
        """Pause the worlds of the visitors for whom ``whose`` holds: none waits for another, and each has its try."""
        sessions = [session for session in self._sessions.values() if session.has_world and whose(session.visitor)]
        await asyncio.gather(*map(self._pause, sessions))

    async def _pause(self, session: PageWorld) -> None:
        await session.alone(session.pause)
        session.changed.set()
        if session.page:
            self._put_all(session, session.page, [session.state()])

    def end(self, visitor: str, problem: MotorcadeError) -> None:
        """End all sessions of a visitor; their pages are sent ``problem``."""
        for session in [session for session in self._sessions.values() if session.visitor == visitor]:
            self._forget(session, problem)

    async def serve(self, socket: WebSocket) -> None:
        """Serve a page's connection until it ends."""
        async with accepted(socket, self._settings, _NEWEST) as page:
            visitor = self._visitors.visitor(socket)
            session = self._enter(socket.query_params.get("session", ""), visitor)
            await self._serve(session, page)

    async def serve_shared(self, socket: WebSocket, session: PageWorld, first: object) -> None:
        """Serve a connection to a world that is no page's own, until it ends; ``first`` is sent before all answers."""
        async with accepted(socket, self._settings, _NEWEST) as page:
            page.put(first)
            await self._serve(session, page)

    async def run_unshown(self, session: PageWorld, every_s: float) -> None:
        """Advance a shared world while no page has it, for those who look on; until the task is cancelled."""
        clock = self._settings.clock
        while True:
            async with session.lock:
                if session.page is None and session.wait_s(clock()) is not None:
                    await session.in_thread(partial(_advance, session, clock))
                    # An earlier page's picture is older than the world.
                    session.sent.pop(bytes, None)
            await asyncio.sleep(every_s)

    async def _serve(self, session: PageWorld, page: PageSocket) -> None:
        """Serve a page, which has the world alone until a newer one comes."""
        if session.page:
            session.page.refuse(MotorcadeError("taken-over"), closing=True)
        session.page = page
        session.used_s = self._settings.clock()
        try:
            async with session.lock:
                self._put_all(session, page, session.connect())
            handle = partial(self._handle, session, page)
            await page.serve(WorldMessage, handle, [partial(self._show, session, page)])
        finally:
            self._leave(session, page)

    def _enter(self, key: str, visitor: str) -> PageWorld:
        if not _KEY.fullmatch(key):
            raise MotorcadeError("bad-session")
        session = self._sessions.get(key)
        if session and not self._visitors.may_use(visitor, session.visitor):
            raise MotorcadeError("bad-session")
        if session is None:
            self._make_room(visitor)
            session = self._sessions[key] = PageWorld(
                key, visitor, self._limits.most_cars, self._workers, self._limits.past_bytes
            )
        if session.forget_timer:
            session.forget_timer.cancel()
            session.forget_timer = None
        return session

    def _make_room(self, visitor: str) -> None:
        """Forget a session where the visitor, or the server, has too many. Raises MotorcadeError where all are used."""
        alike = [session for session in self._sessions.values() if session.visitor == visitor]
        for code, some, most in (
            ("too-many-sessions-of-one", alike, self._limits.most_of_one_visitor),
            ("too-many-sessions", list(self._sessions.values()), self._limits.most),
        ):
            if len(some) < most:
                continue
            idle_since_s = self._settings.clock() - IDLE_S
            gives_way = self._limits.newest_wins and some is alike
            unused = [
                session for session in some if gives_way or session.page is None or session.used_s <= idle_since_s
            ]
            if not unused:
                raise MotorcadeError(code, most=most)
            # Pages that have left give way before pages that are idle.
            oldest = min(unused, key=lambda session: (session.page is not None, session.used_s))
            problem = None
            if gives_way:
                problem = MotorcadeError("taken-over")
            self._forget(oldest, problem)
            return

    def _leave(self, session: PageWorld, page: PageSocket) -> None:
        if session.page is page:
            session.page = None
            session.used_s = self._settings.clock()
            if session.key in self._sessions:
                session.forget_timer = asyncio.get_running_loop().call_later(GRACE_S, self._forget, session)

    def _forget(self, session: PageWorld, problem: MotorcadeError | None = None) -> None:
        if session.forget_timer:
            session.forget_timer.cancel()
        if session.page:
            idle = MotorcadeError("session-was-idle", minutes=round(IDLE_S / 60))
            session.page.refuse(problem or idle, closing=True)
            session.page = None
        del self._sessions[session.key]

    async def _handle(self, session: PageWorld, page: PageSocket, message: WorldMessage) -> None:
        session.used_s = self._settings.clock()
        if not isinstance(message, session.allowed):
            raise MotorcadeError("not-in-this-world")
        if isinstance(message, Shown):
            # Without the lock, as the page's acknowledgement needn't wait for a picture in the making.
            if session.page is page:
                session.receive(message)
            return
        async with session.lock:
            # Asked when the turn has come: meanwhile another page may have the world, or the class was frozen.
            if session.page is not page:
                return
            self._visitors.check_message(session.visitor, message)
            if isinstance(message, SetWorld):
                world = await session.in_thread(lambda: session.make_world(message), self._builder)
                session.fleet.give_back_all()
                session.mat = message.mat
                answers = session.begin(world)
                session.sent.clear()
            else:
                answers = await self._receive(session, message)
            self._put_all(session, page, answers)

    async def _receive(self, session: PageWorld, message: WorldMessage) -> list[WorldAnswer]:
        """Do what a page wants of its world; the caller has acquired the lock."""
        if isinstance(message, world_messages.Reset):
            session.fleet.give_back_all()
        elif isinstance(message, world_messages.Resume):
            session.fleet.give_back(message.car)
        limiter = None
        if isinstance(message, _LONG):
            limiter = self._builder
        answers = await session.in_thread(lambda: session.receive(message), limiter)
        # The last picture didn't show this change.
        session.is_quick = False
        if isinstance(message, world_messages.SetEnvironment):
            session.mat = message.mat
        return answers

    async def _show(self, session: PageWorld, page: PageSocket) -> None:
        """Advance the world while the page is connected, and send its answers."""
        clock = self._settings.clock
        advance = partial(_advance, session, clock)
        while True:
            await session.changed.wait()
            wait_s = session.wait_s(clock())
            if wait_s is None:
                session.changed.clear()
                continue
            await asyncio.sleep(wait_s)
            async with session.lock:
                answers = await (do_in_turn(self._turns, advance) if session.is_quick else session.in_thread(advance))
            self._put(session, page, answers)

    def _put_all(self, session: PageWorld, page: PageSocket, answers: Sequence[WorldAnswer]) -> None:
        self._put(session, page, answers)
        session.changed.set()

    def _put(self, session: PageWorld, page: PageSocket, answers: Sequence[WorldAnswer | bytes]) -> None:
        for answer in answers:
            session.sent[type(answer)] = answer
            page.put(answer)
        self._visitors.note_answers(session.visitor, answers)


def _advance(session: PageWorld, clock: Callable[[], float]) -> list[WorldAnswer | bytes]:
    """Advance a world, with the session's lock; note how long that took, without the time for which it waited."""
    now_s = clock()
    answers = session.advance(now_s)
    took_s = clock() - now_s
    session.adapt_to(took_s)
    # Once may be long because the computer did something else meanwhile.
    session.is_quick = min(took_s, session.took_s) < _QUICK_S
    session.took_s = took_s
    return answers
