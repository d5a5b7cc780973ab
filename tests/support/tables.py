"""Worlds of a few cars on a table, and what they tell, for the tests of the simulator."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from motorcade import Followers, Pose, Program, World, compile_program, open_table
from motorcade.config.profile import Profile
from motorcade.engine.world import KINDS, LOSS_REASONS
from motorcade.mats import Mat, Starts
from motorcade.program.steps import Step
from support.strategies import CLASSROOM

STILL, FORWARD = 0, 2
LEFT, RIGHT_FAST, FORWARD_FAST = 1 * 4 + 2, 2 * 4 + 3, 3


def world(
    mat: Mat, leader: list[Step], followers: Followers | list[Step] | None = None, profile: Profile = CLASSROOM
) -> World:
    """Cars on a mat, whose leaders run one program."""
    return World(mat, [compile_program(Program(leader, followers)).image], profile, events=True)


def table(leader: list[Step], followers: Followers | list[Step] | None, poses: Sequence[Pose], **more: object) -> World:
    """Cars on a table, the first of them leading; ``more`` changes the table."""
    return world(replace(open_table(poses), **more), leader, followers)


def leaders(steps: list[Step], poses: Sequence[Pose], profile: Profile = CLASSROOM, **more: object) -> World:
    """Cars that all lead."""
    return world(Mat("leaders", Starts.of(poses, [True] * len(poses)), **more), steps, None, profile)


def told(cars: World, duration_ms: int, kind: str, car: int | None = None, why: str | None = None) -> np.ndarray:
    """The events of a kind in the next while, of one car and for one reason where they are given."""
    cars.run(duration_ms)
    events = cars.take_events()
    wanted = (events["kind"] == KINDS.index(kind)) & ((events["car"] == car) | (car is None))
    return events[wanted & ((why is None) or (events["why"] == LOSS_REASONS.index(why or "")))]


def hearers(cars: World, duration_ms: int) -> set[int]:
    """The cars that hear a frame in the next while."""
    return set(told(cars, duration_ms, "heard")["car"].tolist())


def wheels(cars: World, ticks: int, car: int = 0) -> list[int]:
    """What the wheels of a car do after each tick."""
    shown = []
    for _ in range(ticks):
        cars.step()
        shown.append(int(cars.snapshot().wheels[car]))
    return shown


def counted(cars: World) -> dict[str, int]:
    """The counts of a single world."""
    return {name: int(values[0]) for name, values in cars.counts().items()}
