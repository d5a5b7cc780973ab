"""Commands about simulated runs: simulate, replay, plot, sweep."""

import dataclasses
import heapq
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli import options
from motorcade.cli.output import (
    print_json,
    print_lines,
    print_note,
    print_problem,
    print_result,
    print_table,
    sentence_of,
    translated,
    wants_json,
)
from motorcade.config.files import raised_as, read_bytes
from motorcade.errors import InputError, MotorcadeError
from motorcade.extras import needs_extra
from motorcade.outcomes import PROGRAM_ERROR, STOPPED

if TYPE_CHECKING:
    from motorcade.config.profile import Profile
    from motorcade.lab.plan import Plan
    from motorcade.lab.spec import Sweep
    from motorcade.mats import Mat
    from motorcade.runs.recording import Recording

# Kinds of events that come many times a second.
_ON_THE_AIR = ("frame", "heard")

app = typer.Typer()
RunFile = Annotated[Path, typer.Argument(metavar="RUN")]


@app.command("simulate")
def _simulate(
    source: options.SourceArgument,
    followers: Annotated[int | None, typer.Option(min=0, max=10_000)] = None,
    seconds: Annotated[float, typer.Option(min=0, max=86400)] = 30,
    seed: options.NumberOption = 0,
    mat: Path | None = None,
    record: list[Path] | None = None,
    profile: options.ImageProfile = None,
) -> None:
    image, chosen = options.image_for(source, profile)
    if math.isnan(seconds):
        raise InputError("option-not-allowed", option="--seconds", value="nan", allowed="0 to 86400")
    if mat and followers is not None:
        raise MotorcadeError("followers-with-mat")
    files = record or []
    with needs_extra("simulating", "world"):
        from motorcade.cli.console import drawing_texts, progress_bar
        from motorcade.cli.run_tables import print_unheard, run_as_dict, run_tables
        from motorcade.mats import read_mat
        from motorcade.runs.recording import DATA_ENDING
        from motorcade.runs.running import simulate
        from motorcade.service.calibration import driven_as
        from motorcade.words.image import parse_image_bytes

        own = options.own_world(source)
        if mat:
            place = read_mat(mat)
        elif own.mat and followers is not None:
            print_note(translated("own-mat-not-used", mat=own.mat.name))
            place = None
        else:
            place = own.mat
        if own.range_mm and place is own.mat:
            chosen = dataclasses.replace(chosen, infrared=dataclasses.replace(chosen.infrared, range_mm=own.range_mm))
        chosen = driven_as(chosen, own.car)
        if followers is None:
            followers = 0
            if parse_image_bytes(image).followers:
                followers = 5
        drawings = [path for path in files if path.suffix.lower() != DATA_ENDING]
        total_ms = round(seconds * 1000) * (1 + len(drawings))
        with progress_bar("done", total_ms) as advance, drawing_texts() if drawings else nullcontext():
            run = simulate(image, followers, seconds, seed, chosen, place, files, advance)
    print_unheard(run)
    if wants_json():
        print_json(run_as_dict(run))
    else:
        print_table(run_tables(run))


@app.command("replay")
def _replay(run: RunFile, output: options.OptionalOutput = None) -> None:
    with needs_extra("replaying", "runs"):
        from motorcade.runs.recorder import open_recording

        recording = open_recording(run)
        if wants_json():
            lines = _json_lines(recording)
        else:
            lines = _text_lines(recording)
        if output:
            options.write_file(output, "".join(f"{line}\n" for line in lines).encode(), run)
        else:
            print_lines(lines)
    print_problem(recording.damage)


@app.command("plot")
def _plot(run: RunFile, output: options.Output, speed: float = 1) -> None:
    if not math.isfinite(speed) or not 0.001 <= speed <= 100_000:
        raise InputError("option-not-allowed", option="--speed", value=f"{speed:g}", allowed="0.001 to 100000")
    with needs_extra("drawing", "runs"):
        from motorcade.cli.console import drawing_texts, progress_bar
        from motorcade.runs.recorder import draw, open_recording

        recording = open_recording(run)
        with progress_bar("drawn", recording.last_ms) as advance, drawing_texts():
            draw(recording, output, advance, speed)
    print_result({"picture": str(output)}, translated("run-is-drawn", picture=output))
    print_problem(recording.damage)


def _text_lines(recording: "Recording") -> Iterator[str]:
    """Yield what the cars did as sentences, a line an event; frames and moments are left out."""
    from motorcade.cli.console import describe_event
    from motorcade.runs.recording import events_as_dicts

    about = recording.about
    yield translated("replay-begins", cars=about.cars, seconds=recording.last_ms / 1000, mat=about.mat.name)
    for batch in recording.events():
        for event in events_as_dicts(batch):
            kind = event["kind"]
            if kind in _ON_THE_AIR:
                continue
            sentence = describe_event(kind, event["word"], event["why"] or event["other"], about.profile)
            yield translated("replay-event", seconds=event["t_ms"] / 1000, number=event["car"], sentence=sentence)


def _json_lines(recording: "Recording") -> Iterator[str]:
    """Yield the run's description, then its moments and events in order of time, each as JSON."""
    from motorcade.runs.recording import events_as_dicts, with_tag

    events = ({"type": "event", **with_tag(event)} for batch in recording.events() for event in events_as_dicts(batch))
    moments = ({"type": "cars", **moment.to_dict()} for moment in recording.moments())
    yield json.dumps({"type": "run", **recording.about.to_dict()}, ensure_ascii=False)
    for line in heapq.merge(events, moments, key=itemgetter("run", "t_ms")):
        yield json.dumps(line)


