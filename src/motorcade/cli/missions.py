"""Commands about missions: missions, check, search."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from motorcade.cli.options import Jobs, NumberOption, own_world, write_file
from motorcade.cli.output import Rows, current_language, print_lines, print_note, print_result, translated, wants_json
from motorcade.cli.runs import ended_by_sentences
from motorcade.config.files import raised_as
from motorcade.errors import MotorcadeError, Phrase
from motorcade.extras import needs_extra
from motorcade.outcomes import FINE, PROGRAM_ERROR

if TYPE_CHECKING:
    from motorcade.missions.check import Result
    from motorcade.missions.model import Mission

# In place of a file: the programs that a mission holds itself.
_OWN = ("solution", "near-miss")

# As motorcade.lab.search.Method, which the command line's start can't import.
Method = Literal["map-elites", "racing", "random"]

app = typer.Typer()


@app.command("missions")
def _missions() -> None:
    from motorcade.missions.document import LITERATURE, missions, shortest_programs

    found = missions() + missions(LITERATURE)
    shortest = shortest_programs()
    language = current_language()
    data = [
        {
            "id": mission.id,
            "name": mission.name.sentence(language),
            "path": mission.document["path"],
            "order": mission.document["order"],
            "stars": mission.stars,
            "shortest": shortest.get(mission.id, {}).get("blocks"),
        }
        for mission in found
    ]
    rows = [
        (
            Phrase(f"mission-path-{row['path']}").sentence(language),
            row["id"],
            row["name"],
            _stars(row["stars"]),
            # What a search has found, and after how many runs.
            translated("shortest-found", **shortest[row["id"]]) if row["id"] in shortest else None,
        )
        for row in data
    ]
    columns = ("path", "mission", "name", "stars", "shortest")
    title = translated("missions-title", count=len(found))
    print_result(data, Rows(columns, rows, ("path", "mission", "stars"), title))


@app.command("check")
def _check(
    mission: Annotated[str, typer.Argument(metavar="MISSION")],
    program: Annotated[str, typer.Argument(metavar="PROGRAM")],
    output: Annotated[Path | None, typer.Option("-o", "--output", dir_okay=False)] = None,
) -> None:
    wanted = _named(mission)
    with needs_extra("simulating", "world"):
        if Path(program).is_dir():
            passed = _check_folder(wanted, Path(program), output)
        else:
            passed = _check_program(wanted, program)
    raise typer.Exit(FINE if passed else PROGRAM_ERROR)


@app.command("search")
def _search(
    mission: Annotated[str, typer.Argument(metavar="MISSION")],
    runs: Annotated[int, typer.Option()] = 1000,
    method: Method = "map-elites",
    output: Annotated[Path | None, typer.Option("-o", "--output", file_okay=False)] = None,
    seed: NumberOption = 0,
    jobs: Jobs = 0,
    scheduler: str = "",
    ahead: Annotated[int, typer.Option(min=1, max=10_000)] = 8,
) -> None:
    wanted = _named(mission)
    folder = output or Path(f"{wanted.id}-search")
    with ended_by_sentences(folder, "search"):
        from motorcade.cli.console import drawing_texts, progress_bar
        from motorcade.lab.run import chosen_workers
        from motorcade.lab.search import Search, do_task, opened_archive
        from motorcade.missions.check import check_program

        search = Search(wanted, method, runs, seed, ahead)
        with opened_archive(folder, search.contents) as archive:
            search.run(archive, chosen_workers(scheduler, jobs, do_task), progress_bar)
            found = [(path, best, check_program(wanted, best.program)) for path, best in search.save_best(folder)]
            picture = folder / "archive.png"
            title = {"name": wanted.name, "runs": search.done, "method": method}
            with drawing_texts():
                search.best.draw(picture, translated("search-title", **title))
            briefest = search.shortest()
            shortest = briefest and briefest.blocks
    best: list[dict[str, Any]] = [
        {
            "file": str(path),
            "grade": result.grade,
            "stars": len(result.stars),
            "blocks": program.blocks,
            "coverage": program.mean.coverage,
            "words_a_minute": program.mean.words,
        }
        for path, program, result in found
    ]
    rows = [
        (
            f"{row['grade']:.4f}",
            _stars(row["stars"]),
            row["blocks"],
            f"{row['coverage']:.0%}",
            f"{row['words_a_minute']:.0f}",
            row["file"],
        )
        for row in best
    ]
    columns = ("grade", "stars", "blocks", "coverage", "words-a-minute", "project")
    data = {"runs": search.done, "shortest": shortest, "picture": str(picture), "best": best}
    print_result(data, Rows(columns, rows, ["project"], translated("search-title", **title)))
    if not wants_json():
        if shortest:
            line = translated("search-shortest", count=shortest)
        else:
            line = translated("search-without-stars")
        print_lines([line, translated("search-is-drawn", picture=picture)])


def _named(mission: str) -> "Mission":
    """The mission with an id, or in a file. Raises MotorcadeError."""
    from motorcade.missions.document import built_in_mission, read_mission

    if Path(mission).suffix:
        return read_mission(Path(mission))
    return built_in_mission(mission)


def _result(mission: "Mission", program: str) -> "Result":
    """Check the program in a file, or one of the mission's own. Raises MotorcadeError or OSError."""
    from motorcade.missions.check import check_program
    from motorcade.missions.report import check_file

    path = Path(program)
    if program in _OWN and not path.exists():
        own = mission.near_miss
        if program == _OWN[0]:
            own = mission.solution
        if own is None:
            raise MotorcadeError("mission-has-no-program", key=program)
        return check_program(mission, own)
    return check_file(mission, path)


