"""The command line: parses, calls, prints.

Each command imports what it needs when it runs, so that all of them start at once. Their help is in the catalogue of
`motorcade.locales`, under "help".
"""

import io
import os
import re
import signal
import sys
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperOption

from motorcade import __version__
from motorcade.cli import car, drive, missions, pages, runs, uploads, words
from motorcade.cli.ending import ending_as_by_ctrl_c
from motorcade.cli.output import (
    current_language,
    is_shown_on_terminal,
    print_json,
    print_note,
    print_problem,
    request_json,
    request_language,
    sentence_of,
    translated,
    wants_json,
)
from motorcade.errors import MotorcadeError
from motorcade.locales import FIRST, catalogue, languages, text
from motorcade.outcomes import STOPPED, USAGE

_HELP_OPTIONS = ("-h", "--help")
# Groups of commands, which print nothing themselves, and commands that print no JSON.
_GROUPS = ("car", "drive")
_WITHOUT_JSON = ("connect", "blink", "name")

app = typer.Typer(
    name="motorcade",
    context_settings={"help_option_names": list(_HELP_OPTIONS)},
    pretty_exceptions_enable=False,
    add_completion=False,
)
# Help lists them in this order: what most people begin with comes first.
for _part in (pages.studio_app, missions.app, runs.app, uploads.app, words.app):
    app.add_typer(_part)
app.add_typer(car.app, name="car")
app.add_typer(uploads.cars_app, name="cars")
app.add_typer(drive.app, name="drive")


def command_line() -> Any:
    """Return the command `motorcade`, which holds all others; each takes --language, and takes or refuses --json."""
    command = typer.main.get_command(app)
    _add_common_options(command)
    return command


def _add_common_options(command: Any) -> None:
    is_hidden = command.name in (*_GROUPS, *_WITHOUT_JSON)
    flag: dict[str, Any] = {"is_flag": True, "default": False, "expose_value": False, "hidden": is_hidden}
    command.params.append(TyperOption(param_decls=["as_json", "--json"], callback=_take_json, **flag))
    # Its value is read before the command line is parsed, which may fail.
    command.params.append(TyperOption(param_decls=["--language"], type=str, default="", expose_value=False))
    for subcommand in getattr(command, "commands", {}).values():
        _add_common_options(subcommand)


def _take_json(context: typer.Context, parameter: Any, is_given: bool) -> None:
    """Take --json for a command and those below it. Raises MotorcadeError where the command prints no JSON."""
    if is_given:
        request_json(True)
    if wants_json() and context.command.name in _WITHOUT_JSON:
        raise MotorcadeError("no-json", command=context.command_path)


def main() -> NoReturn:
    """Run the command line; an error ends it with one sentence and its exit code."""
    _open_closed_streams()
    _use_utf8()
    arguments = sys.argv[1:]
    command = command_line()
    request_json(False)
    try:
        # The last one counts; a value may stand behind it or behind a '='.
        request_language((re.findall("(?:^|\0)--language[=\0]([^\0]*)", "\0".join(arguments)) or [""])[-1])
        if not arguments or set(_HELP_OPTIONS) & set(arguments):
            translate_help(command, has_frames=is_shown_on_terminal())
        with ending_as_by_ctrl_c() as signals:
            code = command(standalone_mode=False) or 0
        if code == STOPPED and signals:
            code = STOPPED - signal.SIGINT + signals[0]
        sys.exit(code)
    except MotorcadeError as error:
        print_problem(error)
        sys.exit(error.exit_code)
    except OSError as error:
        print_note(translated("system-refuses", file=error.filename or "I/O", reason=error))
        sys.exit(USAGE)
    except typer.TyperException as error:
        # Where a group of commands has printed its help there is nothing to add.
        if message := error.format_message():
            context = getattr(error, "ctx", None)
            if context:
                path = context.command_path
            else:
                path = app.info.name
            print_note(translated("usage-help", problem=_usage_sentence(message), command=path))
        sys.exit(USAGE)
    except typer.Abort:
        # At a question.
        sys.exit(STOPPED)


