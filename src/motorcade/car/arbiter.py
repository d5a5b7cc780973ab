"""Decide who drives, by one table of states: stale commands, hand-over, failsafe and emergency stop.

Portable and pure: sessions are numbers, commands are DRIVE words, times are arguments in milliseconds that wrap
(`motorcade.words.ticks`). To have the wheel is to be the session whose commands drive the car.
scripts/arbiter_diagram.py draws the diagram in docs/drive.md from TABLE.
"""

from motorcade.words.positions import DRIVE_NEUTRAL, DRIVE_SPEED_AT
from motorcade.words.ticks import elapsed_ms

# States: what the wheels do, and the reason.
READY, STANDING, MOVING, FAILSAFE, STOPPED, PROGRAM, DISARMED, DISCHARGED = range(8)
STATES = (
    ("ready", "the wheels stand still; the next command drives"),
    ("standing", "the driver's command has speed 0"),
    ("moving", "the driver's command turns the wheels"),
    ("failsafe", "the wheels stand still until a command with speed 0"),
    ("stopped", "emergency stop: no command counts"),
    ("program", "the codeword image drives"),
    ("disarmed", "a new driver's first command has to have speed 0"),
    ("discharged", "the battery is low: nothing moves until it is charged"),
)

# Events. STILL and MOVE are commands of the session that may drive.
STILL, MOVE, SILENT, STALL, RELEASE, GONE, STOP, CLEAR, RESUME, UNARMED, LOW, CHARGED = range(12)
EVENTS = (
    ("still", "a command with speed 0"),
    ("move", "a command with a speed"),
    ("silent", "no command for failsafe_ms"),
    ("stall", "the car's own software was stuck, or its hardware failed"),
    ("release", "the driver gives the wheel back, or another takes it"),
    ("gone", "the driver's connection ended"),
    ("stop", "emergency stop"),
    ("clear", "the emergency stop is lifted"),
    ("resume", "a request that the program drives again"),
    ("unarmed", "a speed, of a driver who has not armed the car"),
    ("low", "the battery is low, and the wheels stand still"),
    ("charged", "the battery is charged again"),
)

# State, event, next state. An event that is not listed for a state changes nothing.
TABLE = (
    (READY, STILL, STANDING),
    (READY, MOVE, MOVING),
    (READY, STALL, FAILSAFE),
    (READY, STOP, STOPPED),
    (READY, RESUME, PROGRAM),
    (READY, UNARMED, DISARMED),
    (READY, LOW, DISCHARGED),
    (STANDING, MOVE, MOVING),
    (STANDING, SILENT, READY),
    (STANDING, STALL, FAILSAFE),
    (STANDING, RELEASE, READY),
    (STANDING, GONE, READY),
    (STANDING, STOP, STOPPED),
    (STANDING, RESUME, PROGRAM),
    (STANDING, LOW, DISCHARGED),
    (MOVING, STILL, STANDING),
    (MOVING, SILENT, FAILSAFE),
    (MOVING, STALL, FAILSAFE),
    (MOVING, RELEASE, READY),
    (MOVING, GONE, FAILSAFE),
    (MOVING, STOP, STOPPED),
    (MOVING, RESUME, PROGRAM),
    (MOVING, LOW, DISCHARGED),
    (FAILSAFE, STILL, STANDING),
    (FAILSAFE, STOP, STOPPED),
    (FAILSAFE, RESUME, PROGRAM),
    (FAILSAFE, LOW, DISCHARGED),
    (STOPPED, CLEAR, FAILSAFE),
    (PROGRAM, MOVE, MOVING),
    (PROGRAM, STALL, FAILSAFE),
    (PROGRAM, STOP, STOPPED),
    (PROGRAM, UNARMED, DISARMED),
    (PROGRAM, LOW, DISCHARGED),
    (DISARMED, STILL, STANDING),
    (DISARMED, SILENT, READY),
    (DISARMED, STALL, FAILSAFE),
    (DISARMED, RELEASE, READY),
    (DISARMED, GONE, READY),
    (DISARMED, STOP, STOPPED),
    (DISARMED, RESUME, PROGRAM),
    (DISARMED, LOW, DISCHARGED),
    (DISCHARGED, STOP, STOPPED),
    (DISCHARGED, CHARGED, FAILSAFE),
)

# The outcome of a command.
APPLIED = 0
WATCHING = 1  # another session drives
NEEDS_NEUTRAL = 2  # failsafe, or disarmed: a command with speed 0 has to come first
HALTED = 3  # emergency stop
YIELDED = 4  # the program drives, and the command has speed 0
UNPOWERED = 5  # the battery is low
# The outcome of a command that doesn't reach the wheels, by the state that it finds or leads to.
_HELD = {STOPPED: HALTED, PROGRAM: YIELDED, DISCHARGED: UNPOWERED}

NOBODY = 0

_NEXT = {(state, event): following for state, event, following in TABLE}


