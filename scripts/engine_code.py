"""Translate the kernels of `motorcade.engine.kernels` to LLVM's intermediate code, by Numba.

Numba compiles a call of `motorcade.car.brain.follower_step` from the source of that function, so there is no second
version of it.
"""

import inspect
import re
from collections.abc import Callable
from functools import lru_cache
from types import FunctionType
from typing import Any, NamedTuple

# Nothing is allocated in a kernel, so its arrays need no reference counts, which would take most of the time.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}

Calls = dict[str, tuple[Callable[..., None], tuple[Any, ...]]]
"""Each kernel, and arguments of the types that it will have."""


class BadKernelError(Exception):
    """A kernel can't be a part of the engine."""


class Code(NamedTuple):
    """A kernel's intermediate code.

    Attributes:
        text: the code.
        function: the name of the kernel's function there.
        arguments: what `motorcade.engine.linear_memory.Argument` is made of, for each.
    """

    text: str
    function: str
    arguments: list[tuple[Any, ...]]


def all_calls() -> Calls:
    """Return every kernel, with arguments as a world passes them."""
    from motorcade.engine import agents
    from motorcade.engine.kernels import KERNELS, ORDER
    from motorcade.engine.native import InterpretedKernels
    from motorcade.engine.pictures import Pictures
    from motorcade.engine.simulation import Simulation
    from motorcade.mats import Pose, formation, open_table

    calls: Calls = {}

    class Recorded(InterpretedKernels):
        def call(self, kernel: str, *arguments: Any) -> None:
            calls.setdefault(kernel, (KERNELS[kernel], arguments))
            super().call(kernel, *arguments)

    world = Simulation(open_table(formation(1)), [bytes(4)], None, Recorded(), events=True)
    world.drive(0)
    world.step()
    world.move(0, Pose(0, 0))
    world.look_ahead(0, 1000)
    world.give_back(0)
    world.judge()
    world.begin_words(agents.KEEP.to_bytes(4, "little") * world.cars)
    forms = {"given": ((1,), "uint32"), "told": ((3, 1), "int64"), "fields": ((1, 2), "int64")}
    forms |= {"sensed": ((1, agents.SENSED), "int64"), "seen": ((1, 9), "float32")}
    world.observe(0, *(world.backend.zeros(name, *form) for name, form in forms.items()))
    world.read_senses()
    pictures = Pictures(world)
    pictures.take_events()
    pictures.moment(is_stored=True)
    pictures.nearest(0)
    scratch = world.backend.zeros("scratch", (1, world.cars), "uint32")
    world.backend.call("run_large", 0, 1, ORDER, 1, 0, calls["run"][1][5], scratch, world.arrays())
    return dict(sorted(calls.items()))


@lru_cache
def register() -> None:
    """Let Numba compile the functions and classes that kernels are made of."""
    import numba.np.arrayobj
    from numba.extending import register_jitable

    from motorcade.car import brain, decisions, frames, next_wakeup, step
    from motorcade.engine import backend, events
    from motorcade.mats import plane
    from motorcade.words import infrared, ticks

    # No kernel counts from the end of an array. To allow for that at each access took a fifth of the time, and no
    # loop became one of vectors.
    numba.np.arrayobj.fix_integer_index = _to_index
    # Portable functions can't be decorated where they stand.
    plain = (ticks, infrared, brain, frames, decisions, next_wakeup, step, events, plane)
    found = ((module, each) for module in plain for each in vars(module).values())
    portable = [each for module, each in found if isinstance(each, FunctionType) and each.__module__ == module.__name__]
    for function in (*backend.FUNCTIONS, *portable):
        if function not in (infrared.ones, infrared.is_odd):
            # Few cars decide: their code shouldn't stand between that of all others.
            is_rare = function.__module__ == decisions.__name__ and function is not decisions.decides
            register_jitable(forceinline=not is_rare)(function)
    _register_ones(infrared.ones, infrared.is_odd)
    for kind in backend.CLASSES:
        for name, method in vars(kind).items():
            if isinstance(method, FunctionType) and not name.startswith("_"):
                _register_method(kind, name, method)


