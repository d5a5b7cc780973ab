"""Environments: PettingZoo's own checks, equal bits everywhere, what cars do, observe and get."""

import hashlib
import math

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test

from motorcade.engine import world as engine_world
from motorcade.engine.backend import NAMES
from motorcade.engine.world import open_backend
from motorcade.errors import MotorcadeError
from motorcade.lab import parallel_env, vector_env
from motorcade.mats import Mat, Physics, Pose, open_table, playground
from motorcade.mats.model import Person, Starts
from motorcade.missions.document import built_in_mission
from motorcade.program.model import Followers, Program
from motorcade.program.steps import led, wait

STAND, FORWARD, LEFT, RIGHT = 0, 3, 6, 9


def mat_of(*poses, **more):
    return Mat("lab", Starts.of(poses, [False] * len(poses)), 20, **more)


@pytest.mark.parametrize(
    "make",
    [
        lambda: parallel_env(playground(), pose=True, seconds=1),
        lambda: parallel_env(playground(), actions="wheels", seconds=1),
        lambda: parallel_env("pass-it-on", actions=("motor_direction", "forward", "led_duration"), seconds=0.5),
        lambda: parallel_env("pass-it-on", program=built_in_mission("pass-it-on").solution, step_ms=200, seconds=1),
    ],
    ids=["words", "wheels", "fields", "program"],
)
@pytest.mark.filterwarnings("error")
def test_pettingzoo_accepts_it(make):
    parallel_api_test(make(), num_cycles=15)
    parallel_seed_test(make, num_cycles=8)


def noisy():
    poses = [Pose(0.5 * column, 0.5 * row) for column in range(4) for row in range(3)]
    return mat_of(*poses, size_m=(2, 2), walled=True, discs=((1, 0.25, 0.1),), physics=Physics(wheel_noise=0.1))


def episode(env, seed, steps=12):
    """All that agents observe and get, as bytes, for actions that depend on the seed alone."""
    dice = np.random.RandomState(1)
    seen = [env.reset(seed=seed)[0]]
    for _ in range(steps):
        actions = dice.randint(0, 1 << 30, (12, 14)) % env.choices
        if isinstance(seen[0], dict):
            seen.append(env.step(dict(zip(env.agents, actions, strict=True)))[0])
        else:
            seen.append(env.step(np.tile(actions, (env.worlds, 1)))[0])
    return [np.stack(list(each.values())) if isinstance(each, dict) else each for each in seen]


@pytest.mark.parametrize("kernels", NAMES)
def test_the_same_seeds_give_the_same_bits_on_every_machine(kernels, monkeypatch):
    monkeypatch.setattr(engine_world, "open_backend", lambda name, needed: open_backend(kernels, needed))
    seen = episode(parallel_env(noisy(), pose=True), 7)
    assert hashlib.sha256(np.stack(seen).tobytes()).hexdigest()[:16] == "fffaca18a9fbe76e"


def test_worlds_side_by_side_are_what_each_would_be_alone():
    together = np.stack(episode(vector_env(noisy(), 3, pose=True), 5)).reshape(13, 3, 12, -1)
    for world in range(3):
        assert np.array_equal(together[:, world], np.stack(episode(parallel_env(noisy(), pose=True), 5 + world)))
    assert not np.array_equal(together[:, 0], together[:, 1])


def at(env, observed, agent, column):
    return float(observed[agent][env.columns.index(column)])


def test_wheels_drive_and_turn():
    env = parallel_env(mat_of(Pose(0, 0), Pose(0, 1), Pose(0, 2)), actions="wheels", pose=True)
    env.reset(seed=0)
    for _ in range(10):
        seen, *_ = env.step({"car_0": FORWARD, "car_1": LEFT, "car_2": RIGHT})
    assert at(env, seen, "car_0", "x_m") == pytest.approx(0.3, abs=0.01)
    assert at(env, seen, "car_1", "heading") == pytest.approx(math.pi / 2, abs=0.04)
    assert at(env, seen, "car_2", "heading") == pytest.approx(3 * math.pi / 2, abs=0.04)
    for _ in range(5):
        seen, *_ = env.step({"car_0": STAND})
    assert at(env, seen, "car_0", "x_m") == pytest.approx(0.3, abs=0.01)
    # Who is given no action goes on with its word.
    assert at(env, seen, "car_1", "heading") == pytest.approx(math.pi * 3 / 4, abs=0.04)


