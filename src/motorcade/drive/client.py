"""A driver's end: drive a car over the network, and connect again when the connection breaks."""

import asyncio
import random
import ssl
from collections.abc import Callable, Coroutine
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from motorcade.config.arguments import to_number, to_whole
from motorcade.drive.connection import (
    Address,
    AwayError,
    CarRefusesError,
    Connection,
    LastingDriveError,
    connected,
    to_error,
)
from motorcade.drive.deadman import FRESH_MS, PERIOD_MS, DeadmanSwitch
from motorcade.drive.keys import client_context
from motorcade.drive.stamps import stamp_at
from motorcade.drive.wire import SessionError, Telemetry, read_telemetry, stick_word
from motorcade.errors import DriveError, MotorcadeError, Phrase
from motorcade.sockets import DRIVE_PORT, LAST_PORT, port_behind
from motorcade.timing import to_ticks
from motorcade.words.formats import switch_words
from motorcade.words.positions import DRIVE_NEUTRAL

FRESH_S = FRESH_MS / 1000
PATIENCE_S = 5.0
_PERIOD_S = PERIOD_MS / 1000
# A car takes 100 commands a second.
_SHORTEST_PERIOD_S = 0.0125
# The car sends telemetry ten times a second. While it doesn't, a command would only wait and arrive too late.
_SILENT_S = 0.5
_LOST_S = 2.0
_FIRST_PAUSE_S = 0.1
_LONGEST_PAUSE_S = 2.0
# A connection that ends sooner counts as none: the car accepted nobody.
_PROVEN_S = 1.0


