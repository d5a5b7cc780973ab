"""A program for a leader and its followers, and the JSON that it is kept in.

Everything else (blocks, compiler, decompiler) makes or takes this model.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from motorcade.program.diagnostics import Phrase, ProgramError, error, phrase
from motorcade.program.schema import BESIDE, FORMAT, check_shape
from motorcade.program.steps import KINDS, LONGEST_S, SHORTEST_DWELL_S, RepeatStep, Step, TogetherStep, as_steps

# Deeper than anyone nests blocks by hand, and short of what the parser's stack takes.
DEEPEST = 100


@dataclass(frozen=True)
class Followers:
    """What the followers do.

    Attributes:
        steps: done in order, for ever.
        accept_ir: whether they go on listening; a step may differ.
        forward: whether they pass their words on; a step may differ.
        dwell_seconds: how long each word is sent, every step being one word. None, the
            usual case, lets the compiler pick.
    """

    steps: tuple[Step, ...]
    accept_ir: bool = True
    forward: bool = False
    dwell_seconds: float | None = None

    def __init__(
        self,
        steps: Iterable[Step],
        accept_ir: bool = True,
        forward: bool = False,
        dwell_seconds: float | None = None,
    ):
        _check_flags(accept_ir=accept_ir, forward=forward)
        if dwell_seconds is not None and not _is_duration(dwell_seconds):
            raise ValueError(
                f"followers: dwell_seconds is {dwell_seconds!r}; allowed: {SHORTEST_DWELL_S} to {LONGEST_S}"
            )
        object.__setattr__(self, "steps", as_steps(steps))
        object.__setattr__(self, "accept_ir", accept_ir)
        object.__setattr__(self, "forward", forward)
        object.__setattr__(self, "dwell_seconds", dwell_seconds)


@dataclass(frozen=True)
class Program:
    """A leader's steps, its followers' (None where only the leader is programmed), and the cars' profile."""

    leader: tuple[Step, ...]
    followers: Followers | None = None
    profile: str = "classroom"

    def __init__(
        self,
        leader: Iterable[Step],
        followers: Followers | Iterable[Step] | None = None,
        profile: str = "classroom",
    ):
        if followers is not None and not isinstance(followers, Followers):
            followers = Followers(followers)
        if not isinstance(profile, str):
            raise ValueError(f"profile is {profile!r}; allowed: a profile's name")
        object.__setattr__(self, "leader", as_steps(leader))
        object.__setattr__(self, "followers", followers)
        object.__setattr__(self, "profile", profile)

    def as_dict(self) -> dict[str, Any]:
        """The program for JSON; what has its usual value is left out."""
        document: dict[str, Any] = {"format": FORMAT, "profile": self.profile}
        document["leader"] = [_step_as_dict(step) for step in self.leader]
        if self.followers is None:
            document["followers"] = None
        else:
            followers: dict[str, Any] = {"accept_ir": self.followers.accept_ir, "forward": self.followers.forward}
            if self.followers.dwell_seconds is not None:
                followers["dwell_seconds"] = self.followers.dwell_seconds
            followers["steps"] = [_step_as_dict(step) for step in self.followers.steps]
            document["followers"] = followers
        return document

    def as_json(self) -> str:
        """The text of the project file."""
        return json.dumps(self.as_dict(), indent=1, ensure_ascii=False) + "\n"

    def save(self, path: str | Path) -> None:
        """Write the project file. Raises OSError."""
        Path(path).write_text(self.as_json(), encoding="utf-8")


def read_program(data: bytes | str) -> Program:
    """The Program in a project file's bytes or text.

    Raises:
        ProgramError: with every diagnostic that there is to say about its shape.
    """
    return program_from_dict(read_document(data))


