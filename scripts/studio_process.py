"""A studio in a process of its own, as a user starts it, for tests, benchmarks and screenshots of its page."""

import base64
import json
import random
import socket
import subprocess
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import hatch_build

ROOT = Path(__file__).resolve().parent.parent


def build_page() -> None:
    """Build the page where it is missing or older than its sources."""
    if hatch_build.is_stale(ROOT):
        hatch_build.npm_run(ROOT, "build")


def project_link(url: str, project: dict[str, Any] | str, name: str = "") -> str:
    """A link that opens the project in the studio at ``url``, in the format of the page's own links.

    Args:
        project: the project, or the text of its file.
    """
    packer = zlib.compressobj(level=9, wbits=-zlib.MAX_WBITS)
    file = project if isinstance(project, str) else json.dumps(project)
    packed = packer.compress(json.dumps({"name": name, "text": file}).encode()) + packer.flush()
    return f"{url}#project={base64.urlsafe_b64encode(packed).decode().rstrip('=')}"


def free_port() -> int:
    """A port of this computer that nobody has, nor the one behind it.

    It is below the ports that systems give to whoever asks for any: while a server is away that will come back at this
    port, no other program gets it.
    """
    while True:
        port = random.randrange(20_000, 32_000)
        with socket.socket() as first, socket.socket() as second, suppress(OSError):
            first.bind(("127.0.0.1", port))
            second.bind(("127.0.0.1", port + 1))
            return port


class StudioProcess:
    """``motorcade studio`` with projects in ``library``, at a port that stays the same after a restart.

    ``url`` is the whole address of its page, ``base`` the same without the token.
    """

    def __init__(self, library: Path, python: str, environment: dict[str, str] | None) -> None:
        self.library = library
        self.url = self.base = ""
        self._python = python
        self._environment = environment
        self._port = free_port()

    def start(self) -> None:
        """Start it, and return once it answers; sets `url`. Raises RuntimeError where it ends before."""
        command = [self._python, "-m", "motorcade", "studio", "--port", str(self._port), "--library", str(self.library)]
        self._process = subprocess.Popen(
            [*command, "--no-browser", "--json"], stdout=subprocess.PIPE, env=self._environment, encoding="utf-8"
        )
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the studio ended with {self._process.wait()} before it was ready")
        self.url = json.loads(line)["url"]
        self.base = self.url.partition("?")[0]

    def kill(self) -> None:
        """End it at once, as a crash would."""
        with self._process as process:
            process.kill()


@contextmanager
def running_studio(
    library: Path, python: str = sys.executable, environment: dict[str, str] | None = None
) -> Iterator[StudioProcess]:
    """A studio that runs for the length of a ``with`` block."""
    studio = StudioProcess(library, python, environment)
    studio.start()
    try:
        yield studio
    finally:
        studio.kill()
