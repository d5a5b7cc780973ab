"""Worlds that are stepped side by side: cars begin words, the engine runs, and what the cars sense and hear is read.

`motorcade.lab.environments` makes environments for PettingZoo and Gymnasium of them; this module needs neither.
"""

import math
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motorcade.config.arguments import (
    MOST_SEED,
    instance_of,
    not_allowed,
    to_function,
    to_list,
    to_number,
    to_truth,
    to_whole,
)
from motorcade.engine import agents
from motorcade.engine.geometry import FULL_TURN
from motorcade.engine.simulation import checked_images
from motorcade.engine.state import Buffer
from motorcade.engine.world import World
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.lab.starts import random_starts, starts_of
from motorcade.mats import Mat
from motorcade.mats.model import flags
from motorcade.mats.schema import LAST_S
from motorcade.missions.check import grade_of
from motorcade.missions.document import built_in_mission
from motorcade.missions.goal import EVERY_MS
from motorcade.missions.model import Mission
from motorcade.missions.watch import MissionWatch, begun_words, run_to_next
from motorcade.program.compiler import compile_program
from motorcade.program.model import Program
from motorcade.words.formats import CONTROL

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
EnvironmentSource = Mission | Mat | str
Actions = Sequence[str] | Literal["words", "wheels"]

# The fields of a control word that an action can set.
FIELDS = {field.name: field for field in CONTROL.fields if not field.reserved and field.name != "parity"}
# What fields hold that an action doesn't set: the car listens, and drives until its next action.
_OTHERS = {"accept_ir": 1, "motor_enable": 1, "motor_duration": 3}
# Direction and speed for each number of the actions "wheels".
_WHEELS = ((0, 0), *((direction, speed) for direction in range(3) for speed in (1, 2, 3)))
# The columns of an observation, with the least and the largest value of each.
_SENSED = ("person", "dark_left", "dark_right", "heard", "obstacle_m")
_HEARD = {f"heard_{name}": (0.0, float(field.maximum)) for name, field in FIELDS.items()}
_POSE = ("x_m", "y_m", "heading")
# The engine counts micrometres in 32 bits.
_FARTHEST_M = (1 << 31) / 1e6
_MAT_S = 60.0
_LONGEST_STEP_MS = 1_000_000
_NO_PROGRAM = bytes(4)
# What `reset` may be told.
RESET_OPTIONS = ("places", "images", "random_starts")
# PettingZoo's own checks pass it.
_WITHOUT_EFFECT = "options"


class Readings(NamedTuple):
    """What all cars sense and hear at a moment; arrays of shape (worlds, cars).

    Attributes:
        now_ms: the simulated time.
        obstacle_m: what the ultrasonic sensor measures; its range where it finds nothing.
        person: whether the PIR sensor finds a person.
        dark_left, dark_right: whether the floor sensors are over dark.
        heard: whether the car has begun a word by infrared since its last action.
        word: the control word that it executes or holds.
        x_m, y_m, heading: its pose; the heading is 0 to 2π, counter-clockwise from the x axis.
    """

    now_ms: int
    obstacle_m: Floats
    person: Flags
    dark_left: Flags
    dark_right: Flags
    heard: Flags
    word: NDArray[np.uint32]
    x_m: Floats
    y_m: Floats
    heading: Floats


# The rewards for a step, from the readings before and after it: an array of shape (worlds, cars), or one that fits it.
Reward = Callable[[Readings, Readings], Floats]


@dataclass(frozen=True, kw_only=True)
class Options:
    """How cars become agents: all that run no program of their own.

    Attributes:
        program: what the leaders run; None: leaders are agents, too.
        actions: what an agent sets: "words" (all fields of a control word), names of some of these fields, or "wheels"
            (0 stands still; 1 to 3 forward, 4 to 6 left, 7 to 9 right, each at three speeds).
        reward: of a step; None: by how much the mission's grade grows.
        pose: whether agents observe their place and heading.
        step_ms: how long an action lasts: a whole number of ticks.
        seconds: how long an episode lasts, more than 0; None: as long as the mission, or 60 s on a mat.

    Raises:
        MotorcadeError: a value is not allowed.
    """

    program: Program | None = None
    actions: Actions = "words"
    reward: Reward | None = None
    pose: bool = False
    step_ms: int = 100
    seconds: float | None = None

    def __post_init__(self) -> None:
        if self.program is not None:
            instance_of(Program, "program", self.program)
        if self.reward is not None:
            to_function("reward", self.reward)
        object.__setattr__(self, "pose", to_truth("pose", self.pose))
        object.__setattr__(self, "step_ms", to_whole("step_ms", self.step_ms, 1, _LONGEST_STEP_MS))
        if self.seconds is not None:
            object.__setattr__(self, "seconds", to_number("seconds", self.seconds, 0.001, LAST_S))


