"""Calls every public method with absurd arguments, in a process of its own: what is wrong there may end the process.

``python -m support.absurd_calls EXAMPLES`` prints each call before it is made, and ends with 0 where each call
gave a result or a sentence.
"""

import contextlib
import inspect
import re
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import fields, replace
from fractions import Fraction
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import motorcade
from motorcade import Pose, World, formation, open_table, simulate
from motorcade.engine.backend import NAMES, BackendName
from motorcade.errors import MotorcadeError
from motorcade.lab import parallel_env, vector_env
from motorcade.lab.stepping import Options
from motorcade.mats import Mat, Starts, playground
from motorcade.mats.model import Person, Voice
from motorcade.program.steps import KINDS
from motorcade.runs.recorder import Recorder

IMAGE = bytes.fromhex("01010201 65800000 c0280000")
MAT = replace(
    playground(), people=(Person(((0.0, 1.0, 0.5), (1.0, 1.0, 1.0))),), voices=(Voice(0.5, "stop"),), patches=()
)

VALUES = [
    *(-1, 1 << 31, (1 << 32) + 1, 1 << 63, 1 << 64, 10**5000, -(10**400)),
    *(float("nan"), float("inf"), float("-inf"), 1.5, -0.5, 1e300, 1j, Fraction(1, 3)),
    *("", "3", "car_0", "\ud800", b"", b"x", bytes(4), bytearray(4), None, True, object(), print),
    *([], [1], ["a"], [None], [[]], [1.5, float("nan")], (1, 2, 3, 4), {}, {"a": 1}, {1: {2: 3}}, {1, 2}, range(3)),
    *(np.int64(-1), np.uint64(2**64 - 1), np.float32("nan"), np.float64(0.5), np.bool_(True), np.str_("a")),
    *(np.array(1), np.array([1]), np.array([[1.0]]), np.array(["a"]), np.zeros(0), np.datetime64(1, "s")),
    *(Pose("a", None), Pose(float("nan"), 0), World, MAT),  # type: ignore[arg-type]
]
# The place of one of VALUES: Hypothesis can't write a number of 5,000 digits. The rest are numbers themselves.
ABSURD = st.integers(0, len(VALUES) + 200)

# What fits, for each parameter of a public method. A method with a new parameter needs a line here.
FITS: dict[str, Any] = {
    "actions": {},
    "agent": "car_0",
    "angle_deg": 90,
    "car": 1,
    "direction": 1,
    "duration_ms": 40,
    "images": [0],
    "look_mm": 500,
    "mat": MAT,
    "options": {},
    "pose": Pose(1, 1),
    "range_mm": 900,
    "rows": [0],
    "seed": 1,
    "seeds": None,
    "speed": 100,
    "starts": [MAT.starts],
    "word": "go",
    "words": bytes(4 * len(MAT.starts)),
    "world": 0,
}
# They take the engine's own arrays, which nobody else makes.
OF_THE_ENGINE = {"arrays", "ask", "begin_given", "judge", "observe", "read_moment", "read_senses"}

# With fewer examples they are the same each time.
FEW = 1000

Call = tuple[str, Callable[..., Any], dict[str, Any]]


def methods_of(thing: Any) -> list[Call]:
    """The public methods of an object that Motorcade's own classes define, with arguments that fit."""
    calls = []
    for kind in type(thing).__mro__:
        if kind.__module__.startswith("motorcade."):
            names = [name for name, value in vars(kind).items() if inspect.isfunction(value) and name[0] != "_"]
            for name in sorted({*names} - OF_THE_ENGINE):
                method = getattr(thing, name)
                calls.append((name, method, {each: FITS[each] for each in inspect.signature(method).parameters}))
    return calls


def of_world(kernels: BackendName) -> list[Call]:
    """Making a world, and its methods before and after its first tick."""
    making = {"mat": MAT, "images": [IMAGE], "profile": None, "seeds": 0, "events": True, "threads": 2}
    new, begun = (World(MAT, [IMAGE], events=True, kernels=kernels) for _ in range(2))
    begun.step()
    things = {each.name: getattr(MAT, each.name) for each in fields(Mat)}

    def made(**changes: Any) -> World:
        return World(replace(MAT, **changes), [IMAGE], kernels=kernels)

    making["kernels"] = kernels
    return [("World", World, making), ("Mat", made, things), *methods_of(new), *methods_of(begun)]


