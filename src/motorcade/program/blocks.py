"""Programs as the states of Blockly's workspaces; `motorcade.program.blocks_reader` reads them.

Each step is a block of its own type, with the step's fields in capitals. Some kinds have a type for each form: a repeat
so many times, until a condition holds, or for ever. Conditions are blocks, too. They stand in the inputs WHEN and UNTIL
of steps, in UNLESS of those that drive, and in those of other conditions. The field ENDS of a step that takes time says
what ends it: its time, a condition, or whichever comes first.

These types are no steps: the hat, which is the first block of each workspace, above the steps; the block that defines a
function, a top block of the leader's workspace; and the infrared block, whose settings hold for the steps inside it.
"""

from collections.abc import Sequence
from itertools import groupby
from typing import Any, NamedTuple

from motorcade.program.conditions import COMPARISONS
from motorcade.program.diagnostics import ProgramError, error
from motorcade.program.flow_steps import ALL_KINDS, IN_TURN, ChangeStep, DoStep, FlowStep, IfStep, SetStep, TellStep
from motorcade.program.model import Followers, Program
from motorcade.program.steps import SIMPLE_KINDS, RepeatStep, TogetherStep, WaitStep, own_fields

Workspace = dict[str, Any]
Block = dict[str, Any]
Document = dict[str, Any]

PREFIX = "motorcade_"
LEADER_HAT = f"{PREFIX}leader"
FOLLOWERS_HAT = f"{PREFIX}followers"
INFRARED = f"{PREFIX}infrared"
DEFINE = f"{PREFIX}define"
# What the type of a condition's block begins with.
CONDITION = f"{PREFIX}when_"

# No image holds more than 255 states or words. Each block of a row adds two levels of nesting to the JSON, and Python's
# reader takes about a thousand levels.
MOST_IN_A_ROW = 400
# program_from_dict reads no deeper program; a repeat takes three levels of nesting there.
MOST_DEEP = 30

SETTINGS = ("accept_ir", "forward")
# The settings of the followers' hat that the page's first level shows.
SETTINGS_IN_START = ("forward",)
CHOICES = {"same": None, "yes": True, "no": False}
_CHOICE_OF = {setting: choice for choice, setting in CHOICES.items()}
TAGGED = {"auto": "auto", "yes": True, "no": False}
_HAT_AT = {"x": 24, "y": 24}
# Room between the stacks of blocks of a workspace that is laid out anew, and for each block in them.
_GAP_PX = 48
_BLOCK_PX = 72

# What ends a step: its time, a condition, or whichever comes first.
BY_TIME = "time"
BY_CONDITION = "until"
_BY_BOTH = "both"
ENDS = (BY_TIME, BY_CONDITION, _BY_BOTH)


# The input of a drive's block with what it minds; it may be empty.
UNLESS = "UNLESS"


class BlockField(NamedTuple):
    """A field of a block, and where its value stands in a document; ``is_menu``: its levels are texts in the block."""

    capitals: str
    name: str
    is_menu: bool = False


class BlockForm(NamedTuple):
    """A type of block whose step differs from others of its kind in the fields that it has, and in its inputs."""

    kind: str
    fields: tuple[BlockField, ...] = ()
    condition: str = ""
    rows: tuple[tuple[str, str], ...] = ()


def _fields_of(kind: type) -> tuple[BlockField, ...]:
    return tuple(BlockField(own.name.upper(), own.name, "menu" in own.metadata) for own in own_fields(kind))


_TIMES = BlockField("TIMES", "times")
_COUNTER = BlockField("COUNTER", "counter")
_STEPS = (("STEPS", "steps"),)
# The types whose steps are objects with fields, a condition and rows of steps: together, tell and do are none.
FORMS = {
    **{kind.kind: BlockForm(kind.kind, _fields_of(kind)) for kind in SIMPLE_KINDS},
    "repeat": BlockForm(RepeatStep.kind, (_TIMES,), rows=_STEPS),
    "repeat_until": BlockForm(RepeatStep.kind, condition="until", rows=_STEPS),
    "forever": BlockForm(RepeatStep.kind, rows=_STEPS),
    "if": BlockForm(IfStep.kind, condition="when", rows=(("THEN", "then"),)),
    "if_else": BlockForm(IfStep.kind, condition="when", rows=(("THEN", "then"), ("ELSE", "else"))),
    "set": BlockForm(SetStep.kind, (_COUNTER, BlockField("TO", "to"))),
    "set_random": BlockForm(SetStep.kind, (_COUNTER, BlockField("RANDOM", "random"))),
    "change": BlockForm(ChangeStep.kind, _fields_of(ChangeStep)),
    "flow": BlockForm(FlowStep.kind, _fields_of(FlowStep)),
}
WAIT_UNTIL = "wait_until"
SIMPLE = {kind.kind: kind for kind in SIMPLE_KINDS}

