"""The command `motorcade studio` in a process of its own."""

import json
import signal
import subprocess
import sys
from contextlib import contextmanager
from types import SimpleNamespace


@contextmanager
def started(folder, *more):
    """A studio in a process of its own; it is stopped by Ctrl-C."""
    command = [sys.executable, "-m", "motorcade", "studio", "--port", "0", "--no-browser", "--json"]
    # On Windows only a process group of its own can be sent a Ctrl-C.
    apart = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP} if sys.platform == "win32" else {}
    process = subprocess.Popen(
        [*command, "--library", str(folder), *more],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **apart,
    )
    try:
        told = json.loads(process.stdout.readline())
        port = int(told["url"].partition("//")[2].partition("/")[0].rpartition(":")[2])
        base, _, token = told["url"].partition("?token=")
        yield SimpleNamespace(
            process=process,
            url=told["url"],
            base=base,
            cookie={"Cookie": f"motorcade_{port}={token}"},
            library=told["library"],
            port=port,
        )
    finally:
        stop(process)


def stop(process):
    if process.poll() is None:
        process.send_signal(signal.CTRL_BREAK_EVENT if sys.platform == "win32" else signal.SIGINT)
    return process.communicate(timeout=60)
