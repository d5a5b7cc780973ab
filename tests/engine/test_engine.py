"""Compare the engine with the plain world, and with itself with other threads, slices and neighbouring worlds."""

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade import (
    Followers,
    Pose,
    Program,
    avoid,
    compile_program,
    dark,
    forward,
    led,
    left,
    open_table,
    pir,
    together,
    voice,
    wait,
    wander,
)
from motorcade.car import decisions
from motorcade.car.brain import RUNNING, WORD
from motorcade.config.profile import MeasuredWheels
from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.engine.slices import Slices
from motorcade.engine.state import DRIVEN, MOST_PARTS
from motorcade.engine.world import World
from motorcade.mats import Mat, Person, Physics, Voice
from motorcade.mats.model import Starts
from motorcade.program.steps import Step
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words
from motorcade.words.packing import words_to_bytes
from support.plain_world import PlainWorld
from support.strategies import BRISK, CLASSROOM
from support.worlds import DURATIONS_MS, Case, CrowdedWorld, cases, contents, crowd, digest, go, ran

SLICES = 5
FEW = settings(max_examples=max(settings().max_examples // 4, 1))
START, LOST, FRAME, HEARD = (KINDS.index(kind) for kind in ("start", "lost", "frame", "heard"))


def events_of(world: World) -> list[tuple[int, int, int, int, int, int]]:
    """The events in the form of the plain world, sorted."""
    names = ["t_ms", "car", "kind", "why", "word", "other"]
    return sorted(world.take_events()[names].tolist())


def shown(world: World) -> dict[str, list[int]]:
    """What each car shows, in the engine's own units."""
    now, held = world.snapshot(), contents(world)
    seen = {name: held[name].T.tolist() for name in ("x", "y", "heading", "memory")}
    return seen | {name: getattr(now, name).tolist() for name in ("word", "runs", "wheels", "led", "sends")}


def wheels_of(world: PlainWorld, car: int) -> int:
    if car in world.driven:
        way = math.hypot(*world.driven[car][:2]) / 4096
        return DRIVEN + sum(way > speed for speed in world.rules.speeds[:3])
    return world.boards[car].direction * 4 + world.boards[car].speed_level


def shown_by_plain_world(world: PlainWorld) -> dict[str, list[int]]:
    brains = [car.memory for car in world.cars]
    sending = {frame.sender for frame in world.on_air if frame.end_ms > world.now_ms}
    return {
        "x": world.x,
        "y": world.y,
        "heading": world.heading,
        "memory": brains,
        "word": [memory[WORD] for memory in brains],
        "runs": [bool(memory[RUNNING]) for memory in brains],
        "wheels": [wheels_of(world, car) for car in range(len(world.cars))],
        "led": [board.led for board in world.boards],
        "sends": [board.index in sending for board in world.boards],
    }


def counts_of_plain_world(world: PlainWorld) -> dict[str, int]:
    kinds = [kind for _, _, kind, _, _, _ in world.events]
    whys = [LOSS_REASONS[why] for _, _, kind, why, _, _ in world.events if kind == LOST]
    lost = {f"lost_{why}": whys.count(why) for why in ("collision", "sending", "parity", "reserved", "check", "remote")}
    sent = {"frames": kinds.count(FRAME), "heard": kinds.count(HEARD), "deaf": whys.count("deaf")}
    return sent | lost | {"undetected": world.undetected, "touching_ms": world.touching_ms}


Worlds = World | PlainWorld


def same_in_both(case: Case, acts: Iterable[Callable[[Worlds], object]], slice_ms: int) -> list[tuple[int, ...]]:
    """Do each act in the engine and in the plain world, and compare what happens in the time after it; the events."""
    engine = CrowdedWorld(case.mat, case.images, case.profile, seeds=case.seed, events=True)
    plain = PlainWorld(case.mat, case.images, case.profile, case.seed)
    happened = []
    for act in acts:
        for world in (engine, plain):
            act(world)
            world.run(slice_ms)
        happened += events_of(engine)
        assert shown(engine) == shown_by_plain_world(plain), engine.now_ms
        assert decisions_of(engine) == decisions_of(plain)
        assert sorted(happened) == sorted(plain.events)
    assert {name: int(counts[0]) for name, counts in engine.counts().items()} == counts_of_plain_world(plain)
    return happened


def decisions_of(world: Worlds) -> list[list[int]]:
    """What the leaders remember of their decisions, but for what each tick writes anew."""
    if isinstance(world, World):
        rows = np.asarray(world.arrays().decisions).tolist()
    else:
        rows = [list(car.decisions) for car in world.cars if car.leads]
    return [[value for place, value in enumerate(row) if place != decisions.FLOW_LEFT] for row in rows]


def nothing(world: Worlds) -> None:
    """Let the world go on."""


@FEW
@given(cases())
def test_the_engine_equals_the_plain_world(case: Case) -> None:
    same_in_both(case, [nothing] * SLICES, DURATIONS_MS[case.mat.tick_ms] // SLICES)


@FEW
@given(cases(decides=True), st.data())
def test_leaders_that_decide_do_so_as_in_the_plain_world(case: Case, data: st.DataObject) -> None:
    """Somebody says words, drives cars and gives them back."""
    cars = range(len(case.mat.starts))

    def drawn(number: int) -> Callable[[Worlds], object]:
        said, car = data.draw(st.sampled_from(["stop", "go", None])), data.draw(st.sampled_from(cars))
        is_driven = number > SLICES and data.draw(st.booleans())

        def act(world: Worlds) -> None:
            if said:
                world.say(said)
            world.drive(car, 60, 1, 200) if is_driven else world.give_back(car)

        return act

    slices = 2 * SLICES
    same_in_both(case, map(drawn, range(slices)), DURATIONS_MS[case.mat.tick_ms] // slices)


@FEW
@given(cases(), cases(tick_ms=20), st.data())
def test_the_engine_equals_the_plain_world_when_cars_are_driven_and_moved(
    case: Case, other: Case, data: st.DataObject
) -> None:
    """Drivers come, steer and leave while the world goes on, cars are moved, and walls are replaced."""
    car = st.integers(0, len(case.mat.starts) - 1)
    angle = st.sampled_from([0, 180]) | st.integers(0, 180)
    setpoint = st.tuples(angle, st.integers(0, 1), st.sampled_from([0, 100, 255]))

    def drawn(number: int) -> Callable[[Worlds], object]:
        moved = data.draw(car) if number % 4 == 3 else None
        x_m, y_m = other.mat.starts.x_m[number // 4], other.mat.starts.y_m[number // 4]
        driven = data.draw(st.dictionaries(car, setpoint | st.none(), max_size=6))

        def act(world: Worlds) -> None:
            if number == 10:
                world.set_environment(other.mat, other.profile.infrared.range_mm)
            if moved is not None:
                world.move(moved, Pose(float(x_m), float(y_m), 0.3 * number))
            for each, wanted in driven.items():
                world.give_back(each) if wanted is None else world.drive(each, *wanted)

        return act

    # Many short slices, so that standing cars often begin to drive near something.
    same_in_both(case, map(drawn, range(4 * SLICES)), DURATIONS_MS[case.mat.tick_ms] // (4 * SLICES))


def test_a_car_on_dark_floor_that_is_pushed_is_felt_by_the_one_beside_it() -> None:
    """Cars that stand near each other rest, and this one begins to look at the floor between two looks around."""
    away_m = CLASSROOM.body.diameter_mm / 1000 + 0.09
    mat = open_table((Pose(0, 0), Pose(-away_m, 0), Pose(away_m, 0)))
    mat = replace(mat, spots=((0.0, 0.0, 2.0),))
    image = compile_program(Program([wait(1), wander(10, unless=dark())]), CLASSROOM).image
    acts = [nothing, lambda world: world.drive(1, 90, 1, 255), nothing, nothing]
    same_in_both(Case(mat, [image], CLASSROOM, 1), acts, 2000)


@pytest.mark.parametrize("driving", [forward(3, speed=1), left(3, speed=1)], ids=["straight on", "on the spot"])
def test_people_who_walk_by_are_felt_in_the_tick_in_which_they_come_and_go(driving: Step) -> None:
    """One crosses the sectors of cars of all headings, and one comes from afar."""
    poses = [Pose(0.5 * car, 0, 0.7 * car) for car in range(9)]
    walkers = Person(((0.0, -2.0, 1.5), (4.0, 6.0, -1.5))), Person(((0.0, 2.0, 9.0), (4.0, 2.0, 0.5)))
    mat = Mat("walkers", Starts.of(poses, [True] * 9), 20, people=walkers)
    image = compile_program(Program([together(driving, pir())])).image
    same_in_both(Case(mat, [image], CLASSROOM, 1), [nothing] * 200, 20)


@pytest.mark.parametrize("speed", [1, 2, 3])
@pytest.mark.parametrize("cone_deg", [15, 60])
def test_what_a_sensor_finds_is_found_and_lost_in_the_tick_in_which_it_comes_and_goes(
    speed: int, cone_deg: int
) -> None:
    """Cars turn before walls, a round obstacle and each other; some would avoid what is beyond their range."""
    profile = replace(CLASSROOM, body=replace(CLASSROOM.body, ultrasonic_cone_deg=cone_deg, ultrasonic_range_mm=250))
    poses = [Pose(0.3 + 0.45 * (car % 4), 0.3 + 0.45 * (car // 4), 0.7 * car) for car in range(16)]
    mat = Mat("room", Starts.of(poses, [True] * 16), 20, (2.0, 2.0), walled=True, discs=((1.0, 0.9, 0.1),))
    programs = [Program([together(forward(3, speed=speed), avoid(radius, 3))]) for radius in (1, 2, 3)]
    images = [compile_program(program, profile).image for program in programs]
    same_in_both(Case(mat, images, profile, 1), [nothing] * 300, 20)


def test_a_car_that_rolls_on_is_pushed_no_further_than_others_count_on() -> None:
    """It is put deep into a wall while it rolls on, and comes out of it towards one that drives there at full speed."""
    profile = replace(CLASSROOM, wheels=MeasuredWheels(0, 150))
    starts = Starts.of([Pose(0, 1), Pose(0, 0)], [True] * 2)
    mat = Mat("wall", starts, 20, walls=((20.0, -1.0, 20.0, 1.0),))
    programs = Program([forward(2, speed=3), wait(2)]), Program([forward(30, speed=3)])

    def put(world: Worlds) -> None:
        world.move(0, Pose(19.999, 0))
        # Bodies of 150 mm, and a bit more than the way of both in four ticks.
        world.move(1, Pose(19.999 - 0.150 - 0.04815, 0))

    images = [compile_program(program, profile).image for program in programs]
    same_in_both(Case(mat, images, profile, 0), [nothing, put], 2000)


@pytest.mark.parametrize("tagged", [(1, 1, 0), (1, 1, 1), (1, 0, 0)], ids=["two of three", "all", "one"])
def test_tags_go_round_while_cars_come_and_go_as_in_the_plain_world(tagged: tuple[int, ...]) -> None:
    """Bare and tagged leaders in one hall, and followers that are away for 5, 15 and 40 s."""
    words = [CONTROL.encode(accept_ir=1, forward=1, led_which=led, led_duration=1) for led in range(3)]
    programs = [
        words_to_bytes(image_words(Image((0x40000000,), tuple(words[k:] + words[:k]), 0, tag)))
        for k, tag in enumerate(tagged)
    ]
    poses = [Pose(0.4 * (car % 4), 0.4 * (car // 4)) for car in range(9)]
    physics = Physics(collisions=False, line_of_sight=False, bit_error_rate=0.002)
    mat = Mat("hall", Starts.of(poses, [car in (0, 4, 8) for car in range(9)]), 20, physics=physics)
    # The round of 31 tags takes 12 s with a dwell of 400 ms.
    profile = replace(BRISK, infrared=replace(BRISK.infrared, forget_ms=2000))
    far = Pose(50, 50)
    moves = {2: (1, far), 5: (2, far), 7: (1, poses[1]), 8: (3, far), 20: (2, poses[2]), 48: (3, poses[3])}

    def moved(second: int) -> Callable[[Worlds], object]:
        return lambda world: world.move(*moves[second]) if second in moves else None

    happened = same_in_both(Case(mat, programs, profile, 3), map(moved, range(52)), 1000)
    begun = [(at_ms, other) for at_ms, _, kind, _, _, other in happened if kind == START]
    assert any(tag > 25 for _, tag in begun)
    assert any(at_ms > 13_000 and 0 < tag < 6 for at_ms, tag in begun)


def test_the_crowd_meets_every_case() -> None:
    """Otherwise its digests would prove little."""
    world = ran(crowd(20_000), 1600)
    counts = {name: int(values[0]) for name, values in world.counts().items()}
    assert {name for name, count in counts.items() if not count} <= {"deaf", "lost_remote"}
    assert np.unique(world.snapshot().wheels).size >= 4


def test_slipping_cars_go_on_slipping_while_another_is_moved() -> None:
    places = [Pose(0, 0), Pose(0.2, 0.05), Pose(3, 3)]
    mat = Mat("slippery", Starts.of(places, [True] * 3), 20, physics=Physics(wheel_noise=0.3))
    image = compile_program(Program([forward(3, speed=3)])).image

    def moved(number: int) -> Callable[[Worlds], object]:
        # Between them, where they are pushed as far as possible.
        return lambda world: world.move(2, Pose(0.05 + number * 0.005, 0.02))

    same_in_both(Case(mat, [image], CLASSROOM, 0), map(moved, range(40)), 20)


@FEW
@given(cases(tick_ms=20), st.data())
def test_a_run_is_the_same_at_once_in_slices_by_ticks_or_beside_other_worlds(case: Case, data: st.DataObject) -> None:
    duration_ms, seeds = 2000, [case.seed, 7, 8]
    once, sliced, stepped = (CrowdedWorld(case.mat, case.images, case.profile, seeds=case.seed) for _ in range(3))
    beside = CrowdedWorld(case.mat, case.images, case.profile, seeds=data.draw(st.permutations(seeds)))
    once.run(duration_ms)
    beside.run(duration_ms)
    while sliced.now_ms < duration_ms:
        sliced.run(min(20 * data.draw(st.integers(1, 40)), duration_ms - sliced.now_ms))
    while stepped.now_ms < duration_ms:
        stepped.step()
    same = [digest(world) for world in (once, sliced, stepped)]
    assert [*same, digest(beside, beside.seeds.index(case.seed))] == [same[0]] * 4


QUIET = {
    "nobody is told": Program([wait(1), forward(2, speed=3)]),
    "all stand": Program([wait(3)], Followers([led(1, 2), led(2, 2)], forward=True, tagged=True)),
    "all drive": Program([wait(3)], Followers([forward(3, speed=3), left(2)], tagged=True)),
    "all mind": Program([together(wander(3), avoid(1, 3), voice())], Followers([together(wander(3), pir(), voice())])),
}


@pytest.mark.parametrize("physics", [Physics(), Physics(wheel_noise=0.1), Physics(collisions=False)])
@pytest.mark.parametrize(("cars", "tick_ms"), [(1, 40), (5, 1), (120, 20)])
@pytest.mark.parametrize("program", QUIET.values(), ids=QUIET)
def test_a_world_that_goes_at_once_to_what_is_due_is_where_single_ticks_bring_it(
    program: Program, cars: int, tick_ms: int, physics: Physics, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Voices, people and sorts come in between, and somebody drives a car for a while; also in two strips.

    Leaders that tell nobody anything drive into cars that stand.
    """
    monkeypatch.setattr("motorcade.engine.world._LARGE", 100)
    poses = [Pose(0.16 * (car % 3), 0.16 * (car // 3), 2.4 * car) for car in range(cars)]
    starts = Starts.of(poses, [car % 12 == 0 for car in range(cars)])
    voices = Voice(0.901, "stop"), Voice(1.5, "go"), Voice(7.401, "stop")
    people = Person(((0.0, -9.0, 0.0), (8.0, 9.0, 0.0)))
    mat = Mat("quiet", starts, tick_ms, voices=voices, people=(people,), physics=physics)
    image = compile_program(program).image
    at_once, stepped = (World(mat, [image], seeds=range(2), threads=1) for _ in range(2))
    in_strips = World(mat, [image], threads=2)
    for act in (nothing, lambda world: world.drive(0, 60, 1, 200), lambda world: world.give_back(0)):
        for world in (at_once, stepped, in_strips):
            act(world)
        for world in (at_once, in_strips):
            world.run(3000)
        for _ in range(3000 // tick_ms):
            stepped.step()
        expected = digest(stepped)
        assert [digest(at_once), digest(in_strips), digest(at_once, 1)] == [expected, expected, digest(stepped, 1)]


def test_a_car_that_is_pushed_disturbs_one_of_a_group_that_rests() -> None:
    """A leader pushes the last car of the first group into the first one of the second."""
    below, above = ([Pose(0.4 * car, y) for car in range(31)] for y in (-3.0, 3.0))
    poses = [*below[1:], Pose(-0.05, 0), Pose(0.16, 0), Pose(0.311, 0), *above]
    mat = Mat("groups", Starts.of(poses, [car == 30 for car in range(64)]), 20)
    image = compile_program(Program([wait(1), forward(2, speed=3)])).image
    at_once, stepped = (World(mat, [image]) for _ in range(2))
    at_once.run(1300)
    for _ in range(65):
        stepped.step()
    assert stepped.snapshot().x_m[32] > 0.313
    assert digest(at_once) == digest(stepped)


def test_cars_are_sorted_after_a_jump_past_the_tick_of_a_sort() -> None:
    """After a wait a leader drives through several cells, into cars that have stood all the time."""
    poses = [Pose(-1.3, 0), *(Pose(0.16 * (car % 8), 0.16 * (car // 8)) for car in range(64))]
    mat = open_table(poses, tick_ms=20)
    image = compile_program(Program([wait(2), forward(3, speed=3)])).image
    at_once, stepped = (World(mat, [image]) for _ in range(2))
    at_once.run(8500)
    for _ in range(425):
        stepped.step()
    assert stepped.snapshot().x_m[1] > 0.001
    assert digest(at_once) == digest(stepped)


def test_cars_that_rest_feel_the_push_of_one_from_the_next_strip(monkeypatch: pytest.MonkeyPatch) -> None:
    """In three columns of cars, so near to each other that a strip ends between two, some set out one after another."""
    monkeypatch.setattr("motorcade.engine.world._LARGE", 100)
    poses = [Pose(0.4 * (car // 40), 0.155 * (car % 40), math.pi / 2) for car in range(120)]
    mat = Mat("strips", Starts.of(poses, [car % 40 % 8 == car // 40 for car in range(120)]), 20)
    images = [compile_program(Program([wait(step), forward(1, speed=step)])).image for step in (1, 2, 3)]
    in_strips, whole = (World(mat, images, threads=threads) for threads in (2, 1))
    for world in (in_strips, whole):
        world.run(3000)
    assert in_strips.arrays().cells.strips[0, MOST_PARTS] > 1
    assert digest(in_strips) == digest(whole)


def test_a_slice_stays_so_short_that_cars_may_wake_up_in_it() -> None:
    """While nothing happened, slices took no time."""
    slices = Slices(cars=10, clock_s=lambda: 0.0)
    for _ in range(40):
        slices.measure(slices.ticks, lambda: None)
    assert 1_000 < slices.ticks < 1_000_000


def test_reset_begins_again_with_the_same_seed_or_another() -> None:
    world = ran(crowd(60), 1600)
    first = digest(world)
    world.reset()
    go(world, 1600)
    assert digest(world) == first
    world.reset(6)
    go(world, 1600)
    assert digest(world) == digest(ran(crowd(60), 1600, seeds=6)) != first


def test_events_are_kept_however_many_there_are() -> None:
    """Each car begins a state in each millisecond, so the room for events has to grow twice."""
    mat = open_table([Pose(place, 0) for place in range(40)], tick_ms=20)
    mat = replace(mat, starts=replace(mat.starts, leads=np.ones(40, bool)))
    two_idle_states = bytes.fromhex("02000000 40000000 40000000")
    told, untold = (
        World(mat, [two_idle_states], replace(BRISK, idle_state_ms=1), seeds=3, events=events)
        for events in (True, False)
    )
    for world in (told, untold):
        world.run(600)
    events = told.take_events()
    assert events["t_ms"].tolist() == [t_ms for t_ms in range(581) for _ in range(40)]
    assert events["car"].tolist() == list(range(40)) * 581
    assert events["other"].tolist() == [t_ms % 2 for t_ms in range(581) for _ in range(40)]
    assert digest(told) == digest(untold)
    assert not len(told.take_events())


def test_driven_cars_stay_driven_when_the_room_for_events_grows() -> None:
    """When the room for events is too small, a slice runs again, after the cars were sorted in another order."""
    dice = np.random.RandomState(3)
    poses = [Pose(*map(float, each)) for each in dice.random_sample((60, 3)) * (3, 3, math.tau)]
    mat = open_table(poses, tick_ms=20)
    mat = replace(mat, starts=replace(mat.starts, leads=np.ones(60, bool)))
    calm, idle = 0x40280000, 0x40000000
    image = b"".join(word.to_bytes(4, "big") for word in (201 << 24, calm, *[idle] * 200))
    profile = replace(BRISK, idle_state_ms=1)
    told, untold = (CrowdedWorld(mat, [image], profile, seeds=3, events=events) for events in (True, False))
    for world in (told, untold):
        world.run(100)
        for car in range(60):
            world.drive(car, 60 + car, 1, 255)
        world.run(4 * (profile.durations_ms[1] + 200))
    assert digest(told) == digest(untold)
    assert len(told.take_events()) > 60 * 800
