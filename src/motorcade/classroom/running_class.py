"""A class while its server runs: its state, its folder, and who waits for changes."""

import asyncio
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from anyio import CapacityLimiter, to_thread
from starlette.requests import HTTPConnection
from starlette.responses import Response

from motorcade.classroom.classroom import MOST_PUPILS, SIGNED_IN_S, Classroom
from motorcade.classroom.folder import RECORD, ClassFolder
from motorcade.classroom.network import Network
from motorcade.classroom.passwords import digest
from motorcade.classroom.record import Pupil, from_bytes, to_bytes
from motorcade.errors import MotorcadeError
from motorcade.server.studio.app import Settings
from motorcade.server.studio.sessions import SessionLimits
from motorcade.sockets import network_of
from motorcade.timing import RateLimit, to_ticks

# The owner of the teacher's own projects; pupils' ids are numbers.
TEACHER = "teacher"
_YEAR_S = 365 * 24 * 3600
_SECRET_BYTES = 24
# One world for each pupil and the teacher, so that nobody takes another's place. A hundred take 600 MB at most, so
# each stores less of the past than in a studio of one user: some ten minutes of 20 cars.
SESSIONS = SessionLimits(
    most=MOST_PUPILS + 1, most_of_one_visitor=1, most_cars=500, past_bytes=(4 << 20, 2 << 20), newest_wins=True
)
_TICK_S = 1.0
_STRANGERS_A_SECOND, _RATE_WINDOW_MS, _MOST_STRANGERS = 20, 2000, 4096
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassServerSettings(Settings):
    """The settings of a class's server; ``library`` is the folder of the class.

    Attributes:
        requests_of_one: how many requests a pupil may send in a second, twice as many at once after a pause.
        first_key: lets who has it set the password; None where there is a password.
        network: how pupils find the class.
        authority: the certificate that tablets may install so that they trust the server's; None without HTTPS.
        unix_s: the time in s since 1970.
    """

    sessions: SessionLimits = SESSIONS
    requests_of_one: int = 15
    first_key: str | None = None
    network: Network = field(default_factory=lambda: Network(["127.0.0.1"], 7710))
    authority: Path | None = None
    unix_s: Callable[[], float] = time.time


