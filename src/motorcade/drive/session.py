"""Control of one car: the object that sockets and pages share, and their sessions. No sockets here.

Every method may be called from any thread. `CarControl.beat` has to be called in time, as
`motorcade.drive.safety.watchdog.watched` does.
"""

import threading
from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

from motorcade.car.arbiter import APPLIED, FAILSAFE, MOVING, NOBODY, STATES, WATCHING, Arbiter
from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import DriveLimits, Profile
from motorcade.drive.activity_log import Record
from motorcade.drive.motors import NEUTRAL_SETPOINT, Setpoint, Wheels, setpoint_of
from motorcade.drive.stamps import STAMP_MASK, Freshness
from motorcade.drive.wire import OVER_RATE, STALE, Counts, Telemetry
from motorcade.errors import MotorcadeError
from motorcade.timing import RateLimit
from motorcade.words.field import WordError
from motorcade.words.ticks import elapsed_ms

MOST_SESSIONS = 9
_RATE_WINDOW_MS = 100
_LOCK_PATIENCE_S = 0.05

_Result = TypeVar("_Result")


class DriveError(MotorcadeError):
    """A car that is driven refuses a session or a request; its codes travel over the network."""


class Who(NamedTuple):
    """Whose session it is.

    Attributes:
        client: the name in the client's certificate, or its address: where places are short, no client keeps many.
        replaced: called, in the thread of the newcomer, when the session has lost its place.
    """

    client: str = ""
    replaced: Callable[[], None] = lambda: None


STRANGER = Who()


