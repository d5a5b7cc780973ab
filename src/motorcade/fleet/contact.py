"""One place where a car may be: the connection to it, the heartbeat that asks it, and what it said."""

import asyncio
import ssl
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import NamedTuple

from motorcade.drive.client import DriveClient
from motorcade.errors import MotorcadeError
from motorcade.fleet.link import Link, connect, connect_problem
from motorcade.fleet.places import Place, safe_name
from motorcade.upload.transfer import NEW, OLD, Retry, holds_phrase, is_busy, upload_error
from motorcade.words.request import ASK, STOP

BEAT_S = 1.4
# A car that answered none of so many heartbeats is away.
MISSES = 3
AWAY_S = BEAT_S * (MISSES + 0.4)
# What a car holds that couldn't be reached, besides what `motorcade.upload.transfer` tells.
AWAY = "away"
_AGAIN_S = 0.5
# How often an upload begins whose connection breaks, and how long a car may take to be back.
_TRIES = 3
_BACK_S = 5.0


class ContactOptions(NamedTuple):
    """How cars are reached.

    Attributes:
        tls: a driver's keys (`motorcade.drive.tls.keys.client_context`), for cars that require them.
        baud: of serial ports, bits a second.
        now_s: a clock in seconds that never goes back.
        retrying: called before a further try of an upload.
    """

    tls: ssl.SSLContext | None = None
    baud: int = 115200
    now_s: Callable[[], float] = time.monotonic
    retrying: Callable[[Retry], None] = lambda retry: None


class CarStatus(NamedTuple):
    """What is known of a car; text of a stranger is made safe by `safe_name`.

    Attributes:
        name, number, role, board, version, state: what the car says; state is ``runs``, ``stopped`` or a drive state.
        where: its port or address. ``kind`` is car or drive.
        words, crc32: of its image; None where that is unknown.
        battery_mv: None where it isn't measured.
        away: whether it doesn't answer.
        silent_s: since when it is silent; None where it never answered.
        problem: why it doesn't answer, or what is wrong with its answers.
    """

    name: str
    where: str
    kind: str
    number: int | None = None
    role: str = ""
    board: str = ""
    version: str = ""
    state: str = ""
    words: int | None = None
    crc32: str | None = None
    battery_mv: int | None = None
    away: bool = True
    silent_s: float | None = None
    problem: MotorcadeError | None = None


class Verdict(NamedTuple):
    """What became of a load at one car.

    Attributes:
        car, where: its name, and its port or address.
        holds: what it holds now: NEW, OLD or another of `motorcade.upload.transfer`; AWAY where it wasn't reached.
        error: why it doesn't hold the new program; None where it does.
    """

    car: str
    where: str
    holds: str
    error: MotorcadeError | None


