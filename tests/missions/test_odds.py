"""Many runs at once: the kernel that judges them says of each what the watches of one run say, moment by moment."""

from dataclasses import replace
from functools import partial

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
from motorcade.program.steps import forward, led, together, voice, wait, wander
from support.interrupts import lines_until_interrupted
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


TOGETHER = [
    {"kind": "gathered", "zone": "middle", "least": 10},
    {"kind": "stopped", "zone": "middle", "least": 160},
    *({"kind": "together", "metres": 2.75, "at": at} for at in ("end", "some-moment", "always")),
    {"kind": "together", "who": [3, 9], "metres": 1},
    {"kind": "stopped-by-voice", "who": "all", "share": 0.35},
    {"kind": "stopped-by-voice", "who": [2, 17]},
    {"kind": "covered", "zone": "middle", "least": 1},
]


def test_what_cars_do_together_is_judged_alike_while_runs_go_on_and_moment_by_moment():
    """Twenty cars wander; voices stop those near the middle, and let them go. The end is between two ticks."""
    voices = [{"at_s": 1, "word": "stop"}, {"at_s": 1.7, "word": "go"}]
    voices.append({"at_s": 2.5, "word": "stop", "centre_m": [1.5, 1.5], "radius_m": 0.7})
    crowd = {"cars": 20, "leaders": 20, "spacing_m": 0.3}
    mat = {"size_m": [3, 3], "edge": "wall", "tick_ms": 40, "crowd": [crowd], "voice": voices}
    zone = {"name": "middle", "centre_m": [1.5, 1.5], "radius_m": 0.5}
    document = {"format": "motorcade-mission/1", "name": "m", "seconds": 3.1, "mat": mat, "zone": [zone]}
    mission = mission_of({**document, "goal": TOGETHER}, "m")
    image = image_of(mission, Program([together(wander(3), voice())]))
    assert [tuple(each) for each in tried(mission, image, SEEDS)] == seen(mission, image, SEEDS)
    world = World(mission.mat, [image], mission.profile, seeds=SEEDS, threads=1)
    runs = ManyRuns(world, [attempt_of(mission, image)] * len(SEEDS))
    world.run(3120)
    told = [(run.grades(), [state.why.sentence() for state in run.states()]) for run in runs.end()]
    for number, seed in enumerate(SEEDS):
        watch = MissionWatch(mission, image)
        alone = World(mission.mat, [image], mission.profile, seeds=[seed], events=True, threads=1)
        for sight in watched(alone, mission):
            watch.see(sight.moment, sight.begun)
        assert told[number] == (watch.grades(), [state.why.sentence() for state in watch.states()])


@pytest.mark.parametrize("kernels", ["native", "interpreted"])
def test_a_judged_run_that_is_broken_off_anywhere_is_judged_once_at_each_moment(kernels):
    mission = built_in_mission("the-square")
    image = image_of(mission, mission.solution)

    def begun():
        world = World(mission.mat, [image], mission.profile, seeds=range(2), threads=1, kernels=kernels)
        return world, ManyRuns(world, [attempt_of(mission, image)] * 2)

    def ended(world, runs):
        world.run(1500 - world.now_ms)
        return [[*run.run.answers.off[0], *run.run.answers.since[0]] for run in runs.end()]

    expected = ended(*begun())
    lines = lines_until_interrupted(partial(begun()[0].run, 1500), -1)
    for at in range(1, lines, max(lines // 20, 1)):
        world, runs = begun()
        lines_until_interrupted(partial(world.run, 1500), at)
        assert ended(world, runs) == expected, at


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