def _to_index(context: Any, builder: Any, kind: Any, index: Any, size: Any) -> Any:
    """Emit an index of an array as it is, instead of adding ``size`` where it is negative."""
    from numba.core import types

    return context.cast(builder, index, kind, types.intp if kind.signed else types.uintp)


def _register_ones(ones: Callable[[int], int], is_odd: Callable[[int], int]) -> None:
    """Let an instruction count bits: every target has one, and LLVM doesn't find out what the function does."""
    from numba.core import types
    from numba.extending import intrinsic, overload

    @intrinsic
    def counted(_: Any, word: Any) -> Any:
        def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.ctpop(context.cast(builder, arguments[0], signature.args[0], types.int64))

        return types.int64(word), emit

    overload(ones)(lambda word: lambda word: counted(word))  # type: ignore[call-arg]  # Numba gives the context
    overload(is_odd)(lambda half: lambda half: counted(half) & 1)  # type: ignore[call-arg]


def _register_method(kind: type, name: str, method: FunctionType) -> None:
    from numba.core import types
    from numba.extending import overload_method

    def implementation(self: Any, *arguments: Any) -> FunctionType | None:
        return method if self.instance_class is kind else None

    # Numba looks here for the names of the parameters.
    implementation.__signature__ = inspect.signature(method)  # type: ignore[attr-defined]
    options: dict[str, Any] = {"jit_options": {"forceinline": True}, "strict": False}
    # Numba has one type for all named tuples, which holds the class.
    overload_method(types.NamedTuple, name, **options)(implementation)


def translated(function: Callable[..., None], arguments: tuple[Any, ...]) -> Code:
    """Return a kernel's code for arguments of these types. Raises BadKernelError."""
    register()
    import numba
    from numba.core.errors import NumbaError

    kernel = numba.njit(**OPTIONS)(function)
    signature = tuple(numba.typeof(argument) for argument in arguments)
    named = zip(kernel.py_func.__code__.co_varnames, signature, strict=False)
    listed = [argument for parameter, kind in named for argument in _flat(parameter, kind)]
    try:
        kernel.compile(signature)
    except NumbaError as problem:
        raise BadKernelError(f"Numba can't compile {kernel.py_func.__name__}: {problem}") from None
    result = kernel.overloads[signature]
    # The layout of data is the target's. These functions of C are instructions everywhere.
    text = re.sub(r"^target (datalayout|triple) = .*$", "", str(result.library.get_llvm_str()), flags=re.MULTILINE)
    text = re.sub(r"^declare double @(ceil|fabs|floor|sqrt)\(double.*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"@(ceil|fabs|floor|sqrt)\(double", r"@llvm.\1.f64(double", text)
    # No kernel computes with NaN or minds the sign of a zero: the least of numbers is found several at an instruction.
    text = re.sub(r"= fcmp (?=[ou])", "= fcmp nnan nsz ", text)
    text = re.sub(r"= select (?=i1 [^,]+, double)", "= select nnan nsz ", text)
    return Code(text, str(result.fndesc.llvm_func_name), listed)


def _flat(name: str, kind: Any) -> list[tuple[Any, ...]]:
    from numba.core import types

    if isinstance(kind, types.NamedTuple):
        fields = zip(kind.fields, kind.types, strict=True)
        return [argument for field, inner in fields for argument in _flat(f"{name}.{field}", inner)]
    if isinstance(kind, types.NamedUniTuple):
        return [argument for field in kind.fields for argument in _flat(f"{name}.{field}", kind.dtype)]
    if isinstance(kind, types.Array):
        return [(name, str(kind.dtype), kind.ndim, kind.layout)]
    if kind in (types.int64, types.float64):
        return [(name, str(kind))]
    raise BadKernelError(f"{name} is {kind}; a kernel takes arrays, int64, float64, and named tuples of them")
