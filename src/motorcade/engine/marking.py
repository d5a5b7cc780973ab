"""Mark the functions and classes that kernels are made of, so that each target finds them without a list of names.

A kernel is a Python function that steps or prepares a world. Three targets run it with equal bits: compiled by Numba
(`motorcade.engine.native`), as WebAssembly (`motorcade.engine.webassembly`), and as plain Python.
"""

from types import FunctionType
from typing import TypeVar

Function = TypeVar("Function")
Class = TypeVar("Class", bound=type)

FUNCTIONS: list[FunctionType] = []
CLASSES: list[type] = []


def in_kernel(function: Function) -> Function:
    """Decorate a function that kernels call. Targets inline it, because a call would copy each array's description."""
    assert isinstance(function, FunctionType)
    FUNCTIONS.append(function)
    return function


def methods_in_kernel(kind: Class) -> Class:
    """Decorate a named tuple class whose public methods kernels call."""
    CLASSES.append(kind)
    return kind
