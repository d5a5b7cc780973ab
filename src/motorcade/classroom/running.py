"""A class while its server runs: its state, its folder, who asks and may do what; and the stop of all real cars."""

import asyncio
import logging
import secrets
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from inspect import isawaitable
from pathlib import Path

from anyio import CapacityLimiter, to_thread
from starlette.requests import HTTPConnection
from starlette.responses import Response

from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.names import digest
from motorcade.classroom.network import Network
from motorcade.classroom.pairs import Pairs
from motorcade.classroom.record import TEACHER, WINDOWS, ClassRecord, Presence, Pupil, is_owner, owners_of
from motorcade.classroom.room import CABLE, MOST_PUPILS, SIGNED_IN_S, Classroom
from motorcade.classroom.shared_mat import SharedMat
from motorcade.drive.connection import CarRefusesError
from motorcade.errors import DriveError, MotorcadeError
from motorcade.missions.document import OWN
from motorcade.server.fleet import RemoteCars
from motorcade.server.studio.sessions import IMPORT, REQUEST_S, SessionLimits, Settings, Visitors
from motorcade.server.studio.uploads import VirtualCarImage, has_cable, listed_ports
from motorcade.server.studio.workers import CHECK
from motorcade.service.messages import Port
from motorcade.service.requests import Context
from motorcade.service.upload_session import VIRTUAL_PORT
from motorcade.service.world_messages import Goals, Play, SetWorld, StepWorld, WorldAnswer, WorldMessage
from motorcade.timing import Attempts

_YEAR_S = 365 * 24 * 3600
# One world for each pupil and the teacher, so that nobody takes another's place. A hundred take 600 MB at most, so
# each stores less of the past than in a studio of one user: some ten minutes of 20 cars.
SESSIONS = SessionLimits(
    most=MOST_PUPILS + 1, most_of_one_visitor=1, most_cars=500, past_bytes=(4 << 20, 2 << 20), newest_wins=True
)
_TICK_S = 1.0
_REQUESTS_A_SECOND = 20
_RATE_WINDOW_S = 2.0
# A whole class imports its projects one after another; the check of the dearest mission takes a quarter of a second.
_MOST_IMPORT_S = 5.0
_AGAIN_S = 0.1
# The clocks of a computer drift by less between two ticks.
_CLOCK_IS_SET_S = 60.0
# An answer waits so long for cars that can't be reached; they are stopped when they can be again.
_PATIENCE_S = 1.0
_log = logging.getLogger("uvicorn.error")


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassServerSettings(Settings):
    """The settings of a class's server; ``library`` is the folder of the class.

    Attributes:
        first_key: lets who has it set the password; None where there is a password.
        network: how pupils find the class.
        authority: the certificate that tablets may install so that they trust the server's; None without HTTPS.
        unix_s: the time in s since 1970, which somebody may set back or forward.
    """

    sessions: SessionLimits = SESSIONS
    first_key: str | None = None
    network: Network = field(default_factory=lambda: Network(["127.0.0.1"], 7710))
    authority: Path | None = None
    unix_s: Callable[[], float] = time.time


