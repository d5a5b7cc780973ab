"""Convert between a program and the states of Blockly's workspaces.

Each step is a block of its own type, with the step's fields in capitals. Two more types are no steps: the hat, which is
the first block of each workspace, above the steps, and the infrared block, whose settings hold for the steps inside it.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

from motorcade.program.diagnostics import BEHIND, DELETE, Diagnostic, Fix, ProgramError, error
from motorcade.program.model import Followers, Program, program_from_dict
from motorcade.program.schema import FORMAT
from motorcade.program.steps import KINDS, RepeatStep, Step, TogetherStep, own_fields

Workspace = dict[str, Any]
Block = dict[str, Any]
_Flags = dict[str, bool]

PREFIX = "motorcade_"
LEADER_HAT = f"{PREFIX}leader"
FOLLOWERS_HAT = f"{PREFIX}followers"
INFRARED = f"{PREFIX}infrared"
_WITH_STEPS = (INFRARED, f"{PREFIX}{TogetherStep.kind}", f"{PREFIX}{RepeatStep.kind}")

# No image holds more than 255 states or words. Each block of a row adds two levels of nesting to the JSON, and Python's
# reader takes about a thousand levels.
MOST_IN_A_ROW = 400
# program_from_dict reads no deeper program; a repeat takes three levels of nesting there.
MOST_DEEP = 30

_SETTINGS = ("accept_ir", "forward")
# The settings of the followers' hat that the page's first level shows.
SETTINGS_IN_START = ("forward",)
_CHOICES = {"same": None, "yes": True, "no": False}
_CHOICE_OF = {setting: choice for choice, setting in _CHOICES.items()}
_TICKS = {"TRUE": True, "FALSE": False}
_TAGGED = {"auto": "auto", "yes": True, "no": False}
_LEVELS = {str(level): level for level in range(4)}
_NOWHERE: Block = {}
# Each field of a kind: its name in a block, its name in the step, and whether it is a menu of levels.
_FIELDS = {
    kind: [(own.name.upper(), own.name, "menu" in own.metadata) for own in own_fields(kind)] for kind in KINDS.values()
}
_HAT_AT = {"x": 24, "y": 24}


def program_of(leader: Any, followers: Any = None, profile: str = "classroom") -> Program:
    """Return the Program of the blocks below the two workspaces' hats; a step's id is its block's.

    Loose and disabled blocks are left out; a workspace without a hat has no steps. ``followers`` is None where only
    the leader is programmed. Raises ProgramError, with all that is wrong, where the blocks make no program.
    """
    document: dict[str, Any] = {"format": FORMAT, "profile": profile, "followers": None}
    faults: list[Diagnostic] = []
    hat = _hat(leader, LEADER_HAT, "leader")
    document["leader"] = _steps(_below(hat, "leader"), "leader", faults, leads=True)
    if followers is not None:
        hat = _hat(followers, FOLLOWERS_HAT, "followers")
        steps = _steps(_below(hat, "followers"), "followers.steps", faults, leads=False)
        document["followers"] = {**_of_hat(hat), "steps": steps}
    try:
        program = program_from_dict(document)
    except ProgramError as problem:
        faults.extend(problem.diagnostics)
    if faults:
        raise ProgramError(faults)
    return program


def blocks_of(program: Program) -> tuple[Workspace, Workspace | None]:
    """Return the workspaces of the leader and of the followers, laid out anew.

    Raises ProgramError where the program has too many steps in a row, or they are nested too deep.
    """
    leader = _workspace(LEADER_HAT, {}, _blocks(program.leader, "leader", 0))
    if program.followers is None:
        return leader, None
    followers = _blocks(program.followers.steps, "followers.steps", 0)
    return leader, _workspace(FOLLOWERS_HAT, _hat_fields(program.followers), followers)


def _steps(
    first: Block | None, path: str, faults: list[Diagnostic], leads: bool, depth: int = 0, inside: bool = False
) -> list[dict[str, Any]]:
    """Return the steps, for JSON, of ``first`` and all blocks below it.

    Args:
        path: the place of these steps in the program.
        faults: takes what is wrong with blocks, which are left out then.
        leads: whether they are the leader's.
        depth: how many blocks are around them.
        inside: whether they are parts of a together.
    """

    def row(first: Block | None, flags: _Flags, depth: int) -> Iterator[tuple[Block, _Flags, int]]:
        """Yield each step's block, the settings of the infrared blocks around it, and its depth."""
        for block in _chain(first, path):
            if depth > MOST_DEEP:
                raise _refused("blocks-too-deep", path, block, most=MOST_DEEP)
            if block.get("enabled") is False or block.get("disabledReasons"):
                continue
            if inside and block.get("type") in _WITH_STEPS:
                faults.extend(_refused("not-inside-together", path, block, [Fix(BEHIND)]).diagnostics)
                continue
            if block.get("type") != INFRARED:
                yield block, flags, depth
                continue
            try:
                own = _own_flags(block, path)
            except ProgramError as problem:
                faults.extend(problem.diagnostics)
                continue
            if leads and own != {"accept_ir": False}:
                fixes = []
                if "forward" in own:
                    fixes.append(Fix("forward", "same"))
                if own.get("accept_ir") is not False:
                    fixes.append(Fix("accept_ir", "no"))
                if len(fixes) > 1:
                    # Where two values are wrong, one isn't enough.
                    fixes.clear()
                faults.extend(_refused("leader-accepts-ir", path, block, fixes).diagnostics)
                own = {}
            yield from row(_inside(block, path), flags | own, depth + 1)

    steps = []
    for number, (block, flags, deep) in enumerate(row(first, {}, depth)):
        try:
            steps.append(_step(block, flags, f"{path}[{number}]", faults, leads, deep, inside))
        except ProgramError as problem:
            faults.extend(problem.diagnostics)
    return steps