# The field of a condition that has one, and whether it is a menu of levels.
ASKED = {
    "obstacle": BlockField("LEVEL", "obstacle", is_menu=True),
    "voice": BlockField("COMMAND", "voice"),
    "floor": BlockField("WHERE", "floor"),
    "chance": BlockField("PERCENT", "chance"),
}
# An `all` or `any` has so many inputs unless its block says otherwise.
PARTS = 2


def blocks_of(program: Program) -> tuple[Workspace, Workspace | None]:
    """Return the workspaces of the leader and of the followers, laid out anew.

    Raises ProgramError where the program has too many steps in a row, or they are nested too deep.
    """
    document = program.as_dict()
    leader = _workspace(LEADER_HAT, {}, _blocks(document["leader"], "leader", 0))
    tops = leader["blocks"]["blocks"]
    for name, steps in document.get("functions", {}).items():
        block: Block = {"type": DEFINE, "id": f"{DEFINE}_{name}", "fields": {"NAME": name}}
        block = _with_inside(block, "STEPS", _blocks(steps, f"functions.{name}", 1))
        above = tops[-1]
        y = above["y"] + _count_blocks(above) * _BLOCK_PX + _GAP_PX
        tops.append({**block, "x": _HAT_AT["x"], "y": y})
    if program.followers is None:
        return leader, None
    followers = _blocks(document["followers"]["steps"], "followers.steps", 0)
    return leader, _workspace(FOLLOWERS_HAT, _hat_fields(program.followers), followers)


def _count_blocks(block: Block) -> int:
    """Return how many blocks are in this one and below it, itself included."""
    below = [connected["block"] for connected in block.get("inputs", {}).values()]
    if "next" in block:
        below.append(block["next"]["block"])
    return 1 + sum(map(_count_blocks, below))


def field_value(name: str, value: Any, in_hat: bool = False) -> tuple[str, Any]:
    """Return the field of a block, and what it holds, for a value of a step or of the followers' settings."""
    if name == "dwell_seconds":
        if value is None:
            return "DWELL", "auto"
        return "DWELL", str(plain(value))
    if value is None:
        return name.upper(), ""
    if isinstance(value, bool) and in_hat:
        value = "TRUE" if value else "FALSE"
    elif isinstance(value, bool):
        value = _CHOICE_OF[value]
    return name.upper(), value


def _hat_fields(followers: Followers) -> dict[str, Any]:
    ticks = dict(field_value(name, getattr(followers, name), in_hat=True) for name in SETTINGS)
    tagged = next(choice for choice, meaning in TAGGED.items() if meaning == followers.tagged)
    return {**ticks, "TAGGED": tagged, **dict([field_value("dwell_seconds", followers.dwell_seconds)])}


def plain(value: Any) -> Any:
    """Return a whole number as an integer: 2 for 2.0; any other value as it is."""
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def _blocks(steps: Sequence[Document], path: str, depth: int) -> Block | None:
    """Return the first block of the row for ``steps``, as they are in JSON; the others are below it."""
    row: list[Block] = []
    for flags, group in groupby(steps, key=lambda step: (step.get("accept_ir"), step.get("forward"))):
        if flags == (None, None):
            row += [_block(step, path, depth) for step in group]
        else:
            accept_ir, forward = flags
            fields = {"ACCEPT_IR": _CHOICE_OF[accept_ir], "FORWARD": _CHOICE_OF[forward]}
            inside = _row_of([_block(step, path, depth + 1) for step in group], path)
            row.append(_with_inside({"type": INFRARED, "fields": fields}, "STEPS", inside))
    return _row_of(row, path)


