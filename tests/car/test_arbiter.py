"""Who drives: every sequence of events is tried, and none moves the wheels but a fresh command of who may drive."""

from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from motorcade.car.arbiter import (
    APPLIED,
    CLIENT,
    EVENTS,
    HALTED,
    LOCAL,
    NEEDS_NEUTRAL,
    NEUTRAL,
    NEXT,
    NOBODY,
    PROGRAM,
    STATES,
    TABLE,
    WATCHING,
    YIELDED,
    Arbiter,
)
from motorcade.words.formats import DRIVE
from motorcade.words.ticks import TICKS_MASK

SPEED = 150
# Both are shorter for the search: it tries each millisecond.
SEARCHED_FAILSAFE_MS, SEARCHED_HAND_OVER_MS = 2, 4
SEARCHED_DEPTH = 23
# Two clients and a stick at the car. A third client could do nothing to the second that the second can't to the first.
SEARCHED_SEATS = {1: CLIENT, 2: CLIENT, 3: LOCAL}


def moving(seat: int) -> int:
    return DRIVE.encode(angle=40 + seat, direction=1, speed=SPEED)


def still(seat: int) -> int:
    return DRIVE.encode(angle=40 + seat, direction=1, speed=0)


MOVES = {seat: moving(seat) for seat in range(1, 12)}
STILLS = {seat: still(seat) for seat in range(1, 12)}


class Witness:
    """Watches an arbiter from outside: knows who sent what and when, and nothing of its table.

    After each event it says what is wrong, if the wheels could move and shouldn't.
    """

    def __init__(self, failsafe_ms: int, hand_over_ms: int, seats: dict[int, int]) -> None:
        self.failsafe_ms, self.hand_over_ms, self.seats = failsafe_ms, hand_over_ms, seats
        self.driver = NOBODY
        self.sent = NEUTRAL
        self.age_ms = 0
        self.wanted: frozenset[int] = frozenset()
        self.is_stopped = self.needs_neutral = self.runs_program = False

    def see(self, car: Arbiter, event: str, seat: int, waited_ms: int, answer: int | bool | None) -> str:
        """Take an event that ``car`` has taken and answered; what it may not have done, or nothing."""
        was_moving = self.sent in MOVES.values() and self.driver != NOBODY
        self.age_ms = min(self.age_ms + waited_ms, self.hand_over_ms + 1)
        lapsed = self.age_ms > self.hand_over_ms
        if event == "request":
            self.wanted |= {seat}
        fault = self._passes_on_rightly(car, event, seat, lapsed)
        left = event in ("release", "gone") and seat == self.driver
        # Whatever stopped moving wheels but the driver's own will.
        failed = was_moving and (self.age_ms > self.failsafe_ms or (event == "gone" and left))
        if event == "stop":
            self.is_stopped = True
        if event == "clear" and self.is_stopped:
            self.is_stopped, self.needs_neutral = False, True
        if event == "stall" or failed:
            self.needs_neutral = True
        if event == "resume" and answer:
            fault = fault or ("a stopped car runs its program" if self.is_stopped else "")
            fault = fault or ("the driver is pushed aside by the program" if self._is_above(seat) else "")
            self.runs_program, self.needs_neutral, self.wanted = True, False, frozenset()
        if event == "still" and seat in (self.driver, car.driver) and not self.is_stopped:
            self.needs_neutral = False
        self._take_driver(car, event, seat)
        return fault or self._moves_rightly(car)

    def _passes_on_rightly(self, car: Arbiter, event: str, seat: int, lapsed: bool) -> str:
        before, after = self.driver, car.driver
        if after in (before, NOBODY):
            return ""
        if before != NOBODY:
            left = lapsed or (event in ("release", "gone") and seat == before)
            outranked = event in ("move", "still") and after == seat and self.seats[after] > self.seats[before]
            handed = after in self.wanted and car.word == NEUTRAL and self.seats[after] >= self.seats[before]
            if not (left or outranked or handed):
                return f"seat {after} took the wheel from {before}"
        if after != seat and after not in self.wanted:
            return f"seat {after} has the wheel and did nothing"
        return ""

    def _is_above(self, seat: int) -> bool:
        """Whether somebody else drives whom ``seat`` can't outrank."""
        return self.driver not in (seat, NOBODY) and self.seats[self.driver] >= self.seats[seat]

    def _take_driver(self, car: Arbiter, event: str, seat: int) -> None:
        if car.driver != self.driver:
            self.driver, self.sent, self.age_ms = car.driver, NEUTRAL, 0
            self.wanted -= {car.driver}
        if event in ("release", "gone"):
            self.wanted -= {seat}
        if event in ("move", "still") and seat == self.driver:
            self.sent, self.age_ms = (MOVES if event == "move" else STILLS)[seat], 0
            self.wanted -= {seat}
            if event == "move":
                self.runs_program = False
        if event in ("stall", "stop"):
            self.runs_program = False
            self.sent = NEUTRAL

    def _moves_rightly(self, car: Arbiter) -> str:
        if car.state == PROGRAM and not self.runs_program:
            return "the program drives unasked"
        if car.word not in MOVES.values():
            return ""
        if self.is_stopped:
            return "the wheels move though the car is stopped"
        if self.needs_neutral:
            return "the wheels move before a command with speed 0"
        if car.word != self.sent:
            return "the wheels follow no command of who drives"
        if self.age_ms > self.failsafe_ms:
            return "the wheels follow a command that isn't fresh"
        return ""

    def memory(self) -> tuple[Any, ...]:
        """All that its next words depend on."""
        flags = self.is_stopped, self.needs_neutral, self.runs_program
        return self.driver, self.sent, self.age_ms, self.wanted, flags


