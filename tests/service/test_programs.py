"""What the page is told of mistakes, and the Python text beside the blocks."""

import json
from copy import deepcopy
from itertools import count

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade import Followers, forward, led, repeat, together, wait
from motorcade.locales import languages
from motorcade.program.blocks import FOLLOWERS_HAT, LEADER_HAT
from motorcade.program.compiler import compile_program
from motorcade.service import programs
from motorcade.service.requests import Context, respond
from support.studio_programs import block_in, blocks


def ask(name, message):
    """The answer to a request that needs nothing of the shell."""
    return json.loads(respond(name, json.dumps(message).encode(), Context(None, None, list)))


def bad_block(answer):
    """The one diagnostic of an answer."""
    (diagnostic,) = answer["diagnostics"]
    return diagnostic


def test_a_wrong_block_has_values_that_would_fix_it():
    found = bad_block(ask("compile", blocks([wait(1, id="w"), forward(1.5, id="f")])))
    assert (found["code"], found["block"]) == ("duration-not-expressible", "f")
    assert [(each["field"], each["value"]) for each in found["fixes"]] == [("SECONDS", 1.0), ("SECONDS", 2.0)]
    assert found["fixes"][0]["sentence"] == {"en": "make it 1 s", "zh": "改成 1 秒"}


def with_fix(sent, diagnostic, fix):
    """The message after the page has set the value of a fix."""
    sent = deepcopy(sent)
    block = block_in(sent[diagnostic["editor"]], fix.get("block") or diagnostic["block"] or FOLLOWERS_HAT)
    assert fix["field"] in block["fields"]
    block["fields"][fix["field"]] = fix["value"]
    return sent


def with_ids(sent):
    """The message with an id for each block, as the page gives them."""
    unused = (f"i{number}" for number in count())

    def give(state):
        parts = state.values() if isinstance(state, dict) else state if isinstance(state, list) else ()
        if isinstance(state, dict) and "type" in state:
            state.setdefault("id", next(unused))
        for part in parts:
            give(part)

    give(sent)
    return sent


@st.composite
def followers_programs(draw):
    """Followers with a mistake in a setting or in a time."""
    flags = st.sampled_from([None, False, True])
    steps = [
        draw(st.sampled_from([forward, wait]))(
            draw(st.sampled_from([0, 0.5, 1, 2, 3, 3.3, 6, 300, 1000])), accept_ir=draw(flags), forward=draw(flags)
        )
        for _ in range(draw(st.integers(1, 3)))
    ]
    steps = draw(st.sampled_from([steps, [repeat(draw(st.sampled_from([2, 200])), *steps)]]))
    dwell = draw(st.sampled_from([None, 0.5, 1, 2, 7]))
    return Followers(
        steps, draw(st.booleans()), draw(st.booleans()), dwell, draw(st.sampled_from(["auto", True, False]))
    )


