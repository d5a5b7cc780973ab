"""Make programs of the states of Blockly's workspaces; what blocks can't say is a sentence about the block at fault.

`motorcade.program.blocks` says which blocks there are.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from motorcade.program.blocks import (
    ASKED,
    BY_CONDITION,
    BY_TIME,
    CHOICES,
    CONDITION,
    DEFINE,
    ENDS,
    FOLLOWERS_HAT,
    FORMS,
    INFRARED,
    LEADER_HAT,
    MOST_DEEP,
    MOST_IN_A_ROW,
    PARTS,
    PREFIX,
    SETTINGS,
    SIMPLE,
    TAGGED,
    UNLESS,
    WAIT_UNTIL,
    Block,
    BlockField,
    BlockForm,
    Document,
    Workspace,
    plain,
)
from motorcade.program.diagnostics import BEHIND, DELETE, Diagnostic, Fix, ProgramError, error
from motorcade.program.flow_steps import ALL_KINDS, IN_TURN, DoStep, TellStep
from motorcade.program.model import Program, program_from_dict
from motorcade.program.schema import FORMAT
from motorcade.program.steps import DrivingStep, RepeatStep, TogetherStep, WaitStep

_TICKS = {"TRUE": True, "FALSE": False}
_LEVELS = {str(level): level for level in range(4)}
_NOWHERE: Block = {}
# Only these can stand in a together; and these, or a together, in a tell.
_TYPES = {*FORMS, TogetherStep.kind, TellStep.kind, DoStep.kind, WAIT_UNTIL, IN_TURN}
# A follower's.
_FOLLOWER_TYPES = {*SIMPLE, TogetherStep.kind, RepeatStep.kind}

_Flags = dict[str, bool]


def program_of(
    leader: Any, followers: Any = None, profile: str = "classroom", left_out: Collection[str] = ()
) -> Program:
    """Return the Program of the blocks below the two workspaces' hats; a step's id is its block's.

    Loose and disabled blocks are left out, and those whose id is in ``left_out``; a workspace without a hat has no
    steps. ``followers`` is None where only the leader is programmed. Raises ProgramError, with all that is wrong, where
    the blocks make no program.
    """
    document: Document = {"format": FORMAT, "profile": profile, "followers": None}
    reading = _BlocksReading(left_out)
    hat = _hat(leader, LEADER_HAT, "leader")
    document["leader"] = reading.steps(_below(hat, "leader"), "leader", _Around())
    if functions := reading.functions(leader):
        document["functions"] = functions
    if followers is not None:
        hat = _hat(followers, FOLLOWERS_HAT, "followers")
        steps = reading.steps(_below(hat, "followers"), "followers.steps", _Around(leads=False))
        document["followers"] = {**_of_hat(hat), "steps": steps}
    faults = reading.faults
    try:
        program = program_from_dict(document)
    except ProgramError as problem:
        faults.extend(problem.diagnostics)
    if faults:
        raise ProgramError(faults)
    return program


class _Around(NamedTuple):
    """What is around a row of blocks.

    Attributes:
        leads: whether they are the leader's.
        depth: how many blocks are around them.
        inside: the kind of the step whose parts they are: together, tell, or none.
        is_ended: whether a condition alone ends the together that they are parts of.
    """

    leads: bool = True
    depth: int = 0
    inside: str = ""
    is_ended: bool = False

    def deeper(self) -> "_Around":
        return self._replace(depth=self.depth + 1)


class _BlocksReading:
    """Blocks that become steps, for JSON.

    Args:
        left_out: the ids of blocks that count as disabled.

    Attributes:
        faults: what is wrong with blocks, which are left out then.
    """

    def __init__(self, left_out: Collection[str]) -> None:
        self.faults: list[Diagnostic] = []
        self._left_out = left_out

    def _is_off(self, block: Block) -> bool:
        """Whether a block is disabled."""
        is_disabled = block.get("enabled") is False or bool(block.get("disabledReasons"))
        return is_disabled or str(block.get("id")) in self._left_out

    def functions(self, workspace: Any) -> dict[str, list[Document]]:
        """Return the steps of the functions that a workspace defines, by their names."""
        found: dict[str, list[Document]] = {}
        for block in _tops(workspace, "leader"):
            if block.get("type") != DEFINE or self._is_off(block):
                continue
            name = str(_part(block, "fields", "functions").get("NAME"))
            path = f"functions.{name}"
            if name in found:
                self.faults += _refused("second-function", path, block, [Fix(DELETE)], name=name).diagnostics
                continue
            found[name] = self.steps(_inside(block, path), path, _Around(depth=1))
        return found

    def steps(self, first: Block | None, path: str, around: _Around) -> list[Document]:
        """Return the steps of ``first`` and all blocks below it; ``path`` is their place in the program."""
        steps: list[Document] = []
        for block, flags, deep in self._row(first, path, {}, around):
            try:
                steps.append(self._step(block, flags, f"{path}[{len(steps)}]", deep))
            except ProgramError as problem:
                self.faults += problem.diagnostics
        return steps

    def _row(
        self, first: Block | None, path: str, flags: _Flags, around: _Around
    ) -> Iterator[tuple[Block, _Flags, _Around]]:
        """Yield each step's block, the settings of the infrared blocks around it, and what is around it."""
        for block in _chain(first, path):
            if around.depth > MOST_DEEP:
                raise _refused("blocks-too-deep", path, block, most=MOST_DEEP)
            if self._is_off(block):
                continue
            kind = str(block.get("type")).removeprefix(PREFIX)
            if around.inside == TogetherStep.kind and kind not in SIMPLE and (kind in _TYPES or kind == "infrared"):
                self.faults += _refused("not-inside-together", path, block, [Fix(BEHIND)]).diagnostics
                continue
            if block.get("type") != INFRARED:
                yield block, flags, around
                continue
            try:
                own = _own_flags(block, path)
            except ProgramError as problem:
                self.faults += problem.diagnostics
                continue
            if around.leads and own != {"accept_ir": False}:
                self.faults += _leader_accepts(block, own, path)
                own = {}
            yield from self._row(_inside(block, path), path, flags | own, around.deeper())

    def _step(self, block: Block, flags: _Flags, path: str, around: _Around) -> Document:
        kind = str(block.get("type")).removeprefix(PREFIX)
        if kind not in _TYPES:
            raise _refused("unknown-block", path, block, type=str(block.get("type"))[:40])
        if not around.leads and kind not in _FOLLOWER_TYPES:
            raise _refused("followers-cannot-decide", path, block, [Fix(DELETE)])
        if around.inside == TellStep.kind and kind == RepeatStep.kind:
            raise _refused("tell-one-step", path, block, [Fix(BEHIND)])
        document: Document = {**flags}
        if "id" in block:
            document["id"] = block["id"]
        if kind == TellStep.kind:
            return {**document, kind: {"step": self._told(block, path, around)}}
        if kind == IN_TURN:
            return {**document, TellStep.kind: {"step": IN_TURN}}
        if kind == DoStep.kind:
            return {**document, kind: _part(block, "fields", path).get("NAME")}
        if kind == WAIT_UNTIL:
            return {**document, WaitStep.kind: {}, "until": self._condition(block, "UNTIL", path, block, around.depth)}
        ends = _ends(block, path)
        if ends != BY_TIME and not around.inside:
            if not around.leads:
                raise _refused("followers-cannot-decide", path, block)
            document["until"] = self._condition(block, "UNTIL", path, block, around.depth)
        if kind == TogetherStep.kind:
            parts = around.deeper()._replace(inside=kind, is_ended=ends == BY_CONDITION)
            document[kind] = self.steps(_inside(block, path), f"{path}.{kind}", parts)
            return document
        form = FORMS[kind]
        content = self._content(block, form, path, around)
        if ends == BY_CONDITION or around.is_ended:
            content.pop("seconds", None)
        return {**document, form.kind: content}

    def _content(self, block: Block, form: BlockForm, path: str, around: _Around) -> Document:
        """Return what a step has in its own object."""
        content: Document = {}
        # A step that accompanies others has no fields in a together: it lasts as long as the together.
        if not (around.inside == TogetherStep.kind and ALL_KINDS[form.kind].accompanies):
            content |= _values(block, form.fields, path)
        minded = _inside(block, path, UNLESS)
        if minded and not self._is_off(minded) and issubclass(ALL_KINDS[form.kind], DrivingStep):
            content["unless"] = self._condition(block, UNLESS, path, block, around.depth)
        if form.condition:
            content[form.condition] = self._condition(block, form.condition.upper(), path, block, around.depth)
        for capitals, name in form.rows:
            inner = self.steps(_inside(block, path, capitals), f"{path}.{form.kind}.{name}", around.deeper())
            content[name] = inner
        return content

    def _told(self, block: Block, path: str, around: _Around) -> Any:
        """Return the one step that a tell holds, for a follower."""
        inner = around.deeper()._replace(leads=False, inside=TellStep.kind)
        found = list(self._row(_inside(block, path), path, {}, inner))
        if not found:
            raise _refused("tell-one-step", path, block)
        if len(found) > 1:
            raise _refused("tell-one-step", path, found[1][0], [Fix(BEHIND)])
        told, flags, deep = found[0]
        return self._step(told, flags, f"{path}.{TellStep.kind}.step", deep)

    def _condition(self, holder: Block, name: str, path: str, step: Block, depth: int) -> Document:
        """Return the condition in an input of ``holder``. The block of the ``step`` is at fault where there is none."""
        block = _inside(holder, path, name)
        if block is None or self._is_off(block):
            raise _refused("missing-condition", path, step)
        if depth > MOST_DEEP:
            raise _refused("blocks-too-deep", path, step, most=MOST_DEEP)
        kind = str(block.get("type"))
        if not kind.startswith(CONDITION):
            raise _refused("unknown-block", path, step, type=kind[:40])
        kind = kind.removeprefix(CONDITION)
        if kind == "person":
            return {kind: {}}
        if kind in ASKED:
            return _values(block, (ASKED[kind],), path)
        if kind == "counter":
            fields = _part(block, "fields", path)
            return {kind: fields.get("COUNTER"), str(fields.get("IS")): fields.get("VALUE")}
        if kind == "not":
            return {kind: self._condition(block, "OF", path, step, depth + 1)}
        if kind not in ("all", "any"):
            raise _refused("unknown-block", path, step, type=str(block.get("type"))[:40])
        parts = _part(block, "extraState", path).get("parts", PARTS)
        if parts not in range(1, MOST_IN_A_ROW):
            raise _refused("bad-blocks", path, step)
        return {kind: [self._condition(block, f"OF{number}", path, step, depth + 1) for number in range(parts)]}


