"""Make a program that takes what comes from others a test, and a target of the fuzzer."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
from hypothesis import HealthCheck, given, settings

from motorcade.errors import MotorcadeError
from motorcade.service.programs import error_answer
from support.soak import SOAK

HARNESSES: dict[str, Any] = {}


def harness(*arguments: Any) -> Callable[[Callable[..., None]], Any]:
    """Make a function of such arguments a test by Hypothesis, whose ``fuzz_one_input`` takes bytes."""

    def made(function: Callable[..., None]) -> Any:
        few = settings(max_examples=1000 if SOAK else 8, suppress_health_check=list(HealthCheck))
        HARNESSES[function.__name__] = few(given(*arguments)(function))
        return HARNESSES[function.__name__]

    return made


@contextmanager
def refused() -> Iterator[None]:
    """Where Motorcade refuses, it says why, in each language."""
    try:
        yield
    except MotorcadeError as problem:
        answer = error_answer(problem)
    else:
        return
    assert msgspec.json.encode(answer)
    assert all(answer.sentence.values())
