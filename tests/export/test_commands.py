"""`motorcade export` and `motorcade formats` as a user types them."""

import json

import pytest

from motorcade.config.vocabulary import MOTORCADE, fingerprint_text
from motorcade.export import TARGETS, export
from motorcade.words.formats import CONTROL, DRIVE, FRAME, HEADER
from support.command_line import Terminal, data, refusal, run
from support.vocabularies import WALKER_FILE


@pytest.mark.parametrize("target", TARGETS)
def test_an_export_is_written_into_the_folder(target, tmp_path):
    ran = run("export", target, "-o", tmp_path / "new" / "folder")
    assert (ran.code, ran.err) == (0, "")
    files = export(target, MOTORCADE)
    for name, text in files.items():
        path = tmp_path / "new" / "folder" / name
        assert path.read_bytes() == text.encode()
        assert f"wrote {path}\n" in ran.out
    assert len(list((tmp_path / "new" / "folder").iterdir())) == len(files)


def test_without_a_folder_it_goes_where_one_is_and_replaces_an_earlier_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "motorcade_words.h").write_text("an older one")
    assert run("export", "c").out == "wrote motorcade_words.h\n"
    assert (tmp_path / "motorcade_words.h").read_text(encoding="utf-8").startswith("/* Motorcade's words")


def test_json_lists_the_files(tmp_path):
    written = data("export", "markdown", "-o", tmp_path, "--json")["files"]
    assert written == [str(tmp_path / "motorcade_words.md"), str(tmp_path / "motorcade_words.zh.md")]


@pytest.mark.parametrize("target", [target for target in TARGETS if target != "brain-c"])
def test_a_format_of_ones_own_goes_through_every_target(target, tmp_path):
    ran = run("export", target, "--format", WALKER_FILE, "-o", tmp_path)
    assert (ran.code, ran.err) == (0, "")
    for path in tmp_path.iterdir():
        assert path.name.startswith("motorcade_walker")
        assert "gait" in path.read_text(encoding="utf-8")


def test_the_brain_takes_no_other_words():
    assert "'walker'" in refusal(2, "export", "brain-c", "--format", WALKER_FILE)


def test_a_target_that_there_is_not_is_answered_with_those_there_are():
    sentence = refusal(2, "export", "pascal")
    assert (
        sentence
        == "there is no target 'pascal'; there are c, brain-c, wireshark, kaitai, json-schema, markdown, vectors"
    )


def test_the_help_names_every_target():
    printed = run("export", "--help").out
    assert [name for name in TARGETS if name not in printed] == []


def test_a_folder_that_can_not_be_is_a_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    assert "can't be made" in refusal(2, "export", "c", "-o", tmp_path / "file" / "folder")


def test_a_format_file_that_is_none_is_a_sentence_with_its_line(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\n[[field]]\nname = "int"\nwidth = 32\nmeaning = "all"\n')
    for command in (("export", "c", "-o", tmp_path / "out"), ("formats",)):
        sentence = refusal(1, *command, "--format", path)
        assert sentence.startswith(f"{path}, line 3: the name 'int' is a word of C")
    assert not (tmp_path / "out").exists()


def test_a_format_file_that_is_no_text_or_not_there_is_a_sentence(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xff\xfe\x00")
    assert "no text in UTF-8" in refusal(2, "formats", "--format", path)
    ran = run("formats", "--format", tmp_path / "none.toml")
    assert (ran.code, ran.out) == (2, "")
    assert "does not exist" in " ".join(ran.err.split())


def test_a_format_file_as_windows_editors_save_it_is_read(tmp_path):
    path = tmp_path / "mine.toml"
    text = WALKER_FILE.read_text(encoding="utf-8")
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert data("formats", "--format", path) == data("formats", "--format", WALKER_FILE)


def test_formats_prints_fields_and_fingerprints():
    printed = data("formats")
    assert [(each["name"], each["fingerprint"]) for each in printed] == [
        (word_format.name, fingerprint_text(word_format)) for word_format in (HEADER, CONTROL, DRIVE, FRAME)
    ]
    angle = next(field for field in printed[2]["fields"] if field["name"] == "angle")
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
    for word_format in (HEADER, CONTROL, DRIVE, FRAME):
        assert f"{word_format.name}, fingerprint {fingerprint_text(word_format)}" in shown
    assert "0 to 180 deg" in shown
    assert json.loads(run("formats", "--json", stdout=Terminal()).out) == data("formats")


def test_words_of_ones_own_format_are_encoded_and_decoded():
    made = data("encode", WALKER_FILE, "walks=1", "gait=3", "heading=270", "legs=2", "lift=4")
    assert made["hex"] == "0xF0E22000"
    (decoded,) = data("decode", WALKER_FILE, made["hex"])
    assert decoded["fields"]["heading"] == 270
    assert refusal(2, "encode", WALKER_FILE, "heading=360") == "heading is 360; allowed: 0 to 359"
    assert "No such file" in refusal(2, "decode", "none.toml", "1")
