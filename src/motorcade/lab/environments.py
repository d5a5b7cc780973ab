"""Environments for learning: one world for PettingZoo, or many worlds that step at once for Gymnasium.

Each car that runs no program of its own is an agent. It observes what it senses and hears, and its action is a word
that it begins. The same seeds and actions give the same bits on every computer.
"""

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete, Space
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from motorcade.config.arguments import instance_of, not_allowed
from motorcade.errors import InputError
from motorcade.lab.showing import Window, WorldView
from motorcade.lab.stepping import EnvironmentSource, Options, SteppedWorlds

Singles = NDArray[np.float32]
Numbers = NDArray[Any]
Infos = dict[str, dict[str, Any]]
Value = TypeVar("Value")


def parallel_env(task: EnvironmentSource, *, render_mode: str | None = None, **options: Any) -> "ParallelCars":
    """Make an environment of PettingZoo of a mission, the id of one that comes with Motorcade, or a mat.

    Args:
        task: the mission or the mat. Agents are cars.
        render_mode: ``"rgb_array"``: `render` returns a picture; ``"human"``: a window shows each step; None: neither.
        options: those of `motorcade.lab.stepping.Options`.

    Raises:
        MotorcadeError: an argument isn't allowed, or the world can't be simulated.
    """
    _check_render_mode(render_mode, "rgb_array", "human")
    return ParallelCars(SteppedWorlds(task, 1, Options(**options)), render_mode)


def vector_env(task: EnvironmentSource, worlds: int, *, render_mode: str | None = None, **options: Any) -> "VectorCars":
    """Make a vector environment of Gymnasium of many worlds; each agent of each world is one of its environments.

    Agent a of world w is number w * agents + a, so that arrays take the shape (worlds, agents, …) without a copy. All
    episodes end at the same time; the step after that begins the next ones. ``render_mode`` may be ``"rgb_array"``. For
    the rest see `parallel_env`.
    """
    _check_render_mode(render_mode, "rgb_array")
    return VectorCars(SteppedWorlds(task, worlds, Options(**options)), render_mode)


def _check_render_mode(render_mode: str | None, *modes: str) -> None:
    if render_mode is not None and (not isinstance(render_mode, str) or render_mode not in modes):
        raise not_allowed("render_mode", render_mode, ", ".join(("None", *modes)))


def _metadata(stepped: SteppedWorlds, *modes: str) -> dict[str, Any]:
    return {"name": "motorcade", "render_modes": list(modes), "render_fps": max(round(1000 / stepped.step_ms), 1)}


def _spaces(stepped: SteppedWorlds) -> tuple[Box, Space[Any]]:
    """The spaces of an agent's observations and actions."""
    least, most = np.array(list(stepped.columns.values()), np.float32).T
    choices = stepped.choices
    actions: Space[Any] = Discrete(choices[0])
    if stepped.is_by_fields:
        actions = MultiDiscrete(choices)
    return Box(least, most), actions


