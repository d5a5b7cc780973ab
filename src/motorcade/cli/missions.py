"""Commands about missions: missions, check."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.language import Language, current_language, translated
from motorcade.cli.options import (
    Json,
    print_json,
    print_note,
    print_table,
    wants_json,
)
from motorcade.errors import MotorcadeError, Phrase
from motorcade.extras import needs_extra
from motorcade.outcomes import FINE, PROGRAM_ERROR

if TYPE_CHECKING:
    from rich.table import Table

    from motorcade.missions.check import Result
    from motorcade.missions.document import Mission

# In place of a file: the programs that a mission holds itself.
_OWN = ("solution", "near-miss")

app = typer.Typer()


@app.command("missions")
def _missions(language: Language = "", as_json: Json = False) -> None:
    from motorcade.missions.document import missions

    found = missions()
    if wants_json(as_json):
        print_json(
            [
                {
                    "id": each.id,
                    "name": each.name.sentence(current_language()),
                    "path": each.document["path"],
                    "order": each.document["order"],
                    "stars": each.stars,
                }
                for each in found
            ]
        )
    else:
        print_table(_missions_table(found))


@app.command("check")
def _check(
    mission: Annotated[str, typer.Argument(metavar="MISSION")],
    program: Annotated[str, typer.Argument(metavar="PROGRAM")],
    language: Language = "",
    as_json: Json = False,
) -> None:
    from motorcade.missions.document import built_in_mission, read_mission

    wanted = read_mission(Path(mission)) if Path(mission).suffix else built_in_mission(mission)
    with needs_extra("simulating", "world"):
        try:
            result = _result(wanted, program)
        except (MotorcadeError, OSError) as problem:
            reason = problem if isinstance(problem, MotorcadeError) else problem.strerror or problem
            raise MotorcadeError("mission-program-not-valid", file=program, reason=reason) from None
    for note in wanted.beside_mat():
        print_note(note.sentence(current_language()))
    if wants_json(as_json):
        print_json(result.to_dict(current_language()))
    else:
        print_table(_result_table(wanted, result))
    raise typer.Exit(FINE if result.stars else PROGRAM_ERROR)


def _result(mission: "Mission", program: str) -> "Result":
    """Check the program in a file, or one of the mission's own. Raises MotorcadeError or OSError."""
    from motorcade.missions.check import check_image, check_program
    from motorcade.program.diagnostics import ProgramError
    from motorcade.program.files import is_project, read_file, read_project

    path = Path(program)
    if program in _OWN and not path.exists():
        own = mission.solution if program == _OWN[0] else mission.near_miss
        if own is None:
            raise MotorcadeError("mission-has-no-program", key=program)
        return check_program(mission, own)
    data = read_file(path)
    if not is_project(data, path):
        return check_image(mission, data)
    text = read_project(data, path)
    try:
        return check_program(mission, text.program)
    except ProgramError as problem:
        raise ProgramError(text.located(problem.diagnostics)) from None


def _missions_table(found: "tuple[Mission, ...]") -> "Table":
    from rich.table import Table

    table = Table(title=translated("missions-title", count=len(found)), title_justify="left")
    for name in ("path", "mission", "name", "stars"):
        table.add_column(translated(f"column-{name}"), no_wrap=name != "name")
    for each in found:
        path = Phrase(f"mission-path-{each.document['path']}").sentence(current_language())
        table.add_row(path, each.id, each.name.sentence(current_language()), _stars(each.stars))
    return table


def _result_table(mission: "Mission", result: "Result") -> "Table":
    from rich.table import Table

    from motorcade.missions.check import STEPS
    from motorcade.missions.watch import goal_phrase

    language = current_language()
    title = translated("check-title", name=mission.name, stars=_stars(len(result.stars)))
    table = Table(title=title, title_justify="left")
    for name in ("star", "goal", "result", "grade", "time", "why"):
        table.add_column(translated(f"column-{name}"), no_wrap=name not in ("goal", "why"))
    goals = iter(enumerate(mission.goals, start=1))
    for each in result.goals:
        if each.kind == STEPS:
            asked = Phrase("goal-steps").sentence(language)
        else:
            number, goal = next(goals)
            asked = f"{number}. {goal_phrase(goal, mission).sentence(language)}"
        shown = translated("goal-is-met") if each.met else translated("goal-is-lost", seed=each.seed)
        numbers = f"{each.grade:.2f}", f"{each.t_ms / 1000:g}"
        row = (_stars(each.star), asked, shown, *numbers, each.why.sentence(language))
        table.add_row(*row)
    return table


def _stars(count: int) -> str:
    return "★" * count or "–"
