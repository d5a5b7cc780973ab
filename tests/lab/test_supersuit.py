"""PettingZoo's recipe for Stable-Baselines3: SuperSuit's wrappers, and a small learner on what they make."""

import numpy as np
import pytest

from motorcade.lab import parallel_env
from motorcade.mats import Pose, open_table, playground

pytestmark = [
    pytest.mark.soak,
    # SuperSuit warns of what it does itself.
    pytest.mark.filterwarnings("default::UserWarning", "default::DeprecationWarning"),
]
supersuit = pytest.importorskip("supersuit", reason="`make soak` installs SuperSuit")
ROUNDS, RATE = 40, 0.1


def wrapped(env, copies, frames=4, **more):
    """As PettingZoo's tutorial wraps an environment for Stable-Baselines3."""
    env = supersuit.frame_stack_v1(supersuit.normalize_obs_v0(env), frames)
    return supersuit.concat_vec_envs_v1(supersuit.pettingzoo_env_to_vec_env_v1(env), copies, **more)


@pytest.mark.parametrize("processes", [0, 2])
def test_copies_side_by_side_are_what_each_would_be_alone(processes):
    dice = np.random.RandomState(1)
    make = {"actions": "wheels", "pose": True, "seconds": 1, "step_ms": 200}
    many = wrapped(parallel_env(playground(), **make), 2, num_cpus=processes, base_class="gymnasium")
    alone = [wrapped(parallel_env(playground(), **make), 1, num_cpus=0, base_class="gymnasium") for _ in range(2)]
    seen = many.reset(seed=5)[0]
    assert np.array_equal(seen, np.concatenate([env.reset(seed=5 + k)[0] for k, env in enumerate(alone)]))
    # The last step begins the next episodes, with seeds of their own.
    for _ in range(4):
        actions = dice.randint(0, 10, many.num_envs)
        seen, _, _, over, _ = many.step(actions)
        parts = [env.step(each) for env, each in zip(alone, np.split(actions, 2), strict=True)]
        assert np.array_equal(seen, np.concatenate([part[0] for part in parts]))
        assert not over.any()
        assert ((seen >= 0) & (seen <= 1)).all()
    assert many.step(np.zeros(many.num_envs, int))[3].all()
    many.close()


def test_pictures_of_a_wrapped_environment():
    env = wrapped(parallel_env(playground(), actions="wheels", render_mode="rgb_array"), 2, base_class="gymnasium")
    env.reset(seed=1)
    assert env.render().shape[2] == 3


def progress(before, now):
    return (now.x_m - before.x_m) * 30


def test_a_small_learner_learns_to_drive():
    """By REINFORCE, with a linear policy that all cars share; every way but straight on at full speed is worse."""
    mat = open_table([Pose(0, row) for row in range(4)], 20)
    env = parallel_env(mat, actions="wheels", reward=progress, pose=True, seconds=2)
    env = wrapped(env, 4, frames=1, num_cpus=0, base_class="gymnasium")
    dice, weights = np.random.RandomState(1), np.zeros((env.observation_space.shape[0] + 1, 10))
    mean_rewards = []
    seen, _ = env.reset(seed=1)
    for _ in range(ROUNDS):
        slope, got = [], []
        for _ in range(20):
            inputs = np.column_stack([seen, np.ones(env.num_envs)])
            odds = np.exp(inputs @ weights)
            odds /= odds.sum(axis=1, keepdims=True)
            actions = (odds.cumsum(axis=1) > dice.rand(env.num_envs, 1)).argmax(axis=1)
            slope.append(inputs[:, :, None] * (np.eye(10)[actions] - odds)[:, None, :])
            seen, rewards, *_ = env.step(actions)
            got.append(rewards)
        later = np.cumsum(got[::-1], axis=0)[::-1]
        advantage = later - later.mean(axis=1, keepdims=True)
        weights += RATE * np.einsum("te,teij->ij", advantage, np.array(slope)) / env.num_envs
        mean_rewards.append(np.mean(got))
    assert np.mean(mean_rewards[:5]) < 0.4
    assert np.mean(mean_rewards[-5:]) > 0.7
