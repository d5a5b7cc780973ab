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
    document["leader"] = reading.steps(_hat(leader, LEADER_HAT, "leader").below(), "leader", _Around())
    if functions := reading.functions(leader):
        document["functions"] = functions
    if followers is not None:
        hat = _hat(followers, FOLLOWERS_HAT, "followers")
        steps = reading.steps(hat.below(), "followers.steps", _Around(leads=False))
        document["followers"] = {**_of_hat(hat), "steps": steps}
    faults = reading.faults
    try:
        program = program_from_dict(document)
    except ProgramError as problem:
        faults.extend(problem.diagnostics)
    if faults:
        raise ProgramError(faults)
    return program


class _Placed(NamedTuple):
    """A block as a page has sent it, which may be anything, and the place in the program that errors name.

    Methods raise ProgramError for what is no object.
    """

    block: Block
    path: str

    @property
    def type(self) -> str:
        """Its type; that of a step is PREFIX and its `kind`."""
        return str(self.block.get("type"))

    @property
    def kind(self) -> str:
        return self.type.removeprefix(PREFIX)

    def at(self, path: str) -> "_Placed":
        return self._replace(path=path)

    def part(self, name: str) -> dict[str, Any]:
        """Return a part of it that must be an object; an empty one where it is absent."""
        return self.checked(self.block.get(name))

    def below(self) -> "_Placed | None":
        """Return the block below it."""
        return self._connected(self.block.get("next"))

    def inside(self, name: str = "STEPS") -> "_Placed | None":
        """Return the block in one of its inputs."""
        return self._connected(self.part("inputs").get(name))

    def _connected(self, connection: Any) -> "_Placed | None":
        block = self.checked(self.checked(connection).get("block"))
        return _Placed(block, self.path) if block else None

    def checked(self, value: Any) -> dict[str, Any]:
        """Return a value that must be an object; an empty one for None."""
        if value is None:
            return {}
        if not isinstance(value, dict):
            raise self.refused("bad-blocks")
        return value

    def refused(self, code: str, *fixes: Fix, **details: Any) -> ProgramError:
        """Return the error that names this block."""
        block_id = self.block.get("id")
        if not isinstance(block_id, str):
            block_id = None
        return ProgramError([error(code, self.path, block_id, **details).with_fixes(*fixes)])


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

    def _is_off(self, placed: _Placed) -> bool:
        """Whether a block is disabled."""
        block = placed.block
        is_disabled = block.get("enabled") is False or bool(block.get("disabledReasons"))
        return is_disabled or str(block.get("id")) in self._left_out

    def functions(self, workspace: Any) -> dict[str, list[Document]]:
        """Return the steps of the functions that a workspace defines, by their names."""
        found: dict[str, list[Document]] = {}
        for top in _tops(workspace, "leader"):
            if top.type != DEFINE or self._is_off(top):
                continue
            name = str(top.at("functions").part("fields").get("NAME"))
            block = top.at(f"functions.{name}")
            if name in found:
                self.faults += block.refused("second-function", Fix(DELETE), name=name).diagnostics
                continue
            found[name] = self.steps(block.inside(), block.path, _Around(depth=1))
        return found

    def steps(self, first: _Placed | None, path: str, around: _Around) -> list[Document]:
        """Return the steps of ``first`` and all blocks below it; ``path`` is their place in the program."""
        steps: list[Document] = []
        for block, flags, deep in self._row(first and first.at(path), {}, around):
            try:
                steps.append(self._step(block.at(f"{path}[{len(steps)}]"), flags, deep))
            except ProgramError as problem:
                self.faults += problem.diagnostics
        return steps

    def _row(self, first: _Placed | None, flags: _Flags, around: _Around) -> Iterator[tuple[_Placed, _Flags, _Around]]:
        """Yield each step's block, the settings of the infrared blocks around it, and what is around it."""
        for block in _chain(first):
            if around.depth > MOST_DEEP:
                raise block.refused("blocks-too-deep", most=MOST_DEEP)
            if self._is_off(block):
                continue
            kind = block.kind
            if around.inside == TogetherStep.kind and kind not in SIMPLE and (kind in _TYPES or kind == "infrared"):
                self.faults += block.refused("not-inside-together", Fix(BEHIND)).diagnostics
                continue
            if block.type != INFRARED:
                yield block, flags, around
                continue
            try:
                own = _own_flags(block)
            except ProgramError as problem:
                self.faults += problem.diagnostics
                continue
            if around.leads and own != {"accept_ir": False}:
                self.faults += _leader_accepts(block, own)
                own = {}
            yield from self._row(block.inside(), flags | own, around.deeper())

    def _step(self, block: _Placed, flags: _Flags, around: _Around) -> Document:
        kind = block.kind
        if kind not in _TYPES:
            raise block.refused("unknown-block", type=block.type[:40])
        if not around.leads and kind not in _FOLLOWER_TYPES:
            raise block.refused("followers-cannot-decide", Fix(DELETE))
        if around.inside == TellStep.kind and kind == RepeatStep.kind:
            raise block.refused("tell-one-step", Fix(BEHIND))
        document: Document = {**flags}
        if "id" in block.block:
            document["id"] = block.block["id"]
        if kind == TellStep.kind:
            return {**document, kind: {"step": self._told(block, around)}}
        if kind == IN_TURN:
            return {**document, TellStep.kind: {"step": IN_TURN}}
        if kind == DoStep.kind:
            return {**document, kind: block.part("fields").get("NAME")}
        if kind == WAIT_UNTIL:
            return {**document, WaitStep.kind: {}, "until": self._condition(block, "UNTIL", block, around.depth)}
        ends = _ends(block)
        if ends != BY_TIME and not around.inside:
            if not around.leads:
                raise block.refused("followers-cannot-decide")
            document["until"] = self._condition(block, "UNTIL", block, around.depth)
        if kind == TogetherStep.kind:
            parts = around.deeper()._replace(inside=kind, is_ended=ends == BY_CONDITION)
            document[kind] = self.steps(block.inside(), f"{block.path}.{kind}", parts)
            return document
        form = FORMS[kind]
        content = self._content(block, form, around)
        if ends == BY_CONDITION or around.is_ended:
            content.pop("seconds", None)
        return {**document, form.kind: content}

    def _content(self, block: _Placed, form: BlockForm, around: _Around) -> Document:
        """Return what a step has in its own object."""
        content: Document = {}
        # A step that accompanies others has no fields in a together: it lasts as long as the together.
        if not (around.inside == TogetherStep.kind and ALL_KINDS[form.kind].accompanies):
            content |= _values(block, form.fields)
        minded = block.inside(UNLESS)
        if minded and not self._is_off(minded) and issubclass(ALL_KINDS[form.kind], DrivingStep):
            content["unless"] = self._condition(block, UNLESS, block, around.depth)
        if form.condition:
            content[form.condition] = self._condition(block, form.condition.upper(), block, around.depth)
        for capitals, name in form.rows:
            place = f"{block.path}.{form.kind}.{name}"
            content[name] = self.steps(block.inside(capitals), place, around.deeper())
        return content

    def _told(self, block: _Placed, around: _Around) -> Any:
        """Return the one step that a tell holds, for a follower."""
        inner = around.deeper()._replace(leads=False, inside=TellStep.kind)
        found = list(self._row(block.inside(), {}, inner))
        if not found:
            raise block.refused("tell-one-step")
        if len(found) > 1:
            raise found[1][0].refused("tell-one-step", Fix(BEHIND))
        told, flags, deep = found[0]
        return self._step(told.at(f"{block.path}.{TellStep.kind}.step"), flags, deep)

    def _condition(self, holder: _Placed, name: str, step: _Placed, depth: int) -> Document:
        """Return the condition in an input of ``holder``. The block of the ``step`` is at fault where there is none."""
        block = holder.inside(name)
        if block is None or self._is_off(block):
            raise step.refused("missing-condition")
        if depth > MOST_DEEP:
            raise step.refused("blocks-too-deep", most=MOST_DEEP)
        kind = block.type
        if not kind.startswith(CONDITION):
            raise step.refused("unknown-block", type=kind[:40])
        kind = kind.removeprefix(CONDITION)
        if kind == "person":
            return {kind: {}}
        if kind in ASKED:
            return _values(block, (ASKED[kind],))
        if kind == "counter":
            fields = block.part("fields")
            return {kind: fields.get("COUNTER"), str(fields.get("IS")): fields.get("VALUE")}
        if kind == "not":
            return {kind: self._condition(block, "OF", step, depth + 1)}
        if kind not in ("all", "any"):
            raise step.refused("unknown-block", type=block.type[:40])
        parts = block.part("extraState").get("parts", PARTS)
        if parts not in range(1, MOST_IN_A_ROW):
            raise step.refused("bad-blocks")
        return {kind: [self._condition(block, f"OF{number}", step, depth + 1) for number in range(parts)]}


