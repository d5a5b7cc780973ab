"""A program for a leader and its followers, and the project file that holds it: JSON, its schema and its check.

Blocks, compiler and decompiler all make or take this model. `align` says which steps of a changed program are which
steps of the program before.
"""

import json
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

from motorcade.config.check import Fault, Schema, check, choice, flag, table
from motorcade.config.files import DEEPEST, DuplicateKeyError, is_deeper, parse, place_text
from motorcade.errors import MotorcadeError, Phrase
from motorcade.program.diagnostics import Diagnostic, Fix, NotJsonError, ProgramError, error
from motorcade.program.steps import (
    COMMON,
    KINDS,
    SECONDS,
    SHORTEST_DWELL_S,
    SIMPLE_KINDS,
    RepeatStep,
    Step,
    TogetherStep,
    as_steps,
    check_field,
    first_value,
    own_fields,
    walk,
)

FORMAT = "motorcade-program/1"
# What may stand beside a program in its file, for the page alone.
BESIDE = {
    "mat": "The mat that it drives on; see docs/mats.md.",
    "view": "Where the page's blocks stand, and comments on them.",
}

_PROFILE: Schema = {"type": "string", "default": "classroom"}
# The followers' settings; the compiler chooses those that have no default.
_SETTINGS: dict[str, Schema] = {
    "accept_ir": flag(default=True),
    "forward": flag(default=False),
    "tagged": {"enum": [True, False, "auto"], "default": "auto"},
    "dwell_seconds": {**SECONDS, "minimum": SHORTEST_DWELL_S},
}


@cache
def program_schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of ``*.motorcade.json``, made from the steps' declarations."""
    leader = {key: schema for key, schema in COMMON.items() if key != "forward"}
    steps = {"type": "array", "items": {"$ref": "#/$defs/follower_step"}}
    followers = table(("dwell_seconds",), **_SETTINGS, steps=steps)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Motorcade program",
        "description": "What a leader car and its followers do.",
        **table(
            tuple(BESIDE),
            format=choice(FORMAT),
            profile=_PROFILE,
            leader={"type": "array", "items": {"$ref": "#/$defs/leader_step"}},
            followers={**followers, "type": ["object", "null"], "default": None},
            **{name: {"type": "object", "description": what} for name, what in BESIDE.items()},
        ),
        "$defs": {
            "leader_step": _step("leader_step", leader),
            "follower_step": _step("follower_step", COMMON),
            "part": _one_of({kind.kind: _fields_of(kind, inside=True) for kind in SIMPLE_KINDS}, {"id": COMMON["id"]}),
        },
    }


def _step(name: str, common: dict[str, Schema]) -> Schema:
    kinds = {kind.kind: _fields_of(kind) for kind in SIMPLE_KINDS}
    kinds[TogetherStep.kind] = {"type": "array", "items": {"$ref": "#/$defs/part"}}
    steps = {"type": "array", "items": {"$ref": f"#/$defs/{name}"}}
    kinds[RepeatStep.kind] = _fields_of(RepeatStep, steps=steps)
    return _one_of(kinds, common)


def _one_of(kinds: dict[str, Schema], common: dict[str, Schema]) -> Schema:
    return {
        "type": "object",
        "properties": {**kinds, **common},
        "oneOf": [{"required": [kind]} for kind in kinds],
        "additionalProperties": False,
    }


def _fields_of(kind: type[Step], inside: bool = False, **more: Schema) -> Schema:
    """Return the schema of a step's own object; a step that accompanies others has no fields inside a together."""
    own = () if inside and kind.accompanies else own_fields(kind)
    return table(**{each.name: each.metadata["schema"] for each in own}, **more)


@dataclass(frozen=True)
class Followers:
    """What the followers do.

    Attributes:
        steps: done in order, over and over.
        accept_ir: whether they go on listening; a step may have another setting.
        forward: whether they pass their words on; a step may have another setting.
        dwell_seconds: how long each word is sent, where every step is one word. With None, the usual case, the
            compiler chooses.
        tagged: whether each word is sent with a tag. By the tag a follower tells it from earlier words and begins it
            once. With "auto", words are tagged where some word is passed on, unless the followers have one bare word.

    Raises:
        ValueError: a setting has a value that no program may have.
    """

    steps: Sequence[Step]
    accept_ir: bool = True
    forward: bool = False
    dwell_seconds: float | None = None
    tagged: bool | Literal["auto"] = "auto"

    def __post_init__(self) -> None:
        for name, schema in _SETTINGS.items():
            if getattr(self, name) is not None or "default" in schema:
                check_field(self, "followers", name, schema)
        object.__setattr__(self, "steps", as_steps(self.steps))


