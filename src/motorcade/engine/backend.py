"""What kernels are made of, and what runs them. All backends give the same bits; `motorcade.engine.world` opens one.

A kernel is a Python function that steps or prepares a world. Three backends run it: compiled ahead of time to machine
code (`motorcade.engine.native`) and to WebAssembly (`motorcade.engine.webassembly`), and plain Python. The compiler
finds the functions and classes that kernels are made of by decorators, without a list of names.

This module needs no NumPy: in a browser, an array is a place in the linear memory of engine.wasm.
"""

from types import FunctionType
from typing import Any, Literal, Protocol, TypeVar, get_args

from motorcade.engine.state import Buffer, People, Rules, Voices

BackendName = Literal["native", "webassembly", "interpreted"]
Figures = TypeVar("Figures", People, Rules, Voices)
NAMES: tuple[BackendName, ...] = get_args(BackendName)
# An array as its backend has it: of NumPy, or a `LinearArray` of a browser. Both have `shape`, `view`, rows and slices.
BackendArray = Any

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


class Backend(Protocol):
    """Runs the kernels of one world, and allocates its arrays where these kernels can reach them.

    Attributes:
        name: which backend it is.
        threaded: whether several threads can share a call, or the phases of `run_large`.
        interruptible: whether KeyboardInterrupt can break off a call; else Python raises it after the call.
    """

    name: BackendName
    threaded: bool
    interruptible: bool

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: str) -> BackendArray:
        """Return an array of zeros. It replaces the array that was allocated before under the same ``slot``."""

    def allocate(self, slot: str, contents: Buffer) -> BackendArray:
        """Return an array with these contents, C-contiguous and reachable; ``slot`` as in `zeros`."""

    def read(self, array: BackendArray) -> bytes:
        """Return the contents of an array; of one that isn't C-contiguous maybe with what is between its rows."""

    def write(self, array: BackendArray, contents: bytes) -> None:
        """Replace the contents of an array by what `read` returns for it."""

    def clear(self, array: BackendArray) -> None:
        """Fill an array with zeros."""

    def join(self) -> None:
        """Wait until no other thread works on the world, after an exception broke off a run of several threads."""

    def call(self, kernel: str, *arguments: Any) -> None:
        """Call a kernel of `motorcade.engine.kernels.KERNELS`; its arrays come from `zeros` or `allocate`."""


def allocate_all(backend: Backend, figures: Figures) -> Figures:
    """Return a named tuple whose buffers ``backend`` has allocated as arrays, each in a slot named after its field."""
    kind = type(figures).__name__
    allocated: dict[str, Any] = {
        name: backend.allocate(f"{kind}.{name}", value)
        for name, value in figures._asdict().items()
        if isinstance(value, Buffer)
    }
    return figures._replace(**allocated)
