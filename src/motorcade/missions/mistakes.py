"""Which usual mistake a program makes: that of the mission's notes whose run goes wrong in the same way.

A run's way of going wrong is told by the sentences about the first star's goals. Of several mistakes that go wrong in
the same way, the one counts whose program is most alike. `scripts/usual_mistakes.py` runs the programs of the notes,
and makes mistakes.json.
"""

import json
from collections import Counter
from collections.abc import Iterator
from functools import cache
from importlib import resources
from itertools import chain
from typing import Any, NamedTuple, Self

from motorcade.errors import Phrase
from motorcade.missions.check import Result
from motorcade.missions.model import Mission
from motorcade.program.model import Program, placed_steps

# Programs that differ by more kinds of steps, or by a larger part of the settings, are no longer the same mistake.
_MOST_KINDS, _MOST_SETTINGS = 1, 0.5


class Failure(NamedTuple):
    """How a program fails.

    Attributes:
        lost: of each goal of the first star the key of its sentence; empty where it is met.
        kinds: the kinds of its steps, with whose they are.
        settings: its steps' settings, and those of the followers, each with its place among the others.
    """

    lost: list[str]
    kinds: list[str]
    settings: list[str]

    @classmethod
    def of(cls, result: Result, program: Program) -> Self:
        """How the program failed that has this result."""
        lost = ["" if goal.met else _key(goal.why) for goal in result.goals if goal.star == 1]
        kinds = {f"{path.partition('[')[0]} {step.kind}" for path, step in placed_steps(program)}
        document = program.as_dict()
        settings = (_settings(document[part] or [], part) for part in ("leader", "followers"))
        return cls(lost, sorted(kinds), sorted(chain(*settings)))

    def differs_by(self, other: "Failure") -> int:
        """By how many settings the programs differ."""
        one, two = Counter(self.settings), Counter(other.settings)
        return ((one - two) + (two - one)).total()

    def is_like(self, known: "Failure") -> bool:
        """Whether a program fails as one that is known, and is much the same."""
        kinds = set(self.kinds).symmetric_difference(known.kinds)
        is_alike = len(kinds) <= _MOST_KINDS and self.differs_by(known) <= _MOST_SETTINGS * len(known.settings)
        return is_alike and self.lost == known.lost


def _settings(node: Any, place: str) -> Iterator[str]:
    """Each value of a part of a program's document, after the keys that lead to it."""
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _settings(value, f"{place} {key}")
    elif isinstance(node, list):
        for item in node:
            yield from _settings(item, place)
    else:
        yield f"{place} {node}"


def _key(why: Phrase) -> str:
    """The key of a sentence, and of the one that it holds."""
    inner = why.details.get("what")
    if isinstance(inner, Phrase):
        return f"{why.key} {inner.key}"
    return why.key


def usual_mistake(mission: Mission, result: Result, program: Program) -> int | None:
    """Return the number of the mistake in the mission's notes, from 0; None where it is none of them."""
    if 1 in result.stars:
        return None
    failure = Failure.of(result, program)
    alike = [
        (failure.differs_by(known), number)
        for number, known in enumerate(_usual_failures().get(mission.id, []))
        if failure.is_like(known)
    ]
    if not alike:
        return None
    return min(alike)[1]


@cache
def _usual_failures() -> dict[str, list[Failure]]:
    """Of each mission that comes with Motorcade how the programs of its notes fail, in their order."""
    text = (resources.files("motorcade.missions") / "mistakes.json").read_text(encoding="utf-8")
    return {name: [Failure(*failure) for failure in failures] for name, failures in json.loads(text).items()}
