"""Who watches an arbiter from outside, and the events that both are shown."""

from typing import Any

from motorcade.car.arbiter import APPLIED, NOBODY, PROGRAM, WATCHING, Arbiter
from motorcade.words.formats import DRIVE
from motorcade.words.positions import DRIVE_NEUTRAL

SPEED = 150


def moving(session: int) -> int:
    return DRIVE.encode(angle=40 + session, direction=1, speed=SPEED)


def still(session: int) -> int:
    return DRIVE.encode(angle=40 + session, direction=1, speed=0)


MOVES = {session: moving(session) for session in range(1, 12)}
STILLS = {session: still(session) for session in range(1, 12)}


class Witness:
    """Watches an arbiter from outside: knows who sent what and when, and nothing of its table.

    After each event it says what is wrong, if the wheels could move and shouldn't.
    """

    def __init__(self, failsafe_ms: int, hand_over_ms: int, arming: bool = False) -> None:
        self.failsafe_ms, self.hand_over_ms = failsafe_ms, hand_over_ms
        self.driver = NOBODY
        self.sent = DRIVE_NEUTRAL
        self.age_ms = 0
        self.wanted: frozenset[int] = frozenset()
        self.is_stopped = self.needs_neutral = self.runs_program = self.is_low = False
        self.arming = arming
        self.armed_by = NOBODY

    def see(self, car: Arbiter, event: str, session: int, waited_ms: int, answer: int | bool | None) -> str:
        """Take an event that ``car`` has taken and answered; what it may not have done, or nothing."""
        was_moving = self.sent in MOVES.values() and self.driver != NOBODY
        self.age_ms = min(self.age_ms + waited_ms, self.hand_over_ms + 1)
        lapsed = self.age_ms > self.hand_over_ms
        if event == "request":
            self.wanted |= {session}
        fault = self._passes_on_rightly(car, event, session, lapsed)
        left = event in ("release", "gone") and session == self.driver
        # Whatever stopped moving wheels but the driver's own will.
        failed = was_moving and (self.age_ms > self.failsafe_ms or (event == "gone" and left))
        if event == "stop":
            # Who measures the battery says it again once the stop is lifted.
            self.is_stopped, self.is_low = True, False
        if event == "low" and not self.is_stopped:
            self.is_low = True
        if event == "charged" and self.is_low:
            self.is_low, self.needs_neutral = False, True
        if event == "clear" and self.is_stopped:
            self.is_stopped, self.needs_neutral = False, True
        # Nothing old can move a car that stands and that nobody drives.
        delayed = event == "delay" and (self.driver != NOBODY or self.runs_program)
        if event == "stall" or delayed or failed:
            self.needs_neutral = True
        if event == "resume" and answer:
            fault = fault or ("a stopped car runs its program" if self.is_stopped or self.is_low else "")
            is_another = self.driver not in (session, NOBODY)
            fault = fault or ("the driver is pushed aside by the program" if is_another else "")
            self.runs_program, self.needs_neutral, self.wanted = True, False, frozenset()
        if event == "still" and session in (self.driver, car.driver) and not self.is_stopped and not self.is_low:
            self.needs_neutral = False
        if event == "switch" and answer == APPLIED:
            fault = fault or ("a session that doesn't drive switches" if session != car.driver else "")
            fault = fault or ("a halted car switches" if self.is_stopped or self.is_low else "")
        self._take_arming(event, session, answer)
        self._take_driver(car, event, session)
        return fault or self._moves_rightly(car)

    def _passes_on_rightly(self, car: Arbiter, event: str, session: int, lapsed: bool) -> str:
        before, after = self.driver, car.driver
        if after in (before, NOBODY):
            return ""
        if before != NOBODY:
            left = lapsed or (event in ("release", "gone") and session == before)
            handed = after in self.wanted and car.word == DRIVE_NEUTRAL
            if not (left or handed):
                return f"session {after} took the wheel from {before}"
        if after != session and after not in self.wanted:
            return f"session {after} has the wheel and did nothing"
        return ""

    def _take_arming(self, event: str, session: int, answer: int | bool | None) -> None:
        if event == "still" and answer != WATCHING:
            self.armed_by = session
        if (event in ("release", "gone") and session == self.armed_by) or (event == "resume" and answer):
            self.armed_by = NOBODY

    def _take_driver(self, car: Arbiter, event: str, session: int) -> None:
        if car.driver != self.driver:
            self.driver, self.sent, self.age_ms = car.driver, DRIVE_NEUTRAL, 0
            self.wanted -= {car.driver}
        if event in ("release", "gone"):
            self.wanted -= {session}
        if event in ("move", "still") and session == self.driver:
            self.sent, self.age_ms = (MOVES if event == "move" else STILLS)[session], 0
            self.wanted -= {session}
            if event == "move":
                self.runs_program = False
        if event in ("stall", "delay", "stop") or self.is_low:
            self.runs_program = False
            self.sent = DRIVE_NEUTRAL

    def _moves_rightly(self, car: Arbiter) -> str:
        if car.state == PROGRAM and not self.runs_program:
            return "the program drives unasked"
        if car.word not in MOVES.values():
            return ""
        if self.is_stopped:
            return "the wheels move though the car is stopped"
        if self.is_low:
            return "the wheels move though the battery is low"
        if self.arming and self.armed_by != self.driver:
            return "the wheels move for a driver who has not armed the car"
        if self.needs_neutral:
            return "the wheels move before a command with speed 0"
        if car.word != self.sent:
            return "the wheels follow no command of who drives"
        if self.age_ms > self.failsafe_ms:
            return "the wheels follow a command that isn't fresh"
        return ""

    def memory(self) -> tuple[Any, ...]:
        """All that its next words depend on."""
        flags: tuple[Any, ...] = self.is_stopped, self.needs_neutral, self.runs_program, self.is_low
        if self.arming:
            flags += (self.armed_by,)
        return self.driver, self.sent, self.age_ms, self.wanted, flags


def take(car: Arbiter, event: str, session: int, now: int) -> int | bool | None:
    """Let ``car`` take an event."""
    if event == "move":
        return car.command(session, MOVES[session], now)
    if event == "still":
        return car.command(session, STILLS[session], now)
    if event == "request":
        return car.request(session, now)
    if event == "switch":
        return car.may_switch(session, now)
    if event == "resume":
        return car.resume(session, now)
    if event in ("release", "gone"):
        return {"release": car.release, "gone": car.gone}[event](session, now)
    if event == "wait":
        return car.tick(now)
    events = {"stop": car.stop, "clear": car.clear, "low": car.discharge, "charged": car.charge}
    return (events | {"stall": car.stall, "delay": car.delay})[event]()
