"""Environments: PettingZoo's own checks, equal bits everywhere, what cars do, observe and get."""

import hashlib
import math

import numpy as np
import pytest
from matplotlib import pyplot
from pettingzoo.test import parallel_api_test, parallel_seed_test

from motorcade.engine import world as engine_world
from motorcade.engine.backend import NAMES
from motorcade.engine.world import open_backend
from motorcade.errors import MotorcadeError
from motorcade.lab import parallel_env, vector_env
from motorcade.mats import Mat, Physics, Pose, open_table, playground
from motorcade.mats.model import Person, Starts
from motorcade.missions.document import built_in_mission
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.steps import led, wait
from support import mock_window

STAND, FORWARD, LEFT, RIGHT = 0, 3, 6, 9


def row(cars):
    return [Pose(0.1 + 0.15 * car, 0.1) for car in range(cars)]


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
    poses = [Pose(0.25 + 0.5 * column, 0.25 + 0.5 * row) for column in range(4) for row in range(3)]
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
    assert hashlib.sha256(np.stack(seen).tobytes()).hexdigest()[:16] == "600ddb2c8fd14c6b"


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


@pytest.mark.parametrize("tick_ms", [1, 20, 40])
def test_every_step_is_as_long_as_the_others(tick_ms):
    mat = open_table([Pose(0, 0)], tick_ms)
    env = parallel_env(mat, actions="wheels", pose=True, step_ms=200, seconds=1)
    env.reset(seed=0)
    at_m = [0.0]
    while env.agents:
        at_m.append(at(env, env.step({"car_0": FORWARD})[0], "car_0", "x_m"))
    assert np.diff(at_m) == pytest.approx([0.06] * 5, abs=1e-4)


def test_rewards_of_a_whole_episode_are_the_grade_of_the_mission():
    mission = built_in_mission("pass-it-on")
    env = parallel_env(mission, program=mission.solution)
    env.reset(seed=mission.seeds[0])
    got = 0.0
    while env.agents:
        got += next(iter(env.step({})[1].values()))
    assert got > 0.9


def test_bounds_are_finite_and_hold():
    for mat in (noisy(), open_table([Pose(0, 0), Pose(0.5, 0)], 20)):
        env = parallel_env(mat, pose=True, seconds=2)
        seen, _ = env.reset(seed=1)
        dice = np.random.RandomState(1)
        assert np.isfinite([env.observation_space("car_0").low, env.observation_space("car_0").high]).all()
        while env.agents:
            seen = env.step({agent: dice.randint(0, 1 << 30, 14) % env.choices for agent in env.agents})[0]
            assert all(env.observation_space(agent).contains(each) for agent, each in seen.items())
            assert env.state_space.contains(env.state())


def test_the_state_is_that_of_all_cars():
    program = Program([wait(seconds=1)], Followers([led(2, seconds=1)], tagged=False))
    env = parallel_env(open_table([Pose(0, 0), Pose(0.5, 0)], tick_ms=20), program=program, pose=True)
    seen, _ = env.reset(seed=0)
    leader, follower = env.state().reshape(2, -1)
    assert follower.tolist() == seen["car_1"].tolist()
    assert leader[-3:].tolist() == [0, 0, 0]


def test_a_reset_may_give_places():
    env = parallel_env(playground(), pose=True)
    places = np.array([[1.0, 1.0, 0.5], [1.5, 1.0, 1.0], [2.0, 1.0, 1.5], [1.0, 2.0, 2.0], [1.5, 2.0, 2.5]])
    seen, _ = env.reset(seed=1, options={"places": places})
    for number, (x, y, heading) in enumerate(places.tolist()):
        found = [at(env, seen, f"car_{number}", name) for name in ("x_m", "y_m", "heading")]
        assert found == pytest.approx([x, y, heading], abs=1e-5)
    again, _ = env.reset(seed=1, options={"places": [Pose(*place) for place in places.tolist()]})
    assert np.array_equal(np.stack([*again.values()]), np.stack([*seen.values()]))
    # The next episode begins where the mat says.
    seen, _ = env.reset(seed=1)
    assert at(env, seen, "car_0", "x_m") == pytest.approx(0.9)


@pytest.mark.parametrize("mat", [playground(), open_table(row(4), 20)], ids=["walled", "open"])
def test_random_starts_follow_the_seed(mat):
    def places(seed):
        seen, _ = parallel_env(mat, pose=True).reset(seed=seed, options={"random_starts": True})
        return np.stack([*seen.values()])[:, -3:].tolist()

    assert places(5) == places(5) != places(6)
    env = vector_env(mat, 2, pose=True)
    seen, _ = env.reset(seed=5, options={"random_starts": True})
    assert seen[:, -3:].reshape(2, env.agents, 3).tolist() == [places(5), places(6)]


def test_a_reset_may_give_another_program():
    other = compile_program(Program([wait(seconds=1)], Followers([led(3, seconds=1)], tagged=False))).image
    program = Program([wait(seconds=1)], Followers([led(2, seconds=1)], tagged=False))
    env = parallel_env(open_table([Pose(0, 0), Pose(0.5, 0)], tick_ms=20), program=program)

    def heard(options):
        env.reset(seed=0, options=options)
        return {at(env, env.step({})[0], "car_1", "heard_led_which") for _ in range(5)}

    assert [heard(options) & {2, 3} for options in (None, {"images": [other]}, None)] == [{2}, {3}, {2}]


