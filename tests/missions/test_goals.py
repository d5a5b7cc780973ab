"""Each kind of goal, by moments and events that a test makes up: what came of it, and which moment and cars show it."""

import math

import pytest

from motorcade.locales import languages
from motorcade.missions.check import grade_of
from motorcade.missions.goal import EVERY_MS, TIMES
from motorcade.missions.schema import GOALS
from motorcade.missions.watch import MissionWatch, goal_phrase
from motorcade.program.compiler import compile_program
from motorcade.program.model import Program
from motorcade.program.steps import wait
from support.made_up_runs import (
    ALL_HEARD,
    BARE,
    FIRST,
    IN,
    OUT,
    SECOND,
    TAGGED,
    ZONE,
    at,
    begins,
    mission,
    moment,
    outcome,
    run_seen,
    watched,
)

SOME, ALWAYS = {"at": "some-moment"}, {"at": "always"}
OUTSIDE = {**ZONE, "kind": "out-of-zone"}
LIT = {"kind": "lit", "who": "followers"}
NEAR = {"kind": "together", "who": "followers", "metres": 1.0}
WAY = {"kind": "travelled", "who": [FIRST]}
FACES = {"kind": "heading", "who": [FIRST]}
BY = {"kind": "all-by", "goal": 1, "seconds": 0.3}
SOME_HEARD = [each for each in ALL_HEARD if each[:2] != (1100, SECOND)]


def apart(*metres):
    """Moments at which the followers are so far apart, and the leader stands between them."""
    return [{"x": (0.5, 1.0, x), "y": (2.0, 1.0, 1.0)} for x in metres]


def leds(*shown):
    return [{"led": each} for each in shown]


def facing(degrees):
    return [{"heading": (0, math.radians(degrees), 0)}]


