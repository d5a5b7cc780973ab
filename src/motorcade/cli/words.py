"""Commands about words, programs and formats: encode, decode, compile, decompile, inspect, formats, export.

Each command imports what it needs when it runs, so that the others start quickly.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.language import Language, resolve_locale, translated
from motorcade.cli.options import (
    ExistingFile,
    Json,
    ProfileOption,
    compile_project,
    print_json,
    print_table,
    print_text,
    profile_named,
    read_file,
    wants_json,
    whole_number,
    words_in,
    write_file,
)
from motorcade.errors import MotorcadeError, Phrase
from motorcade.outcomes import PROGRAM_ERROR

if TYPE_CHECKING:
    from motorcade.config.vocabulary import Vocabulary
    from motorcade.words.field import WordFormat

FormatFile = Annotated[
    Path | None,
    typer.Option(
        "--format",
        metavar="FILE.toml",
        exists=True,
        dir_okay=False,
        readable=True,
        help="A word format of your own in place of Motorcade's.",
    ),
]


def add_to(app: typer.Typer) -> None:
    """Register the commands."""
    app.command()(encode)
    app.command(context_settings={"ignore_unknown_options": True})(decode)
    app.command("compile")(compile_command)
    app.command("decompile")(decompile_command)
    app.command()(inspect)
    app.command()(formats)
    app.command()(export)


def encode(
    word_format: Annotated[
        str, typer.Argument(metavar="FORMAT", help="header, control, drive, or a FILE.toml of your own.")
    ],
    values: Annotated[list[str] | None, typer.Argument(metavar="NAME=VALUE...", help="Raw values of fields.")] = None,
    as_json: Json = False,
) -> None:
    """Make a word from the values of its fields; fields left out take their default."""
    chosen, _ = _format_called(word_format)
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
    chosen, vocabulary = _format_called(word_format)
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
        print_table(fields_table(each["word"], chosen, vocabulary, each["warnings"]))


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


def formats(format_file: FormatFile = None, as_json: Json = False) -> None:
    """Show the word formats, their fields and their fingerprints.

    Two ends with the same fingerprint give their words the same meaning.
    """
    vocabulary = _vocabulary_in(format_file)
    if wants_json(as_json):
        print_json([_format_as_dict(word_format) for word_format in vocabulary.formats])
        return
    from motorcade.cli.console import format_table

    for word_format in vocabulary.formats:
        print_table(format_table(word_format, vocabulary))


def _format_as_dict(word_format: "WordFormat") -> dict[str, object]:
    from motorcade.config.vocabulary import fingerprint_text

    names = ("name", "high", "low", "minimum", "maximum", "default", "unit", "allowed", "meaning", "source")
    fields = [{name: getattr(field, name) for name in names} for field in word_format.fields]
    fields = [{**values, "allowed": str(values["allowed"])} for values in fields]
    return {"name": word_format.name, "fingerprint": fingerprint_text(word_format), "fields": fields}


def export(
    target: Annotated[
        str, typer.Argument(metavar="TARGET", help="c, wireshark, kaitai, json-schema, markdown or vectors")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", file_okay=False, help="The folder to write into.")
    ] = Path(),
    format_file: FormatFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the names of the files as JSON.")] = False,
) -> None:
    """Write what lets another tool or language speak the words; files of an earlier export are replaced."""
    from motorcade.export import export as make

    files = make(target, _vocabulary_in(format_file))
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise MotorcadeError("folder-not-writable", folder=output, reason=problem.strerror) from None
    written = []
    for name, text in files.items():
        write_file(output / name, text.encode(), format_file)
        written.append(str(output / name))
    if as_json:
        print_json({"files": written})
    else:
        print_text("".join(translated("file-written", file=path) + "\n" for path in written))


def _vocabulary_in(format_file: Path | None) -> "Vocabulary":
    """Return the format that a TOML file declares, or Motorcade's own where there is no file."""
    from motorcade.config.own_format import read_format
    from motorcade.config.vocabulary import MOTORCADE

    if format_file is None:
        return MOTORCADE
    try:
        text = read_file(format_file).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise MotorcadeError("format-not-utf-8", file=format_file) from None
    return read_format(text, str(format_file))


def _format_called(name: str) -> "tuple[WordFormat, Vocabulary]":
    """Return the format that is called ``name`` or declared in the file ``name``, and its vocabulary."""
    from motorcade.words.formats import format_named

    if not name.endswith(".toml"):
        return format_named(name), _vocabulary_in(None)
    vocabulary = _vocabulary_in(Path(name))
    return vocabulary.formats[0], vocabulary
