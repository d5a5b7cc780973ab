"""Random worlds, and the contents of worlds, for the tests of the engine."""

import hashlib
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from motorcade import Followers, Program, avoid, compile_program, forward, led, left, pir, together, voice, wander
from motorcade.config.profile import MeasuredWheels, Profile
from motorcade.engine.world import World
from motorcade.mats import Mat, Person, Physics, Pose, Starts, Voice
from motorcade.mats.document import check_things
from motorcade.mats.model import Line
from motorcade.words.image import image_words
from motorcade.words.packing import words_to_bytes
from support.deciding_leader import deciding_images
from support.strategies import BRISK, images

# With these, every body is larger than the way of four ticks.
TICKS_MS = (1, 4, 20)
# The plain world with some ten cars takes a tenth of a second for these.
DURATIONS_MS = {1: 1_000, 4: 2_400, 20: 8_000}


@dataclass(frozen=True)
class Case:
    """The arguments of a world."""

    mat: Mat
    images: list[bytes]
    profile: Profile
    seed: int


class CrowdedWorld(World):
    """A world whose cars may start in walls and in each other, as they may come to stand while it changes."""

    def _check_mat(self, mat: Mat, profile: Profile | None) -> None:
        """Check all but the places of the cars."""
        check_things(mat)


@st.composite
def cases(draw: st.DrawFn, tick_ms: int | None = None, decides: bool | None = None) -> Case:
    """Any small world, crowded or wide, with any physics; with or without leaders that decide."""
    side_mm = draw(st.sampled_from([600, 1500, 4000]))
    length = st.integers(0, side_mm).map(lambda length_mm: length_mm / 1000)
    point = st.tuples(length, length)
    angle = st.integers(-400, 400).map(math.radians)
    poses = draw(st.lists(st.builds(Pose, length, length, angle), min_size=6, max_size=12))
    leads = [not number or not draw(st.integers(0, 5)) for number in range(len(poses))]
    mat = Mat(
        "any",
        Starts.of(poses, leads),
        tick_ms or draw(st.sampled_from(TICKS_MS)),
        (side_mm / 1000, side_mm / 1000),
        draw(st.booleans()),
        tuple(draw(st.lists(st.tuples(length, length, length, length).filter(has_length), max_size=2))),
        tuple(draw(st.lists(st.tuples(length, length, length.map(lambda radius: 0.01 + radius / 5)), max_size=2))),
        tuple(draw(st.lists(polygons(length), max_size=1))),
        tuple(draw(st.lists(st.builds(Person, paths(point), st.booleans()), max_size=2))),
        tuple(draw(st.lists(voices(length), max_size=3))),
        draw(physics()),
        tuple(draw(st.lists(lines(point), max_size=2))),
        tuple(draw(st.lists(st.tuples(length, length, st.sampled_from([0.02, 0.2, 1.0])), max_size=1))),
        tuple(draw(st.lists(st.lists(point, min_size=3, max_size=4).map(tuple), max_size=1))),
    )
    if decides is None:
        decides = draw(st.booleans())
    made = deciding_images().map(image_words).map(words_to_bytes) if decides else images(states=1, followers=1)
    programs = draw(st.lists(made, min_size=1, max_size=2))
    return Case(mat, programs, draw(profiles()), draw(st.integers(0, (1 << 32) - 1)))


@st.composite
def paths(draw: st.DrawFn, point: st.SearchStrategy[tuple[float, float]]) -> tuple[tuple[float, float, float], ...]:
    """A path, or one place."""
    legs_ms = draw(st.lists(st.integers(1, 3000), max_size=3))
    return tuple((sum(legs_ms[:leg]) / 1000, *draw(point)) for leg in range(len(legs_ms) + 1))


def has_length(wall: tuple[float, float, float, float]) -> bool:
    return wall[:2] != wall[2:]


