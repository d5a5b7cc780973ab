"""Commands about words and programs: encode, decode, compile, decompile, inspect.

Each command imports what it needs when it runs, so that the others start at once.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.options import (
    ExistingFile,
    Json,
    Language,
    ProfileOption,
    compile_project,
    print_json,
    print_table,
    print_text,
    profile_named,
    read_file,
    resolve_locale,
    wants_json,
    whole_number,
    words_in,
    write_file,
)
from motorcade.errors import MotorcadeError, Phrase
from motorcade.outcomes import PROGRAM_ERROR

if TYPE_CHECKING:
    from motorcade.words.field import WordFormat


def add_to(app: typer.Typer) -> None:
    """Register the commands."""
    app.command()(encode)
    app.command(context_settings={"ignore_unknown_options": True})(decode)
    app.command("compile")(compile_command)
    app.command("decompile")(decompile_command)
    app.command()(inspect)


def encode(
    word_format: Annotated[
        str, typer.Argument(metavar="FORMAT", help="header, control, drive, or a FILE.toml of your own.")
    ],
    values: Annotated[list[str] | None, typer.Argument(metavar="NAME=VALUE...", help="Raw values of fields.")] = None,
    as_json: Json = False,
) -> None:
    """Make a word from the values of its fields; fields left out take their default."""
    chosen = _format_called(word_format)
    fields: dict[str, int] = {}
    for text in values or ():
        name, equals, value = text.partition("=")
        if not equals:
            raise MotorcadeError("not-name-and-value", text=text, name=chosen.fields[0].name)
        chosen.field(name)
        if name in fields:
            raise MotorcadeError("field-given-twice", field=name)
        fields[name] = whole_number(value, name)
    word = chosen.encode(**fields)
    made = {"word": word, "hex": f"0x{word:08X}", "bits": f"{word:032b}"}
    if wants_json(as_json):
        print_json(made)
    else:
        from motorcade.cli.console import coloured_bits

        print_table(coloured_bits(word, chosen, f"{word}  0x{word:08X}  "))


def decode(
    word_format: Annotated[
        str, typer.Argument(metavar="FORMAT", help="header, control, drive, or a FILE.toml of your own.")
    ],
    words: Annotated[
        list[str], typer.Argument(metavar="WORD...", help="Decimal or 0x hex; a negative one is a signed int.")
    ],
    as_json: Json = False,
) -> None:
    """Show the fields of words."""
    chosen = _format_called(word_format)
    decoded = []
    for text in words:
        number = whole_number(text, Phrase("a-word"))
        word = number + (1 << 32) if -(1 << 31) <= number < 0 else number
        values = chosen.decode(word)
        decoded.append({"word": word, "fields": values._asdict(), "warnings": chosen.warnings(word)})
    if wants_json(as_json):
        print_json([{**each, "warnings": [str(warning) for warning in each["warnings"]]} for each in decoded])
        return
    from motorcade.cli.console import fields_table

    for each in decoded:
        print_table(fields_table(each["word"], chosen, each["warnings"]))


def compile_command(
    project: ExistingFile,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Write the image's bytes here.")] = None,
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Compile a project into the words of its image."""
    from rich.console import Console

    from motorcade.cli.console import print_diagnostics, words_table
    from motorcade.program.diagnostics import ProgramError, has_errors

    locale = resolve_locale(language)
    try:
        compiled, profile = compile_project(read_file(project), project.parent)
        words, diagnostics = compiled.words, compiled.diagnostics
        counts = (compiled.leader_states, compiled.follower_words, compiled.dwell_ms)
    except ProgramError as problem:
        words, diagnostics, counts, profile = (), problem.diagnostics, (0, 0, 0), None
    failed = has_errors(diagnostics)
    if output and not failed:
        write_file(output, compiled.image, project)
    if wants_json(as_json):
        print_json(
            {
                "words": list(words),
                "leader_states": counts[0],
                "follower_words": counts[1],
                "dwell_ms": counts[2],
                "diagnostics": [each.as_dict(locale) for each in diagnostics],
            }
        )
    elif profile and not failed:
        print_table(words_table(words, profile))
    print_diagnostics(Console(stderr=True), diagnostics, locale)
    if failed:
        raise typer.Exit(PROGRAM_ERROR)


def decompile_command(
    image: ExistingFile, profile: ProfileOption = "classroom", language: Language = "", as_json: Json = True
) -> None:
    """Print the project, always JSON, that compiles to an image."""
    from motorcade.program.decompiler import decompile

    print_text(decompile(words_in(image), profile_named(profile)).as_json())


def inspect(
    image: ExistingFile, profile: ProfileOption = "classroom", language: Language = "", as_json: Json = False
) -> None:
    """Show the words of an image with their fields."""
    from motorcade.words.formats import CONTROL, HEADER
    from motorcade.words.image import parse_image

    words = words_in(image)
    leader_states = len(parse_image(words).leader)
    if not as_json:
        from motorcade.cli.console import words_table

        print_table(words_table(words, profile_named(profile)))
        return
    roles = ["header"] + ["leader"] * leader_states + ["follower"] * (len(words) - 1 - leader_states)
    print_json(
        [
            {"word": word, "role": role, "fields": (CONTROL if number else HEADER).decode(word)._asdict()}
            for number, (word, role) in enumerate(zip(words, roles, strict=True))
        ]
    )


def _format_called(name: str) -> "WordFormat":
    from motorcade.words.formats import format_named

    if not name.endswith(".toml"):
        return format_named(name)
    from motorcade.cli.exports import vocabulary_in

    return vocabulary_in(Path(name)).formats[0]