def _step(
    block: Block, flags: _Flags, path: str, faults: list[Diagnostic], leads: bool, depth: int, inside: bool
) -> dict[str, Any]:
    kind = str(block.get("type")).removeprefix(PREFIX)
    if kind not in KINDS:
        raise _refused("unknown-block", path, block, type=str(block.get("type"))[:40])
    document: dict[str, Any] = {**flags}
    if "id" in block:
        document["id"] = block["id"]
    if kind == TogetherStep.kind:
        document[kind] = _steps(_inside(block, path), f"{path}.{kind}", faults, leads, depth + 1, inside=True)
        return document
    content: dict[str, Any] = {}
    # A step that accompanies others has no fields in a together: it lasts as long as the together.
    if not (inside and KINDS[kind].accompanies):
        fields = _object(block.get("fields"), path, block)
        for capitals, name, is_menu in _FIELDS[KINDS[kind]]:
            if capitals not in fields:
                continue
            content[name] = fields[capitals]
            if is_menu:
                content[name] = _chosen(fields[capitals], _LEVELS)
    if kind == RepeatStep.kind:
        content["steps"] = _steps(_inside(block, path), f"{path}.{kind}.steps", faults, leads, depth + 1)
    return {**document, kind: content}


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


def holder_of(workspace: Workspace, block_id: str | None, name: str) -> Block:
    """Return the block whose setting ``name`` holds for a block below the followers' hat.

    That is the innermost infrared block around it that changes the setting, else the hat.
    """
    hat = _hat(workspace, FOLLOWERS_HAT, "followers")

    def find(first: Block | None, holder: Block) -> Block | None:
        for block in _chain(first, ""):
            if block.get("id") == block_id:
                return holder
            inner = holder
            if block.get("type") == INFRARED and name in _own_flags(block, ""):
                inner = block
            if found := find(_inside(block, ""), inner):
                return found
        return None

    return find(_below(hat, ""), hat) or hat


def _hat(workspace: Any, kind: str, path: str) -> Block:
    """The workspace's hat; an empty block where there is none."""
    blocks = _object(_object(workspace, path).get("blocks"), path).get("blocks", [])
    if not isinstance(blocks, list):
        raise _refused("bad-blocks", path, _NOWHERE)
    hats = [block for block in blocks if isinstance(block, dict) and block.get("type") == kind]
    if len(hats) > 1:
        raise _refused("second-hat", path, hats[1], [Fix(DELETE)])
    if not hats:
        return _NOWHERE
    return hats[0]


def _of_hat(hat: Block) -> dict[str, Any]:
    """The settings of the followers' hat, for JSON."""
    fields = _object(hat.get("fields"), "followers", hat)
    settings = {name: _chosen(fields[name.upper()], _TICKS) for name in _SETTINGS if name.upper() in fields}
    if "TAGGED" in fields:
        settings["tagged"] = _chosen(fields["TAGGED"], _TAGGED)
    dwell = fields.get("DWELL", "auto")
    if dwell != "auto":
        settings["dwell_seconds"] = _number(dwell)
    return settings


