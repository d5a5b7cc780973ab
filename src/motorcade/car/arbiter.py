"""Who drives: priorities, freshness, failsafe and emergency stop, as one table of states.

Portable and pure: seats are numbers, commands are DRIVE words, time comes in as
milliseconds that wrap (`motorcade.words.ticks`). The diagram in docs/drive.md is drawn from TABLE.
"""

from motorcade.words.formats import DRIVE
from motorcade.words.ticks import elapsed_ms

# States: what the wheels do, and why.
READY = 0
STANDING = 1
MOVING = 2
FAILSAFE = 3
STOPPED = 4
PROGRAM = 5
STATES = (
    ("ready", "the wheels stand still; the next command drives"),
    ("standing", "the driver's command says speed 0"),
    ("moving", "the driver's command turns the wheels"),
    ("failsafe", "the wheels stand still until a command with speed 0"),
    ("stopped", "emergency stop: no command counts"),
    ("program", "the codeword image drives"),
)

# Events. A command is one of the seat that may drive.
STILL = 0
MOVE = 1
SILENT = 2
STALL = 3
RELEASE = 4
GONE = 5
STOP = 6
CLEAR = 7
RESUME = 8
EVENTS = (
    ("still", "a command with speed 0"),
    ("move", "a command with a speed"),
    ("silent", "no command for failsafe_ms"),
    ("stall", "the car's own software was stuck, or its hardware failed"),
    ("release", "the driver gives the wheel back or it passes on"),
    ("gone", "the driver's connection ended"),
    ("stop", "emergency stop"),
    ("clear", "the emergency stop is lifted"),
    ("resume", "the program shall drive again"),
)

# State, event, next state. What isn't here changes nothing.
TABLE = (
    (READY, STILL, STANDING),
    (READY, MOVE, MOVING),
    (READY, STALL, FAILSAFE),
    (READY, STOP, STOPPED),
    (READY, RESUME, PROGRAM),
    (STANDING, MOVE, MOVING),
    (STANDING, SILENT, READY),
    (STANDING, STALL, FAILSAFE),
    (STANDING, RELEASE, READY),
    (STANDING, GONE, READY),
    (STANDING, STOP, STOPPED),
    (STANDING, RESUME, PROGRAM),
    (MOVING, STILL, STANDING),
    (MOVING, SILENT, FAILSAFE),
    (MOVING, STALL, FAILSAFE),
    (MOVING, RELEASE, READY),
    (MOVING, GONE, FAILSAFE),
    (MOVING, STOP, STOPPED),
    (MOVING, RESUME, PROGRAM),
    (FAILSAFE, STILL, STANDING),
    (FAILSAFE, STOP, STOPPED),
    (FAILSAFE, RESUME, PROGRAM),
    (STOPPED, CLEAR, FAILSAFE),
    (PROGRAM, MOVE, MOVING),
    (PROGRAM, STALL, FAILSAFE),
    (PROGRAM, STOP, STOPPED),
)

# What became of a command.
APPLIED = 0
WATCHING = 1
NEEDS_NEUTRAL = 2
HALTED = 3
YIELDED = 4

# Priorities: a higher one takes the wheel at once.
CLIENT = 1
LOCAL = 2

NOBODY = 0
_SPEED_AT = DRIVE.field("speed").low
NEUTRAL = DRIVE.encode(angle=90, direction=1, speed=0)


def _rows() -> tuple[tuple[int, ...], ...]:
    """NEXT[state][event]."""
    rows = [[state] * len(EVENTS) for state in range(len(STATES))]
    for state, event, following in TABLE:
        rows[state][event] = following
    return tuple([tuple(row) for row in rows])


NEXT = _rows()


