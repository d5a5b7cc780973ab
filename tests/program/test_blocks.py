"""Blocks and programs say the same; what blocks can't say is a sentence about the block at fault."""

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade import Followers, Program, ProgramError, compile_program
from motorcade import forward as drive
from motorcade.locales import languages
from motorcade.program.blocks import MOST_DEEP, MOST_IN_A_ROW, blocks_of
from motorcade.program.blocks_reader import program_of
from motorcade.program.conditions import All, AnyOf, Not, chance, counter, dark, heard, obstacle, person
from motorcade.program.flow_steps import (
    FlowStep,
    change_counter,
    do,
    forever,
    if_,
    random,
    repeat_until,
    set_counter,
    tell,
)
from motorcade.program.steps import led, left, pir, repeat, together, voice, wait
from support.deciding import deciding_programs
from support.strategies import JSON, programs

DRIVE = {"type": "motorcade_drive", "fields": {"DIRECTION": "forward", "SPEED": "2", "SECONDS": 3}}
WAIT = {"type": "motorcade_wait", "id": "w", "fields": {"SECONDS": 1}}


def row(*blocks):
    """The first of the blocks, the others hanging below it."""
    first = None
    for block in reversed(blocks):
        first = {**block, "next": {"block": first}} if first else block
    return first


def holding(kind, *blocks, **more):
    inputs = {"STEPS": {"block": row(*blocks)}} if blocks else {}
    return {"type": f"motorcade_{kind}", "inputs": inputs, **more}


def workspace(*blocks, kind="leader", loose=(), **hat):
    hat = {"type": f"motorcade_{kind}", "id": "hat", **hat}
    return {"blocks": {"languageVersion": 0, "blocks": [row(hat, *blocks), *loose]}}


def followers(*blocks, **hat):
    return workspace(*blocks, kind="followers", **hat)


def infrared(*blocks, accept_ir="same", forward="same", block_id="ir"):
    return holding("infrared", *blocks, id=block_id, fields={"ACCEPT_IR": accept_ir, "FORWARD": forward})


def diagnostic(leader, told=None):
    """The one thing that there is to say about these blocks, which can be said in every language."""
    with pytest.raises(ProgramError) as refused:
        program_of(leader, told)
    (only,) = refused.value.diagnostics
    assert all(only.sentence(language) for language in languages())
    return only


@given(programs())
def test_a_program_is_the_same_after_it_was_blocks(program):
    leader, told = json.loads(json.dumps(blocks_of(program)))
    assert program_of(leader, told, program.profile) == program


@given(deciding_programs())
def test_a_program_of_a_leader_that_decides_is_the_same_after_it_was_blocks(program):
    leader, told = json.loads(json.dumps(blocks_of(program)))
    assert program_of(leader, told, program.profile) == program


@pytest.mark.parametrize(
    ("block", "step"),
    [
        (DRIVE, drive(3)),
        (WAIT, wait(1, id="w")),
        ({"type": "motorcade_led", "id": "x", "fields": {"WHICH": "3", "SECONDS": 0.4}}, led(3, 0.4, id="x")),
        ({"type": "motorcade_voice", "fields": {"SECONDS": 2}}, voice(2)),
        (holding("together", DRIVE, {"type": "motorcade_pir", "fields": {"SECONDS": 9}}), together(drive(3), pir())),
        (holding("together", id="t"), together(id="t")),
        (holding("repeat", WAIT, DRIVE, fields={"TIMES": 7}), repeat(7, wait(1, id="w"), drive(3))),
        (infrared(DRIVE, accept_ir="no"), drive(3, accept_ir=False)),
    ],
)
def test_a_block_is_a_step(block, step):
    assert program_of(workspace(block)).leader == (step,)


def when(kind, inputs=None, parts=None, **fields):
    """The block of a condition."""
    block = {"type": f"motorcade_when_{kind}", "fields": fields}
    if inputs:
        block["inputs"] = {name: {"block": inner} for name, inner in inputs.items()}
    if parts is not None:
        block["extraState"] = {"parts": parts}
    return block


