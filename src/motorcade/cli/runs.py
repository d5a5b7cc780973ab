"""Commands about simulated runs: simulate, replay, plot."""

import heapq
import json
import math
from collections.abc import Iterator
from contextlib import nullcontext
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from motorcade.cli.language import Language, current_language, translated
from motorcade.cli.options import (
    CarNumber,
    ImageProfile,
    Json,
    Output,
    Source,
    image_for,
    print_json,
    print_lines,
    print_note,
    print_result,
    print_table,
    wants_json,
)
from motorcade.errors import MotorcadeError
from motorcade.extras import needs_extra

if TYPE_CHECKING:
    from motorcade.runs.recording import Recording

app = typer.Typer()
RunFile = Annotated[Path, typer.Argument(metavar="RUN")]


# As motorcade.engine.targets.Name, which the command line's start can't import.
Kernels = Literal["native", "webassembly", "interpreted"]


@app.command("simulate")
def _simulate(
    source: Source,
    followers: Annotated[int | None, typer.Option(min=0, max=10_000)] = None,
    seconds: Annotated[float, typer.Option(min=0, max=86400)] = 30,
    seed: CarNumber = 0,
    mat: Path | None = None,
    record: list[Path] | None = None,
    video: Path | None = None,
    picture: Path | None = None,
    profile: ImageProfile = None,
    kernels: Kernels | None = None,
    language: Language = "",
    as_json: Json = False,
) -> None:
    image, chosen = image_for(source, profile)
    if math.isnan(seconds):
        raise MotorcadeError("option-not-allowed", option="--seconds", value="nan", allowed="0 to 86400")
    if mat and followers is not None:
        raise MotorcadeError("followers-with-mat")
    files = [*(record or ()), *([video] if video else ()), *([picture] if picture else ())]
    with needs_extra("simulating", "world"):
        from motorcade.cli.console import drawing_texts, progress_bar
        from motorcade.cli.options import compiling_announced
        from motorcade.cli.run_tables import print_unheard, run_as_dict, run_tables
        from motorcade.mats import formation, open_table, read_mat
        from motorcade.runs.recording import DATA_ENDING
        from motorcade.runs.running import simulate_on
        from motorcade.words.image import parse_image_bytes

        if followers is None:
            followers = 5 if parse_image_bytes(image).followers else 0
        range_m = chosen.infrared.range_mm / 1000
        place = read_mat(mat) if mat else open_table(formation(followers, range_m))
        compiling = compiling_announced() if kernels == "native" else nullcontext()
        drawings = [path for path in files if path.suffix.lower() != DATA_ENDING]
        total_ms = round(seconds * 1000) * (1 + len(drawings))
        texts = drawing_texts() if drawings else nullcontext()
        with compiling, progress_bar("done", total_ms) as advance, texts:
            run = simulate_on(place, image, seconds, seed, chosen, files, advance, kernels)
    print_unheard(run)
    if wants_json(as_json):
        print_json(run_as_dict(run))
    else:
        print_table(run_tables(run))


@app.command("replay")
def _replay(run: RunFile, video: Path | None = None, speed: float = 1, as_json: Json = False) -> None:
    if not math.isfinite(speed) or not 0.001 <= speed <= 100_000:
        raise MotorcadeError("option-not-allowed", option="--speed", value=f"{speed:g}", allowed="0.001 to 100000")
    with needs_extra("replaying", "runs"):
        from motorcade.runs.recorder import open_recording

        recording = open_recording(run)
        if video:
            _draw_film(recording, video, speed)
            last_ms = recording.last_ms
            sentence = translated("film-is-drawn", video=video, seconds=last_ms / 1000, run=run)
            print_result({"video": str(video), "t_ms": last_ms}, sentence, as_json)
        else:
            print_lines(_lines(recording))
    _print_damage(recording)


@app.command("plot")
def _plot(run: RunFile, output: Output, as_json: Json = False) -> None:
    with needs_extra("drawing", "runs"):
        from motorcade.cli.console import drawing_texts, progress_bar
        from motorcade.runs.recorder import open_recording
        from motorcade.runs.tracks import draw_tracks

        recording = open_recording(run)
        with progress_bar("read", recording.last_ms) as advance, drawing_texts():
            draw_tracks(recording, output, advance)
    print_result({"picture": str(output)}, translated("tracks-are-drawn", picture=output), as_json)
    _print_damage(recording)


def _draw_film(recording: "Recording", video: Path, speed: float) -> None:
    from motorcade.cli.console import drawing_texts, progress_bar
    from motorcade.runs.film import draw_film

    with progress_bar("drawn", recording.last_ms) as advance, drawing_texts():
        draw_film(recording, video, speed, advance)


def _lines(recording: "Recording") -> Iterator[str]:
    """Yield the run's description, then its moments and events in order of time, each as JSON."""
    from motorcade.runs.recording import events_as_dicts, with_tag

    events = ({"type": "event", **with_tag(event)} for batch in recording.events() for event in events_as_dicts(batch))
    moments = ({"type": "cars", **moment.to_dict()} for moment in recording.moments())
    yield json.dumps({"type": "run", **recording.about.to_dict()}, ensure_ascii=False)
    for line in heapq.merge(events, moments, key=itemgetter("t_ms")):
        yield json.dumps(line)


def _print_damage(recording: "Recording") -> None:
    if recording.damage:
        print_note(recording.damage.sentence(current_language()))
