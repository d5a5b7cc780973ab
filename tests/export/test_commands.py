"""`motorcade export` and `motorcade formats` as a user types them."""

import json

import pytest

from motorcade.cli.words import TARGETS, exported
from motorcade.words.formats import DRIVE, FORMATS, fingerprint
from support.command_line import Terminal, data, refusal, run


@pytest.mark.parametrize("target", TARGETS)
def test_an_export_is_written_into_the_folder(target, tmp_path):
    ran = run("export", target, "-o", tmp_path / "new" / "folder")
    assert (ran.code, ran.err) == (0, "")
    files = exported(target)
    for name, contents in files.items():
        path = tmp_path / "new" / "folder" / name
        assert path.read_bytes() == contents
        assert f"wrote {path}\n" in ran.out
    assert len(list((tmp_path / "new" / "folder").iterdir())) == len(files)


def test_without_a_folder_it_goes_where_one_is_and_replaces_an_earlier_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "motorcade_words.h").write_text("an older one")
    assert run("export", "c").out == "wrote motorcade_words.h\n"
    assert (tmp_path / "motorcade_words.h").read_text(encoding="utf-8").startswith("/* Motorcade's words")


def test_json_lists_the_files(tmp_path):
    written = data("export", "brain-c", "-o", tmp_path, "--json")["files"]
    assert written == [str(tmp_path / "motorcade_brain.h"), str(tmp_path / "motorcade_brain.c")]


def test_a_target_that_there_is_not_is_answered_with_those_there_are():
    sentence = refusal(2, "export", "pascal")
    assert sentence == "there is no target 'pascal'; there are c, brain-c, wireshark, json-schema, vectors"


def test_a_folder_that_can_not_be_is_a_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    assert "can't be made" in refusal(2, "export", "c", "-o", tmp_path / "file" / "folder")


def test_formats_prints_fields_and_fingerprints():
    printed = data("formats")
    assert [(each["name"], each["fingerprint"]) for each in printed] == [
        (word_format.name, f"0x{fingerprint(word_format):08X}") for word_format in FORMATS
    ]
    angle = next(field for field in printed[FORMATS.index(DRIVE)]["fields"] if field["name"] == "angle")
    assert {key: angle[key] for key in ("high", "low", "minimum", "maximum", "default", "unit")} == {
        "high": 27,
        "low": 20,
        "minimum": 0,
        "maximum": 180,
        "default": 90,
        "unit": "deg",
    }


def test_formats_shows_tables_on_a_terminal():
    shown = run("formats", stdout=Terminal()).out
    for word_format in FORMATS:
        assert f"{word_format.name}, fingerprint 0x{fingerprint(word_format):08X}" in shown
    assert "0 to 180 deg" in shown
    assert json.loads(run("formats", "--json", stdout=Terminal()).out) == data("formats")
