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

from motorcade.config.arguments import not_allowed
from motorcade.config.check import Fault, check, fits
from motorcade.config.files import (
    DEEPEST,
    DuplicateKeyError,
    is_deeper,
    parse,
    place_text,
    replace_file,
)
from motorcade.errors import MotorcadeError, Phrase
from motorcade.program.conditions import NAME, alternatives, any_of, condition_document, condition_of
from motorcade.program.diagnostics import (
    Diagnostic,
    Fix,
    NotJsonError,
    ProgramError,
    error,
)
from motorcade.program.flow_steps import (
    ALL_KINDS,
    IN_TURN,
    DoStep,
    FlowStep,
    IfStep,
    TellStep,
)
from motorcade.program.schema import (
    BESIDE,
    FORMAT,
    PROFILE,
    SETTINGS,
    program_schema,
)
from motorcade.program.steps import (
    COMMON,
    DrivingStep,
    RepeatStep,
    Step,
    TogetherStep,
    as_steps,
    check_field,
    first_value,
    own_fields,
    walk,
)


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
        for name, schema in SETTINGS.items():
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
        functions: steps of the leader by their name, which DoStep does.
        beside: what stands beside the program in its file, by the keys of BESIDE: the mat, and how the page shows the
            blocks. Two programs that differ in nothing else are equal.
    """

    leader: tuple[Step, ...]
    followers: Followers | None = None
    profile: str = "classroom"
    functions: Mapping[str, tuple[Step, ...]] = field(default_factory=dict, hash=False)
    beside: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)

    def __init__(
        self,
        leader: Iterable[Step],
        followers: Followers | Iterable[Step] | None = None,
        profile: str = "classroom",
        beside: Mapping[str, Any] | None = None,
        functions: Mapping[str, Iterable[Step]] | None = None,
    ):
        if followers is not None and not isinstance(followers, Followers):
            followers = Followers(as_steps(followers))
        object.__setattr__(self, "leader", as_steps(leader))
        object.__setattr__(self, "followers", followers)
        object.__setattr__(self, "profile", profile)
        named = {name: as_steps(steps) for name, steps in (functions or {}).items()}
        for name in named:
            if not fits(name, NAME):
                raise ValueError(f"program: no function can be called {name!r}")
        object.__setattr__(self, "functions", named)
        object.__setattr__(self, "beside", dict(beside or {}))
        check_field(self, "program", "profile", PROFILE)

    @property
    def rows(self) -> dict[str, tuple[Step, ...]]:
        """Its lists of steps, by their places: the leader's, those of functions, the followers'."""
        rows = {"leader": self.leader} | {f"functions.{name}": steps for name, steps in self.functions.items()}
        if self.followers:
            rows["followers.steps"] = tuple(self.followers.steps)
        return rows

    def with_rows(self, change: Callable[[Sequence[Step], str], Sequence[Step]]) -> "Program":
        """Return the program with other steps: ``change`` is given each of `rows`, and its place."""
        followers = self.followers
        if followers:
            followers = replace(followers, steps=change(followers.steps, "followers.steps"))
        functions = {name: change(steps, f"functions.{name}") for name, steps in self.functions.items()}
        return Program(change(self.leader, "leader"), followers, self.profile, self.beside, functions)

    def as_dict(self) -> dict[str, Any]:
        """The program for JSON, without what stands beside it; what has its usual value is left out."""
        followers = None
        if self.followers:
            names = ("accept_ir", "forward", "dwell_seconds", "tagged")
            settings = {name: getattr(self.followers, name) for name in names}
            followers = {name: value for name, value in settings.items() if value not in (None, "auto")}
            followers["steps"] = [_step_as_dict(step) for step in self.followers.steps]
        leader = [_step_as_dict(step) for step in self.leader]
        document = {"format": FORMAT, "profile": self.profile, "leader": leader, "followers": followers}
        if self.functions:
            document["functions"] = {name: list(map(_step_as_dict, steps)) for name, steps in self.functions.items()}
        return document

    def as_json(self) -> str:
        """The text of the project file, with all that stands beside the program."""
        text = json.dumps(self.as_dict(), indent=1, ensure_ascii=False).removesuffix("\n}")
        for name, value in self.beside.items():
            # One line each: a long row of blocks is nested deeply, so indented JSON would be mostly spaces.
            text += f',\n "{name}": {json.dumps(value, ensure_ascii=False)}'
        return text + "\n}\n"

    def save(self, path: str | Path) -> None:
        """Write the project file; the file before is kept until all is written. Raises OSError."""
        replace_file(Path(path), self.as_json().encode())


def placed_steps(program: Program) -> Iterator[tuple[str, Step]]:
    """Yield every step of a program, those inside of others included, with its place."""
    for place, steps in program.rows.items():
        yield from walk(steps, place)


def count_blocks(program: Program) -> int:
    """How many blocks a program has on the page, those inside of others included."""
    return sum(1 for _ in placed_steps(program))


def read_program(data: bytes | str) -> Program:
    """Return the Program in a project file's bytes or text. Raises ProgramError with all diagnostics of its shape."""
    if not isinstance(data, bytes | str):
        raise not_allowed("data", data, "bytes, str")
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
        document = document | {name: {} for name, content in beside.items() if isinstance(content, dict)}
    if is_deeper(document, DEEPEST):
        raise _not_json(Phrase("too-deep"))
    checked, faults = check(document, program_schema())
    # A file of another kind, such as a mat, has nothing else to mend.
    other_kind = [fault for fault in faults if fault.place == ("format",) and "format" in document]
    if faults:
        raise ProgramError(_diagnostic(fault, document) for fault in other_kind or faults)
    leader = map(_step_from, checked["leader"])
    followers = None
    if checked["followers"]:
        settings = dict(checked["followers"])
        followers = Followers(list(map(_step_from, settings.pop("steps"))), **settings)
    functions = {name: list(map(_step_from, steps)) for name, steps in checked["functions"].items()}
    return Program(leader, followers, checked["profile"], beside, functions)


