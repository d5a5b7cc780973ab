"""Commands about words, programs and formats: encode, decode, compile, decompile, inspect, formats, export."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli import options
from motorcade.cli.output import (
    current_language,
    print_diagnostics,
    print_json,
    print_lines,
    print_result,
    print_table,
    translated,
    wants_json,
)
from motorcade.config.files import raised_as
from motorcade.errors import MotorcadeError, Phrase
from motorcade.outcomes import PROGRAM_ERROR

if TYPE_CHECKING:
    from motorcade.words.field import WordFormat

# What `motorcade export` gives: the words, and the brain of a car, for other tools; `make generate` wrote the files.
TARGETS = {
    "c": ("motorcade_words.h",),
    "brain-c": ("motorcade_brain.h", "motorcade_brain.c"),
    "wireshark": ("motorcade_words.lua",),
    "json-schema": ("motorcade_words.schema.json",),
    "vectors": ("motorcade_words.vectors.json",),
}
app = typer.Typer()
FormatName = Annotated[str, typer.Argument(metavar="FORMAT")]


@app.command("encode")
def _encode(
    word_format: FormatName,
    values: Annotated[list[str] | None, typer.Argument(metavar="NAME=VALUE...")] = None,
) -> None:
    from motorcade.words.formats import format_named

    chosen = format_named(word_format)
    fields: dict[str, int] = {}
    for text in values or ():
        name, equals, value = text.partition("=")
        if not equals:
            raise MotorcadeError("not-name-and-value", text=text, name=chosen.fields[0].name)
        if chosen.field(name).parity_masks:
            raise MotorcadeError("field-is-computed", field=name)
        if name in fields:
            raise MotorcadeError("field-given-twice", field=name)
        fields[name] = options.whole_number(value, name)
    word = chosen.complete(chosen.encode(**fields))
    if wants_json():
        print_json({"word": word, "hex": f"0x{word:08X}", "bits": f"{word:032b}"})
    else:
        from motorcade.cli.console import coloured_bits

        print_table(coloured_bits(word, chosen, f"{word}  0x{word:08X}  "))


@app.command("decode", context_settings={"ignore_unknown_options": True})
def _decode(
    word_format: FormatName,
    words: Annotated[list[str], typer.Argument(metavar="WORD...")],
) -> None:
    from motorcade.words.formats import format_named

    chosen = format_named(word_format)
    decoded = []
    for text in words:
        number = options.whole_number(text, Phrase("a-word"))
        word = number
        if -(1 << 31) <= number < 0:
            word = number + (1 << 32)
        decoded.append((word, chosen.decode(word), chosen.warnings(word)))
    if wants_json():
        rows = []
        for word, values, warnings in decoded:
            texts = [str(warning) for warning in warnings]
            codes = [warning.key for warning in warnings]
            rows.append({"word": word, "fields": values._asdict(), "warnings": texts, "warning_codes": codes})
        print_json(rows)
        return
    from motorcade.cli.console import fields_table

    for word, _, warnings in decoded:
        print_table(fields_table(word, chosen, warnings))


@app.command("compile")
def _compile(project: options.ExistingFile, output: options.OptionalOutput = None) -> None:
    from motorcade.cli.console import words_table
    from motorcade.config.files import read_bytes
    from motorcade.program.compiler import Compiled
    from motorcade.program.diagnostics import ProgramError, has_errors
    from motorcade.program.files import compile_project

    try:
        compiled, profile = compile_project(read_bytes(project), project)
    except ProgramError as problem:
        compiled = Compiled((), 0, 0, 0, False, problem.diagnostics, ())
        profile = None
    failed = has_errors(compiled.diagnostics)
    if output and not failed:
        options.write_file(output, compiled.image, project)
    if wants_json():
        names = ("leader_states", "follower_words", "dwell_ms", "tagged")
        found = {name: getattr(compiled, name) for name in names}
        diagnostics = [diagnostic.as_dict(current_language()) for diagnostic in compiled.diagnostics]
        print_json({"words": list(compiled.words), **found, "diagnostics": diagnostics})
    elif profile and not failed:
        print_table(words_table(compiled.words, profile))
    print_diagnostics(compiled.diagnostics)
    if failed:
        raise typer.Exit(PROGRAM_ERROR)


@app.command("decompile")
def _decompile(
    image: options.ExistingFile,
    profile: str = "classroom",
    python: Annotated[bool, typer.Option("--python")] = False,
    output: options.OptionalOutput = None,
) -> None:
    from motorcade.program.decompiler import decompile
    from motorcade.program.files import words_in
    from motorcade.program.python_writer import python_text

    options.exclude_each_other(python=python, json=wants_json())
    program = decompile(words_in(image), options.profile_named(profile))
    if python:
        text = python_text(program)
    else:
        text = program.as_json()
    if output:
        options.write_file(output, text.encode(), image)
    else:
        print_lines([text.removesuffix("\n")])


@app.command("inspect")
def _inspect(image: options.ExistingFile, profile: str = "classroom") -> None:
    from motorcade.program.files import words_in
    from motorcade.words.image import format_at, parse_image

    words = words_in(image)
    parsed = parse_image(words)
    if not wants_json():
        from motorcade.cli.console import words_table

        print_table(words_table(words, options.profile_named(profile)))
        return
    roles = ["header"] + ["leader"] * len(parsed.leader) + ["follower"] * len(parsed.followers)
    rows = []
    for position, (word, role) in enumerate(zip(words, roles, strict=True)):
        values = format_at(position, word, words[0]).decode(word)
        rows.append({"word": word, "role": role, "fields": values._asdict()})
    print_json(rows)


@app.command("formats")
def _formats() -> None:
    from motorcade.cli.console import fingerprint_text, format_table
    from motorcade.words.formats import FORMATS

    if wants_json():
        print_json([_format_as_dict(word_format, fingerprint_text(word_format)) for word_format in FORMATS])
        return
    for word_format in FORMATS:
        print_table(format_table(word_format))


def _format_as_dict(word_format: "WordFormat", fingerprint: str) -> dict[str, object]:
    names = ("name", "high", "low", "minimum", "maximum", "default", "unit", "allowed", "meaning", "source")
    fields = []
    for field in word_format.fields:
        row = {name: getattr(field, name) for name in names}
        row["allowed"] = str(field.allowed)
        fields.append(row)
    return {"name": word_format.name, "fingerprint": fingerprint, "fields": fields}


def exported(target: str) -> dict[str, bytes]:
    """Return the files of a target of `motorcade export`, by name. Raises MotorcadeError: unknown-target."""
    from importlib.resources import files
    from importlib.resources.abc import Traversable

    from motorcade.firmware.arduino_library import library_folder

    if target not in TARGETS:
        raise MotorcadeError("unknown-target", target=target[:40], targets=", ".join(TARGETS))
    # The brain is a part of the Arduino library, whose sources must be in one folder.
    folder: Traversable = files("motorcade") / "export"
    if target == "brain-c":
        folder = library_folder() / "src"
    return {name: (folder / name).read_bytes() for name in TARGETS[target]}


@app.command("export")
def _export(
    target: Annotated[str, typer.Argument(metavar="TARGET")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", file_okay=False)] = Path(),
) -> None:
    found = exported(target)
    with raised_as("folder-not-writable", OSError, folder=output):
        output.mkdir(parents=True, exist_ok=True)
    for name, contents in found.items():
        options.write_file(output / name, contents)
    written = [str(output / name) for name in found]
    print_result({"files": written}, "\n".join(translated("file-written", file=path) for path in written))