class CarControl:
    """A car that is driven; its ``board`` is set to neutral, which raises OSError where the hardware isn't there.

    ``clock`` gives the time in ms that wraps (`motorcade.words.ticks`). Who drives, stops and clears is told to
    ``record``, see `motorcade.drive.activity_log.Record`.
    """

    def __init__(self, board: DriveBoard, clock: Callable[[], int], profile: Profile) -> None:
        self._board = board
        self._clock = clock
        self._limits = profile.drive
        self._arbiter = Arbiter(profile.drive.failsafe_ms, profile.drive.hand_over_ms, profile.drive.arming)
        self._state = self._arbiter.state
        self._setpoint: Setpoint = NEUTRAL_SETPOINT
        self._lock = threading.Lock()
        self._sessions: dict[int, ControlSession] = {}
        self._last_number = self._refused = self._turned_away = self._failsafes = self._stalls = 0
        self._beat_ms: int | None = None
        self._is_stuck = False
        self._wheels = Wheels(board, profile, clock())
        self._recorded_driver: ControlSession | None = None
        self.record: Record = lambda did, who: None

    @property
    def moves(self) -> bool:
        """Whether the wheels may turn, by a command or by the program."""
        return not self._wheels.is_neutral

    @property
    def failsafe_ms(self) -> int:
        """How long a command counts."""
        return self._limits.failsafe_ms

    @property
    def has_program(self) -> bool:
        """Whether the car holds an image that it can run."""
        return self._board.has_program

    @property
    def rescue(self) -> tuple[str, Sequence[str]] | None:
        """What stops the wheels once this process is dead; see `motorcade.car.drive_board.DriveBoard.rescue`."""
        return self._board.rescue()

    def now_ms(self) -> int:
        """The time now (ticks)."""
        return self._clock()

    def join(
        self, name: str, who: Who = STRANGER, watches: bool = False, counts: Counts | None = None
    ) -> "ControlSession":
        """Open a session. An emergency stop needs none.

        Where nine clients have one, a newcomer replaces the session that sent no command for longest, if that is more
        than ``hand_over_ms``; else one of the client that has the most, if it has two more than the newcomer. A session
        that only watches replaces none for its silence.

        Args:
            name: what others are shown.
            who: whose session it is.
            watches: for a session that won't drive; while nobody drives one place is kept for a driver.
            counts: of the words that came before the session.

        Raises:
            DriveError: "full".
        """
        with self._lock:
            loser = None
            taken = len(self._sessions)
            if watches and self._arbiter.driver == NOBODY:
                taken += 1
            if taken >= MOST_SESSIONS:
                loser = self._replaceable(who.client, watches)
                if loser is None:
                    raise DriveError("full", sessions=MOST_SESSIONS)
                self._end(loser)
            self._last_number += 1
            session = ControlSession(self, self._last_number, name, who, self._limits, counts or Counts())
            self._sessions[session.number] = session
        if loser:
            loser.who.replaced()
        return session

    def _replaceable(self, client: str, watches: bool) -> "ControlSession | None":
        """The session that gives its place to one of ``client``, None for none."""
        sessions = list(self._sessions.values())
        longest = max(sessions, key=lambda session: session.silent_ms, default=None)
        if longest and not watches and longest.silent_ms > self._limits.hand_over_ms:
            return longest
        places = Counter(session.who.client for session in sessions)
        most = max(places.values(), default=0)
        if most < places[client] + 2:
            return None
        others = [each for each in sessions if places[each.who.client] == most and each.number != self._arbiter.driver]
        return max(others, key=lambda session: session.silent_ms)

    def check(self, word: int, counts: Counts) -> Setpoint:
        """The setpoint in a DRIVE word. Raises WordError, and counts it, where the word is none."""
        try:
            return setpoint_of(word & ~STAMP_MASK)
        except WordError as problem:
            with self._lock:
                self._refused += 1
            counts.refused += 1
            counts.last_refusal = str(problem)
            raise

    def change(self, session: "ControlSession | None", action: Callable[[Arbiter, int], _Result]) -> _Result | None:
        """Call ``action`` with the arbiter and the time, and make the wheels follow; not where ``session`` is over.

        Returns what ``action`` returns, or None.
        """
        with self._lock:
            if session and session.number not in self._sessions:
                return None
            result = action(self._arbiter, self._clock())
            self._follow()
            return result

    def apply(self, session: "ControlSession", word: int, setpoint: Setpoint, number: int) -> int:
        """Take the command ``number`` of ``session``. Returns its outcome, see `motorcade.drive.wire.OUTCOMES`."""
        with self._lock:
            now = self._clock()
            if not session.freshness.is_fresh(word & STAMP_MASK, now, number, stands=setpoint[2] == 0):
                return STALE
            session.commanded_ms = now
            if session.number not in self._sessions:
                return WATCHING
            # A command that stops is never over the rate.
            if setpoint[2] and not session.rate.allows(now):
                return OVER_RATE
            outcome = self._arbiter.command(session.number, word & ~STAMP_MASK, now)
            if outcome == APPLIED:
                self._setpoint = setpoint
            self._follow(outcome == APPLIED)
            return outcome

    def end(self, session: "ControlSession") -> None:
        """End a session: the wheels stand still if it moved them. A second call does nothing."""
        with self._lock:
            self._end(session)

    def _end(self, session: "ControlSession") -> None:
        if self._sessions.pop(session.number, None):
            self._arbiter.gone(session.number, self._clock())
            self._follow()

    def stop(self, who: str = "") -> None:
        """Emergency stop, asked for by ``who``: nothing moves until `clear`."""
        self.change(None, lambda arbiter, now: arbiter.stop())
        self.record("stops", who)

    def clear(self, who: str = "") -> None:
        """Lift the emergency stop; a command with speed 0 then arms the car."""
        self.change(None, lambda arbiter, now: arbiter.clear())
        self.record("clears", who)

    @property
    def driver(self) -> int:
        """The number of the session that has the wheel, or NOBODY."""
        return self._arbiter.driver

    def turn_away(self) -> None:
        """Count a connection that got or kept no place."""
        with self._lock:
            self._turned_away += 1

    def telemetry(self) -> Telemetry:
        """What the car does now."""
        with self._lock:
            now, arbiter = self._clock(), self._arbiter
            self._wheels.read_battery(now)
            driver = self._sessions.get(arbiter.driver)
            wanted_by = self._sessions.get(arbiter.wanted_by)
            return Telemetry(
                STATES[arbiter.state][0],
                *self._wheels.applied,
                driver.name if driver else None,
                wanted_by.name if wanted_by else None,
                elapsed_ms(now, arbiter.commanded_ms) if driver else None,
                self._wheels.battery_mv,
                len(self._sessions) - (driver is not None),
                self._refused,
                self._failsafes,
                self._stalls,
                self._wheels.faults,
                self._wheels.last_fault,
                self._turned_away,
                self._wheels.limiter.obstacle_mm,
            )

    def tick(self) -> int:
        """Do what is due. Returns after how many ms something can be due next."""
        with self._lock:
            rest_ms = self._arbiter.tick(self._clock())
            return min(rest_ms, self._follow())

    def beat(self) -> int:
        """Do what `tick` does, and record that the loop that takes the commands is alive; at least every 50 ms."""
        rest_ms = self.tick()
        with self._lock:
            self._beat_ms = self._clock()
            self._is_stuck = False
            self._wheels.keep_alive()
        return rest_ms

    def watch(self) -> int:
        """Do what `tick` does; where the last `beat` is older than the profile's ``watchdog_ms``, stop the wheels.

        The commands that a stuck loop then finds in its buffers are old: a command with speed 0 has to arm the car.
        """
        if not self._lock.acquire(timeout=_LOCK_PATIENCE_S):
            # The thread that holds the lock hangs in the hardware's driver.
            self._board.neutral()
            return 0
        try:
            now = self._clock()
            rest_ms = self._arbiter.tick(now)
            late_ms = 0 if self._beat_ms is None else elapsed_ms(now, self._beat_ms)
            if late_ms >= self._limits.watchdog_ms:
                self._stalls += not self._is_stuck
                self._is_stuck = True
                self._arbiter.stall()
            return min(rest_ms, self._follow(), max(1, self._limits.watchdog_ms - late_ms))
        finally:
            self._lock.release()

    def call_before_moving(self, may_move: Callable[[], None]) -> None:
        """Call ``may_move`` whenever the wheels are about to turn; where it raises OSError they don't."""
        with self._lock:
            self._wheels.before_moving = may_move

    def fail(self, problem: Exception, stops: bool = True) -> None:
        """Count a fault; one of what watches over the wheels ``stops`` them: then speed 0 has to arm the car."""
        with self._lock:
            self._wheels.count_fault(problem)
            if stops:
                self._arbiter.stall()
                self._follow()

    def close(self) -> None:
        """End all sessions, stop the wheels and free the hardware. Raises OSError where the wheels don't stop."""
        with self._lock:
            self._sessions.clear()
            self._beat_ms = None
            self._arbiter.stop()
            self._follow()
            self._board.close()

    def _follow(self, is_fresh: bool = False) -> int:
        """Make the wheels follow the arbiter; ``is_fresh``: there is a new setpoint.

        Returns after how many ms the limits are due again.
        """
        arbiter = self._arbiter
        self._failsafes += arbiter.state == FAILSAFE and self._state == MOVING
        rest_ms = self._wheels.follow(arbiter, self._setpoint, self._clock(), is_fresh)
        self._state = arbiter.state
        driver = self._sessions.get(arbiter.driver)
        if driver is not self._recorded_driver:
            for did, session in (("ends", self._recorded_driver), ("drives", driver)):
                if session:
                    self.record(did, session.name)
            self._recorded_driver = driver
        return rest_ms


