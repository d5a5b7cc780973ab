"""Control of one car: the object that sockets and pages share, and their sessions. No sockets here.

Theory of operation: One `CarControl` stands for the car. Whoever drives or watches it, by a socket or by a page, has a
`ControlSession` of it. Three parts of it decide, each in one place:

- *Places.* A session takes one of nine places with its first command or request, not by looking. Where all are taken,
  `CarControl._who_gives_way` names the session that loses its own. So nobody can fill the car with silent
  connections, and a client with many sessions loses one of them before another client does.
- *Age and rate.* `CarControl.apply` asks `Freshness` whether a word was sent long ago, then the session's rate. A
  command that stops or switches off is never over the rate, since it makes nothing worse.
- *The wheel.* The `Arbiter` is a table of states. It knows sessions as numbers and says whose commands drive.

A command passes through these three, in this order, and its outcome is an index of `OUTCOMES`, which its client is
told. Whatever may have changed the arbiter ends in `CarControl._follow`: it makes wheels and switches do what the
arbiter's state asks for, and writes into the log who drives. So no path can change who drives and leave the wheels as
they were.

Three things stop the wheels when no command does. The arbiter's failsafe ends a command that nobody renews: `beat`,
called by the loop that takes the commands, asks it at least every 50 ms. If that loop is stuck, `watch`, called by
another thread, finds the last beat old; it stops the wheels, and commands that wait in the loop's buffers are old by
then, so a command with speed 0 has to arm the car. If a thread hangs in the hardware's driver and holds the lock,
`watch` doesn't wait for it: it sets the board to neutral at once.

Every method may be called from any thread: one lock guards sessions, arbiter and wheels. What is called back
(``replaced``, ``left``) is called without it. `CarControl.beat` has to be called in time, as
`motorcade.drive.server.watched` does.
"""

import threading
from collections import Counter
from collections.abc import Callable
from itertools import count
from typing import Any, TypeVar

from motorcade.car.arbiter import APPLIED, FAILSAFE, MOVING, STATES, WATCHING, Arbiter
from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import Profile
from motorcade.drive.activity_log import Record
from motorcade.drive.motors import NEUTRAL_SETPOINT, Command, Setpoint, Switchboard, Wheels, command_in
from motorcade.drive.stamps import STAMP_MASK, Freshness
from motorcade.drive.wire import COUNTS, NO_HARDWARE, OUTCOMES, OVER_RATE, STALE, SessionError, Telemetry, stick_word
from motorcade.timing import RateLimit
from motorcade.words.field import WordError
from motorcade.words.formats import switch_words
from motorcade.words.ticks import elapsed_ms

MOST_SESSIONS = 9
_RATE_WINDOW_MS = 100
_LOCK_PATIENCE_S = 0.05

_Result = TypeVar("_Result")