class DriveClient:
    """Drive a car over the network: ``async with DriveClient("192.168.1.20") as car: ...``.

    The car moves while its driver renews its command: each command of `drive` counts for ``fresh_s`` and is repeated
    meanwhile, 20 times a second; then the car stops. The car also stops by itself when no command comes for 300 ms.

    Args:
        host: name or address of the car.
        port: where it takes commands.
        telemetry_port: where it sends telemetry; ``port`` + 1, unless given; 0 for a car that has none and knows the
            four bytes of a command alone.
        keys: this driver's keys file, where the car requires one (`motorcade drive keys`), or the TLS context that
            `motorcade.drive.keys.client_context` makes of it.
        car: the car's name in its keys, where ``host`` isn't in them.
        fresh_s: how long a command counts, 0.05 to 1.
        rearm: after it stopped by itself a car drives again only after a command with speed 0. A client sends that by
            itself; without ``rearm`` it waits until the caller commands throttle 0 or nothing, as one who releases a
            stick does.
        patience_s: after how long without the car a method raises DriveError. The client connects again and again
            meanwhile, and after that too.

    Attributes:
        telemetry: the latest `Telemetry`; None before the first, and while the car can't be reached.
        you: what the car sent with it about this client: its ``name``, whether it ``drives``, and what became of its
            commands, by the names of `motorcade.drive.wire.COUNTS`.
        is_strange: whether the car has ever sent telemetry that isn't ours, which ends the connection.

    Raises:
        MotorcadeError: an argument isn't allowed, ``keys`` can't be used, or there is no port for telemetry.
    """

    def __init__(
        self,
        host: str,
        port: int = DRIVE_PORT,
        *,
        telemetry_port: int | None = None,
        keys: Path | str | ssl.SSLContext | None = None,
        car: str | None = None,
        fresh_s: float = FRESH_S,
        rearm: bool = True,
        patience_s: float | None = None,
    ) -> None:
        fresh_s = to_number("fresh_s", fresh_s, _PERIOD_S, 1)
        port = to_whole("port", port, 1, LAST_PORT)
        if isinstance(keys, Path | str):
            keys = client_context(Path(keys))
        if telemetry_port is None:
            telemetry_port = port_behind(port)
        if keys and not telemetry_port:
            raise MotorcadeError("keys-need-telemetry")
        self._address = Address(host, port, telemetry_port or None, keys, (car or host) if keys else None)
        self._patience_s = PATIENCE_S if patience_s is None else patience_s
        self._switch = DeadmanSwitch(round(fresh_s * 1000), rearm)
        self.telemetry: Telemetry | None = None
        self.you: dict[str, Any] = {}
        self.is_strange = False
        self._connection: Connection | None = None
        self._changed = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._problem: DriveError | None = None
        self._was_reached = False
        # Whether the car has sent telemetry since the connection began.
        self._has_telemetry = False
        # Whether the car knows by a clock that this client has answered which of its words are old.
        self._has_answered = False
        self._former_name = ""
        # Whether it has given the wheel back and commanded nothing since.
        self._has_released = False
        self._away_since_s = self._begun_s = self._received_s = self._sent_s = 0.0

    async def __aenter__(self) -> Self:
        """Connect. Raises DriveError where that fails."""
        self.begin()
        try:
            await self._until(lambda: self.connected)
        except BaseException:
            await self.end()
            raise
        return self

    async def __aexit__(self, *_: object) -> None:
        """Stop the car and hang up."""
        await self.end()

    def begin(self) -> None:
        """Connect in the background, now or whenever the car can be reached; `problem` tells how it goes."""
        self._away_since_s = _now_s()
        self._task = asyncio.create_task(self._stay_connected())

    async def end(self) -> None:
        """Stop the car and hang up."""
        if self._connection and self._sent_s:
            self._connection.send(self._stamped(stick_word(0, 0)))
        if self._task:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    @property
    def problem(self) -> DriveError | None:
        """Why the car can't be reached now; None while it sends telemetry, and until the first try has failed."""
        if self.telemetry or self._problem is None:
            return None
        return self._away()

    @property
    def silent_ms(self) -> int:
        """Time since the last telemetry of a car that is connected."""
        return round(self._silent_s() * 1000)

    @property
    def connected(self) -> bool:
        """Whether the car can be reached now."""
        return self._connection is not None

    @property
    def waits_for_release(self) -> bool:
        """Whether the car stopped by itself and stands still until the caller releases the stick (see ``rearm``)."""
        return self._switch.is_locked

    async def drive(self, throttle: float = 0.0, steering: float = 0.0, **switches: int) -> None:
        """Command the car for the next ``fresh_s``, unless another command comes first.

        Args:
            throttle: -1 full speed back, 0 standing still, 1 full speed ahead.
            steering: -1 full left, 0 straight on, 1 full right.
            switches: what else the car has (`telemetry.switches`), by name: 1 or True switches it on, 0 off. A horn is
                on for the time of the command; others stay on until they are switched off, or this client leaves.

        Raises:
            ValueError: one of the axes is out of range.
            MotorcadeError: no car has such a switch.
            DriveError: the car could not be reached for longer than ``patience_s``.
        """
        self.steer(throttle, steering, **switches)
        if lost := self._lost():
            raise lost

    def steer(self, throttle: float, steering: float, **switches: int) -> None:
        """Do what `drive` does; a car that can't be reached is no error. Raises ValueError, MotorcadeError."""
        # These raise where an axis is out of range, or no such switch is known.
        stick_word(throttle, steering)
        switch_words(switches, {})
        self._has_released = False
        self._switch.command(throttle, steering, _ticks(), switches)
        if _now_s() - self._sent_s >= _SHORTEST_PERIOD_S:
            self._send()

    async def drive_for(self, seconds: float, throttle: float = 0.0, steering: float = 0.0, **switches: int) -> None:
        """Command the same for a time, then to stand still. Raises what `drive` raises.

        The time begins when the car may move: not before it has asked for this client's clock.
        """
        if not self._may_move:
            await self.drive()
            patient_until_s = _now_s() + self._patience_s
            await self._until(lambda: self._may_move or _now_s() > patient_until_s)
        end_s = _now_s() + seconds
        try:
            while (left_s := end_s - _now_s()) > 0:
                await self.drive(throttle, steering, **switches)
                await asyncio.sleep(min(left_s, _PERIOD_S))
        finally:
            self._switch.command(0, 0, _ticks())
            self._send()

    async def next_telemetry(self) -> Telemetry:
        """The telemetry that comes next. Raises DriveError where none comes for ``patience_s``."""
        last = self.telemetry
        # By identity: a car at rest may send equal telemetry again.
        await self._until(lambda: self.telemetry is not None and self.telemetry is not last)
        return self.telemetry  # type: ignore[return-value]

    async def request(self) -> bool:
        """Ask for the wheel: True where this client has it now; else it comes when the driver stops or leaves.

        Raises:
            DriveError: the car can't be reached or refuses; the following methods raise it too.
        """
        return bool((await self._ask("request")).get("has_wheel"))

    async def release(self) -> None:
        """Give the wheel back, or stop waiting for it."""
        self._switch.order()
        self._has_released = True
        await self._ask("release")

    async def stop(self) -> None:
        """Emergency stop: nothing moves until `clear`."""
        self._switch.order()
        await self._ask("stop")

    async def stop_strange(self) -> None:
        """Stop a car whose telemetry isn't ours; nobody learns whether it did. Raises DriveError, OSError."""
        async with connected(self._address) as connection, asyncio.timeout(_SILENT_S):
            await connection.ask(do="stop")

    async def clear(self) -> None:
        """Lift the emergency stop."""
        await self._ask("clear")

    async def resume_program(self) -> None:
        """Make the car run its image again."""
        self._switch.order()
        await self._ask("resume")

    async def _stay_connected(self) -> None:
        pause_s = _FIRST_PAUSE_S
        while True:
            self._has_telemetry = False
            try:
                async with connected(self._address, takes_keys=self._was_reached) as connection:
                    self._connection = connection
                    self._has_answered = False
                    self._begun_s = self._received_s = _now_s()
                    self._switch.lose()
                    self._changed.set()
                    await self._use(connection)
            except (OSError, EOFError, ValueError, SessionError, DriveError) as problem:
                self._problem = to_error(self._address, problem, self._has_telemetry)
            was_proven = self._is_proven
            self._was_reached |= was_proven or self._has_telemetry
            if was_proven:
                self._away_since_s = _now_s()
                pause_s = _FIRST_PAUSE_S
            self._connection = self.telemetry = None
            # Random, so that the drivers of a car that is switched on again don't all connect at once.
            await asyncio.sleep(pause_s * random.uniform(0.5, 1.0))
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)

    async def _use(self, connection: Connection) -> None:
        """Drive by ``connection`` until it ends, which raises."""
        parts: list[Coroutine[Any, Any, object]] = [connection.ended(), self._repeat()]
        if self._address.telemetry_port is not None:
            parts.append(self._receive(connection))
        tasks: list[asyncio.Future[Any]] = [asyncio.ensure_future(part) for part in parts]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            if done == {tasks[0]} and len(tasks) > 2:
                # A car that hangs up the connection for commands gives its reason as the answer to a request.
                tasks.append(asyncio.ensure_future(connection.ask(do="release")))
                await asyncio.wait(tasks[2:], return_when=asyncio.FIRST_COMPLETED)
            reasons = [task.exception() for task in tasks if task.done()]
            raise next((reason for reason in reasons if isinstance(reason, CarRefusesError)), reasons[0]) or EOFError
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _repeat(self) -> None:
        while True:
            if self._silent_s() > _LOST_S:
                raise TimeoutError
            rest_s = self._sent_s + _PERIOD_S - _now_s()
            if rest_s <= 0:
                self._send()
                rest_s = _PERIOD_S
            await asyncio.sleep(rest_s)

    async def _receive(self, connection: Connection) -> None:
        async for frame in connection.telemetry():
            self._received_s = _now_s()
            self._has_telemetry = True
            try:
                self.telemetry, you = read_telemetry(frame)
            except ValueError:
                self.is_strange = True
                raise
            self._note_self(you, connection)
            if self.telemetry.state in ("failsafe", "disarmed"):
                self._switch.receive_failsafe(_ticks())
            if (clock := self.you.get("clock")) is not None:
                connection.answer_clock(clock, _stamp())
                self._switch.stand_first()
                self._has_answered = True
            self._changed.set()

    def _note_self(self, you: dict[str, Any], connection: Connection) -> None:
        """Keep what the car sends about this client; ask for the wheel that a former connection still has."""
        if self.you.get("drives") and you.get("name") != self.you.get("name"):
            self._former_name = self.you.get("name", "")
        self.you = you
        driver = self.telemetry and self.telemetry.driver
        if you and driver == self._former_name and not you.get("drives"):
            self._former_name = ""
            connection.send_request(do="request")
        if self._has_released and you.get("drives"):
            # A command of before, by the other connection, came later than the request and took the wheel again.
            connection.send_request(do="release")

    def _send(self) -> None:
        """Send what is due now, if it would arrive now."""
        if self._connection is None or not self._connection.is_free or self._silent_s() > _SILENT_S:
            return
        axes = self._switch.next(_ticks())
        if axes is not None:
            self._sent_s = _now_s()
            if not self._may_move:
                self._connection.send(self._stamped(DRIVE_NEUTRAL))
                return
            self._connection.send(self._stamped(stick_word(*axes)))
            present = {}
            if self.telemetry:
                present = self.telemetry.switches
            for word in switch_words(self._switch.switches(_ticks()), present):
                self._connection.send(self._stamped(word))

    @property
    def _may_move(self) -> bool:
        """Whether the car would find a word that comes late. Its first word opens the session in which a car asks."""
        knows_no_clock = bool(self.you) and "clock" not in self.you
        return self._has_answered or knows_no_clock or self._address.telemetry_port is None

    def _stamped(self, word: int) -> int:
        """A word with its stamp, which only a car with telemetry can ask to be answered for after a silence."""
        if self._address.telemetry_port is None:
            return word
        return word | _stamp()

    @property
    def _is_proven(self) -> bool:
        """Whether there is a connection that the car didn't end as soon as it had begun."""
        is_answered = self._has_telemetry or self._address.telemetry_port is None
        return self._connection is not None and is_answered and _now_s() - self._begun_s >= _PROVEN_S

    def _silent_s(self) -> float:
        """Time since the last telemetry; 0 where the car sends none."""
        if self._address.telemetry_port is None:
            return 0.0
        return _now_s() - self._received_s

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

    def _lost(self) -> DriveError | None:
        """The error, once it lasts longer than the caller's patience, or is final."""
        if self._task and self._task.done():
            # Raises an error of this program that ended the task.
            self._task.result()
        if self._is_proven:
            return None
        if isinstance(self._problem, LastingDriveError) and not self._was_reached:
            return self._problem
        is_late = self._problem is not None or self._connection is None
        if is_late and _now_s() - self._away_since_s > self._patience_s:
            return self._away()
        return None

    def _away(self) -> DriveError:
        if self._problem and (not self._was_reached or isinstance(self._problem, CarRefusesError)):
            return self._problem
        seconds = f"{_now_s() - self._away_since_s:.0f}"
        detail = (self._problem and self._problem.details.get("detail")) or Phrase("gives-no-answer")
        return AwayError("away", car=str(self._address), seconds=seconds, detail=detail)


def _ticks() -> int:
    return to_ticks(_now_s())


def _stamp() -> int:
    return stamp_at(int(_now_s() * 1000))


def _now_s() -> float:
    """The time of the running event loop, so that a test's loop may have a clock of its own."""
    return asyncio.get_running_loop().time()