# Each example compiles a program as often as its mistakes have fixes.
@settings(max_examples=max(settings().max_examples // 2, 1))
@given(st.floats(0.001, 2000), st.integers(1, 8), st.sampled_from([1, 3, 260]), followers_programs())
def test_a_fix_mends(seconds, steps, times, followers):
    leader = [*[wait(1)] * steps, repeat(times, wait(1)), forward(seconds, id="f")]
    sent = with_ids(blocks(leader, followers))
    found = ask("compile", sent)["diagnostics"]
    for each in found:
        for fix in each.get("fixes", []):
            left = ask("compile", with_fix(sent, each, fix))["diagnostics"]
            assert (each["code"], each["block"]) not in [(other["code"], other["block"]) for other in left]
            # What fixes a warning makes no error.
            new = {other["code"] for other in left if other["severity"] == "error"} - {one["code"] for one in found}
            assert each["severity"] == "error" or not new


def test_the_other_blocks_keep_their_words():
    good = ask("compile", blocks([wait(1, id="w"), led(0, 1, id="l")], [wait(2, id="f")]))
    answer = ask("compile", blocks([wait(1, id="w"), forward(0.5, id="x"), led(0, 1, id="l")], [wait(2, id="f")]))
    assert answer["words"] == good["words"]
    assert (answer["left_out"], answer["image"]) == (["x"], None)
    assert bad_block(answer)["block"] == "x"


def test_the_same_mistake_is_told_of_each_block_also_of_blocks_without_ids():
    found = ask("compile", blocks([forward(0.5), forward(0.5)]))["diagnostics"]
    assert [each["path"] for each in found] == ["leader[0]", "leader[1]"]


def test_blocks_that_make_no_program_are_left_out_too():
    sent = blocks([wait(1, id="w"), led(0, 1, id="l"), wait(2, id="z")])
    middle = sent["leader"]["blocks"]["blocks"][0]["next"]["block"]["next"]["block"]
    middle["type"] = "motorcade_infrared"
    answer = ask("compile", sent)
    assert [word["block"] for word in answer["words"]] == [None, "w", "z"]
    assert answer["left_out"] == ["l"]


# The Python text.


def test_the_text_of_blocks_and_the_blocks_of_a_text():
    sent = blocks([wait(1, id="w"), repeat(2, together(forward(1, id="f"), led(0, 1, id="l"), id="t"), id="r")], [])
    answer = ask("blocks-to-python", sent)
    lines = answer["text"].splitlines()
    stands = {
        each["block"]: lines[each["line"] - 1][each["column"] - 1 : each["end_column"] - 1] for each in answer["places"]
    }
    assert stands == {
        "w": "wait(1)",
        "r": "repeat(2, together(forward(1), led(0, 1)))",
        "t": "together(forward(1), led(0, 1))",
        "f": "forward(1)",
        "l": "led(0, 1)",
    }
    back = ask("python-to-blocks", {**sent, "text": answer["text"]})
    assert back == {key: sent[key] for key in ("leader", "followers", "profile")} | {"diagnostics": []}


def test_an_edit_of_the_text_keeps_the_other_blocks():
    sent = blocks([wait(1, id="w"), forward(3, id="f"), led(0, 1, id="l")])
    text = ask("blocks-to-python", sent)["text"].replace("wait(1),", "# none\n").replace("led(0, 1)", "led(2, 1)")
    changed = ask("python-to-blocks", {**sent, "text": text})
    assert changed["leader"] == blocks([forward(3, id="f"), led(2, 1, id="l")])["leader"]
    again = ask("blocks-to-python", {**sent, "leader": changed["leader"], "text": text})
    assert again["text"] == text


def test_a_text_with_a_mistake_makes_no_blocks_and_is_not_touched():
    sent = {**blocks([wait(1, id="w")]), "text": "from motorcade import *\nprogram = Program([forwad(1)])"}
    for name in ("python-to-blocks", "blocks-to-python"):
        found = bad_block(answer := ask(name, sent))
        assert found["place"] == {"line": 2, "column": 20, "end_line": 2, "end_column": 26}
        assert [(each["field"], each["value"]) for each in found["fixes"]] == [("TEXT", "forward")]
        assert answer.get("leader") is None
        assert answer.get("text", sent["text"]) == sent["text"]
    unknown = bad_block(ask("python-to-blocks", {**sent, "text": "program = Program([], profile='nix')"}))
    assert (unknown["code"], unknown["place"]["line"]) == ("bad-profile", 1)


_IMPORT = "from motorcade import Program, forward"


@pytest.mark.parametrize(
    ("program", "fixed"),
    [
        ("Program([forward(3, speed=9)])", "Program([forward(3, speed=3)])"),
        ("Program([led(7, 1)])", "Program([led(3, 1)])"),
        ("Program([repeat(0, forward(1))])", "Program([repeat(1, forward(1))])"),
        ("Program([forward(-1)])", "Program([forward(0)])"),
        ("Program([forward(1)], profile='clasroom')", 'Program([forward(1)], profile="classroom")'),
        ("Program([wait(1)], Followers([led(0, 1)], dwell_seconds=0))", "dwell_seconds=None))"),
        ("Program([forward(1, sped=2)])", "Program([forward(1, speed=2)])"),
        ("Program([forward(1, zzz=2)])", "Program([forward(1)])"),
        ("Program([forward()])", "Program([forward(seconds=1)])"),
        ("Program([forward(None)])", "Program([forward(1)])"),
        ("Program([led(2)])", "Program([led(2, seconds=1)])"),
        ("Program([repeat(forward(1))])", "Program([repeat(forward(1), times=2)])"),
        ("Program()", "Program(leader=[])"),
        ("Program([wait(1)], Followers())", "Program([wait(1)], Followers(steps=[]))"),
        ("Program([forward('3')])", "Program([forward(3)])"),
        ("Program([led(1.4, 1)])", "Program([led(1, 1)])"),
        ("Program([wait(1)], Followers([led(0, 1)], tagged='atuo'))", 'tagged="auto"))'),
        ("Program([wait(1)], Followers([led(0, 1)], forward='true'))", "forward=True))"),
        ("Program([wait(1)], Followers([led(0, 1)], forward=1))", "forward=True))"),
        ("Program([forward(1, seconds=2)])", "Program([forward(1)])"),
        ("Program([forward(1, 2, 3)])", "Program([forward(1, 2)])"),
        ("Program([motorcade.forward(1)])", "Program([forward(1)])"),
        ("Program([forward])", "Program([forward(1)])"),
        ("Program([led])", "Program([led(0, 1)])"),
        ("Program(forward(1))", "Program([forward(1)])"),
        ("Program([wait(1)], led(0, 1))", "Program([wait(1)], [led(0, 1)])"),
        # What Python itself doesn't read.
        ("Program([forward（1)])", "Program([forward(1)])"),
        ("Program([forward(1)，wait(1)])", "Program([forward(1),wait(1)])"),
        ("Program([forward(1) wait(1)])", "Program([forward(1), wait(1)])"),
        ("Program([forward(1])", "Program([forward(1)])"),
        ("Program([forward(1)]))", "Program([forward(1)])"),
        ("Program([forward(1)]", "Program([forward(1)])"),
    ],
)
def test_a_value_that_would_fix_a_text_is_written_in_its_place(program, fixed):
    head = "from motorcade import Followers, Program, forward, led, repeat, wait\nprogram = "
    assert with_the_fix(head + program).endswith(fixed)


@pytest.mark.parametrize(
    ("text", "fixed"),
    [
        ("program = Program([])", "from motorcade import Program\n\nprogram = Program([])"),
        ('"""Mine."""\nprogram = Program([])', '"""Mine."""\nfrom motorcade import Program\n\nprogram = Program([])'),
        (f"{_IMPORT}\nprogram = Program([wait(1)])", f"{_IMPORT}, wait\nprogram = Program([wait(1)])"),
        (f"import time\n{_IMPORT}\nprogram = Program([])", f"{_IMPORT}\nprogram = Program([])"),
        ("from motorcad import Program\nprogram = Program([])", "from motorcade import Program\nprogram = Program([])"),
        ("import motorcade\nprogram = Program([])", "from motorcade import *\nprogram = Program([])"),
        (f"{_IMPORT}\nmine = Program([])", f"{_IMPORT}\nprogram = Program([])"),
        (f"{_IMPORT}\nProgram([])", f"{_IMPORT}\nprogram = Program([])"),
        (f"{_IMPORT}\nprogram = Program([])\nprogram = Program([])", f"{_IMPORT}\nprogram = Program([])\n"),
    ],
)
def test_a_line_that_is_missing_or_too_much_is_fixed(text, fixed):
    assert with_the_fix(text) == fixed


def diagnostics_of(text):
    return ask("python-to-blocks", {"leader": {}, "text": text})["diagnostics"]


def with_the_fix(text):
    """The text with the one fix of its one mistake, after which nothing is wrong."""
    (found,) = diagnostics_of(text)
    (fix,) = found["fixes"]
    assert (fix["field"], set(fix["sentence"])) == ("TEXT", set(languages()))
    fixed = fixed_text(text, found, fix)
    assert diagnostics_of(fixed) == []
    return fixed


@pytest.mark.parametrize(
    ("text", "said", "fixed"),
    [
        (
            "laps = 0\nwhile True:\n    laps += 1\n\n    forward(1)",
            "put these lines into 'def leader():'",
            "def leader():\n    while True:\n        laps += 1\n\n        forward(1)",
        ),
        (
            "def main():\n    forward(1)\n\nmain()\n",
            "put these lines into 'def leader():'",
            "def leader():\n    main()\n",
        ),
        ("def leader():\n    forward(1)\n\nleader()\n", "delete it", "forward(1)\n\n"),
    ],
)
def test_what_stands_outside_of_functions_as_in_other_programs_is_put_right(text, said, fixed):
    text = f"from motorcade import *\n{text}"
    (found,) = diagnostics_of(text)
    assert found["fixes"][0]["sentence"]["en"] == said
    assert with_the_fix(text).endswith(fixed)


def fixed_text(text, diagnostic, fix):
    """The text after the page has put the value of a fix into it."""
    place, lines = fix.get("place") or diagnostic["place"], text.split("\n")
    before = [*lines[: place["line"] - 1], lines[place["line"] - 1][: place["column"] - 1]]
    after = [lines[place["end_line"] - 1][place["end_column"] - 1 :], *lines[place["end_line"] :]]
    return "\n".join(before) + fix["value"] + "\n".join(after)


def test_one_of_several_wide_signs_is_corrected_though_the_others_are_wrong_still():
    text = f"{_IMPORT}\nprogram = Program([forward（1），forward(2)])"
    for written in ("forward(1）", "forward(1)，", "forward(1),forward(2)"):
        (found,) = diagnostics_of(text)
        text = fixed_text(text, found, found["fixes"][0])
        assert written in text
    assert diagnostics_of(text) == []


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("Program([forward()])", "add 'seconds=1'"),
        ("Program([forward(1, seconds=2)])", "delete it"),
        ("Program([forwad(1)])", "write 'forward'"),
        ("Program([forward(1) forward(1)])", "add ','"),
        ("Program([forward(1)，forward(1)])", "write ','"),
    ],
)
def test_the_button_says_whether_it_adds_deletes_or_writes(program, said):
    found = diagnostics_of(f"{_IMPORT}\nprogram = {program}")
    assert found[0]["fixes"][0]["sentence"]["en"] == said