class ControlSession:
    """One who drives or watches a car; `CarControl.join` opens it.

    Attributes:
        number: from 1, never given twice.
        name: what others are shown.
        who: whose session it is.
        rate: of commands that move the car.
        counts: what became of its words.
        freshness: finds its words that were sent long ago.
        commanded_ms: when it last sent a valid command (ticks); when it joined, before the first.
    """

    def __init__(
        self, control: CarControl, number: int, name: str, who: Who, limits: DriveLimits, counts: Counts
    ) -> None:
        self.number = number
        self.name = name
        self.who = who
        self.rate = RateLimit(max(1, limits.commands_per_s * _RATE_WINDOW_MS // 1000), _RATE_WINDOW_MS)
        self.counts = counts
        self.commanded_ms = control.now_ms()
        self.freshness = Freshness(limits.stale_ms)
        self._control = control

    @property
    def drives(self) -> bool:
        """Whether it has the wheel."""
        return self._control.driver == self.number

    @property
    def silent_ms(self) -> int:
        """Time since its last valid command, or since it joined."""
        return elapsed_ms(self._control.now_ms(), self.commanded_ms)

    def command(self, word: int, number: int = 0) -> int:
        """Take a DRIVE word that came just now. Returns its outcome, an index of `motorcade.drive.wire.OUTCOMES`.

        ``number`` counts the words of its connection, from 1; words with stamps need it. Raises WordError, and counts
        it, where it is no DRIVE word.
        """
        outcome = self._control.apply(self, word, self._control.check(word, self.counts), number)
        self.counts.outcomes[outcome] += 1
        return outcome

    def clock_to_answer(self) -> int | None:
        """The car's clock that the client has to answer before its stamps are believed again; None for none."""
        return self._control.change(self, lambda arbiter, now: self.freshness.clock_to_answer(now))

    def answer_clock(self, clock: int, number: int, stamp: int) -> None:
        """Take the client's answer; see `motorcade.drive.stamps.Freshness.take_answer`."""
        self._control.change(self, lambda arbiter, now: self.freshness.take_answer(clock, number, stamp, now))

    def request(self) -> bool:
        """Ask for the wheel: True where this session has it now; else it comes when the driver stops or leaves."""
        return bool(self._control.change(self, lambda arbiter, now: arbiter.request(self.number, now)))

    def release(self) -> None:
        """Give the wheel back, or stop waiting for it."""
        self._control.change(self, lambda arbiter, now: arbiter.release(self.number, now))

    def stop(self) -> None:
        """Emergency stop: nothing moves until `clear`."""
        self._control.stop(self.name)

    def clear(self) -> None:
        """Lift the emergency stop; a command with speed 0 then arms the car."""
        self._control.clear(self.name)

    def resume_program(self) -> None:
        """Give the wheels to the car's image again.

        Raises DriveError: the car has no program, another session drives, or the emergency stop holds.
        """
        if not self._control.has_program:
            raise DriveError("no-program")
        if not self._control.change(self, lambda arbiter, now: arbiter.resume(self.number, now)):
            raise DriveError("not-yours")
        self._control.record("resumes", self.name)

    def leave(self) -> None:
        """End the session: the wheels stand still if it moved them. A second call does nothing."""
        self._control.end(self)
