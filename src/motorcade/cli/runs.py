"""Commands about simulated runs: simulate, replay, plot.

Each command imports what it needs when it runs, so that the others start quickly.
"""

import heapq
import json
import math
import os
import sys
from collections.abc import Iterator
from enum import StrEnum
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.language import Language, current_language, resolve_locale
from motorcade.cli.options import (
    Json,
    ProfileOption,
    Source,
    image_of,
    needs_extra,
    print_json,
    print_table,
    print_text,
    wants_json,
)
from motorcade.errors import MotorcadeError
from motorcade.locales import command_line_text

if TYPE_CHECKING:
    from motorcade.runs.recording import Recording


def simulate_command(
    source: Source,
    followers: Annotated[
        int | None,
        typer.Option(min=0, max=10_000, help="How many; 5 unless given, 0 where only the leader is programmed."),
    ] = None,
    seconds: Annotated[float, typer.Option(min=0, max=86400, help="Simulated time.")] = 30,
    seed: Annotated[int, typer.Option(min=0, max=(1 << 32) - 1, help="The same seed gives the same run.")] = 0,
    mat: Annotated[Path | None, typer.Option(help="The place that they drive on, a .toml or .json file.")] = None,
    record: Annotated[list[Path] | None, typer.Option(help="Record the run into this .mcap or .parquet file.")] = None,
    video: Annotated[Path | None, typer.Option(help="Draw the run into this MP4 or GIF file.")] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw the tracks into this PNG, SVG or PDF file.")] = None,
    profile: ProfileOption = "classroom",
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Simulate a leader and its followers, which run the same bytes that an upload sends."""
    image, chosen = image_of(source, profile, resolve_locale(language))
    if math.isnan(seconds):
        raise MotorcadeError("option-not-allowed", option="--seconds", value="nan", allowed="0 to 86400")
    if mat and followers is not None:
        raise MotorcadeError("followers-with-mat")
    files = [*(record or ()), *([video] if video else ()), *([picture] if picture else ())]
    with needs_extra("simulating"):
        from motorcade.cli.console import progress_bar
        from motorcade.cli.options import compiling_announced
        from motorcade.cli.run_tables import print_unheard, run_as_dict, run_tables
        from motorcade.mats import read_mat
        from motorcade.runs.recording import FILM_ENDINGS, PICTURE_ENDINGS
        from motorcade.runs.running import simulate
        from motorcade.words.image import parse_image_bytes

        if followers is None:
            followers = 5 if parse_image_bytes(image).followers else 0
        place = read_mat(mat) if mat else None
        drawings = [path for path in files if path.suffix.lower() in (*FILM_ENDINGS, *PICTURE_ENDINGS)]
        total_ms = round(seconds * 1000) * (1 + len(drawings))
        with compiling_announced(), progress_bar("done", total_ms) as advance:
            run = simulate(image, followers, seconds, seed, chosen, place, files, advance)
    print_unheard(run, current_language())
    if wants_json(as_json):
        print_json(run_as_dict(run))
    else:
        print_table(run_tables(run))


RunFile = Annotated[Path, typer.Argument(metavar="RUN", help="A .mcap or .parquet file of `simulate --record`.")]


class Kind(StrEnum):
    """What `plot` draws."""

    TRACKS = "tracks"
    WORDS = "words"
    AIR = "air"


def add_to(app: typer.Typer) -> None:
    """Register the commands."""
    app.command("simulate")(simulate_command)
    app.command("replay")(replay_command)
    app.command("plot")(plot_command)


def replay_command(
    run: RunFile,
    video: Annotated[Path | None, typer.Option(help="Draw the run into this MP4 or GIF file instead.")] = None,
    speed: Annotated[float, typer.Option(help="Simulated seconds in a second of the film.")] = 1,
    as_json: Json = False,
) -> None:
    """Print a recorded run as JSON, one line for each moment and each event; or draw it as a film."""
    if not math.isfinite(speed) or not 0.001 <= speed <= 100_000:
        raise MotorcadeError("option-not-allowed", option="--speed", value=f"{speed:g}", allowed="0.001 to 100000")
    with needs_extra("replaying"):
        from motorcade.runs.recorder import open_recording

        recording = open_recording(run)
        if video:
            _draw_film(recording, video, speed)
            result = {"video": str(video), "t_ms": recording.last_ms}
            sentence = command_line_text(
                "film-is-drawn", current_language(), video=video, seconds=recording.last_ms / 1000, run=run
            )
            _print_result(result, sentence, as_json)
        else:
            _print_lines(_lines(recording))
    _print_damage(recording)


def plot_command(
    run: RunFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="The picture, a PNG, SVG or PDF file.")],
    kind: Annotated[Kind | None, typer.Option(help="Only this plot; all three in one picture unless given.")] = None,
    as_json: Json = False,
) -> None:
    """Draw a recorded run: tracks on the mat, which car held which word when, what happened to the frames."""
    with needs_extra("drawing"):
        from motorcade.cli.console import describe_control, progress_bar
        from motorcade.runs.plots import draw_plots
        from motorcade.runs.recorder import open_recording

        recording = open_recording(run)
        profile = recording.about.profile
        kinds = [kind] if kind else list(Kind)
        with progress_bar("read", recording.last_ms) as advance:
            draw_plots(recording, output, kinds, lambda word: describe_control(word, profile), advance)
    sentence = command_line_text("plots-are-drawn", current_language(), picture=output, kinds=", ".join(kinds), run=run)
    _print_result({"picture": str(output), "kinds": kinds}, sentence, as_json)
    _print_damage(recording)


def _draw_film(recording: "Recording", video: Path, speed: float) -> None:
    from motorcade.cli.console import progress_bar
    from motorcade.runs.video import draw_film

    with progress_bar("drawn", recording.last_ms) as advance:
        draw_film(recording, video, speed, advance)


def _lines(recording: "Recording") -> Iterator[str]:
    """Yield the run's description, then its moments and events in order of time, each as JSON."""
    from motorcade.engine.events import KINDS, LOSS_REASONS

    def events() -> Iterator[tuple[int, dict[str, object]]]:
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

    moments = ((moment.t_ms, {"type": "cars", **moment.to_dict()}) for moment in recording.moments())
    yield json.dumps({"type": "run", **recording.about.to_dict()}, ensure_ascii=False)
    for _, line in heapq.merge(events(), moments, key=itemgetter(0)):
        yield json.dumps(line)


def _print_lines(lines: Iterator[str]) -> None:
    """Print all lines; stop without an error when nobody reads them any more."""
    try:
        for line in lines:
            print(line)
        sys.stdout.flush()
    except BrokenPipeError:
        # Python flushes again when it ends, which would fail with a traceback.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _print_result(data: dict[str, object], sentence: str, as_json: bool) -> None:
    if as_json:
        print_json(data)
    else:
        print_text(sentence + "\n")


def _print_damage(recording: "Recording") -> None:
    if recording.damage:
        print(f"motorcade: {recording.damage.sentence(current_language())}", file=sys.stderr)