PERSON = when("person")
NEAR = when("obstacle", LEVEL="2")


def asking(kind, asked, rows=None, **fields):
    """A block with a condition in its gap, and rows of blocks."""
    name = "WHEN" if kind.startswith("if") else "UNTIL"
    inputs = {name: {"block": asked}} if asked else {}
    for capitals, blocks in (rows or {}).items():
        inputs[capitals] = {"block": row(*blocks)}
    return {"type": f"motorcade_{kind}", "id": kind, "fields": fields, "inputs": inputs}


@pytest.mark.parametrize(
    ("block", "step"),
    [
        (asking("wait_until", PERSON), wait(until=person())),
        (asking("wait", PERSON, SECONDS=2, ENDS="until"), wait(until=person())),
        (asking("wait", PERSON, SECONDS=2, ENDS="both"), wait(2, until=person())),
        (asking("wait", PERSON, SECONDS=2), wait(2)),
        (asking("led", NEAR, WHICH="1", SECONDS=3, ENDS="until"), led(1, until=obstacle(2))),
        (asking("if", PERSON, {"THEN": [WAIT]}), if_(person(), [wait(1, id="w")])),
        (
            asking("if_else", NEAR, {"THEN": [WAIT], "ELSE": [DRIVE, DRIVE]}),
            if_(obstacle(2), [wait(1, id="w")], [drive(3), drive(3)]),
        ),
        (asking("repeat_until", PERSON, {"STEPS": [DRIVE]}), repeat_until(person(), drive(3))),
        (holding("forever", DRIVE), forever(drive(3))),
        ({"type": "motorcade_set", "fields": {"COUNTER": "laps", "TO": 3}}, set_counter("laps", 3)),
        ({"type": "motorcade_set_random", "fields": {"COUNTER": "圈数", "RANDOM": 6}}, set_counter("圈数", random(6))),
        ({"type": "motorcade_change", "fields": {"COUNTER": "laps", "BY": -1}}, change_counter("laps", -1)),
        (holding("tell", WAIT), tell(wait(1, id="w"))),
        (holding("tell", holding("together", DRIVE)), tell(together(drive(3)))),
        (holding("tell", infrared(DRIVE, forward="yes")), tell(drive(3, forward=True))),
        ({"type": "motorcade_in_turn"}, tell()),
        ({"type": "motorcade_do", "fields": {"NAME": "dance"}}, do("dance")),
        ({"type": "motorcade_flow", "fields": {"OP": "jump", "TARGET": 2}}, FlowStep("jump", 2)),
    ],
)
def test_a_block_of_a_leader_that_decides_is_a_step(block, step):
    (made,) = program_of(workspace(block)).leader
    assert replace(made, id=None) == step


@pytest.mark.parametrize(
    ("block", "condition"),
    [
        (NEAR, obstacle(2)),
        (when("voice", COMMAND="go"), heard("go")),
        (when("floor", WHERE="both"), dark("both")),
        (when("chance", PERCENT=20), chance(20)),
        (when("counter", COUNTER="laps", IS="above", VALUE=3), counter("laps", "above", 3)),
        (when("not", {"OF": PERSON}), Not(person())),
        (when("all", {"OF0": PERSON, "OF1": NEAR}), All((person(), obstacle(2)))),
        (when("any", {"OF0": PERSON, "OF1": NEAR, "OF2": NEAR}, 3), AnyOf((person(), obstacle(2), obstacle(2)))),
        (when("any", {"OF0": PERSON}, 1), AnyOf((person(),))),
    ],
)
def test_a_pointed_block_is_a_condition(block, condition):
    (step,) = program_of(workspace(asking("if", block))).leader
    assert step.when == condition


