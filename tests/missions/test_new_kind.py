"""A made-up kind of goal, declared in a copy of the sources as CONTRIBUTING.md says, is judged, tried and graded."""

import ast
import json
import re

import pytest

from motorcade.missions.schema import GOALS
from support.source_copy import ROOT, SourceCopy

SOURCE = ROOT / "src" / "motorcade"
KIND = '''

class FacesLeft(CarsGoal):
    """Cars face along the y axis."""

    name = "faces-left"
    fields: ClassVar = {**CARS, "at": at("end"), **WINDOW}
    is_reached = True
    half = 90.0

    @classmethod
    def question(cls, goal: Goal, mission: Mission) -> Question:
        return Question(judging.FACES, AT[goal.values["at"]], (90.0, 20.0), window_ms=_window_ms(goal))

    def lost(self, off: float) -> tuple[str, dict[str, Any]]:
        return f"goal-{self.name}-lost", {"degrees": off}
'''
PHRASES = {
    "goal-faces-left-end": "Face left",
    "goal-faces-left-some-moment": "Face left once",
    "goal-faces-left-always": "Always face left",
    "goal-faces-left-lost": "{car} is {degrees:.0f} off{tally}",
    "goal-faces-left-lost-tally": "; {done} of {count} are not",
}
PROBE = """
import json
from scripts.goal_kinds import goal_kinds

from motorcade import Program, compile_program, forward, left
from motorcade.lab.grading import grade_runs
from motorcade.missions.check import check_program, open_worlds_here
from motorcade.missions.document import mission_of
from motorcade.missions.odds import Odds
from motorcade.missions.schema import mission_schema
from motorcade.missions.watch import goal_phrase

goals = [
    {"kind": "faces-left", "at": "some-moment"},
    {"kind": "all-by", "goal": 1, "seconds": 5, "star": 2},
    {"kind": "works", "seeds": 10, "star": 3},
]
mat = {"car": [{"at_m": [0, 0], "role": "leader"}]}
mission = mission_of({"format": "motorcade-mission/1", "name": "m", "seconds": 5, "mat": mat, "goal": goals}, "m")
told = {"asks": goal_phrase(mission.goals[0], mission).sentence(), "runs": []}
for step in (left(3), forward(3)):
    program = Program([step])
    image = compile_program(program, mission.profile).image
    result = check_program(mission, program)
    odds = Odds(mission, image, [7], open_worlds_here)
    trials = []
    while not odds.is_over:
        trials += odds.advance()
    first = result.goals[0]
    told["runs"].append(
        {
            "stars": sorted(result.stars),
            "why": first.why.sentence(),
            "met": trials[0].met,
            "grades": [first.grade, result.grade, grade_runs(mission, [image], [0], [0])[0].grade],
        }
    )
told["kinds"] = '"faces-left": [' in goal_kinds()
told["schema"] = "faces-left" in json.dumps(mission_schema())
print(json.dumps(told))
"""


@pytest.fixture
def copy(tmp_path):
    """A copy of the sources with the kind, and its texts in each language."""
    copy = SourceCopy(tmp_path)
    with (copy.package / "missions" / "car_goals.py").open("a", encoding="utf-8") as file:
        file.write(KIND)
    for path in (copy.package / "locales").glob("*.json"):
        texts = json.loads(path.read_text(encoding="utf-8"))
        texts["phrases"] |= PHRASES
        texts["page"]["missions"]["kinds"]["faces-left"] = "face left"
        path.write_text(json.dumps(texts), encoding="utf-8")
    return copy


def test_a_declared_kind_is_judged_tried_and_graded(copy):
    ran = copy.run("-c", PROBE)
    assert ran.returncode == 0, ran.stderr
    told = json.loads(ran.stdout)
    assert (told["asks"], told["kinds"], told["schema"]) == ("Face left once", True, True)
    turns, drives = told["runs"]
    assert (turns["stars"], turns["met"]) == ([1, 2, 3], [True, True, True])
    assert (drives["stars"], drives["met"], drives["why"]) == ([], [False, False, True], "the car is 90 off")
    assert turns["grades"] == [1, 1, 1]
    # Half of what counts half, and the other stars are worth what the first is.
    one, of_check, of_search = drives["grades"]
    assert one == 0.5
    assert of_check == of_search == pytest.approx(0.5 * (1 + 0.25) / 2)


def names_in(file):
    """The strings of a file that aren't docstrings."""
    return {
        node.value for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))) if isinstance(node, ast.Constant)
    }


def test_a_kind_is_named_where_it_is_declared_and_nowhere_else():
    """Names that are no words of everyday, so that they mean a kind wherever they stand."""
    names = {name for name in GOALS if "-" in name or name in ("travelled", "gathered", "networked")}
    declared = {f"{kind.__module__.replace('.', '/')}.py" for kind in GOALS.values()}
    # What the mat of a class asks for is a mission's document.
    allowed = {*declared, "motorcade/classroom/shared_mat.py"}
    found = {file.relative_to(SOURCE.parent).as_posix(): names & names_in(file) for file in SOURCE.rglob("*.py")}
    assert {file: named for file, named in found.items() if named and file not in allowed} == {}


def test_the_list_of_files_is_short_and_they_exist():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = text.partition("## How to add a kind of goal")[2].partition("\n## ")[0].split("\n")
    files = re.findall(r"`([\w./*]+)`", "".join(row.split("|")[1] for row in rows if row.startswith("| `")))
    assert len(files) <= 6
    for file in files:
        assert list(ROOT.glob(file)) or list(SOURCE.glob(file)), file
