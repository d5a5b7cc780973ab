"""One place where a car may be: the connection to it, the heartbeat that asks it, and what it said."""

import asyncio
import ssl
from collections.abc import Callable
from contextlib import closing, suppress
from functools import partial
from time import monotonic
from typing import NamedTuple

from motorcade.drive.client import DriveClient
from motorcade.errors import MotorcadeError, Phrase, TransferError
from motorcade.fleet.link import Answer, Link, connect
from motorcade.fleet.places import Place, safe_name
from motorcade.sockets import LAST_PORT
from motorcade.upload.transfer import OLD, holds_phrase, is_busy, upload_error
from motorcade.words.request import ASK, STOP

BEAT_S = 1.4
# A car that answered none of so many heartbeats is away.
MISSES = 3
AWAY_S = BEAT_S * (MISSES + 0.4)
# What a car holds that couldn't be reached, besides what `motorcade.upload.transfer` tells.
AWAY = "away"
_AGAIN_S = 0.5
_STRANGE_S = 5.0
# How often a drive server's orders and telemetry are looked at.
_ORDER_S = 0.05
# How often an upload begins whose connection breaks, and how long a car may take to be back.
_TRIES = 3
# At so many ports an announced drive server is asked for telemetry.
_TELEMETRY_PORTS = 4
# For so long it may be silent there, so long where it takes keys.
_TELEMETRY_S = 1.0
_TLS_TELEMETRY_S = 3.0
_BACK_S = 5.0


class CarAwayError(TransferError):
    """A car of the list doesn't answer now."""


class NoCarError(TransferError):
    """What answers isn't a car."""


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
    number: int | None
    role: str
    board: str
    version: str
    state: str
    words: int | None
    crc32: str | None
    battery_mv: int | None
    away: bool
    silent_s: float | None
    problem: MotorcadeError | None


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
    error: MotorcadeError | None = None


