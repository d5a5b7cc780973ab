"""Write steps and conditions as the statements of a program that is written as functions."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from motorcade.program import steps
from motorcade.program.blocks import plain
from motorcade.program.conditions import (
    SENSES,
    All,
    AnyOf,
    Chance,
    Condition,
    Counted,
    Not,
    Sensing,
    alternatives,
    counters_in,
    without_double_not,
)
from motorcade.program.flow_steps import (
    IN_TURN,
    ChangeStep,
    DoStep,
    FlowStep,
    IfStep,
    SetStep,
    TellStep,
    conditions_of,
)
from motorcade.program.model import Followers, Program, placed_steps
from motorcade.program.python_calls import parameters_of
from motorcade.program.steps import (
    COMMON,
    DrivingStep,
    RepeatStep,
    Step,
    is_deciding,
    own_fields,
    walk,
)

_SIGNS = {("is", True): "==", ("is", False): "!=", ("below", True): "<", ("below", False): ">="}
_SIGNS |= {("above", True): ">", ("above", False): "<="}
_CALLS = {"voice": "heard", "floor": "dark"}


def needs_statements(program: Program) -> bool:
    """Whether a program holds what only functions and statements say."""
    return bool(program.functions) or any(
        is_deciding(step) or (_minded(step) and not _is_sensed(step)) for _, step in placed_steps(program)
    )


def _minded(step: Step) -> list[Condition]:
    """Return the conditions of a step's ``unless``."""
    if not isinstance(step, DrivingStep) or step.unless is None:
        return []
    return list(alternatives(step.unless))


def _is_sensed(step: Step) -> bool:
    """Whether what a step minds is all sensed, as it has to be in a program without errors."""
    return all(isinstance(condition, Sensing) for condition in _minded(step))


def changed_counters(program: Program) -> list[str]:
    """Return the counters that a program sets or changes, in their order."""
    found = [step.counter for _, step in placed_steps(program) if isinstance(step, SetStep | ChangeStep)]
    return list(dict.fromkeys(found))


def asked_counters(program: Program) -> list[str]:
    """Return the counters that a program asks and never changes: they are no variables of the text."""
    changed = changed_counters(program)
    asked = [
        name
        for _, step in placed_steps(program)
        for condition in conditions_of(step)
        for name in counters_in(condition)
    ]
    return [name for name in dict.fromkeys(asked) if name not in changed]