def _diagnostic(fault: Fault, document: Any) -> Diagnostic:
    """Return a fault under the codes of programs, which are part of the format."""
    place = fault.place
    key = place[-1] if place else ""
    if fault.code == "missing-key":
        return _missing(place[:-1], str(key), _id_at(document, place[:-1]))
    path = _path(place)
    if fault.code == "unknown-key":
        return error("unknown-field", path, _id_at(document, place[:-1]), name=key, allowed=fault.allowed)
    step_id = _id_at(document, place)
    if fault.code == "no-key":
        return error("missing-field", path, step_id, name=Phrase("one-kind", kinds=fault.allowed))
    if fault.code == "several-keys":
        return error("several-kinds", path, step_id, kinds=fault.allowed, present=fault.value)
    problem = error("out-of-range", path, step_id, value=fault.value, allowed=fault.allowed)
    if fault.nearest is None or not isinstance(key, str):
        return problem
    if key == "dwell_seconds":
        # The compiler chooses a better sending time than the shortest that a file may name.
        return problem.with_fixes(Fix(key, None))
    return problem.with_fixes(Fix(key, fault.nearest))


def _missing(around: tuple[str | int, ...], key: str, step_id: str | None) -> Diagnostic:
    """Return the error for a key that isn't there, with its first value where it has one."""
    missing = error("missing-field", _path(around), step_id, name=key)
    kind = ALL_KINDS.get(str(around[-1])) if around else None
    if kind is None:
        return missing
    value = first_value(kind, key)
    if value in (None, []):
        return missing
    return missing.with_fixes(Fix(key, value))


def _path(place: tuple[str | int, ...]) -> str:
    if not place:
        return ""
    return str(place_text(place))


def _id_at(document: Any, place: tuple[str | int, ...]) -> str | None:
    """Return the id of the innermost step around ``place``."""
    found = None
    here = document
    for part in place:
        here = here[part]
        if isinstance(here, dict) and isinstance(here.get("id"), str):
            found = here["id"]
    return found


def _step_from(document: dict[str, Any]) -> Step:
    kind = next(key for key in document if key in ALL_KINDS)
    content = document[kind]
    if kind == TogetherStep.kind:
        content = {"steps": tuple(map(_step_from, content))}
    elif kind == RepeatStep.kind:
        content["steps"] = tuple(map(_step_from, content["steps"]))
    elif kind == IfStep.kind:
        then, otherwise = (tuple(map(_step_from, content[name])) for name in ("then", "else"))
        content = {"when": condition_of(content["when"]), "then": then, "otherwise": otherwise}
    elif kind == TellStep.kind:
        told = content["step"]
        content = {"step": None if told == IN_TURN else _step_from(told)}
    elif kind == DoStep.kind:
        content = {"function": content}
    values = {**document, **content}
    if "until" in values:
        values["until"] = condition_of(values["until"])
    if "unless" in values:
        values["unless"] = any_of(list(alternatives(condition_of(values["unless"]))))
    return ALL_KINDS[kind].of_checked(values)


