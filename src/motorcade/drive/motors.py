"""What a car's hardware was commanded and accepted within its limits, so that a write that failed is made again.

`Wheels` are the wheels, `Switchboard` is what is switched beside them.
"""

from collections.abc import Callable, Iterable
from functools import lru_cache

from motorcade.car.arbiter import DISCHARGED, FAILSAFE, MOVING, NOBODY, PROGRAM, STANDING, STOPPED, Arbiter
from motorcade.car.drive_board import DriveBoard
from motorcade.car.drive_limits import DutyLimiter, duty_per_s
from motorcade.config.profile import Profile
from motorcade.drive.stamps import STAMP_MASK
from motorcade.words.formats import DRIVE, SWITCHES, switched_by
from motorcade.words.ticks import elapsed_ms, later_ms

# A stick repeats itself: a car gets the same words again and again.
_REMEMBERED_WORDS = 1024
# The upper bits of all commands that move the wheels.
_ANGLE_AT = DRIVE.field("angle").low
_STEERING = frozenset(DRIVE.encode(angle=angle) >> _ANGLE_AT for angle in range(DRIVE.field("angle").maximum + 1))

Setpoint = tuple[int, int, int]
# A setpoint of the wheels, or what is switched, by name.
Command = Setpoint | dict[str, int]
NEUTRAL_SETPOINT = (90, 1, 0)
_BATTERY_MS = 1000
# How often the limits act while a command drives.
_LIMITS_MS = 20


class Wheels:
    """Make a board follow the arbiter.

    Args:
        board: its hardware, which is set to neutral. Raises OSError where that fails.
        profile: the limits of a driver's commands.
        now: in ms (ticks).

    Attributes:
        limiter: what becomes of a command's duty.
        battery_mv: the voltage at the last `read_battery`; None where it is unknown.
        applied: the setpoint of the last command that was applied; NEUTRAL_SETPOINT where no command drives.
        faults: how often the board has raised OSError since then.
        last_fault: the reason of the last one.
        is_neutral: whether ``neutral`` is the last command that the board accepted.
        before_moving: called before any command but neutral; where it raises OSError the board gets no command.
    """

    def __init__(self, board: DriveBoard, profile: Profile, now: int) -> None:
        drive = profile.drive
        self.board = board
        gain_per_s = duty_per_s(drive.acceleration_max_mm_per_s2, profile.speeds_mm_s[-1], profile.motor.pwm_max)
        self.limiter = DutyLimiter(
            gain_per_s,
            # Without a limit of acceleration a low battery ends in a stop within 1 s.
            gain_per_s or profile.motor.pwm_max,
            profile.motor.pwm_max,
            drive.obstacle_stop_mm,
            drive.battery_low_mv,
            drive.battery_charged_mv,
        )
        self.battery_mv: int | None = None
        self.applied = NEUTRAL_SETPOINT
        self.faults = 0
        self.last_fault = ""
        self.before_moving: Callable[[], None] = lambda: None
        self._battery_read_ms = later_ms(now, -_BATTERY_MS)
        self._sees_obstacles = drive.obstacle_stop_mm > 0
        self._watches_battery = drive.battery_low_mv > 0
        self._is_limited = bool(drive.acceleration_max_mm_per_s2 or self._sees_obstacles or self._watches_battery)
        self._is_programmed = False
        # Whether ``before_moving`` has agreed since the wheels stood still.
        self._may_move = False
        board.neutral()
        self.is_neutral = True

    def follow(self, arbiter: Arbiter, setpoint: Setpoint, now: int, is_fresh: bool) -> int:
        """Do what the arbiter's state says. Where the board fails the arbiter is told, and the wheels stand still.

        Args:
            arbiter: a low battery is reported to it.
            setpoint: where a command drives.
            now: in ms (ticks).
            is_fresh: whether the setpoint came just now. Otherwise it is applied only where a limit changes it.

        Returns:
            After how many ms the limits are due again.
        """
        if self._watches_battery:
            self.read_battery(now)
            self._report_battery(arbiter)
        is_due = is_fresh or self._is_limited or arbiter.state not in (STANDING, MOVING)
        if is_due and not self._obey(arbiter.state, setpoint, now, is_fresh):
            arbiter.stall()
            self._obey(arbiter.state, setpoint, now, is_fresh)
        if self._is_limited and arbiter.state == MOVING:
            return _LIMITS_MS
        return _BATTERY_MS

    def read_battery(self, now: int) -> None:
        """Read the battery's voltage, once a second, for the limits too: one that can't be read counts as flat."""
        if elapsed_ms(now, self._battery_read_ms) < _BATTERY_MS:
            return
        self._battery_read_ms = now
        try:
            self.battery_mv = self.board.battery_mv()
        except OSError as problem:
            self.count_fault(problem)
            self.battery_mv = None
            # Nobody knows how far it is from flat.
            self.limiter.see_battery(0)
        if self.battery_mv is not None:
            self.limiter.see_battery(self.battery_mv)

    def _report_battery(self, arbiter: Arbiter) -> None:
        """Stop the car where the battery is low, at the end of the gentle stop where a command moves it."""
        if not self.limiter.is_low:
            if arbiter.state == DISCHARGED:
                arbiter.charge()
        elif arbiter.state != MOVING or not self.limiter.duty:
            arbiter.discharge()

    def _obey(self, state: int, setpoint: Setpoint, now: int, is_fresh: bool) -> bool:
        """Do what ``state`` says. Returns False where the board fails."""
        try:
            if state in (STANDING, MOVING):
                limited = setpoint
                if self._is_limited:
                    limited = self._limited(setpoint, now)
                if is_fresh or limited != self.applied:
                    self._end_program()
                    self._leave_neutral()
                    self.board.apply(*limited)
                    self.applied = limited
            elif state == PROGRAM and self._is_programmed:
                self.board.check_program()
            elif state == PROGRAM:
                self._begin_program()
            else:
                self._stand_still()
        except OSError as problem:
            self.count_fault(problem)
            return False
        return True

    def keep_alive(self) -> None:
        """Feed the hardware watchdog, if the board has one."""
        try:
            self.board.keep_alive()
        except OSError as problem:
            self.count_fault(problem)

    def count_fault(self, problem: Exception) -> None:
        """Count a fault, and keep its reason."""
        self.faults += 1
        self.last_fault = str(problem) or type(problem).__name__

    def _limited(self, setpoint: Setpoint, now: int) -> Setpoint:
        angle_deg, direction, speed = setpoint
        if direction:
            wanted = speed
        else:
            wanted = -speed
        if self._sees_obstacles:
            self.limiter.see_obstacle(self.board.obstacle_mm() if wanted > 0 else None)
        duty = self.limiter.next_duty(wanted, now)
        return angle_deg, int(duty > 0) if duty else direction, abs(duty)

    def _stand_still(self) -> None:
        self.limiter.stop()
        self._may_move = False
        self.applied = NEUTRAL_SETPOINT
        try:
            self._end_program()
        finally:
            if not self.is_neutral:
                self.board.neutral()
                self.is_neutral = not self._is_programmed

    def _begin_program(self) -> None:
        self._stand_still()
        self._leave_neutral()
        self._is_programmed = True
        self.board.begin_program()

    def _end_program(self) -> None:
        if self._is_programmed:
            self.board.end_program()
            self._is_programmed = False

    def _leave_neutral(self) -> None:
        # Also where the board has refused to be neutral: whoever is asked may be gone meanwhile.
        if not self._may_move:
            self.is_neutral = False
            self.before_moving()
            self._may_move = True