def test_where_only_a_condition_ends_a_together_its_parts_have_no_time():
    parts = [DRIVE, {"type": "motorcade_pir", "fields": {"SECONDS": 1}}]
    block = asking("together", PERSON, {"STEPS": parts}, ENDS="until")
    (step,) = program_of(workspace(block)).leader
    assert step == together(drive(), pir(), until=person(), id="together")
    timed = asking(
        "together", PERSON, {"STEPS": [DRIVE, {**DRIVE, "type": "motorcade_led", "fields": LED}]}, ENDS="both"
    )
    (step,) = program_of(workspace(timed)).leader
    assert step == together(drive(3), led(1), until=person(), id="together")
    for made in (step, together(drive(), led(1), until=person())):
        leader, _ = blocks_of(Program([made]))
        assert program_of(leader).leader == (made,)


# A part that the together's condition alone ends, beside one with a time.
LED = {"WHICH": "1", "SECONDS": 1, "ENDS": "until"}


def test_blocks_that_define_are_functions():
    dance = holding("define", DRIVE, fields={"NAME": "dance"}, id="d")
    program = program_of(workspace({"type": "motorcade_do", "fields": {"NAME": "dance"}}, loose=[dance]))
    assert program.functions == {"dance": (drive(3),)}
    assert program.leader == (do("dance"),)
    hat, defined = blocks_of(program)[0]["blocks"]["blocks"]
    assert defined["y"] > hat["y"]
    twice = diagnostic(workspace(loose=[dance, {**dance, "id": "second"}]))
    assert (twice.code, twice.id, [fix.field for fix in twice.fixes]) == ("second-function", "second", ["delete"])
    assert program_of(workspace(loose=[{**dance, "enabled": False}])).functions == {}


@pytest.mark.parametrize(
    ("block", "code", "at"),
    [
        (asking("if", None), "missing-condition", "if"),
        (asking("if", {**PERSON, "enabled": False}), "missing-condition", "if"),
        (asking("wait_until", when("not")), "missing-condition", "wait_until"),
        (asking("if", when("all", {"OF0": PERSON})), "missing-condition", "if"),
        (asking("if", WAIT), "unknown-block", "if"),
        (asking("if", {"type": "motorcade_when_weekend"}), "unknown-block", "if"),
        (asking("if", when("all", {"OF0": PERSON}, "many")), "bad-blocks", "if"),
        (asking("if", when("obstacle", LEVEL="9")), "out-of-range", "if"),
        (asking("wait", PERSON, SECONDS=1, ENDS="never"), "out-of-range", "wait"),
        (holding("tell", id="t"), "tell-one-step", "t"),
        (holding("tell", DRIVE, WAIT), "tell-one-step", "w"),
        (holding("tell", holding("repeat", DRIVE, fields={"TIMES": 2}, id="r")), "tell-one-step", "r"),
        (holding("tell", asking("if", PERSON)), "followers-cannot-decide", "if"),
        (holding("together", asking("if", PERSON)), "not-inside-together", "if"),
        (holding("together", holding("tell", DRIVE, id="t")), "not-inside-together", "t"),
    ],
)
def test_what_a_leaders_block_cannot_say_is_said_about_that_block(block, code, at):
    said = diagnostic(workspace(block))
    assert (said.code, said.id) == (code, at)


@pytest.mark.parametrize("block", [asking("if", PERSON), asking("wait", PERSON, SECONDS=1, ENDS="both")])
def test_followers_do_not_decide(block):
    said = diagnostic(workspace(), followers(block))
    assert (said.code, said.id) == ("followers-cannot-decide", block["id"])


def test_conditions_may_stand_in_each_other_but_not_for_ever():
    asked = PERSON
    for _ in range(MOST_DEEP):
        asked = when("not", {"OF": asked})
    program = program_of(workspace(asking("if", asked)))
    assert program_of(blocks_of(program)[0]) == program
    deeper = when("not", {"OF": asked})
    assert diagnostic(workspace(asking("if", deeper))).code == "blocks-too-deep"


