"""The engine finds what the plain loop of a car finds, whoever and however many step it."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from motorcade import (
    Followers,
    Program,
    ProgramError,
    avoid,
    compile_program,
    forward,
    led,
    left,
    pir,
    together,
    voice,
    wander,
)
from motorcade.profile import Profile
from motorcade.sim import geometry
from motorcade.sim.mat import Mat, Person, Physics, Starts, Voice
from motorcade.sim.state import Cars
from motorcade.sim.world import World
from plain_world import PlainWorld
from strategies import BRISK, CLASSROOM, programs

# What a pair of worlds costs, several seconds of many cars by the plain loop, is tried on a fifth of the cases.
SLOW = settings(max_examples=settings().max_examples // 5)
FIELDS = [name for name in Cars._fields if name not in ("rows", "memory", "push", "order")]
CROWD = 6_000


@st.composite
def mats(draw: st.DrawFn) -> Mat:
    cars, side_m = draw(st.integers(2, 16)), draw(st.sampled_from([1.5, 3.0, 6.0]))
    dice = np.random.default_rng(draw(st.integers(0, 999)))
    x_m, y_m = dice.uniform(0, side_m, cars), dice.uniform(0, side_m, cars)
    starts = Starts(x_m, y_m, dice.uniform(-7, 7, cars), np.arange(cars) % draw(st.integers(2, 9)) == 0)
    return Mat(
        name="anything",
        starts=starts,
        tick_ms=draw(st.sampled_from([1, 5, 20])),
        size_m=(side_m, side_m),
        walled=draw(st.booleans()),
        walls=((0.3, 0.3, 1.2, 0.9),),
        discs=((1.0, 1.0, 0.2),),
        polygons=(((2.0, 2.0), (2.5, 2.0), (2.2, 2.6)),),
        people=(Person(((0, 0, 0), (3, 2, 2), (9, 0, 4)), repeats=draw(st.booleans())), Person(((0, 1.5, 0.5),))),
        voices=(Voice(1, "stop", 1.0, 1.0, 1.0), Voice(2, "go")),
        physics=Physics(
            collisions=draw(st.booleans()),
            line_of_sight=draw(st.booleans()),
            capture_ratio=draw(st.sampled_from([None, 2.0, 4.0])),
            beam_half_angle_deg=draw(st.sampled_from([60.0, 180.0])),
            bit_error_rate=draw(st.sampled_from([0.0, 0.02])),
            wheel_noise=draw(st.sampled_from([0.0, 0.1])),
        ),
    )


def told_by(world: World) -> list[tuple[int, ...]]:
    columns = ("t_ms", "car", "kind", "why", "word", "other")
    return sorted(tuple(int(event[name]) for name in columns) for event in world.take_events())


def images_of(program: Program, profile: Profile) -> list[bytes]:
    try:
        return [compile_program(program, profile).image]
    except ProgramError:
        reject()


@SLOW
@given(st.data(), mats(), st.sampled_from([BRISK, CLASSROOM]), st.integers(0, 999))
def test_words_times_places_and_outputs_are_those_of_the_plain_loop(
    data: st.DataObject, mat: Mat, profile: Profile, seed: int
) -> None:
    images = images_of(data.draw(programs(profile)), profile)
    world, plain = World(mat, images, profile, seeds=seed, events=True), PlainWorld(mat, images, profile, seed)
    for _ in range(6):
        world.run(400)
        plain.run(400)
        shown = world.snapshot()
        assert np.rint(shown.x_m * 1e6).tolist() == plain.x
        assert np.rint(shown.y_m * 1e6).tolist() == plain.y
        assert shown.wheels.tolist() == [board.direction * 4 + board.speed_level for board in plain.boards]
        assert shown.led.tolist() == [board.led for board in plain.boards]
        assert by_number(world, world.state.heading) == plain.heading
    assert told_by(world) == sorted(plain.events)
    memory = [by_number(world, row) for row in world.state.memory]
    assert [list(column) for column in zip(*memory, strict=True)] == [car.memory for car in plain.cars]
    counts = world.counts()
    assert (counts["undetected"][0], counts["touching_ms"][0]) == (plain.undetected, plain.touching_ms)


def by_number(world: World, field: np.ndarray) -> list[int]:
    return field[np.argsort(world.state.number)].tolist()


def crowd(cars: int = CROWD) -> tuple[Mat, list[bytes]]:
    """Everything at once, in a hall with six cars around each."""
    side_m = float(np.sqrt(cars / 2))
    dice = np.random.default_rng(cars)
    columns = int(np.ceil(np.sqrt(cars)))
    place = np.arange(cars)
    x_m, y_m = (
        (each + 0.5 + dice.uniform(-0.2, 0.2, cars)) * side_m / columns for each in (place % columns, place // columns)
    )
    mat = Mat(
        name="hall",
        starts=Starts(x_m, y_m, dice.uniform(-3, 3, cars), place % 20 == 0),
        tick_ms=20,
        size_m=(side_m, side_m),
        walled=True,
        walls=tuple((x, x / 2, x + 1, x / 2 + 0.5) for x in np.arange(1, side_m - 2, 3).tolist()),
        discs=tuple((x, side_m - x, 0.3) for x in np.arange(1, side_m - 2, 4).tolist()),
        people=(Person(((0, 0, 0), (20, side_m, side_m)), repeats=True),),
        voices=(Voice(1, "stop", side_m / 2, side_m / 2, side_m / 4), Voice(2, "go")),
        physics=Physics(capture_ratio=4.0, beam_half_angle_deg=170.0, bit_error_rate=0.001),
    )
    words = [
        together(wander(3), avoid(1, 3), led(0, 2)),
        together(forward(2, speed=3), pir()),
        together(wander(2), voice()),
    ]
    program = Program([forward(2), left(1), wander(3)], Followers(words, forward=True))
    return mat, [compile_program(program).image]


def digest(world: World, number: int = 0) -> str:
    """Of all that a world's cars are, in the order of their numbers."""
    part = slice(number * world.cars, (number + 1) * world.cars)
    order = np.argsort(world.state.number[part])
    rows = [*world.state.memory[:, part], *(getattr(world.state, name)[part] for name in FIELDS)]
    return hashlib.sha256(b"".join(row[order].tobytes() for row in rows)).hexdigest()


