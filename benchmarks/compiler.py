"""Measure how long the largest programs take to compile. Run ``python benchmarks/compiler.py``.

Each program has 255 leader words and 255 follower words, the most that an image holds; a leader that decides has a few
less. Programs take turns, so that a
machine that is slow for a while is slow for all of them. Figures are medians of processor time.
"""

import gc
from collections.abc import Callable
from functools import partial
from statistics import median
from time import thread_time_ns

import msgspec
from rich.console import Console
from rich.table import Table

from motorcade.devices.motor import DIRECTIONS
from motorcade.program.blocks import blocks_of
from motorcade.program.compiler import compile_program
from motorcade.program.conditions import counter, dark, heard, obstacle, person
from motorcade.program.flow_steps import change_counter, do, if_, repeat_until
from motorcade.program.model import Program, read_program
from motorcade.program.steps import AvoidStep, DriveStep, LedStep, RepeatStep, Step, TogetherStep, forward, wait
from motorcade.service.messages import Blocks, decode
from motorcade.service.programs import compile_blocks

TURNS = 51
GOAL_MS = 5.0
ANSWER_GOAL_MS = 20.0
STATES = 255
WORDS = 255


def different(number: int) -> Step:
    """Return a step of 1 s that differs from its neighbours."""
    kinds = (DriveStep(DIRECTIONS[number % 4], number // 4 % 4, 1), LedStep(number % 4, 1), AvoidStep(number % 4, 1))
    return kinds[number % 3]


def together(number: int, drive_s: int, led_s: int, avoid_s: int) -> Step:
    """Return one of 256 different steps of three blocks."""
    drive = DriveStep(DIRECTIONS[number % 4], number // 4 % 4, drive_s)
    return TogetherStep((drive, LedStep(number // 16 % 4, led_s), AvoidStep(number // 64, avoid_s)))


def deciding(number: int) -> list[Step]:
    """Return steps of 14 words of a leader that decides."""
    return [
        if_(obstacle(number % 4) | ~person(), [different(number), change_counter("a")], [different(number + 1)]),
        forward(until=dark("both")),
        wait(1, until=heard("stop")),
        repeat_until(counter("a", "above", number % 9), different(number + 2), different(number + 3)),
        different(number),
    ]


def deciders() -> dict[str, Program]:
    """Return programs whose leader decides, with functions too."""
    varied = [different(number) for number in range(STATES)]
    rows = [step for number in range(18) for step in deciding(number)]
    called = [do("f"), do("g")] * 10
    functions = {"f": varied[:5], "g": varied[5:12]}
    return {
        "a leader that decides": Program([*rows, *varied[:3]], varied),
        "a leader with functions": Program([*rows[:75], *called, *varied[:5]], varied, functions=functions),
    }


def shapes() -> dict[str, Program]:
    varied = [different(number) for number in range(STATES)]
    short, long = [DriveStep("forward", 2, 1)], [DriveStep("forward", 2, 3)]
    blocks = [together(number, 1, 1, 1) for number in range(STATES)]
    uneven = [together(number, 3, 2, 1) for number in range(STATES)]
    nested = [RepeatStep(17, (RepeatStep(3, tuple(varied[:5])),))]
    return {
        "all different": Program(varied, varied),
        "all the same, 1 s": Program(short * STATES, short * WORDS),
        "all the same, 3 s": Program(long * STATES, long * WORDS),
        "all the same, 3 s counted down by 1 s": Program(long * STATES, [*long * (WORDS // 3 - 1), *short * 3]),
        "three blocks together": Program(blocks, blocks),
        "three blocks together, of 3, 2 and 1 s": Program(uneven, uneven),
        "a repeat in a repeat": Program(nested, nested),
    }


def medians_ms(contestants: dict[str, Callable[[], object]]) -> dict[str, float]:
    times_ns: dict[str, list[int]] = {name: [] for name in contestants}
    gc.disable()
    for _ in range(TURNS):
        for name, run in contestants.items():
            begin_ns = thread_time_ns()
            run()
            times_ns[name].append(thread_time_ns() - begin_ns)
    gc.enable()
    return {name: median(each) / 1e6 for name, each in times_ns.items()}


def read_and_compile(text: str) -> object:
    return compile_program(read_program(text))


def message(program: Program) -> bytes:
    """Return the message in which the page sends a program."""
    return msgspec.json.encode(Blocks(*blocks_of(program)))


def answer_the_page(received: bytes) -> object:
    return msgspec.json.encode(compile_blocks(decode(received, Blocks)))


def measured(time_ms: float, goal_ms: float) -> str:
    colour, result = ("green", "met") if time_ms <= goal_ms else ("red", "missed")
    return f"{time_ms:.2f} ms, [{colour}]{result}[/]"


def main() -> None:
    programs = shapes() | deciders()
    compiling = medians_ms({name: partial(compile_program, program) for name, program in programs.items()})
    reading = medians_ms({name: partial(read_and_compile, program.as_json()) for name, program in programs.items()})
    # The page has no blocks for what a leader decides.
    shown = shapes()
    answering = medians_ms({name: partial(answer_the_page, message(program)) for name, program in shown.items()})
    table = Table(
        "shape",
        "states",
        "words",
        "compiled",
        "read from JSON and compiled",
        "blocks to the page's words",
        title=f"Goals: compiling {GOAL_MS:g} ms, answering the page {ANSWER_GOAL_MS:g} ms",
    )
    for name, program in programs.items():
        compiled = compile_program(program)
        counts = (str(compiled.leader_states), str(compiled.follower_words))
        table.add_row(
            name,
            *counts,
            measured(compiling[name], GOAL_MS),
            f"{reading[name]:.2f} ms",
            measured(answering[name], ANSWER_GOAL_MS) if name in answering else "",
        )
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