def test_pictures_show_the_cars_in_one_size():
    env = parallel_env(open_table([Pose(0, 0), Pose(0, 1)], 20), actions="wheels", render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    assert (first.dtype, first.shape[2]) == (np.uint8, 3)
    for _ in range(40):
        env.step({"car_0": FORWARD, "car_1": STAND})
    # By now a car has left the first picture.
    assert env.render().shape == first.shape
    assert not np.array_equal(env.render(), first)
    many = vector_env(playground(), 2, render_mode="rgb_array")
    many.reset(seed=0)
    assert [picture.shape for picture in many.render()] == [many.render()[0].shape] * 10


def test_a_window_shows_each_step():
    before, figures_before = pyplot.get_backend(), pyplot.get_fignums()
    pyplot.switch_backend("module://support.mock_window")
    try:
        env = parallel_env(playground(), actions="wheels", render_mode="human", seconds=0.3)
        env.reset(seed=0)
        while env.agents:
            env.step(dict.fromkeys(env.agents, FORWARD))
        assert mock_window.shown == 4
        assert env.render() is None
        env.close()
        assert pyplot.get_fignums() == figures_before
    finally:
        pyplot.switch_backend(before)


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
        (lambda: parallel_env(playground(), actions=("forward", "forward")), "option-not-allowed"),
        (lambda: parallel_env(playground(), seconds=0), "option-not-allowed"),
        (lambda: parallel_env(playground(), seconds=-1), "option-not-allowed"),
        (lambda: parallel_env(playground(), seconds=math.nan), "option-not-allowed"),
        (lambda: parallel_env(playground(), render_mode="ansi"), "option-not-allowed"),
        (lambda: vector_env(playground(), 2, render_mode="human"), "option-not-allowed"),
        (lambda: parallel_env(mat_of(Pose(0, 0), Pose(0.1, 0))), "starts-too-close"),
        (lambda: parallel_env(playground()).state(), "episode-has-not-begun"),
        (lambda: parallel_env(playground(), render_mode="rgb_array").render(), "episode-has-not-begun"),
        (lambda: begun(parallel_env(playground())).render(), "no-render-mode"),
        (lambda: begun(parallel_env(playground(), render_mode="human")), "no-window"),
        (lambda: parallel_env(playground()).action_space("car_9"), "no-such-agent"),
        (lambda: parallel_env(playground()).observation_space("car_9"), "no-such-agent"),
        (lambda: begun(parallel_env(playground())).step({"car_9": np.zeros(14, int)}), "no-such-agent"),
        (lambda: begun(parallel_env(playground(), actions="wheels")).step({"car_0": 1.7}), "action-not-allowed"),
        (lambda: begun(parallel_env(playground(), actions="wheels")).step({"car_0": math.nan}), "action-not-allowed"),
        (lambda: begun(parallel_env(playground(), actions="wheels")).step({"car_0": "3"}), "action-not-allowed"),
        (lambda: begun(parallel_env(playground())).step({"car_0": [1, 2]}), "action-not-allowed"),
        (lambda: parallel_env(playground()).reset(seed=-1), "option-not-allowed"),
        (lambda: parallel_env(playground()).reset(seed=(1 << 32) + 1), "option-not-allowed"),
        (lambda: parallel_env(playground()).reset(options={"place": []}), "option-not-allowed"),
        (lambda: parallel_env(playground()).reset(options={"places": [(1, 1)]}), "places-differ-from-cars"),
        (lambda: parallel_env(playground()).reset(options={"places": [(1, 1)] * 5}), "starts-too-close"),
        (lambda: parallel_env(playground()).reset(options={"places": [(1,)] * 5}), "option-not-allowed"),
        (lambda: parallel_env(playground()).reset(options={"images": [bytes(4)]}), "images-without-leaders"),
        (
            lambda: parallel_env(playground()).reset(options={"places": [], "random_starts": True}),
            "places-and-random-starts",
        ),
        (
            lambda: parallel_env(mat_of(*row(30), size_m=(4.6, 0.2))).reset(options={"random_starts": True}),
            "crowd-has-no-room",
        ),
        (lambda: parallel_env(playground(), step_ms=50), "step-not-in-ticks"),
        (lambda: vector_env(playground(), 0), "option-not-allowed"),
        (
            lambda: parallel_env(open_table([Pose(0, 0)]), program=Program([wait(seconds=1)])),
            "environment-without-agents",
        ),
        (lambda: parallel_env(playground()).step({}), "episode-has-not-begun"),
        (lambda: vector_env(playground(), 2).step(np.zeros((10, 14))), "episode-has-not-begun"),
        (lambda: begun(vector_env(playground(), 2)).step(np.full((10, 14), 4)), "action-not-allowed"),
        (lambda: begun(vector_env(playground(), 2)).step(np.zeros((10, 3))), "action-not-allowed"),
        (lambda: begun(vector_env(playground(), 2)).step(np.zeros((14, 10), int)), "action-not-allowed"),
        (lambda: begun(vector_env(playground(), 2)).step(np.zeros(31, int)), "action-not-allowed"),
    ],
)
def test_what_is_wrong_is_a_sentence(use, code):
    with pytest.raises(MotorcadeError) as caught:
        use()
    assert caught.value.code == code


def begun(env):
    env.reset(seed=0)
    return env