@pytest.mark.parametrize(
    ("goal", "moments", "expected"),
    [
        (ZONE, [OUT, IN], ("met", 100)),
        (ZONE, [IN, OUT, IN], ("met", 200)),
        (ZONE, [IN, OUT], ("lost", 100, FIRST)),
        (ZONE | SOME, [OUT, IN, OUT], ("met", 100)),
        # Nearest to the zone at 0.2 s.
        (ZONE | SOME, [OUT, at(1.5), at(1.9), at(1.5), OUT], ("lost", 200, FIRST)),
        (ZONE | ALWAYS, [IN], ("met", 1000)),
        (ZONE | ALWAYS, [IN, OUT, IN], ("lost", 100, FIRST)),
        ({**ZONE, "zone": "lake"}, [at(2.6)], ("met", 0)),
        ({**ZONE, "zone": "lake"}, [at(2.4)], ("lost", 1000, FIRST)),
        ({**ZONE, "who": "followers"}, [IN], ("lost", 1000, SECOND)),
        ({**ZONE, "who": "followers", "share": 0.5}, [IN], ("met", 0)),
        (OUTSIDE, [OUT], ("met", 1000)),
        (OUTSIDE, [OUT, IN, OUT], ("lost", 100, FIRST)),
        ({**OUTSIDE, "at": "end"}, [IN, OUT], ("met", 100)),
        (OUTSIDE | SOME, [IN], ("lost", 1000, FIRST)),
        # A part of the run.
        ({**ZONE, **ALWAYS, "from_s": 0.2}, [OUT, OUT, IN], ("met", 1000)),
        ({**ZONE, **ALWAYS, "from_s": 0.1}, [OUT, OUT, IN], ("lost", 100, FIRST)),
        ({**ZONE, **ALWAYS, "from_s": 0.2, "until_s": 0.4}, [OUT, OUT, IN], ("met", 400)),
        ({**ZONE, "until_s": 0.1}, [OUT, OUT, IN], ("lost", 100, FIRST)),
        ({**ZONE, **SOME, "until_s": 0.1}, [OUT, OUT, IN], ("lost", 100, FIRST)),
        ({**ZONE, **SOME, "from_s": 0.3}, [OUT, OUT, IN], ("met", 300)),
        # Headings go round a full turn.
        ({**FACES, "degrees": 90}, facing(100), ("met", 0)),
        ({**FACES, "degrees": 90}, facing(106), ("lost", 1000, FIRST)),
        ({**FACES, "degrees": -170}, facing(175), ("met", 0)),
        ({**FACES, "degrees": 180}, facing(-179), ("met", 0)),
        ({**FACES, "degrees": 0}, facing(-16), ("lost", 1000, FIRST)),
        ({**LIT, "led": 2}, leds((4, 2, 4)), ("lost", 1000, SECOND)),
        ({**LIT, "led": 2}, leds((4, 2, 4), (4, 4, 2)), ("met", 100)),
        ({**LIT, "led": 2, "at": "end"}, leds((4, 2, 4), (4, 2, 2)), ("met", 100)),
        ({**LIT, "led": "off", **ALWAYS}, leds((2, 4, 4)), ("met", 1000)),
        # No LED is on before the first tick.
        ({**LIT, "led": 2, **ALWAYS}, leds((4, 4, 4), (4, 2, 2)), ("met", 1000)),
        ({**LIT, "led": "off", **ALWAYS}, leds((4, 4, 4), (4, 0, 4)), ("lost", 100, FIRST)),
        # The two cars count that are farthest apart.
        (NEAR, apart(1.5, 3.0), ("lost", 1000, FIRST, SECOND)),
        (NEAR, apart(3.0, 1.5), ("met", 100)),
        (NEAR | SOME, apart(3.0, 1.5, 3.0), ("met", 100)),
        (NEAR | ALWAYS, apart(1.5, 3.0, 1.5), ("lost", 100, FIRST, SECOND)),
        (NEAR | ALWAYS, apart(1.5), ("met", 1000)),
        ({"kind": "no-touch"}, [{}], ("met", 1000)),
        ({"kind": "no-touch"}, [{}, {"x": (0.5, 1.0, 1.155), "touching_ms": 7}], ("lost", 100, FIRST, SECOND)),
        # Another goal was met so early, and is lost again where the car drives on.
        ([ZONE, BY], [OUT] * 3 + [IN], ("met", 300)),
        ([ZONE, BY], [OUT] * 4 + [IN], ("lost", 300, FIRST)),
        ([ZONE, BY], [OUT], ("lost", 300, FIRST)),
        ([ZONE, BY], [OUT, IN, IN, IN, IN, OUT], ("lost", 500, FIRST)),
        ([ZONE, BY], [OUT, IN, IN, IN, IN, OUT, IN], ("lost", 500, FIRST)),
        # What is compared is what a sentence shows: a car that 'drove 3.00 m' has driven 3 m.
        (ZONE, [{}, at(1.994)], ("lost", 1000, FIRST)),
        (ZONE, [{}, at(1.996)], ("met", 100)),
        ({**WAY, "least_m": 3}, [{}, at(3.994)], ("lost", 1000, FIRST)),
        ({**WAY, "least_m": 3}, [{}, at(3.996)], ("met", 100)),
        ({**WAY, "most_m": 3}, [{}, at(4.006)], ("lost", 100, FIRST)),
        ({**WAY, "most_m": 3}, [{}, at(4.004)], ("met", 0)),
        (NEAR, [{}, at(2.506)], ("lost", 1000, FIRST, SECOND)),
        (NEAR, [{}, at(2.504)], ("met", 0)),
        ({**FACES, "degrees": 0}, facing(15.6), ("lost", 1000, FIRST)),
        ({**FACES, "degrees": 0}, facing(15.4), ("met", 0)),
    ],
)
def test_a_goal_is_met_or_lost_at_a_moment_by_a_car(goal, moments, expected):
    assert outcome(goal, moments) == expected


