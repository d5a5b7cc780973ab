"""Each mission takes programs that do what it asks, however they are written, and refuses those that don't."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from motorcade.missions.check import check_program
from motorcade.missions.document import missions
from motorcade.program.python_reader import STEP_NAMES, read_python
from support.soak import SOAK

PROGRAMS = tomllib.loads(Path(__file__).with_name("programs.toml").read_text(encoding="utf-8"))
MISSIONS = {each.id: each for each in missions()}
_IMPORT = f"from motorcade import Followers, Program, {', '.join(STEP_NAMES)}"


def program_of(line):
    leader, followers, settings = ([part.strip() for part in line.split("|")] + ["", ""])[:3]
    told = f", followers=Followers([{followers}], {settings})" if followers else ""
    return read_python(f"{_IMPORT}\nprogram = Program(leader=[{leader}]{told})\n").program


def judged(mission, lines):
    """Which of the programs earn the first star; by the first seed alone unless there is time for all."""
    if not SOAK:
        mission = replace(mission, document={**mission.document, "seeds": mission.document["seeds"][:1]})
    return [line for line in lines if 1 in check_program(mission, program_of(line)).stars]


def test_every_mission_has_three_right_programs_and_five_wrong_ones():
    assert set(PROGRAMS) == set(MISSIONS)
    for each in PROGRAMS.values():
        assert (len({*each["right"]}), len({*each["wrong"]})) >= (3, 5)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.soak] * (len(MISSIONS[name].mat.starts) >= 100)) for name in MISSIONS],
)
def test_what_does_the_task_earns_its_star_and_what_does_not_earns_none(name):
    assert judged(MISSIONS[name], PROGRAMS[name]["right"]) == PROGRAMS[name]["right"]
    assert judged(MISSIONS[name], PROGRAMS[name]["wrong"]) == []


@pytest.mark.parametrize("name", MISSIONS)
def test_the_mistakes_in_the_notes_are_the_near_miss_and_wrong_programs(name):
    """Both are known to earn no star: what the notes tell of does go wrong."""
    noted = PROGRAMS[name]["noted"]
    assert 0 <= min(noted) <= max(noted) < len(PROGRAMS[name]["wrong"])
    assert len(MISSIONS[name].notes.mistakes) == 1 + len(set(noted))
