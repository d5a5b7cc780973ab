"""Make the engine: the kernels of `motorcade.engine.kernels` as a WebAssembly module and as libraries of machine code.

Numba translates each kernel to LLVM's intermediate code, for a generic processor, so that neither the processor nor the
system shapes it. The LLVM inside llvmlite then optimises it for each target, and Debian's lld links it. The same
sources, Python, llvmlite, Numba and lld give the same bytes.

Print the sizes: ``python -m scripts.engine_module``. Write the files: ``make generate``.
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
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from scripts.debian import find_or_install
from scripts.engine_code import BadKernelError, Calls, Code, all_calls, translated

from motorcade.imports import needed_files

ROOT = Path(__file__).resolve().parent.parent
LLD = "16"
PYTHON = (3, 11)
# Numba reads these when it is imported.
NUMBA = {
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_LOOP_VECTORIZE": "0",
    "NUMBA_SLP_VECTORIZE": "0",
    "NUMBA_DISABLE_JIT": "0",
}


class Target(NamedTuple):
    """What an engine is made for, and how lld links it there.

    Attributes:
        file: its path in `motorcade.engine`.
        linker: the program, without the version of LLD.
        options: of the linker; ``{export}`` is repeated for each kernel.
    """

    file: str
    triple: str
    cpu: str
    features: str
    linker: str
    options: tuple[str, ...]
    export: str


_ELF = ("-shared", "-nostdlib", "--strip-all", "--no-undefined", "--build-id=none")
_COFF = ("/dll", "/noentry", "/nodefaultlib", "/opt:ref", "/Brepro", "/nologo")
_MACH_O = (
    "-dylib",
    "-platform_version",
    "macos",
    "11.0",
    "11.0",
    "-dead_strip",
    "-x",
    "-install_name",
    "engine",
)
TARGETS = (
    Target(
        "engine.wasm",
        "wasm32-unknown-unknown",
        "generic",
        "+simd128,+bulk-memory,+sign-ext,+nontrapping-fptoint",
        "wasm-ld",
        # An overflow of the stack hits the memory's beginning and stops, instead of overwriting data.
        ("--no-entry", "--strip-all", "--stack-first", "-z", "stack-size=65536", "--export=__heap_base"),
        "--export={}",
    ),
    Target("libraries/linux-x86_64.so", "x86_64-unknown-linux-gnu", "x86-64-v2", "", "ld.lld", _ELF, "--undefined={}"),
    Target(
        "libraries/linux-x86_64-v3.so", "x86_64-unknown-linux-gnu", "x86-64-v3", "", "ld.lld", _ELF, "--undefined={}"
    ),
    Target("libraries/linux-aarch64.so", "aarch64-unknown-linux-gnu", "generic", "", "ld.lld", _ELF, "--undefined={}"),
    Target("libraries/win32-x86_64.dll", "x86_64-pc-windows-msvc", "x86-64-v2", "", "lld-link", _COFF, "/export:{}"),
    Target(
        "libraries/darwin-x86_64.dylib",
        "x86_64-apple-macosx11.0.0",
        "x86-64-v2",
        "",
        "ld64.lld",
        ("-arch", "x86_64", *_MACH_O),
        "-u _{}",
    ),
    Target(
        "libraries/darwin-aarch64.dylib",
        "arm64-apple-macosx11.0.0",
        "apple-m1",
        "",
        "ld64.lld",
        ("-arch", "arm64", *_MACH_O),
        "-u _{}",
    ),
)


def engine_files() -> dict[str, bytes]:
    """Return all files of the engine by their paths in `motorcade.engine`.

    They are made in processes of their own, because Numba reads the environment once. The libraries are 3% faster where
    Numba's own optimiser runs first, without making vectors. It counts on pointers of 64 bits, so it is off for
    WebAssembly.
    """
    module, *libraries = FILES
    with tempfile.TemporaryDirectory() as folder:
        makers = []
        for level, files in ("0", [module]), ("3", libraries):
            command = [sys.executable, "-m", "scripts.engine_module", folder, *files]
            makers.append(subprocess.Popen(command, cwd=ROOT, env={**os.environ, **NUMBA, "NUMBA_OPT": level}))
        ends = [maker.wait() for maker in makers]
        if any(ends):
            raise BadKernelError("a process that makes the engine failed; what it said is above")
        return {name: Path(folder, name).read_bytes() for name in FILES}


FILES = (*(target.file for target in TARGETS), "libraries/digests.json")


def fingerprints(files: dict[str, bytes]) -> str:
    """Return lines: digests of what the engine is made of, and of each file. They tell quickly whether it is stale.

    Docstrings, comments and the form of the code don't count.
    """
    makers = (Path(__file__), Path(__file__).with_name("engine_code.py"))
    sources = sorted(needed_files(makers, within=("car", "devices", "engine", "mats.plane", "words")))
    digest = hashlib.sha256(f"{version('numba')} {version('llvmlite')} {LLD}".encode())
    for path in sources:
        digest.update(ast.dump(_without_docstrings(ast.parse(path.read_text(encoding="utf-8")))).encode())
    made = (f"{name} {hashlib.sha256(data).hexdigest()}\n" for name, data in sorted(files.items()))
    return f"sources {digest.hexdigest()}\n{''.join(made)}"


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
    return "" if linker("wasm-ld") else f"lld {LLD} is missing (Debian: lld-{LLD})"


def linker(name: str) -> Path | None:
    """Return a linker, installed from Debian if need be and possible."""
    return find_or_install(f"{name}-{LLD}", f"lld-{LLD}")


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


# What LLVM calls where it fills memory. It leaves the loop of a function of this name as it is.
_MEMSET = """
define hidden ptr @memset(ptr %to, i32 %value, i64 %count) {
  %byte = trunc i32 %value to i8
  %none = icmp eq i64 %count, 0
  br i1 %none, label %end, label %each
each:
  %k = phi i64 [ 0, %0 ], [ %next, %each ]
  %at = getelementptr i8, ptr %to, i64 %k
  store i8 %byte, ptr %at
  %next = add i64 %k, 1
  %more = icmp ult i64 %next, %count
  br i1 %more, label %each, label %end
end:
  ret ptr %to
}
"""
# What LLVM calls where it moves memory; here it is in either direction.
_MEMMOVE = """
define hidden ptr @memmove(ptr %to, ptr %from, i64 %count) {
  %ahead = icmp ult ptr %from, %to
  %step = select i1 %ahead, i64 -1, i64 1
  %last = sub i64 %count, 1
  %first = select i1 %ahead, i64 %last, i64 0
  %none = icmp eq i64 %count, 0
  br i1 %none, label %end, label %each
each:
  %k = phi i64 [ %first, %0 ], [ %next, %each ]
  %left = phi i64 [ %count, %0 ], [ %fewer, %each ]
  %source = getelementptr i8, ptr %from, i64 %k
  %byte = load i8, ptr %source
  %at = getelementptr i8, ptr %to, i64 %k
  store i8 %byte, ptr %at
  %next = add i64 %k, %step
  %fewer = sub i64 %left, 1
  %more = icmp ne i64 %fewer, 0
  br i1 %more, label %each, label %end
end:
  ret ptr %to
}
"""
# What code for macOS calls where it fills memory with zeros.
_BZERO = """
declare ptr @memset(ptr, i32, i64)
define hidden void @{name}(ptr %to, i64 %count) {{
  call ptr @memset(ptr %to, i32 0, i64 %count)
  ret void
}}
"""
# Code for Windows that has floating-point numbers refers to it.
_FLTUSED = "@_fltused = hidden global i32 0"


def _whole(kernels: dict[str, Code], target: Target) -> Any:
    """Return the optimised module of all kernels for a target."""
    import llvmlite.binding as llvm

    # The code models of a compiler that runs what it makes keep two registers for the addresses of constants.
    machine = llvm.Target.from_triple(target.triple).create_target_machine(
        cpu=target.cpu,
        features=target.features,
        opt=3,
        reloc="default" if target.linker == "wasm-ld" else "pic",
        codemodel="small",
    )
    whole = llvm.parse_assembly("")
    for name, (code, function, arguments) in kernels.items():
        module = llvm.parse_assembly(code)
        for each in [*module.functions, *module.global_variables]:
            if not each.is_declaration and each.name != function:
                each.linkage = "internal"
        module.get_function(function).name = f"kernel.{name}"
        module.link_in(llvm.parse_assembly(_with_block(name, _types(arguments))))
        module.get_function(f"kernel.{name}").linkage = "internal"
        whole.link_in(module)
    whole.data_layout, whole.triple = str(machine.target_data), target.triple
    whole.verify()
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    builder.getModulePassManager().run(whole, builder)
    _check(whole, list(kernels))
    if target.linker != "wasm-ld":
        for called in (_MEMSET, _MEMMOVE):
            whole.link_in(llvm.parse_assembly(called))
    if target.linker == "ld64.lld":
        # On Intel's and on Apple's processors.
        for name in ("__bzero", "bzero"):
            whole.link_in(llvm.parse_assembly(_BZERO.format(name=name)))
    if target.linker == "lld-link":
        whole.link_in(llvm.parse_assembly(_FLTUSED))
    return machine.emit_object(whole)


def _check(module: Any, exports: list[str]) -> None:
    """Raise BadKernelError where a kernel needs a function from outside, or can raise an exception."""
    wanted = [each.name for each in module.functions if each.is_declaration and not each.name.startswith("llvm.")]
    if wanted:
        raise BadKernelError(f"a kernel calls {', '.join(wanted)}, which no target has")
    functions = {each.name: str(each) for each in module.functions}
    for name in exports:
        # What Numba's function returns is 0, or says which exception was raised. LLVM finds out where it is always 0;
        # then the function may be inlined, or return nothing.
        codes = [functions[each] for each in (name, f"kernel.{name}") if each in functions]
        if {"0"} not in [set(re.findall(r"^  ret i32 (.*)$", code, re.MULTILINE)) for code in codes]:
            raise BadKernelError(f"the kernel {name} can raise an exception")


def _linked(code: bytes, target: Target, exports: list[str]) -> bytes:
    command = linker(target.linker)
    if command is None:
        raise BadKernelError(f"lld {LLD} is missing; Debian has it in the package lld-{LLD}")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "engine.o").write_bytes(code)
        wanted = [word for name in exports for word in target.export.format(name).split()]
        output = ["/out:engine"] if target.linker == "lld-link" else ["-o", "engine"]
        arguments = [*target.options, *wanted, *output, "engine.o"]
        linked = subprocess.run([command, *arguments], cwd=folder, stderr=subprocess.PIPE, check=False, text=True)
        if linked.returncode:
            raise BadKernelError(f"{target.file} can't be linked: {linked.stderr}")
        return Path(folder, "engine").read_bytes()


def _section(name: str, contents: bytes) -> bytes:
    """Return a custom section of a WebAssembly module."""
    body = _unsigned(len(name)) + name.encode() + contents
    return b"\0" + _unsigned(len(body)) + body


def _unsigned(number: int) -> bytes:
    low = bytes([number & 0x7F])
    return low if number < 0x80 else bytes([low[0] | 0x80]) + _unsigned(number >> 7)


def made_of(calls: Calls, targets: Sequence[Target] = TARGETS) -> dict[str, bytes]:
    """Make files of kernels in this process, whose environment has NUMBA. Raises BadKernelError."""
    import llvmlite.binding as llvm

    from motorcade.engine.linear_memory import SECTION

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    kernels = {name: translated(*call) for name, call in calls.items()}
    made = {}
    for target in targets:
        # WebAssembly has one thread.
        chosen = {name: kernel for name, kernel in kernels.items() if target.linker != "wasm-ld" or name != "run_large"}
        made[target.file] = _linked(_whole(chosen, target), target, list(chosen))
    listed = {name: kernel.arguments for name, kernel in kernels.items()}
    if "engine.wasm" in made:
        made["engine.wasm"] += _section(SECTION, json.dumps(listed, separators=(",", ":")).encode())
    return made


def _write(folder: Path, files: Sequence[str]) -> None:
    """Write some of the files, for `engine_files`."""
    from motorcade.engine.native import InterpretedKernels
    from motorcade.engine.world import DIGESTS, proof

    made = made_of(all_calls(), [target for target in TARGETS if target.file in files])
    if f"libraries/{DIGESTS}" in files:
        digests = {Path(name).name: hashlib.sha256(data).hexdigest() for name, data in made.items()}
        digests["proof"] = proof(InterpretedKernels())
        made[f"libraries/{DIGESTS}"] = f"{json.dumps(digests, indent=2)}\n".encode()
    for name, data in made.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        _write(Path(sys.argv[1]), sys.argv[2:])
    else:
        for file, data in engine_files().items():
            print(f"{file}: {len(data):,} bytes, {len(gzip.compress(data, mtime=0)):,} compressed by gzip")