@pytest.mark.parametrize(
    ("goals", "moments", "said"),
    [
        (
            [{**ZONE, "who": "followers"}],
            [{"x": (0.5, 1.75, 3)}],
            "car 1 stands 25 cm away from home; 1 of 2 cars are in it",
        ),
        ([ZONE], [at(1.75)], "the car stands 25 cm away from home"),
        ([ZONE], [{}], "the car did not drive at all"),
        ([{**ZONE, "at": "some-moment"}], [{}, at(1.75)], "the car came no nearer to home than 25 cm"),
        ([ZONE], [at(3)], "done"),
        ([{**WAY, "most_m": 1}], [{}, at(2.5)], "at 0.1 s the car drove 150 cm, and 100 cm are the most"),
        ([{**WAY, "least_m": 2}], [{}, at(2.5)], "the car drove only 150 cm of 200 cm"),
        (
            [{"kind": "no-touch"}],
            [{}, {}, {"x": (0.5, 1.0, 1.155), "touching_ms": 7}],
            "at 0.2 s car 1 and car 2 touched",
        ),
        (
            [ZONE, BY],
            [OUT, IN, IN, IN, IN, at(1.9)],
            "it was done within 0.3 s, but not to the end: at 0.5 s the car drove out of home",
        ),
    ],
)
def test_a_sentence_says_which_car_and_by_how_much(goals, moments, said):
    assert watched(goals, moments)[-1].why.sentence().startswith(said)


def test_who_touches_a_wall_is_named():
    wall = watched([{"kind": "no-touch"}], [{"x": (0.5, 1.0, 5.9), "touching_ms": 7}], walled=True)[0]
    assert wall.why.sentence().startswith("at 0.0 s car 2 touched a wall or an obstacle")
    assert wall.cars == (SECOND,)


@pytest.mark.parametrize(
    ("bounds", "expected"),
    [
        ({"least_m": 0.9}, ("met", 900)),
        ({"least_m": 1.1}, ("lost", 1000)),
        ({"most_m": 1.1}, ("met", 0)),
        ({"most_m": 0.45}, ("lost", 500)),
        ({"least_m": 0.5, "most_m": 1.5}, ("met", 500)),
        ({"least_m": 0.1, "most_m": 0.5}, ("lost", 600)),
    ],
)
def test_travelled_adds_up_the_way_between_moments(bounds, expected):
    there_and_back = [at(1 + 0.1 * (number if number < 6 else 10 - number) + 0.001 * number) for number in range(11)]
    progress, t_ms, *_ = outcome(WAY | bounds, there_and_back)
    assert (progress, t_ms) == (expected[0], pytest.approx(expected[1], abs=100))


@pytest.mark.parametrize(
    ("events", "share", "expected"),
    [
        (ALL_HEARD, 1, ("met", 3000)),
        # The first word is missed where its time ends.
        (ALL_HEARD[1:], 1, ("lost", 1000, FIRST)),
        (ALL_HEARD[1:], 0.8, ("met", 3000)),
        (ALL_HEARD[2:], 0.8, ("lost", 1000, FIRST)),
        (SOME_HEARD, 1, ("lost", 2000, SECOND)),
        # Once in a slot is enough, and in the slot after it is in time.
        ([*ALL_HEARD[:-1], begins(2100, FIRST)], 1, ("lost", 3000, SECOND)),
        ([], 0.01, ("lost", 1000, FIRST)),
    ],
)
def test_heard_counts_the_words_that_cars_begin(events, share, expected):
    goal = {"kind": "heard", "who": "followers", "share": share}
    assert outcome(goal, [{}], events, seconds=3.0) == expected


def test_heard_says_who_never_heard_a_word():
    events = [each for each in ALL_HEARD if each[1] == FIRST]
    state = watched([{"kind": "heard", "who": "followers"}], [{}], events, seconds=3.0)[0]
    assert state.why.sentence("en") == "car 2 never heard any of 3 words"


def test_a_tagged_word_counts_for_the_slot_that_its_tag_names():
    late = [begins(1900 + car, car, tag=1 + slot) for slot in range(2) for car in (FIRST, SECOND)]
    goal = {"kind": "heard", "who": "followers"}
    assert outcome(goal, [{}], late, seconds=2.0, program=TAGGED)[0] == "met"
    assert outcome(goal, [{}], late[:3], seconds=2.0, program=TAGGED)[0] == "lost"


