"""Every example runs as its reader would run it."""

import json
import runpy
from pathlib import Path

import pytest

from motorcade.program.model import read_program

EXAMPLES = Path(__file__).parent.parent / "examples"
SCRIPTS = sorted({*EXAMPLES.glob("*.py")} - {EXAMPLES / "first_run.py"})
PROJECTS = sorted(EXAMPLES.glob("*.motorcade.json"))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_an_example_runs_and_prints_something(script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(script), run_name="__main__")
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize("project", PROJECTS, ids=lambda path: path.stem)
def test_an_example_project_is_valid_and_names_its_format(project):
    assert read_program(project.read_bytes()).leader
    assert json.loads(project.read_text(encoding="utf-8"))["format"] == "motorcade-program/1"


def test_the_main_job_uploads_verified_and_draws(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(EXAMPLES / "first_run.py"), run_name="__main__")
    printed = " ".join(capsys.readouterr().out.split())
    assert "Verified, the car answered: OK words=7 crc32=" in printed
    picture = tmp_path / "build" / "parade.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
