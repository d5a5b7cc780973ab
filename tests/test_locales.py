"""The catalogue of sentences: every code has one in every language, and each has a code."""

import ast
import json
import re
from functools import cache
from pathlib import Path
from string import Formatter

import numpy as np
import pytest
from scripts.exports import markdown

from motorcade import locales
from motorcade.cli import command_line
from motorcade.errors import MotorcadeError, Phrase
from motorcade.outcomes import EXIT_CODES, HTTP_STATUSES, exit_code_of, http_status_of
from motorcade.words.formats import FORMATS
from support.command_line import PARADE, run
from support.source_trees import tree_of

SOURCE = Path(locales.FOLDER).parent
# Those of scripts/exports write documentation and other tools' files in sentences of the catalogue.
FILES = sorted([*SOURCE.rglob("*.py"), *(SOURCE.parents[1] / "scripts" / "exports").glob("*.py")])
LANGUAGES = sorted(file.stem for file in locales.FOLDER.glob("*.json"))
# What makes a diagnostic of a program.
DIAGNOSTICS = {"error", "warning"}
HOME_OF_DIAGNOSTICS = "motorcade.program.diagnostics"


def trees():
    """The parsed files. Not at import: every process that runs tests imports this file, and one runs its tests."""
    return {file: tree_of(file) for file in FILES if file.name != "outcomes.py"}


@cache
def error_classes():
    """MotorcadeError and the names of all its subclasses; the second value: those with a constructor of their own."""
    bases = {
        node.name: (
            {base.id for base in node.bases if isinstance(base, ast.Name)},
            any(isinstance(each, ast.FunctionDef) and each.name == "__init__" for each in node.body),
        )
        for tree in trees().values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    }
    names, growing = {"MotorcadeError"}, True
    while growing:
        found = {name for name, (parents, _) in bases.items() if parents & names} - names
        names, growing = names | found, bool(found)
    return names, {name for name in names - {"MotorcadeError"} if bases[name][1]}


@cache
def parts():
    """Which part of the catalogue the first argument of a call names."""
    errors, with_constructor = error_classes()
    return dict.fromkeys((errors | DIAGNOSTICS) - with_constructor, "errors") | {
        "Phrase": "phrases",
        "picture_text": "phrases",
        "translated": "command_line",
    }


def pattern_of(node):
    """A regular expression of what a key may be: several where it is put together, such as ``f"{kind}-range"``."""
    match node:
        case ast.Constant(value=str(value)):
            return re.escape(value)
        case ast.JoinedStr(values=parts):
            return "".join(pattern_of(part) for part in parts)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return pattern_of(left) + pattern_of(right)
        case ast.IfExp(body=body, orelse=orelse):
            return f"({pattern_of(body)}|{pattern_of(orelse)})"
    return ".+"


def constants_in(node):
    """The strings that an expression may be: one, or both of ``"a" if x else "b"``."""
    if isinstance(node, ast.IfExp):
        return constants_in(node.body) + constants_in(node.orelse)
    return [node.value] if isinstance(node, ast.Constant) and isinstance(node.value, str) else []


