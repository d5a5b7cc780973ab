"""Decorate the functions and classes that kernels are made of: the compiler finds them without a list of names.

A kernel is a Python function that steps or prepares a world. Three backends run it with equal bits: compiled ahead of
time to machine code (`motorcade.engine.native`) and to WebAssembly (`motorcade.engine.webassembly`), and plain Python.
"""

from types import FunctionType
from typing import TypeVar

Function = TypeVar("Function")
Class = TypeVar("Class", bound=type)

FUNCTIONS: list[FunctionType] = []
CLASSES: list[type] = []


def in_kernel(function: Function) -> Function:
    """Decorate a function that kernels call. It is inlined, because a call would copy each array's description."""
    assert isinstance(function, FunctionType)
    FUNCTIONS.append(function)
    return function


def methods_in_kernel(kind: Class) -> Class:
    """Decorate a named tuple class whose public methods kernels call."""
    CLASSES.append(kind)
    return kind
