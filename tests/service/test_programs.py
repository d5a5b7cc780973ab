"""What the page is told of mistakes, and the Python text beside the blocks."""

import json
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade import Program, compile_program, forward, led, repeat, together, wait
from motorcade.locales import languages
from motorcade.program.blocks import blocks_of
from motorcade.service.requests import Context, respond


def ask(name, message):
    """The answer to a request that needs nothing of the shell."""
    return json.loads(respond(name, json.dumps(message).encode(), Context(None, None, list)))


def blocks(leader, followers=None):
    """The page's message for a program."""
    leader, followers = blocks_of(Program(leader, followers))
    return {"leader": leader, "followers": followers, "profile": "classroom"}


def bad_block(answer):
    """The one diagnostic of an answer."""
    (diagnostic,) = answer["diagnostics"]
    return diagnostic


def test_a_wrong_block_has_values_that_would_mend_it():
    sent = blocks([wait(1, id="w"), forward(1.5, id="f")])
    found = bad_block(ask("compile", sent))
    assert (found["code"], found["block"]) == ("duration-not-expressible", "f")
    assert [(each["field"], each["value"]) for each in found["mends"]] == [("SECONDS", 1.0), ("SECONDS", 2.0)]
    assert found["mends"][0]["sentence"] == {"en": "make it 1 s", "zh": "改成 1 秒"}
    for mend in found["mends"]:
        sent["leader"]["blocks"]["blocks"][0]["next"]["block"]["next"]["block"]["fields"]["SECONDS"] = mend["value"]
        assert ask("compile", sent)["diagnostics"] == []


@given(st.floats(0.001, 100), st.integers(1, 60), st.integers(1, 400))
def test_a_mend_mends(seconds, steps, times):
    def compiled(seconds, times):
        program = Program([*[wait(1)] * steps, repeat(times, wait(1)), forward(seconds, id="f")])
        return compile_program(program).diagnostics

    for each in compiled(seconds, times):
        for mend in each.mends:
            fixed = {"seconds": seconds, "times": times, mend.field: mend.value}
            assert each.code not in [left.code for left in compiled(**fixed)]


def test_the_other_blocks_keep_their_words():
    good = ask("compile", blocks([wait(1, id="w"), led(0, 1, id="l")], [wait(2, id="f")]))
    answer = ask("compile", blocks([wait(1, id="w"), forward(0.5, id="x"), led(0, 1, id="l")], [wait(2, id="f")]))
    assert answer["words"] == good["words"]
    assert (answer["left_out"], answer["image"]) == (["x"], None)
    assert bad_block(answer)["block"] == "x"


def test_blocks_that_make_no_program_are_left_out_too():
    sent = blocks([wait(1, id="w"), led(0, 1, id="l"), wait(2, id="z")])
    middle = sent["leader"]["blocks"]["blocks"][0]["next"]["block"]["next"]["block"]
    middle["type"] = "motorcade_infrared"
    answer = ask("compile", sent)
    assert [word["block"] for word in answer["words"]] == [None, "w", "z"]
    assert answer["left_out"] == ["l"]


@pytest.mark.parametrize("language", languages())
def test_steps_that_cannot_start_together_are_named_in_words(language):
    answer = ask("compile", blocks([together(forward(1, id="a"), wait(1, id="b"))]))
    assert "drive" not in bad_block(answer)["sentence"]["zh"]
    answer = ask("compile", blocks([wait(1, id=str(number)) for number in range(256)]))
    assert not re.search(r"\b1\b", bad_block(answer)["sentence"][language])


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
        assert [(each["field"], each["value"]) for each in found["mends"]] == [("TEXT", "forward")]
        assert answer.get("leader") is None
        assert answer.get("text", sent["text"]) == sent["text"]
    unknown = bad_block(ask("python-to-blocks", {**sent, "text": "program = Program([], profile='nix')"}))
    assert (unknown["code"], unknown["place"]["line"]) == ("bad-profile", 1)


@pytest.mark.parametrize(
    ("program", "written"),
    [
        ("Program([forward(3, speed=9)])", "forward(3, speed=3)"),
        ("Program([led(7, 1)])", "led(3, 1)"),
        ("Program([repeat(0, forward(1))])", "repeat(1, forward(1))"),
        ("Program([forward(-1)])", "forward(0)"),
        ("Program([forward(1)], profile='clasroom')", 'profile="classroom"'),
        ("Program([wait(1)], Followers([led(0, 1)], dwell_seconds=0))", "dwell_seconds=None)"),
        ("Program([forward(1, sped=2)])", "forward(1, speed=2)"),
    ],
)
def test_a_value_that_would_mend_a_text_is_written_in_its_place(program, written):
    text = f"from motorcade import Followers, Program, forward, led, repeat, wait\nprogram = {program}"
    found = bad_block(ask("python-to-blocks", {"leader": {}, "text": text}))
    (mend,) = found["mends"]
    assert (mend["field"], set(mend["sentence"])) == ("TEXT", set(languages()))
    head, line = text.splitlines()
    first, end = found["place"]["column"] - 1, found["place"]["end_column"] - 1
    mended = f"{line[:first]}{mend['value']}{line[end:]}"
    assert written in mended
    assert ask("python-to-blocks", {"leader": {}, "text": f"{head}\n{mended}"})["diagnostics"] == []


def test_a_leader_that_listens_to_infrared_is_mended_by_its_block():
    sent = blocks([forward(1, id="f", accept_ir=True)])
    infrared = sent["leader"]["blocks"]["blocks"][0]["next"]["block"]
    infrared["id"] = "i"
    found = bad_block(ask("compile", sent))
    assert (found["code"], found["block"]) == ("leader-accepts-ir", "i")
    (mend,) = found["mends"]
    infrared["fields"][mend["field"]] = mend["value"]
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