def _values(block: _Placed, wanted: Sequence[BlockField]) -> Document:
    """Return the values of a block's fields by their names in a step; those that the block lacks are left out."""
    fields = block.part("fields")
    values = {}
    for field in wanted:
        if field.capitals not in fields:
            continue
        value = fields[field.capitals]
        if field.is_menu:
            value = _chosen(value, _LEVELS)
        values[field.name] = value
    return values


def _ends(block: _Placed) -> str:
    """Return what ends the step of a block."""
    ends = block.part("fields").get("ENDS", BY_TIME)
    if ends not in ENDS:
        raise block.refused("out-of-range", value=str(ends)[:40], allowed=", ".join(ENDS))
    return str(ends)


def _leader_accepts(block: _Placed, own: _Flags) -> Sequence[Diagnostic]:
    """Return the error of a leader's infrared block, with what would fix it."""
    fixes = []
    if "forward" in own:
        fixes.append(Fix("forward", "same"))
    if own.get("accept_ir") is not False:
        fixes.append(Fix("accept_ir", "no"))
    if len(fixes) > 1:
        # Where two values are wrong, one isn't enough.
        fixes.clear()
    return block.refused("leader-accepts-ir", *fixes).diagnostics


def holder_of(workspace: Workspace, block_id: str | None, name: str) -> Block:
    """Return the block whose setting ``name`` holds for a block below the followers' hat.

    That is the innermost infrared block around it that changes the setting, else the hat.
    """
    hat = _hat(workspace, FOLLOWERS_HAT, "followers")

    def find(first: _Placed | None, holder: _Placed) -> _Placed | None:
        for block in _chain(first):
            if block.block.get("id") == block_id:
                return holder
            inner = holder
            if block.type == INFRARED and name in _own_flags(block):
                inner = block
            if found := find(block.inside(), inner):
                return found
        return None

    return (find(hat.below(), hat) or hat).block