@pytest.mark.parametrize(
    ("events", "within_ms", "expected"),
    [
        (ALL_HEARD, 50, ("met", 3000)),
        (ALL_HEARD, 49, ("lost", 100, SECOND)),
        (ALL_HEARD[:-1], 50, ("lost", 3000, SECOND)),
        (SOME_HEARD, 60, ("lost", 2000, SECOND)),
        (sorted([*SOME_HEARD, begins(1400, SECOND)]), 60, ("lost", 1400, SECOND)),
    ],
)
def test_in_step_measures_from_the_first_to_the_last_car(events, within_ms, expected):
    goal = {"kind": "in-step", "who": "followers", "within_ms": within_ms}
    assert outcome(goal, [{}], events, seconds=3.0) == expected


DRIVES, STANDS = {"wheels": (2, 2, 2)}, {"wheels": (0, 0, 0)}


@pytest.mark.parametrize(
    ("moments", "expected"),
    [
        # 'Stop' is said at 0.2 s, a car may take until 0.5 s, and 'go' is said at 0.8 s.
        ([DRIVES] * 4 + [STANDS] * 5 + [DRIVES], "met"),
        ([DRIVES] * 4 + [STANDS] * 2 + [DRIVES], "lost"),
        ([DRIVES] * 11, "lost"),
        ([STANDS] * 11, "lost"),
    ],
)
def test_stopped_by_voice(moments, expected):
    assert outcome({"kind": "stopped-by-voice", "who": "followers"}, moments)[0] == expected


@pytest.mark.parametrize(
    ("goal", "expected"),
    [
        ({"kind": "words-at-most", "count": 1}, "met"),
        ({"kind": "words-at-most", "count": 0}, "lost"),
        ({"kind": "states-at-most", "count": 2}, "met"),
        ({"kind": "states-at-most", "count": 1}, "lost"),
        ({"kind": "seconds-at-most", "seconds": 2}, "met"),
        ({"kind": "seconds-at-most", "seconds": 1.9}, "lost"),
    ],
)
def test_a_goal_of_the_program(goal, expected):
    assert outcome(goal, [{}]) == (expected, 0)


def test_a_program_twice_as_long_as_is_asked_for_counts_half():
    assert run_seen([{"kind": "seconds-at-most", "seconds": 1}], [{}]).grades() == [0.5]


def test_while_a_run_goes_on_a_goal_is_open_or_holds():
    goals = [ZONE, {"kind": "no-touch"}, {"kind": "all-by", "goal": 1, "seconds": 0.9}]
    # How far a car drives at most is known at the end.
    near = {"kind": "travelled", "who": [SECOND], "most_m": 1}
    wanted = mission(*goals, near)
    watch = MissionWatch(wanted, compile_program(BARE, wanted.profile).image)
    seen = []
    for number, shown in enumerate([OUT, IN, OUT, IN]):
        watch.see(moment(number * EVERY_MS, **shown))
        seen.append([state.progress for state in watch.states()])
    assert seen == [["open", "holds", "open", "holds"], ["holds"] * 4] * 2
    watch.see(moment(1000, **IN))
    assert [state.progress for state in watch.states()] == ["met"] * 4
    watch.see(moment(1100, **OUT))
    assert [state.progress for state in watch.states()] == ["met"] * 4


@pytest.mark.parametrize("goal", [{"kind": "heard"}, {"kind": "in-step", "within_ms": 200}])
def test_a_leader_that_sends_nothing_has_lost_only_once_it_drives(goal):
    wanted = mission({"who": "followers", **goal})
    watch = MissionWatch(wanted, compile_program(Program([wait(1)]), wanted.profile).image)
    seen = []
    for t_ms in (0, EVERY_MS):
        watch.see(moment(t_ms))
        seen.append(watch.states()[0].progress)
    assert seen == ["open", "lost"]


