"""The build of the engine refuses kernels that need more than their memory; what it makes asks nothing of its host."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import wasmtime
from scripts import engine_module
from scripts.engine_code import BadKernelError, Calls

from motorcade.engine.linear_memory import PATH
from support.soak import SOAK

ARRAY = np.zeros(4)


def imports(values: Any, number: int) -> None:
    values[0] = math.sin(values[1])


def allocates(values: Any, number: int) -> None:
    values[:] = np.arange(number).astype(np.float64)


def raises(values: Any, number: int) -> None:
    if number > 3:
        raise ValueError("too many")
    values[0] = number


def made(calls: Calls) -> dict[str, bytes]:
    return engine_module.made_of(calls, engine_module.TARGETS[:1])


def divides(values: Any, number: int) -> None:
    values[0] = number % len(values)


@pytest.mark.parametrize(
    ("function", "fault"),
    [
        (imports, "undefined symbol: sin"),
        (allocates, "Numba can't compile allocates: "),
        (raises, "the kernel kernel can raise an exception"),
    ],
)
def test_a_kernel_that_needs_more_than_its_memory_is_refused(function: Callable[..., None], fault: str) -> None:
    with pytest.raises(BadKernelError, match=fault):
        made({"kernel": (function, (ARRAY, 3))})


@pytest.mark.parametrize("value", [True, 3j, "text", [1, 2]])
def test_a_kernel_takes_numbers_and_arrays_alone(value: object) -> None:
    with pytest.raises(BadKernelError, match=r"number is .+; a kernel takes arrays, int64, float64"):
        made({"kernel": (lambda values, number: None, (ARRAY, value))})


def test_a_missing_linker_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_module, "linker", lambda name: None)
    with pytest.raises(BadKernelError, match=r"lld 16 is missing; Debian has it in .* lld-16"):
        made({"kernel": (divides, (ARRAY, 3))})


def test_the_module_imports_nothing_and_exports_its_kernels() -> None:
    module = wasmtime.Module(wasmtime.Engine(), PATH.read_bytes())
    assert module.imports == []
    assert {each.name for each in module.exports} >= {"memory", "__heap_base", "run", "wake"}


if SOAK:

    def test_the_committed_engine_is_what_its_sources_make() -> None:
        if reason := engine_module.obstacle():
            pytest.skip(reason)
        assert engine_module.engine_files() == {name: (PATH.parent / name).read_bytes() for name in engine_module.FILES}