@st.composite
def polygons(draw: st.DrawFn, length: st.SearchStrategy[float]) -> tuple[tuple[float, float], ...]:
    """Three or four corners around a point: each in a sector of its own, so no side meets another."""
    x, y = draw(length), draw(length)
    sector_deg = 360 // draw(st.integers(3, 4))
    corners = []
    for first_deg in range(0, 360, sector_deg):
        # Less than half a turn lies between two corners.
        angle = math.radians(first_deg + draw(st.integers(0, 2 * sector_deg // 5)))
        away = 0.01 + draw(length)
        corners.append((x + away * math.cos(angle), y + away * math.sin(angle)))
    return tuple(corners)


def lines(point: st.SearchStrategy[tuple[float, float]]) -> st.SearchStrategy[Line]:
    points = st.lists(point, min_size=2, max_size=4).map(tuple)
    return st.builds(Line, points, st.sampled_from([0.03, 0.1]), st.sampled_from([0.0, 0.2]), st.booleans())


def voices(length: st.SearchStrategy[float]) -> st.SearchStrategy[Voice]:
    at_s = st.integers(0, 5000).map(lambda at_ms: at_ms / 1000)
    return st.builds(
        Voice,
        at_s,
        st.sampled_from(["stop", "go"]),
        length,
        length,
        st.none() | length.map(lambda radius: 0.001 + radius),
    )


def physics() -> st.SearchStrategy[Physics]:
    return st.builds(
        Physics,
        st.booleans(),
        st.booleans(),
        st.sampled_from([None, 1.5, 4.0]),
        st.sampled_from([180, 180, 90, 20]),
        st.sampled_from([0.0, 0.0, 0.02]),
        st.sampled_from([0.0, 0.0, 0.1]),
    )


@st.composite
def profiles(draw: st.DrawFn) -> Profile:
    """Fast cars, small or large, with short or long ranges; some bend or roll on."""
    body = replace(
        BRISK.body,
        diameter_mm=draw(st.sampled_from([150, 80, 301])),
        ultrasonic_cone_deg=draw(st.sampled_from([15, 1, 80])),
        ultrasonic_range_mm=draw(st.sampled_from([2000, 250])),
        pir_range_mm=draw(st.sampled_from([3000, 500])),
        pir_half_angle_deg=draw(st.sampled_from([55, 120, 180])),
    )
    infrared = replace(BRISK.infrared, range_mm=draw(st.sampled_from([1000, 1000, 4000, 300])))
    wheels = MeasuredWheels(draw(st.sampled_from([0, 0, 0, -700])), draw(st.sampled_from([0, 0, 0, 150])))
    return replace(BRISK, body=body, infrared=infrared, wheels=wheels)


def contents(world: World, which: int = 0) -> dict[str, np.ndarray]:
    """All arrays and counts of one of the worlds, in the order of the cars' numbers.

    Without the field clear: when cars look for others again depends on the strips into which a world is cut. And
    without a leader's row of Decisions, which counts the leaders of all worlds.
    """
    part = slice(which * world.cars, (which + 1) * world.cars)
    state = world.state
    order = np.argsort(state.number[part])
    names = [name for name in state._fields if name not in ("rows", "push", "order", "clear")]
    held = {name: getattr(state, name)[..., part][..., order] for name in names}
    held["heard_at"] = np.where(held["program"] > 0, 0, held["heard_at"])
    counted = {name: counts[which] for name, counts in world.counts().items()}
    return held | counted


def digest(world: World, which: int = 0) -> str:
    """A digest of the contents: equal only for worlds that are equal to the last bit."""
    summed = hashlib.sha256()
    for name, values in contents(world, which).items():
        summed.update(name.encode() + np.ascontiguousarray(values).tobytes())
    return summed.hexdigest()


ROAMING = compile_program(
    Program(
        [together(wander(3), avoid(1, 3)), together(left(2), led(1, 1)), together(forward(3), pir(), voice())],
        Followers([together(wander(3), avoid(0, 3), led(2, 1), voice())], forward=True),
    )
).image


def crowd(cars: int) -> Mat:
    """A walled square full of cars, in which everything happens that can happen in a world."""
    side = math.ceil(math.sqrt(cars))
    dice = np.random.RandomState(1)
    x_m: Any
    y_m: Any
    x_m, y_m = (0.1 + 0.2 * places for places in (np.arange(cars) % side, np.arange(cars) // side))
    edge_m = 0.2 * side
    heading: Any = dice.random_sample(cars) * math.tau
    return Mat(
        "a crowd",
        Starts(x_m, y_m, heading, np.arange(cars) % 40 == 0),
        tick_ms=20,
        size_m=(edge_m, edge_m),
        walled=True,
        walls=((0.25, 0.25, edge_m - 0.25, 0.25),),
        discs=((edge_m / 2, edge_m / 2, 0.1),),
        people=(Person(((0.0, edge_m, edge_m), (1.0, 0.0, 0.0)), repeats=True),),
        voices=(Voice(0.5, "stop", 0.0, 0.0, edge_m / 2), Voice(0.8, "go")),
        physics=Physics(capture_ratio=4.0, beam_half_angle_deg=120, bit_error_rate=0.01, wheel_noise=0.1),
    )


def go(world: World, duration_ms: int) -> None:
    """Run a world; in the second half somebody drives a leader amid the crowd, and for a while a follower too."""
    leader = 40 * (world.cars // 80)
    world.run(duration_ms // 2)
    for which in range(world.worlds):
        world.drive(leader, 150, 1, 255, which)
        world.drive(leader + 7, 30, 0, 200, which)
    world.run(duration_ms // 4)
    for which in range(world.worlds):
        world.give_back(leader + 7, which)
    world.run(duration_ms // 4)


def ran(mat: Mat, duration_ms: int, seeds: int | list[int] = 5, **more: Any) -> World:
    """A world of roaming cars that has run for ``duration_ms``."""
    world = CrowdedWorld(mat, [ROAMING], seeds=seeds, **more)
    go(world, duration_ms)
    return world


def large_and_many(threads: int, kernels: str) -> list[str]:
    """The digests of one large world and some small ones after a run with ``threads`` threads."""
    many = ran(crowd(60), 1600, [5, 6, 7, 8, 9], threads=threads, kernels=kernels)
    large = ran(crowd(20_000), 1600, threads=threads, kernels=kernels)
    return [digest(large), *(digest(many, which) for which in range(many.worlds))]