def test_a_block_that_stands_in_a_wrong_place_is_moved_or_deleted():
    both_drive = blocks([together(forward(1, id="a"), wait(1, id="b"), id="t")])
    inside = blocks([together(forward(1, id="a"), id="t")])
    block_in(inside, "a")["type"] = "motorcade_repeat"
    twice = blocks([])
    twice["leader"]["blocks"]["blocks"].append({"type": "motorcade_leader", "id": "second"})
    for sent, block, field in ((both_drive, "b", "BEHIND"), (inside, "a", "BEHIND"), (twice, "second", "DELETE")):
        found = bad_block(ask("compile", sent))
        assert (found["block"], [each["field"] for each in found["fixes"]]) == (block, [field])


def test_deaf_followers_are_fixed_where_the_setting_stands():
    in_block = Followers([wait(3, id="w", accept_ir=False), wait(1)])
    in_hat = Followers([wait(3, id="w"), wait(1)], accept_ir=False)
    for followers, kind, value in ((in_block, "motorcade_infrared", "yes"), (in_hat, FOLLOWERS_HAT, "TRUE")):
        sent = with_ids(blocks([wait(1)], followers))
        found = next(each for each in ask("compile", sent)["diagnostics"] if each["code"] == "deaf-followers")
        (fix,) = found["fixes"]
        assert block_in(sent["followers"], fix["block"])["type"] == kind
        assert (fix["field"], fix["value"]) == ("ACCEPT_IR", value)
        assert ask("compile", with_fix(sent, found, fix))["diagnostics"] == []