@dataclass(frozen=True)
class Program:
    """What a leader and its followers do.

    Attributes:
        leader: the leader's steps.
        followers: the followers'; None where only the leader is programmed.
        profile: the cars' profile.
        beside: what stands beside the program in its file, by the keys of BESIDE: the mat, and how the page shows the
            blocks. Two programs that differ in nothing else are equal.
    """

    leader: tuple[Step, ...]
    followers: Followers | None = None
    profile: str = "classroom"
    beside: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)

    def __init__(
        self,
        leader: Iterable[Step],
        followers: Followers | Iterable[Step] | None = None,
        profile: str = "classroom",
        beside: Mapping[str, Any] | None = None,
    ):
        if followers is not None and not isinstance(followers, Followers):
            followers = Followers(as_steps(followers))
        object.__setattr__(self, "leader", as_steps(leader))
        object.__setattr__(self, "followers", followers)
        object.__setattr__(self, "profile", profile)
        object.__setattr__(self, "beside", dict(beside or {}))
        check_field(self, "program", "profile", _PROFILE)

    def as_dict(self) -> dict[str, Any]:
        """The program for JSON, without what stands beside it; what has its usual value is left out."""
        followers = None
        if self.followers:
            names = ("accept_ir", "forward", "dwell_seconds", "tagged")
            settings = {name: getattr(self.followers, name) for name in names}
            followers = {name: value for name, value in settings.items() if value not in (None, "auto")}
            followers["steps"] = [_step_as_dict(step) for step in self.followers.steps]
        leader = [_step_as_dict(step) for step in self.leader]
        return {"format": FORMAT, "profile": self.profile, "leader": leader, "followers": followers}

    def as_json(self) -> str:
        """The text of the project file, with all that stands beside the program."""
        text = json.dumps(self.as_dict(), indent=1, ensure_ascii=False).removesuffix("\n}")
        for name, value in self.beside.items():
            # One line each: a long row of blocks is nested deeply, so indented JSON would be mostly spaces.
            text += f',\n "{name}": {json.dumps(value, ensure_ascii=False)}'
        return text + "\n}\n"

    def save(self, path: str | Path) -> None:
        """Write the project file. Raises OSError."""
        Path(path).write_text(self.as_json(), encoding="utf-8")


def placed_steps(program: Program) -> Iterator[tuple[str, Step]]:
    """Yield every step of a program, those inside of others included, with its place."""
    yield from walk(program.leader, "leader")
    if program.followers:
        yield from walk(program.followers.steps, "followers.steps")


def count_blocks(program: Program) -> int:
    """How many blocks a program has on the page, those inside of others included."""
    return sum(1 for _ in placed_steps(program))


def read_program(data: bytes | str) -> Program:
    """Return the Program in a project file's bytes or text. Raises ProgramError with all diagnostics of its shape."""
    return program_from_dict(read_document(data))


def read_document(data: bytes | str) -> Any:
    """Return the parsed JSON of a project file, in which no key may appear twice. Raises ProgramError."""
    try:
        return parse(data, "JSON", "", deepest=None)
    except DuplicateKeyError as problem:
        name = problem.details["key"]
        raise ProgramError([error("duplicate-field", name, name=name)]) from None
    except MotorcadeError as problem:
        raise _not_json(problem.details["reason"]) from None


def program_from_dict(document: Any) -> Program:
    """Return the Program in parsed JSON. The contents of the keys in BESIDE are not checked. Raises ProgramError."""
    beside = {}
    if isinstance(document, dict):
        beside = {name: document[name] for name in BESIDE if name in document}
        document = {
            name: {} if name in BESIDE and isinstance(value, dict) else value for name, value in document.items()
        }
    if is_deeper(document, DEEPEST):
        raise _not_json(Phrase("too-deep"))
    checked, faults = check(document, program_schema())
    if faults:
        raise ProgramError(_diagnostic(fault, document) for fault in faults)
    followers = checked["followers"]
    return Program(
        leader=map(_step_from, checked["leader"]),
        followers=followers and Followers(**{**followers, "steps": [_step_from(each) for each in followers["steps"]]}),
        profile=checked["profile"],
        beside=beside,
    )


def _diagnostic(fault: Fault, document: Any) -> Diagnostic:
    """Return a fault under the codes of programs, which are part of the format."""
    place, key = fault.place, fault.place[-1] if fault.place else ""
    around = place[:-1] if fault.code in ("unknown-key", "missing-key") else place
    path, step_id = _path(around if fault.code == "missing-key" else place), _id_at(document, around)
    if fault.code == "unknown-key":
        return error("unknown-field", path, step_id, name=key, allowed=fault.allowed)
    if fault.code == "missing-key":
        missing = error("missing-field", path, step_id, name=key)
        kind = KINDS.get(str(place[-2])) if len(place) > 1 else None
        value = first_value(kind, str(key)) if kind else None
        return missing if value in (None, []) else missing.with_fixes(Fix(str(key), value))
    if fault.code == "no-key":
        return error("missing-field", path, step_id, name=Phrase("one-kind", kinds=fault.allowed))
    if fault.code == "several-keys":
        return error("several-kinds", path, step_id, kinds=fault.allowed, present=fault.value)
    problem = error("out-of-range", path, step_id, value=fault.value, allowed=fault.allowed)
    if fault.nearest is None or not isinstance(key, str):
        return problem
    # The compiler chooses a better sending time than the shortest that a file may name.
    return problem.with_fixes(Fix(key, None if key == "dwell_seconds" else fault.nearest))