class ParallelCars(ParallelEnv[str, Singles, Numbers]):
    """One world for PettingZoo; see `parallel_env`.

    An agent without an action in a step goes on with its word.

    Attributes:
        columns, choices: the names of the columns of an observation; how many values each number of an action has.
        state_space: the space of `state`.
    """

    def __init__(self, stepped: SteppedWorlds, render_mode: str | None = None) -> None:
        self.metadata = _metadata(stepped, "rgb_array", "human") | {"is_parallelizable": True}
        self.render_mode = render_mode
        self._stepped = stepped
        self._view = WorldView(stepped)
        self._window = Window()
        self.possible_agents = [f"car_{car}" for car in stepped.agents]
        self.agents: list[str] = []
        self.columns = tuple(stepped.columns)
        self.choices = stepped.choices
        spaces = {agent: _spaces(stepped) for agent in self.possible_agents}
        self.observation_spaces = {agent: pair[0] for agent, pair in spaces.items()}
        self.action_spaces = {agent: pair[1] for agent, pair in spaces.items()}
        least, most = np.array(list(stepped.state_columns.values()), np.float32).T
        cars = stepped.world.cars
        self.state_space = Box(np.tile(least, cars), np.tile(most, cars))

    def observation_space(self, agent: str) -> Box:
        """The space of what an agent observes."""
        return self._of(agent, self.observation_spaces)

    def action_space(self, agent: str) -> Space[Any]:
        """The space of an agent's actions."""
        return self._of(agent, self.action_spaces)

    def state(self) -> Singles:
        """What all cars sense and hear, and where they are, one car after the other, whether or not they are agents.

        Raises MotorcadeError: no episode has begun.
        """
        return self._stepped.state().reshape(-1)

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Singles], Infos]:
        """Begin an episode; without a seed, one with another seed than the last.

        ``options`` are those of `motorcade.lab.stepping.SteppedWorlds.reset`, which says what is refused.
        """
        self._stepped.reset(seed, options)
        self.agents = list(self.possible_agents)
        self._show()
        return self._observed(), {agent: {} for agent in self.agents}

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[dict[str, Singles], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Let agents begin the words of their actions, and simulate a step.

        Returns:
            By agent: observations, rewards, whether it has ended (never), whether the episode's time is over, and
            nothing more.

        Raises:
            MotorcadeError: an action isn't allowed or is of no agent, or no episode has begun.
        """
        if not instance_of(dict, "actions", actions).keys() <= self.action_spaces.keys():
            for agent in actions:
                self._of(agent, self.action_spaces)
        acts = None
        if len(actions) < len(self.possible_agents):
            acts = np.array([[agent in actions for agent in self.possible_agents]])
        rewards = self._stepped.step(self._chosen(actions), acts)[0].tolist()
        agents = self.agents
        is_over = self._stepped.is_over
        observed = self._observed()
        self.agents = [] if is_over else agents
        self._show()
        ended = dict.fromkeys(agents, False)
        over = dict.fromkeys(agents, is_over)
        return observed, dict(zip(agents, rewards, strict=True)), ended, over, {agent: {} for agent in agents}

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, an array of uint8 (height, width, 3); in the mode ``human`` show it in a window instead.

        Raises MotorcadeError: the environment was made without a mode, no episode has begun, or no window opens here.
        """
        picture = self._view.pictures(self.render_mode)[0]
        if self.render_mode == "rgb_array":
            return picture
        self._window.show(picture)
        return None

    def close(self) -> None:
        """Close the window."""
        self._window.close()

    def _chosen(self, actions: Mapping[str, Any]) -> Any:
        """The actions of all agents; zeros for those that don't act."""
        nothing = [0] * len(self.choices) if self._stepped.is_by_fields else 0
        chosen = [actions.get(agent, nothing) for agent in self.possible_agents]
        try:
            return np.array(chosen).reshape(1, len(chosen), -1)
        except ValueError:
            # Some are numbers and some are arrays.
            return [[np.reshape(action, -1) for action in chosen]]

    def _show(self) -> None:
        if self.render_mode == "human":
            self.render()

    def _of(self, agent: Any, spaces: Mapping[str, Value]) -> Value:
        if not isinstance(agent, str) or agent not in spaces:
            raise InputError("no-such-agent", agent=agent, allowed=", ".join(self.possible_agents[:9]))
        return spaces[agent]

    def _observed(self) -> dict[str, Singles]:
        return dict(zip(self.possible_agents, self._stepped.observations()[0], strict=True))


class VectorCars(VectorEnv[Singles, Numbers, Numbers]):
    """Many worlds for Gymnasium; see `vector_env`.

    Attributes:
        worlds, agents: how many worlds there are, and how many agents in each.
        columns, choices: the names of the columns of an observation; how many values each number of an action has.
    """

    def __init__(self, stepped: SteppedWorlds, render_mode: str | None = None) -> None:
        self.metadata = _metadata(stepped, "rgb_array") | {"autoreset_mode": AutoresetMode.NEXT_STEP}
        self.render_mode = render_mode
        self._stepped = stepped
        self._view = WorldView(stepped)
        self.worlds = stepped.world.worlds
        self.agents = len(stepped.agents)
        self.num_envs = self.worlds * self.agents
        self.columns = tuple(stepped.columns)
        self.choices = stepped.choices
        self.single_observation_space, self.single_action_space = _spaces(stepped)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Singles, dict[str, Any]]:
        """Begin the episodes: world w has the seed ``seed`` + w; without one, each has another than before.

        ``options`` are those of `motorcade.lab.stepping.SteppedWorlds.reset`, which says what is refused.
        """
        self._stepped.reset(seed, options)
        if seed is not None:
            seed = int(seed)
        super().reset(seed=seed)
        return self._observed(), {}

    def step(self, actions: Numbers) -> tuple[Singles, Numbers, Numbers, Numbers, dict[str, Any]]:
        """Let agents begin the words of their actions, and simulate a step; where the episodes are over, begin others.

        Returns:
            Observations, rewards, whether each agent has ended (never), whether its time is over, and nothing more.

        Raises:
            MotorcadeError: an action isn't allowed, or no episode has begun.
        """
        rewards = np.zeros(self.num_envs)
        if self._stepped.is_over:
            self._stepped.reset(None)
        else:
            rewards = self._stepped.step(self._by_world(actions)).reshape(-1)
        ended = np.zeros(self.num_envs, bool)
        over = np.full(self.num_envs, self._stepped.is_over)
        return self._observed(), rewards, ended, over, {}

    def render(self) -> tuple[NDArray[np.uint8], ...]:
        """Return a picture for each agent of each world, an array of uint8 (height, width, 3): that of its world.

        Raises MotorcadeError: the environment was made without ``render_mode``, or no episode has begun.
        """
        pictures = self._view.pictures(self.render_mode)
        return tuple(picture for picture in pictures for _ in range(self.agents))

    def _by_world(self, actions: Any) -> Any:
        """The actions of the agents of each world; what has no row for each agent is left as it is, and refused."""
        try:
            numbers = np.asarray(actions)
        except ValueError:
            return actions
        is_complete = numbers.ndim > 0 and len(numbers) == self.num_envs
        if is_complete:
            return numbers.reshape(self.worlds, self.agents, -1)
        return numbers

    def _observed(self) -> Singles:
        return self._stepped.observations().reshape(self.num_envs, -1)
