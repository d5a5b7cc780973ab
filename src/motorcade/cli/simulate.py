"""The command simulate.

It imports what it needs when it runs, so that the other commands start at once.
"""

import math
from pathlib import Path
from typing import Annotated

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
    wants_json,
)
from motorcade.errors import MotorcadeError


def add_to(app: typer.Typer) -> None:
    """Register the command."""
    app.command("simulate")(simulate_command)


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
        from motorcade.cli.run_tables import cars_table, print_unheard, run_as_dict
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
        print_table(cars_table(run))