def of_environments() -> list[Call]:
    """Making environments, and their methods before and in an episode."""
    options = {each.name: each.default for each in fields(Options)} | {"render_mode": None, "step_ms": 20, "seconds": 1}
    calls: list[Call] = [
        ("parallel_env", parallel_env, {"task": MAT, **options}),
        ("vector_env", vector_env, {"task": MAT, "worlds": 2, **options}),
    ]
    for begins in (False, True):
        for env in (parallel_env(MAT), vector_env(MAT, 2)):
            if begins:
                env.reset()
            calls += methods_of(env)
            calls.append(("reset options", partial_reset(env), {"places": None, "images": None, "random_starts": None}))
    return calls


def partial_reset(env: Any) -> Callable[..., Any]:
    """Reset with those options that are given."""
    return lambda **options: env.reset(options={name: value for name, value in options.items() if value is not None})


def of_runs() -> list[Call]:
    """Recording and simulating, making mats, and steps."""
    world = World(MAT, [IMAGE], events=True)

    def recorded(targets: Any, every_ms: Any, events: Any, progress: Any) -> None:
        with Recorder(targets, world, every_ms, events, progress) as record:
            world.step()
            record(world)

    def recorded_world(world: Any, other: Any) -> None:
        with Recorder([], world) as record:
            record(other)

    def steps(**changes: Any) -> None:
        for name, value in changes.items():
            for kind in KINDS.values():
                for call in kind.names:
                    # A step says by ValueError what is wrong, as project files are checked by the same schemas.
                    with contextlib.suppress(ValueError):
                        getattr(motorcade, call)(**{name: value})

    run = {"image": IMAGE, "followers": 2, "seconds": 0.1, "seed": 0, "profile": None, "mat": None, "record": ()}
    return [
        ("Recorder", recorded, {"targets": [], "every_ms": 100, "events": True, "progress": print}),
        ("Recorder of a world", recorded_world, {"world": world, "other": world}),
        ("simulate", simulate, run | {"progress": lambda done_ms: None}),
        ("formation", formation, {"followers": 3, "reach_m": 1.0}),
        ("open_table", open_table, {"poses": [Pose(0, 0)], "tick_ms": 20}),
        ("Starts.of", Starts.of, {"poses": [Pose(0, 0)], "leads": [True]}),
        ("Starts", Starts, {"x_m": [0.0], "y_m": [0.0], "heading": [0.0], "leads": [True]}),
    ]


TARGETS: dict[str, Callable[[], list[Call]]] = {
    **{name: lambda name=name: of_world(name) for name in NAMES},  # type: ignore[misc]
    "environments": of_environments,
    "runs": of_runs,
}


def main(examples: int) -> None:
    """Make calls of all TARGETS; each has at least one argument that is absurd."""
    calls = [(f"{target} {name}", *rest) for target in TARGETS for name, *rest in TARGETS[target]() if rest[1]]

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=examples < FEW,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.sampled_from(calls), st.data())
    def call_all(call: Any, data: st.DataObject) -> None:
        name, function, fitting = call
        changed = data.draw(st.lists(st.sampled_from(sorted(fitting)), min_size=1, max_size=2, unique=True))
        drawn = {each: data.draw(ABSURD) for each in changed}
        arguments = fitting | {each: VALUES[at] if at < len(VALUES) else at - 100 for each, at in drawn.items()}
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                print(f"{name}: { {each: arguments[each] for each in changed} }", flush=True)
            except ValueError:  # thousands of digits
                print(f"{name}: {changed}", flush=True)
            try:
                function(**arguments)
            except MotorcadeError as problem:
                sentences = problem.sentence("en") + problem.sentence("zh")
                if re.search(r"\{[a-z_]", sentences):
                    raise RuntimeError(sentences) from None

    call_all()


if __name__ == "__main__":
    # Recorders write files here.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        main(int(sys.argv[1]))
