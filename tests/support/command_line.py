"""Run the command line: in this process, as its installed script does, or in a process of its own."""

import contextlib
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from functools import cache
from pathlib import Path
from subprocess import PIPE
from types import SimpleNamespace
from unittest import mock

import pytest

from motorcade import cli
from support.waiting import DEADLINE_S

_PROGRAMS = str(Path(sys.executable).parent)
INSTALLED = shutil.which("motorcade", path=_PROGRAMS) or f"{_PROGRAMS}/motorcade"
# On Windows only a process group of its own can be sent a Ctrl-C.
if sys.platform == "win32":
    OWN_GROUP, CTRL_C = subprocess.CREATE_NEW_PROCESS_GROUP, signal.CTRL_BREAK_EVENT
else:
    OWN_GROUP, CTRL_C = 0, signal.SIGINT
PARADE = Path(__file__).parents[2] / "examples" / "parade.motorcade.json"


# To put all commands together takes longer than most of them run. Asked for help they change, so not for that.
_commands = cache(cli.command_line)


class Terminal(io.StringIO):
    """A stream at whose other end is somebody."""

    def isatty(self):
        return True


def run(*arguments, stdout=None, typed=None):
    """The command in this process; a traceback fails the test. Somebody who typed something sits at a terminal."""
    out, err = stdout or io.StringIO(), io.StringIO() if typed is None else Terminal()
    asks_for_help = not arguments or {"-h", "--help"} & set(arguments)
    with (
        mock.patch.object(cli, "command_line", cli.command_line if asks_for_help else _commands),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        mock.patch.object(sys, "argv", ["motorcade", *map(str, arguments)]),
        # Under `python -m pytest` the command would be named after that.
        mock.patch.object(sys.modules["__main__"], "__package__", None, create=True),
        mock.patch.object(sys, "stdin", io.StringIO() if typed is None else Terminal(typed)),
        mock.patch.dict(os.environ, COLUMNS="160"),
        pytest.raises(SystemExit) as left,
    ):
        cli.main()
    return SimpleNamespace(code=left.value.code, out=out.getvalue(), err=err.getvalue())


def data(*arguments):
    """The JSON that a command prints, and nothing else."""
    ran = run("--json", *arguments)
    assert (ran.code, ran.err) == (0, "")
    return json.loads(ran.out)


def refusal(code, *arguments):
    """The one sentence that a command gives in place of its output."""
    ran = run(*arguments)
    assert (ran.code, ran.out) == (code, "")
    (line,) = ran.err.strip().splitlines()
    assert line.startswith("motorcade: ")
    return line.removeprefix("motorcade: ")


def imported_by(*arguments):
    """The modules that the installed command imports, by Python's own report."""
    reporting = {**os.environ, "PYTHONPROFILEIMPORTTIME": "1"}
    ran = subprocess.run(
        [INSTALLED, *arguments], env=reporting, capture_output=True, text=True, check=True, timeout=DEADLINE_S
    )
    return {line.rpartition("|")[2].strip() for line in ran.stderr.splitlines() if line.startswith("import time:")}


@contextlib.contextmanager
def started(*arguments, program=(sys.executable, "-m", "motorcade")):
    """A command in a process of its own, and the line of JSON by which it says that it is ready; it is killed at last.

    ``program`` is what starts the command line.
    """
    command = [*map(str, (*program, *arguments)), "--json"]
    with subprocess.Popen(
        command, stdin=PIPE, stdout=PIPE, stderr=PIPE, creationflags=OWN_GROUP, encoding="utf-8"
    ) as process:
        assert process.stdout
        assert process.stderr
        # Whoever waits for what it never says shall see it end; a test waits several times.
        patience = threading.Timer(4 * DEADLINE_S, process.kill)
        patience.start()
        try:
            line = process.stdout.readline()
            assert line, process.stderr.read()
            yield process, json.loads(line)
        finally:
            patience.cancel()
            process.kill()