def _hat_fields(followers: Followers) -> dict[str, Any]:
    ticks = dict(field_value(name, getattr(followers, name), in_hat=True) for name in _SETTINGS)
    tagged = next(choice for choice, meaning in _TAGGED.items() if meaning == followers.tagged)
    return {**ticks, "TAGGED": tagged, **dict([field_value("dwell_seconds", followers.dwell_seconds)])}


def _chain(block: Block | None, path: str) -> Iterator[Block]:
    """Yield the block and those below it."""
    for _ in range(MOST_IN_A_ROW):
        if block is None:
            return
        yield block
        block = _below(block, path)
    if block is not None:
        raise _refused("too-many-in-a-row", path, block, most=MOST_IN_A_ROW)


def _below(block: Block, path: str) -> Block | None:
    return _connected(block.get("next"), path, block)


def _inside(block: Block, path: str) -> Block | None:
    return _connected(_object(block.get("inputs"), path, block).get("STEPS"), path, block)


def _connected(connection: Any, path: str, block: Block) -> Block | None:
    if connection is None:
        return None
    return _object(_object(connection, path, block).get("block"), path, block) or None


def _object(value: Any, path: str, block: Block = _NOWHERE) -> dict[str, Any]:
    """Return a value of ``block`` that must be an object; an empty one where it is absent."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise _refused("bad-blocks", path, block)
    return value


def _own_flags(block: Block, path: str) -> _Flags:
    """Return the settings of an infrared block, without those that it does not change."""
    fields = _object(block.get("fields"), path, block)
    flags = {}
    for name in _SETTINGS:
        choice = str(fields.get(name.upper(), "same"))
        if choice not in _CHOICES:
            raise _refused("out-of-range", path, block, value=choice[:40], allowed=", ".join(_CHOICES))
        flags[name] = _CHOICES[choice]
    return {name: flag for name, flag in flags.items() if flag is not None}


def _chosen(value: Any, meanings: Mapping[str, Any]) -> Any:
    """Return the meaning of a menu's or a checkbox's text; the schema refuses any other value later."""
    if not isinstance(value, str):
        return value
    return meanings.get(value, value)


def _number(text: Any) -> Any:
    try:
        return plain(float(text))
    except (TypeError, ValueError):
        return text


def plain(value: Any) -> Any:
    """Return a whole number as an integer: 2 for 2.0; any other value as it is."""
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def _blocks(steps: Sequence[Step], path: str, depth: int) -> Block | None:
    """Return the first block of the row for ``steps``; the others are below it."""
    row: list[Block] = []
    for flags, group in groupby(steps, key=lambda step: (step.accept_ir, step.forward)):
        if flags == (None, None):
            row += [_block(step, path, depth) for step in group]
        else:
            accept_ir, forward = flags
            fields = {"ACCEPT_IR": _CHOICE_OF[accept_ir], "FORWARD": _CHOICE_OF[forward]}
            inside = _row_of([_block(step, path, depth + 1) for step in group], path)
            row.append(_with_inside({"type": INFRARED, "fields": fields}, inside))
    return _row_of(row, path)


def _block(step: Step, path: str, depth: int) -> Block:
    if depth > MOST_DEEP:
        raise ProgramError([error("blocks-too-deep", path, step.id, most=MOST_DEEP)])
    block: Block = {"type": f"{PREFIX}{step.kind}"}
    if step.id is not None:
        block["id"] = step.id
    fields = block["fields"] = {}
    for capitals, name, is_menu in _FIELDS[type(step)]:
        value = getattr(step, name)
        if value is None:
            continue
        fields[capitals] = value
        if is_menu:
            fields[capitals] = str(value)
    return _with_inside(block, _blocks(step.inside, path, depth + 1))


def _with_inside(block: Block, first: Block | None) -> Block:
    if first is None:
        return block
    return {**block, "inputs": {"STEPS": {"block": first}}}


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


def _refused(
    code: str, path: str, block: Mapping[str, Any], fixes: Sequence[Fix] = (), **arguments: Any
) -> ProgramError:
    block_id = block.get("id")
    if not isinstance(block_id, str):
        block_id = None
    problem = error(code, path, block_id, **arguments)
    return ProgramError([problem.with_fixes(*fixes)])