class CarControl:
    """A car that is driven; its ``board`` is set to neutral, which raises OSError where the hardware isn't there.

    ``clock`` gives the time in ms that wraps (`motorcade.words.ticks`).

    Attributes:
        board: its hardware.
        wheels, switchboard: what was done with the board's wheels, and what is switched on beside them.
        limits: those of the car's profile.
        clock: gives the time.
        arbiter: says who drives; only this class changes it.
        refused: number of words that were no DRIVE words.
        turned_away: number of connections that got or kept no place.
        numbers: of the next sessions.
        record: is told who drives, stops and clears, see `motorcade.drive.activity_log.Record`.
    """

    def __init__(self, board: DriveBoard, clock: Callable[[], int], profile: Profile) -> None:
        self.board = board
        self.clock = clock
        self.limits = profile.drive
        self.arbiter = Arbiter(profile.drive.failsafe_ms, profile.drive.hand_over_ms, profile.drive.arming)
        self._state = self.arbiter.state
        self._setpoint: Setpoint = NEUTRAL_SETPOINT
        self._lock = threading.Lock()
        self._sessions: dict[int, ControlSession] = {}
        self.refused = self.turned_away = 0
        self._failsafes = self._stalls = 0
        self.numbers = count(1)
        self._beat_ms: int | None = None
        self._is_stuck = self._is_closed = False
        self.wheels = Wheels(board, profile, clock())
        self.switchboard = Switchboard(board, profile.drive.failsafe_ms)
        self._recorded_driver: ControlSession | None = None
        self.record: Record = lambda did, who: None

    def take_place(self, session: "ControlSession") -> None:
        """Give a session one of the nine places, unless it has one or is over. Raises SessionError: "full"."""
        with self._lock:
            if session.has_place or session.is_over or self._is_closed:
                return
            if loser := self._who_gives_way(session):
                self._end(loser)
            session.commanded_ms, session.has_place = self.clock(), True
            self._sessions[session.number] = session
        if loser:
            loser.replaced()

    def _who_gives_way(self, newcomer: "ControlSession") -> "ControlSession | None":
        """The session that gives its place to a newcomer; None where a place is free. Raises SessionError: "full".

        Where all are taken it is the one that sent no command for longest, if that is more than ``hand_over_ms``; else
        one of the client that has the most, but not the driver's, if that client has two more than the newcomer. A
        session that only watches replaces none for its silence, and while nobody drives one place is kept for a driver.
        """
        sessions, driver = list(self._sessions.values()), self.arbiter.driver
        if len(sessions) + (newcomer.watches and not driver) < MOST_SESSIONS:
            return None
        longest = max(sessions, key=lambda session: session.silent_ms)
        if not newcomer.watches and longest.silent_ms > self.limits.hand_over_ms:
            return longest
        places = Counter(session.client for session in sessions)
        most = max(places.values())
        if most < places[newcomer.client] + 2:
            raise SessionError("full", sessions=MOST_SESSIONS)
        others = [session for session in sessions if places[session.client] == most and session.number != driver]
        return max(others, key=lambda session: session.silent_ms)

    def change(self, session: "ControlSession | None", action: Callable[[Arbiter, int], _Result]) -> _Result | None:
        """Call ``action`` with the arbiter and the time, and make the wheels follow; not where ``session`` is over.

        Returns what ``action`` returns, or None.
        """
        with self._lock:
            if session and not session.has_place:
                return None
            result = action(self.arbiter, self.clock())
            self._follow()
            return result

    def apply(self, session: "ControlSession", word: int, command: Command, number: int) -> int:
        """Take the command ``number`` of ``session``. Returns its outcome, see `motorcade.drive.wire.OUTCOMES`."""
        if isinstance(command, dict):
            is_off = not any(command.values())
        else:
            is_off = command[2] == 0
        with self._lock:
            now = self.clock()
            if not session.freshness.is_fresh(word & STAMP_MASK, now, number, is_off, isinstance(command, tuple)):
                return STALE
            session.commanded_ms = now
            if not session.has_place:
                return WATCHING
            # A command that stops or switches off is never over the rate.
            if not is_off and not session.rate.allows(now):
                return OVER_RATE
            if isinstance(command, dict):
                outcome = self.arbiter.may_switch(session.number, now)
                if outcome == APPLIED and not self.switchboard.command(command, session.number, now):
                    outcome = NO_HARDWARE
            else:
                outcome = self.arbiter.command(session.number, word & ~STAMP_MASK, now)
                if outcome == APPLIED:
                    self._setpoint = command
            self._follow(outcome == APPLIED and isinstance(command, tuple))
            return outcome

    def end(self, session: "ControlSession") -> None:
        """Take a session's place: the wheels stand still if it moved them. A second call does nothing."""
        with self._lock:
            self._end(session)

    def _end(self, session: "ControlSession") -> None:
        if self._sessions.pop(session.number, None):
            session.has_place = False
            self.switchboard.leave(session.number)
            self.arbiter.gone(session.number, self.clock())
            self._follow()

    def telemetry(self) -> Telemetry:
        """What the car does now."""
        with self._lock:
            now, arbiter = self.clock(), self.arbiter
            self.wheels.read_battery(now)
            driver, wanted_by = (self._sessions.get(number) for number in (arbiter.driver, arbiter.wanted_by))
            return Telemetry(
                STATES[arbiter.state][0],
                *self.wheels.applied,
                driver.name if driver else None,
                wanted_by.name if wanted_by else None,
                elapsed_ms(now, arbiter.commanded_ms) if driver else None,
                self.wheels.battery_mv,
                len(self._sessions) - (driver is not None),
                self.refused,
                self._failsafes,
                self._stalls,
                self.wheels.faults,
                self.wheels.last_fault,
                self.turned_away,
                dict(self.switchboard.values),
                self.wheels.limiter.obstacle_mm,
            )

    def beat(self) -> int:
        """Do what is due, and record that the loop that takes the commands is alive; at least every 50 ms.

        Returns after how many ms something can be due next.
        """
        with self._lock:
            self._beat_ms = now = self.clock()
            self._is_stuck = False
            rest_ms = min(self.arbiter.tick(now), self._follow())
            self.wheels.keep_alive()
        return rest_ms

    def watch(self) -> int:
        """Do what is due; where the last `beat` is older than the profile's ``watchdog_ms``, stop the wheels.

        Returns what `beat` returns. The commands that a stuck loop then finds in its buffers are old: a command with
        speed 0 has to arm the car, unless it stood and nobody drove.
        """
        if not self._lock.acquire(timeout=_LOCK_PATIENCE_S):
            # The thread that holds the lock hangs in the hardware's driver.
            self.board.neutral()
            return 0
        try:
            now = self.clock()
            rest_ms = self.arbiter.tick(now)
            if self._beat_ms is None:
                late_ms = 0
            else:
                late_ms = elapsed_ms(now, self._beat_ms)
            if late_ms >= self.limits.watchdog_ms:
                self._stalls += not self._is_stuck
                self._is_stuck = True
                self.arbiter.delay()
            return min(rest_ms, self._follow(), max(1, self.limits.watchdog_ms - late_ms))
        finally:
            self._lock.release()

    def fail(self, problem: Exception, stops: bool = True) -> None:
        """Count a fault; one of what watches over the wheels ``stops`` them: then speed 0 has to arm the car."""
        with self._lock:
            self.wheels.count_fault(problem)
            if stops:
                self.arbiter.stall()
                self._follow()

    def close(self) -> None:
        """End all sessions, stop the wheels and free the hardware. Raises OSError where the wheels don't stop."""
        with self._lock:
            for session in list(self._sessions.values()):
                self._end(session)
            self._is_closed = True
            self._beat_ms = None
            self.arbiter.stop()
            self._follow()
            self.board.close()

    def _follow(self, is_fresh: bool = False) -> int:
        """Make the wheels follow the arbiter; ``is_fresh``: there is a new setpoint.

        Returns after how many ms the limits are due again.
        """
        arbiter = self.arbiter
        self._failsafes += arbiter.state == FAILSAFE and self._state == MOVING
        rest_ms = self.wheels.follow(arbiter, self._setpoint, self.clock(), is_fresh)
        rest_ms = min(rest_ms, self.switchboard.follow(arbiter, self.clock(), self.wheels.count_fault))
        self._state = arbiter.state
        driver = self._sessions.get(arbiter.driver)
        if driver is not self._recorded_driver:
            for did, session in (("ends", self._recorded_driver), ("drives", driver)):
                if session:
                    self.record(did, session.name)
            self._recorded_driver = driver
        return rest_ms