class RunningClass(Visitors):
    """What all routes of a class share, and its pupils, by their ids, and its teacher as visitors of the studio.

    Args:
        settings: of the server.
        folder: locked for this process.
    """

    settings: ClassServerSettings

    def __init__(self, settings: ClassServerSettings, folder: ClassFolder) -> None:
        super().__init__(settings)
        self.storage = self.folder = folder
        self.first_key = settings.first_key
        cars = [car.name for car in settings.cars]
        record = folder.load(secrets.randbelow)
        self.room = Classroom(record, secrets.randbelow, cars, settings.clock())
        folder.is_in = self.is_in
        self.mat = SharedMat()
        self.pairs = Pairs(self.room)
        for pair in self.room.record.pairs:
            for window in WINDOWS:
                # A window that nobody has stored yet, or whose files are gone, begins empty.
                with suppress(MotorcadeError):
                    self.pairs.versions[pair.id, window] = folder.history(pair.library, window)[0].version
        self.hashing = CapacityLimiter(1)
        self.reporting = CapacityLimiter(1)
        self._storing = asyncio.Lock()
        # The revision that the file has, and the last one that was undone.
        self._stored = self._undone = self._shown = -1
        self._began_s = settings.unix_s() - settings.clock()
        for sign_in in self.room.record.sign_ins:
            # It was made while the clock of this computer was ahead.
            sign_in.until_s = min(sign_in.until_s, settings.unix_s() + SIGNED_IN_S)
        self._waiting: set[asyncio.Event] = set()
        # Of pupils, and of strangers by address: a page needs a few requests in a second, also one that joins.
        self.rates = Attempts(2 * _REQUESTS_A_SECOND, _RATE_WINDOW_S, "requests-too-fast")
        self._turns: dict[tuple[str, bool], asyncio.Lock] = {}
        # Cookies are shared between ports: two classes on one computer need different names, one the same at any port.
        own = self.room.record.id
        self._pupil_cookie, self._teacher_cookie = (f"motorcade_{name}_{own}" for name in ("class", "teacher"))

    # Who asks.

    def pupil(self, connection: HTTPConnection) -> Pupil | None:
        """Return the pupil whose device it is; None for anybody else."""
        return self.room.pupil_at(digest(connection.cookies.get(self._pupil_cookie, "")))

    def is_teacher(self, connection: HTTPConnection) -> bool:
        """Return whether the teacher is signed in at this browser."""
        return self.room.is_teacher(digest(connection.cookies.get(self._teacher_cookie, "")), self.unix_s())

    def unix_s(self) -> float:
        """Return the time in s since 1970, as it goes on whatever the computer's clock is set to meanwhile."""
        return self._began_s + self.settings.clock()

    def is_in(self, owner: str) -> bool:
        """Return whether something may be stored for an owner: who is in, and whose number the file has."""
        return owner in owners_of(self.room.record) and owner in owners_of(self.room.kept)

    def visitor(self, connection: HTTPConnection) -> str:
        """Return whose library it is that asks: a pupil's id, or the teacher. Raises MotorcadeError for strangers."""
        if pupil := self.pupil(connection):
            return pupil.id
        if self.is_teacher(connection):
            return TEACHER
        raise MotorcadeError("class-session-needed")

    def remember(self, response: Response, connection: HTTPConnection, secret: str, *, teacher: bool = False) -> None:
        """Have a browser keep a pupil's or the teacher's secret."""
        # The server alone says how long the teacher is signed in: the clock of a browser may be set, too.
        name = self._pupil_cookie
        if teacher:
            name = self._teacher_cookie
        secure = connection.scope["scheme"] in ("https", "wss")
        response.set_cookie(name, secret, max_age=_YEAR_S, httponly=True, samesite="strict", secure=secure)

    def forget(self, response: Response, connection: HTTPConnection, *, teacher: bool = False) -> None:
        """Sign a browser out."""
        name = self._pupil_cookie
        sign_out = self.room.leave
        if teacher:
            name = self._teacher_cookie
            sign_out = self.room.sign_out
        sign_out(digest(connection.cookies.get(name, "")))
        response.delete_cookie(name)

    # Changes.

    async def settle(self, since: int | None = None) -> None:
        """Store what has changed, then let pages know.

        An answer is sent after this, so that nothing is lost that was answered. Where it can't be stored, what has
        changed since the last time is undone, and this raises MotorcadeError.

        Args:
            since: the revision with which a request began: what was undone since then, it may have changed.
        """
        if since is None:
            since = self.room.revision
        try:
            async with self._storing:
                revision = self.room.revision
                self._check_kept(since)
                if revision != self._stored:
                    data = self.room.to_store()
                    await to_thread.run_sync(self.folder.store, data)
                    self.room.note_stored(data)
                    self._stored = revision
        except MotorcadeError:
            self._undone = self.room.revision
            self.room.restore()
            raise
        finally:
            self.show_changes()

    def _check_kept(self, since: int) -> None:
        if since <= self._undone:
            raise MotorcadeError("undone-meanwhile")

    async def delete_libraries(self) -> None:
        """Delete the libraries of who is out. Raises MotorcadeError where one can't be deleted now; others are."""
        problems = []
        for owner in dict.fromkeys(self.room.record.removed):
            try:
                if is_owner(owner) and owner not in owners_of(self.room.record):
                    await to_thread.run_sync(self.folder.remove_owner, owner)
                self.room.part(partial(_forget, owner=owner))
            except MotorcadeError as problem:
                problems.append(problem)
        if problems:
            raise problems[0]

    async def delete_strays(self) -> None:
        """Delete the libraries that belong to nobody: a server was killed, or one of before this version wrote them."""
        known = owners_of(self.room.record)
        strays = [owner for owner in await to_thread.run_sync(self.folder.owners) if owner not in known]
        self.room.record.removed += [owner for owner in strays if owner not in self.room.record.removed]
        await self.delete_libraries()

    def show_changes(self) -> None:
        """Let pages know of what has changed."""
        if (changes := self.room.changes + self.mat.changes) != self._shown:
            self._shown = changes
            for event in self._waiting:
                event.set()

    @contextmanager
    def watching(self) -> Iterator[asyncio.Event]:
        """Yield an event that is set whenever something has changed, and at the beginning."""
        event = asyncio.Event()
        event.set()
        self._waiting.add(event)
        try:
            yield event
        finally:
            self._waiting.discard(event)

    async def pass_time(self) -> None:
        """Let time pass, until the task is cancelled."""
        while True:
            await asyncio.sleep(_TICK_S)
            now_s = self.settings.clock()
            self._follow_clock()
            passing = (partial(self.room.advance, now_s), partial(self.pairs.advance, now_s))
            for act in (*passing, self._look_for_cable, self._keep_up):
                try:
                    done = act()
                    if isawaitable(done):
                        await done
                except MotorcadeError:
                    # The teacher's page says that the disk takes nothing; the next second tries again.
                    continue
                except Exception:  # noqa: BLE001  # whatever is wrong with one record, the others go on
                    _log.exception("The clock of the class goes on")

    async def _look_for_cable(self) -> None:
        self.room.see_cable(await to_thread.run_sync(has_cable))

    def _follow_clock(self) -> None:
        """Where the computer's clock was set, let sign-ins end as much later or earlier: the file has them by it."""
        set_s = self.settings.unix_s() - self.settings.clock() - self._began_s
        if abs(set_s) < _CLOCK_IS_SET_S:
            return
        self._began_s += set_s
        for sign_in in self.room.record.sign_ins:
            sign_in.until_s += set_s
        self.room.save()

    async def _keep_up(self) -> None:
        """Delete and store what could not be before. Raises MotorcadeError."""
        try:
            await self.delete_libraries()
        finally:
            await self.settle()

    # What its visitors may do in the studio.

    def context(self, visitor: str) -> Context:
        able = self.capabilities("teacher" if visitor == TEACHER else "pupil")
        return Context(able, self.storage, lambda: self._ports(visitor), visitor)

    def _ports(self, visitor: str) -> list[Port]:
        """Return the server's ports where the visitor has the cable, and the simulated car."""
        if visitor == TEACHER or self.room.holders[CABLE] == visitor:
            return listed_ports()
        return [VIRTUAL_PORT]

    def may_use(self, visitor: str, owner: str) -> bool:
        return visitor == owner

    def may_drive(self, visitor: str, car: str) -> bool:
        return visitor == TEACHER or self.room.may_drive(visitor, car)

    def check_message(self, visitor: str, message: WorldMessage) -> None:
        if visitor not in self.room.presence:
            return
        # A page that is loaded again gets its world, which stands still.
        if self.room.frozen and isinstance(message, Play | StepWorld):
            raise MotorcadeError("class-frozen")
        if isinstance(message, SetWorld):
            mission = None
            if message.mission:
                mission = message.mission.id or OWN
            self._note(visitor, Presence.open_mission, mission=mission)
            self.show_changes()

    def note_answers(self, visitor: str, answers: Iterable[WorldAnswer | bytes]) -> None:
        for answer in answers:
            if isinstance(answer, Goals):
                met = sum(goal.progress == "met" for goal in answer.goals)
                count = len(answer.goals)
                self._note(visitor, Presence.see_goals, met=met, goals=count)
                self.show_changes()

    @asynccontextmanager
    async def answering(self, visitor: str, request: str) -> AsyncIterator[float]:
        """Answer one request of a visitor at a time, and one check: however many one sends, others wait for one."""
        self.check_request(visitor)
        async with self._turns.setdefault((visitor, request == CHECK), asyncio.Lock()):
            yield _MOST_IMPORT_S if request == IMPORT else REQUEST_S
        if request == CHECK:
            await self.count_stars([visitor])

    async def count_stars(self, owners: Iterable[str]) -> None:
        """Count the stars that pupils have earned."""
        for owner in owners:
            earned = await to_thread.run_sync(self.folder.stars, owner)
            total = sum(map(len, earned.values()))
            self._note(owner, Presence.earn, stars=total)
        self.show_changes()

    def _note(self, pupil: str, what: Callable[..., None], **details: object) -> None:
        """Note now what a pupil did."""
        self.room.note(pupil, partial(what, **details, now_s=self.settings.clock()))

    def check_request(self, visitor: str) -> None:
        """Raise MotorcadeError where the visitor may not send one more request now."""
        if visitor != TEACHER:
            self.rates.count(visitor, self.settings.clock())

    def virtual_car(self, connection: HTTPConnection, port: str) -> VirtualCarImage:
        visitor = self.visitor(connection)
        if visitor != TEACHER:
            if self.room.frozen:
                raise MotorcadeError("class-frozen")
            if port != VIRTUAL_PORT.port:
                self.room.check_cable(visitor)
        return self.folder.virtual_car(visitor)