def take(car: Arbiter, event: str, seat: int, priority: int, now: int) -> int | bool | None:
    """Let ``car`` take an event."""
    if event == "move":
        return car.command(seat, priority, MOVES[seat], now)
    if event == "still":
        return car.command(seat, priority, STILLS[seat], now)
    if event == "request":
        return car.request(seat, priority, now)
    if event == "resume":
        return car.resume(seat, priority, now)
    if event in ("release", "gone"):
        return {"release": car.release, "gone": car.gone}[event](seat, now)
    if event == "wait":
        return car.tick(now)
    return {"stop": car.stop, "clear": car.clear, "stall": car.stall}[event]()


def twin(thing: Any) -> Any:
    copied = object.__new__(type(thing))
    copied.__dict__.update(thing.__dict__)
    return copied


def every_event() -> Iterator[tuple[str, int, int]]:
    """Event, seat and how long passes before it."""
    for seat in SEARCHED_SEATS:
        for event in ("move", "still", "request", "release", "gone", "resume"):
            yield event, seat, 0
    for event in ("stop", "clear", "stall"):
        yield event, 1, 0
    yield "wait", 1, 1


def test_no_sequence_of_events_moves_the_wheels_but_a_fresh_command_of_who_may_drive() -> None:
    """Goes through all sequences, of any length: what two sequences have led to alike goes on alike."""
    events = list(every_event())
    start = (
        Arbiter(SEARCHED_FAILSAFE_MS, SEARCHED_HAND_OVER_MS),
        Witness(SEARCHED_FAILSAFE_MS, SEARCHED_HAND_OVER_MS, SEARCHED_SEATS),
    )
    seen, frontier, depth, moved = set(), [(start, ())], 0, set()
    while frontier:
        depth += 1
        following = []
        for (car, witness), way in frontier:
            for event, seat, waited_ms in events:
                one, other = twin(car), twin(witness)
                # Time is told by how long ago the driver's command came, so that it can stand still in the search.
                one.commanded_ms = (one.commanded_ms - waited_ms) & TICKS_MASK
                answer = take(one, event, seat, SEARCHED_SEATS[seat], 0)
                fault = other.see(one, event, seat, waited_ms, answer)
                went = (*way, f"{event} {seat}")
                assert not fault, f"{fault}: {went}"
                if one.driver == NOBODY:
                    one.commanded_ms = 0
                key = (*one.__dict__.values(), *other.memory())
                if key not in seen:
                    seen.add(key)
                    following.append(((one, other), went))
                moved.add((car.state, one.state))
        frontier = following
    # The search has ended: behind this depth there is nothing new, however long a sequence grows.
    assert depth == SEARCHED_DEPTH
    assert moved >= {(state, next_state) for state, _, next_state in TABLE}


