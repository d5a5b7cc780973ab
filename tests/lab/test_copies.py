"""Copies of environments step as the originals do."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest

from motorcade.lab import parallel_env, vector_env
from motorcade.mats import formation, open_table
from motorcade.runs.running import simulate
from support.worlds import ROAMING

MAT = open_table(formation(3), tick_ms=20)


def farther(before: Any, now: Any) -> Any:
    return now.x_m - before.x_m


def copies_of(thing: Any) -> list[Any]:
    return [copy.deepcopy(thing), pickle.loads(pickle.dumps(thing))]


@pytest.mark.parametrize("task", [MAT, "pass-it-on"])
def test_a_copy_of_one_world_steps_alike(task: Any) -> None:
    env = parallel_env(task, pose=True, reward=farther if task is MAT else None)
    env.reset(seed=3)
    dice = np.random.default_rng(1)

    def actions() -> dict[str, Any]:
        return {agent: dice.integers(env.choices) for agent in env.agents}

    env.step(actions())
    copies = copies_of(env)
    for _ in range(12):
        chosen = actions()
        observed, rewards, *rest = env.step(chosen)
        for each in copies:
            its_observed, its_rewards, *its_rest = each.step(chosen)
            assert {agent: seen.tolist() for agent, seen in its_observed.items()} == {
                agent: seen.tolist() for agent, seen in observed.items()
            }
            assert (its_rewards, its_rest) == (rewards, rest)
    for each in (env, *copies):
        each.reset(seed=4)
    assert [each._stepped.world.save() for each in copies] == [env._stepped.world.save()] * 2


def test_a_copy_of_many_worlds_steps_alike() -> None:
    env = vector_env(MAT, 4, actions="wheels", seconds=1)
    env.reset(seed=3)
    dice = np.random.default_rng(1)
    env.step(dice.integers(10, size=env.num_envs))
    copies = copies_of(env)
    # Over the end of the episodes, behind which others begin.
    for _ in range(15):
        chosen = dice.integers(10, size=env.num_envs)
        answer = env.step(chosen)
        for each in copies:
            for ours, its in zip(answer[:4], each.step(chosen)[:4], strict=True):
                assert np.array_equal(ours, its)


def test_a_copy_before_the_first_episode_begins_with_the_same_seed() -> None:
    env = parallel_env(MAT, pose=True)
    copied = copy.deepcopy(env)
    assert env.reset()[0]["car_0"].tolist() == copied.reset()[0]["car_0"].tolist()


def test_a_run_can_be_copied_and_comes_back_from_another_process() -> None:
    run = simulate(ROAMING, followers=3, seconds=2)
    for each in copies_of(run):
        assert each.world.save() == run.world.save()
        assert each.driven_m.tolist() == run.driven_m.tolist()
        assert each.events.tolist() == run.events.tolist()
        assert each.slots == run.slots
        assert [moment.x_m.tolist() for moment in each.recording.moments()] == [
            moment.x_m.tolist() for moment in run.recording.moments()
        ]
