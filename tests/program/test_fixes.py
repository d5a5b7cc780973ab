"""Steps that can't be sent, or can't be done together: one other duration fixes them."""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from hypothesis import event, given
from hypothesis import strategies as st

from motorcade import Program, avoid, compile_program, forward, led, repeat, together, wait
from motorcade.program.diagnostics import has_errors
from motorcade.program.steps import Step
from support.strategies import CLASSROOM

SENT = replace(CLASSROOM, durations_ms=(0, 400, 600, 1000), dwell_ms=(400, 600, *CLASSROOM.dwell_ms[2:]))
DONE = replace(CLASSROOM, durations_ms=(0, 3000, 5000, 7000))


def steps_of(seconds: list[float]) -> st.SearchStrategy[list[Step]]:
    """Steps alone, in a together, and repeated, of these durations."""
    lengths = st.sampled_from(seconds)
    step = st.one_of(
        st.builds(wait, lengths),
        st.builds(lambda one, other: together(forward(one), led(1, other)), lengths, lengths),
        st.builds(
            lambda *each: together(forward(each[0]), led(1, each[1]), avoid(1, each[2])), lengths, lengths, lengths
        ),
    )
    return st.lists(st.one_of(step, st.builds(lambda inner: repeat(2, inner), step)), min_size=1, max_size=4)


def with_fix(steps: Sequence[Step], path: str, value: object) -> Sequence[Step]:
    """The steps with another duration of the one at the path."""
    return lasting(steps, [int(place) for place in re.findall(r"\[(\d+)\]", path)], value)


def lasting(steps: Any, places: list[int], seconds: object) -> Sequence[Step]:
    """The same with the step at these places, the outermost first."""
    first, *inner = places
    step = steps[first]
    changed = (
        replace(step, steps=tuple(lasting(step.steps, inner, seconds))) if inner else replace(step, seconds=seconds)
    )
    return [*steps[:first], changed, *steps[first + 1 :]]


@given(steps_of([0, 0.4, 0.6, 0.8, 1, 1.4, 2]))
def test_one_other_duration_fixes_steps_that_cannot_be_sent(steps: list[Step]) -> None:
    for each in compile_program(Program([wait(1)], steps), SENT).diagnostics:
        for fix in each.fixes if each.code == "dwell-not-expressible" else ():
            event(str(each.details["reason"]))
            right = with_fix(steps, each.path, fix.value)
            assert not has_errors(compile_program(Program([wait(1)], right), SENT).diagnostics)


@given(steps_of([0, 3, 5, 6, 7, 8, 10]))
def test_one_other_duration_fixes_blocks_that_cannot_go_together(steps: list[Step]) -> None:
    for each in compile_program(Program(steps), DONE).diagnostics:
        for fix in each.fixes:
            right = with_fix(steps, each.path, fix.value)
            assert each.path not in [other.path for other in compile_program(Program(right), DONE).diagnostics]


def test_each_reason_has_its_durations() -> None:
    def offered(steps: list[Step]) -> list[tuple[str, list[object]]]:
        found = compile_program(Program([wait(1)], steps), SENT).diagnostics
        return [(each.path, [fix.value for fix in each.fixes]) for each in found]

    # No dwell in common; a step that takes no time; one that no dwell divides.
    assert offered([led(0, 0.4), led(1, 0.6)]) == [("followers.steps[0]", [0.6])]
    assert offered([wait(0), wait(0.4)]) == [("followers.steps[0]", [0.4])]
    assert offered([together(forward(1), led(1, 0.4))]) == [("followers.steps[0].together[0]", [0.8, 1.2])]
    # Two steps are wrong, so no one value fixes it.
    assert offered([wait(0), wait(0)]) == [("followers.steps[0]", [])]

    (found,) = compile_program(Program([together(forward(8), led(1, 7))]), DONE).diagnostics
    assert (found.path, [fix.value for fix in found.fixes]) == ("leader[0].together[0]", [7, 10])
    # Two blocks are the longest.
    (found,) = compile_program(Program([together(forward(8), led(1, 8), avoid(1, 7))]), DONE).diagnostics
    assert (found.path, found.fixes) == ("leader[0]", ())
