"""The code blocks of a page of the documentation, and a folder in which they run as their reader would run them.

A fence's info string says what a block is:

- ``console``: lines after ``$ `` are commands, run one after the other on a terminal; the other lines must stand in
  what they print, with ``…`` for whatever is in between. Each must end well. Motorcade's own command runs in the
  process of the tests, since a process for each would start Python and import all anew.
- ``{.console .stays}``: the last command is still there for the blocks behind it.
- ``{.console .needs-car}``, ``{.console .needs-board}``: hardware is needed, so each must end by not finding its port.
- ``{.console .installs}``: sets up Motorcade itself. What follows runs with the extras that ``pip install`` names, and
  nothing else. Before that, and on pages without such a block, all that `make setup` installs is there.
- ``python``: run in one namespace a page; behind ``pip install`` each block is a program by itself. With
  ``title="name.py"`` the block is a file first.
- ``{.python .forever}``: run until somebody presses Ctrl-C, which the module ``roverhat`` does.
- ``toml``, ``json``: parsed. With ``title="name.toml"`` the block is written to that file.
- ``text``: no code.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, chdir, contextmanager, nullcontext
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import pytest

from motorcade import __version__
from support.command_line import Terminal, run
from support.page_environment import make_environment
from support.waiting import DEADLINE_S

ROOT = Path(__file__).resolve().parents[2]
PORT_NOT_FOUND = 3
_FENCE = re.compile(r"^( *)```([^`\n]+)\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
_INFO = re.compile(r"^\s*\{?\s*\.?(?P<language>[\w+-]+)")
_TITLE = re.compile(r'title="([^"]+)"')
_CLASS = re.compile(r"\.([a-z-]+)")
_COMMENT = re.compile(r"\s*#.*$", re.MULTILINE)


class Block(NamedTuple):
    """One fenced block.

    Attributes:
        line: where it begins in its page.
        language: console, python, toml, json, text or another one.
        classes: what else its info string says of it.
        title: a file's name, or "".
        text: what stands in it.
    """

    line: int
    language: str
    classes: frozenset[str]
    title: str
    text: str

    @property
    def code(self) -> str:
        """The block without its comments, which are in the page's language."""
        return _COMMENT.sub("", self.text)


def blocks_of(page: Path) -> list[Block]:
    """All code blocks of ``page``, in order."""
    text = page.read_text(encoding="utf-8")
    return [_block(text, match) for match in _FENCE.finditer(text)]


def _block(text: str, match: "re.Match[str]") -> Block:
    indent, info, body = match.groups()
    language = _INFO.match(info)
    assert language, f"a fence says {info!r}"
    title = _TITLE.search(info)
    return Block(
        text.count("\n", 0, match.start()) + 1,
        language["language"],
        frozenset(_CLASS.findall(_TITLE.sub("", info))) - {language["language"]},
        title[1] if title else "",
        "".join(line.removeprefix(indent) for line in body.splitlines(keepends=True)),
    )


