"""Run the programs of the missions' usual mistakes: src/motorcade/missions/mistakes.json.

    python -m scripts.usual_mistakes

The first mistake of a mission's notes is its near miss, the others are the `noted` programs of
tests/missions/programs.toml. It takes about a minute.
"""

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from motorcade.missions.check import Mistake, check_program
from motorcade.missions.document import missions
from motorcade.missions.model import Mission
from motorcade.program.model import Program
from motorcade.program.python_calls import STEP_NAMES
from motorcade.program.python_reader import read_python

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "src" / "motorcade" / "missions" / "mistakes.json"
PROGRAMS: dict[str, Any] = tomllib.loads((ROOT / "tests" / "missions" / "programs.toml").read_text(encoding="utf-8"))
_IMPORT = f"from motorcade import Followers, Program, {', '.join(STEP_NAMES)}"


def program_of(line: str) -> Program:
    """The program of a line, or of a text as pupils write it."""
    if "def leader" in line:
        return read_python(f"from motorcade import *\n\n{line}").program
    leader, followers, settings = ([part.strip() for part in line.split("|")] + ["", ""])[:3]
    told = f", followers=Followers([{followers}], {settings})" if followers else ""
    return read_python(f"{_IMPORT}\nprogram = Program(leader=[{leader}]{told})\n").program


def noted_programs(mission: Mission) -> Iterator[Program]:
    """The programs of the mistakes in a mission's notes, in their order."""
    assert mission.near_miss is not None
    yield mission.near_miss
    known = PROGRAMS[mission.id]
    for number in known["noted"]:
        yield program_of(known["wrong"][number])


def main() -> None:
    """Write how they fail."""
    lines = []
    for mission in sorted(missions(), key=lambda mission: mission.id):
        programs = noted_programs(mission)
        failures = [Mistake.of(check_program(mission, program), program) for program in programs]
        lines.append(f"{json.dumps(mission.id)}: {json.dumps(failures)}")
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
