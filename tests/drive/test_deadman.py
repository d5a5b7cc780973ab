"""What a client sends and when: a command lives as long as its caller renews it, and no longer."""

import ast
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.drive import deadman
from motorcade.drive.deadman import EVENTS, FRESH_MS, STATES, TABLE, DeadmanSwitch
from motorcade.drive.stamps import stamp_at
from motorcade.drive.wire import stick_word
from motorcade.words.formats import DRIVE
from motorcade.words.ticks import later_ms

# What happens at a time; the rest has none.
TIMED = ("command", "release", "receive_failsafe")

CASES = json.loads(Path(__file__).with_name("deadman_cases.json").read_text(encoding="utf-8"))
# By whether a car that has stopped by itself is armed again, and the name.
SWITCHES = [
    pytest.param(who == "programs", case["steps"], id=f"{who}: {case['name']}")
    for who in ("persons", "programs")
    for case in CASES[who]
]


def do(switch, does, axes, at_ms):
    if does:
        getattr(switch, does)(*(axes or ()), *((at_ms,) if does in TIMED else ()))


def sent(switch, steps):
    """When each step is, and what is sent then."""
    told = []
    for at_ms, does, axes, _ in steps:
        do(switch, does, axes, at_ms)
        sends = switch.next(at_ms)
        told.append((at_ms, sends and list(sends)))
    return told


def wanted(steps):
    return [(at_ms, sends) for at_ms, _, _, sends in steps]


@pytest.mark.parametrize(("rearm", "steps"), SWITCHES)
def test_what_is_sent_when(rearm, steps):
    assert sent(DeadmanSwitch(FRESH_MS, rearm), steps) == wanted(steps)


@pytest.mark.parametrize(("now_ms", "stamp"), CASES["stamps"])
def test_a_stamp_counts_four_milliseconds_and_comes_round(now_ms, stamp):
    assert stamp_at(now_ms) == stamp


def test_a_case_fails_without_any_one_row_of_the_table():
    """So that a page's switch, which passes the same cases, has the same table in use."""
    tree = ast.parse(Path(deadman.__file__).read_text(encoding="utf-8"))
    rows = next(each.value.elts for each in tree.body if ast.unparse(each).startswith("TABLE = "))
    cases = [each.values for each in SWITCHES]
    missed = []
    for state, event, _ in TABLE:
        row = rows.pop(0)
        exec(compile(tree, "without a row", "exec"), changed := {})
        rows.append(row)
        if all(sent(changed["DeadmanSwitch"](FRESH_MS, rearm), steps) == wanted(steps) for rearm, steps in cases):
            missed.append((STATES[state][0], EVENTS[event][0]))
    assert missed == []


acts = st.lists(
    st.tuples(
        st.sampled_from(["speed", "still", "release", "order", "lose", "stand_first", "receive_failsafe", "next"]),
        st.integers(0, 400),
    ),
    max_size=60,
)


@given(acts=acts, rearm=st.booleans(), begin_ms=st.sampled_from([0, (1 << 30) - 1000]))
def test_no_speed_is_ever_sent_but_a_fresh_command_after_speed_0(acts, rearm, begin_ms):
    switch, now_ms, at_ms = DeadmanSwitch(FRESH_MS, rearm), begin_ms, 0
    commanded_at_ms, stood_since_loss, must_release = None, False, False
    for act, later in acts:
        now_ms, at_ms = later_ms(now_ms, later), at_ms + later
        if act == "speed":
            switch.command(0.5, 0, now_ms)
            commanded_at_ms = at_ms
        elif act == "still":
            switch.command(0, 0, now_ms)
            commanded_at_ms, must_release = None, False
        elif act == "next":
            sent = switch.next(now_ms)
            assert sent in (None, (0, 0), (0.5, 0))
            if commanded_at_ms is None or at_ms - commanded_at_ms > FRESH_MS:
                must_release = False
            stood_since_loss |= sent == (0, 0)
            if sent == (0.5, 0):
                assert commanded_at_ms is not None
                assert at_ms - commanded_at_ms <= FRESH_MS
                assert stood_since_loss
                assert not must_release
        else:
            do(switch, act, None, now_ms)
            if act == "lose":
                stood_since_loss = False
            if act in ("lose", "order"):
                must_release = switch.is_locked
            if act == "release":
                commanded_at_ms, must_release = None, False


@pytest.mark.parametrize(
    ("throttle", "steering", "angle", "direction", "speed"),
    [
        (0, 0, 90, 1, 0),
        (1, 0, 90, 1, 255),
        (-1, 0, 90, 0, 255),
        (0.4, -0.2, 108, 1, 102),
        (0, -1, 180, 1, 0),
        (0, 1, 0, 1, 0),
        (-0.0, 0.5, 45, 1, 0),
    ],
)
def test_a_stick_s_axes_become_the_fields_of_a_drive_word(throttle, steering, angle, direction, speed):
    values = DRIVE.decode(stick_word(throttle, steering))
    assert (values.angle, values.direction, values.speed) == (angle, direction, speed)


def test_an_axis_out_of_range_is_refused_by_name():
    for wrong in (1.001, -2, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="throttle is"):
            stick_word(wrong, 0)
        with pytest.raises(ValueError, match=r"steering is .*allowed: -1 to 1"):
            stick_word(0, wrong)
