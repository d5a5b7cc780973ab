"""What a page begins with while Python starts: the answers about its first project, and the world of that project.

The world is the memory of engine.wasm before the first tick, and how the kernels that step and show it are called. The
page's JavaScript (`web/src/site/steppedWorld.ts`) writes the few numbers that differ from call to call. It knows
neither the kernels nor where arrays are: that is found here, by running the world and comparing the calls.
"""

import io
import struct
import zipfile
from collections.abc import Sequence
from ctypes import string_at
from itertools import cycle
from typing import Any, NamedTuple

import msgspec

from motorcade.browser.shell import CAPABILITIES
from motorcade.engine.events import COLUMNS, EVENTS
from motorcade.engine.moment import EVENT_BYTES
from motorcade.engine.simulation import Simulation
from motorcade.engine.webassembly import WebAssemblyKernels
from motorcade.service.messages import Blocks, Project
from motorcade.service.programs import compile_blocks
from motorcade.service.studio_world import open_world
from motorcade.service.world_messages import SetWorld
from motorcade.service.world_session import WorldSession

# The world is run for so long, in steps of these lengths, to see what differs, and how much room events need.
_TRIED_MS = 10_000
_STEPS_MS = (20, 60, 200)
_ROW_BYTES = 4 * COLUMNS
_PACKED_AT = (1980, 1, 1, 0, 0, 0)

_NUMBER_BYTES = 8

_Calls = list[tuple[str, bytes]]


class _Sample(NamedTuple):
    """What differed in one of the world's steps or pictures, and the calls of kernels that it took."""

    values: dict[str, int]
    calls: _Calls


class _RecordedKernels(WebAssemblyKernels):
    """Kernels that record their calls."""

    def __init__(self) -> None:
        super().__init__()
        self.heap = self._end
        self._calls: _Calls = []

    def _call(self, kernel: str, block: bytes) -> None:
        self._calls.append((kernel, block))
        super()._call(kernel, block)

    def take_calls(self) -> _Calls:
        """Return the calls since the last time."""
        calls, self._calls = self._calls, []
        return calls

    def address(self, array: Any) -> int:
        """Return the address of an array."""
        described = self._describe(array)
        assert described
        return described.address

    def slot(self, name: str) -> tuple[int, int]:
        """Return the address and the size of a slot."""
        return self._slots[name]

    def contents(self) -> bytes:
        """Return the memory from ``heap`` on."""
        return string_at(self._base + self.heap, self._end - self.heap)


def opening_zip(project: Project) -> bytes:
    """Return the file for a page that opens ``project``: opening.json, and memory.

    opening.json has the project, two requests with their answers (compile, and the world's ``set`` with its first
    ``hello`` and ``state``), and what `_World.recipe` returns. The same project gives the same bytes.
    """
    blocks = Blocks(project.leader, project.followers, project.profile)
    compiled = compile_blocks(blocks)
    assert project.mat, "the first project has a mat"
    message = SetWorld(project.mat, compiled.image, project.profile, range_mm=project.range_mm)
    world = _World(message)
    memory, recipe = world.recipe()
    requests = {"blocks": blocks, "compiled": compiled, "set": message, "answers": world.answers}
    files = {"opening.json": msgspec.json.encode({"project": project, **requests, **recipe}), "memory": memory}
    return zip_of(files)


