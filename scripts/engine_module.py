"""Make engine.wasm: the kernels of `motorcade.engine.kernels` as one WebAssembly module.

Numba translates each kernel to LLVM's intermediate code, for a generic processor and before any optimiser has run, so
that neither the processor nor the system shapes it. The LLVM inside llvmlite then optimises it for WebAssembly, and
Debian's wasm-ld links it. The same sources, Python, llvmlite, Numba and wasm-ld give the same bytes.

Print the sizes: ``python -m scripts.engine_module``. Write the file: ``make generate``.
"""

import ast
import gzip
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from scripts.debian import find_or_install

ROOT = Path(__file__).resolve().parent.parent
LINKER = "wasm-ld-16"
PYTHON = (3, 11)
TRIPLE = "wasm32-unknown-unknown"
FEATURES = "+simd128,+bulk-memory,+sign-ext,+nontrapping-fptoint"
# Numba reads these when it is imported.
NUMBA = {
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_OPT": "0",
    "NUMBA_LOOP_VECTORIZE": "0",
    "NUMBA_SLP_VECTORIZE": "0",
    "NUMBA_DISABLE_JIT": "0",
}

Make = Callable[[str, Any], Callable[..., None]]
"""Returns a kernel, as those of `motorcade.engine.kernels.KERNELS`."""

Calls = dict[str, tuple[Make, tuple[Any, ...]]]
"""What makes each kernel, and arguments of the types that it will have."""


class BadKernelError(Exception):
    """A kernel can't be a part of the module."""


def engine_module() -> bytes:
    """Return the module, made in a process of its own, because Numba reads the environment once."""
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder, "engine.wasm")
        command = [sys.executable, "-m", "scripts.engine_module", str(made)]
        subprocess.run(command, cwd=ROOT, env={**os.environ, **NUMBA}, check=True)
        return made.read_bytes()


def fingerprints(module: bytes) -> str:
    """Return two lines: digests of what ``module`` is made of, and of itself. They tell quickly whether it is stale.

    Docstrings, comments and the form of the code don't count.
    """
    package = ROOT / "src" / "motorcade"
    folders = (package / name for name in ("car", "engine", "words"))
    # No kernel calls the check of boards.
    sources = sorted(path for folder in folders for path in folder.rglob("*.py") if path.parent.name != "check")
    digest = hashlib.sha256(f"{version('numba')} {version('llvmlite')} {LINKER}".encode())
    for path in (*sources, Path(__file__)):
        digest.update(ast.dump(_without_docstrings(ast.parse(path.read_text(encoding="utf-8")))).encode())
    return f"sources {digest.hexdigest()}\nmodule {hashlib.sha256(module).hexdigest()}\n"


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            node.body = [each for each in node.body if not _is_text(each)]
    return tree


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def obstacle() -> str:
    """Return why this computer can't make the committed bytes; "" where it can."""
    if sys.version_info[:2] != PYTHON:
        return "it is made by Python {}.{}, and other versions order some instructions otherwise".format(*PYTHON)
    return "" if linker() else f"{LINKER} is missing (Debian: lld-16)"


def linker() -> Path | None:
    """Return the linker, installed from Debian if need be and possible."""
    return find_or_install(LINKER, "lld-16")


def _calls() -> Calls:
    """Return every kernel, with arguments as a world passes them."""
    from motorcade.engine import choice
    from motorcade.engine.interpreted import InterpretedKernels
    from motorcade.engine.kernels import KERNELS
    from motorcade.engine.world import World, warm_up
    from motorcade.mats import formation, open_table

    calls: Calls = {}

    class Recorded(InterpretedKernels):
        def call(self, kernel: str, threads: int, *arguments: Any) -> None:
            calls.setdefault(kernel, (KERNELS[kernel], arguments))
            super().call(kernel, threads, *arguments)

    choice.open_target = lambda name, needed_bytes: Recorded()
    warm_up(World(open_table(formation(1)), [bytes(4)], threads=1))
    return calls


def _intermediate(make: Make, arguments: tuple[Any, ...]) -> tuple[str, str, list[tuple[Any, ...]]]:
    """Return a kernel's intermediate code, the name of its function there, and its arguments for the section."""
    import numba
    from numba.core.errors import NumbaError

    from motorcade.engine.native import OPTIONS

    kernel = numba.njit(**OPTIONS)(make("", range))
    signature = tuple(numba.typeof(argument) for argument in arguments)
    named = zip(kernel.py_func.__code__.co_varnames, signature, strict=False)
    listed = [argument for parameter, kind in named for argument in _flat(parameter, kind)]
    try:
        kernel.compile(signature)
    except NumbaError as problem:
        raise BadKernelError(f"Numba can't compile {kernel.py_func.__name__}: {problem}") from None
    result = kernel.overloads[signature]
    return str(result.library.get_llvm_str()), str(result.fndesc.llvm_func_name), listed


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


