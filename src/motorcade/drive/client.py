"""A driver's end: steers a car over the network, and starts over when the connection breaks."""

import asyncio
import random
import ssl
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from motorcade.drive.car_failures import CarAwayError, CarError, CarRefusesError
from motorcade.drive.command_stream import CommandStream
from motorcade.drive.connection import Address, Connection, connected, failure
from motorcade.drive.input.stick import stick_word
from motorcade.drive.telemetry import Telemetry
from motorcade.drive.tls.keys import client_context
from motorcade.words.ticks import TICKS_MASK

DRIVE_PORT = 5005
FRESH_S, PATIENCE_S = 0.3, 5.0
_PERIOD_S = 0.05
# A car takes 100 commands a second.
_SHORTEST_PERIOD_S = 0.0125
_CONNECT_S = 3.0
# The car tells ten times a second. What is sent while it doesn't would only wait, and come too late.
_SILENT_S, _LOST_S = 0.5, 2.0
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.1, 2.0
# With these nothing gets better by trying again.
_FOR_GOOD = ("no-such-host", "not-trusted")
# A connection that ended sooner was none: the car let nobody in.
_PROVEN_S = 1.0


class DriveClient:
    """A car that is steered over the network: ``async with DriveClient("192.168.1.20") as car: ...``.

    The car moves as long as its driver keeps saying so: each wish of `drive` counts for ``fresh_s`` and is repeated
    meanwhile, 20 times a second; then the car stops. It stops by itself too when it hears nothing for 300 ms.

    Args:
        host: name or address of the car.
        port: where it takes commands.
        telemetry_port: where it tells what it does; the one behind ``port``, unless given.
        bare: the car knows the four bytes of a command alone, and tells nothing.
        keys: this driver's keys file, where the car wants one (`motorcade drive keys`), or what
            `motorcade.drive.tls.keys.client_context` makes of it.
        car: the car's name in its keys, where ``host`` isn't in them.
        fresh_s: how long a wish counts, 0.05 to 1.
        rearm: after it stopped by itself a car drives again only after a command with speed 0. A client sends that by
            itself; without ``rearm`` it waits for a wish of throttle 0 or none, as of a hand that lets go of a stick.
        patience_s: a car that has been away for longer is an error. The client tries again and again meanwhile, and
            after that too.

    Attributes:
        telemetry: the latest `Telemetry`; None before the first, and while the car is away.
        you: what the car said with it of this client: its ``name``, whether it ``drives``, and what became of its
            commands, as `motorcade.drive.telemetry.Counts` names it.

    Raises:
        KeysError: ``keys`` can't be used.
    """

    def __init__(
        self,
        host: str,
        port: int = DRIVE_PORT,
        *,
        telemetry_port: int | None = None,
        bare: bool = False,
        keys: Path | str | ssl.SSLContext | None = None,
        car: str | None = None,
        fresh_s: float = FRESH_S,
        rearm: bool = True,
        patience_s: float | None = None,
    ) -> None:
        if not _PERIOD_S <= fresh_s <= 1:
            raise ValueError(f"fresh_s is {fresh_s!r}; allowed: {_PERIOD_S} to 1")
        tls = client_context(Path(keys)) if isinstance(keys, Path | str) else keys
        tells_at = None if bare else telemetry_port or port + 1
        self._address = Address(host, port, tells_at, tls, (car or host) if tls else None)
        self._patience_s = PATIENCE_S if patience_s is None else patience_s
        self._helm = CommandStream(round(fresh_s * 1000), rearm)
        self.telemetry: Telemetry | None = None
        self.you: dict[str, Any] = {}
        self._connection: Connection | None = None
        self._changed = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._problem: CarError | None = None
        self._had_it = False
        self._former_name = ""
        self._away_since_s = self._begun_s = self._heard_s = self._sent_s = 0.0

    async def __aenter__(self) -> Self:
        """Connect. Raises CarError where that fails."""
        self.begin()
        try:
            await self._until(lambda: self.connected)
        except BaseException:
            await self.end()
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop the car and hang up."""
        await self.end()

    def begin(self) -> None:
        """Connect, now or whenever the car is there, for who doesn't wait and looks at ``problem``; then `end` it."""
        self._away_since_s = time.monotonic()
        self._task = asyncio.create_task(self._stay_connected())

    async def end(self) -> None:
        """Stop the car and hang up."""
        if self._connection and self._sent_s:
            self._connection.send(stick_word(0, 0))
        if self._task:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    @property
    def problem(self) -> CarError | None:
        """Why the car can't be reached now; None while it tells of itself, and until the first try has failed."""
        return None if self.telemetry or self._problem is None else self._away()

    @property
    def silent_ms(self) -> int:
        """For how long a car that is connected has told nothing."""
        return round(self._silent_s() * 1000)

    @property
    def connected(self) -> bool:
        """Whether the car can be reached now."""
        return self._connection is not None

    @property
    def waits_for_release(self) -> bool:
        """Whether the car stopped by itself and stands until the caller has let go (see ``rearm``)."""
        return self._helm.waits_for_release

    async def drive(self, throttle: float = 0.0, steering: float = 0.0) -> None:
        """Wish what the car does for the next ``fresh_s``, unless another wish comes first.

        Args:
            throttle: -1 full speed back, 0 standing still, 1 full speed ahead.
            steering: -1 full left, 0 straight on, 1 full right.

        Raises:
            ValueError: one of them is out of range.
            CarError: the car has been away for longer than ``patience_s``.
        """
        self.wish(throttle, steering)
        if lost := self._lost():
            raise lost

    def wish(self, throttle: float, steering: float) -> None:
        """As `drive`, but that a car which is away is no error. Raises ValueError."""
        self._helm.wish(stick_word(throttle, steering), _now_ms())
        if time.monotonic() - self._sent_s >= _SHORTEST_PERIOD_S:
            self._send()

    async def drive_for(self, seconds: float, throttle: float = 0.0, steering: float = 0.0) -> None:
        """Wish the same for so long, then to stand still. Raises what `drive` raises."""
        end_s = time.monotonic() + seconds
        try:
            while (left_s := end_s - time.monotonic()) > 0:
                await self.drive(throttle, steering)
                await asyncio.sleep(min(left_s, _PERIOD_S))
        finally:
            self._helm.wish(stick_word(0, 0), _now_ms())
            self._send()

    async def next_telemetry(self) -> Telemetry:
        """What the car tells next. Raises CarError where it tells nothing for ``patience_s``."""
        last = self.telemetry
        # A car at rest may tell the same again.
        await self._until(lambda: self.telemetry is not None and self.telemetry is not last)
        return self.telemetry  # type: ignore[return-value]

    async def request(self) -> bool:
        """Ask for the wheel: True where this client has it now; else it comes when the driver stands still or leaves.

        Raises:
            CarError: the car is away or says no; so do the following.
        """
        return bool((await self._ask("request")).get("has_wheel"))

    async def release(self) -> None:
        """Give the wheel back, or wait for it no longer."""
        self._helm.drop()
        await self._ask("release")

    async def stop(self) -> None:
        """Emergency stop: nothing moves until somebody says `clear`."""
        self._helm.drop()
        await self._ask("stop")

    async def clear(self) -> None:
        """Lift the emergency stop."""
        await self._ask("clear")

    async def resume_program(self) -> None:
        """Let the car run its image of codewords again."""
        self._helm.drop()
        await self._ask("resume")

    async def _stay_connected(self) -> None:
        pause_s = _FIRST_PAUSE_S
        while True:
            try:
                async with connected(self._address, _CONNECT_S) as connection:
                    self._begin(connection)
                    await self._use(connection)
            except (OSError, EOFError, ValueError, CarError) as problem:
                self._problem = failure(self._address, problem, self._has_spoken)
            if self._end():
                pause_s = _FIRST_PAUSE_S
            # Cars that are switched on again are not met by all of their drivers in one moment.
            await asyncio.sleep(pause_s * random.uniform(0.5, 1.0))
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)

    def _begin(self, connection: Connection) -> None:
        self._connection = connection
        self._begun_s = self._heard_s = time.monotonic()
        self._helm.disarm()
        connection.join()
        self._changed.set()

    def _end(self) -> bool:
        """The connection is over: whether it was one."""
        was_one = self._is_proven
        if was_one:
            self._away_since_s = time.monotonic()
        self._had_it |= was_one or self._has_spoken
        self._connection = self.telemetry = None
        self._changed.set()
        return was_one

    async def _use(self, connection: Connection) -> None:
        """Drive by ``connection`` until it ends, which raises."""
        parts: list[Coroutine[Any, Any, object]] = [connection.ended(), self._repeat()]
        if self._address.telemetry_port is not None:
            parts.append(self._hear(connection))
        tasks: list[asyncio.Future[Any]] = [asyncio.ensure_future(part) for part in parts]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            if done == {tasks[0]} and len(tasks) > 2:
                # A car that hangs up where it takes commands says why where it is asked; a seat is needed to ask.
                tasks.append(asyncio.ensure_future(connection.ask(do="release")))
                await asyncio.wait(tasks[2:], return_when=asyncio.FIRST_COMPLETED)
            reasons = [task.exception() for task in tasks if task.done()]
            raise next((each for each in reasons if isinstance(each, CarRefusesError)), reasons[0]) or EOFError
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _repeat(self) -> None:
        while True:
            now_s = time.monotonic()
            if self._silent_s() > _LOST_S:
                raise TimeoutError
            rest_s = self._sent_s + _PERIOD_S - now_s
            if rest_s <= 0:
                self._send()
                rest_s = _PERIOD_S
            await asyncio.sleep(rest_s)

    async def _hear(self, connection: Connection) -> None:
        async for told in connection.told():
            self._heard_s = time.monotonic()
            self.telemetry = Telemetry(*(told.get(name) for name in Telemetry._fields))  # type: ignore[arg-type]
            self._note_self(told.get("you") or {}, connection)
            if self.telemetry.state == "failsafe":
                self._helm.hear_failsafe(_now_ms())
            self._changed.set()

    def _note_self(self, you: dict[str, Any], connection: Connection) -> None:
        """Take note of what the car says of this client, and take over from what it was before the connection broke."""
        if self.you.get("drives") and you.get("name") != self.you.get("name"):
            self._former_name = self.you["name"]
        self.you = you
        driver = self.telemetry and self.telemetry.driver
        if you and driver == self._former_name and not you.get("drives"):
            self._former_name = ""
            connection.ask_only(do="request")

    def _send(self) -> None:
        """Send what is to be sent now, if it would arrive now."""
        if self._connection is None or not self._connection.is_free or self._silent_s() > _SILENT_S:
            return
        word = self._helm.next_word(_now_ms())
        if word is not None:
            self._sent_s = time.monotonic()
            self._connection.send(word)

    @property
    def _has_spoken(self) -> bool:
        """Whether the car has told anything since the connection began."""
        return self._heard_s > self._begun_s

    @property
    def _is_proven(self) -> bool:
        """Whether there is a connection that the car didn't end as soon as it had begun."""
        speaks = self._has_spoken or self._address.telemetry_port is None
        return self._connection is not None and speaks and time.monotonic() - self._begun_s >= _PROVEN_S

    def _silent_s(self) -> float:
        """For how long the car has told nothing, where it tells anything."""
        return 0.0 if self._address.telemetry_port is None else time.monotonic() - self._heard_s

    async def _ask(self, what: str) -> dict[str, Any]:
        if self._connection is None:
            raise self._away()
        return await self._connection.ask(do=what)

    async def _until(self, condition: Callable[[], bool]) -> None:
        while not condition():
            if lost := self._lost():
                raise lost
            self._changed.clear()
            with suppress(TimeoutError):
                async with asyncio.timeout(_PERIOD_S):
                    await self._changed.wait()

    def _lost(self) -> CarError | None:
        """What is wrong, once it is for longer than the caller's patience, or for good."""
        if self._task and self._task.done():
            # A fault of ours is the caller's to see.
            self._task.result()
        if self._is_proven:
            return None
        if self._problem and self._problem.code in _FOR_GOOD and not self._had_it:
            return self._problem
        is_late = self._problem is not None or self._connection is None
        return self._away() if is_late and time.monotonic() - self._away_since_s > self._patience_s else None

    def _away(self) -> CarError:
        if self._problem and (not self._had_it or isinstance(self._problem, CarRefusesError)):
            return self._problem
        seconds = f"{time.monotonic() - self._away_since_s:.0f}"
        figures = self._problem.figures if self._problem else {}
        return CarAwayError("away", car=str(self._address), seconds=seconds, detail=figures.get("detail", "no answer"))


def _now_ms() -> int:
    return int(time.monotonic() * 1000) & TICKS_MASK