def test_a_leader_that_listens_to_infrared_is_fixed_by_its_block():
    sent = blocks([forward(1, id="f", accept_ir=True)])
    infrared = sent["leader"]["blocks"]["blocks"][0]["next"]["block"]
    infrared["id"] = "i"
    found = bad_block(ask("compile", sent))
    assert (found["code"], found["block"]) == ("leader-accepts-ir", "i")
    (fix,) = found["fixes"]
    infrared["fields"][fix["field"]] = fix["value"]
    assert ask("compile", sent)["diagnostics"] == []


def test_too_many_states_still_have_a_costliest_block():
    answer = ask("compile", blocks([wait(3, id="a"), repeat(400, wait(1), id="b")]))
    assert (answer["states"], answer["image"], answer["words"]) == (401, None, [])
    assert answer["costliest"]["leader"] == {"block": "b", "count": 400}
    (diagnostic,) = answer["diagnostics"]
    assert (diagnostic["code"], diagnostic["severity"]) == ("too-many-states", "error")
    # The page leads to the block, and nobody there knows a place in a file.
    assert not any("leader[" in sentence for sentence in diagnostic["sentence"].values())
    assert (diagnostic["block"], diagnostic["editor"]) == ("b", "leader")


def wrong_blocks():
    """A row of blocks for each editor, and the ids of those that are wrong, each for a reason of its own."""
    infrared = {"type": "motorcade_infrared", "id": "w-infrared", "fields": {"ACCEPT_IR": "no", "FORWARD": "yes"}}
    leader = [
        fields("drive", "w-half", DIRECTION="forward", SPEED="2", SECONDS=0.5),
        fields("fly", "w-kind"),
        fields("drive", "w-speed", DIRECTION="forward", SPEED=7, SECONDS=1),
        fields("drive", "w-direction", DIRECTION="up", SPEED="1", SECONDS=1),
        fields("drive", "w-no-time", DIRECTION="left", SPEED="1"),
        fields("led", "w-led", WHICH=9, SECONDS=1),
        fields("led", "w-text", WHICH="1", SECONDS="long"),
        inside(
            "together", "t", fields("led", "a", WHICH="1", SECONDS=1), fields("led", "w-second", WHICH="2", SECONDS=1)
        ),
        inside("together", "t2", fields("led", "b", WHICH="1", SECONDS=1), inside("repeat", "w-repeat", TIMES=2)),
        inside("repeat", "w-times", fields("wait", "c", SECONDS=1), TIMES=0),
        infrared,
        fields("wait", "fine", SECONDS=1),
    ]
    followers = [
        fields("drive", "w-dwell", DIRECTION="forward", SPEED="2", SECONDS=0),
        fields("wait", "w-follower", SECONDS=1.5),
        fields("wait", "fine-too", SECONDS=1),
    ]
    rows = [
        *leader,
        *followers,
        leader[7]["inputs"]["STEPS"]["block"]["next"]["block"],
        leader[8]["inputs"]["STEPS"]["block"]["next"]["block"],
    ]
    return leader, followers, {block["id"] for block in rows if block["id"].startswith("w-")}


