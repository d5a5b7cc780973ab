"""Driving one car: the one object that sockets, pages and local sticks share. No sockets in here.

Every method may be called from any thread. Somebody has to call ``beat`` in time:
`motorcade.drive.safety.watchdog.kept` does.
"""

import threading
from collections.abc import Callable, Sequence
from functools import lru_cache

from motorcade.car.arbiter import APPLIED, CLIENT, FAILSAFE, LOCAL, MOVING, NOBODY, STANDING, STATES, WATCHING, Arbiter
from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import Profile
from motorcade.drive.drive_failures import DriveError
from motorcade.drive.motors import NEUTRAL_SETPOINT, Setpoint, Wheels
from motorcade.drive.seat import ControlSession
from motorcade.drive.telemetry import OUTCOMES, OVER_RATE, Counts, Telemetry
from motorcade.words.field import WordError
from motorcade.words.formats import DRIVE
from motorcade.words.ticks import elapsed_ms, later_ms

__all__ = ["APPLIED", "CLIENT", "LOCAL", "OUTCOMES", "OVER_RATE", "CarControl", "ControlSession", "Telemetry"]

MOST_SEATS = 9
_LOCK_PATIENCE_S = 0.05
_BATTERY_MS = 1000
# A stick repeats itself: a car hears the same words again and again.
_REMEMBERED_WORDS = 1024