def read_document(data: bytes | str) -> Any:
    """The parsed JSON of a project file, in which no key stands twice. Raises ProgramError."""
    try:
        text = data.decode("utf-8-sig") if isinstance(data, bytes) else data
        document = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_without_doubles)
        if "\\ud" in text.lower():
            # Half a surrogate pair is legal in JSON, yet no file or schema can hold it.
            json.dumps(document, ensure_ascii=False).encode()
    except ProgramError:
        raise
    except json.JSONDecodeError as problem:
        where = phrase("syntax", line=problem.lineno, column=problem.colno, reason=problem.msg)
        raise _not_json(where) from None
    except UnicodeError:
        raise _not_json(phrase("not-text")) from None
    except RecursionError:
        raise _not_json(phrase("too-deep")) from None
    except ValueError as problem:  # a number with thousands of digits
        raise _not_json(phrase("bad-number", number=str(problem)[:40])) from None
    return document


def program_from_dict(document: Any) -> Program:
    """The Program in parsed JSON. What stands beside it there is not looked into. Raises ProgramError."""
    if isinstance(document, dict):
        document = {
            name: {} if name in BESIDE and isinstance(value, dict) else value for name, value in document.items()
        }
    if _depth(document) > DEEPEST:
        raise _not_json(phrase("too-deep"))
    try:
        diagnostics = check_shape(document)
    except UnicodeError:  # half a surrogate pair
        raise _not_json(phrase("not-text")) from None
    if diagnostics:
        raise ProgramError(diagnostics)
    followers = document.get("followers")
    return Program(
        leader=_steps_from(document["leader"]),
        followers=followers and Followers(**{**followers, "steps": _steps_from(followers["steps"])}),
        profile=document.get("profile", "classroom"),
    )


def _steps_from(documents: list[dict[str, Any]]) -> list[Step]:
    return [_step_from(document) for document in documents]


def _step_from(document: dict[str, Any]) -> Step:
    more = {key: document[key] for key in ("id", "accept_ir", "forward") if key in document}
    kind = next(key for key in document if key in KINDS)
    content = document[kind]
    if kind == TogetherStep.kind:
        return TogetherStep(tuple(_steps_from(content)), **more)
    if kind == RepeatStep.kind:
        return RepeatStep(int(content["times"]), tuple(_steps_from(content["steps"])), **more)
    # JSON knows one kind of number: 2.0 is a level as good as 2.
    levels = {name: int(content[name]) for name in ("speed", "which", "radius") if name in content}
    return KINDS[kind](**{**content, **levels}, **more)


def _step_as_dict(step: Step) -> dict[str, Any]:
    if isinstance(step, TogetherStep):
        document: dict[str, Any] = {step.kind: [_step_as_dict(part) for part in step.steps]}
    else:
        own = {name: getattr(step, name) for name in step.own_schemas()}
        content = {name: value for name, value in own.items() if value is not None}
        if isinstance(step, RepeatStep):
            content["steps"] = [_step_as_dict(part) for part in step.steps]
        document = {step.kind: content}
    for name in ("id", "accept_ir", "forward"):
        if getattr(step, name) is not None:
            document[name] = getattr(step, name)
    return document


def _check_flags(**flags: object) -> None:
    for name, value in flags.items():
        if not isinstance(value, bool):
            raise ValueError(f"followers: {name} is {value!r}; allowed: True or False")


def _is_duration(seconds: object) -> bool:
    return (
        isinstance(seconds, (int, float)) and not isinstance(seconds, bool) and SHORTEST_DWELL_S <= seconds <= LONGEST_S
    )


def _depth(document: Any) -> int:
    """How deeply ``document`` nests, counted no further than DEEPEST + 1."""
    level, depth = [document], 0
    while level and depth <= DEEPEST:
        depth += 1
        level = [
            child
            for parent in level
            if isinstance(parent, (dict, list))
            for child in (parent.values() if isinstance(parent, dict) else parent)
        ]
    return depth


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object; Python's own reader would silently keep only the last of two equal keys."""
    document = dict(pairs)
    if len(document) < len(pairs):
        names = [name for name, _ in pairs]
        double = next(name for name in names if names.count(name) > 1)
        raise ProgramError([error("duplicate-field", double, name=double)])
    return document


def _refuse_constant(name: str) -> None:
    raise _not_json(phrase("bad-number", number=name))


def _not_json(reason: Phrase) -> ProgramError:
    return ProgramError([error("not-json", "", reason=reason)])
