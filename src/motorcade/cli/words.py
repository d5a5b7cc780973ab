"""Commands about words, programs and formats: encode, decode, compile, decompile, inspect, formats, export."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.language import Language, current_language, translated
from motorcade.cli.options import (
    ExistingFile,
    Json,
    OptionalOutput,
    compile_project,
    print_json,
    print_lines,
    print_table,
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

app = typer.Typer()
FormatName = Annotated[str, typer.Argument(metavar="FORMAT")]
FormatFile = Annotated[
    Path | None, typer.Option("--format", metavar="FILE.toml", exists=True, dir_okay=False, readable=True)
]


@app.command("encode")
def _encode(
    word_format: FormatName,
    values: Annotated[list[str] | None, typer.Argument(metavar="NAME=VALUE...")] = None,
    as_json: Json = False,
) -> None:
    chosen, _ = _format_called(word_format)
    fields: dict[str, int] = {}
    for text in values or ():
        name, equals, value = text.partition("=")
        if not equals:
            raise MotorcadeError("not-name-and-value", text=text, name=chosen.fields[0].name)
        if chosen.field(name).parity_masks:
            raise MotorcadeError("field-is-computed", field=name)
        if name in fields:
            raise MotorcadeError("field-given-twice", field=name)
        fields[name] = whole_number(value, name)
    word = chosen.complete(chosen.encode(**fields))
    if wants_json(as_json):
        print_json({"word": word, "hex": f"0x{word:08X}", "bits": f"{word:032b}"})
    else:
        from motorcade.cli.console import coloured_bits

        print_table(coloured_bits(word, chosen, f"{word}  0x{word:08X}  "))


@app.command("decode", context_settings={"ignore_unknown_options": True})
def _decode(
    word_format: FormatName, words: Annotated[list[str], typer.Argument(metavar="WORD...")], as_json: Json = False
) -> None:
    chosen, vocabulary = _format_called(word_format)
    decoded = []
    for text in words:
        number = whole_number(text, Phrase("a-word"))
        word = number + (1 << 32) if -(1 << 31) <= number < 0 else number
        values = chosen.decode(word)
        decoded.append({"word": word, "fields": values._asdict(), "warnings": chosen.warnings(word)})
    if wants_json(as_json):
        print_json([{**each, **_warnings_as_dict(each["warnings"])} for each in decoded])
        return
    from motorcade.cli.console import fields_table

    for each in decoded:
        print_table(fields_table(each["word"], chosen, vocabulary, each["warnings"]))


def _warnings_as_dict(warnings: list[Phrase]) -> dict[str, list[str]]:
    return {"warnings": [str(warning) for warning in warnings], "warning_codes": [warning.key for warning in warnings]}


@app.command("compile")
def _compile(
    project: ExistingFile, output: OptionalOutput = None, language: Language = "", as_json: Json = False
) -> None:
    from rich.console import Console

    from motorcade.cli.console import print_diagnostics, words_table
    from motorcade.program.diagnostics import ProgramError, has_errors

    try:
        compiled, profile = compile_project(read_file(project), project)
        words, diagnostics = compiled.words, compiled.diagnostics
        counts = (compiled.leader_states, compiled.follower_words, compiled.dwell_ms, compiled.tagged)
    except ProgramError as problem:
        words, diagnostics, counts, profile = (), problem.diagnostics, (0, 0, 0, False), None
    failed = has_errors(diagnostics)
    if output and not failed:
        write_file(output, compiled.image, project)
    if wants_json(as_json):
        print_json(
            {
                "words": list(words),
                **dict(zip(("leader_states", "follower_words", "dwell_ms", "tagged"), counts, strict=True)),
                "diagnostics": [each.as_dict(current_language()) for each in diagnostics],
            }
        )
    elif profile and not failed:
        print_table(words_table(words, profile))
    print_diagnostics(Console(stderr=True), diagnostics)
    if failed:
        raise typer.Exit(PROGRAM_ERROR)


@app.command("decompile")
def _decompile(
    image: ExistingFile,
    profile: str = "classroom",
    python: Annotated[bool, typer.Option("--python")] = False,
    language: Language = "",
    as_json: Json = True,
) -> None:
    from motorcade.program.decompiler import decompile
    from motorcade.program.python_writer import python_text

    program = decompile(words_in(image), profile_named(profile))
    print_lines([(python_text(program) if python else program.as_json()).removesuffix("\n")])


@app.command("inspect")
def _inspect(image: ExistingFile, profile: str = "classroom", language: Language = "", as_json: Json = False) -> None:
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


@app.command("formats")
def _formats(format_file: FormatFile = None, as_json: Json = False) -> None:
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


@app.command("export")
def _export(
    target: Annotated[str, typer.Argument(metavar="TARGET")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", file_okay=False)] = Path(),
    format_file: FormatFile = None,
    as_json: Json = False,
) -> None:
    from motorcade.export import export

    files = export(target, _vocabulary_in(format_file))
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
        print_lines(translated("file-written", file=path) for path in written)


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