class AnyDrive(RuleBasedStateMachine):
    """The same, beyond the search: nine clients and a stick, real times, a clock that wraps."""

    @initialize(clock_ms=st.integers(0, TICKS_MASK) | st.integers(TICKS_MASK - 20_000, TICKS_MASK))
    def switch_on(self, clock_ms: int) -> None:
        self.clock_ms = clock_ms
        self.seats = dict.fromkeys(range(1, 10), CLIENT) | {10: LOCAL}
        self.car, self.witness = Arbiter(300, 5000), Witness(300, 5000, self.seats)

    @rule(
        event=st.sampled_from(["move"] * 6 + ["still"] * 3 + ["request", "release", "gone", "stop", "clear", "stall"]),
        seat=st.sampled_from([1, 1, 1, 2, 2, 3, 9, 10]),
    )
    def take(self, event: str, seat: int) -> None:
        self._see(event, seat, 0)

    @rule(seat=st.integers(1, 10))
    def resume(self, seat: int) -> None:
        self._see("resume", seat, 0)

    @rule(waited_ms=st.integers(0, 40) | st.sampled_from([299, 300, 301, 4999, 5000, 5001, 40_000]))
    def wait(self, waited_ms: int) -> None:
        self.clock_ms = (self.clock_ms + waited_ms) & TICKS_MASK
        self._see("wait", 1, waited_ms)

    def _see(self, event: str, seat: int, waited_ms: int) -> None:
        answer = take(self.car, event, seat, self.seats[seat], self.clock_ms)
        assert not self.witness.see(self.car, event, seat, waited_ms, answer)


TestAnyDrive = AnyDrive.TestCase
TestAnyDrive.settings = settings(stateful_step_count=60)


@pytest.fixture
def car() -> Arbiter:
    return Arbiter(300, 5000)


def state(car: Arbiter) -> str:
    return STATES[car.state][0]


def test_the_first_to_send_drives_and_others_watch(car: Arbiter) -> None:
    assert car.command(1, CLIENT, MOVES[1], 0) == APPLIED
    assert car.command(2, CLIENT, MOVES[2], 10) == WATCHING
    assert (car.word, car.driver) == (MOVES[1], 1)


