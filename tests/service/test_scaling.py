"""What a page may send takes time in proportion to its size."""

import json
from contextlib import suppress
from pathlib import Path
from time import process_time

import pytest

import motorcade.missions
from motorcade import Program, compile_program, decompile, forward, led
from motorcade.config.files import line_of
from motorcade.config.pins import parse_pins, parse_voice_map
from motorcade.config.profile import parse_profile
from motorcade.errors import MotorcadeError
from motorcade.mats import parse_mat
from motorcade.program.model import align
from motorcade.service.requests import Context, respond
from motorcade.words.image import bytes_to_words

MISSION = (Path(motorcade.missions.__file__).parent / "gallery" / "a-secret.toml").read_text(encoding="utf-8")
HEAD = "from motorcade import *\nprogram = Program(leader=["
BLOCKS = {"leader": {"blocks": {"blocks": []}}}
# The same work ten times as often takes ten times as long; what grows with the square takes a hundred times.
MOST_RATIO = 40
# Shorter times are mostly the clock's.
LEAST_S = 0.002


def text_to_blocks(text):
    return "python-to-blocks", BLOCKS | {"text": text}


def blocks_to_text(text):
    return "blocks-to-python", BLOCKS | {"text": text}


def mission(text):
    return "missions/open", {"text": text}


# For each a size, and what to ask for at a size.
REQUESTS = {
    "a mission with comments and a fault": (2000, lambda n: mission(MISSION + "# a\n" * n + "unknown = 1\n")),
    "a mission with goals": (300, lambda n: mission(MISSION + '\n[[goal]]\nkind = "x"' * n)),
    "a mission with unknown keys": (300, lambda n: mission(MISSION + "".join(f"\n[x.k{i}]" for i in range(n)))),
    "a mission in JSON": (3000, lambda n: mission(json.dumps({"format": "motorcade-mission/1", "a": [1] * n}))),
    "text in one line with an accent": (300, lambda n: text_to_blocks(HEAD + "voice('é'), " * n + "])")),
    "a text with comments": (300, lambda n: blocks_to_text(HEAD + "\n" + "forward(1), # b\n" * n + "])")),
    "a text of wrong lines": (300, lambda n: text_to_blocks(HEAD + "\n" + "forwar(1), # é\n" * n + "])")),
    "a text of names": (300, lambda n: text_to_blocks("".join(f"a{i} = 1\n" for i in range(n)) + HEAD + "])")),
    "a mission with a key of many parts": (1500, lambda n: mission("a" + ".a" * n + " = 1")),
    "a mission with a key of many quoted parts": (1500, lambda n: mission("'a'" + ' . "a"' * n + " = 1")),
    "a mission with one long word": (20_000, lambda n: mission("a" * n + ' "' * n)),
    "a mission with many lists in lists": (40, lambda n: mission("a = " + "[" * n + "]" * n)),
    "a mission with many numbers": (2000, lambda n: mission("a = [" + "1.5, " * n + "]")),
    "a text of repeats": (100, lambda n: text_to_blocks(HEAD + "repeat(2, forward(1)), " * n + "])")),
    "a text of steps at once": (100, lambda n: text_to_blocks(HEAD + "together(" + "led(1, 1), " * n + ")])")),
    "a text of doubled lists": (
        200,
        lambda n: text_to_blocks("".join(f"a{i + 1} = [a{i}, a{i}]\n" for i in range(n)) + HEAD + "])"),
    ),
    "a file of numbers": (3000, lambda n: ("open", {"text": json.dumps({"format": "motorcade/1", "a": [1] * n})})),
}


# Documents that a command line reads, too.
DOCUMENTS = {
    "a mat's crowds": (
        80,
        lambda n: mat(crowd=[{"cars": 1, "corner_m": [k % 90 * 10, k // 90 * 10], "size_m": [9, 9]} for k in range(n)]),
    ),
    "a mat's leaders": (1000, lambda n: mat(crowd=[{"cars": 2 * n, "leaders": n}])),
    "a mat's walls": (
        300,
        lambda n: mat(wall=[{"from_m": [k % 90, k // 90], "to_m": [k % 90 + 0.5, k // 90]} for k in range(n)]),
    ),
    "a mat's path": (900, lambda n: mat(person=[{"path": [[k, 1, 1] for k in range(n)]}])),
    "a program and its image": (
        12,
        lambda n: decompile(bytes_to_words(compile_program(Program(leader=[forward(1), led(1, 1)] * n)).image)),
    ),
    "a voice map": (300, lambda n: parse_voice_map("".join(f"[k{k}]\nx = 1\n" for k in range(n)), "v.toml")),
    "pins": (300, lambda n: parse_pins("".join(f"k{k} = {k}\n" for k in range(n)), "p.toml")),
    "a profile": (300, lambda n: parse_profile("".join(f"[k{k}]\nx = 1\n" for k in range(n)), "p.toml")),
}


def mat(**furniture):
    document = {"format": "motorcade-mat/1", "name": "x", "size_m": [900, 900]} | furniture
    return parse_mat(json.dumps(document), "x", "JSON")


def took_s(job, *arguments):
    """The least CPU time of three."""
    times_s = []
    for _ in range(3):
        began_s = process_time()
        job(*arguments)
        times_s.append(process_time() - began_s)
    return min(times_s)


def ask(name, message):
    with suppress(MotorcadeError):
        respond(name, json.dumps(message).encode(), Context(None, None, list))


@pytest.mark.parametrize("kind", REQUESTS)
def test_ten_times_as_much_takes_no_hundred_times_as_long(kind):
    size, message = REQUESTS[kind]
    few, many = (took_s(ask, *message(each)) for each in (size, 10 * size))
    assert many < MOST_RATIO * max(few, LEAST_S)


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_a_document_ten_times_as_long_takes_no_hundred_times_as_long(kind):
    def read(size):
        with suppress(MotorcadeError):
            DOCUMENTS[kind][1](size)

    size = DOCUMENTS[kind][0]
    few, many = (took_s(read, each) for each in (size, 10 * size))
    assert many < MOST_RATIO * max(few, LEAST_S)


def test_many_steps_are_compared_in_time():
    def compare(steps):
        old = [forward(1)] * steps
        align(old, [led(1, 1), *[forward(1), led(1, 1)] * (steps // 2)])

    few, many = (took_s(compare, steps) for steps in (150, 1500))
    assert many < MOST_RATIO * max(few, LEAST_S)


@pytest.mark.parametrize(
    ("place", "line"), [(("a",), 3), (("w", 0, "x"), 7), (("w", 0, "z"), 9), (("w", 1), 10), (("not there",), 11)]
)
def test_the_line_of_a_value_is_the_one_on_which_it_is_complete(place, line):
    text = '# [ "\na = [1, # ]\n 2]\n[[w]]\nx = """\n] """ # """\n"""\ny = \'[\'\nz = {b = "[\\""}\n[[w]]\n'
    text = text.replace('] """ # """\n', '] \\""" #\n')
    assert line_of(text, place) == line
