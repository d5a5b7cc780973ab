"""Files of programs: which is a project and which an image, and what a project names beside it."""

from pathlib import Path

import pytest

from motorcade.config.files import read_bytes
from motorcade.errors import MotorcadeError
from motorcade.program.diagnostics import ProgramError
from motorcade.program.files import compile_project, is_project
from motorcade.program.model import Program
from motorcade.program.python_writer import python_text
from motorcade.program.steps import wait
from support.command_line import PARADE

CLASSROOM = Path(__file__).parents[2] / "src" / "motorcade" / "profiles" / "classroom.toml"
# Its header counts 123 states and 34 words: the first bytes are {".
LIKE_JSON = bytes([0x7B, 0x22, 1, 0]) + bytes(157 * 4)


@pytest.mark.parametrize(
    ("name", "data", "expected"),
    [
        ("a.motorcade.json", b"", True),
        ("a.py", bytes(4), True),
        ("a.txt", b"\xef\xbb\xbf \n{", True),
        ("a.image", LIKE_JSON, False),
        ("a.image", LIKE_JSON[:-1], True),
        ("a.image", b"", False),
    ],
)
def test_a_file_is_a_project_by_its_ending_or_its_first_character(name: str, data: bytes, expected: bool) -> None:
    assert is_project(data, Path(name)) is expected


def test_a_file_larger_than_any_program_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "huge.image"
    with path.open("wb") as file:
        file.truncate(1 << 24)
        assert len(read_bytes(path)) == 1 << 24
        file.truncate((1 << 24) + 1)
    with pytest.raises(MotorcadeError, match=r"huge.image .*16 MiB"):
        read_bytes(path)


def test_a_program_finds_the_profile_beside_its_file_whatever_the_current_folder(tmp_path: Path) -> None:
    text = CLASSROOM.read_text(encoding="utf-8").replace("[0, 1000, 2000, 3000]", "[0, 500, 1000, 1500]")
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    program = Program([wait(0.5)], profile="mine.toml")
    for name, data in (("a.json", program.as_json()), ("a.py", python_text(program))):
        compiled, profile = compile_project(data.encode(), tmp_path / name)
        assert (compiled.leader_states, profile.durations_ms[1]) == (1, 500)
    _, built_in = compile_project(PARADE.read_bytes(), tmp_path / PARADE.name)
    assert built_in.name == "classroom"


def test_a_profile_that_is_not_there_is_an_error_at_its_line_of_a_text(tmp_path: Path) -> None:
    text = python_text(Program([wait(1)], profile="mine.toml"))
    with pytest.raises(ProgramError) as caught:
        compile_project(text.encode(), tmp_path / "program.py")
    (problem,) = caught.value.diagnostics
    assert problem.span
    assert "mine.toml" in text.splitlines()[problem.span.line - 1]


def test_a_project_that_can_not_be_saved_whole_keeps_the_file_before(tmp_path: Path) -> None:
    path = tmp_path / "mine.motorcade.json"
    Program([wait(1)]).save(path)
    before = path.read_bytes()
    with pytest.raises(UnicodeEncodeError):
        Program([wait(1)], beside={"name": "\ud800"}).save(path)
    assert path.read_bytes() == before
