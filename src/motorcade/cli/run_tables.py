"""Tables of simulated runs: what each car did. `show` is for scripts and notebooks."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from motorcade.cli.console import words_table
from motorcade.cli.output import make_table, print_diagnostics, print_lines, print_table, translated
from motorcade.config.profile import built_in_profile
from motorcade.engine.events import KINDS, NEXT_WORD
from motorcade.errors import Phrase
from motorcade.mats import Mat
from motorcade.mats.document import mat_of
from motorcade.program.compiler import compile_program
from motorcade.program.model import Program
from motorcade.runs.recording import WHICH, events_as_dicts, with_tag
from motorcade.runs.running import Run, Slot, simulate

# Slots in a table; --json lists all.
_MOST_SLOTS = 20


def cars_table(run: Run) -> Table:
    """Make a table of what each car of a run did, or all cars together where the run was not recorded in memory."""
    if run.recording is None:
        return _crowd_table(run)
    world = run.world
    events = run.events
    counts = {}
    for number, kind in enumerate(KINDS):
        of_kind = events["car"][events["kind"] == number]
        counts[kind] = np.bincount(of_kind, minlength=world.cars)
    end = world.snapshot()
    leader = translated("role-leader")
    rows = []
    for car, leads in enumerate(world.mat.starts.leads.tolist()):
        name = str(car)
        if leads:
            name = leader
        if leads and car:
            name = f"{car}, {leader}"
        rows.append(
            (
                name,
                counts["state"][car] + counts["start"][car],
                *(counts[kind][car] for kind in ("frame", "heard", "lost")),
                *(_rounded(column[car], 2) for column in (run.driven_m, end.x_m, end.y_m)),
                _rounded(math.degrees(end.heading[car]), 0),
            )
        )
    columns = ("car", "words", "frames", "heard", "lost", "driven", "x", "y", "heading")
    title = translated("cars-table-title", seconds=world.now_ms / 1000, mat=world.mat.name)
    return make_table(columns, rows, right=columns[1:], unbroken=["car"], title=title)


def run_tables(run: Run) -> Group:
    """Make the tables of a run: what each car did, then how the words spread."""
    tables = [cars_table(run)]
    if run.slots:
        tables.append(slots_table(run))
    return Group(*tables)


def run_as_dict(run: Run) -> dict[str, object]:
    """Describe what the cars did, for JSON; ``events`` is null where the run was not recorded in memory."""
    end = run.world.snapshot()
    columns = zip(end.x_m.tolist(), end.y_m.tolist(), end.heading.tolist(), strict=True)
    cars = []
    for car, (x, y, heading) in enumerate(columns):
        cars.append({"id": car, "x": x, "y": y, "heading": heading})
    counts = {name: int(values[0]) for name, values in run.world.counts().items()}
    events = None
    if run.recording:
        events = [_event_as_dict(with_tag(event)) for event in events_as_dicts(run.events)]
    slots = [slot._asdict() for slot in run.slots]
    return {"cars": cars, "counts": counts, "slots": slots, "events": events}


def slots_table(run: Run) -> Table:
    """Make a table of the leaders' slots: how many followers began the word of each, and how late."""
    columns = [f"slot-{name.replace('_', '-')}" for name in Slot._fields]
    more = len(run.slots) - _MOST_SLOTS
    caption = None
    if more > 0:
        caption = translated("slots-table-more", count=more)
    title = translated("slots-table-title")
    return make_table(columns, run.slots[:_MOST_SLOTS], right=columns, title=title, caption=caption)


def _event_as_dict(event: dict[str, Any]) -> dict[str, object]:
    kind = event["kind"]
    why = event.pop("why")
    other = event.pop("other")
    if kind == "state":
        event["index"] = other
    if kind == "flow":
        event["next"], event["index"] = divmod(other, NEXT_WORD)
    if kind in ("heard", "lost"):
        event["sender"] = other
    named = {name: value for name, value in event.items() if name not in WHICH}
    if why:
        named["why"] = why
    return named


def _crowd_table(run: Run) -> Table:
    world = run.world
    counts = {name.replace("_", "-"): f"{int(values[0]):,}" for name, values in world.counts().items()}
    rows = [(translated(f"counter-{name}"), count) for name, count in counts.items()]
    rows.append((translated("mean-distance"), _rounded(float(run.driven_m.mean()), 2)))
    title = translated("crowd-table-title", count=world.cars, seconds=world.now_ms / 1000)
    return make_table(("counter", "total"), rows, right=["total"], title=title)


def print_unheard(run: Run) -> None:
    """Print on standard error which followers never heard a frame, where some were sent."""
    if run.recording is None or not int(run.world.counts()["frames"][0]):
        return
    events = run.events
    reached = np.isin(events["kind"], [KINDS.index("heard"), KINDS.index("lost")])
    heard = set(events["car"][reached].tolist())
    silent = [car for car, leads in enumerate(run.world.mat.starts.leads) if not leads and car not in heard]
    if silent:
        key = "cars-out-of-range"
        if len(silent) == 1:
            key = "car-out-of-range"
        line = translated(key, car=silent[0], count=len(silent))
        Console(stderr=True).print(Text(line), soft_wrap=True)


def _rounded(value: float, digits: int) -> str:
    """Format a number; minus zero becomes zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def show(
    program: Program,
    followers: int | None = None,
    seconds: float = 30,
    seed: int = 0,
    mat: Mat | None = None,
    picture: str | Path | None = None,
) -> Run:
    """Compile a program, simulate it, and print its words and what the cars did.

    Args:
        program: the program.
        followers: the number of followers on an open table; 5 unless given.
        seconds: simulated time.
        seed: the same seed gives the same run.
        mat: the place with all cars, in place of ``followers``; `open_table` makes one from poses. Unless one of both
            is given, the mat with which the program was saved, if it was.
        picture: the file for a picture of the tracks, if one is wanted.

    Raises:
        ProgramError: the program has errors; its text says which and where.
        MotorcadeError: the run can't be simulated, or the picture can't be written.
    """
    compiled = compile_program(program)
    print_diagnostics(compiled.diagnostics, Console())
    profile = built_in_profile(program.profile)
    if compiled.words:
        print_table(words_table(compiled.words, profile))
    record = []
    if picture:
        record = [picture]
    if mat is None and followers is None and "mat" in program.beside:
        mat = mat_of(program.beside["mat"], Phrase("mat-of-page"))
    run = simulate(compiled.image, 5 if followers is None else followers, seconds, seed, profile, mat, record)
    print_table(run_tables(run))
    if picture:
        print_lines([translated("run-is-drawn", picture=picture)])
    return run