def zip_of(files: dict[str, bytes]) -> bytes:
    """Return a ZIP archive of files by name. The same files give the same bytes, on every system."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, data in files.items():
            info = zipfile.ZipInfo(name, _PACKED_AT)
            info.external_attr = 0o644 << 16
            info.create_system = 3
            archive.writestr(info, data, zipfile.ZIP_DEFLATED, 9)
    return packed.getvalue()


class _World:
    """A world whose kernels' calls are compared.

    Attributes:
        answers: to the page's ``set``.
    """

    def __init__(self, message: SetWorld) -> None:
        self._kernels = _RecordedKernels()
        self._world = open_world(
            message,
            CAPABILITIES.most_cars,
            lambda mat, images, profile, seeds, events: Simulation(
                mat, images, profile, self._kernels, seeds=seeds, events=events
            ),
        )
        self._simulation = self._world.simulation
        self.answers = WorldSession("", lambda _: self._world).receive(message)

    def recipe(self) -> tuple[bytes, dict[str, Any]]:
        """Return the memory before the first tick, and how to go on from there.

        ``run``, ``take`` and ``show`` list calls of kernels: the name, the address of the block, and for each number
        that differs its address, its part that is constant, and a name (``until``, ``tick`` or ``events``) and factor.
        ``run`` takes at most ``most_ticks``. After it the number at ``count`` says how many ``rows`` of events there
        are: (from, to, bytes of a row, the most that there is room for). Where there are any, they are copied, and
        after ``take`` they are ``packed`` for a picture: (address, bytes of each). After ``show``, the picture's
        columns are at ``picture``: (address, bytes).
        """
        # Once to let each slot become as large as it has to be, and once for what is recorded.
        self._tried()
        self._world.reset(self._simulation.seeds[0])
        memory = bytearray(self._kernels.contents())
        stepped, shown = self._tried()
        run = [_Sample(values, calls[:1]) for values, calls in stepped]
        # Without events the arrays have other strides.
        take = [_Sample(values, calls[1:]) for values, calls in stepped if values["events"]]
        counters, kernels = self._simulation.arrays().counters, self._kernels
        to, room = kernels.slot("taken")
        packed, packed_room = kernels.slot("packed events")
        most = min(room // _ROW_BYTES, packed_room // EVENT_BYTES, counters.events.shape[1])
        moment = self._world.pictures.moment(is_stored=False)
        recipe = {
            "heap": kernels.heap,
            "run": self._calls_of(run, memory),
            "most_ticks": max(sample.values["ticks"] for sample in run),
            "count": kernels.address(counters.counts[0, EVENTS:]),
            "rows": [kernels.address(counters.events), to, _ROW_BYTES, most],
            "take": self._calls_of(take, memory) if take else [],
            "packed": [packed, EVENT_BYTES],
            "show": self._calls_of(shown, memory),
            "picture": [kernels.slot("picture")[0], len(moment)],
        }
        return bytes(memory), recipe

    def _tried(self) -> tuple[list[_Sample], list[_Sample]]:
        """Run the world; return what differed in each step and in each picture, and the calls of kernels."""
        stepped, shown = [], []
        self._kernels.take_calls()
        for step_ms in cycle(_STEPS_MS):
            if self._world.now_ms >= _TRIED_MS:
                break
            tick, ticks = self._simulation.tick, max(step_ms // self._world.tick_ms, 1)
            rows = self._world.run(ticks * self._world.tick_ms)
            values = {"until": tick + ticks, "ticks": ticks, "events": len(rows) // EVENT_BYTES}
            stepped.append(_Sample(values, self._kernels.take_calls()))
            self._world.pictures.moment(is_stored=False)
            shown.append(_Sample({"tick": self._simulation.tick}, self._kernels.take_calls()))
        return stepped, shown

    def _calls_of(self, samples: Sequence[_Sample], memory: bytearray) -> list[Any]:
        """Add a block of arguments for each call to ``memory``; return the calls as in `recipe`."""
        calls = []
        for number, (kernel, block) in enumerate(samples[0].calls):
            memory += bytes(-(self._kernels.heap + len(memory)) % _NUMBER_BYTES)
            address = self._kernels.heap + len(memory)
            memory += block
            form = f"<{len(block) // _NUMBER_BYTES}q"
            numbers = [struct.unpack(form, sample.calls[number][1]) for sample in samples]
            terms = _terms([sample.values for sample in samples], numbers)
            calls.append([kernel, address, [[address + _NUMBER_BYTES * place, *rest] for place, *rest in terms]])
        return calls


def _terms(tried: Sequence[dict[str, int]], rows: Sequence[Sequence[int]]) -> list[tuple[int, int, str, int]]:
    """Return the columns that differ: each one's index, constant part, and the name in ``tried`` and its factor."""
    terms = []
    for place, column in enumerate(zip(*rows, strict=True)):
        if len(set(column)) > 1:
            found = {name: _term([trial[name] for trial in tried], column) for name in tried[0]}
            [(name, (constant, factor))] = ((name, term) for name, term in found.items() if term)
            terms.append((place, constant, name, factor))
    return terms


def _term(values: Sequence[int], column: Sequence[int]) -> tuple[int, int] | None:
    """Return the constant part and the factor by which ``values`` give ``column``; None where they don't."""
    other = next((k for k, value in enumerate(values) if value != values[0]), None)
    if other is None:
        return None
    factor = (column[other] - column[0]) // (values[other] - values[0])
    constant = column[0] - factor * values[0]
    if [constant + factor * value for value in values] == list(column):
        return (constant, factor)
    return None