def test_a_hat_of_the_followers_says_what_holds_for_all_of_them():
    told = followers(WAIT, fields={"ACCEPT_IR": "FALSE", "FORWARD": True, "DWELL": "2"})
    assert program_of(workspace(), told).followers == Followers([wait(1, id="w")], False, True, 2)
    assert program_of(workspace(), followers(fields={"DWELL": "auto"})).followers == Followers([])
    for choice, tagged in {"auto": "auto", "yes": True, "no": False}.items():
        assert program_of(workspace(), followers(fields={"TAGGED": choice})).followers == Followers([], tagged=tagged)
    assert program_of(workspace()).followers is None


def test_of_infrared_blocks_in_each_other_the_inner_one_wins():
    inner = infrared(DRIVE, accept_ir="yes")
    told = followers(
        infrared(WAIT, inner, holding("repeat", DRIVE, fields={"TIMES": 2}), accept_ir="no", forward="yes")
    )
    flags = [(step.accept_ir, step.forward) for step in program_of(workspace(), told).followers.steps]
    assert flags == [(False, True), (True, True), (False, True)]
    # The repeat's own steps take what holds for the repeat.
    assert program_of(workspace(), told).followers.steps[2].steps == (drive(3),)


@pytest.mark.parametrize("off", [{"enabled": False}, {"disabledReasons": ["MANUALLY_DISABLED"]}])
def test_loose_and_disabled_blocks_say_nothing(off):
    blocks = workspace(WAIT, {**DRIVE, **off}, WAIT, loose=[DRIVE, {"type": "nonsense"}])
    assert program_of(blocks).leader == (wait(1, id="w"), wait(1, id="w"))


@pytest.mark.parametrize("nothing", [{}, {"blocks": {}}, {"blocks": {"blocks": []}}, workspace()])
def test_an_editor_without_steps_is_a_program_without_steps(nothing):
    assert program_of(nothing) == Program([])


@pytest.mark.parametrize(("accept_ir", "forward"), [("yes", "same"), ("no", "yes"), ("same", "no"), ("same", "same")])
def test_a_leader_with_infrared_settings_gets_the_seeds_prompt_on_that_block(accept_ir, forward):
    block = holding("repeat", infrared(DRIVE, accept_ir=accept_ir, forward=forward))
    blocks = workspace(WAIT, {**block, "fields": {"TIMES": 2}})
    said = diagnostic(blocks)
    assert (said.code, said.id) == ("leader-accepts-ir", "ir")
    assert "无法设置头车接受红外信息" in said.sentence("zh")


@pytest.mark.parametrize(
    ("block", "code", "path"),
    [
        ({"type": "math_number", "id": "b"}, "unknown-block", "leader[1]"),
        ({"id": "b"}, "unknown-block", "leader[1]"),
        ({"type": "motorcade_leader", "id": "b"}, "unknown-block", "leader[1]"),
        ({"type": "motorcade_wait", "id": "b"}, "missing-field", "leader[1].wait"),
        ({**WAIT, "id": "b", "fields": {"SECONDS": -1}}, "out-of-range", "leader[1].wait.seconds"),
        ({"type": "motorcade_led", "id": "b", "fields": {"WHICH": "4", "SECONDS": 1}}, "out-of-range", None),
        (holding("repeat", id="b", fields={"TIMES": 0}), "out-of-range", "leader[1].repeat.times"),
        (holding("together", holding("repeat", id="b", fields={"TIMES": 1})), "not-inside-together", None),
        (holding("together", holding("together", id="b")), "not-inside-together", None),
        (holding("together", infrared(DRIVE, block_id="b")), "not-inside-together", "leader[1].together"),
        (holding("infrared", DRIVE, id="b", fields={"FORWARD": []}), "out-of-range", "leader"),
        ({**WAIT, "id": "b", "fields": 3}, "bad-blocks", "leader[1]"),
        ({**WAIT, "id": "b", "next": {"block": "w"}}, "bad-blocks", "leader"),
        ({"type": "motorcade_repeat", "id": "b", "inputs": {"STEPS": [WAIT]}}, "bad-blocks", "leader[1]"),
    ],
)
def test_what_a_block_cannot_say_is_said_about_that_block(block, code, path):
    said = diagnostic(workspace(WAIT, block))
    assert (said.code, said.id) == (code, "b")
    assert path is None or said.path == path