class Arbiter:
    """Decide whose command the wheels follow.

    Args:
        failsafe_ms: how long a command is valid.
        hand_over_ms: a driver who sends nothing for longer loses the wheel.
        arming: whether each driver has to send a command with speed 0 before the first one that moves the car.

    Attributes:
        state: READY to DISCHARGED.
        word: the DRIVE word that is valid now; DRIVE_NEUTRAL where no command is.
        driver: number of the session that drives, or NOBODY; sessions are numbered from 1.
        wanted_by: number of the session that waits for the wheel, or NOBODY.
        commanded_ms: when the driver last sent a command.
    """

    def __init__(self, failsafe_ms: int, hand_over_ms: int, arming: bool = False) -> None:
        self.state = READY
        self.word = DRIVE_NEUTRAL
        self.driver = NOBODY
        self.wanted_by = NOBODY
        self.commanded_ms = 0
        self._failsafe_ms = failsafe_ms
        self._hand_over_ms = hand_over_ms
        self._arming = arming
        # The session that armed the car, where arming is asked.
        self._armed_by = NOBODY

    def tick(self, now: int) -> int:
        """Do what is due at ``now`` and return after how many ms something can be due next."""
        if self.driver == NOBODY:
            return self._hand_over_ms
        silent_ms = elapsed_ms(now, self.commanded_ms)
        if silent_ms <= self._failsafe_ms:
            return self._failsafe_ms + 1 - silent_ms
        self._take_event(SILENT)
        if silent_ms > self._hand_over_ms:
            self.driver = NOBODY
        self._pass_on(now)
        # The present driver, perhaps a new one, sent a command or got the wheel at most silent_ms ago.
        return max(1, self._hand_over_ms + 1 - silent_ms)

    def command(self, session: int, word: int, now: int) -> int:
        """Take a valid DRIVE word that came at ``now``; return its outcome, APPLIED to UNPOWERED."""
        self.tick(now)
        if not self._may_drive(session):
            return WATCHING
        moves = word >> DRIVE_SPEED_AT & 255
        event = MOVE if moves else STILL
        if self._arming:
            if moves and session != self._armed_by:
                event = UNARMED
            self._armed_by = NOBODY if event == UNARMED else session
        following = _NEXT.get((self.state, event), self.state)
        if following in _HELD:
            if session == self.driver:
                self.commanded_ms = now
            return _HELD[following]
        self.driver = session
        self.commanded_ms = now
        self.state = following
        if following in (FAILSAFE, DISARMED):
            self.word = DRIVE_NEUTRAL
            return NEEDS_NEUTRAL
        self.word = word
        if moves == 0:
            self._pass_on(now)
        return APPLIED

    def may_switch(self, session: int, now: int) -> int:
        """Return the outcome of a command that moves no wheels: APPLIED where ``session`` drives."""
        self.tick(now)
        if not self._may_drive(session):
            return WATCHING
        return _HELD.get(self.state, APPLIED if self.driver == session else WATCHING)

    def request(self, session: int, now: int) -> bool:
        """Ask for the wheel; return whether ``session`` has it now.

        It gets the wheel at once where nobody drives or the car stands still, else as soon as the car does. Another
        session that waits already comes first.
        """
        self.tick(now)
        if session == self.driver:
            return True
        if self.wanted_by == NOBODY:
            self.wanted_by = session
            self._pass_on(now)
        return self.driver == session

    def release(self, session: int, now: int) -> None:
        """Take the wheel from a session that gives it back, or no longer waits for it."""
        self._leave(session, RELEASE, now)

    def gone(self, session: int, now: int) -> None:
        """Remove a session whose connection has ended."""
        self._leave(session, GONE, now)

    def stop(self) -> None:
        """Stop the car in an emergency; every session may."""
        self._take_event(STOP)

    def clear(self) -> None:
        """Lift the emergency stop; a command with speed 0 then arms the car."""
        self._take_event(CLEAR)

    def stall(self) -> None:
        """Stop after a fault in the car itself: outputs may not have arrived."""
        self._take_event(STALL)

    def delay(self) -> None:
        """Stop after a delay in the car itself, since commands may be old; not a car that stands and nobody drives."""
        if self.state != READY or self.driver != NOBODY:
            self._take_event(STALL)

    def discharge(self) -> None:
        """Let nothing move, because the battery is low."""
        self._take_event(LOW)

    def charge(self) -> None:
        """Let commands count again, because the battery is charged; one with speed 0 then arms the car."""
        self._take_event(CHARGED)

    def resume(self, session: int, now: int) -> bool:
        """Give the wheels to the program.

        Returns:
            False where another session drives, the emergency stop holds or the battery is low.
        """
        self.tick(now)
        if not self._may_drive(session) or self.state in (STOPPED, DISCHARGED):
            return False
        self._take_event(RESUME)
        self._armed_by = NOBODY
        self.driver = NOBODY
        self.wanted_by = NOBODY
        return True

    def _may_drive(self, session: int) -> bool:
        return self.driver in (session, NOBODY)

    def _take_event(self, event: int) -> None:
        self.state = _NEXT.get((self.state, event), self.state)
        if self.state not in (STANDING, MOVING):
            self.word = DRIVE_NEUTRAL

    def _leave(self, session: int, event: int, now: int) -> None:
        self.tick(now)
        if self.wanted_by == session:
            self.wanted_by = NOBODY
        if self._armed_by == session:
            self._armed_by = NOBODY
        if self.driver == session:
            self._take_event(event)
            self.driver = NOBODY
            self._pass_on(now)

    def _pass_on(self, now: int) -> None:
        """Give the wheel to the waiting session, unless the driver moves the car."""
        if self.wanted_by == NOBODY or (self.driver != NOBODY and self.state == MOVING):
            return
        self._take_event(RELEASE)
        self.driver = self.wanted_by
        self.commanded_ms = now
        self.wanted_by = NOBODY
