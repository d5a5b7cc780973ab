"""Run the command line in this process, as its installed script does."""

import contextlib
import io
import json
import os
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import pytest

from motorcade.cli import main

INSTALLED = shutil.which("motorcade", path=str(Path(sys.executable).parent))
PARADE = Path(__file__).parents[2] / "examples" / "parade.motorcade.json"


class Terminal(io.StringIO):
    """A stream at whose other end is somebody."""

    def isatty(self):
        return True


def run(*arguments, stdout=None, typed=None):
    """The command in this process; a traceback fails the test. Somebody who typed something sits at a terminal."""
    out, err = stdout or io.StringIO(), io.StringIO() if typed is None else Terminal()
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        mock.patch.object(sys, "argv", ["motorcade", *map(str, arguments)]),
        mock.patch.object(sys, "stdin", io.StringIO() if typed is None else Terminal(typed)),
        mock.patch.dict(os.environ, COLUMNS="160"),
        pytest.raises(SystemExit) as left,
    ):
        main()
    return SimpleNamespace(code=left.value.code, out=out.getvalue(), err=err.getvalue())


def data(*arguments):
    """The JSON that a command prints, and nothing else."""
    ran = run(*arguments)
    assert (ran.code, ran.err) == (0, "")
    return json.loads(ran.out)


def refusal(code, *arguments):
    """The one sentence that a command gives in place of its output."""
    ran = run(*arguments)
    assert (ran.code, ran.out) == (code, "")
    (line,) = ran.err.strip().splitlines()
    assert line.startswith("motorcade: ")
    return line.removeprefix("motorcade: ")
