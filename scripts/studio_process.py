"""A studio of its own process, as a user starts it: for what looks at its page from outside."""

import base64
import json
import subprocess
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import hatch_build

ROOT = Path(__file__).resolve().parent.parent


def build_page() -> None:
    """Builds the page where it is missing or older than its sources."""
    if hatch_build.is_stale(ROOT):
        hatch_build.npm_run(ROOT, "build")


def project_link(url: str, project: dict[str, Any], name: str = "") -> str:
    """A link like those that the page shares: it opens the project in the studio at ``url``."""
    packer = zlib.compressobj(wbits=-zlib.MAX_WBITS)
    text = json.dumps({"name": name, "text": json.dumps(project)})
    packed = packer.compress(text.encode()) + packer.flush()
    return f"{url}#project={base64.urlsafe_b64encode(packed).decode().rstrip('=')}"


class StudioProcess:
    """``motorcade studio`` with projects in ``library``, on a free port that it keeps when it is started again."""

    def __init__(self, library: Path, python: str, environment: dict[str, str] | None) -> None:
        self.library = library
        self.url = ""
        self._python = python
        self._environment = environment
        self._port = "0"

    def start(self) -> None:
        """Returns once it answers, with `url` set."""
        command = [self._python, "-m", "motorcade", "studio", "--port", self._port, "--library", str(self.library)]
        self._process = subprocess.Popen(
            [*command, "--no-browser", "--json"], stdout=subprocess.PIPE, env=self._environment, encoding="utf-8"
        )
        assert self._process.stdout
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the studio ended with {self._process.wait()} before it was ready")
        self.url = json.loads(line)["url"]
        self._port = self.url.rstrip("/").rpartition(":")[2]

    def kill(self) -> None:
        """Ends it as a crash does: it can do nothing about it."""
        with self._process as process:
            process.kill()


@contextmanager
def running_studio(
    library: Path, python: str = sys.executable, environment: dict[str, str] | None = None
) -> Iterator[StudioProcess]:
    """A studio from the first line to the last of a ``with``."""
    studio = StudioProcess(library, python, environment)
    studio.start()
    try:
        yield studio
    finally:
        studio.kill()