class Contact:
    """A place where a car may be, asked again and again while ``run`` runs.

    Args:
        place: where it is.
        tls, baud: as of `motorcade.fleet.cars.Cars`.

    Attributes:
        is_known: set once the car has answered, or a try to reach it has failed.
        wanted: STOP or GO until the car has confirmed it: it gets that first when it is back.
        was_reached: whether the last try made a connection; True where that isn't known.
        answered: called with each answer.
        reached: called with the address that the place's host has, ``HOST:PORT``, whenever it is reached.
    """

    def __init__(self, place: Place, tls: ssl.SSLContext | None, baud: int) -> None:
        self.place = place
        self.reached: Callable[[str], None] = lambda address: None
        self.answered: Callable[[], None] = lambda: None
        self.is_known = asyncio.Event()
        self.was_reached = True
        self.wanted = ""
        self._tls = tls
        self._baud = baud
        self._link: Link | None = None
        # Set while the car is connected and answers.
        self._answers = asyncio.Event()
        self._fields: dict[str, str] = {}
        self._heard_s: float | None = None
        self._problem: MotorcadeError | None = None
        self._loads = self._orders = 0

    @property
    def has_answered(self) -> bool:
        """Whether the car has ever answered."""
        return self._heard_s is not None

    @property
    def answers(self) -> bool:
        """Whether the car is connected and answers."""
        return self._answers.is_set()

    @property
    def name(self) -> str:
        """What the car calls itself, else what the list calls it, else where it is."""
        return safe_name(self._fields.get("name", "")) or self.place.name or self.place.address

    def status(self) -> CarStatus:
        """What is known of the car."""
        fields = self._fields
        silent_s = None
        if self._heard_s is not None:
            silent_s = round(monotonic() - self._heard_s, 1)
        texts = {key: safe_name(fields.get(key, "")) for key in ("role", "board", "version", "state")}
        return CarStatus(
            self.name,
            self.place.address,
            self.place.kind,
            number=_number(fields.get("number"), 16),
            **texts,
            words=_number(fields.get("words"), 10),
            crc32=fields["holds"] if _number(fields.get("holds"), 16) is not None else None,
            battery_mv=_number(fields.get("battery"), 10),
            away=silent_s is None or silent_s > AWAY_S or not (self._link or self._loads),
            silent_s=silent_s,
            problem=self._problem,
        )

    def order(self, kind: str) -> None:
        """Send STOP or GO at once, and again until the car confirms it."""
        self.wanted = kind
        self._orders += 1
        if self._link:
            self._send(self._link, kind)

    async def ask(self, kind: str, name: str = "") -> None:
        """Send a request and wait for its answer. Raises MotorcadeError."""
        if self._link:
            answer = self._link.send(kind, name)
            await asyncio.wait([answer], timeout=AWAY_S)
            if answer.done() and not answer.cancelled():
                self._hear(answer.result())
                if not self._problem:
                    return
        raise self._problem or CarAwayError("car-away", car=self.name)

    async def run(self) -> None:
        """Stay connected, and ask again and again until cancelled; return where what nobody named is no car."""
        while True:
            await self.attempt()
            if self.place.found and isinstance(self._problem, NoCarError):
                return
            await asyncio.sleep(self.pause_s)

    @property
    def pause_s(self) -> float:
        """How long until the next try; whoever was no car, by what it said, costs little."""
        if isinstance(self._problem, NoCarError):
            return _STRANGE_S
        return _AGAIN_S

    async def attempt(self) -> None:
        """Connect once, and ask again and again until the connection ends."""
        self.was_reached = False
        try:
            with closing(await connect(self.place, self._tls, self._baud)) as link:
                self.was_reached = True
                if link.address:
                    self.reached(link.address)
                await self._use(link)
        except MotorcadeError as problem:
            self._problem = problem
        finally:
            self._link = None
            self._answers.clear()
            self.is_known.set()

    async def load(self, image: bytes, progress: "Callable[[Contact, int], None]") -> Verdict:
        """Upload ``image``, again where the connection breaks; ``progress`` gets the number of bytes sent so far."""
        holds = AWAY
        error: MotorcadeError | None = None
        for number in range(_TRIES):
            # A car that is known to be away keeps nobody waiting.
            with suppress(TimeoutError):
                async with asyncio.timeout(_BACK_S):
                    await (self._answers if number else self.is_known).wait()
            link = self._link
            if link is None or not self._answers.is_set():
                break
            self._loads += 1
            try:
                transfer = await link.upload(image, partial(progress, self))
            finally:
                self._loads -= 1
            if transfer.holds != OLD or holds == AWAY:
                # What a try before has left isn't old for certain.
                holds = transfer.holds
            if transfer.outcome is None:
                holding = holds_phrase(holds)
                if self.place.host:
                    reason = Phrase("connection-ended")
                    error = TransferError("connection-broke", port=self.name, reason=reason, holds=holding)
                else:
                    error = TransferError("went-away", port=self.name, holds=holding)
                self._answers.clear()
                if link.is_strange:
                    break
                continue
            error = upload_error(self.name, transfer.outcome, holds, in_network=bool(self.place.host))
            if not is_busy(transfer.outcome):
                break
            await asyncio.sleep(BEAT_S)
        if holds == AWAY:
            # What is wrong with a port says more.
            error = (None if self.place.host else self._problem) or CarAwayError("car-away", car=self.name)
        return Verdict(self.name, self.place.address, holds, error)

    async def _use(self, link: Link) -> None:
        """Send heartbeats until the connection ends or the car misses three; then raise MotorcadeError."""
        if not self.place.host:
            await link.settle()
        self._link = link
        missed = 0
        while not (link.is_strange or link.ended.done()) and missed < MISSES:
            heard_s = self._heard_s
            is_asked = not self._loads
            if is_asked:
                self._send(link, self.wanted or ASK)
            await asyncio.wait([link.ended], timeout=BEAT_S)
            if self._loads or not is_asked:
                # Its answers to the upload tell as much.
                self._heard_s = monotonic()
            if self._heard_s == heard_s:
                missed += 1
                self._answers.clear()
                self.is_known.set()
            else:
                missed = 0
        # What has answered once is a car, also while it hangs.
        if link.is_strange or not (self.place.host or link.heard or self.has_answered):
            raise NoCarError("no-car-at-port", port=self.place.address)
        raise CarAwayError("car-away", car=self.name)

    def _send(self, link: Link, kind: str) -> None:
        orders = self._orders

        def take(answer: asyncio.Future[Answer]) -> None:
            if not answer.cancelled():
                self._hear(answer.result())
                # The answer to an order says nothing of the next one, also where that is of the same kind.
                if orders == self._orders and not self._problem:
                    self.wanted = ""

        link.send(kind).add_done_callback(take)

    def _hear(self, answer: Answer) -> None:
        if isinstance(answer, MotorcadeError):
            # It is a car, but one that doesn't know the request.
            self._problem = answer
        else:
            self._fields = answer
            self._problem = None
        self._heard_s = monotonic()
        self.is_known.set()
        self._answers.set()
        self.answered()