def calls_in(tree):
    """The calls that name a text, each with its part of the catalogue."""
    nodes = list(ast.walk(tree))
    modules = {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
    part_of = dict(parts())
    if HOME_OF_DIAGNOSTICS not in modules:
        part_of = {name: part for name, part in part_of.items() if name not in DIAGNOSTICS}
    for node in nodes:
        if isinstance(node, ast.ClassDef) and node.name in error_classes()[0]:
            for each in ast.walk(node):
                if isinstance(each, ast.Call) and ast.unparse(each.func) == "super().__init__" and each.args:
                    yield "errors", each
        elif isinstance(node, ast.Call) and node.args and getattr(node.func, "id", "") in part_of:
            yield part_of[node.func.id], node


@cache
def calls_by_file():
    return {file: list(calls_in(tree)) for file, tree in trees().items()}


@cache
def calls():
    """Of each key that a call writes out: file and line, part of the catalogue, key, and the names of the details.

    The names are None where the call passes more than it writes out.
    """
    found = set()
    for file, in_file in calls_by_file().items():
        for part, call in in_file:
            names = {keyword.arg for keyword in call.keywords}
            for key in constants_in(call.args[0]):
                place = f"{file.relative_to(SOURCE.parents[1])}:{call.lineno}"
                found.add((place, part, key, None if None in names else frozenset(names)))
    return sorted(found, key=lambda call: call[:3])


def placeholders(sentence):
    return {name for _, name, _, _ in Formatter().parse(sentence) if name}


@pytest.mark.parametrize("part", ["errors", "phrases", "command_line"])
def test_every_key_in_the_code_has_a_text_in_every_language(part):
    missing = [
        (place, key, language)
        for place, its_part, key, _ in calls()
        for language in LANGUAGES
        if its_part == part and key not in locales.catalogue(language)[part]
    ]
    assert missing == []


@pytest.mark.parametrize("part", ["errors", "phrases", "command_line"])
def test_the_details_of_a_call_fill_every_placeholder(part):
    wrong = [
        (place, key, sorted(needed - given))
        for place, its_part, key, given in calls()
        if its_part == part and given is not None and key in locales.catalogue("en")[part]
        for needed in [placeholders(locales.catalogue("en")[part][key])]
        if needed - given
    ]
    assert wrong == []


def test_every_text_is_used():
    constants = {
        node.value
        for tree in trees().values()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    patterns = [
        pattern_of(call.args[0])
        for in_file in calls_by_file().values()
        for _, call in in_file
        if isinstance(call.args[0], (ast.JoinedStr, ast.BinOp))
    ]
    unused = {
        f"{part}.{key}"
        for part in ("errors", "phrases", "command_line")
        for key in locales.catalogue("en")[part]
        if key not in constants and not any(re.fullmatch(pattern, key) for pattern in patterns)
    }
    assert unused == set()


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_language_has_the_same_keys_and_placeholders(language):
    english, other = locales.catalogue("en"), locales.catalogue(language)
    assert set(other) == set(english)
    pages = (english["page"].get("errors", {}), other["page"].get("errors", {}))
    parts = ("errors", "phrases", "system", "command_line", "help")
    for ours, theirs in [*((english[part], other[part]) for part in parts), pages]:
        assert set(theirs) == set(ours)
        assert {key: placeholders(text) for key, text in theirs.items()} == {
            key: placeholders(text) for key, text in ours.items()
        }
    assert set(pages[0]) <= set(english["errors"])


def commands_below(command, path="motorcade"):
    yield path.removeprefix("motorcade "), command
    for name, each in getattr(command, "commands", {}).items():
        yield from commands_below(each, f"{path} {name}")


def test_every_command_and_option_has_help_and_no_help_is_left_over():
    known, used = locales.catalogue("en")["help"], set()
    # An argument whose name in the usage says all needs no more.
    named = {"compile.project", "decompile.image", "inspect.image", "simulate.source", "upload.source", "sweep.spec"}
    for path, command in commands_below(command_line()):
        used.add(path)
        for parameter in command.params:
            if getattr(parameter, "hidden", False):
                continue
            own = f"{path}.{parameter.name}"
            used |= {own if own in known else f".{parameter.name}"} - (
                {f".{parameter.name}"} if own in named else set()
            )
    assert used == set(known)


def test_help_is_in_the_language_of_the_option_or_the_system(monkeypatch):
    chinese = locales.catalogue("zh")["help"]
    shown = run("simulate", "--language", "zh", "--help").out
    assert chinese["simulate"] in shown
    assert [name for name in ("Usage", "OPTIONS", "Options", "Arguments", "default", "required") if name in shown] == []
    assert "[默认：" in shown
    monkeypatch.setenv("LC_ALL", "zh_CN.UTF-8")
    shown = run("--help").out
    assert chinese["plot"] in shown
    assert locales.catalogue("en")["help"]["plot"] not in shown


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_command_in_a_sentence_works_in_every_shell(language):
    """Windows' cmd passes single quotes on to the program."""
    text = (locales.FOLDER / f"{language}.json").read_text(encoding="utf-8")
    assert 'pip install \\".[' in text
    assert re.findall(r"pip install '[^']*'", text) == []


def test_every_field_of_the_words_has_its_meaning_in_every_language():
    declared = {
        f"{word_format.name}.{field.name}": field.meaning for word_format in FORMATS for field in word_format.fields
    }
    assert locales.catalogue("en")["meanings"] == declared
    for language in LANGUAGES:
        assert set(locales.catalogue(language)["meanings"]) == set(declared)


def test_a_file_of_the_catalogue_is_written_in_one_way():
    for file in locales.FOLDER.glob("*.json"):
        text = file.read_text(encoding="utf-8")
        assert text == json.dumps(json.loads(text), indent=2, ensure_ascii=False) + "\n"


@pytest.mark.parametrize(("rows", "outcome_of"), [(EXIT_CODES, exit_code_of), (HTTP_STATUSES, http_status_of)])
def test_the_tables_of_outcomes_name_each_code_once_and_only_codes_that_there_are(rows, outcome_of):
    codes = [code for _, codes in rows for code in codes]
    assert sorted(codes) == sorted(set(codes))
    assert set(codes) <= set(locales.catalogue("en")["errors"])
    assert all({outcome_of(code) for code in named} == {outcome} for outcome, named in rows)


@pytest.fixture
def third_language(tmp_path, monkeypatch):
    """A language that is one file more: each sentence is the English one between brackets."""

    def bracketed(value):
        return {key: bracketed(each) for key, each in value.items()} if isinstance(value, dict) else f"⟦{value}⟧"

    for language in LANGUAGES:
        source = locales.FOLDER / f"{language}.json"
        (tmp_path / source.name).write_bytes(source.read_bytes())
    document = bracketed(locales.catalogue("en")) | {"language": "Latina", "english_name": "Latin"}
    (tmp_path / "la.json").write_text(json.dumps(document), encoding="utf-8")
    monkeypatch.setenv("MOTORCADE_LOCALES", str(tmp_path))
    forget()
    yield "la"
    monkeypatch.undo()
    forget()


def forget():
    locales.languages.cache_clear()
    locales.catalogue.cache_clear()


def test_one_file_more_adds_a_language(third_language):
    assert locales.languages() == ("en", "la", "zh")
    error = MotorcadeError("not-a-program", place="here", reason=Phrase("image-is-empty"))
    assert error.sentence("la") == "⟦here is no program: ⟦the image is empty: not even a header word is here⟧⟧"
    assert set(error.to_dict()["sentence"]) == {"en", "la", "zh"}
    page = markdown("la")
    assert page.splitlines()[2] == "# ⟦Words, bit by bit⟧"
    assert "⟦the wheels are driven⟧" in page


def test_a_text_that_a_language_has_not_got_is_given_in_english(third_language, tmp_path):
    (tmp_path / "la.json").write_text('{"language": "Latina", "english_name": "Latin"}', encoding="utf-8")
    forget()
    assert Phrase("image-is-empty").sentence("la") == Phrase("image-is-empty").sentence("en")


@pytest.mark.parametrize("name", ["la_VA.UTF-8", "Latin_Vatican City.1252"])
def test_errors_are_in_the_language_of_the_system(third_language, monkeypatch, name):
    monkeypatch.setenv("LC_ALL", name)
    ran = run("decode", "drive", "0x1FFFFFFFF")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err == "motorcade: ⟦drive word is 8589934591; allowed: ⟦0 to 4294967295⟧⟧\n"


def test_diagnostics_of_a_program_are_in_the_new_language(third_language, tmp_path):
    path = tmp_path / "project.json"
    path.write_text(
        json.dumps(json.loads(PARADE.read_text(encoding="utf-8")) | {"leader": [], "followers": None}), encoding="utf-8"
    )
    ran = run("compile", path, "--language", third_language)
    assert ran.code == 0
    assert "⟦warning⟧ empty-program: ⟦" in ran.err


def test_a_language_that_is_not_there_is_refused_with_those_that_are(third_language):
    ran = run("compile", PARADE, "--language", "tlh")
    assert (ran.code, ran.out) == (2, "")
    assert "'tlh' is not one of en, la, zh" in ran.err


@pytest.mark.parametrize("language", LANGUAGES)
def test_an_address_ends_where_a_terminal_sees_its_end(language):
    """A comma of full width, and what follows it, would be a part of the address that is clicked."""
    catalogue = locales.catalogue(language)
    texts = [text for part in ("errors", "phrases", "command_line") for text in catalogue[part].values()]
    assert [text for text in texts if re.search(r"\{(url|addresses)\}[^\x00-\x7f]", text)] == []


@pytest.mark.parametrize(
    ("key", "details", "sentence"),
    [
        ("shortest-found", {"blocks": 1, "runs": 900}, "1 block (900 runs)"),
        ("shortest-found", {"blocks": 2, "runs": 1}, "2 blocks (1 run)"),
        ("cars-run", {"cars": 1, "first": "car 1"}, "1 car runs; it is at car 1. Ctrl-C stops them."),
        (
            "sweep-was-done",
            {"runs": 1, "table": "t", "done": 1, "tasks": np.int64(1)},
            "1 run is in t; 1 of 1 task was done already.",
        ),
        ("lines-lost", {"count": 0}, "0 lines are not shown, since nobody took them in time."),
    ],
)
def test_a_noun_beside_a_number_has_its_form(key, details, sentence):
    assert locales.text("command_line", key, details, "en") == sentence
