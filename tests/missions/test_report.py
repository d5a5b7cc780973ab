"""The report of a folder: whatever files are called, it is whole, and no spreadsheet computes a name."""

import csv
import os
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.errors import MotorcadeError
from motorcade.missions.document import built_in_mission
from motorcade.missions.report import Checked, checked_file, files_of, to_csv, to_html
from support.command_line import run

MISSION = built_in_mission("forward-and-stop")
FORMULAS = ("=", "+", "-", "@", "＝", "＋", "－", "＠")
NAMES = [
    "x;=WEBSERVICE(A1);y",
    "=1+1",
    "\t=1",
    "a\t+1",
    "a\n=1",
    "a\r@SUM(A1)",
    'a";"=1',
    "a; '=1",
    'a,"-1',
    "；＝1",
    "＝1",
    "\u2028=1",
    "\x85=1",
    "a|=1",
]


def cells(text, separator):
    """The cells that a spreadsheet makes of a table: as a strict reader, and as one that divides at each sign."""
    for line in text.removeprefix("\ufeff").splitlines():
        yield from line.split(separator)
        for row in csv.reader([line], delimiter=separator):
            yield from row
    for row in csv.reader(text.removeprefix("\ufeff").splitlines(keepends=True), delimiter=separator):
        yield from row


def assert_computes_nothing(name):
    checked = [Checked(name, MotorcadeError("file-syntax", file=name, kind="JSON", reason=name))]
    table = to_csv(checked, MISSION, "en")
    assert len(table.splitlines()) == 2
    for separator in (",", ";", "\t", "|"):
        for cell in cells(table, separator):
            assert not cell.strip(" \"'").startswith(FORMULAS) or cell.strip(' "').startswith("'"), cell


@pytest.mark.parametrize("name", NAMES)
def test_no_spreadsheet_computes_the_name_of_a_file(name):
    assert_computes_nothing(name)


@given(st.text(st.sampled_from("=+-@;,|\t\n\r\"' aＡ＝\u2028\x0b")))
def test_no_spreadsheet_computes_any_name(name):
    assert_computes_nothing(name)


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="these systems have no such names")
def test_one_name_that_is_no_text_ends_no_report(tmp_path):
    (tmp_path / "away.py").symlink_to(tmp_path / "nowhere.py")
    for name in (b"Mia.json", b"Be\xffn.json", b"\xfe\xff.py", b"a\nb.py"):
        with open(os.path.join(os.fsencode(tmp_path), name), "wb") as file:  # noqa: PTH118, PTH123
            file.write(MISSION.solution.as_json().encode())
    checked = [checked_file(MISSION, tmp_path, path) for path in files_of(tmp_path)]
    assert {each.name for each in checked} == {"Mia.json", "Be\ufffdn.json", "\ufffd\ufffd.py", "a b.py", "away.py"}
    for write in (to_csv, to_html):
        assert "Be\ufffdn.json" in write(checked, MISSION, "zh").encode().decode()
    asked = run("check", "forward-and-stop", str(tmp_path))
    assert "Be\ufffdn.json" in asked.out
    assert (tmp_path / "forward-and-stop-report.csv").read_text(encoding="utf-8-sig").count("\n") == 6
