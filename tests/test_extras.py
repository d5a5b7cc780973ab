"""What a command or a Python program needs beyond Motorcade itself: the sentence, and that what it names suffices."""

import importlib.metadata
import json
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from motorcade import extras
from motorcade.extras import install_command
from support.command_line import PARADE, started
from support.page_environment import make_environment

ROOT = Path(__file__).parents[1]
posix_only = pytest.mark.skipif(sys.platform == "win32", reason="links need rights on Windows")
SIMULATE = ("simulate", str(PARADE), "--seconds", "0.1")
SHOW = f"from motorcade import *; show(read_program(open({str(PARADE)!r}, 'rb').read()), seconds=0.1, picture='a.png')"


@pytest.fixture(scope="module")
def programs_with(tmp_path_factory):
    """The programs of an environment with some extras."""

    @cache
    def made(*names):
        return make_environment(tmp_path_factory.mktemp("environment"), names)

    return made


def run(programs, words, folder):
    return subprocess.run([programs / words[0], *words[1:]], cwd=folder, capture_output=True, text=True, check=False)


@posix_only
@pytest.mark.parametrize(
    ("words", "needed"),
    [
        (("motorcade", *SIMULATE), ("world",)),
        (("motorcade", *SIMULATE, "--record", "a.svg"), ("world", "runs")),
        (("motorcade", "drive", "serve", "--port", "0", "--mat", str(PARADE)), ("world",)),
        (("motorcade", "drive", "keys", "keys", "--driver", "lin"), ("drive",)),
        # Whatever the studio needs is imported before these options exclude each other.
        (("motorcade", "studio", "--insecure-lan", "--https", "none.pem"), ("studio",)),
        (("motorcade", "install-firmware", "--dry-run", "--chip", "rp2040"), ("firmware",)),
        (("python", "-c", "from motorcade.lab import parallel_env"), ("lab",)),
        (("python", "-c", SHOW), ("world", "runs")),
    ],
    ids=lambda value: " ".join(value)[:40],
)
def test_what_a_sentence_names_is_enough(words, needed, programs_with, tmp_path):
    for count, extra in enumerate(needed):
        ran = run(programs_with(*needed[:count]), words, tmp_path)
        last = ran.stderr.splitlines()[-1]
        assert (ran.returncode != 0, re.findall(r"\[(.*)\]", last)) == (True, [extra])
        assert words[0] == "python" or ran.stderr.count("\n") == 1
    assert "needs" not in run(programs_with(*needed), words, tmp_path).stderr


@posix_only
def test_the_studio_starts_with_its_extra_alone(programs_with, tmp_path):
    program = (programs_with("studio") / "motorcade",)
    with started("studio", "--port", "0", "--no-browser", "--library", tmp_path, program=program) as (_, told):
        assert told["library"] == str(tmp_path)


class Installed:
    """A distribution that pip installed from somewhere."""

    def __init__(self, record):
        self.record = record

    def read_text(self, name):
        assert name == "direct_url.json"
        return self.record and json.dumps(self.record)


def test_the_command_installs_from_where_motorcade_came(monkeypatch, tmp_path):
    def command(record):
        monkeypatch.setattr(importlib.metadata, "distribution", lambda name: Installed(record))
        return str(install_command("runs"))

    monkeypatch.setattr(extras.shutil, "which", lambda name: str(Path(sys.executable).with_name("pip")))
    clone, wheel = tmp_path / "a clone", tmp_path / "motorcade-0.1.0-py3-none-any.whl"
    clone.mkdir()
    wheel.touch()
    assert command(None) == 'pip install "motorcade[runs]"'
    assert command({"url": clone.as_uri(), "dir_info": {}}) == f'pip install "{clone}[runs]"'
    assert command({"url": clone.as_uri(), "dir_info": {"editable": True}}) == f'pip install -e "{clone}[runs]"'
    assert command({"url": wheel.as_uri(), "archive_info": {}}) == f'pip install "{wheel}[runs]"'
    wheel.unlink()
    sentence = command({"url": wheel.as_uri(), "archive_info": {}})
    assert '".[runs]"' in sentence
    assert '.whl[runs]"' in sentence
    monkeypatch.setattr(extras.shutil, "which", lambda name: "/usr/bin/pip")
    monkeypatch.setattr(sys, "executable", "/home/ada/.venv/bin/python")
    assert command(None) == '/home/ada/.venv/bin/python -m pip install "motorcade[runs]"'