def test_every_goal_is_described_in_every_language():
    values = {"zone": "home", "led": 1, "degrees": 5, "metres": 5, "within_ms": 100, "count": 1, "seconds": 1}
    values |= {"who": "followers", "share": 0.5, "goal": 1, "least": 1, "most_m": 2}
    goals = []
    for kind, known in GOALS.items():
        goal = {"kind": kind, "star": 2, **{name: value for name, value in values.items() if name in known.fields}}
        goals += [{**goal, "at": when} for when in TIMES] if "at" in known.fields else [goal]
    goals += [{**LIT, "led": "off", "at": when} for when in TIMES]
    goals += [WAY | bounds for bounds in ({"least_m": 1}, {"least_m": 1, "most_m": 2})]
    goals += [{**LIT, "led": 1, **window} for window in ({"from_s": 1}, {"until_s": 1}, {"from_s": 1, "until_s": 2})]
    for first in range(0, len(goals), 20):
        wanted = mission(ZONE, *goals[first : first + 20])
        for language in languages():
            told = [goal_phrase(goal, wanted).sentence(language) for goal in wanted.goals[1:]]
            assert len(set(told)) == len(told)
            assert "{" not in "".join(told)


@pytest.mark.parametrize(
    ("who", "named"),
    [
        ({"who": "leader"}, "the leader"),
        ({"who": "followers"}, "all 2 followers"),
        ({"who": "followers", "share": 0.5}, "at least 1 of all 2 followers"),
        ({"who": [FIRST]}, "car 1"),
        ({"who": [FIRST, 2]}, "cars 1, 2"),
    ],
)
def test_a_goal_says_of_which_cars_it_is(who, named):
    wanted = mission({**ZONE, **who})
    assert goal_phrase(wanted.goals[0], wanted).sentence("en").endswith(f": {named}")


NEARER = at(1.5)
BUMP, LONG_BUMP = {"touching_ms": 100}, {"touching_ms": 2000}


@pytest.mark.parametrize(
    ("goals", "runs"),
    [
        ([ZONE], ([OUT], [NEARER], [IN])),
        ([{**ZONE, "at": "always"}], ([IN, IN, OUT], [IN, IN, IN, OUT], [IN])),
        (
            [{"kind": "heading", "who": [FIRST], "degrees": 180}],
            ([{}], [{"heading": (0, 1, 0)}], [{"heading": (0, 3, 0)}]),
        ),
        ([{"kind": "travelled", "who": [FIRST], "least_m": 1}], ([OUT, at(1.2)], [OUT, NEARER], [OUT, IN])),
        ([{"kind": "travelled", "who": [FIRST], "most_m": 0.3}], ([OUT, IN], [OUT, NEARER], [OUT])),
        ([{"kind": "together", "who": [FIRST, SECOND], "metres": 0.1}], ([at(3)], [IN], [NEARER])),
        ([{"kind": "lit", "led": 1}], ([{}], [{"led": (1, 1, 4)}], [{"led": (1, 1, 1)}])),
        ([{"kind": "no-touch"}], ([{}, LONG_BUMP], [{}, BUMP], [{}])),
        ([ZONE, {"kind": "all-by", "goal": 1, "seconds": 0.3}], ([OUT], [OUT] * 6 + [IN], [OUT, IN])),
    ],
)
def test_a_run_that_comes_nearer_to_a_goal_has_a_higher_grade_and_only_one_that_meets_it_has_1(goals, runs):
    far, near, met = (run_seen(goals, moments).grades()[-1] for moments in runs)
    assert 0 <= far < near < 1
    assert met == 1


@pytest.mark.parametrize("goal", [{"kind": "heard"}, {"kind": "in-step", "within_ms": 60}])
def test_the_grade_of_a_goal_about_words_counts_those_that_went_well(goal):
    goals = [{"who": "followers", **goal}]
    grades = [run_seen(goals, [{}], events, seconds=3.0).grades()[0] for events in ([], SOME_HEARD, ALL_HEARD)]
    assert 0 == grades[0] < grades[1] < grades[2] == 1


@pytest.mark.parametrize(
    ("stars", "grades", "expected"),
    [
        ((1, 2, 3), (1.0, 1.0, 1.0), 1),
        ((1, 2), (1.0, 0.5), 0.75),
        ((1, 2, 3), (0.0, 1.0, 1.0), 0),
        ((1, 1, 2), (1.0, 0.5, 1.0), 0.75),
    ],
)
def test_the_grade_of_a_run_counts_stars_alike_and_nothing_without_the_first(stars, grades, expected):
    assert grade_of(mission(*({**ZONE, "star": star} for star in stars)), grades) == expected