class DriveContact(Contact):
    """A drive server: its telemetry is the heartbeat."""

    def __init__(self, place: Place, tls: ssl.SSLContext | None, baud: int) -> None:
        super().__init__(place, tls, baud)
        self._client: DriveClient | None = None
        # Where telemetry may be: whoever announces an address may announce another port than its server does.
        self._telemetry_ports = [place.telemetry_port]

    def add_telemetry_port(self, port: int) -> None:
        """Look for telemetry at this port too, first; of many the oldest is left out, but not the usual one."""
        usual = []
        if self.place.port < LAST_PORT:
            usual = [self.place.port + 1]
        others = [other for other in self._telemetry_ports if other not in (port, *usual)]
        self._telemetry_ports = list(dict.fromkeys([port, *others[: _TELEMETRY_PORTS - 2], *usual]))

    def status(self) -> CarStatus:
        known = super().status()
        telemetry = None
        if self._client:
            telemetry = self._client.telemetry
        if telemetry is None:
            return known
        return known._replace(state=telemetry.state, battery_mv=telemetry.battery_mv, away=False)

    async def ask(self, kind: str, name: str = "") -> None:
        raise TransferError("car-only-drives", car=self.name)

    async def load(self, image: bytes, progress: "Callable[[Contact, int], None]") -> Verdict:
        return Verdict(self.name, self.place.address, OLD, TransferError("car-only-drives", car=self.name))

    @property
    def answers(self) -> bool:
        return bool(self._client and self._client.telemetry)

    async def attempt(self) -> None:
        """Stay connected; return where what nobody named sends no telemetry at any of its ports."""
        for port in list(self._telemetry_ports):
            await self._attempt_at(port)

    async def _attempt_at(self, port: int) -> None:
        place = self.place
        begin_s = monotonic()
        client = self._client = DriveClient(
            place.host, place.port, telemetry_port=port, keys=self._tls, car=place.name if self._tls else None
        )
        client.begin()
        try:
            while not place.found or monotonic() - max(begin_s, self._heard_s or 0.0) < self._patience_s:
                self._problem = client.problem
                if client.telemetry or client.problem:
                    self.is_known.set()
                if client.telemetry:
                    self._heard_s = monotonic()
                    self.answered()
                if client.telemetry and (kind := self.wanted):
                    with suppress(MotorcadeError):
                        if kind == STOP:
                            await client.stop()
                        else:
                            await client.clear()
                        if self.wanted == kind:
                            self.wanted = ""
                if client.is_strange and self.wanted == STOP:
                    # A newer car's telemetry is no reason to let it drive on.
                    with suppress(MotorcadeError, OSError, EOFError):
                        await client.stop_strange()
                if place.found and client.problem and not self.has_answered:
                    return
                await asyncio.sleep(_ORDER_S)
        finally:
            self.is_known.set()
            await client.end()

    @property
    def _patience_s(self) -> float:
        """For how long what nobody named may be silent."""
        if self.has_answered:
            return AWAY_S
        if self._tls:
            return _TLS_TELEMETRY_S
        return _TELEMETRY_S


def _number(text: str | None, base: int) -> int | None:
    """Return the number in a stranger's text, None where it is none of at most eight digits."""
    allowed = "0123456789abcdef"[:base]
    if text and len(text) <= 8 and all(character in allowed for character in text):
        return int(text, base)
    return None
