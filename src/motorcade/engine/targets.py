"""What runs the kernels of a world. All targets give the same bits; `motorcade.engine.choice` picks one.

This module needs no NumPy: in a browser, an array is a place in the linear memory of engine.wasm.
"""

from collections.abc import Sequence
from typing import Any, Literal, Protocol, TypeVar, get_args

from motorcade.engine.state import Buffer, People, Rules, Voices

Name = Literal["native", "webassembly", "interpreted"]
Figures = TypeVar("Figures", People, Rules, Voices)
NAMES: tuple[Name, ...] = get_args(Name)
# An array as its target has it: of NumPy, or a `motorcade.browser.kernels.LinearArray`. Both have `shape`, `view`, rows
# and slices.
TargetArray = Any


class Target(Protocol):
    """Runs the kernels of one world, and allocates its arrays where these kernels can reach them.

    Attributes:
        name: which target it is.
        threaded: whether it can use several threads.
    """

    name: Name
    threaded: bool

    def zeros(self, slot: str, shape: tuple[int, ...], dtype: str) -> TargetArray:
        """Return an array of zeros. It replaces the array that was allocated before under the same ``slot``."""

    def keep(self, slot: str, contents: Buffer) -> TargetArray:
        """Return an array with these contents, C-contiguous and reachable; ``slot`` as in `zeros`."""

    def read(self, array: TargetArray) -> bytes:
        """Return the contents of a C-contiguous array."""

    def write(self, array: TargetArray, contents: bytes) -> None:
        """Replace the contents of a C-contiguous array."""

    def clear(self, array: TargetArray) -> None:
        """Fill an array with zeros."""

    def save(self, arrays: Sequence[TargetArray]) -> Any:
        """Return a copy of the contents of arrays for `restore`; it is valid until the next call of `save`."""

    def restore(self, arrays: Sequence[TargetArray], saved: Any) -> None:
        """Give the arrays the contents that `save` copied."""

    def call(self, kernel: str, threads: int, *arguments: Any) -> None:
        """Call a kernel of `motorcade.engine.kernels.KERNELS`; its arrays come from `zeros` or `keep`."""


class Runner(Protocol):
    """What runs the kernels of one world, now and later; `motorcade.engine.choice.KernelChoice` may change it.

    Attributes:
        memory: allocates the arrays, and reads and writes them. They stay where they are.
        now: runs the next call.
    """

    memory: Target
    now: Target

    def begin(self, car_steps: int) -> int:
        """Return how many car-steps the next call may have at most, where ``car_steps`` are left of a run."""


class OneTarget:
    """Runs the kernels of a world by one target from its beginning to its end."""

    def __init__(self, target: Target) -> None:
        self.memory = self.now = target

    def begin(self, car_steps: int) -> int:
        """Return ``car_steps``."""
        return car_steps


def keep_all(target: Target, figures: Figures) -> Figures:
    """Return a named tuple with its buffers kept by ``target`` as arrays, each in a slot named after its field."""
    kind = type(figures).__name__
    kept: dict[str, Any] = {
        name: target.keep(f"{kind}.{name}", value)
        for name, value in figures._asdict().items()
        if isinstance(value, Buffer)
    }
    return figures._replace(**kept)