class StatementTexts:
    """Writes steps; ``used`` collects the names of motorcade that their text needs.

    Args:
        imports: the names of motorcade that have another name in the text, with that.
        constant: the counters that have no variable.
    """

    def __init__(self, imports: Mapping[str, str], constant: Sequence[str] = ()) -> None:
        self.used: set[str] = set()
        self._imports = imports
        self._constant = constant

    def head(self, step: Step) -> str:
        """Return the first line of a step; that of a step that holds others ends with a colon."""
        if isinstance(step, RepeatStep) and not is_statement(step):
            return self.call(step)
        match step:
            case IfStep():
                return f"if {self.condition(step.when)}:"
            case RepeatStep(times=None, until=None):
                return "while True:"
            case RepeatStep(until=Condition() as until):
                return f"while {self.condition(Not(until))}:"
            case RepeatStep():
                return f"for _ in range({step.times}):"
            case SetStep(to=None):
                return f"{step.counter} = {self.name('random')}({step.random})"
            case SetStep():
                return f"{step.counter} = {step.to}"
            case ChangeStep() if step.by < 0:
                return f"{step.counter} -= {-step.by}"
            case ChangeStep():
                return f"{step.counter} += {step.by}"
            case DoStep():
                return f"{step.function}()"
            case TellStep():
                told = f'"{IN_TURN}"' if step.step is None else self.call(step.step)
                return f"{self.name('tell')}({told})"
        return self.call(step)

    def call(self, step: Any) -> str:
        """Return a step as a call."""
        if isinstance(step, FlowStep):
            given = {own.name: getattr(step, own.name) for own in own_fields(FlowStep)}
            usual = {own.name: own.default for own in own_fields(FlowStep)}
            values = [f"{name}={value!r}" for name, value in given.items() if value != usual[name] and name != "op"]
            return f"{self.name('flow')}({', '.join([repr(step.op), *values])})".replace("'", '"')
        return self.call_around(step, [self.call(part) for part in step.inside])

    def call_around(self, step: Step, inside: Iterable[str]) -> str:
        """Return a step as a call on one line; ``inside`` are the calls of the steps inside it."""
        positional, named = values_of(step)
        if minded := _minded(step):
            # Where a program is a list of steps, Python itself reads it, and takes no word between conditions.
            sign = " | " if _is_sensed(step) else " or "
            named.append(f"unless={sign.join(self.condition(condition, sign) for condition in minded)}")
        if step.until is not None:
            named.append(f"until={self.condition(step.until)}")
        return f"{self.name(name_of(step))}({', '.join([*positional, *inside, *named])})"

    def condition(self, condition: Condition, inside: str = "") -> str:
        """Return a condition; ``inside`` is the word between it and its neighbours."""
        condition, holds = without_double_not(condition)
        if isinstance(condition, Counted) and condition.counter not in self._constant:
            sign = _SIGNS[condition.comparison, holds]
            return f"{condition.counter} {sign} {condition.number}"
        if isinstance(condition, All | AnyOf):
            word = " and " if isinstance(condition, All) else " or "
            text = word.join(self.condition(part, word) for part in condition.parts)
            is_one = len(condition.parts) < 2
            if not holds:
                return f"not ({text})"
            return f"({text})" if inside and not is_one else text
        text = self._asked(condition)
        return text if holds else f"not {text}"

    def _asked(self, condition: Condition) -> str:
        match condition:
            case Chance(percent):
                return f"{self.name('chance')}({plain(percent)})"
            case Counted(name, comparison, number):
                return f'{self.name("counter")}("{name}", "{comparison}", {number})'
            case Sensing("person"):
                return f"{self.name('person')}()"
            case Sensing("obstacle", level):
                return f"{self.name('obstacle')}({level})"
            case Sensing(sense, level):
                return f'{self.name(_CALLS[sense])}("{SENSES[sense][level]}")'
        raise TypeError(condition)

    def name(self, name: str) -> str:
        """Return the name that something of motorcade has in the text, and take note that the text needs it."""
        self.used.add(name)
        return self._imports.get(name, name)


def values_of(step: Step) -> tuple[list[str], list[str]]:
    """Return a step's values that stand by their position, and those that are named."""
    names, defaults, _ = parameters_of(getattr(steps, name_of(step)))
    positional = []
    named = []
    for parameter in names:
        value = getattr(step, parameter)
        has_default = parameter in defaults
        if has_default and value == defaults[parameter]:
            continue
        if has_default and defaults[parameter] is not None:
            named.append(f"{parameter}={plain(value)!r}")
        else:
            positional.append(repr(plain(value)))
    for setting in COMMON:
        value = getattr(step, setting)
        if value is not None and setting != "id":
            named.append(f"{setting}={value!r}")
    return positional, named


def settings_of(followers: Followers) -> dict[str, Any]:
    """Return the settings of followers that aren't the usual ones."""
    usual = parameters_of(Followers)[1]
    return {name: getattr(followers, name) for name in usual if getattr(followers, name) != usual[name]}


def name_of(step: Step) -> str:
    """Return the name of a step in Python."""
    names: dict[str, dict[str, str]] = step.names
    return next(name for name, fixed in names.items() if all(getattr(step, key) == fixed[key] for key in fixed))


def is_statement(step: Step) -> bool:
    """Whether a step becomes a statement that holds others; with settings of its own a repeat is a call."""
    has_settings = step.accept_ir is not None or step.forward is not None
    is_call = has_settings and not any(is_deciding(part) for _, part in walk([step], ""))
    return isinstance(step, IfStep) or (isinstance(step, RepeatStep) and not is_call)


def statement_lists(step: Step) -> Iterator[tuple[str, str]]:
    """Yield the lists of a step that is a statement, each with the line above it: empty for the first one."""
    if isinstance(step, IfStep):
        yield "then", ""
        if step.otherwise:
            yield "otherwise", "else:"
    else:
        yield "steps", ""