def _path(place: tuple[str | int, ...]) -> str:
    return str(place_text(place)) if place else ""


def _id_at(document: Any, place: tuple[str | int, ...]) -> str | None:
    """Return the id of the innermost step around ``place``."""
    found, here = None, document
    for part in place:
        here = here[part]
        if isinstance(here, dict) and isinstance(here.get("id"), str):
            found = here["id"]
    return found


def _step_from(document: dict[str, Any]) -> Step:
    kind = next(key for key in document if key in KINDS)
    content = document[kind]
    if kind == TogetherStep.kind:
        content = {"steps": tuple(map(_step_from, content))}
    elif kind == RepeatStep.kind:
        content["steps"] = tuple(map(_step_from, content["steps"]))
    return KINDS[kind].of_checked({**document, **content})


def _step_as_dict(step: Step) -> dict[str, Any]:
    if isinstance(step, TogetherStep):
        document: dict[str, Any] = {step.kind: [_step_as_dict(part) for part in step.steps]}
    else:
        own = {each.name: getattr(step, each.name) for each in own_fields(type(step))}
        content = {name: value for name, value in own.items() if value is not None}
        if isinstance(step, RepeatStep):
            content["steps"] = [_step_as_dict(part) for part in step.steps]
        document = {step.kind: content}
    for name in COMMON:
        if getattr(step, name) is not None:
            document[name] = getattr(step, name)
    return document


def _not_json(reason: Any) -> NotJsonError:
    return NotJsonError([error("not-json", "", reason=reason)])


def align(old: Sequence[Step], new: Sequence[Step]) -> list[int | None]:
    """Return for each new step the position of the old step that it is or comes from; None where it is a new one.

    Equal steps at the beginning and at the end belong together; then equal steps; then steps of one kind. Ids are not
    compared.
    """
    ours, theirs = [without_ids(each) for each in old], [without_ids(each) for each in new]
    fewer = min(len(old), len(new))
    start = next((at for at in range(fewer) if ours[at] != theirs[at]), fewer)
    end = next((at for at in range(fewer - start) if ours[-1 - at] != theirs[-1 - at]), fewer - start)
    middle = [None] * (len(new) - start - end)
    found: list[int | None] = [*range(start), *middle, *range(len(old) - end, len(old))]
    keys: tuple[Callable[[Step], object], ...] = (lambda step: step, lambda step: step.kind)
    for key in keys:
        waiting: dict[object, deque[int]] = defaultdict(deque)
        for position in sorted({*range(len(old))} - {*found}):
            waiting[key(ours[position])].append(position)
        for position, step in enumerate(theirs):
            if found[position] is None and waiting[key(step)]:
                found[position] = waiting[key(step)].popleft()
    return found


@cache
def without_ids(step: Step) -> Step:
    """Return a step, and the steps inside it, without the blocks that they came from."""
    changes: dict[str, Any] = {"steps": tuple(map(without_ids, step.inside))} if step.inside else {}
    return replace(step, id=None, **changes) if changes or step.id is not None else step


def bare(program: Program) -> Program:
    """Return a program without the blocks that its steps came from."""
    told = program.followers
    followers = told and replace(told, steps=tuple(map(without_ids, told.steps)))
    return Program(map(without_ids, program.leader), followers, program.profile)


def with_ids_of(program: Program, before: Program) -> Program:
    """Return ``program`` with the ids that its steps have in ``before``; steps with an id of their own keep it."""
    taken = {step.id for _, step in placed_steps(program) if step.id is not None}
    leader = _steps_with_ids(program.leader, before.leader, taken)
    followers = program.followers
    if followers and before.followers:
        followers = replace(followers, steps=_steps_with_ids(followers.steps, before.followers.steps, taken))
    return replace(program, leader=tuple(leader), followers=followers)


def _steps_with_ids(steps: Sequence[Step], before: Sequence[Step], taken: set[str]) -> list[Step]:
    made = []
    for step, position in zip(steps, align(before, steps), strict=True):
        old = None if position is None else before[position]
        changes: dict[str, Any] = {}
        if old and old.id is not None and step.id is None and old.id not in taken:
            changes["id"] = old.id
        if step.inside:
            changes["steps"] = tuple(_steps_with_ids(step.inside, old.inside if old else (), taken))
        made.append(replace(step, **changes) if changes else step)
    return made