class Contact:
    """A place where a car may be, asked again and again while ``run`` runs.

    Attributes:
        place: where it is.
        is_known: set once the car has answered, or a try to reach it has failed.
        ordered: STOP or GO, the last order; empty where there was none.
        wanted: the same until the car has confirmed it: it gets that first when it is back.
    """

    def __init__(self, place: Place, options: ContactOptions) -> None:
        self.place = place
        self.is_known = asyncio.Event()
        self.wanted = self.ordered = ""
        self._options = options
        self._link: Link | None = None
        # Set while the car is connected and answers.
        self._answers = asyncio.Event()
        self._fields: dict[str, str] = {}
        self._heard_s: float | None = None
        self._problem: MotorcadeError | None = None
        self._loading = 0

    @property
    def name(self) -> str:
        """What the car calls itself, else what the list calls it, else where it is."""
        return safe_name(self._fields.get("name", "")) or self.place.name or self.place.address

    def status(self) -> CarStatus:
        """What is known of the car."""
        fields = self._fields
        silent_s = None if self._heard_s is None else self._options.now_s() - self._heard_s
        unreachable = self._link is None and not self._loading
        return CarStatus(
            name=self.name,
            where=self.place.address,
            kind=self.place.kind,
            number=_number(fields.get("number"), 16),
            role=safe_name(fields.get("role", "")),
            board=safe_name(fields.get("board", "")),
            version=safe_name(fields.get("version", "")),
            state=safe_name(fields.get("state", "")),
            words=_number(fields.get("words"), 10),
            crc32=fields["holds"] if _number(fields.get("holds"), 16) is not None else None,
            battery_mv=_number(fields.get("battery"), 10),
            away=unreachable or silent_s is None or silent_s > AWAY_S,
            silent_s=None if silent_s is None else round(silent_s, 1),
            problem=self._problem,
        )

    def order(self, kind: str) -> None:
        """Send STOP or GO at once, and again until the car confirms it."""
        self.wanted = self.ordered = kind
        if self._link:
            self._link.send(kind).add_done_callback(partial(self._take, kind))

    async def ask(self, kind: str, name: str = "") -> None:
        """Send a request and wait for its answer. Raises MotorcadeError."""
        if self._link is not None:
            answer = self._link.send(kind, name)
            await asyncio.wait([answer], timeout=AWAY_S)
            if answer.done() and not answer.cancelled():
                self._hear(answer.result())
                return
        raise MotorcadeError("car-away", car=self.name)

    async def run(self) -> None:
        """Stay connected, and ask again and again until cancelled; what is no car at a port is left alone."""
        while True:
            try:
                self._link = await connect(self.place, self._options.tls, self._options.baud)
                await self._beat(self._link)
            except (OSError, TimeoutError, MotorcadeError) as problem:
                self._problem = connect_problem(self.place, problem)
            finally:
                if self._link:
                    self._link.close()
                self._link = None
                self._answers.clear()
            self.is_known.set()
            if not self.place.name and self._problem and self._problem.code == "no-car-at-port":
                return
            await asyncio.sleep(_AGAIN_S)

    async def load(self, image: bytes, progress: "Callable[[Contact, int], None]") -> Verdict:
        """Upload ``image``, again where the connection breaks; ``progress`` gets the number of bytes sent so far."""
        holds, error = AWAY, MotorcadeError("car-away", car=self.name)
        for number in range(_TRIES):
            # A car that is known to be away keeps nobody waiting.
            with suppress(TimeoutError):
                async with asyncio.timeout(_BACK_S):
                    await (self._answers if number else self.is_known).wait()
            link = self._link
            if link is None or not self._answers.is_set():
                break
            self._loading += 1
            try:
                transfer = await link.upload(image, lambda sent: progress(self, sent), self._options.retrying)
            finally:
                self._loading -= 1
            holds = transfer.holds
            if transfer.outcome is None:
                error = MotorcadeError("went-away", port=self.name, holds=holds_phrase(holds))
                self._answers.clear()
                continue
            found = upload_error(self.name, transfer.outcome, holds)
            if found is None:
                return Verdict(self.name, self.place.address, NEW, None)
            error = found
            if not is_busy(transfer.outcome):
                break
            await asyncio.sleep(BEAT_S)
        return Verdict(self.name, self.place.address, holds, error)

    async def _beat(self, link: Link) -> None:
        """Send heartbeats until the connection ends or the car misses three. Raises MotorcadeError then."""
        missed = 0
        while not link.closed and missed < MISSES:
            heard_s = self._heard_s
            if not self._loading:
                kind = self.wanted or ASK
                link.send(kind).add_done_callback(partial(self._take, kind))
            await link.pause(BEAT_S)
            if self._loading:
                # Its answers to the upload tell as much.
                self._heard_s = self._options.now_s()
            missed = missed + 1 if self._heard_s == heard_s else 0
            if missed:
                self._answers.clear()
                self.is_known.set()
        if link.is_strange or not (self.place.host or link.heard):
            raise MotorcadeError("no-car-at-port", port=self.place.address)
        raise MotorcadeError("car-away", car=self.name)

    def _take(self, kind: str, answer: "asyncio.Future[dict[str, str]]") -> None:
        """Note an answer, and whether it confirms the last stop or go."""
        if answer.cancelled():
            return
        refusal = answer.exception()
        if isinstance(refusal, MotorcadeError):
            # It is a car, but one that doesn't know the request.
            self._heard_s, self._problem = self._options.now_s(), refusal
            self.is_known.set()
        else:
            self._hear(answer.result())
        self._answers.set()
        if kind == self.wanted:
            self.wanted = ""

    def _hear(self, fields: dict[str, str]) -> None:
        self._fields, self._heard_s, self._problem = fields, self._options.now_s(), None
        self.is_known.set()


class DriveContact(Contact):
    """A drive server: its telemetry is the heartbeat."""

    def __init__(self, place: Place, options: ContactOptions) -> None:
        super().__init__(place, options)
        self._ordered = asyncio.Event()
        name = (place.name or None) if options.tls else None
        self._client = DriveClient(
            place.host, place.port, telemetry_port=place.telemetry_port, keys=options.tls, car=name
        )

    def status(self) -> CarStatus:
        telemetry, known = self._client.telemetry, super().status()
        if telemetry is None:
            return known._replace(away=True)
        return known._replace(state=telemetry.state, battery_mv=telemetry.battery_mv, away=False)

    def order(self, kind: str) -> None:
        super().order(kind)
        self._ordered.set()

    async def ask(self, kind: str, name: str = "") -> None:
        raise MotorcadeError("car-only-drives", car=self.name)

    async def load(self, image: bytes, progress: "Callable[[Contact, int], None]") -> Verdict:
        return Verdict(self.name, self.place.address, OLD, MotorcadeError("car-only-drives", car=self.name))

    async def run(self) -> None:
        client = self._client
        client.begin()
        try:
            while True:
                if client.telemetry:
                    self._heard_s = self._options.now_s()
                    if kind := self.wanted:
                        with suppress(MotorcadeError):
                            await (client.stop() if kind == STOP else client.clear())
                            self.wanted = "" if self.wanted == kind else self.wanted
                self._problem = client.problem
                if client.telemetry or client.problem:
                    self.is_known.set()
                with suppress(TimeoutError):
                    async with asyncio.timeout(_AGAIN_S):
                        await self._ordered.wait()
                self._ordered.clear()
        finally:
            await client.end()


def _number(text: str | None, base: int) -> int | None:
    """Return the number in a stranger's text, None where it is none of at most eight digits."""
    allowed = "0123456789abcdef"[:base]
    return int(text, base) if text and len(text) <= 8 and all(each in allowed for each in text) else None