def _types(arguments: list[tuple[Any, ...]]) -> list[str]:
    """Return the types of LLVM by which Numba passes the arguments."""
    passed: list[str] = []
    for _, dtype, *array in arguments:
        if array:
            passed += ["ptr", "ptr", "i64", "i64", "ptr", *["i64"] * (2 * array[0])]
        else:
            passed.append({"int64": "i64", "float64": "double"}[dtype])
    return passed


def _with_block(name: str, passed: list[str]) -> str:
    """Return a function that reads the arguments from a block and calls the kernel. Its result isn't 0 on an error."""
    lines = [f"declare i32 @kernel.{name}(ptr, ptr, {', '.join(passed)})", f"define i32 @{name}(ptr %block) {{"]
    lines += ["  %result = alloca i64", "  %error = alloca ptr"]
    for number, kind in enumerate(passed):
        lines.append(f"  %p{number} = getelementptr i64, ptr %block, i32 {number}")
        lines.append(f"  %a{number} = load {kind}, ptr %p{number}, align 8")
    listed = ", ".join(f"{kind} %a{number}" for number, kind in enumerate(passed))
    lines += [f"  %status = call i32 @kernel.{name}(ptr %result, ptr %error, {listed})", "  ret i32 %status", "}"]
    return "\n".join(lines)


def _object(calls: Calls) -> tuple[bytes, dict[str, list[tuple[Any, ...]]]]:
    """Return the object file of all kernels, and their arguments."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(TRIPLE)
    machine = target.create_target_machine(cpu="generic", features=FEATURES, opt=3)
    whole, arguments = llvm.parse_assembly(""), {}
    for name, (make, values) in calls.items():
        code, function, arguments[name] = _intermediate(make, values)
        # The layout of data is the target's. These functions of C are instructions in WebAssembly.
        code = re.sub(r"^target (datalayout|triple) = .*$", "", code, flags=re.MULTILINE)
        code = re.sub(r"@(floor|sqrt|fabs)\(double", r"@llvm.\1.f64(double", code)
        module = llvm.parse_assembly(code)
        for each in [*module.functions, *module.global_variables]:
            if not each.is_declaration and each.name != function:
                each.linkage = "internal"
        module.get_function(function).name = f"kernel.{name}"
        module.link_in(llvm.parse_assembly(_with_block(name, _types(arguments[name]))))
        module.get_function(f"kernel.{name}").linkage = "internal"
        whole.link_in(module)
    whole.data_layout, whole.triple = str(machine.target_data), TRIPLE
    whole.verify()
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    builder.getModulePassManager().run(whole, builder)
    _check(whole, list(calls))
    return machine.emit_object(whole), arguments


def _check(module: Any, exports: list[str]) -> None:
    """Raise BadKernelError where a kernel needs a function from outside, or can raise an exception."""
    wanted = [each.name for each in module.functions if each.is_declaration and not each.name.startswith("llvm.")]
    if wanted:
        raise BadKernelError(f"a kernel calls {', '.join(wanted)}, which WebAssembly doesn't have")
    codes = {each.name: str(each) for each in module.functions}
    for name in exports:
        # What Numba's function returns is 0, or says which exception was raised. A small one is inlined.
        results = re.findall(r"^  ret i32 (.*)$", codes.get(f"kernel.{name}") or codes[name], re.MULTILINE)
        if set(results) != {"0"}:
            raise BadKernelError(f"the kernel {name} can raise an exception")


def _linked(code: bytes, exports: list[str]) -> bytes:
    command = linker()
    if command is None:
        raise BadKernelError(f"{LINKER} is missing; Debian has it in the package lld-16")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "engine.o")
        path.write_bytes(code)
        # An overflow of the stack hits the memory's beginning and stops, instead of overwriting data.
        options = ["--no-entry", "--strip-all", "--stack-first", "-z", "stack-size=65536"]
        wanted = [f"--export={name}" for name in (*exports, "__heap_base")]
        options += [*wanted, "-o", "engine.wasm", path.name]
        linked = subprocess.run([command, *options], cwd=folder, stderr=subprocess.PIPE, check=False, text=True)
        if linked.returncode:
            raise BadKernelError(f"a kernel can't be linked: {linked.stderr}")
        return Path(folder, "engine.wasm").read_bytes()


def _section(name: str, contents: bytes) -> bytes:
    """Return a custom section."""
    body = _unsigned(len(name)) + name.encode() + contents
    return b"\0" + _unsigned(len(body)) + body


def _unsigned(number: int) -> bytes:
    low = bytes([number & 0x7F])
    return low if number < 0x80 else bytes([low[0] | 0x80]) + _unsigned(number >> 7)


def module_of(calls: Calls) -> bytes:
    """Make a module of kernels in this process, whose environment has NUMBA. Raises BadKernelError."""
    from motorcade.engine.linear_memory import SECTION

    code, arguments = _object(calls)
    section = _section(SECTION, json.dumps(arguments, separators=(",", ":")).encode())
    return _linked(code, list(arguments)) + section


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_bytes(module_of(dict(sorted(_calls().items()))))
    else:
        made = engine_module()
        print(f"engine.wasm: {len(made):,} bytes, {len(gzip.compress(made, mtime=0)):,} compressed by gzip")