def _check_folder(mission: "Mission", folder: Path, output: Path | None) -> bool:
    """Check all files of a folder, write the report, and print it; return whether each has a star."""
    from motorcade.cli.console import progress_bar
    from motorcade.missions.report import REPORTS, checked_file, files_of, to_csv, to_html

    language = current_language()
    base = output or folder / f"{mission.id}{REPORTS[0]}"
    page = base.with_suffix(".html")
    table = base.with_suffix(".csv")
    files = [path for path in files_of(folder) if path not in (page, table)]
    if not files:
        raise MotorcadeError("folder-without-files", folder=folder)
    checked = []
    with progress_bar("checked", len(files)) as advance:
        for path in files:
            checked.append(checked_file(mission, folder, path))
            advance(len(checked))
    write_file(table, to_csv(checked, mission, language).encode(errors="replace"))
    write_file(page, to_html(checked, mission, language).encode(errors="replace"))
    data: list[dict[str, Any]] = []
    cells: list[tuple[str | None, ...]] = []
    for file in checked:
        if isinstance(file.found, MotorcadeError):
            problem = file.found.sentence(language)
            data.append({"file": file.name, "problem": problem, "stars": 0})
            cells.append((file.name, None, problem))
        else:
            found = file.found.to_dict(language)
            data.append({"file": file.name, "problem": None, **found})
            lost = "\n".join(goal["why"] for goal in found["goals"] if not goal["met"])
            cells.append((file.name, _stars(found["stars"]), lost))
    title = translated("check-folder-title", name=mission.name, folder=folder)
    shown = Rows(("file", "stars", "why"), cells, ["stars"], title)
    print_result({"page": str(page), "table": str(table), "files": data}, shown)
    if not wants_json():
        print_lines([translated("check-folder-written", page=page, table=table)])
    return all(file.passes for file in checked)


def _check_program(mission: "Mission", program: str) -> bool:
    """Check one program, and print which goals it meets; return whether it has a star. Raises MotorcadeError."""
    from motorcade.missions.report import asked_goals

    language = current_language()
    with raised_as("mission-program-not-valid", (MotorcadeError, OSError), file=program):
        result = _result(mission, program)
    if Path(program).is_file():
        own = own_world(Path(program)).mat
        if own and own != mission.mat:
            print_note(translated("own-mat-not-checked", file=program, mat=own.name))
    for note in mission.beside_mat():
        print_note(note.sentence(language))
    rows = []
    for asked, goal in asked_goals(mission, result, language):
        met = translated("goal-is-met")
        if not goal.met:
            met = translated("goal-is-lost", seed=goal.seed)
        time = f"{goal.t_ms / 1000:g}"
        rows.append((_stars(goal.star), asked, met, f"{goal.grade:.2f}", time, goal.why.sentence(language)))
    columns = ("star", "goal", "result", "grade", "time", "why")
    title = translated("check-title", name=mission.name, stars=_stars(len(result.stars)))
    print_result(result.to_dict(language), Rows(columns, rows, columns[:1] + columns[2:5], title))
    return bool(result.stars)


def _stars(count: int) -> str:
    return "★" * count or "–"