def _values(block: Block, wanted: Sequence[BlockField], path: str) -> Document:
    """Return the values of a block's fields by their names in a step; those that the block lacks are left out."""
    fields = _part(block, "fields", path)
    values = {}
    for field in wanted:
        if field.capitals not in fields:
            continue
        value = fields[field.capitals]
        if field.is_menu:
            value = _chosen(value, _LEVELS)
        values[field.name] = value
    return values


def _ends(block: Block, path: str) -> str:
    """Return what ends the step of a block."""
    ends = _part(block, "fields", path).get("ENDS", BY_TIME)
    if ends not in ENDS:
        raise _refused("out-of-range", path, block, value=str(ends)[:40], allowed=", ".join(ENDS))
    return str(ends)


def _leader_accepts(block: Block, own: _Flags, path: str) -> Sequence[Diagnostic]:
    """Return the error of a leader's infrared block, with what would fix it."""
    fixes = []
    if "forward" in own:
        fixes.append(Fix("forward", "same"))
    if own.get("accept_ir") is not False:
        fixes.append(Fix("accept_ir", "no"))
    if len(fixes) > 1:
        # Where two values are wrong, one isn't enough.
        fixes.clear()
    return _refused("leader-accepts-ir", path, block, fixes).diagnostics


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


def _tops(workspace: Any, path: str) -> list[Block]:
    """Return the blocks of a workspace that hang below no other."""
    blocks = _object(_object(workspace, path).get("blocks"), path).get("blocks", [])
    if not isinstance(blocks, list):
        raise _refused("bad-blocks", path, _NOWHERE)
    return [block for block in blocks if isinstance(block, dict)]


