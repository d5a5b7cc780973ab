"""Check many files against a mission: a table as CSV, and a web page with a small picture of each run."""

import base64
import csv
import io
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

from motorcade.config.files import read_bytes
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.missions.check import STEPS, GoalResult, Look, Result, Sight, check_image, check_program
from motorcade.missions.model import Mission
from motorcade.missions.watch import goal_phrase
from motorcade.program.diagnostics import ProgramError
from motorcade.program.files import is_project, read_project
from motorcade.words.packing import ImageError

_IMAGES = (".image", ".bin")
REPORTS = ("-report.html", "-report.csv")
_LEADER, _FOLLOWER = "#d62728", "#1f77b4"
_WIDTH_PX = 220
_HEIGHT_PX = 150
# Control characters and what ends a line; what a formula begins with, also as the wide letters of Chinese and Japanese
# keyboards, at the beginning of a text or behind what separates cells.
_CONTROLS = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029]+")
_FORMULA = re.compile(r"""((?:^|[;,|:])[\s"']*)([=+\-@＝＋－＠])""")
# Around what is shown of a mat without a size.
_MARGIN_M = 0.2
# With more, tracks can't be told apart, and the page of a class has megabytes.
_MOST_CARS = 60
_MOST_POINTS = 100
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:75rem;margin:2rem auto;padding:0 1rem}"
    "table{border-collapse:collapse;width:100%}th,td{border:1px solid #999;padding:.4rem .6rem;text-align:left;"
    "vertical-align:top}th{overflow-wrap:anywhere;min-width:5rem}svg{display:block}"
    "ul{margin:0;padding-inline-start:1.2em}.refused td{background:#fff1d6;color:#5c3a00}"
    "@media print{tr{break-inside:avoid}}"
)


class Checked(NamedTuple):
    """A file that was checked.

    Attributes:
        name: of the file, below the folder.
        found: what its program earned; an error says why it holds none that can be checked.
        picture: an SVG of the run with the mission's first seed: where each car drove, and where it stands at the end.
    """

    name: str
    found: Result | MotorcadeError
    picture: str = ""

    @property
    def passes(self) -> bool:
        """Whether its program earned a star."""
        return isinstance(self.found, Result) and bool(self.found.stars)


def check_file(mission: Mission, path: Path, look: Look | None = None) -> Result:
    """Check the project, the Python text or the image in a file; ``look`` is shown each moment of its runs.

    Raises MotorcadeError or OSError where it holds no program that can be checked.
    """
    data = read_bytes(path)
    if not is_project(data, path):
        return check_image(mission, data, look)
    program, python = read_project(data, path)
    try:
        return check_program(mission, program, look=look)
    except ProgramError as problem:
        diagnostics = problem.diagnostics
        if python:
            diagnostics = python.located(diagnostics)
        raise ProgramError(diagnostics) from None


def files_of(folder: Path) -> list[Path]:
    """Return the files of a folder and of those in it, by name; without hidden ones and reports. Raises OSError."""
    found = (path for path in folder.rglob("*") if not path.is_dir() and not path.name.endswith(REPORTS))
    return sorted(path for path in found if not any(part.startswith(".") for part in path.relative_to(folder).parts))


def checked_file(mission: Mission, folder: Path, path: Path) -> Checked:
    """Check a file of a folder; one that can't be checked has a problem."""
    # A name need not be UTF-8, on Linux at least: what isn't becomes the sign for it.
    name = _CONTROLS.sub(" ", os.fsencode(path.relative_to(folder).as_posix()).decode(errors="replace"))
    points = list[list[tuple[float, float]]]()

    def note(sight: Sight) -> None:
        """Note where all cars are in the run with the first seed."""
        if sight.seed == mission.seeds[0]:
            points.append(list(zip(sight.moment.x_m, sight.moment.y_m, strict=True)))

    try:
        result = check_file(mission, path, note)
    except ImageError as problem:
        # To who put a photo into the folder its number of bytes says nothing.
        if path.suffix not in _IMAGES:
            return Checked(name, InputError("no-program-in-file"))
        return Checked(name, problem)
    except MotorcadeError as problem:
        return Checked(name, problem)
    except OSError as problem:
        return Checked(name, MotorcadeError("cant-read", reason=problem))
    return Checked(name, result, _picture(mission, points))