def _step_as_dict(step: Step) -> dict[str, Any]:
    document: dict[str, Any] = {step.kind: _content_as_dict(step)}
    for name in COMMON:
        if getattr(step, name) is not None:
            document[name] = getattr(step, name)
    if step.until is not None and not isinstance(step, RepeatStep):
        document["until"] = condition_document(step.until)
    return document


def _content_as_dict(step: Step) -> Any:
    """Return what stands below the key of a step's kind."""
    match step:
        case TogetherStep():
            return list(map(_step_as_dict, step.steps))
        case DoStep():
            return step.function
        case TellStep():
            return {"step": _step_as_dict(step.step) if step.step else IN_TURN}
        case IfStep():
            then, otherwise = (list(map(_step_as_dict, steps)) for steps in step.lists.values())
            content = {"when": condition_document(step.when), "then": then}
            return content | {"else": otherwise} if otherwise else content
    content = {}
    for own in own_fields(type(step)):
        value = getattr(step, own.name)
        if value is not None and (not isinstance(step, FlowStep) or value != own.default):
            content[own.name] = value
    if isinstance(step, DrivingStep) and step.unless is not None:
        content["unless"] = condition_document(step.unless)
    if isinstance(step, RepeatStep):
        if step.until is not None:
            content["until"] = condition_document(step.until)
        content["steps"] = list(map(_step_as_dict, step.steps))
    return content


def _not_json(reason: Any) -> NotJsonError:
    return NotJsonError([error("not-json", "", reason=reason)])


def align(old: Sequence[Step], new: Sequence[Step]) -> list[int | None]:
    """Return for each new step the position of the old step that it is or comes from; None where it is a new one.

    Equal steps at the beginning and at the end belong together; then equal steps; then steps of one kind. Ids are not
    compared.
    """
    ours = list(map(without_ids, old))
    theirs = list(map(without_ids, new))
    start = equal_at_start(ours, theirs)
    end = equal_at_start(ours[start:][::-1], theirs[start:][::-1])
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


def equal_at_start(some: Sequence[object], others: Sequence[object]) -> int:
    """Return how many of the first ones are equal."""
    count = 0
    for one, other in zip(some, others, strict=False):
        if one != other:
            break
        count += 1
    return count


@cache
def without_ids(step: Step) -> Step:
    """Return a step, and the steps inside it, without the blocks that they came from."""
    changes: dict[str, Any] = {name: tuple(map(without_ids, steps)) for name, steps in step.lists.items()}
    if isinstance(step, TellStep) and step.step:
        changes["step"] = without_ids(step.step)
    if step.id is None and not changes:
        return step
    return replace(step, id=None, **changes)


def bare(program: Program) -> Program:
    """Return a program without the blocks that its steps came from."""
    return program.with_rows(lambda steps, _: list(map(without_ids, steps)))


def with_ids_of(program: Program, before: Program) -> Program:
    """Return ``program`` with the ids that its steps have in ``before``; steps with an id of their own keep it."""
    taken = {step.id for _, step in placed_steps(program) if step.id is not None}
    old = before.rows
    return program.with_rows(lambda steps, place: _steps_with_ids(steps, old.get(place, ()), taken))


def _steps_with_ids(steps: Sequence[Step], before: Sequence[Step], taken: set[str]) -> list[Step]:
    made = []
    for step, position in zip(steps, align(before, steps), strict=True):
        changes: dict[str, Any] = {}
        old_lists: dict[str, tuple[Step, ...]] = {}
        if position is not None:
            old = before[position]
            old_lists = old.lists
            if old.id is not None and step.id is None and old.id not in taken:
                changes["id"] = old.id
        for name, steps in step.lists.items():
            if steps:
                changes[name] = tuple(_steps_with_ids(steps, old_lists.get(name, ()), taken))
        if changes:
            step = replace(step, **changes)
        made.append(step)
    return made
