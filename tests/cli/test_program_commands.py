"""The command about programs, compile, with good projects and bad ones; and bad projects wherever they are taken."""

import json
import locale
import os
import subprocess

import pytest

from support.command_line import INSTALLED, PARADE, Terminal, data, refusal, run
from support.waiting import DEADLINE_S

DRIVE = {"drive": {"direction": "forward", "speed": 1, "seconds": 1}}
LIT = {"led": {"which": 1, "seconds": 1}}
HALF = {"wait": {"seconds": 0.5}}


def only_line(text):
    (line,) = text.strip().splitlines()
    return line


def document(*leader, **more):
    return {"format": "motorcade-program/1", "leader": list(leader), **more}


@pytest.fixture
def project(tmp_path):
    """Writes a document, or text as it is, into a project file."""

    def write(content):
        path = tmp_path / "it.motorcade.json"
        path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
        return path

    return write


def test_compile_prints_the_words_and_writes_their_bytes(tmp_path):
    output = tmp_path / "parade.image"
    ran = run("compile", PARADE, "-o", output, "--json")
    assert (ran.code, ran.err) == (0, "")
    printed = json.loads(ran.out)
    assert set(printed) == {"words", "leader_states", "follower_words", "dwell_ms", "tagged", "diagnostics"}
    assert (printed["leader_states"], printed["follower_words"], printed["dwell_ms"]) == (3, 3, 2000)
    assert printed["tagged"] is False
    assert printed["words"][0] == 0x03030200
    assert printed["diagnostics"] == []
    assert output.read_bytes() == b"".join(word.to_bytes(4, "big") for word in printed["words"])


def test_compile_says_that_words_are_tagged(project):
    steps = [{"led": {"which": which, "seconds": 3}} for which in (0, 1)]
    followers = {"forward": True, "steps": steps}
    path = project({"format": "motorcade-program/1", "leader": [steps[0]], "followers": followers})
    printed = json.loads(run("compile", path, "--json").out)
    assert (printed["tagged"], printed["words"][0] & 0xFF, printed["diagnostics"]) == (True, 1, [])
    assert "2 for followers, 3 s each, tagged" in run("compile", path, stdout=Terminal()).out


def test_an_error_has_code_severity_message_path_and_id(project):
    ran = run("compile", project(document(DRIVE, {**HALF, "id": "block-7"})), "--json")
    assert ran.code == 1
    printed = json.loads(ran.out)
    assert printed["words"] == []
    (diagnostic,) = printed["diagnostics"]
    message = diagnostic.pop("message")
    place = {"code": "duration-not-expressible", "severity": "error", "path": "leader[1]", "id": "block-7"}
    assert diagnostic == place
    assert only_line(ran.err) == f"leader[1]: error duration-not-expressible: {message}"


def test_a_warning_stops_nothing(project, tmp_path):
    output = tmp_path / "empty.image"
    ran = run("compile", project(document()), "-o", output, "--json")
    assert ran.code == 0
    (diagnostic,) = json.loads(ran.out)["diagnostics"]
    assert (diagnostic["code"], diagnostic["severity"]) == ("empty-program", "warning")
    assert "warning empty-program" in only_line(ran.err)
    assert output.read_bytes() == bytes(4)


def test_a_project_that_windows_notepad_saved_compiles(project):
    assert run("compile", project("\ufeff" + json.dumps(document(DRIVE)).replace("{", "{\r\n"))).code == 0


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be"])
def test_what_powershell_writes_is_read(tmp_path, encoding):
    """Its '>' writes UTF-16 with a byte-order mark."""
    texts = {
        "a.motorcade.json": json.dumps(document(DRIVE)),
        "a.py": "from motorcade import Program, forward\nprogram = Program([forward(1)])\n",
        "mat.toml": 'format = "motorcade-mat/1"\nname = "M"\n[[car]]\nat_m = [0, 0]\nrole = "leader"\n',
    }
    mark = b"\xfe\xff" if encoding == "utf-16-be" else b""
    for name, text in texts.items():
        (tmp_path / name).write_bytes(mark + text.encode(encoding))
    for name in ("a.motorcade.json", "a.py"):
        assert data("compile", tmp_path / name)["leader_states"] == 1
        assert data("simulate", tmp_path / name, "--mat", tmp_path / "mat.toml", "--seconds", "0.1")["cars"]


def test_decompile_writes_its_project_into_a_file(tmp_path):
    image, project, text = (tmp_path / name for name in ("a.image", "a.motorcade.json", "a.py"))
    run("compile", PARADE, "-o", image)
    for options in ((project,), (text, "--python")):
        assert run("decompile", image, "-o", *options).code == 0
        assert data("compile", options[0])["words"] == data("compile", PARADE)["words"]
    assert "is what is being read" in refusal(2, "decompile", image, "-o", image)