def test_cars_hear_the_words_of_others_within_range():
    env = parallel_env(mat_of(Pose(0, 0), Pose(0.8, 0), Pose(2.5, 0)), actions=("forward", "motor_speed", "led_which"))
    env.reset(seed=0)
    heard = set()
    for _ in range(8):
        seen, *_ = env.step({"car_0": (1, 0, 2), "car_1": (0, 0, 0), "car_2": (0, 0, 0)})
        heard |= {agent for agent in env.agents if at(env, seen, agent, "heard")}
        if at(env, seen, "car_1", "heard"):
            assert (at(env, seen, "car_1", "heard_led_which"), at(env, seen, "car_1", "heard_forward")) == (2, 1)
    assert heard == {"car_1"}


def test_cars_sense_obstacles_people_and_the_floor():
    mat = mat_of(
        *(Pose(0, 0), Pose(0, 5), Pose(0, 10)),
        discs=((1.0, 0, 0.1),),
        people=(Person(((0, 1, 5),)),),
        patches=(((-1, 10), (1, 10), (1, 11), (-1, 11)),),
    )
    seen, _ = (env := parallel_env(mat)).reset(seed=0)
    sensed = {agent: [round(at(env, seen, agent, name), 3) for name in env.columns[:5]] for agent in env.agents}
    names = list(env.columns[:5])
    expected = {"obstacle_m": [0.825, 2, 2], "person": [0, 1, 0], "dark_left": [0, 0, 1], "dark_right": [0, 0, 0]}
    for name, values in expected.items():
        assert [sensed[agent][names.index(name)] for agent in env.agents] == pytest.approx(values), name


def test_rewards_are_how_much_the_grade_grows():
    def episode(action):
        env = parallel_env("forward-and-stop", actions="wheels")
        env.reset(seed=0)
        rewards = []
        while env.agents:
            _, got, *_ = env.step({"car_0": action if len(rewards) < 20 else STAND})
            rewards.append(got["car_0"])
        return rewards

    arrived, stayed = episode(FORWARD), episode(STAND)
    assert len(arrived) == len(stayed) == 80
    assert sum(arrived) > 0.5
    assert sum(stayed) < 0.01
    assert max(arrived) == arrived[13]  # it enters the garage


def test_a_program_leads_and_followers_are_agents():
    program = Program([wait(seconds=1)], Followers([led(2, seconds=1)], tagged=False))
    env = parallel_env(open_table([Pose(0, 0), Pose(0.5, 0)], tick_ms=20), program=program)
    env.reset(seed=0)
    assert env.agents == ["car_1"]
    heard = [at(env, env.step({})[0], "car_1", "heard_led_which") for _ in range(3)]
    assert 2 in heard


def test_a_reward_may_be_any_function_of_what_all_cars_sense():
    def apart(before, now):
        return now.x_m - before.x_m

    env = vector_env(mat_of(Pose(0, 0), Pose(0, 1)), 2, actions="wheels", reward=apart, seconds=0.5)
    env.reset(seed=1)
    for step in range(5):
        _, rewards, ended, over, _ = env.step(np.array([FORWARD, STAND, STAND, FORWARD]))
        assert rewards == pytest.approx([0.03, 0, 0, 0.03], abs=0.007)
        assert (ended.any(), over.all()) == (False, step == 4)
    # The next step begins other episodes, whatever the actions.
    _, rewards, _, over, _ = env.step(np.array([FORWARD] * 4))
    assert (rewards.any(), over.any()) == (False, False)


@pytest.mark.parametrize(
    ("use", "code"),
    [
        (lambda: parallel_env("no-such-mission"), "no-mission"),
        (lambda: parallel_env(playground(), actions=("speed",)), "option-not-allowed"),
        (lambda: parallel_env(playground(), step_ms=50), "step-not-in-ticks"),
        (lambda: vector_env(playground(), 0), "environment-without-agents"),
        (
            lambda: parallel_env(open_table([Pose(0, 0)]), program=Program([wait(seconds=1)])),
            "environment-without-agents",
        ),
        (lambda: parallel_env(playground()).step({}), "episode-has-not-begun"),
        (lambda: vector_env(playground(), 2).step(np.zeros((10, 14))), "episode-has-not-begun"),
        (lambda: begun(vector_env(playground(), 2)).step(np.full((10, 14), 4)), "action-not-allowed"),
        (lambda: begun(vector_env(playground(), 2)).step(np.zeros((10, 3))), "action-not-allowed"),
    ],
)
def test_what_is_wrong_is_a_sentence(use, code):
    with pytest.raises(MotorcadeError) as caught:
        use()
    assert caught.value.code == code


def begun(env):
    env.reset(seed=0)
    return env