class CarControl:
    """A car that is steered.

    Args:
        board: its hardware; neutral from now on.
        clock: the time in ms that wraps, as `motorcade.words.ticks` says.
        profile: its kind.

    Raises:
        OSError: the hardware isn't there.
    """

    def __init__(self, board: DriveBoard, clock: Callable[[], int], profile: Profile) -> None:
        self._board = board
        self._clock = clock
        self._limits = profile.drive
        self._arbiter = Arbiter(profile.drive.failsafe_ms, profile.drive.hand_over_ms)
        self._state = self._arbiter.state
        self._setpoint: Setpoint = NEUTRAL_SETPOINT
        self._lock = threading.Lock()
        self._seats: dict[int, ControlSession] = {}
        self._numbers = self._refused = self._turned_away = self._failsafes = self._stalls = 0
        self._beat_ms: int | None = None
        self._is_stuck = False
        self._battery_mv: int | None = None
        self._battery_read_ms = later_ms(clock(), -_BATTERY_MS)
        self._wheels = Wheels(board)

    @property
    def moves(self) -> bool:
        """Whether the wheels may turn, by a command or by the program."""
        return not self._wheels.is_neutral

    @property
    def failsafe_ms(self) -> int:
        """For how long a command counts."""
        return self._limits.failsafe_ms

    @property
    def rescue(self) -> tuple[str, Sequence[str]] | None:
        """What makes the wheels stand still once this process is dead, of `motorcade.car.drive_board.DriveBoard`."""
        return self._board.rescue()

    def join(
        self, name: str, kind: int = CLIENT, watches: bool = False, counts: Counts | None = None
    ) -> ControlSession:
        """A seat for one who will drive or watch: CLIENT, or LOCAL for a stick at the car itself, which comes first.

        Args:
            name: what the others are shown.
            kind: CLIENT or LOCAL.
            watches: for one who won't drive; where nobody drives such a one leaves a seat for who will.
            counts: what has become of its words so far, for one who has sent some.

        Raises:
            DriveError: ``full``, with one driver and eight watchers; a local stick always finds a seat.
        """
        with self._lock:
            taken = sum(seat.kind == CLIENT for seat in self._seats.values())
            if watches and self._arbiter.driver == NOBODY:
                taken += 1
            if kind == CLIENT and taken >= MOST_SEATS:
                raise DriveError("full", seats=MOST_SEATS)
            self._numbers += 1
            seat = ControlSession(
                self, self._numbers, name, kind, self._clock(), self._limits.commands_per_s, counts or Counts()
            )
            self._seats[seat.number] = seat
            return seat

    def command(self, seat: ControlSession, word: int) -> int:
        """As `ControlSession.command`."""
        setpoint = self.check(word, seat.counts)
        with self._lock:
            now = seat.heard_ms = self._clock()
            if seat.number not in self._seats:
                outcome = WATCHING
            elif setpoint[2] and not seat.takes(now):
                # One that stops is never one too many.
                outcome = OVER_RATE
            else:
                outcome = self._arbiter.command(seat.number, seat.kind, word, now)
                if outcome == APPLIED:
                    self._setpoint = setpoint
                self._follow(outcome == APPLIED)
        seat.counts.outcomes[outcome] += 1
        return outcome

    def request(self, seat: ControlSession) -> bool:
        """As `ControlSession.request`."""
        with self._lock:
            if seat.number not in self._seats:
                return False
            has_it = self._arbiter.request(seat.number, seat.kind, self._clock())
            self._follow()
            return has_it

    def release(self, seat: ControlSession) -> None:
        """As `ControlSession.release`."""
        with self._lock:
            self._arbiter.release(seat.number, self._clock())
            self._follow()

    def stop(self) -> None:
        """As `ControlSession.stop`."""
        with self._lock:
            self._arbiter.stop()
            self._follow()

    def clear(self) -> None:
        """As `ControlSession.clear`."""
        with self._lock:
            self._arbiter.clear()
            self._follow()

    def resume_program(self, seat: ControlSession) -> None:
        """As `ControlSession.resume_program`."""
        with self._lock:
            if not self._board.has_program:
                raise DriveError("no-program")
            if seat.number not in self._seats or not self._arbiter.resume(seat.number, seat.kind, self._clock()):
                raise DriveError("not-yours")
            self._follow()

    def leave(self, seat: ControlSession) -> None:
        """As `ControlSession.leave`."""
        with self._lock:
            if self._seats.pop(seat.number, None):
                self._arbiter.gone(seat.number, self._clock())
                self._follow()

    def turn_away(self) -> None:
        """A connection got no place; count it."""
        with self._lock:
            self._turned_away += 1

    def check(self, word: int, counts: Counts) -> Setpoint:
        """What a DRIVE word says. Raises WordError, and counts it, where it is none."""
        try:
            return _setpoint_of(word)
        except WordError as problem:
            with self._lock:
                self._refused += 1
            counts.refused += 1
            counts.last_refusal = str(problem)
            raise

    def drives(self, seat: ControlSession) -> bool:
        """Whether the seat has the wheel."""
        return self._arbiter.driver == seat.number

    def silent_ms(self, seat: ControlSession) -> int:
        """Since the seat's last valid command, or since it joined."""
        return elapsed_ms(self._clock(), seat.heard_ms)

    def telemetry(self) -> Telemetry:
        """What the car does now."""
        with self._lock:
            now, arbiter = self._clock(), self._arbiter
            self._read_battery(now)
            driver = self._seats.get(arbiter.driver)
            wanted_by = self._seats.get(arbiter.wanted_by)
            return Telemetry(
                STATES[arbiter.state][0],
                *(self._setpoint if arbiter.state in (STANDING, MOVING) else NEUTRAL_SETPOINT),
                driver.name if driver else None,
                wanted_by.name if wanted_by else None,
                elapsed_ms(now, arbiter.commanded_ms) if driver else None,
                self._battery_mv,
                len(self._seats) - (driver is not None),
                self._refused,
                self._failsafes,
                self._stalls,
                self._wheels.faults,
                self._wheels.last_fault,
                self._turned_away,
            )

    def tick(self) -> int:
        """Do what is due, and say after how many ms something can be due next."""
        with self._lock:
            rest_ms = self._arbiter.tick(self._clock())
            self._follow()
            return rest_ms

    def beat(self) -> int:
        """As ``tick``, and a sign of life of what takes the commands; at least every 50 ms."""
        rest_ms = self.tick()
        with self._lock:
            self._beat_ms = self._clock()
            self._is_stuck = False
            self._wheels.keep_alive()
        return rest_ms

    def watch(self) -> int:
        """As ``tick``, for a watchdog: where the loop gave no sign of life for the profile's ``watchdog_ms``, neutral.

        What the loop then finds in its buffers is old: the car has to be armed by a command with speed 0.
        """
        if not self._lock.acquire(timeout=_LOCK_PATIENCE_S):
            # Who holds the lock hangs in the hardware's driver.
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
            self._follow()
            return min(rest_ms, max(1, self._limits.watchdog_ms - late_ms))
        finally:
            self._lock.release()

    def ask_before_moving(self, may_move: Callable[[], None]) -> None:
        """Call ``may_move`` whenever the wheels are about to turn; where it raises OSError they don't."""
        with self._lock:
            self._wheels.before_moving = may_move

    def fail(self, problem: OSError) -> None:
        """What watches over the wheels has failed: they stand still, and a command with speed 0 has to arm the car."""
        with self._lock:
            self._wheels.note(problem)
            self._arbiter.stall()
            self._follow()

    def close(self) -> None:
        """Everybody leaves, the wheels stand still and the hardware is free. Raises OSError where they don't."""
        with self._lock:
            self._seats.clear()
            self._beat_ms = None
            self._arbiter.stop()
            self._follow()
            self._board.close()

    def _follow(self, is_fresh: bool = False) -> None:
        """Let the wheels do what the arbiter says; ``is_fresh``: there is a new setpoint."""
        arbiter = self._arbiter
        self._failsafes += arbiter.state == FAILSAFE and self._state == MOVING
        is_due = is_fresh or arbiter.state not in (STANDING, MOVING)
        if is_due and not self._wheels.follow(arbiter.state, self._setpoint):
            arbiter.stall()
            self._wheels.follow(arbiter.state, NEUTRAL_SETPOINT)
        self._state = arbiter.state

    def _read_battery(self, now: int) -> None:
        if elapsed_ms(now, self._battery_read_ms) >= _BATTERY_MS:
            self._battery_read_ms = now
            self._battery_mv = self._wheels.battery_mv()


@lru_cache(_REMEMBERED_WORDS)
def _setpoint_of(word: int) -> Setpoint:
    setpoint: Setpoint = DRIVE.decode(word, strict=True)[1:4]
    return setpoint
