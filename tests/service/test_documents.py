"""What a user is told about a file that is no project."""

import pytest

from motorcade.errors import MotorcadeError
from motorcade.service.documents import open_file


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "not-a-project"),
        ("\x89PNG\r\n\x1a\n\ufffd", "not-a-project"),
        ("import os\n", "not-a-project"),
        ("[" * 100_000, "not-a-project"),
        ("42", "not-a-project"),
        ('{"a": 1}', "not-a-project"),
        ('{"format": ["motorcade-program/1"]}', "not-a-project"),
        ('{"format": "motorcade-program/1", "leader": [', "project-not-whole"),
        ('{"format": "motorcade-program/2", "boats": []}', "newer-project"),
        ('{"format": "motorcade-mat/1"}', "mat-not-project"),
        ('{"format": "motorcade-mission/1"}', "mission-not-project"),
        ('{"format": "motorcade-projects/1"}', "projects-not-project"),
        ('{"format": "motorcade-program/1"}', "program-errors"),
    ],
)
def test_a_file_that_is_no_project_is_told_what_it_is(text: str, code: str) -> None:
    with pytest.raises(MotorcadeError) as refused:
        open_file(text)
    assert refused.value.code == code