class ControlSession:
    """One who drives or watches a car.

    It takes a place at the car with its first command or request, so who only looks takes none from others. One that
    has lost its place to others takes one again in the same way.

    Args:
        control: the car.
        name: what others are shown.
        client: the name in the client's certificate, or its address: where places are short, no client keeps many.
        watches: for a session that won't drive; while nobody drives one place is kept for a driver.
        replaced: called, in the thread of the newcomer, when the session has lost its place.
        left: called when it leaves.

    Attributes:
        number: from 1, never given twice.
        rate: of commands that move the car.
        counts: what became of its words, by the names of COUNTS; ``last_refusal``: why the last one was refused.
        freshness: finds its words that were sent long ago.
        commanded_ms: when it last sent a valid command (ticks); when it took its place, before the first.
        has_place: whether it drives or watches, rather than only looks.
        is_over: whether it has left.
    """

    def __init__(
        self,
        control: CarControl,
        name: str,
        client: str = "",
        *,
        watches: bool = False,
        replaced: Callable[[], None] = lambda: None,
        left: Callable[[], None] = lambda: None,
    ) -> None:
        self.number = next(control.numbers)
        self.name, self.client, self.watches = name, client, watches
        self.replaced, self._left = replaced, left
        self.rate = RateLimit(max(1, control.limits.commands_per_s * _RATE_WINDOW_MS // 1000), _RATE_WINDOW_MS)
        self.counts = dict.fromkeys(COUNTS, 0)
        self.last_refusal = ""
        self.commanded_ms = control.clock()
        self.freshness = Freshness(control.limits.stale_ms)
        self.has_place = self.is_over = False
        self._control = control

    @property
    def drives(self) -> bool:
        """Whether it has the wheel."""
        return self._control.arbiter.driver == self.number

    @property
    def silent_ms(self) -> int:
        """Time since its last valid command, or since it took its place."""
        return elapsed_ms(self._control.clock(), self.commanded_ms)

    def take_place(self) -> None:
        """Take a place at the car, unless it has one. Raises SessionError: "full"."""
        self._control.take_place(self)

    def steer(self, throttle: float, steering: float, **switches: int) -> None:
        """Take the position of a page's stick, both axes -1 to 1, and what it switches. Raises MotorcadeError."""
        self.command(stick_word(throttle, steering))
        for word in switch_words(switches, self._control.switchboard.values):
            self.command(word)

    def command(self, word: int, number: int = 0) -> int:
        """Take a DRIVE word that came just now. Returns its outcome, an index of `motorcade.drive.wire.OUTCOMES`.

        Args:
            word: with its stamp, if it has one.
            number: of the word among those of its connection, from 1; words with stamps need it.

        Raises:
            WordError: it is no DRIVE word, which is counted.
            SessionError: "full".
        """
        try:
            command = command_in(word & ~STAMP_MASK)
        except WordError as problem:
            self.refuse(problem)
            raise
        self.take_place()
        outcome = self._control.apply(self, word, command, number)
        self.counts[OUTCOMES[outcome]] += 1
        return outcome

    def refuse(self, problem: WordError) -> None:
        """Count a word that is no DRIVE word."""
        self._control.refused += 1
        self.counts["refused"] += 1
        self.last_refusal = str(problem)

    def you(self) -> dict[str, Any]:
        """What concerns this session, for its client: its name, whether it drives or waits, and its counts."""
        has_wheel = {"drives": self.drives, "waits": self._control.arbiter.wanted_by == self.number}
        return {"name": self.name} | has_wheel | self.counts | {"last_refusal": self.last_refusal}

    def telemetry(self) -> dict[str, Any]:
        """The car's telemetry, and what concerns this session."""
        return self._control.telemetry()._asdict() | {"you": self.you()}

    def clock_to_answer(self) -> int | None:
        """The car's clock that the client has to answer before its stamps are believed again; None for none."""
        return self._control.change(self, lambda arbiter, now: self.freshness.clock_to_answer(now))

    def answer_clock(self, clock: int, number: int, stamp: int) -> None:
        """Take the client's answer; see `motorcade.drive.stamps.Freshness.take_answer`. Raises SessionError: "full"."""
        self.take_place()
        self._control.change(self, lambda arbiter, now: self.freshness.take_answer(clock, number, stamp, now))

    async def act(self, action: str) -> None:
        """Do `request`, `release`, `stop`, `clear` or `resume_program`; a remote car waits. Raises SessionError."""
        getattr(self, action)()

    def request(self) -> bool:
        """Ask for the wheel: True where this session has it now; else it comes when the driver stops or leaves.

        Raises SessionError: "full".
        """
        self.take_place()
        return bool(self._control.change(self, lambda arbiter, now: arbiter.request(self.number, now)))

    def release(self) -> None:
        """Give the wheel back, or stop waiting for it."""
        self._control.change(self, lambda arbiter, now: arbiter.release(self.number, now))

    def stop(self) -> None:
        """Emergency stop, which needs no place: nothing moves until `clear`."""
        self._control.change(None, lambda arbiter, now: arbiter.stop())
        self._control.record("stops", self.name)

    def clear(self) -> None:
        """Lift the emergency stop; a command with speed 0 then arms the car. Raises SessionError: "full"."""
        self.take_place()
        self._control.change(None, lambda arbiter, now: arbiter.clear())
        self._control.record("clears", self.name)

    def resume_program(self) -> None:
        """Give the wheels to the car's image again.

        Raises SessionError: the car has no program, another session drives, or the emergency stop holds.
        """
        self.take_place()
        if not self._control.board.has_program:
            raise SessionError("no-program")
        if not self._control.change(self, lambda arbiter, now: arbiter.resume(self.number, now)):
            raise SessionError("not-yours")
        self._control.record("resumes", self.name)

    def leave(self) -> None:
        """End the session for good: the wheels stand still if it moved them. A second call does nothing."""
        if not self.is_over:
            self.is_over = True
            self._control.end(self)
            self._left()