def _forget(record: ClassRecord, owner: str) -> None:
    """Note that an owner's library is deleted."""
    record.removed = [other for other in record.removed if other != owner]


class EmergencyStop:
    """The teacher's emergency stop of all real cars."""

    def __init__(self, cars: RemoteCars) -> None:
        self._cars = cars
        self._pending: list[asyncio.Task[None]] = []

    async def stop(self) -> list[str]:
        """Stop all cars at once; return those that could not be reached yet."""
        return await self._at_all(lambda car: self._cars.stop(car, TEACHER))

    async def release(self) -> list[str]:
        """Let all cars drive again; return those that could not be reached yet."""
        return await self._at_all(self._clear)

    async def _clear(self, car: str) -> None:
        """Lift a car's stop as soon as it can be reached, unless somebody stops it until then."""
        stops = self._cars.stops[car]
        control = await self._cars.connect(car, TEACHER)
        try:
            while self._cars.stops[car] == stops:
                try:
                    return await control.act("clear")
                except CarRefusesError:
                    raise
                except DriveError:
                    # A new connection to a car takes a moment.
                    await asyncio.sleep(_AGAIN_S)
        finally:
            control.leave()

    async def _at_all(self, act: Callable[[str], Awaitable[None]]) -> list[str]:
        """Do something at all cars, in place of what was begun before."""
        done = set()

        async def do(car: str) -> None:
            with suppress(MotorcadeError):
                await act(car)
                done.add(car)

        cars = [car.car for car in await self._cars.listed()]
        for before in self._pending:
            before.cancel()
        tasks = self._pending = [asyncio.create_task(do(car)) for car in cars]
        if tasks:
            await asyncio.wait(tasks, timeout=_PATIENCE_S)
        return [car for car in cars if car not in done]
