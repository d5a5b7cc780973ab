"""Many runs at once: the kernel that judges them says of each what the watches of one run say, moment by moment."""

from dataclasses import replace

import pytest

from motorcade.browser.kernels import open_worlds
from motorcade.engine.world import World
from motorcade.errors import MotorcadeError
from motorcade.missions.check import check_program, open_worlds_here, watched
from motorcade.missions.document import built_in_mission, mission_of, missions
from motorcade.missions.model import Goal
from motorcade.missions.odds import Odds, other_seeds, works
from motorcade.missions.other_goals import Works
from motorcade.missions.watch import ManyRuns, MissionWatch, attempt_of, run_to_next
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.steps import forward, led, wait
from support.linear_instance import MockInstance
from support.made_up_runs import MAT, SQUARE
from support.soak import SOAK
from support.worlds import digest

# Each kind of goal is in one of them; `make soak` takes all.
SOME = ("the-square", "stop-all", "come-together", "two-words", "noisy-air")
SHELLS = {"server": open_worlds_here, "site": open_worlds(MockInstance)}
SEEDS = (3, 17, 4_000_000_000)


def image_of(mission, program):
    return compile_program(program, mission.profile).image


def tried(mission, image, seeds, opened=open_worlds_here):
    odds = Odds(mission, image, seeds, opened)
    trials = []
    while not odds.is_over:
        trials += odds.advance()
    return trials


def seen(mission, image, seeds):
    """The same by watches that see all moments of each run."""
    watches = {seed: MissionWatch(mission, image) for seed in seeds}
    world = World(mission.mat, [image], mission.profile, seeds=seeds, events=True, threads=1)
    for sight in watched(world, mission):
        watches[sight.seed].see(sight.moment, sight.begun)
    kinds = [goal.kind for goal in mission.goals]
    return [
        (seed, [kind == Works.name or each.progress == "met" for kind, each in zip(kinds, watch.states(), strict=True)])
        for seed, watch in watches.items()
    ]


@pytest.mark.parametrize("name", [each.id for each in missions()] if SOAK else SOME)
def test_many_runs_are_judged_as_each_one_is(name):
    mission = built_in_mission(name)
    for program in (mission.solution, mission.near_miss):
        image = image_of(mission, program)
        expected = seen(mission, image, SEEDS)
        for opened in SHELLS.values():
            assert [tuple(each) for each in tried(mission, image, SEEDS, opened)] == expected


WINDOWS = [
    {"kind": "out-of-zone", "who": "all", "zone": "home", "until_s": 0.5},
    {"kind": "in-zone", "who": "followers", "zone": "home", "at": "always", "from_s": 90},
    {"kind": "in-zone", "who": "followers", "zone": "home", "at": "some-moment", "from_s": 90},
    {"kind": "heading", "who": "followers", "degrees": 350, "tolerance_deg": 11, "at": "always"},
    {"kind": "lit", "who": "followers", "led": "off", "at": "always", "share": 0.5},
    {"kind": "lit", "who": [1], "led": 1, "at": "always"},
    {"kind": "travelled", "who": "followers", "least_m": 0.5, "most_m": 0.9},
    {"kind": "in-zone", "who": [1], "zone": "home", "at": "end"},
    {"kind": "all-by", "goal": 8, "seconds": 4.2},
    {"kind": "all-by", "goal": 7, "seconds": 2.3},
]


@pytest.mark.parametrize("seconds", [1, 2.2, 3, 4.4])
def test_windows_shares_and_times_count_as_in_one_run(seconds):
    """A car drives into a zone and out of it; where the run ends decides which goals are met."""
    document = {"format": "motorcade-mission/1", "name": "m", "seconds": seconds, "mat": MAT, "zone": [SQUARE]}
    mission = mission_of({**document, "goal": WINDOWS}, "m")
    program = Program([wait(3)], Followers([forward(3, speed=3), led(1, 1), wait(2)], dwell_seconds=3))
    image = image_of(mission, program)
    assert [tuple(each) for each in tried(mission, image, SEEDS)] == seen(mission, image, SEEDS)


def test_a_mission_that_is_judged_in_every_tick_is_told_each_moment_and_disturbs_no_run():
    """A car drives through a zone: worlds stop at each tick on their way to the next at which anything happens."""
    document = {"format": "motorcade-mission/1", "name": "m", "seconds": 8, "mat": {**MAT, "tick_ms": 40}}
    mission = mission_of({**document, "zone": [SQUARE], "goal": WINDOWS}, "m")
    image = image_of(mission, Program([forward(3, speed=3)]))
    attempt, watch = attempt_of(mission, image), MissionWatch(mission, image)
    judged, at_once = (World(mission.mat, [image], mission.profile, seeds=range(2), threads=1) for _ in range(2))
    runs = ManyRuns(judged, [attempt] * 2, every_ms=40)
    judged.run(mission.duration_ms)
    at_once.run(mission.duration_ms)
    shown = World(mission.mat, [image], mission.profile, seeds=[1], threads=1)
    while not watch.is_over:
        watch.see(shown.snapshot())
        run_to_next(shown, mission.duration_ms, shown.tick_ms)
    assert [digest(judged, which) for which in range(2)] == [digest(at_once, which) for which in range(2)]
    told = [[state.progress for state in run.states()] for run in (*runs.end(), watch)]
    assert told == [told[0]] * 3
    assert {*told[0]} == {"met", "lost"}
    assert watch.run.times_ms == list(range(0, 8001, 40))


def test_more_runs_than_go_on_side_by_side_are_all_told_once():
    mission = built_in_mission("pass-it-on")
    seeds = other_seeds(mission, 33)
    assert len({*seeds, *mission.seeds}) == 33 + len(mission.seeds)
    trials = tried(mission, image_of(mission, mission.solution), seeds)
    assert [each.seed for each in trials] == seeds
    assert all(works(mission, each) for each in trials)


def test_a_star_asks_for_a_program_that_works_nearly_always():
    """Words that are sent too shortly arrive on the mission's three seeds, but not on enough others."""
    mission = built_in_mission("a-hundred-cars")
    short = replace(mission.solution, followers=replace(mission.solution.followers, dwell_seconds=2))
    rate = sum(works(mission, each) for each in tried(mission, image_of(mission, short), other_seeds(mission, 20)))
    assert 0 < rate < 20
    first = [goal for goal in mission.goals if goal.star == 1]
    shares = {2: rate / 20, 3: rate / 20 + 0.01}
    asked = [Goal(Works.name, star, {"share": share, "seeds": 20}) for star, share in shares.items()]
    result = check_program(replace(mission, goals=(*first, *asked)), short)
    assert result.stars == {1, 2}
    for found in result.goals[-2:]:
        assert found.met == (found.grade == 1) == (found.star == 2)
        assert found.why.sentence() == f"worked {rate} of 20 times with other luck"


@pytest.mark.parametrize(
    ("goal", "more", "said"),
    [
        ({"kind": "works"}, {}, "goal[1].star"),
        ({"kind": "works", "star": 3, "seeds": 201}, {}, "goal[1].seeds"),
        ({"kind": "works", "star": 3, "seeds": 200}, {"seconds": 600}, "200"),
    ],
)
def test_what_cannot_be_tried_is_refused(goal, more, said):
    document = {"format": "motorcade-mission/1", "name": "m", "seconds": 5, "mat": MAT, "zone": [SQUARE], **more}
    with pytest.raises(MotorcadeError, match="mission") as problem:
        mission_of({**document, "goal": [{"kind": "no-touch"}, goal]}, "m")
    assert said in str(problem.value)
