"""The command line: parses, calls, prints."""

import io
import sys
from typing import Annotated, NoReturn

import typer

from motorcade import __version__
from motorcade.cli import car, drive, experiments, firmware, runs, studio, uploads, words
from motorcade.cli.language import current_language, requested_language
from motorcade.errors import MotorcadeError
from motorcade.outcomes import USAGE

app = typer.Typer(
    name="motorcade",
    help="Program and drive small cars: a leader, its followers, and the 32-bit words between them. "
    "Commands that print data print JSON into files and pipes, or with --json.",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    add_completion=False,
)
words.add_to(app)
runs.add_to(app)
car.add_to(app)
uploads.add_to(app)
firmware.add_to(app)
experiments.add_to(app)
drive.add_to(app)
studio.add_to(app)


def main() -> NoReturn:
    """Run the command line; an error ends it with one sentence and its exit code."""
    _use_utf8()
    requested_language.set("")
    try:
        app()
    except (MotorcadeError, OSError) as error:
        sentence = error.sentence(current_language()) if isinstance(error, MotorcadeError) else str(error)
        print(f"motorcade: {sentence}", file=sys.stderr)
        sys.exit(error.exit_code if isinstance(error, MotorcadeError) else USAGE)
    sys.exit(0)


def _use_utf8() -> None:
    """Write UTF-8 into files and pipes on every system; a terminal shows '?' for what it can't show."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            if stream.isatty():
                stream.reconfigure(errors="replace")
            else:
                stream.reconfigure(encoding="utf-8", errors="backslashreplace")


@app.callback(invoke_without_command=True)
def _motorcade(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and leave.")] = False,
) -> None:
    if version:
        print(f"motorcade {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())
