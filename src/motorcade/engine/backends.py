"""Open what runs the kernels of a world: the library of this computer, else WebAssembly; or plain Python."""

import hashlib
import json
import os
from functools import lru_cache

from motorcade.engine.backend import NAMES, Backend, Name
from motorcade.engine.interpreted import InterpretedKernels
from motorcade.engine.native import NativeKernels, library_path
from motorcade.engine.simulation import Simulation
from motorcade.errors import MotorcadeError
from motorcade.mats import formation, open_table
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words, words_to_bytes

# WebAssembly addresses 4 GiB. Arrays that grow leave gaps, and the sizes here are estimates.
_MOST_BYTES = 3 << 30
_PROOF_MS = 2_000
# Beside the libraries: the digest of each, and of the proof.
DIGESTS = "digests.json"


def open_backend(name: Name | None = None, needed_bytes: int = 0) -> Backend:
    """Return what runs one world; for None the library of this computer, or WebAssembly where it can't be used.

    Args:
        name: one of NAMES, or None.
        needed_bytes: the estimated size of the world's arrays.

    Raises:
        MotorcadeError: there is no such backend, its library can't be used, or the world is too large for it.
        ModuleNotFoundError: wasmtime isn't installed.
    """
    if name is not None and name not in NAMES:
        raise MotorcadeError("kernels-unknown", name=name, allowed=", ".join(NAMES))
    if name == "interpreted":
        return InterpretedKernels()
    problem = None if name == "webassembly" else library_problem()
    if problem and name == "native":
        raise problem
    if problem is None and name != "webassembly":
        return NativeKernels()
    if needed_bytes > _MOST_BYTES:
        raise MotorcadeError("world-exceeds-webassembly", needed=needed_bytes / 1e9, most=_MOST_BYTES / 1e9)
    from motorcade.engine.webassembly import WebAssemblyKernels

    return WebAssemblyKernels()


@lru_cache
def library_problem() -> MotorcadeError | None:
    """Return why this computer can't use its library: missing, damaged, not loadable, or wrong; None where it can."""
    path = library_path()
    if not path.exists():
        return MotorcadeError("library-missing", file=path.name)
    digests = json.loads((path.parent / DIGESTS).read_text(encoding="utf-8"))
    # To load a file that was cut off would end the process.
    if hashlib.sha256(path.read_bytes()).hexdigest() != digests[path.name]:
        return MotorcadeError("library-damaged", file=path.name)
    try:
        backend = NativeKernels()
    except (OSError, AttributeError) as problem:
        return MotorcadeError("library-not-loaded", file=path.name, reason=str(problem))
    return None if proof(backend) == digests["proof"] else MotorcadeError("library-differs", file=path.name)


def proof(backend: Backend) -> str:
    """Return a digest of a small world after two seconds: the same for every backend that computes rightly."""
    drives = {"forward": 1, "motor_enable": 1, "motor_duration": 3}
    leader = (CONTROL.encode(**drives, motor_direction=3, motor_speed=3),)
    followers = tuple(CONTROL.encode(accept_ir=1, **drives, motor_direction=k, motor_speed=k) for k in (1, 2, 3))
    image = words_to_bytes(image_words(Image(leader, followers, dwell_level=0, tagged=1)))
    world = Simulation(open_table(formation(12)), [image], None, backend, seeds=(7,))
    world.run(_PROOF_MS)
    digest = hashlib.sha256(repr(sorted(world.totals().items())).encode())
    for column in (world.state.rows, world.state.wheels):
        digest.update(backend.read(column))
    return digest.hexdigest()


def processors() -> int:
    """How many threads a world uses: one for each processor that this process may use."""
    usable = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
    return max(len(usable), 1)
