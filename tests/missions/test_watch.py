"""What a lost goal shows: the moment and the cars by which one can see why, in numbers that agree with it."""

import math

import pytest

from support.made_up_runs import ALL_HEARD, FIRST, IN, OUT, SECOND, ZONE, at, begins, outcome, watched


def causes(goals, moments, *more, **options):
    """Of the last goal: the moment that shows why it was lost, and which cars."""
    state = watched(goals, moments, *more, **options)[-1]
    assert state.progress == "lost"
    return state.t_ms, state.cars


BY = {"kind": "all-by", "goal": 1, "seconds": 0.3}


@pytest.mark.parametrize(
    ("goals", "moments", "expected"),
    [
        ([ZONE], [OUT], (1000, (FIRST,))),
        # Met in time, and lost again: where the car drove on.
        ([ZONE, BY], [OUT, IN, IN, IN, IN, OUT], (500, (FIRST,))),
        ([ZONE, BY], [OUT, IN, IN, IN, IN, OUT, IN], (500, (FIRST,))),
        # Not met in time: where it should have been met.
        ([ZONE, BY], [OUT] * 6 + [IN], (300, (FIRST,))),
        ([ZONE, BY], [OUT], (300, (FIRST,))),
        # Nearest to the zone at 0.2 s.
        ([{**ZONE, "at": "some-moment"}], [OUT, at(1.5), at(1.9), at(1.5), OUT], (200, (FIRST,))),
        ([{**ZONE, "at": "always"}], [IN, IN, OUT, IN], (200, (FIRST,))),
        ([{"kind": "together", "who": "followers", "metres": 0.1}], [OUT], (1000, (SECOND, FIRST))),
        ([{"kind": "travelled", "who": "followers", "most_m": 0.1}], [OUT, at(1.5)], (100, (FIRST,))),
        ([{"kind": "no-touch"}], [{}, {"x": (0.5, 1.0, 1.155), "touching_ms": 7}], (100, (FIRST, SECOND))),
    ],
)
def test_a_lost_goal_names_the_moment_and_the_cars_that_show_why(goals, moments, expected):
    t_ms, cars = causes(goals, moments)
    assert (t_ms, {*cars}) == (expected[0], {*expected[1]})


def test_a_missed_word_is_shown_where_it_should_have_begun_and_by_the_car_that_missed_it():
    missed = [each for each in ALL_HEARD if each[:2] != (1100, SECOND)]
    for goal in ({"kind": "heard"}, {"kind": "in-step", "within_ms": 60}):
        assert causes([{"who": "followers", **goal}], [{}], missed, seconds=3.0) == (2000, (SECOND,))
    late = [*missed, begins(1400, SECOND)]
    step = {"kind": "in-step", "who": "followers", "within_ms": 60}
    assert causes([step], [{}], sorted(late), seconds=3.0) == (1400, (SECOND,))


def test_what_was_lost_again_says_when_and_why():
    state = watched([ZONE, BY], [OUT, IN, IN, IN, IN, at(1.9)])[-1]
    said = "goal 1 was met within 0.3 s, but not to the end. After 0.5 s: the car is 0.10 m away from home"
    assert state.why.sentence() == said


@pytest.mark.parametrize(
    ("goal", "short", "enough"),
    [
        ({"kind": "travelled", "who": [FIRST], "least_m": 3}, at(3.994), at(3.996)),
        ({"kind": "travelled", "who": [FIRST], "most_m": 3}, at(4.006), at(4.004)),
        (ZONE, at(1.994), at(1.996)),
        ({"kind": "together", "who": [FIRST, SECOND], "metres": 1}, at(2.506), at(2.504)),
        (
            {"kind": "heading", "who": [FIRST], "degrees": 0},
            {"heading": (0, math.radians(15.6), 0)},
            {"heading": (0, math.radians(15.4), 0)},
        ),
    ],
)
def test_what_is_compared_is_what_the_sentence_shows(goal, short, enough):
    """A car that 'drove 3.00 m' has driven 3 m."""
    assert outcome(goal, [{}, short])[0] == "lost"
    assert outcome(goal, [{}, enough])[0] == "met"
