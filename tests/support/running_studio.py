"""Commands of Motorcade that serve pages, in processes of their own."""

import json
import subprocess
import sys
from contextlib import contextmanager
from subprocess import PIPE
from types import SimpleNamespace

from support.command_line import CTRL_C, OWN_GROUP
from support.waiting import DEADLINE_S


@contextmanager
def serving(*command):
    """A command that serves pages, in a process of its own, and what it says when it is ready; Ctrl-C stops it."""
    whole = [sys.executable, "-m", "motorcade", *map(str, command), "--no-browser", "--json"]
    process = subprocess.Popen(whole, stdout=PIPE, stderr=PIPE, text=True, creationflags=OWN_GROUP)
    assert process.stdout
    try:
        yield process, json.loads(process.stdout.readline())
    finally:
        stop(process)


@contextmanager
def started(folder, *more):
    """A studio in a process of its own."""
    with serving("studio", "--port", 0, "--library", folder, *more) as (process, told):
        port = int(told["url"].partition("//")[2].partition("/")[0].rpartition(":")[2])
        base, _, token = told["url"].partition("?token=")
        cookie = {"Cookie": f"motorcade_{port}={token}"}
        yield SimpleNamespace(process=process, base=base, cookie=cookie, port=port, **told)


@contextmanager
def started_class(folder, port=0, *more):
    """A class in a process; how to find it."""
    with serving("class", "--host", "127.0.0.1", "--folder", folder, "--port", port, *more) as found:
        yield found


def stop(process):
    if process.poll() is None:
        process.send_signal(CTRL_C)
    return process.communicate(timeout=DEADLINE_S)