@pytest.mark.parametrize(
    ("fields", "path"),
    [
        ({"ACCEPT_IR": "maybe"}, "followers.accept_ir"),
        ({"FORWARD": 1}, "followers.forward"),
        ({"TAGGED": "maybe"}, "followers.tagged"),
        ({"DWELL": "long"}, "followers.dwell_seconds"),
        ({"DWELL": "inf"}, "followers.dwell_seconds"),
        ({"DWELL": None}, "followers.dwell_seconds"),
    ],
)
def test_what_the_hat_cannot_say(fields, path):
    said = diagnostic(workspace(), followers(fields=fields))
    assert (said.code, said.path) == ("out-of-range", path)


@pytest.mark.parametrize("garbage", [3, "x", [], {"blocks": 3}, {"blocks": {"blocks": {}}}])
def test_no_workspace_at_all(garbage):
    assert diagnostic(garbage).code == "bad-blocks"
    assert diagnostic({}, garbage).code == "bad-blocks"


def test_as_many_blocks_in_a_row_as_a_car_could_hold_and_more():
    assert len(program_of(workspace(*[WAIT] * MOST_IN_A_ROW)).leader) == MOST_IN_A_ROW
    said = diagnostic(workspace(*[WAIT] * MOST_IN_A_ROW, {**WAIT, "id": "first too many"}))
    assert (said.code, said.id) == ("too-many-in-a-row", "first too many")
    assert blocks_of(Program([wait(1)] * MOST_IN_A_ROW))
    with pytest.raises(ProgramError, match="Use a repeat block"):
        blocks_of(Program([wait(1)] * (MOST_IN_A_ROW + 1)))


@pytest.mark.parametrize("kind", ["repeat", "infrared"])
def test_blocks_may_stand_in_each_other_but_not_for_ever(kind):
    fields = {"TIMES": 1} if kind == "repeat" else {"ACCEPT_IR": "no"}
    block = {**WAIT, "id": "innermost"}
    for _ in range(MOST_DEEP):
        block = holding(kind, block, fields=fields)
    assert blocks_of(program_of(workspace(block)))
    assert diagnostic(workspace(holding(kind, block, fields=fields))).code == "blocks-too-deep"


def test_a_program_too_deep_for_blocks_says_so():
    step = wait(1)
    for _ in range(MOST_DEEP + 1):
        step = repeat(1, step)
    with pytest.raises(ProgramError, match="Take some of them out"):
        blocks_of(Program([step]))


@given(st.data())
def test_damaged_blocks_never_do_worse_than_a_sentence(data):
    leader, told = blocks_of(data.draw(programs()))
    place = leader if data.draw(st.booleans()) or told is None else told
    for _ in range(data.draw(st.integers(0, 20))):
        inner = list(place.values()) if isinstance(place, dict) else place
        deeper = [each for each in inner if isinstance(each, dict | list) and each]
        if not deeper:
            break
        place = data.draw(st.sampled_from(deeper))
    key = data.draw(st.sampled_from(list(place) if isinstance(place, dict) else range(len(place))))
    place[key] = data.draw(JSON)
    try:
        diagnostics = compile_program(program_of(leader, told)).diagnostics
    except ProgramError as refused:
        diagnostics = refused.diagnostics
    assert all(each.sentence(language) for each in diagnostics for language in languages())


def test_steps_with_the_same_settings_share_an_infrared_block():
    deaf = [replace(step, accept_ir=False) for step in (drive(1), left(1))]
    _, told = blocks_of(Program([], Followers([*deaf, wait(1)])))
    hat = told["blocks"]["blocks"][0]
    shared = hat["next"]["block"]
    assert shared["fields"] == {"ACCEPT_IR": "no", "FORWARD": "same"}
    assert shared["inputs"]["STEPS"]["block"]["next"]["block"]["type"] == "motorcade_drive"
    assert shared["next"]["block"]["type"] == "motorcade_wait"
    assert isinstance(hat["x"], int)
    assert isinstance(hat["y"], int)
