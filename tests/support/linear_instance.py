"""An instance of engine.wasm as a browser's worker passes it to Python, made of wasmtime."""

import ctypes
from functools import cache
from typing import Any, cast

import wasmtime

from motorcade.engine.linear_memory import PATH, section_text

_PAGE = 1 << 16


@cache
def _compiled() -> tuple[wasmtime.Engine, wasmtime.Module]:
    """The compiled module. Not at import: every process that runs tests imports this file."""
    engine = wasmtime.Engine()
    return engine, wasmtime.Module(engine, PATH.read_bytes())


class MockView:
    """Bytes of the memory, with the methods that Pyodide gives a Uint8Array."""

    def __init__(self, place: Any) -> None:
        self._place = place

    def to_bytes(self) -> bytes:
        return bytes(self._place)

    def assign(self, contents: Any) -> None:
        assert memoryview(contents).nbytes == len(self._place)
        self._place[:] = bytes(contents)


class MockInstance:
    """What `web/src/site/engine.ts` gives; ``calls`` counts the calls by name."""

    def __init__(self) -> None:
        engine, module = _compiled()
        self._store = wasmtime.Store(engine)
        # The module decides what each of its exports is.
        self._exports = cast(Any, wasmtime.Instance(self._store, module, []).exports(self._store))
        self._memory = self._exports["memory"]
        self.heap = self._exports["__heap_base"].value(self._store)
        self.section = section_text()
        self.calls: list[str] = []

    def grow(self, end: int) -> bool:
        self.calls.append("grow")
        missing = end - self._memory.data_len(self._store)
        if missing > 0:
            try:
                self._memory.grow(self._store, -(-missing // _PAGE))
            except wasmtime.WasmtimeError:
                return False
        return True

    def _at(self, address: int, size: int) -> Any:
        assert 0 <= address <= address + size <= self._memory.data_len(self._store)
        base = ctypes.addressof(self._memory.data_ptr(self._store).contents)
        return (ctypes.c_ubyte * size).from_address(base + address)

    def view(self, address: int, size: int) -> MockView:
        self.calls.append("view")
        return MockView(self._at(address, size))

    def clear(self, address: int, size: int) -> None:
        self.calls.append("clear")
        ctypes.memset(self._at(address, size), 0, size)

    def call(self, kernel: str, address: int) -> None:
        self.calls.append(kernel)
        assert self._exports[kernel](self._store, address) == 0
