"""Commands about recorded runs: replay, plot.

Each command imports what it needs when it runs, so that the others start at once.
"""

import heapq
import json
import math
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.failures import UsageError
from motorcade.cli.options import Json, print_json, print_text, wants_json

if TYPE_CHECKING:
    from motorcade.runs.recording import Recording

RunFile = Annotated[Path, typer.Argument(metavar="RUN", help="A .mcap or .parquet file of `simulate --record`.")]


class Kind(StrEnum):
    """What `plot` draws."""

    TRACKS = "tracks"
    WORDS = "words"
    AIR = "air"


def add_to(app: typer.Typer) -> None:
    """Register the commands."""
    app.command("replay")(replay_command)
    app.command("plot")(plot_command)


@contextmanager
def needs_extra(what: str, extra: str = "sim") -> Iterator[None]:
    """A library of the ``extra`` that is missing ends in a sentence that says how to get it."""
    try:
        yield
    except ModuleNotFoundError as missing:
        if not missing.name or missing.name.startswith("motorcade"):
            raise
        raise UsageError(f"{what} needs {missing.name}: pip install 'motorcade[{extra}]'") from None


def replay_command(
    run: RunFile,
    speed: Annotated[float, typer.Option(help="Simulated seconds in a second.")] = 1,
    video: Annotated[Path | None, typer.Option(help="Draw it into this MP4 or GIF file instead.")] = None,
    as_json: Json = False,
) -> None:
    """Show a recorded run: live on a terminal, as a line of JSON a moment and event into files and pipes."""
    if not math.isfinite(speed) or not 0.001 <= speed <= 100_000:
        raise UsageError(f"--speed is {speed:g}; allowed: 0.001 to 100000")
    with needs_extra("replaying"):
        from motorcade.runs.recording import open_recording

        recording = open_recording(run)
        if video:
            _film(recording, video, speed)
            told = f"{video} shows {recording.last_ms / 1000:g} s of {run}."
            _tell({"video": str(video), "t_ms": recording.last_ms}, told, as_json)
        elif wants_json(as_json):
            _print_lines(_lines(recording))
        else:
            from motorcade.cli.live import show_live

            show_live(recording, speed)
    _complain(recording)


def plot_command(
    run: RunFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="The picture, a PNG, SVG or PDF file.")],
    kind: Annotated[Kind | None, typer.Option(help="Only this plot; all three in one picture unless given.")] = None,
    as_json: Json = False,
) -> None:
    """Draw a recorded run: tracks on the mat, who held which word when, what became of the frames."""
    with needs_extra("drawing"):
        from motorcade.cli.console import describe_control, progress_bar
        from motorcade.runs.picture import draw_plots
        from motorcade.runs.recording import open_recording

        recording = open_recording(run)
        profile = recording.about.profile
        kinds = [kind] if kind else list(Kind)
        with progress_bar("read", recording.last_ms) as advance:
            draw_plots(recording, output, kinds, lambda word: describe_control(word, profile), advance)
    _tell({"picture": str(output), "kinds": kinds}, f"{output} shows the {', '.join(kinds)} of {run}.", as_json)
    _complain(recording)


def _film(recording: "Recording", video: Path, speed: float) -> None:
    from motorcade.cli.console import progress_bar
    from motorcade.runs.video import draw_film

    with progress_bar("drawn", recording.last_ms) as advance:
        draw_film(recording, video, speed, advance)


def _lines(recording: "Recording") -> Iterator[str]:
    """The run, then its moments and events in order of time, each as JSON."""
    from motorcade.engine.events import KINDS, LOSS_REASONS

    def happened() -> Iterator[tuple[int, dict[str, object]]]:
        for batch in recording.events():
            for t_ms, _, car, kind, why, word, other in batch.tolist():
                event = {
                    "t_ms": t_ms,
                    "car": car,
                    "kind": KINDS[kind],
                    "why": LOSS_REASONS[why],
                    "word": word,
                    "other": other,
                }
                yield t_ms, {"type": "event", **event}

    moments = ((frame.t_ms, {"type": "cars", **frame.to_dict()}) for frame in recording.frames())
    yield json.dumps({"type": "run", **recording.about.as_dict()}, ensure_ascii=False)
    for _, line in heapq.merge(happened(), moments, key=itemgetter(0)):
        yield json.dumps(line)


def _print_lines(lines: Iterator[str]) -> None:
    """Print until the end, or until the reader has left."""
    try:
        for line in lines:
            print(line)
        sys.stdout.flush()
    except BrokenPipeError:
        # Python flushes once more when it ends, and would complain then.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _tell(data: dict[str, object], sentence: str, as_json: bool) -> None:
    if as_json:
        print_json(data)
    else:
        print_text(sentence + "\n")


def _complain(recording: "Recording") -> None:
    if recording.complaint:
        print(f"motorcade: {recording.complaint}", file=sys.stderr)