def _hat(workspace: Any, kind: str, path: str) -> Block:
    """The workspace's hat; an empty block where there is none."""
    hats = [block for block in _tops(workspace, path) if block.get("type") == kind]
    if len(hats) > 1:
        raise _refused("second-hat", path, hats[1], [Fix(DELETE)])
    if not hats:
        return _NOWHERE
    return hats[0]


def _of_hat(hat: Block) -> dict[str, Any]:
    """The settings of the followers' hat, for JSON."""
    fields = _part(hat, "fields", "followers")
    settings = {name: _chosen(fields[name.upper()], _TICKS) for name in SETTINGS if name.upper() in fields}
    if "TAGGED" in fields:
        settings["tagged"] = _chosen(fields["TAGGED"], TAGGED)
    dwell = fields.get("DWELL", "auto")
    if dwell != "auto":
        settings["dwell_seconds"] = _number(dwell)
    return settings


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


def _inside(block: Block, path: str, name: str = "STEPS") -> Block | None:
    return _connected(_part(block, "inputs", path).get(name), path, block)


def _part(block: Block, name: str, path: str) -> dict[str, Any]:
    return _object(block.get(name), path, block)


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
    fields = _part(block, "fields", path)
    flags = {}
    for name in SETTINGS:
        choice = str(fields.get(name.upper(), "same"))
        if choice not in CHOICES:
            raise _refused("out-of-range", path, block, value=choice[:40], allowed=", ".join(CHOICES))
        flags[name] = CHOICES[choice]
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


def _refused(
    code: str, path: str, block: Mapping[str, Any], fixes: Sequence[Fix] = (), **arguments: Any
) -> ProgramError:
    block_id = block.get("id")
    if not isinstance(block_id, str):
        block_id = None
    problem = error(code, path, block_id, **arguments)
    return ProgramError([problem.with_fixes(*fixes)])
