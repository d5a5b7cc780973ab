"""Digests of worlds, computed by the Python that a site's page runs: this file also runs in a browser.

A test gives the page a python.zip with this file and `world_hash.py` in it; all else is the site's own.
"""

import base64
import io
import json
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from support.brain_steps import sums
from support.world_hash import page_hash, state_hash

REQUEST = "test/digest"
_HERE = Path(__file__)
_SENT = ("__init__.py", "hashes_in_site.py", "brain_steps.py", "world_hash.py")
_BOOT = "motorcade/browser/shell.py"
_ADDED = """

from support.hashes_in_site import Digests, answering  # noqa: E402

_start = start


def start(open_instance):
    return answering(_start(open_instance), Digests(open_instance))
"""


class Digests:
    """Computes digests where there is engine.wasm and no NumPy.

    Args:
        open_instance: gives each world an instance of engine.wasm of its own.
    """

    def __init__(self, open_instance: Callable[[], Any]) -> None:
        self._open = open_instance

    def world(self, mat: Any, images: list[bytes], profile: Any, seed: int, durations_ms: list[int]) -> list[str]:
        """The digest of a world's state after each duration, which follow each other."""
        from motorcade.browser.kernels import BrowserKernels
        from motorcade.engine.simulation import Simulation

        world = Simulation(mat, images, profile, BrowserKernels(self._open()), seeds=(seed,), events=True)
        return digests(world, durations_ms)

    def page(self, message: Any, duration_ms: int, watched: int) -> str:
        """The digest of all that a page gets from a world."""
        from motorcade.browser.kernels import open_worlds
        from motorcade.service.studio_world import open_world

        return page_hash(open_world(message, 1_000, open_worlds(self._open)), duration_ms, watched)

    def brain(self, seed: int, steps: int) -> list[str]:
        """The sums of what brain, receiver and step do in random steps of cars, all in Python."""
        return sums(seed, steps)


def digests(world: Any, durations_ms: list[int]) -> list[str]:
    """Run a world so long, again and again; the digest of its state after each."""
    found = []
    for duration_ms in durations_ms:
        world.run(duration_ms)
        found.append(state_hash(world))
    return found


def answering(shell: Any, of: Digests) -> Any:
    """The shell, which answers REQUEST too."""
    answer = shell.answer

    def answered(name: str, message: str) -> str:
        if name != REQUEST:
            return str(answer(name, message))
        what, arguments = pickle.loads(base64.b64decode(message))
        return json.dumps(getattr(of, what)(*arguments))

    shell.answer = answered
    return shell


def packed(what: str, *arguments: Any) -> str:
    """The message of REQUEST for one of the methods of `Digests`."""
    return base64.b64encode(pickle.dumps((what, arguments), protocol=4)).decode()


def with_digests(python_zip: bytes) -> bytes:
    """A site's python.zip whose shell answers REQUEST too."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(python_zip)) as archive, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as made:
        for name in archive.namelist():
            made.writestr(name, archive.read(name) + (_ADDED.encode() if name == _BOOT else b""))
        for name in _SENT:
            made.write(_HERE.with_name(name), f"support/{name}")
    return out.getvalue()
