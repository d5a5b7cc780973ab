"""What a run looks like on a terminal: who drove where and heard what."""

import math
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from motorcade.cli.console import print_diagnostics, words_table
from motorcade.config.profile import built_in_profile
from motorcade.engine.world import KINDS, LOSS_REASONS
from motorcade.mats import Pose
from motorcade.program.compiler import compile_program
from motorcade.program.model import Program
from motorcade.runs.running import Run, simulate


def cars_table(run: Run) -> Table:
    """What each car of a run did and where it ended, or all of them together where they are many."""
    if run.kept is None:
        return _crowd_table(run)
    world, events = run.world, run.events
    counts = {
        name: np.bincount(events["car"][events["kind"] == k], minlength=world.cars) for k, name in enumerate(KINDS)
    }
    table = Table(title=f"What the cars did in {world.now_ms / 1000:g} s", title_justify="left")
    table.add_column("car", no_wrap=True)
    for name in ("words begun", "frames sent", "heard", "lost", "drove (m)", "x (m)", "y (m)", "faces (°)"):
        table.add_column(name, justify="right")
    end = world.snapshot()
    for car, leads in enumerate(world.mat.starts.leads.tolist()):
        table.add_row(
            f"{car}, leader" if leads and car else "leader" if leads else str(car),
            str(counts["state"][car] + counts["start"][car]),
            str(counts["frame"][car]),
            str(counts["heard"][car]),
            str(counts["lost"][car]),
            _rounded(run.driven_m[car], 2),
            _rounded(end.x_m[car], 2),
            _rounded(end.y_m[car], 2),
            _rounded(math.degrees(end.heading[car]), 0),
        )
    return table


def run_as_dict(run: Run) -> dict[str, object]:
    """What the cars did, for JSON; ``events`` is null where they were not kept."""
    end = run.world.snapshot()
    columns = zip(end.x_m.tolist(), end.y_m.tolist(), end.heading.tolist(), strict=True)
    cars = [{"id": car, "x": x, "y": y, "heading": heading} for car, (x, y, heading) in enumerate(columns)]
    counts = {name: int(values[0]) for name, values in run.world.counts().items()}
    events = [_event_as_dict(event) for event in run.events] if run.kept else None
    return {"cars": cars, "counts": counts, "events": events}


def _event_as_dict(event: np.void) -> dict[str, object]:
    kind, why = KINDS[event["kind"]], LOSS_REASONS[event["why"]]
    shown: dict[str, object] = {"t_ms": int(event["t_ms"]), "car": int(event["car"]), "kind": kind}
    shown["word"] = int(event["word"])
    if kind == "state":
        shown["index"] = int(event["other"])
    if kind in ("heard", "lost"):
        shown["sender"] = int(event["other"])
    return shown | ({"why": why} if why else {})


def _crowd_table(run: Run) -> Table:
    world = run.world
    title = f"What {world.cars:,} cars did in {world.now_ms / 1000:g} s"
    table = Table("what", title=title, title_justify="left")
    table.add_column("in all", justify="right")
    for name, values in world.counts().items():
        table.add_row(name.replace("_", " "), f"{int(values[0]):,}")
    table.add_row("drove on average (m)", _rounded(float(run.driven_m.mean()), 2))
    return table


def print_unheard(run: Run) -> None:
    """Say on standard error which followers never heard a frame, though some were sent."""
    if run.kept is None or not int(run.world.counts()["frames"][0]):
        return
    events = run.events
    heard = set(events["car"][events["kind"] >= KINDS.index("heard")].tolist())
    silent = [car for car, leads in enumerate(run.world.mat.starts.leads) if not leads and car not in heard]
    if silent:
        who = f"Car {silent[0]} was" if len(silent) == 1 else f"{len(silent)} of the cars were"
        line = f"{who} out of infrared range all the time; followers that pass words on reach further."
        Console(stderr=True).print(line, soft_wrap=True)


def _rounded(value: float, digits: int) -> str:
    """``value`` as text, never as minus zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def show(
    program: Program,
    followers: int = 5,
    seconds: float = 30,
    seed: int = 0,
    poses: list[Pose] | None = None,
    picture: str | Path | None = None,
) -> Run:
    """Compile a program, let it drive in the simulator, and print its words and what the cars did.

    Args:
        followers: how many; 5 unless given.
        seconds: simulated time; 30 unless given.
        seed: of all random draws.
        poses: where the cars stand at first, the leader first, in place of ``followers``.
        picture: where to draw the tracks, if anywhere.

    Raises:
        ProgramError: the program has errors; its text says which and where.
    """
    console = Console()
    compiled = compile_program(program)
    print_diagnostics(console, compiled.diagnostics, "en")
    profile = built_in_profile(program.profile)
    console.print(words_table(compiled.words, profile) if compiled.words else "")
    record = [picture] if picture else []
    run = simulate(compiled.image, followers, seconds, seed, profile, poses, record=record)
    console.print(cars_table(run))
    if picture:
        console.print(f"The tracks are in {picture}.")
    return run