def outcome(threads: int) -> tuple[str, dict[str, list[int]]]:
    world = World(*crowd(), threads=threads)
    world.run(3000)
    return digest(world), {name: values.tolist() for name, values in world.counts().items()}


def in_a_process(expression: str, **environment: str) -> object:
    """The value of an expression over this module, found by a Python of its own, through JSON."""
    program = f"import json, test_engine; print(json.dumps({expression}))"
    paths = os.pathsep.join(str(folder) for folder in Path(__file__).parents[:2])
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": paths, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("threads", [2, 8])
def test_a_crowd_is_the_same_to_the_last_bit_with_any_number_of_threads(threads: int) -> None:
    several = in_a_process(f"test_engine.outcome({threads})", NUMBA_NUM_THREADS=str(threads))
    assert several == list(outcome(1))


def test_a_run_is_the_same_in_one_call_in_slices_and_tick_by_tick() -> None:
    worlds = [World(*crowd(200)) for _ in range(3)]
    worlds[0].run(2000)
    for _ in range(10):
        worlds[1].run(200)
    for _ in range(100):
        worlds[2].step()
    assert len({digest(world) for world in worlds}) == 1


def test_keeping_events_changes_nothing_even_when_their_room_grows() -> None:
    mat, images = crowd(300)
    silent, telling = World(mat, images), World(mat, images, events=True)
    telling._tally = telling._tally._replace(events=telling._tally.events[:, :8])
    silent.run(2000)
    telling.run(2000)
    assert digest(silent) == digest(telling)
    assert len(telling.take_events()) > 1000


def test_each_of_many_worlds_is_as_if_it_were_alone() -> None:
    mat, images = crowd(60)
    seeds = [3, 14, 15, 92]
    many = World(mat, images, seeds=seeds, threads=2)
    many.run(3000)
    for number, seed in enumerate(seeds):
        alone = World(mat, images, seeds=seed)
        alone.run(3000)
        assert digest(many, number) == digest(alone)
        assert [values[number] for values in many.counts().values()] == [
            values[0] for values in alone.counts().values()
        ]
    assert len({digest(many, number) for number in range(len(seeds))}) == len(seeds)


def test_reset_begins_anew_with_the_same_or_another_seed() -> None:
    mat, images = crowd(60)
    world = World(mat, images, seeds=7)
    world.run(2000)
    first = digest(world)
    world.reset()
    world.run(2000)
    assert digest(world) == first
    world.reset(8)
    world.run(2000)
    assert digest(world) != first


def small(duration_ms: int = 1500) -> Sequence[object]:
    world = World(*crowd(30), seeds=5)
    world.run(duration_ms)
    return digest(world), {name: values.tolist() for name, values in world.counts().items()}


def test_the_same_source_gives_the_same_integers_without_the_compiler() -> None:
    assert in_a_process("test_engine.small()", NUMBA_DISABLE_JIT="1") == list(small())


def test_draws_of_the_hash_are_even() -> None:
    draws = np.array([geometry.mix(1, number, 7) >> 28 for number in range(20_000)])
    assert np.bincount(draws, minlength=16).min() > 1100