def test_diagnostics_speak_chinese_when_asked_or_when_the_system_does(project, monkeypatch):
    path = project(document({**DRIVE, "accept_ir": True}))
    asked = run("compile", path, "--language", "zh", "--json")
    assert asked.code == 1
    # The sentence is seed 000's, c1 2.1.1.
    assert "无法设置头车接受红外信息" in json.loads(asked.out)["diagnostics"][0]["message"]
    assert "错误 leader-accepts-ir: 无法设置头车接受红外信息" in only_line(asked.err)
    monkeypatch.setenv("LC_ALL", "zh_CN.UTF-8")
    assert run("compile", path, "--json") == asked
    for name in ("LC_ALL", "LC_MESSAGES", "LANG"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(locale, "getlocale", lambda *category: ("zh_CN", "UTF-8"))
    assert run("compile", path, "--json") == asked
    assert "错误 leader-accepts-ir" in only_line(run("simulate", path).err)
    assert "A leader can't" in only_line(run("compile", path, "--language", "en").err)


def test_json_comes_whatever_the_output_can_encode(project):
    path = project(document({**DRIVE, "accept_ir": True, "id": "方块"}))
    narrow = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    command = [INSTALLED, "compile", str(path), "--language", "zh", "--json"]
    ran = subprocess.run(command, env=narrow, capture_output=True, timeout=DEADLINE_S, check=False)
    assert ran.returncode == 1
    assert b"Traceback" not in ran.stderr
    assert json.loads(ran.stdout)["diagnostics"][0]["id"] == "方块"


# Bad input, one by one

# tests/program has every diagnostic.
BAD = {
    "no JSON": ("leader: forward 3", "not-json", ""),
    "an unknown key": (document(DRIVE, leeder=[]), "unknown-field", "leeder"),
    "256 states": (document({"repeat": {"times": 256, "steps": [DRIVE]}}), "too-many-states", "leader[0]"),
    "half a second": (document(HALF), "duration-not-expressible", "leader[0]"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_project_gets_one_diagnostic_and_exit_code_1_and_leaves_the_old_image(project, tmp_path, name):
    content, code, path = BAD[name]
    output = tmp_path / "old.image"
    output.write_bytes(b"kept")
    ran = run("compile", project(content), "-o", output, "--json")
    assert (ran.code, output.read_bytes()) == (1, b"kept")
    (diagnostic,) = json.loads(ran.out)["diagnostics"]
    assert (diagnostic["code"], diagnostic["severity"], diagnostic["path"]) == (code, "error", path)
    assert only_line(ran.err).endswith(diagnostic["message"])


def test_every_mistake_of_a_step_has_a_line_of_its_own(project):
    ran = run("compile", project(document({"drive": {"direction": "up", "speed": 9, "seconds": -1}})))
    places = [line.partition(": ")[0] for line in ran.err.splitlines()]
    assert sorted(places) == [f"leader[0].drive.{name}" for name in ("direction", "seconds", "speed")]


@pytest.mark.parametrize("typed", ["simulate", "upload --port no-such-port"])
def test_a_bad_project_neither_drives_nor_reaches_a_port(project, typed):
    content, code, _ = BAD["256 states"]
    ran = run(*typed.split(), project(content))
    assert (ran.code, ran.out) == (1, "")
    assert f"error {code}: " in only_line(ran.err)


@pytest.mark.parametrize("name", ["racer", "../classroom", "a" * 4000, "broken.toml", "\0.toml"])
def test_a_profile_that_is_not_there_or_not_one_gets_one_sentence(project, tmp_path, name):
    (tmp_path / "broken.toml").write_text("durations_ms = [", encoding="utf-8")
    ran = run("compile", project(document(DRIVE, profile=name)))
    assert ran.code == 1
    assert "profile" in only_line(ran.err)


def test_a_profile_that_was_asked_for_and_is_not_there_gets_one_sentence(tmp_path):
    (tmp_path / "it.image").write_bytes(bytes(4))
    for command in ("decompile", "inspect", "simulate"):
        said = refusal(2, command, tmp_path / "it.image", "--profile", "racer")
        assert said.startswith("there is no profile 'racer'; built in: classroom, e-puck, ")


@pytest.mark.parametrize("typed", ["compile", "decompile", "inspect", "simulate", "upload --port no-such-port"])
def test_a_file_that_is_not_there_and_a_directory_are_usage_errors(typed, tmp_path):
    for path, says in ((tmp_path / "nothing.json", "there is no file"), (tmp_path, "is a folder")):
        assert says in refusal(2, *typed.split(), path)


def test_a_text_is_no_program_and_python_text_is_one_for_every_command(tmp_path):
    letter, script = tmp_path / "square.txt", tmp_path / "square.py"
    for file in (letter, script):
        file.write_text("from motorcade import Program")
    for command in ("simulate", "upload --port no-such-port"):
        assert "square.txt is no program: " in refusal(2, *command.split(), letter)
    for command in ("simulate", "upload --port no-such-port", "compile"):
        ran = run(*command.split(), script)
        assert ran.code == 1
        assert "line 1, column 1: error python-no-leader" in only_line(ran.err)


@pytest.mark.parametrize("name", ["missing/it.image", "."])
def test_an_output_that_cannot_be_written_is_a_usage_error(tmp_path, name):
    assert "can't be written" in refusal(2, "compile", PARADE, "-o", tmp_path / name)