def fields(kind, block_id, **values):
    return {"type": f"motorcade_{kind}", "id": block_id, "fields": values}


def inside(kind, block_id, *row, **values):
    return {**fields(kind, block_id, **values), "inputs": {"STEPS": {"block": chained(row)}} if row else {}}


def chained(row):
    below = None
    for block in reversed(row):
        below = {**block, "next": {"block": below}} if below else block
    return below


def test_all_wrong_blocks_are_marked_by_two_compilations(monkeypatch):
    compilations = []

    def counting(*arguments):
        compilations.append(arguments)
        return compile_program(*arguments)

    monkeypatch.setattr(programs, "compile_program", counting)
    leader, followers, wrong = wrong_blocks()
    hats = {
        "leader": {"type": LEADER_HAT, "id": "hat", "next": {"block": chained(leader)}},
        "followers": {"type": FOLLOWERS_HAT, "id": "hat", "next": {"block": chained(followers)}},
    }
    sent = {name: {"blocks": {"blocks": [hat]}} for name, hat in hats.items()}
    answer = ask("compile", {**sent, "profile": "classroom"})
    marked = {diagnostic["block"] for diagnostic in answer["diagnostics"] if diagnostic["severity"] == "error"}
    assert (len(wrong), wrong - marked, marked - wrong) == (13, set(), set())
    assert len(compilations) <= 2
    assert {word["block"] for word in answer["words"]} >= {"fine", "fine-too"}