def test_a_command_counts_for_300_ms_and_not_for_one_more(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    assert car.tick(300) == 1
    assert car.word == MOVES[1]
    car.tick(301)
    assert (state(car), car.word) == ("failsafe", NEUTRAL)


@pytest.mark.parametrize("now", [0, TICKS_MASK - 100])
def test_the_next_tick_is_due_when_something_happens(car: Arbiter, now: int) -> None:
    car.command(1, CLIENT, MOVES[1], now)
    due = car.tick((now + 100) & TICKS_MASK)
    assert due == 201
    due = car.tick((now + 301) & TICKS_MASK)
    assert (state(car), due) == ("failsafe", 4700)
    car.tick((now + 301 + due) & TICKS_MASK)
    assert car.driver == NOBODY


def test_after_a_failsafe_one_command_with_speed_0_arms(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    assert car.command(1, CLIENT, MOVES[1], 400) == NEEDS_NEUTRAL
    assert car.word == NEUTRAL
    assert car.command(1, CLIENT, STILLS[1], 410) == APPLIED
    assert car.word == STILLS[1]
    assert car.command(1, CLIENT, MOVES[1], 420) == APPLIED
    assert car.word == MOVES[1]


def test_who_stood_still_before_the_silence_drives_on_at_once(car: Arbiter) -> None:
    car.command(1, CLIENT, STILLS[1], 0)
    car.tick(2000)
    assert (state(car), car.word) == ("ready", NEUTRAL)
    assert car.command(1, CLIENT, MOVES[1], 2000) == APPLIED


def test_a_driver_who_gives_back_leaves_a_car_that_the_next_command_drives(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    car.release(1, 10)
    assert (state(car), car.word) == ("ready", NEUTRAL)
    assert car.command(2, CLIENT, MOVES[2], 20) == APPLIED


def test_a_driver_who_is_gone_while_moving_leaves_a_car_that_needs_arming(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    car.gone(1, 10)
    assert (state(car), car.driver) == ("failsafe", NOBODY)
    assert car.command(2, CLIENT, MOVES[2], 20) == NEEDS_NEUTRAL
    assert car.command(2, CLIENT, STILLS[2], 30) == APPLIED


def test_a_driver_who_is_gone_while_standing_leaves_a_centred_car_that_the_next_command_drives(car: Arbiter) -> None:
    car.command(1, CLIENT, STILLS[1], 0)
    car.gone(1, 10)
    assert (state(car), car.word) == ("ready", NEUTRAL)
    assert car.command(2, CLIENT, MOVES[2], 20) == APPLIED


def test_who_takes_over_waits_no_longer_for_the_wheel(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    assert car.request(2, LOCAL, 10) is False
    car.command(2, LOCAL, MOVES[2], 20)
    car.command(2, LOCAL, STILLS[2], 30)
    assert (state(car), car.word, car.wanted_by) == ("standing", STILLS[2], NOBODY)


def test_a_watcher_who_leaves_changes_nothing(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    car.request(2, CLIENT, 5)
    car.gone(2, 10)
    car.command(1, CLIENT, STILLS[1], 20)
    assert (car.driver, state(car)) == (1, "standing")


def test_five_seconds_after_the_drivers_last_command_anybody_may_drive(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    assert car.command(2, CLIENT, STILLS[2], 5000) == WATCHING
    assert car.command(2, CLIENT, STILLS[2], 5001) == APPLIED
    assert car.command(1, CLIENT, STILLS[1], 5002) == WATCHING


def test_a_refused_command_of_the_driver_is_a_sign_of_life(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    assert car.command(1, CLIENT, MOVES[1], 4000) == NEEDS_NEUTRAL
    assert car.command(2, CLIENT, STILLS[2], 8000) == WATCHING


def test_the_wheel_passes_to_who_asked_once_the_car_stands(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    assert car.request(2, CLIENT, 10) is False
    assert car.request(3, CLIENT, 11) is False
    assert car.word == MOVES[1]
    assert car.command(1, CLIENT, STILLS[1], 20) == APPLIED
    assert (car.driver, state(car)) == (2, "ready")
    assert car.command(1, CLIENT, MOVES[1], 30) == WATCHING
    assert car.command(2, CLIENT, MOVES[2], 40) == APPLIED


def test_who_asks_while_the_car_stands_has_the_wheel_at_once(car: Arbiter) -> None:
    assert car.request(2, CLIENT, 0) is True
    assert car.command(1, CLIENT, MOVES[1], 10) == WATCHING
    car.command(2, CLIENT, STILLS[2], 20)
    assert car.request(1, CLIENT, 30) is True


def test_who_asked_gets_the_wheel_from_one_who_fell_silent(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    car.request(2, CLIENT, 10)
    car.tick(301)
    assert (car.driver, state(car)) == (2, "failsafe")


def test_the_stick_at_the_car_takes_over_at_once_and_keeps_the_wheel(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    assert car.command(2, LOCAL, MOVES[2], 10) == APPLIED
    assert car.command(1, CLIENT, MOVES[1], 20) == WATCHING
    car.command(2, LOCAL, STILLS[2], 30)
    assert car.request(1, CLIENT, 40) is False
    car.tick(5031)
    assert car.driver == 1


def test_nothing_moves_after_an_emergency_stop_until_it_is_lifted_and_the_car_armed(car: Arbiter) -> None:
    car.command(1, CLIENT, MOVES[1], 0)
    car.stop()
    assert car.word == NEUTRAL
    for word in (STILLS[1], MOVES[1]):
        assert car.command(1, CLIENT, word, 10) == HALTED
    assert car.command(2, LOCAL, MOVES[2], 15) == HALTED
    assert car.resume(1, CLIENT, 20) is False
    car.clear()
    assert car.command(1, CLIENT, MOVES[1], 30) == NEEDS_NEUTRAL
    assert car.command(1, CLIENT, STILLS[1], 40) == APPLIED
    assert car.command(1, CLIENT, MOVES[1], 50) == APPLIED


def test_a_program_yields_to_a_driver_and_goes_on_when_told(car: Arbiter) -> None:
    assert car.resume(1, CLIENT, 0) is True
    assert (state(car), car.word) == ("program", NEUTRAL)
    assert car.command(1, CLIENT, STILLS[1], 10) == YIELDED
    assert car.command(1, CLIENT, MOVES[1], 20) == APPLIED
    assert car.resume(2, CLIENT, 30) is False
    assert car.word == MOVES[1]
    assert car.resume(1, CLIENT, 40) is True
    assert (state(car), car.word, car.driver) == ("program", NEUTRAL, NOBODY)


def test_an_emergency_stop_ends_the_program_too(car: Arbiter) -> None:
    car.resume(1, CLIENT, 0)
    car.stop()
    car.clear()
    assert state(car) == "failsafe"


@pytest.mark.parametrize("before", ["ready", "standing", "moving", "program"])
def test_after_a_stall_nothing_old_counts(car: Arbiter, before: str) -> None:
    if before == "program":
        car.resume(1, CLIENT, 0)
    elif before != "ready":
        car.command(1, CLIENT, MOVES[1] if before == "moving" else STILLS[1], 0)
    assert state(car) == before
    car.stall()
    assert car.command(1, CLIENT, MOVES[1], 250) == NEEDS_NEUTRAL
    assert car.command(1, CLIENT, STILLS[1], 260) == APPLIED


def test_the_table_has_each_case_once_and_leads_somewhere() -> None:
    cases = [(state, event) for state, event, _ in TABLE]
    assert len(set(cases)) == len(cases)
    assert all(state != following for state, _, following in TABLE)
    assert len(NEXT) == len(STATES)
    assert all(len(row) == len(EVENTS) for row in NEXT)
