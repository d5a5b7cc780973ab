"""The libraries for other computers do the same there: under QEMU's and Wine's emulation."""

import ctypes
import struct
import subprocess
from pathlib import Path

import pytest
from scripts.debian import find_or_install

from motorcade.engine.linear_memory import module_arguments
from motorcade.engine.native import library_path
from motorcade.engine.webassembly import WebAssemblyKernels
from support.worlds import crowd, ran

SOURCE = Path(__file__).with_name("call_kernel.c")
ARM = ("gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross", "qemu-user")
WINDOWS = ("gcc-mingw-w64-x86-64", "wine64", "wine")


class StoredKernels(WebAssemblyKernels):
    """Stores the memory and the arguments of the last call of ``run``, and the memory after it."""

    def _call(self, kernel: str, block: bytes) -> None:
        if kernel == "run":
            address, _ = self._place("arguments", len(block))
            ctypes.memmove(self._base + address, block, len(block))
            self.before, self.block = self.memory(), block
        super()._call(kernel, block)
        if kernel == "run":
            self.after = self.memory()

    def memory(self) -> bytes:
        return ctypes.string_at(self._base, self._memory.data_len(self._store))


def address_places(kernel: str) -> list[int]:
    """Where the addresses of arrays stand in the kernel's block of arguments."""
    places, at = [], 0
    for argument in module_arguments()[kernel]:
        if argument.rank:
            places.append(at + 4)
        at += 5 + 2 * argument.rank if argument.rank else 1
    return places


def stored_call(monkeypatch: pytest.MonkeyPatch) -> StoredKernels:
    """A call that steps a crowd for a second, after it has driven for a while."""
    backend = StoredKernels()
    monkeypatch.setattr("motorcade.engine.world.open_backend", lambda name, needed: backend)
    ran(crowd(60), 800).run(1000)
    return backend


def differences(backend: StoredKernels, library: Path, compiler: Path, start: list[str], folder: Path) -> int:
    """How many bytes of the memory differ from WebAssembly's after the call was done by a library of another system."""
    program, stored, made = folder / "call_kernel.exe", folder / "stored", folder / "made"
    subprocess.run(
        [compiler, "-O1", "-o", program, SOURCE, *([] if "mingw" in compiler.name else ["-ldl"])], check=True
    )
    places = address_places("run")
    sizes = len(backend.before), len(backend.block) // 8, len(places)
    numbers = struct.pack("<3q", *sizes), backend.before, backend.block, struct.pack(f"<{len(places)}q", *places)
    stored.write_bytes(b"".join(numbers))
    subprocess.run([*start, program, library, "run", stored, made], check=True, cwd=folder)
    # Below is WebAssembly's stack.
    begin = min(place for place, _ in backend._slots.values())
    pairs = zip(made.read_bytes()[begin:], backend.after[begin:], strict=True)
    return sum(one != other for one, other in pairs)


CASES = {
    "linux-aarch64.so": ("aarch64-linux-gnu-gcc", ARM, ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"]),
    "win32-x86_64.dll": ("x86_64-w64-mingw32-gcc", WINDOWS, ["wine"]),
}


@pytest.mark.soak
@pytest.mark.parametrize("name", list(CASES))
def test_the_library_of_another_computer_gives_the_same_memory(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler_name, packages, (emulator_name, *options) = CASES[name]
    compiler, emulator = (find_or_install(each, *packages) for each in (compiler_name, emulator_name))
    if compiler is None or emulator is None:
        pytest.skip("needs a compiler and an emulator of Debian's")
    backend = stored_call(monkeypatch)
    assert differences(backend, library_path().with_name(name), compiler, [str(emulator), *options], tmp_path) == 0
