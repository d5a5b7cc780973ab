"""Who drives: every sequence of events is tried, and none moves the wheels but a fresh command of who may drive."""

from collections.abc import Iterator
from typing import Any

import pytest

from motorcade.car.arbiter import DISARMED, NOBODY, TABLE, Arbiter
from motorcade.words.ticks import TICKS_MASK
from support.arbiter_witness import Witness, take

# Both are shorter for the search: it tries each millisecond.
SEARCHED_FAILSAFE_MS, SEARCHED_HAND_OVER_MS = 2, 4
SEARCHED_DEPTH = 17
# A third client could do nothing to the second that the second can't to the first.
SEARCHED_SESSIONS = (1, 2)


def twin(thing: Any) -> Any:
    copied = object.__new__(type(thing))
    copied.__dict__.update(thing.__dict__)
    return copied


def every_event() -> Iterator[tuple[str, int, int]]:
    """Event, session and how long passes before it."""
    for session in SEARCHED_SESSIONS:
        for event in ("move", "still", "switch", "request", "release", "gone", "resume"):
            yield event, session, 0
    for event in ("stop", "clear", "stall", "delay", "low", "charged"):
        yield event, 1, 0
    yield "wait", 1, 1


@pytest.mark.parametrize("arming", [False, True])
def test_no_sequence_of_events_moves_the_wheels_but_a_fresh_command_of_who_may_drive(arming: bool) -> None:
    """Goes through all sequences, of any length: what two sequences have led to alike goes on alike."""
    events = list(every_event())
    start = (
        Arbiter(SEARCHED_FAILSAFE_MS, SEARCHED_HAND_OVER_MS, arming),
        Witness(SEARCHED_FAILSAFE_MS, SEARCHED_HAND_OVER_MS, arming),
    )
    seen, frontier, depth, moved = set(), [(start, ())], 0, set()
    while frontier:
        depth += 1
        following = []
        for (car, witness), way in frontier:
            for event, session, waited_ms in events:
                one, other = twin(car), twin(witness)
                # Time is told by how long ago the driver's command came, so that it can stand still in the search.
                one.commanded_ms = (one.commanded_ms - waited_ms) & TICKS_MASK
                answer = take(one, event, session, 0)
                fault = other.see(one, event, session, waited_ms, answer)
                went = (*way, f"{event} {session}")
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
    expected = {(state, next_state) for state, _, next_state in TABLE if arming or DISARMED not in (state, next_state)}
    assert moved >= expected