def _tops(workspace: Any, path: str) -> list[_Placed]:
    """Return the blocks of a workspace that hang below no other."""
    nowhere = _Placed({}, path)
    blocks = nowhere.checked(nowhere.checked(workspace).get("blocks")).get("blocks", [])
    if not isinstance(blocks, list):
        raise nowhere.refused("bad-blocks")
    return [_Placed(block, path) for block in blocks if isinstance(block, dict)]


def _hat(workspace: Any, kind: str, path: str) -> _Placed:
    """The workspace's hat; an empty block where there is none."""
    hats = [block for block in _tops(workspace, path) if block.type == kind]
    if len(hats) > 1:
        raise hats[1].refused("second-hat", Fix(DELETE))
    return hats[0] if hats else _Placed({}, path)


def _of_hat(hat: _Placed) -> dict[str, Any]:
    """The settings of the followers' hat, for JSON."""
    fields = hat.part("fields")
    settings = {name: _chosen(fields[name.upper()], _TICKS) for name in SETTINGS if name.upper() in fields}
    if "TAGGED" in fields:
        settings["tagged"] = _chosen(fields["TAGGED"], TAGGED)
    dwell = fields.get("DWELL", "auto")
    if dwell != "auto":
        settings["dwell_seconds"] = _number(dwell)
    return settings


def _chain(block: _Placed | None) -> Iterator[_Placed]:
    """Yield the block and those below it."""
    for _ in range(MOST_IN_A_ROW):
        if block is None:
            return
        yield block
        block = block.below()
    if block is not None:
        raise block.refused("too-many-in-a-row", most=MOST_IN_A_ROW)


def _own_flags(block: _Placed) -> _Flags:
    """Return the settings of an infrared block, without those that it does not change."""
    fields = block.part("fields")
    flags = {}
    for name in SETTINGS:
        choice = str(fields.get(name.upper(), "same"))
        if choice not in CHOICES:
            raise block.refused("out-of-range", value=choice[:40], allowed=", ".join(CHOICES))
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