def _block(step: Document, path: str, depth: int) -> Block:
    if depth > MOST_DEEP:
        raise ProgramError([error("blocks-too-deep", path, step.get("id"), most=MOST_DEEP)])
    kind = next(key for key in step if key in ALL_KINDS)
    content = step[kind]
    until = step.get("until")
    block_type = _type_of(kind, content, until)
    fields: dict[str, Any] = {}
    block: Block = {"type": f"{PREFIX}{block_type}", "fields": fields}
    if "id" in step:
        block["id"] = step["id"]
    if until is not None:
        block = _with_inside(block, "UNTIL", _condition_block(until, path, depth))
        if block_type != WAIT_UNTIL:
            fields["ENDS"] = _BY_BOTH
    if block_type == TogetherStep.kind:
        return _together(block, content, until is not None, path, depth)
    if block_type == TellStep.kind:
        return _with_inside(block, "STEPS", _blocks([content["step"]], path, depth + 1))
    if block_type == DoStep.kind:
        fields["NAME"] = content
    form = FORMS.get(block_type)
    if form is None:
        return block
    fields |= _field_values(content, form.fields)
    if until is not None and "seconds" not in content:
        fields["ENDS"] = BY_CONDITION
    if form.condition:
        condition = _condition_block(content[form.condition], path, depth)
        block = _with_inside(block, form.condition.upper(), condition)
    if "unless" in content:
        block = _with_inside(block, UNLESS, _condition_block(content["unless"], path, depth))
    for capitals, name in form.rows:
        block = _with_inside(block, capitals, _blocks(content[name], path, depth + 1))
    return block


def _type_of(kind: str, content: Any, until: Any) -> str:
    """Return the type of the block of a step, without its prefix."""
    if kind == WaitStep.kind and until is not None and "seconds" not in content:
        return WAIT_UNTIL
    if kind == RepeatStep.kind and "until" in content:
        return "repeat_until"
    if kind == RepeatStep.kind and "times" not in content:
        return "forever"
    if kind == IfStep.kind and content.get("else"):
        return "if_else"
    if kind == SetStep.kind and "random" in content:
        return "set_random"
    if kind == TellStep.kind and content["step"] == IN_TURN:
        return IN_TURN
    return kind


def _together(block: Block, parts: Sequence[Document], is_until: bool, path: str, depth: int) -> Block:
    """Return the block of a together with those of its parts. A part that only a condition ends has no time."""
    row = []
    timeless = []
    for part in parts:
        made = _block(part, path, depth + 1)
        kind = next(key for key in part if key in SIMPLE)
        if is_until and not SIMPLE[kind].accompanies and "seconds" not in part[kind]:
            timeless.append(made)
        row.append(made)
    timed = sum(1 for made in row if "SECONDS" in made["fields"])
    if timeless and not timed:
        block["fields"]["ENDS"] = BY_CONDITION
    else:
        for made in timeless:
            made["fields"]["ENDS"] = BY_CONDITION
    return _with_inside(block, "STEPS", _row_of(row, path))


def _condition_block(condition: Document, path: str, depth: int) -> Block:
    """Return the block of a condition, as it is in JSON."""
    if depth > MOST_DEEP:
        raise ProgramError([error("blocks-too-deep", path, most=MOST_DEEP)])
    kind, content = next(iter(condition.items()))
    block: Block = {"type": f"{CONDITION}{kind}", "fields": {}}
    if kind in ASKED:
        block["fields"] = _field_values(condition, (ASKED[kind],))
    elif kind == "counter":
        comparison = next(name for name in COMPARISONS if name in condition)
        block["fields"] = {"COUNTER": content, "IS": comparison, "VALUE": condition[comparison]}
    elif kind == "not":
        return _with_inside(block, "OF", _condition_block(content, path, depth + 1))
    elif kind in ("all", "any"):
        if len(content) != PARTS:
            block["extraState"] = {"parts": len(content)}
        for number, part in enumerate(content):
            block = _with_inside(block, f"OF{number}", _condition_block(part, path, depth + 1))
    return block


def _field_values(content: Document, fields: Sequence[BlockField]) -> dict[str, Any]:
    """Return the fields of a block for what a step has in its own object."""
    values = {}
    for field in fields:
        if field.name not in content:
            continue
        value = content[field.name]
        if field.is_menu:
            value = str(value)
        values[field.capitals] = value
    return values


def _with_inside(block: Block, name: str, first: Block | None) -> Block:
    """Return a block with another in one of its inputs."""
    if first is None:
        return block
    return {**block, "inputs": {**block.get("inputs", {}), name: {"block": first}}}


def _row_of(row: Sequence[Block], path: str) -> Block | None:
    """Return the row's first block, with each of the others below the one before it."""
    if len(row) > MOST_IN_A_ROW:
        raise ProgramError([error("too-many-in-a-row", path, most=MOST_IN_A_ROW)])
    below = None
    for block in reversed(row):
        if below:
            block = {**block, "next": {"block": below}}
        below = block
    return below


def _workspace(hat: str, fields: dict[str, Any], first: Block | None) -> Workspace:
    block: Block = {"type": hat, "id": hat, **_HAT_AT}
    if fields:
        block["fields"] = fields
    if first:
        block["next"] = {"block": first}
    return {"blocks": {"languageVersion": 0, "blocks": [block]}}
