"""Worlds of a few cars on a table, and their events, for the tests of the simulator."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from motorcade import Followers, Pose, Program, World, compile_program, open_table
from motorcade.config.profile import Profile
from motorcade.engine.events import KINDS, LOSS_REASONS
from motorcade.mats import Mat, Starts
from motorcade.program.steps import Step
from support.strategies import CLASSROOM
from support.worlds import CrowdedWorld

STILL, FORWARD = 0, 2
LEFT, RIGHT_FAST, FORWARD_FAST = 1 * 4 + 2, 2 * 4 + 3, 3


def world(
    mat: Mat, leader: list[Step], followers: Followers | list[Step] | None = None, profile: Profile = CLASSROOM
) -> World:
    """A world of cars whose leaders run one program."""
    return CrowdedWorld(mat, [compile_program(Program(leader, followers)).image], profile, events=True)


def table(leader: list[Step], followers: Followers | list[Step] | None, poses: Sequence[Pose], **more: Any) -> World:
    """Cars on a table, of which the first leads; ``more`` changes the table."""
    return world(replace(open_table(poses), **more), leader, followers)


def leaders(steps: list[Step], poses: Sequence[Pose], profile: Profile = CLASSROOM, **more: Any) -> World:
    """Cars that all lead."""
    return world(Mat("leaders", Starts.of(poses, [True] * len(poses)), **more), steps, None, profile)


def events_of(cars: World, duration_ms: int, kind: str, car: int | None = None, why: str | None = None) -> np.ndarray:
    """Run the world; gives the events of a kind, of one car and for one reason if they are given."""
    cars.run(duration_ms)
    events = cars.take_events()
    wanted = (events["kind"] == KINDS.index(kind)) & ((events["car"] == car) | (car is None))
    return events[wanted & ((why is None) or (events["why"] == LOSS_REASONS.index(why or "")))]


def hearers(cars: World, duration_ms: int) -> set[int]:
    """Run the world; gives the cars that receive a frame."""
    return set(events_of(cars, duration_ms, "heard")["car"].tolist())


def wheels(cars: World, ticks: int, car: int = 0) -> list[int]:
    """The state of the wheels of a car after each tick."""
    shown = []
    for _ in range(ticks):
        cars.step()
        shown.append(int(cars.snapshot().wheels[car]))
    return shown


def counted(cars: World) -> dict[str, int]:
    """The counts of a single world."""
    return {name: int(values[0]) for name, values in cars.counts().items()}
