"""The command line as a whole, and its commands about words and images: encode, decode, decompile, inspect."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from threading import Thread

import pytest

from motorcade import __version__
from motorcade.__main__ import main
from motorcade.cli.output import print_problem
from motorcade.config import profile
from motorcade.errors import MotorcadeError
from motorcade.words.formats import CONTROL, FORMATS
from support.command_line import INSTALLED, PARADE, Terminal, data, imported_by, refusal, run
from support.waiting import DEADLINE_S

COMMANDS = ("encode", "decode", "compile", "decompile", "inspect", "simulate", "ports", "upload", "readback")
HEAVY = (
    *("numpy", "numba", "matplotlib", "pyarrow", "dask", "blessed", "serial", "jsonschema_rs", "rich", "pydantic"),
    *("starlette", "uvicorn", "msgspec", "websockets", "anyio", "asyncio"),
)
PICO = PARADE.parents[1] / "firmware" / "micropython" / "rp2040.toml"
OTHER_ROOMS = ("motorcade.program", "motorcade.engine", "motorcade.upload", "motorcade.cli.console")


def under(modules, roots):
    return sorted(name for name in modules for root in roots if f"{name}.".startswith(f"{root}."))


def bytes_of(*words):
    return b"".join(word.to_bytes(4, "big") for word in words)


@pytest.fixture
def image(tmp_path):
    """Writes words, or bytes as they are, into a file."""

    def write(*content):
        path = tmp_path / "it.image"
        path.write_bytes(content[0] if isinstance(content[0], bytes) else bytes_of(*content))
        return path

    return write


# The command line as a whole


def test_the_installed_command_prints_its_version_and_imports_nothing_heavy():
    assert (
        subprocess.check_output([INSTALLED, "--version"], text=True, timeout=DEADLINE_S) == f"motorcade {__version__}\n"
    )
    modules = imported_by("--version")
    assert "motorcade.cli" in modules
    assert under(modules, (*HEAVY, *OTHER_ROOMS, "motorcade.words")) == []


def test_words_are_decoded_and_programs_compiled_with_few_modules():
    assert under(imported_by("decode", "control", "5", "--json"), (*HEAVY, *OTHER_ROOMS)) == []
    assert under(imported_by("compile", str(PARADE), "--json"), ("numpy", "numba", "matplotlib", "serial")) == []


def test_every_command_is_in_the_help_which_comes_without_arguments_too():
    ran, shown = run(), run("--help")
    assert (ran.code, ran.err, ran.out.strip()) == (0, "", shown.out.strip())
    assert [command for command in COMMANDS if f" {command} " not in shown.out] == []
    own = run("encode", "--help")
    assert [word_format.name for word_format in FORMATS if word_format.name not in own.out] == []
    assert (own.code, own.err, " encode [OPTIONS]" in own.out) == (0, "", True)


@pytest.mark.parametrize(
    ("typed", "says"),
    [
        ("fly", "there is no command 'fly'"),
        ("uplod", "there is no command 'uplod'; similar ones: 'upload', 'plot'"),
        ("studio --jsn", "there is no option --jsn here; similar ones: --json"),
        ("studio --json=1", "the option '--json' takes no value"),
        ("studio --port", "the option '--port' needs a value"),
        ("studio --port x", "'--port': 'x' is no whole number"),
        ("studio --port 99999", "'--port': 99999 is not allowed; allowed: 0 to 65535"),
        ("car run --board toaster", "'--board': 'toaster' is not allowed; choose one of 'simulated', 'raspberry-pi'"),
        ("drive", "a command is missing"),
        ("decode control", "'WORD...' is missing"),
        ("upload it", "'PROJECT|IMAGE': there is no file 'it'"),
        ("ports more", "this is too much: more"),
    ],
)
def test_missing_or_unknown_arguments_are_told_in_both_languages(typed, says, monkeypatch):
    monkeypatch.setenv("LC_ALL", "en_GB.UTF-8")
    ran = run(*typed.split())
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(f"motorcade: {says}; `motorcade ")
    monkeypatch.setenv("LC_ALL", "zh_CN.UTF-8")
    told = run(*typed.split()).err
    assert re.search("[\u4e00-\u9fff]", told.partition("`")[0])
    assert told != ran.err


def test_a_mat_in_place_of_a_program_is_one_mistake(tmp_path):
    file = tmp_path / "mat.json"
    file.write_text('{"format": "motorcade-mat/1", "name": "A mat", "size_m": [1, 1]}', encoding="utf-8")
    told = run("compile", file).err
    assert told.count("\n") == 1
    assert 'The value is "motorcade-mat/1"; allowed: "motorcade-program/1".' in told


def test_an_address_that_there_is_not_is_told_without_the_driver_s_own_words():
    told = refusal(3, "upload", PARADE, "--port", "socket://no.such.host.invalid:7001")
    assert told.startswith("No car answers at socket://no.such.host.invalid:7001: there is no such address. ")


def test_a_reader_that_has_enough_gets_no_complaint():
    reader, writer = os.pipe()
    os.close(reader)
    try:
        command = [INSTALLED, "decode", "control", "5"]
        ran = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, timeout=DEADLINE_S)
    finally:
        os.close(writer)
    assert (ran.returncode, ran.stderr) == (0, b"")


class InterruptedRead:
    """A finder of modules at which Ctrl-C arrives while the command line is imported."""

    def find_spec(self, name, path, target=None):
        if name == "motorcade.cli":
            raise KeyboardInterrupt


def test_ctrl_c_during_the_imports_ends_without_a_traceback(monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith("motorcade.cli")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "meta_path", [InterruptedRead(), *sys.meta_path])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 130
    assert capsys.readouterr().err == ""


# encode and decode


def test_encode_gives_the_word_in_three_ways_and_computes_check_and_parity():
    assert data("encode", "frame", "accept_ir=1", "led_which=1", "led_duration=1", "tag=5")["hex"] == "0x80280178"
    # Seed 001's worked example: angle 40, forward, speed 150.
    assert data("encode", "drive", "angle=40", "direction=1", "speed=0x96", "--json") == {
        "word": 311209984,
        "hex": "0x128CB000",
        "bits": "00010010100011001011000000000000",
    }


def test_decode_gives_raw_fields_and_warnings_of_each_word_in_order():
    led, idle_motor = data("decode", "control", "0x40280000", "0x01000000", "--json")
    assert set(led) == {"word", "fields", "warnings", "warning_codes"}
    assert (led["word"], led["warnings"], led["warning_codes"]) == (0x40280000, [], [])
    assert {name: raw for name, raw in led["fields"].items() if raw} == {
        "forward": 1,
        "led_which": 1,
        "led_duration": 1,
    }
    assert idle_motor["fields"]["motor_duration"] == 2
    assert idle_motor["warnings"] == ["motor_duration is 2, yet motor_enable is 0: it has no effect"]
    assert idle_motor["warning_codes"] == ["field-without-effect"]


@pytest.mark.parametrize("way", ["-5", "-- -5", "-0x5", "0xFFFFFFFB", "--json -5"])
def test_a_word_may_be_negative_or_hexadecimal(way):
    (decoded,) = data("decode", "control", *way.split())
    assert decoded["word"] == 0xFFFFFFFB
    assert decoded["fields"] == CONTROL.decode(0xFFFFFFFB)._asdict()


def test_on_a_terminal_words_are_shown_to_read_and_json_only_when_asked():
    table = run("decode", "header", "0x03030200", stdout=Terminal()).out
    assert "header word 50528768 = 0x03030200" in table
    assert "how many leader control words follow" in table
    assert "0x40280000" in run("encode", "control", "forward=1", "led_which=1", "led_duration=1", stdout=Terminal()).out
    table = run("decode", "frame", "0x80280177", stdout=Terminal()).out
    assert "warning bad-check: check is 27, but bits 31 to 6 give 28" in " ".join(table.split())
    asked = run("decode", "header", "0x03030200", "--json", stdout=Terminal()).out
    assert json.loads(asked)[0]["fields"]["dwell"] == 2


@pytest.mark.parametrize("arguments", [("formats",), ("compile", PARADE), ("simulate", PARADE, "--seconds", "1")])
def test_into_a_pipe_goes_text_without_frames_colours_or_broken_lines(arguments):
    shown, piped = run(*arguments, stdout=Terminal()).out, run(*arguments).out
    assert set(shown) & set("│┃━─┏")
    assert not set(piped) & set("│┃━─┏\x1b{")
    assert piped.splitlines() == [line.rstrip() for line in piped.splitlines()]
    cells = [line.split() for line in piped.splitlines()]
    assert any(len(line) > 3 for line in cells)


@pytest.mark.parametrize(
    "arguments",
    [("--json", "formats"), ("formats", "--json"), ("car", "--json", "wiring", PICO), ("--json", "missions")],
)
def test_json_is_obeyed_before_and_behind_the_name_of_a_command(arguments):
    ran = run(*arguments)
    assert (ran.code, isinstance(json.loads(ran.out), list)) == (0, True)


@pytest.mark.parametrize(
    "arguments", [("--json", "cars", "blink", "x"), ("cars", "--json", "blink", "x"), ("cars", "blink", "x", "--json")]
)
def test_a_command_that_prints_no_json_refuses_to(arguments):
    assert refusal(2, *arguments) == "`motorcade cars blink` prints no JSON: call it without --json"


@pytest.mark.parametrize(
    ("typed", "names", "allowed"),
    [
        ("decode motor 1", "'motor'", "header, control, state, flow, drive, lights, frame"),
        ("encode frame tag=32", "tag is 32", "0 to 31"),
        ("encode frame tag=5 check=28", "check is computed", "leave it out"),
        ("decode control 4294967296", "4294967296", "0 to 4294967295"),
        ("decode control five", "'five'", "a whole number, such as 42 or 0x2A"),
        ("decode drive 0x20000000", "code is 2", "1 (speed and direction)"),
        ("encode control motor_speed=fast", "motor_speed is 'fast'", "a whole number"),
        ("encode control sped=1", "'sped'", "motor_speed"),
        ("encode control voice", "'voice'", "NAME=VALUE"),
        ("encode control voice=1 voice=0", "voice", "twice"),
    ],
)
def test_a_word_that_cannot_be_gets_one_sentence(typed, names, allowed):
    sentence = refusal(2, *typed.split())
    assert names in sentence
    assert allowed in sentence


# decompile and inspect


def test_decompile_for_a_profile_of_ones_own_prints_a_project_that_compiles(image, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(Path(profile.__file__).parents[1] / "profiles" / "classroom.toml", "mine.toml")
    project = data("decompile", image(0x01000000, 0x64800000), "--profile", "mine.toml")
    Path("again.motorcade.json").write_text(json.dumps(project), encoding="utf-8")
    assert data("compile", "again.motorcade.json")["words"] == [0x01000000, 0x64800000]


def test_inspect_shows_a_table_and_fields_as_json(image):
    path = image(0x01010200, 0x64800000, 0xC0280000)
    table = run("inspect", path)
    assert (table.code, table.err) == (0, "")
    assert "forward 200 mm/s 1 s" in table.out
    assert "LED 1 1 s; passed on" in table.out
    # What a leader does with infrared is no part of its words' meaning.
    assert "deaf" not in table.out
    header, leader, follower = data("inspect", path, "--json")
    assert [each["role"] for each in (header, leader, follower)] == ["header", "leader", "follower"]
    assert header["word"] == 0x01010200
    assert header["fields"] == {"leader_states": 1, "follower_words": 1, "dwell": 2, "reserved": 0}
    assert (leader["fields"]["motor_speed"], leader["fields"]["motor_duration"]) == (2, 1)
    assert (follower["fields"]["accept_ir"], follower["fields"]["led_which"]) == (1, 1)


@pytest.mark.parametrize("typed", ["decompile", "inspect", "simulate", "upload --port no-such-port"])
def test_a_bad_image_gets_one_sentence_and_exit_code_2(image, typed):
    assert "2 bytes are no whole number of 4-byte words" in refusal(2, *typed.split(), image(b"\x01\x00"))
    says = "word 1 (0x40000002) is not valid: reserved is 1"
    assert says in refusal(2, *typed.split(), image(0x01000000, 0x40000002))


def test_an_image_that_looks_like_the_start_of_json_is_still_an_image(image):
    # 123 states and 34 follower words: the header's first two bytes are '{"'.
    ran = run("simulate", image(0x7B220100, *[0x40280000] * 123, *[0xC0280000] * 34), "--seconds", "0", "--json")
    assert (ran.code, ran.err.strip()) == (0, "")


@pytest.mark.parametrize("name", ["zh_CN.UTF-8", "zh", "Chinese (Simplified)_China.936"])
def test_tables_are_in_the_language_of_the_system_unless_another_is_named(monkeypatch, name):
    command = ("decode", "drive", "0x128CB000")
    monkeypatch.setenv("LC_ALL", name)
    shown = run(*command, stdout=Terminal()).out
    assert "drive 码字 311209984" in shown
    assert "舵机角度" in shown
    # Each command takes the option, and those above it do, too.
    for asked in ((*command, "--language", "en"), ("--language", "en", *command)):
        assert "drive word 311209984" in run(*asked, stdout=Terminal()).out
    assert "fr" in refusal(2, *command, "--language", "fr")


def test_other_threads_print_in_the_language_that_was_asked_for(monkeypatch, capsys):
    monkeypatch.setenv("LC_ALL", "en_US.UTF-8")
    asked = run("decode", "drive", "0x128CB000", "--language", "zh")
    server = Thread(target=print_problem, args=[MotorcadeError("no-report")])
    server.start()
    server.join()
    assert "检查时间太长" in capsys.readouterr().err
    # The next command isn't asked for it.
    assert "drive word" in run("decode", "drive", "0x128CB000", stdout=Terminal()).out
    assert asked.code == 0


@pytest.mark.parametrize("word", ["0x" + "9" * 9000, "9" * 9000, "0x" + "9" * 70], ids=len)
def test_a_word_with_thousands_of_digits_gives_a_short_sentence(word):
    assert len(refusal(2, "decode", "control", word)) < 200