def _picture(mission: Mission, points: Sequence[Sequence[tuple[float, float]]]) -> str:
    """Return an SVG of a run; ``points`` are the places of all cars at each moment."""
    mat = mission.mat
    shown = points[:: -(-len(points) // _MOST_POINTS)]
    boxes = [(x, y, x, y) for moment in shown for x, y in moment] + [zone.box() for zone in mission.zones]
    left = min(box[0] for box in boxes) - _MARGIN_M
    bottom = min(box[1] for box in boxes) - _MARGIN_M
    right = max(box[2] for box in boxes) + _MARGIN_M
    top = max(box[3] for box in boxes) + _MARGIN_M
    if mat.size_m:
        left = 0.0
        bottom = 0.0
        (right, top) = mat.size_m
    scale = max((right - left) / _WIDTH_PX, (top - bottom) / _HEIGHT_PX)
    radius_m = max(mission.profile.body.diameter_mm / 2000, 3 * scale)

    def outline(corners: Iterable[tuple[float, float]], style: str) -> str:
        return f'<path d="M{"L".join(f"{x:.2f} {y:.2f}" for x, y in corners)}" {style}/>'

    def disc(x: float, y: float, radius: float, style: str) -> str:
        return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{radius:.3f}" {style}/>'

    thing = 'fill="#666"'
    zone_style = f'fill="none" stroke="#0a7" stroke-dasharray="{4 * scale:.3f}"'
    parts = [outline(((x0, y0), (x1, y1)), 'stroke="#333"') for x0, y0, x1, y1 in mat.walls]
    parts += [outline(corners, thing) for corners in mat.polygons]
    parts += [disc(*place, thing) for place in mat.discs]
    for zone in mission.zones:
        if zone.corners:
            parts.append(outline((*zone.corners, zone.corners[0]), zone_style))
        else:
            parts.append(disc(*zone.disc, zone_style))
    for car, leads in enumerate(mat.starts.leads[:_MOST_CARS]):
        colour = _FOLLOWER
        if leads:
            colour = _LEADER
        parts.append(outline((moment[car] for moment in shown), f'fill="none" stroke="{colour}" opacity=".5"'))
        parts.append(disc(*points[-1][car], radius_m, f'fill="{colour}"'))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{(right - left) / scale:.0f}" role="img" '
        f'viewBox="{left:.2f} {-top:.2f} {right - left:.2f} {top - bottom:.2f}">'
        f'<g transform="scale(1 -1)" stroke-width="{scale:.4f}">'
        f'<path d="M{left:.2f} {bottom:.2f}H{right:.2f}V{top:.2f}H{left:.2f}Z" fill="#f6f1e7" stroke="#999"/>'
        f"{''.join(parts)}</g></svg>"
    )


def asked_goals(mission: Mission, result: Result, language: str) -> Iterator[tuple[str, GoalResult]]:
    """Yield each goal in words, and what came of it."""
    goals = iter(enumerate(mission.goals, start=1))
    for found in result.goals:
        if found.kind == STEPS:
            yield Phrase("goal-steps").sentence(language), found
        else:
            number, goal = next(goals)
            yield f"{number}. {goal_phrase(goal, mission).sentence(language)}", found


def to_csv(checked: Iterable[Checked], mission: Mission, language: str) -> str:
    """Return the table as CSV, a row for each file, which spreadsheets recognize as UTF-8."""
    text = io.StringIO()
    writer = csv.writer(text)
    words = [Phrase(f"report-{name}").sentence(language) for name in ("file", "stars", "grade", "lost", "problem")]
    writer.writerow(words)
    for entry in checked:
        found = entry.found
        if isinstance(found, MotorcadeError):
            row = ["", "", "", found.sentence(language)]
        else:
            goals = asked_goals(mission, found, language)
            lost = [f"{asked} – {goal.why.sentence(language)}" for asked, goal in goals if not goal.met]
            row = [str(len(found.stars)), f"{found.grade:.2f}", " · ".join(lost), ""]
        writer.writerow([_cell(value) for value in (entry.name, *row)])
    return "\ufeff" + text.getvalue()


def _cell(text: str) -> str:
    """Return a text as one cell that no spreadsheet computes, whatever it takes to separate cells.

    Others choose the names of files. A spreadsheet of a country that writes numbers with a comma separates cells at
    semicolons, and takes quotation marks for text; others ask, and tabs separate. So each part that could become a
    cell has an apostrophe where it would begin as a formula.
    """
    return _FORMULA.sub(r"\1'\2", _CONTROLS.sub(" ", text))


def to_html(checked: Sequence[Checked], mission: Mission, language: str) -> str:
    """Return the web page, which holds all that it shows, and the table to be downloaded."""

    def say(text: str, **details: object) -> str:
        return escape(Phrase(f"report-{text}", **details).sentence(language))

    rows = []
    for entry in checked:
        file = f"<th scope=row>{escape(entry.name)}</th>"
        found = entry.found
        if isinstance(found, MotorcadeError):
            problem = escape(found.sentence(language))
            rows.append(f"<tr class=refused><td></td>{file}<td>–</td><td>{problem}</td></tr>")
            continue
        goals = ""
        for asked, goal in asked_goals(mission, found, language):
            if goal.met:
                goals += f"<li>✓ {escape(asked)}</li>"
            else:
                goals += f"<li>✗ {escape(asked)} <b>{escape(goal.why.sentence(language))}</b></li>"
        stars = "★" * len(found.stars) or "–"
        picture = entry.picture.replace("<svg ", f'<svg aria-label="{say("picture", file=entry.name)}" ', 1)
        rows.append(f"<tr><td>{picture}</td>{file}<td>{stars}</td><td><ul>{goals}</ul></td></tr>")
    heads = "".join(f"<th scope=col>{say(name)}</th>" for name in ("run", "file", "stars", "goals"))
    title = say("title", name=mission.name)
    passed = sum(entry.passes for entry in checked)
    table = base64.b64encode(to_csv(checked, mission, language).encode(errors="replace")).decode()
    return (
        f'<!doctype html><html lang="{escape(language)}"><meta charset=utf-8>'
        f"<meta name=viewport content=width=device-width><title>{title}</title><style>{_STYLE}</style><h1>{title}</h1>"
        f"<p>{say('summary', count=len(checked), passed=passed)} "
        f'<a download="{escape(mission.id)}.csv" href="data:text/csv;base64,{table}">{say("table")}</a></p>'
        f"<table><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table></html>\n"
    )