def _open_closed_streams() -> None:
    """Read nothing, and write to nobody, where the command was started without a stream (``>&-``)."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115 - until the command ends


def _use_utf8() -> None:
    """Write UTF-8 into files and pipes on every system; a terminal shows '?' for what it can't show.

    What is typed may be no text: then a sign stands for it, and what comes behind it is read.
    """
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            if stream.isatty() or stream is sys.stdin:
                stream.reconfigure(errors="replace")
            else:
                stream.reconfigure(encoding="utf-8", errors="backslashreplace")


def translate_help(command: Any, has_frames: bool = True) -> None:
    """Give a Typer command, all commands below it, and what stands around their parameters their texts."""
    from typer import core, rich_utils

    titles = {name: translated(f"help-{name.lower()}") for name in ("Arguments", "Options", "Commands")}
    for name, title in titles.items():
        setattr(rich_utils, f"{name.upper()}_PANEL_TITLE", title)
    default = translated("help-default", default="{default}")
    required = translated("help-required")
    rich_utils.DEFAULT_STRING = f"[{default.replace('{default}', '{}')}]"
    rich_utils.REQUIRED_LONG_STRING = f"[{required}]"
    said = titles | {"default: {default}": default, "required": required}
    # Typer asks gettext, which has no catalogue of Typer's texts.
    core._ = lambda message: said.get(message, message)  # type: ignore[attr-defined]
    _translate_help(command, "", has_frames)


def _write_usage(command: Any, context: typer.Context, formatter: Any) -> None:
    """Write the line that shows how a command is called; Typer's own begins in English."""
    pieces = " ".join(command.collect_usage_pieces(context))
    formatter.write_usage(context.command_path, pieces, translated("help-usage"))


def _translate_help(command: Any, path: str, has_frames: bool) -> None:
    """Give a command and those below it the texts "COMMAND" and "COMMAND.PARAMETER", or ".PARAMETER" for all."""
    if not has_frames:
        command.rich_markup_mode = None
    from motorcade.words.formats import FORMATS

    formats = ", ".join(word_format.name for word_format in FORMATS)
    lists = {"languages": " / ".join(languages()), "formats": formats}
    known = catalogue(FIRST)["help"]
    command.help = text("help", path or "motorcade", {}, current_language())
    command.options_metavar = translated("help-options-place")
    if hasattr(command, "subcommand_metavar"):
        command.subcommand_metavar = translated("help-command-place")
    command.format_usage = partial(_write_usage, command)
    option = command.get_help_option(typer.Context(command, help_option_names=list(_HELP_OPTIONS)))
    option.help = translated("help-help")
    for parameter in command.params:
        for key in (f".{parameter.name}", f"{path}.{parameter.name}"):
            if key in known:
                parameter.help = text("help", key, lists, current_language())
    for name, subcommand in getattr(command, "commands", {}).items():
        _translate_help(subcommand, f"{path} {name}".lstrip(), has_frames)
        # In a list of commands; Typer cuts it at 45 letters otherwise.
        subcommand.short_help = subcommand.help.partition("\n")[0]


def _usage_sentence(message: str) -> str:
    """Return what Typer says of a wrong command line in the current language; what the catalogue lacks, as it is."""
    for template, sentence in catalogue(current_language()).get("usage", {}).items():
        texts = re.split(r"\{(\w+)\}", template)
        parts = [f"(?P<{part}>.+)" if place % 2 else re.escape(part) for place, part in enumerate(texts)]
        if found := re.fullmatch("".join(parts), message):
            values = {name: _usage_sentence(value) for name, value in found.groupdict().items()}
            return str(sentence.format(**values))
    return message


@app.callback(invoke_without_command=True)
def _motorcade(context: typer.Context, version: Annotated[bool, typer.Option("--version")] = False) -> None:
    if version:
        if wants_json():
            print_json({"version": __version__, **_engine()})
        else:
            print(f"motorcade {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())


def _engine() -> dict[str, str | None]:
    """Return what runs simulated cars here, and why it isn't machine code; None where nothing can run them."""
    try:
        from motorcade.engine.world import library_problem, open_backend

        name = open_backend().name
        problem = library_problem()
    except ModuleNotFoundError as missing:
        return {"kernels": None, "problem": str(missing)}
    return {"kernels": name, "problem": sentence_of(problem) if problem else None}