class Arbiter:
    """Decides whose command the wheels follow.

    Args:
        failsafe_ms: a command is fresh for so long.
        hand_over_ms: a driver who is silent for longer has lost the wheel.

    Attributes:
        state: READY to PROGRAM.
        word: the DRIVE word that holds now; NEUTRAL wherever nobody's command does.
        driver: number of the seat that drives, or NOBODY; seats are numbered from 1.
        driver_priority: its priority.
        wanted_by: number of the seat that waits for the wheel, or NOBODY.
        commanded_ms: when the driver last sent a command.
    """

    def __init__(self, failsafe_ms: int, hand_over_ms: int) -> None:
        self.state = READY
        self.word = NEUTRAL
        self.driver = NOBODY
        self.driver_priority = 0
        self.wanted_by = NOBODY
        self.commanded_ms = 0
        self._failsafe_ms = failsafe_ms
        self._hand_over_ms = hand_over_ms
        self._wanted_priority = 0

    def tick(self, now: int) -> int:
        """Do what is due, and say after how many ms something can be due next."""
        if self.driver == NOBODY:
            return self._hand_over_ms
        silent_ms = elapsed_ms(now, self.commanded_ms)
        if silent_ms <= self._failsafe_ms:
            return self._failsafe_ms + 1 - silent_ms
        self._take_event(SILENT)
        if silent_ms > self._hand_over_ms:
            self.driver = NOBODY
        self._pass_on(now)
        # Whoever drives now was heard silent_ms ago at the latest.
        return max(1, self._hand_over_ms + 1 - silent_ms)

    def command(self, seat: int, priority: int, word: int, now: int) -> int:
        """Take a valid DRIVE word that came just now: APPLIED, or why it wasn't."""
        self.tick(now)
        if not self._may_drive(seat, priority):
            return WATCHING
        moves = word >> _SPEED_AT & 255
        following = NEXT[self.state][MOVE if moves else STILL]
        if following in (STOPPED, PROGRAM):
            if seat == self.driver:
                self.commanded_ms = now
            return HALTED if following == STOPPED else YIELDED
        if self.wanted_by == seat:
            self.wanted_by = NOBODY
        self.driver = seat
        self.driver_priority = priority
        self.commanded_ms = now
        self.state = following
        if following == FAILSAFE:
            return NEEDS_NEUTRAL
        self.word = word
        if moves == 0:
            self._pass_on(now)
        return APPLIED

    def request(self, seat: int, priority: int, now: int) -> bool:
        """Ask for the wheel: it comes at once where nobody drives or the car stands still, else as soon as it does.

        True where ``seat`` has it now. A driver of higher priority keeps it until they release it or fall silent.
        Another seat that waits already comes first.
        """
        self.tick(now)
        if seat == self.driver:
            return True
        if self.wanted_by == NOBODY:
            self.wanted_by = seat
            self._wanted_priority = priority
            self._pass_on(now)
        return self.driver == seat

    def release(self, seat: int, now: int) -> None:
        """Give the wheel back, or wait for it no longer."""
        self._leave(seat, RELEASE, now)

    def gone(self, seat: int, now: int) -> None:
        """The seat is there no longer."""
        self._leave(seat, GONE, now)

    def stop(self) -> None:
        """Emergency stop, by anyone."""
        self._take_event(STOP)

    def clear(self) -> None:
        """Lift the emergency stop; a command with speed 0 then arms the car."""
        self._take_event(CLEAR)

    def stall(self) -> None:
        """What has come in meanwhile may be old, and what goes out may not have arrived."""
        self._take_event(STALL)

    def resume(self, seat: int, priority: int, now: int) -> bool:
        """Let the program drive, if ``seat`` might: False while somebody else drives or the car is stopped."""
        self.tick(now)
        if not self._may_drive(seat, priority) or self.state == STOPPED:
            return False
        self._take_event(RESUME)
        self.driver = NOBODY
        self.wanted_by = NOBODY
        return True

    def _may_drive(self, seat: int, priority: int) -> bool:
        return self.driver in (seat, NOBODY) or priority > self.driver_priority

    def _take_event(self, event: int) -> None:
        self.state = NEXT[self.state][event]
        if self.state not in (STANDING, MOVING):
            self.word = NEUTRAL

    def _leave(self, seat: int, event: int, now: int) -> None:
        self.tick(now)
        if self.wanted_by == seat:
            self.wanted_by = NOBODY
        if self.driver == seat:
            self._take_event(event)
            self.driver = NOBODY
            self._pass_on(now)

    def _pass_on(self, now: int) -> None:
        """Give the wheel to who waits for it, unless somebody uses it or has a right to keep it."""
        if self.wanted_by == NOBODY:
            return
        if self.driver != NOBODY and (self.state == MOVING or self._wanted_priority < self.driver_priority):
            return
        self._take_event(RELEASE)
        self.driver = self.wanted_by
        self.driver_priority = self._wanted_priority
        self.commanded_ms = now
        self.wanted_by = NOBODY
