"""Published scores, by hand-made runs whose scores follow from the formulas; and grading of many runs side by side."""

import math

import pytest

from motorcade.lab.grading import grade_runs
from motorcade.missions.check import check_program
from motorcade.missions.document import built_in_mission
from motorcade.missions.watch import MissionWatch
from motorcade.program.compiler import compile_program
from support.made_up_runs import BARE, mission, moment

MAT = {"size_m": [6, 2], "car": [{"at_m": [0.5, 1], "role": "leader"}, {"at_m": [1, 1]}, {"at_m": [1.5, 1]}]}


def score(goal, moments, **mat):
    """The score of a run of 1 s; ``moments`` are the cars' x and y, the last one stays."""
    wanted = mission({"least": 1000, **goal}, mat=MAT | mat)
    watch = MissionWatch(wanted, compile_program(BARE, wanted.profile).image)
    for number in range(11):
        x, y = moments[min(number, len(moments) - 1)]
        watch.see(moment(number * 100, x=x, y=y))
    return watch.states()[0].why.details["score"]


LEVEL = (1.0, 1.0, 1.0)


def test_gathered_counts_the_cars_in_the_zone_every_tenth_of_a_second_but_not_at_the_start():
    goal = {"kind": "gathered", "zone": "home"}
    assert score(goal, [((2.5, 3, 3.5), LEVEL)]) == 30
    assert score(goal, [((2.5, 3, 3.5), LEVEL), ((2.5, 0, 0), LEVEL)]) == 10
    # The disc has its radius.
    assert score({"kind": "gathered", "zone": "lake"}, [((2.49, 2.51, 3.49), LEVEL)]) == 20
    assert score({"kind": "gathered", "zone": "lake"}, [((3.3, 3.4, 3.0), (1.3, 1.4, 0.4))]) == 10


def test_covered_is_a_hundred_times_what_the_mean_distance_is_less_than_the_diameter():
    goal = {"kind": "covered", "zone": "lake"}
    # The mean distance of a disc's points from its centre is 2/3 of its radius.
    centre = score(goal, [((3, 9, 9), LEVEL)])
    assert centre == pytest.approx(100 * (2.5 - 2 / 3 * 0.5), abs=1)
    # A car on the dark counts for nothing, and without any car all points are 2.5 m away.
    dark = {"spot": [{"centre_m": [3, 1], "radius_m": 0.1}]}
    assert score(goal, [((3, 9, 9), LEVEL)], **dark) == 0
    assert score(goal, [((3, 3.2, 9), LEVEL)], **dark) < centre


def test_networked_is_the_area_around_the_largest_group_of_linked_cars():
    goal = {"kind": "networked", "zone": "home"}
    disc = math.pi * 0.25**2
    # Two cars 0.3 m apart are linked: two discs less their common part. The third one is alone.
    apart, common = 0.3, 2 * 0.25**2 * math.acos(0.6) - 0.15 * math.sqrt(4 * 0.25**2 - 0.3**2)
    assert score(goal, [((2.5, 2.5 + apart, 3.5), LEVEL)]) == pytest.approx(2 * disc - common, rel=0.02)
    assert score(goal, [((2.5, 3.0, 3.5), LEVEL)]) == pytest.approx(disc, rel=0.03)
    # What lies outside the zone is not covered.
    assert score(goal, [((2.0, 1, 5), LEVEL)]) == pytest.approx(disc / 2, rel=0.05)


def test_stopped_counts_off_standing_before_a_car_finds_the_zone_and_driving_after():
    goal = {"kind": "stopped", "zone": "home"}
    most = 2 * 3 * 10
    stand = ((0.5, 1.0, 1.5), LEVEL)
    assert score(goal, [stand]) == most - 10 * (3 + 3)
    drive = [((0.5 + 0.01 * k, 1.0 + 0.01 * k, 1.5 + 0.01 * k), LEVEL) for k in range(11)]
    assert score(goal, drive) == most - 10 * 3
    # At 0.1 s one car finds the zone; then all stand.
    found = ((0.6, 1.1, 2.5), LEVEL)
    assert score(goal, [stand, found]) == most - 3
    assert score(goal, [stand, found, *[((0.6, 1.1 + 0.01 * k, 2.5), LEVEL) for k in range(9)]]) == most - 3 - 8


@pytest.mark.parametrize("name", ["left-or-right", "pass-it-on", "come-together", "stop", "zebra-crossing"])
def test_runs_graded_side_by_side_have_the_grades_of_the_check(name):
    """Positions alone, all columns, events of words, a score, and a rule that is kept for a time."""
    wanted = built_in_mission(name)
    programs = [each for each in (wanted.solution, wanted.near_miss) if each]
    images = [compile_program(each, wanted.profile).image for each in programs]
    seeds = wanted.seeds
    numbers = [number for number in range(len(images)) for _ in seeds]
    graded = grade_runs(wanted, images, numbers, list(seeds) * len(images))
    for number, program in enumerate(programs):
        grades = [run.grade for run, of in zip(graded, numbers, strict=True) if of == number]
        assert sum(grades) / len(grades) == pytest.approx(check_program(wanted, program).grade, abs=1e-12)
    assert all(0 < run.coverage <= 1 for run in graded)
    # The one car at the crossing tells nobody anything.
    assert all((run.words > 0) == (name != "zebra-crossing") for run in graded)