class SteppedWorlds:
    """Some worlds of one mission, the id of one that comes with Motorcade, or of a mat.

    Attributes:
        world: the engine's.
        agents: the numbers of the cars that take actions.
        choices: how many values each number of an action has.
        is_by_fields: whether these are fields of words; else there is one number for the wheels.
        columns: the least and the largest value of each column of an observation, by name. What a car heard is 0
            where it heard nothing.
        state_columns: the same of a car in `state`: it has the pose in any case.
        step_ms: how long a step lasts.
        has_begun: whether an episode has begun.

    Raises:
        MotorcadeError: an argument isn't allowed, or the world can't be simulated.
    """

    def __init__(self, task: EnvironmentSource, worlds: int, options: Options) -> None:
        program = options.program
        step_ms = options.step_ms
        if isinstance(task, str):
            task = built_in_mission(task)
        if not isinstance(task, Mission | Mat):
            raise not_allowed("task", task, Phrase("mission-or-mat"))
        worlds = to_whole("worlds", worlds, 1, MOST_SEED)
        mission = profile = None
        usual_s: float = _MAT_S
        if isinstance(task, Mission):
            mission = task
            mat = task.mat
            profile = task.profile
            usual_s = task.duration_ms / 1000
        else:
            mat = task
        self._images = [compile_program(program, profile).image if program else _NO_PROGRAM]
        if program is None:
            mat = replace(mat, starts=replace(mat.starts, leads=flags([False] * len(mat.starts))))
        if step_ms < mat.tick_ms or step_ms % mat.tick_ms:
            raise InputError("step-not-in-ticks", step_ms=step_ms, tick_ms=mat.tick_ms)
        self.agents = np.flatnonzero(~np.asarray(mat.starts.leads))
        if not len(self.agents):
            raise InputError("environment-without-agents")
        # Agents are mostly neighbours: then arrays needn't be gathered.
        first, last = self.agents[[0, -1]].tolist()
        self._places = slice(first, last + 1) if last - first + 1 == len(self.agents) else self.agents
        self._set_actions(options.actions)
        self._choices = np.array(self.choices, np.uint64)
        self._reward = options.reward
        # The mission whose grade gives the rewards.
        self._watched = mission if options.reward is None else None
        self._open(World(mat, self._images, profile, seeds=range(worlds), events=self._watched is not None))
        self.has_begun = False
        self._next_seed = secrets.randbelow(MOST_SEED)
        self.step_ms = step_ms
        length_s = options.seconds
        if length_s is None:
            length_s = usual_s
        self._length_ms = math.ceil(length_s * 1000 / step_ms) * step_ms
        self._range_m = self.world.profile.body.ultrasonic_range_mm / 1000
        self.state_columns = self._limits(mat)
        self.columns = {
            name: limits for name, limits in self.state_columns.items() if options.pose or name not in _POSE
        }

    def _open(self, world: World) -> None:
        """Step these worlds from now on. Their kernels write into the same arrays in each step."""
        self.world = world
        memory = world.backend
        cars = world.worlds * world.cars
        fields = Buffer.of("int64", [number for field in FIELDS.values() for number in (field.low, field.raw_mask)], 2)
        self._fields = memory.allocate("observed.fields", fields)
        # The words that cars begin in a step; and those that they had before it, with when they began.
        self._given = memory.zeros("observed.given", (cars,), "uint32")
        self._told = memory.zeros("observed.told", (3, cars), "int64")
        self._sensed = memory.zeros("observed.sensed", (cars, agents.SENSED), "int64")
        self._seen = memory.zeros("observed.seen", (cars, agents.SEEN + len(FIELDS)), "float32")

    def _limits(self, mat: Mat) -> dict[str, tuple[float, float]]:
        """The least and the largest value of each column that can be observed."""
        wide_m = high_m = -_FARTHEST_M, _FARTHEST_M
        if mat.walled and mat.size_m and mat.physics.collisions:
            wide_m = (0.0, mat.size_m[0])
            high_m = (0.0, mat.size_m[1])
        sensed = dict.fromkeys(_SENSED, (0.0, 1.0)) | {"obstacle_m": (0.0, self._range_m)}
        return sensed | _HEARD | {"x_m": wide_m, "y_m": high_m, "heading": (0.0, math.tau)}

    def _set_actions(self, actions: Actions) -> None:
        """Prepare to make words of actions: ``_shifts`` places the numbers of an action in ``_base``."""
        self.is_by_fields = actions != "wheels"
        if actions == "wheels":
            words = [CONTROL.encode(**_OTHERS, motor_direction=way, motor_speed=speed) for way, speed in _WHEELS]
            self.choices = [len(words)]
            self._shifts = None
            self._base = np.array(words, np.uint32)
            return
        names = list(FIELDS)
        if actions != "words":
            names = to_list("actions", actions)
        for number, name in enumerate(names):
            if not isinstance(name, str) or name not in FIELDS or name in names[:number]:
                raise not_allowed("actions", name, ", ".join(("words", "wheels", *FIELDS)))
        fields = [FIELDS[name] for name in names]
        self.choices = [field.maximum + 1 for field in fields]
        self._shifts = np.array([field.low for field in fields], np.uint32)
        others = {name: value for name, value in _OTHERS.items() if name not in names}
        self._base = np.array(CONTROL.encode(**others), np.uint32)

    @property
    def is_over(self) -> bool:
        """Whether the episode is over."""
        return self.world.now_ms >= self._length_ms + self.world.tick_ms

    def reset(self, seed: int | None, options: dict[str, Any] | None = None) -> None:
        """Begin an episode: world w has the seed ``seed`` + w; None: each has another one than before.

        The first tick is simulated, because cars are switched on in it.

        Args:
            seed: a whole number from 0 to 2^32 - 1, or None.
            options: for this episode: ``places`` of all cars, for each a Pose or x, y and, unless it is 0, heading;
                ``random_starts`` (true): places at random, by the seed of each world; ``images`` that the leaders run.

        Raises:
            MotorcadeError: an argument isn't allowed, or a car would stand in a wall or in another car.
        """
        first = self._next_seed
        if seed is not None:
            first = to_whole("seed", seed, 0, MOST_SEED)
        chosen = {} if options is None else instance_of(dict, "options", options)
        self._check_reset(chosen)
        self._run_images(checked_images(chosen.get("images", self._images)))
        world = self.world
        world.reset([(first + number) % (MOST_SEED + 1) for number in range(world.worlds)])
        if chosen.get("random_starts"):
            world.place_cars([random_starts(world.mat, world.profile, seed) for seed in world.seeds])
        elif "places" in chosen:
            world.place_cars([starts_of(chosen["places"], world.mat)] * world.worlds)
        self._next_seed = (first + world.worlds) % (MOST_SEED + 1)
        self.has_begun = True
        self._given[:] = agents.KEEP
        self._told[:2] = 0
        self._told[2] = np.tile(~np.asarray(world.mat.starts.leads), world.worlds)
        watched = self._watched
        self._watches = [MissionWatch(watched, world.images[0]) for _ in world.seeds] if watched else []
        self._see()
        world.step()
        self._graded = self._grades()
        # Those before and after the last step, where a reward needs them.
        self._readings = list[Readings]()
        self._observe(0)

    def _check_reset(self, options: Mapping[str, Any]) -> None:
        for name in options:
            if name not in (*RESET_OPTIONS, _WITHOUT_EFFECT):
                raise not_allowed("options", name, ", ".join(RESET_OPTIONS))
        if to_truth("random_starts", options.get("random_starts", False)) and "places" in options:
            raise InputError("places-and-random-starts")
        if "images" in options and not any(self.world.mat.starts.leads):
            raise InputError("images-without-leaders")

    def _run_images(self, images: tuple[bytes, ...]) -> None:
        """Let leaders run these programs, in other worlds where they are others."""
        world = self.world
        if images != world.images:
            events = self._watched is not None
            self._open(World(world.mat, images, world.profile, seeds=world.seeds, events=events))

    def step(self, actions: Any, acts: Flags | None = None) -> Floats:
        """Let each agent begin the word of its action, and run the worlds for a step.

        Args:
            actions: numbers of shape (worlds, agents, choices).
            acts: of shape (worlds, agents), which agents act; None: all. The others keep their words.

        Returns:
            The reward of each agent, of shape (worlds, agents).

        Raises:
            MotorcadeError: an action isn't allowed, or no episode has begun.
        """
        if self.is_over or not self.has_begun:
            raise MotorcadeError("episode-has-not-begun")
        world = self.world
        words = self._words_of(actions)
        if acts is not None:
            words = np.where(acts, words, agents.KEEP)
        self._given.reshape(world.worlds, world.cars)[:, self._places] = words
        world.begin_given(self._given)
        given_ms = world.now_ms
        if self._watches:
            self._run_watched(given_ms + self.step_ms)
        else:
            world.run(self.step_ms)
        self._observe(given_ms)
        return self._rewards()

    def _run_watched(self, end_ms: int) -> None:
        """Run to ``end_ms``, and show the goals' watches their moments: each EVERY_MS, and the episode's end."""
        world = self.world
        length_ms = self._length_ms
        while world.now_ms < end_ms:
            before_ms = world.now_ms
            next_ms = end_ms
            if before_ms < length_ms:
                next_ms = min(end_ms, length_ms)
            run_to_next(world, next_ms)
            is_next = before_ms // EVERY_MS != world.now_ms // EVERY_MS
            if before_ms < length_ms and (is_next or world.now_ms >= length_ms):
                self._see()

    def observations(self) -> NDArray[np.float32]:
        """What the agents observe now, of shape (worlds, agents, columns)."""
        return self._state()[:, self._places, : len(self.columns)].copy()

    def state(self) -> NDArray[np.float32]:
        """What all cars sense and hear, and where they are, of shape (worlds, cars, state_columns).

        Raises MotorcadeError: no episode has begun.
        """
        return self._state().copy()

    def _state(self) -> NDArray[np.float32]:
        """As `state`; the next step overwrites it."""
        if not self.has_begun:
            raise MotorcadeError("episode-has-not-begun")
        seen: NDArray[np.float32] = self._seen.reshape(self.world.worlds, self.world.cars, -1)
        return seen

    def _words_of(self, actions: Any) -> NDArray[np.uint32]:
        shape = self.world.worlds, len(self.agents), len(self.choices)
        try:
            given = np.asarray(actions)
        except ValueError:
            # Its rows differ in length.
            given = np.array(None)
        is_number = given.dtype.kind in "iuf" and given.shape == shape
        if is_number:
            with np.errstate(invalid="ignore"):
                numbers = given.astype(np.int64)
            # Less than 0 is more than all choices.
            is_choice = bool((numbers.view(np.uint64) < self._choices).all())
            is_number = is_choice and (given.dtype.kind != "f" or bool((numbers == given).all()))
        if not is_number:
            raise InputError("action-not-allowed", shape=shape, choices=self.choices)
        if self._shifts is None:
            words = self._base[numbers[..., 0]]
        else:
            words = self._base | np.bitwise_or.reduce(numbers.astype(np.uint32) << self._shifts, axis=2)
        return np.asarray(words, np.uint32)

    def _see(self) -> None:
        """Show the goals' watches this moment."""
        for number, watch in enumerate(self._watches):
            begun = begun_words(self.world, number) if self.world.now_ms else ()
            watch.see(self.world.snapshot(number).in_single_precision(), begun)

    def _grades(self) -> Floats:
        """Each world's grade in the mission, 0 to 1."""
        return np.array([grade_of(watch.run.attempt.mission, watch.grades()) for watch in self._watches])

    def _rewards(self) -> Floats:
        """The rewards of the step that ends now."""
        shape = self.world.worlds, self.world.cars
        if self._reward is not None:
            found = self._reward(*self._readings)
            return np.broadcast_to(np.asarray(found, float), shape)[:, self.agents]
        if self._watches:
            earlier = self._graded
            self._graded = self._grades()
            return np.broadcast_to((self._graded - earlier)[:, None], (shape[0], len(self.agents)))
        return np.zeros((shape[0], len(self.agents)))

    def _observe(self, given_ms: int) -> None:
        """Let the kernels write what cars observe, after a step that began at ``given_ms``."""
        world = self.world
        world.read_senses(self._sensed)
        world.observe(given_ms, self._given, self._told, self._fields, self._sensed, self._seen)
        if self._reward is not None:
            self._readings = [*self._readings[-1:], self._read()]

    def _read(self) -> Readings:
        world = self.world
        rows = self._sensed.reshape(world.worlds, world.cars, agents.SENSED)
        # In the order of the columns of `motorcade.engine.agents`.
        obstacle_mm, person, dark, word, _, x_um, y_um, heading = np.moveaxis(rows, 2, 0)
        heard = self._state()[:, :, _SENSED.index("heard")] > 0
        obstacle_m = np.minimum(obstacle_mm / 1000, self._range_m)
        radians = heading * (math.tau / FULL_TURN)
        sensed = obstacle_m, person > 0, dark & 1 > 0, dark & 2 > 0, heard
        return Readings(world.now_ms, *sensed, word.astype(np.uint32), x_um / 1e6, y_um / 1e6, radians)