class Reader:
    """Somebody who does what a page says, in a folder that has the repository's examples and firmware."""

    def __init__(self, folder: Path, running: ExitStack) -> None:
        self.folder = folder
        self._running = running
        self._namespace: dict[str, object] = {"__name__": "__main__"}
        # What the page installed, and the programs of the environment that it made.
        self._extras: set[str] = set()
        self._programs: Path | None = None
        self._environment = {
            **{name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
            "PATH": _path_with(Path(sys.executable).parent),
            "COLUMNS": "120",
            "NO_COLOR": "1",
            "TERM": "dumb",
            "LANGUAGE": "en",
            "LC_ALL": "C.UTF-8",
            "HOME": str(folder),
        }

    def follow(self, block: Block) -> None:
        """Do what ``block`` says. Raises AssertionError, or what the code raises, where it can't be done."""
        if block.title:
            path = self.folder / block.title
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
        if block.language == "console":
            self._type(block)
        elif block.language == "python" and self._programs:
            file = self.folder / (block.title or f"line-{block.line}.py")
            file.write_text(block.text, encoding="utf-8")
            # A block with a title is run by the reader's own command.
            if not block.title:
                self._run(f"python {file.name}", frozenset())
        elif block.language == "python":
            endless = pytest.raises(KeyboardInterrupt) if "forever" in block.classes else nullcontext()
            with chdir(self.folder), endless:
                exec(compile(block.text, block.title or f"line {block.line}", "exec"), self._namespace)

    def _type(self, block: Block) -> None:
        lines = block.text.replace("\\\n", " ").splitlines()
        commands = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
        assert commands, "a console block has no line that begins with '$ '"
        if "stays" in block.classes:
            *commands, last = commands
            self._running.enter_context(self._staying(last))
        printed = "".join(self._run(command, block.classes) for command in commands)
        shown = [line for line in lines if line.strip() and not line.startswith("$ ")]
        for line in shown if "stays" not in block.classes else ():
            pattern = re.escape(" ".join(line.split())).replace("…", ".*")
            assert re.search(pattern, " ".join(printed.split())), f"{line!r} is not in what was printed:\n{printed}"

    def _run(self, command: str, classes: frozenset[str]) -> str:
        expected = 0
        if classes & {"needs-car", "needs-board"}:
            expected = PORT_NOT_FOUND
        words = shlex.split(command, comments=True)
        if "installs" in classes:
            return self._install(words)
        if words[0] == "motorcade" and not self._programs:
            code, printed = self._in_this_process(words[1:])
        else:
            code, printed = self._on_a_terminal(words)
        assert code == expected, f"'{command}' ended with {code}:\n{printed}"
        return printed

    def _install(self, words: list[str]) -> str:
        """Do what a command that sets up Motorcade does, without a network."""
        if words[0] == "make":
            code, printed = self._on_a_terminal(["make", "--dry-run", "--directory", str(ROOT), *words[1:]])
            assert code == 0, printed
            return printed
        if words[0] == "MOTORCADE_NO_PAGE=1":
            words = words[1:]
        if words[:2] == ["pip", "install"]:
            (what,) = words[2:]
            source, _, extras = what.removesuffix("]").partition("[")
            assert source in (".", f"./motorcade-{__version__}-py3-none-any.whl"), f"what is {source}?"
            self._extras.update(extras.split(","))
            self._programs = make_environment(Path(tempfile.mkdtemp(dir=self.folder)), self._extras)
            self._environment["PATH"] = _path_with(self._programs)
        else:
            assert words in (["python3", "-m", "venv", ".venv"], [".", ".venv/bin/activate"]), f"how is {words} tried?"
        return ""

    def _in_this_process(self, arguments: list[str]) -> tuple[int, str]:
        with chdir(self.folder), mock.patch.dict(os.environ, self._environment):
            ran = run(*arguments, stdout=Terminal())
        return ran.code, ran.out + ran.err

    def _on_a_terminal(self, words: list[str]) -> tuple[int, str]:
        import pty

        reader, writer = pty.openpty()
        with tempfile.TemporaryFile() as nothing:
            process = subprocess.Popen(
                words, cwd=self.folder, env=self._environment, stdin=nothing, stdout=writer, stderr=writer
            )
        os.close(writer)
        parts = []
        try:
            while part := os.read(reader, 65536):
                parts.append(part)
        except OSError:  # how Linux says that the other end of a terminal has left
            pass
        finally:
            os.close(reader)
        return process.wait(timeout=DEADLINE_S), b"".join(parts).decode()

    @contextmanager
    def _staying(self, command: str) -> Iterator[None]:
        """Runs ``command`` until the page ends; it is ready when it has printed its first line."""
        process = subprocess.Popen(
            shlex.split(command, comments=True),
            cwd=self.folder,
            env=self._environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        try:
            assert process.stdout
            line = process.stdout.readline()
            assert line, f"'{command}' printed nothing"
            assert process.poll() is None, f"'{command}' ended: {line}"
            yield
        finally:
            process.kill()
            process.communicate()


def _path_with(programs: Path) -> str:
    return os.pathsep.join([str(programs), os.environ.get("PATH", "")])


def fill_folder(folder: Path) -> None:
    """Copy into ``folder`` what a clone of the repository has and pages speak of."""
    for name in ("examples", "firmware"):
        shutil.copytree(ROOT / name, folder / name)
