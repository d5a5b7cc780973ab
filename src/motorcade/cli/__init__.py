"""The command line: parses, calls, prints."""

import os
import sys
from typing import Annotated, NoReturn

import typer

from motorcade import __version__
from motorcade.cli import cars, words
from motorcade.cli.failures import exit_code

app = typer.Typer(
    name="motorcade",
    help="Program and drive small cars: a leader, its followers, and the 32-bit words between them. "
    "Data comes as JSON wherever the output is no terminal, or with --json.",
    pretty_exceptions_enable=False,
    add_completion=False,
)
words.add_to(app)
cars.add_to(app)


def main() -> NoReturn:
    """Run the command line; every failure ends in one sentence and its exit code."""
    try:
        app()
    except BrokenPipeError:
        # Whoever read our output has enough; keep Python's own shutdown from complaining too.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except Exception as problem:
        code = exit_code(problem)
        if code is None:
            raise
        print(f"motorcade: {problem}", file=sys.stderr)
        sys.exit(code)
    sys.exit(0)


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
