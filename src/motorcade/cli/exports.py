"""The commands about the formats themselves: formats, export.

Each command imports what it needs when it runs, so that the others start at once.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.options import Json, print_json, print_table, print_text, read_file, wants_json, write_file
from motorcade.errors import MotorcadeError

if TYPE_CHECKING:
    from motorcade.config.vocabulary import Vocabulary

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
    app.command()(formats)
    app.command()(export)


def formats(format_file: FormatFile = None, as_json: Json = False) -> None:
    """Show the word formats, their fields and their fingerprints.

    Two ends that name the same fingerprint mean the same by their words.
    """
    from motorcade.config.vocabulary import fingerprint_text

    vocabulary = vocabulary_in(format_file)
    if wants_json(as_json):
        print_json(
            [
                {
                    "name": word_format.name,
                    "fingerprint": fingerprint_text(word_format),
                    "fields": [
                        {
                            "name": field.name,
                            "high": field.high,
                            "low": field.low,
                            "minimum": field.minimum,
                            "maximum": field.maximum,
                            "default": field.default,
                            "unit": field.unit,
                            "allowed": str(field.allowed),
                            "meaning": field.meaning,
                            "source": field.source,
                        }
                        for field in word_format.fields
                    ],
                }
                for word_format in vocabulary.formats
            ]
        )
        return
    from motorcade.cli.console import format_table

    for word_format in vocabulary.formats:
        print_table(format_table(word_format, fingerprint_text(word_format)))


def export(
    target: Annotated[
        str, typer.Argument(metavar="TARGET", help="c, wireshark, kaitai, json-schema, markdown or vectors")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", file_okay=False, help="The folder to write into.")
    ] = Path(),
    format_file: FormatFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Tell in JSON which files were written.")] = False,
) -> None:
    """Write what lets another tool or language speak the words; files of an earlier export are replaced."""
    from motorcade.export.targets import export as make

    files = make(target, vocabulary_in(format_file))
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
        print_text("".join(f"wrote {path}\n" for path in written))


def vocabulary_in(format_file: Path | None) -> "Vocabulary":
    """The format that a TOML file declares, or Motorcade's own where there is no file."""
    from motorcade.config.own_format import read_format
    from motorcade.config.vocabulary import MOTORCADE

    if format_file is None:
        return MOTORCADE
    try:
        text = read_file(format_file).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise MotorcadeError("format-not-utf-8", file=format_file) from None
    return read_format(text, str(format_file))
