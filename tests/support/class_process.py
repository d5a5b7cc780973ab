"""The command `motorcade class` in a process of its own."""

import json
import subprocess
import sys
from contextlib import contextmanager

from support.running_studio import stop

COMMAND = [sys.executable, "-m", "motorcade", "class", "--host", "127.0.0.1", "--no-browser", "--json"]


@contextmanager
def started(folder, port=0, *more):
    """A class in a process; how to find it."""
    apart = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP} if sys.platform == "win32" else {}
    process = subprocess.Popen(
        [*COMMAND, "--folder", str(folder), "--port", str(port), *more],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **apart,
    )
    try:
        yield process, json.loads(process.stdout.readline())
    finally:
        stop(process)