@app.command("sweep")
def _sweep(
    spec: Annotated[Path, typer.Argument(metavar="SPEC.toml", exists=True, dir_okay=False, readable=True)],
    output: Annotated[Path, typer.Option("-o", "--output", dir_okay=False)],
    jobs: options.Jobs = 0,
    scheduler: str = "",
    capsule: Annotated[Path | None, typer.Option(dir_okay=False)] = None,
) -> None:
    with ended_by_sentences(output):
        from motorcade.cli.console import progress_bar
        from motorcade.lab.run import chosen_workers, run_sweep
        from motorcade.runs.recording import check_writable

        check_writable(output, (".parquet",))
        if capsule:
            check_writable(capsule, (".zip",))
        plan = _plan(spec, capsule is not None)
        ran = run_sweep(plan, output, chosen_workers(scheduler, jobs), progress_bar)
        if capsule:
            from motorcade.lab.capsule import write_capsule

            write_capsule(capsule, read_bytes(spec), plan, output)
    result = {"runs": plan.runs, "tasks": plan.tasks, "tasks_run": ran, "table": str(output)}
    key = "sweep-was-done"
    if ran == plan.tasks:
        key = "sweep-is-done"
    lines = [translated(key, runs=plan.runs, table=output, done=plan.tasks - ran, tasks=plan.tasks)]
    if capsule:
        result["capsule"] = str(capsule)
        lines.append(translated("capsule-is-written", capsule=capsule))
        if not plan.sweep.citation.get("authors"):
            lines.append(translated("capsule-without-authors", spec=spec))
    print_result(result, "\n".join(lines))


@app.command("verify")
def _verify(
    capsule: Annotated[Path, typer.Argument(metavar="CAPSULE.zip", exists=True, dir_okay=False, readable=True)],
    sample: Annotated[int | None, typer.Option(min=1)] = None,
    jobs: options.Jobs = 0,
) -> None:
    with ended_by_sentences(capsule, "verify"):
        from motorcade.cli.console import progress_bar
        from motorcade.lab.capsule import verify
        from motorcade.lab.run import on_this_computer

        runs, difference = verify(capsule, sample, on_this_computer(jobs), progress_bar)
    if difference is None:
        print_result({"runs": runs, "equal": True}, translated("capsule-is-equal", runs=runs))
        return
    details = difference._asdict()
    result = {"runs": runs, "equal": False, **details, "point": sentence_of(difference.point)}
    print_result(result, translated("capsule-differs", runs=runs, **details))
    raise typer.Exit(PROGRAM_ERROR)


def _plan(spec: Path, with_digests: bool) -> "Plan":
    from motorcade import __version__
    from motorcade.cli.console import progress_bar
    from motorcade.lab.plan import Plan
    from motorcade.lab.spec import read_sweep

    def has_own_mat(program: Path) -> bool:
        # A program that can't be read gets its own sentence when it is compiled.
        with suppress(MotorcadeError, OSError):
            return options.own_world(program).mat is not None
        return False

    with raised_as("sweep-not-valid"):
        wanted = read_sweep(spec, lambda program: has_own_mat(spec.parent / program))
    programs = [_program(spec, index, wanted) for index in range(len(wanted.programs))]
    mats = [_mat(spec, index, wanted) for index in range(len(wanted.mats))]
    with progress_bar("checked", wanted.cells) as advance:
        return Plan(wanted, programs, mats, __version__, advance, with_digests=with_digests)


def _program(spec: Path, index: int, wanted: "Sweep") -> "tuple[bytes, Profile]":
    """Read one of the programs that a sweep names: its image and its cars' profile."""
    name = wanted.programs[index]
    place = f"{spec.name}: programs[{index}], '{name}'"
    own = wanted.profile.endswith(".toml")
    try:
        profile_name = wanted.profile
        if own:
            profile_name = str(spec.parent / wanted.profile)
        image, profile = options.image_of(spec.parent / name, profile_name, place)
    except OSError as problem:
        raise MotorcadeError("sweep-program-unreadable", place=place, reason=problem) from None
    except typer.Exit:
        print_note(translated("sweep-program-has-errors", place=place))
        raise
    return image, dataclasses.replace(profile, name=Path(profile.name).name)


def _mat(spec: Path, index: int, wanted: "Sweep") -> "Mat | None":
    """Read one of the mats that a sweep names; None for the empty table."""
    from motorcade.lab.spec import EMPTY_TABLE
    from motorcade.mats import read_mat

    name = wanted.mats[index]
    if name == EMPTY_TABLE:
        return None
    with raised_as("sweep-mat-not-valid", place=f"{spec.name}: mats[{index}]"):
        return read_mat(spec.parent / name)


@contextmanager
def ended_by_sentences(output: Path, part: str = "sweep") -> Iterator[None]:
    """Print a sentence for all that ends a sweep or a search early: a missing library, Ctrl-C, a failing disk."""
    try:
        with needs_extra(part, "sim"):
            yield
    except KeyboardInterrupt:
        print_note(translated(f"{part}-is-stopped", table=output))
        raise typer.Exit(STOPPED) from None
    except OSError as problem:
        raise MotorcadeError("file-not-usable", file=problem.filename or output, reason=problem) from None