class Switchboard:
    """Make a board's switches follow the driver's commands.

    One that is held goes off when nobody commands it any more for ``fresh_ms``, and at once with a failsafe, a stop, a
    low battery or another driver. The others stay as they are, until the session leaves that switched them on.

    Attributes:
        values: 1 or 0 by name, of what the board has.
    """

    def __init__(self, board: DriveBoard, fresh_ms: int) -> None:
        self.values = dict.fromkeys(board.switches, 0)
        self._board = board
        self._fresh_ms = fresh_ms
        self._held = [switch.name for switch in SWITCHES if switch.is_held and switch.name in self.values]
        self._commanded_ms = 0
        # The session that last switched each on.
        self._by: dict[str, int] = {}
        self._written: dict[str, int] = {}

    def command(self, wanted: dict[str, int], session: int, now: int) -> bool:
        """Switch what ``session``, the driver, commands. Returns False where the car has nothing of it."""
        own = {name: value for name, value in wanted.items() if name in self.values}
        self.values |= own
        self._by |= dict.fromkeys(own, session)
        self._commanded_ms = now
        return bool(own)

    def leave(self, session: int) -> None:
        """Switch off what a session has switched on that leaves."""
        self.values |= {name: 0 for name, by in self._by.items() if by == session}

    def follow(self, arbiter: Arbiter, now: int, count_fault: Callable[[Exception], None]) -> int:
        """Switch off what is no longer held, and write to the board what it hasn't yet; it may fail.

        Returns after how many ms something is due.
        """
        held = [name for name in self._held if self.values[name]]
        age_ms = elapsed_ms(now, self._commanded_ms)
        is_over = arbiter.state in (FAILSAFE, STOPPED, DISCHARGED, PROGRAM) or age_ms > self._fresh_ms
        self.values |= {name: 0 for name in held if is_over or arbiter.driver != self._by.get(name, NOBODY)}
        for name, value in self.values.items():
            if value != self._written.get(name, 0):
                try:
                    self._board.set_switch(name, bool(value))
                    self._written[name] = value
                except OSError as problem:
                    count_fault(problem)
        if any(self.values[name] for name in held):
            return self._fresh_ms + 1 - age_ms
        return _BATTERY_MS


def check_commands(words: Iterable[int]) -> None:
    """Check that words are drive commands; fast, since a client may send any number. Raises WordError."""
    for word in {word & ~STAMP_MASK for word in words if word >> _ANGLE_AT not in _STEERING}:
        command_in(word)


@lru_cache(_REMEMBERED_WORDS)
def command_in(word: int) -> Command:
    """What a drive command without its stamp commands. Raises WordError where it is none."""
    if switched := switched_by(word):
        return switched
    setpoint: Setpoint = DRIVE.decode(word, strict=True)[1:4]
    return setpoint