class RunningClass:
    """What all routes of a class share.

    Args:
        settings: of the server.
        folder: locked for this process.
        cars: the names of the real cars.
    """

    def __init__(self, settings: ClassServerSettings, folder: ClassFolder, cars: tuple[str, ...] = ()) -> None:
        self.settings = settings
        self.folder = folder
        self.first_key = settings.first_key
        self.room = Classroom(folder.load(secrets.randbelow), secrets.randbelow, cars, settings.clock())
        self.hashing = CapacityLimiter(1)
        self._storing = asyncio.Lock()
        # What the file holds, the revision that it has, and the last one that was undone.
        self._kept = to_bytes(self.room.record)
        self._stored = self._undone = self._shown = -1
        self._waiting: set[asyncio.Event] = set()
        self._strangers: OrderedDict[str, RateLimit] = OrderedDict()
        # Cookies are shared between ports: two classes on one computer need different names, one the same at any port.
        own = self.room.record.id
        self._pupil_cookie, self._desk_cookie = (f"motorcade_{name}_{own}" for name in ("class", "desk"))

    def now_s(self) -> float:
        """The time by the server's clock."""
        return self.settings.clock()

    # Who asks.

    def pupil(self, connection: HTTPConnection) -> Pupil | None:
        """The pupil whose device it is; None for anybody else."""
        return self.room.pupil_at(digest(connection.cookies.get(self._pupil_cookie, "")))

    def is_teacher(self, connection: HTTPConnection) -> bool:
        """Whether the teacher is signed in at this browser."""
        return self.room.is_teacher(digest(connection.cookies.get(self._desk_cookie, "")), self.settings.unix_s())

    def visitor(self, connection: HTTPConnection) -> str:
        """The owner of the shelf of who asks: a pupil's id, or the teacher. Raises MotorcadeError for strangers."""
        pupil = self.pupil(connection)
        if pupil:
            return pupil.id
        if self.is_teacher(connection):
            return TEACHER
        raise MotorcadeError("class-session-needed")

    def guesser(self, connection: HTTPConnection) -> str:
        """Whom wrong attempts count for."""
        return network_of(connection.client.host if connection.client else "")

    def new_secret(self) -> str:
        """The secret of a device."""
        return secrets.token_urlsafe(_SECRET_BYTES)

    def remember(self, response: Response, connection: HTTPConnection, secret: str, *, teacher: bool = False) -> None:
        """Have a browser keep a pupil's or the teacher's secret."""
        name, age_s = (self._desk_cookie, int(SIGNED_IN_S)) if teacher else (self._pupil_cookie, _YEAR_S)
        secure = connection.scope["scheme"] in ("https", "wss")
        response.set_cookie(name, secret, max_age=age_s, httponly=True, samesite="strict", secure=secure)

    def forget(self, response: Response, connection: HTTPConnection, *, teacher: bool = False) -> None:
        """Sign a browser out."""
        name = self._desk_cookie if teacher else self._pupil_cookie
        device = digest(connection.cookies.get(name, ""))
        (self.room.sign_out if teacher else self.room.leave)(device)
        response.delete_cookie(name)

    def check_stranger(self, connection: HTTPConnection) -> None:
        """Raise MotorcadeError where somebody without a session asks too often; a class joins with a few requests."""
        who = self.guesser(connection)
        rate = self._strangers.setdefault(who, RateLimit(2 * _STRANGERS_A_SECOND, _RATE_WINDOW_MS))
        self._strangers.move_to_end(who)
        if len(self._strangers) > _MOST_STRANGERS:
            self._strangers.popitem(last=False)
        if not rate.allows(to_ticks(self.now_s())):
            raise MotorcadeError("requests-too-fast", most=_STRANGERS_A_SECOND)

    # Changes.

    async def settle(self, since: int | None = None) -> None:
        """Store what has changed, then let pages know.

        An answer is sent after this, so that nothing is lost that was answered. Where it can't be stored, what has
        changed since the last time is undone, and this raises MotorcadeError.

        Args:
            since: the revision with which a request began: what was undone since then, it may have changed.
        """
        since = self.room.revision if since is None else since
        try:
            async with self._storing:
                revision = self.room.revision
                self._check_kept(since)
                if revision != self._stored:
                    data = to_bytes(self.room.record)
                    await to_thread.run_sync(self.folder.store, data)
                    self._stored, self._kept = revision, data
        except MotorcadeError:
            self._undo()
            raise
        finally:
            self.show_changes()

    def _check_kept(self, since: int) -> None:
        if since <= self._undone:
            raise MotorcadeError("undone-meanwhile")

    def _undo(self) -> None:
        self._undone = self.room.revision
        self.room.restore(from_bytes(self._kept, RECORD))

    async def delete_shelves(self) -> None:
        """Delete the shelves of pupils who are out. Raises MotorcadeError; the next start tries again."""
        for owner in list(self.room.record.removed):
            await self.with_files(self.folder.remove_owner, owner)
            self.room.shelf_deleted(owner)

    def show_changes(self) -> None:
        """Let pages know of what has changed."""
        if self.room.changes != self._shown:
            self._shown = self.room.changes
            for event in self._waiting:
                event.set()

    @contextmanager
    def watching(self) -> Iterator[asyncio.Event]:
        """An event that is set whenever something has changed, and at the beginning."""
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
            self.room.advance(self.now_s())
            with suppress(MotorcadeError):
                await self.settle()

    async def with_files(self, job: Callable[..., _T], *arguments: Any) -> _T:
        """Do a job with the folder in a thread."""
        return await to_thread.run_sync(job, *arguments)
