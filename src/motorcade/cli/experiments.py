"""The command about large experiments: sweep.

It imports what it needs when it runs, so that the other commands start at once.
"""

import dataclasses
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.language import Language, resolve_locale
from motorcade.cli.options import Json, image_of, print_json, print_text, wants_json
from motorcade.errors import MotorcadeError
from motorcade.locales import command_line_text

if TYPE_CHECKING:
    from motorcade.config.profile import Profile
    from motorcade.experiments.plan import Plan
    from motorcade.experiments.spec import Sweep
    from motorcade.mats import Mat

STOPPED = 130


def add_to(app: typer.Typer) -> None:
    """Register the command."""
    app.command()(sweep)


def sweep(
    spec: Annotated[Path, typer.Argument(metavar="SPEC.toml", exists=True, dir_okay=False, readable=True)],
    output: Annotated[Path, typer.Option("-o", "--output", dir_okay=False, help="The table, a Parquet file.")],
    jobs: Annotated[int, typer.Option(min=0, max=1024, help="How many processes at once; 0: one a core.")] = 0,
    scheduler: Annotated[str, typer.Option(help="Run on the Dask cluster at tcp://HOST:PORT instead.")] = "",
    picture: Annotated[Path | None, typer.Option(help="Draw the table into this PNG, SVG or PDF file.")] = None,
    x: Annotated[str, typer.Option(help="The picture's axis to the right: a parameter, program or mat.")] = "",
    y: Annotated[str, typer.Option(help="Its axis upwards: a measure, or with --colour a parameter.")] = "",
    colour: Annotated[str, typer.Option(help="A measure to colour it by.")] = "",
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Run programs on mats with many parameters and seeds, and make a table with a row for each run.

    After a stop, the same command continues.
    """
    if len({bool(each) for each in (picture, x, y)}) > 1 or (colour and not picture):
        raise MotorcadeError("picture-needs-options")
    language = resolve_locale(language)
    with _ended_by_sentences(output, language):
        plan = _plan(spec, language)
        if picture:
            from motorcade.experiments.picture import check_picture

            check_picture(plan.sweep, picture, x, y, colour)
        ran = _run(plan, output, jobs, scheduler)
        if picture:
            from motorcade.experiments.picture import draw_sweep

            draw_sweep(plan.sweep, output, picture, x, y, colour)
    if wants_json(as_json):
        result = {"runs": plan.runs, "tasks": plan.tasks, "tasks_run": ran, "table": str(output)}
        print_json(result | ({"picture": str(picture)} if picture else {}))
        return
    key = "sweep-is-done" if ran == plan.tasks else "sweep-was-done"
    lines = [command_line_text(key, language, runs=plan.runs, table=output, done=plan.tasks - ran, tasks=plan.tasks)]
    if picture:
        lines.append(command_line_text("sweep-is-drawn", language, picture=picture))
    print_text("".join(f"{line}\n" for line in lines))


def _plan(spec: Path, language: str) -> "Plan":
    from motorcade import __version__
    from motorcade.cli.console import progress_bar
    from motorcade.experiments.plan import Plan
    from motorcade.experiments.spec import read_sweep

    try:
        wanted = read_sweep(spec)
    except MotorcadeError as problem:
        raise MotorcadeError("sweep-not-valid", reason=problem) from None
    programs = [_program(spec, index, wanted, language) for index in range(len(wanted.programs))]
    mats = [_mat(spec, index, wanted) for index in range(len(wanted.mats))]
    with progress_bar("checked", wanted.cells) as advance:
        return Plan(wanted, programs, mats, __version__, advance)


def _run(plan: "Plan", output: Path, jobs: int, scheduler: str) -> int:
    from motorcade.cli.console import progress_bar
    from motorcade.experiments.run import on_a_cluster, on_this_computer, run_sweep

    workers = on_a_cluster(scheduler) if scheduler else on_this_computer(jobs)
    return run_sweep(plan, output, workers, progress_bar)


def _program(spec: Path, index: int, wanted: "Sweep", language: str) -> "tuple[bytes, Profile]":
    """Read one of the programs that a sweep names: its image and its cars' profile."""
    from motorcade.words.image import ImageError

    name = wanted.programs[index]
    place = f"{spec.name}: programs[{index}], '{name}'"
    profile_name = wanted.profile
    if profile_name.endswith(".toml"):
        profile_name = str(spec.parent / profile_name)
    try:
        image, profile = image_of(spec.parent / name, profile_name, language)
    except OSError as problem:
        raise MotorcadeError("sweep-program-unreadable", place=place, reason=problem.strerror) from None
    except ImageError as problem:
        raise MotorcadeError("not-a-program", place=place, reason=problem) from None
    except typer.Exit:
        print(f"motorcade: {command_line_text('sweep-program-has-errors', language, place=place)}", file=sys.stderr)
        raise
    return image, dataclasses.replace(profile, name=Path(profile.name).name)


def _mat(spec: Path, index: int, wanted: "Sweep") -> "Mat | None":
    """Read one of the mats that a sweep names; None for the empty table."""
    from motorcade.experiments.spec import EMPTY_TABLE
    from motorcade.mats import read_mat

    name = wanted.mats[index]
    if name == EMPTY_TABLE:
        return None
    try:
        return read_mat(spec.parent / name)
    except MotorcadeError as problem:
        raise MotorcadeError("sweep-mat-not-valid", place=f"{spec.name}: mats[{index}]", reason=problem) from None


@contextmanager
def _ended_by_sentences(output: Path, language: str) -> Iterator[None]:
    """Print a sentence for all that ends a sweep early: a missing library, Ctrl-C, a failing disk."""
    try:
        yield
    except ModuleNotFoundError as problem:
        extra = "cluster" if problem.name in ("dask", "distributed") else "sim"
        raise MotorcadeError("missing-library", library=problem.name, extra=extra) from None
    except KeyboardInterrupt:
        print(f"motorcade: {command_line_text('sweep-is-stopped', language, table=output)}", file=sys.stderr)
        raise typer.Exit(STOPPED) from None
    except OSError as problem:
        reason = problem.strerror or problem
        raise MotorcadeError("file-not-usable", file=problem.filename or output, reason=reason) from None
