"""Environments for learning: one world for PettingZoo, or many worlds that step at once for Gymnasium.

Each car that runs no program of its own is an agent. It observes what it senses and hears, and its action is a word
that it begins. The same seeds and actions give the same bits on every computer.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete, Space
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from motorcade.lab.stepping import EnvironmentSource, Options, SteppedWorlds

Singles = NDArray[np.float32]
Numbers = NDArray[Any]
Infos = dict[str, dict[str, Any]]


def parallel_env(task: EnvironmentSource, **options: Any) -> "ParallelCars":
    """Make an environment of PettingZoo of a mission, the id of one that comes with Motorcade, or a mat.

    The agents are cars; ``options`` are those of `motorcade.lab.stepping.Options`. Raises MotorcadeError: an argument
    isn't allowed, or the world can't be simulated.
    """
    return ParallelCars(SteppedWorlds(task, 1, Options(**options)))


def vector_env(task: EnvironmentSource, worlds: int, **options: Any) -> "VectorCars":
    """Make a vector environment of Gymnasium of many worlds; each agent of each world is one of its environments.

    Agent a of world w is number w * agents + a, so that arrays take the shape (worlds, agents, …) without a copy. All
    episodes end at the same time; the step after that begins the next ones. For the rest see `parallel_env`.
    """
    return VectorCars(SteppedWorlds(task, worlds, Options(**options)))


def _spaces(stepped: SteppedWorlds) -> tuple[Box, Space[Any]]:
    """The spaces of an agent's observations and actions."""
    least, most = np.array(list(stepped.columns.values()), np.float32).T
    choices = stepped.choices
    return Box(least, most), MultiDiscrete(choices) if stepped.is_by_fields else Discrete(choices[0])


class ParallelCars(ParallelEnv[str, Singles, Numbers]):
    """One world for PettingZoo; see `parallel_env`.

    An agent without an action in a step goes on with its word.

    Attributes:
        columns, choices: the names of the columns of an observation; how many values each number of an action has.
    """

    def __init__(self, stepped: SteppedWorlds) -> None:
        self.metadata = {"name": "motorcade", "render_modes": []}
        self._stepped = stepped
        self.possible_agents = [f"car_{car}" for car in stepped.agents]
        self.agents: list[str] = []
        self.columns, self.choices = tuple(stepped.columns), stepped.choices
        spaces = {agent: _spaces(stepped) for agent in self.possible_agents}
        self.observation_spaces = {agent: each[0] for agent, each in spaces.items()}
        self.action_spaces = {agent: each[1] for agent, each in spaces.items()}

    def observation_space(self, agent: str) -> Box:
        """The space of what an agent observes."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space[Any]:
        """The space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Singles], Infos]:
        """Begin an episode; without a seed, one with another seed than the last. ``options`` has no effect."""
        self._stepped.reset(seed)
        self.agents = list(self.possible_agents)
        return self._observed(), {agent: {} for agent in self.agents}

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[dict[str, Singles], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Let agents begin the words of their actions, and simulate a step.

        Returns:
            By agent: observations, rewards, whether it has ended (never), whether the episode's time is over, and
            nothing more.

        Raises:
            MotorcadeError: an action isn't allowed, or no episode has begun.
        """
        nothing = np.zeros(len(self.choices), np.int64)
        chosen = [np.reshape(actions.get(agent, nothing), -1) for agent in self.possible_agents]
        acts = np.array([[agent in actions for agent in self.possible_agents]])
        rewards = self._stepped.step([chosen], acts)[0].tolist()
        agents, is_over = self.agents, self._stepped.is_over
        observed, self.agents = self._observed(), [] if is_over else agents
        ended, over = dict.fromkeys(agents, False), dict.fromkeys(agents, is_over)
        return observed, dict(zip(agents, rewards, strict=True)), ended, over, {agent: {} for agent in agents}

    def _observed(self) -> dict[str, Singles]:
        return dict(zip(self.possible_agents, self._stepped.observations()[0], strict=True))


class VectorCars(VectorEnv[Singles, Numbers, Numbers]):
    """Many worlds for Gymnasium; see `vector_env`.

    Attributes:
        worlds, agents: how many worlds there are, and how many agents in each.
        columns, choices: the names of the columns of an observation; how many values each number of an action has.
    """

    def __init__(self, stepped: SteppedWorlds) -> None:
        self.metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}
        self._stepped = stepped
        self.worlds, self.agents = stepped.world.worlds, len(stepped.agents)
        self.num_envs = self.worlds * self.agents
        self.columns, self.choices = tuple(stepped.columns), stepped.choices
        self.single_observation_space, self.single_action_space = _spaces(stepped)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Singles, dict[str, Any]]:
        """Begin the episodes: world w has the seed ``seed`` + w; without one, each has another than before."""
        super().reset(seed=seed)
        self._stepped.reset(seed)
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
            numbers = np.reshape(actions, (self.worlds, self.agents, -1))
            rewards = self._stepped.step(numbers).reshape(-1)
        ended, over = np.zeros(self.num_envs, bool), np.full(self.num_envs, self._stepped.is_over)
        return self._observed(), rewards, ended, over, {}

    def _observed(self) -> Singles:
        return self._stepped.observations().reshape(self.num_envs, -1)
