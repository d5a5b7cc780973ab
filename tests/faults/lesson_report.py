"""The work of all pupils of a simulated lesson: as one file, and as a report of a mission."""

import asyncio
import base64
import io
import json
import re
import zipfile
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from tests.faults import lesson_work
from tests.faults.browsers import DONE
from tests.faults.pupils import PASSWORD

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson

_MARK = re.compile("# mark-[0-9]+-")


async def collect(run: "Lesson") -> None:
    """The teacher collects all work: what is there, and nothing of those who are out."""
    outcome, data = await run.teacher.fetch("GET", "/api/teacher/work.zip?language=en")
    run.world.keep("as-asked", outcome == DONE, f"work.zip ends in {outcome}")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        files = [name for name in archive.namelist() if name.endswith(".motorcade.json")]
        texts = "".join(archive.read(name).decode() for name in files)
        overview = archive.read("overview.html").decode()
    check_marks(run, texts)
    run.world.keep("answered-stays", sorted(files) == sorted(_paths(run)), "the file of all work has {}", files)
    told = Overview()
    told.feed(overview)
    rows = [[pupil.name, *sorted([*pupil.projects, *(["Draft"] if pupil.draft else [])])] for pupil in run.pupils]
    shown = [[row[0], *sorted(row[1:])] for row in told.rows[1:]]
    run.world.keep("as-asked", shown == rows, "the overview has {}, not {}", shown, rows)
    run.world.keep("as-asked", sorted(told.links) == sorted(files), "the overview leads to {}", told.links)
    run.world.keep(
        "as-asked", told.title == (run.title or "The work of the class"), "the overview is called {}", told.title
    )


def _paths(run: "Lesson") -> list[str]:
    """The files of all work: a folder for each pupil, and names that every file system allows."""
    return [
        f"{pupil.id} {pupil.name}/{_allowed(name)}.motorcade.json"
        for pupil in run.pupils
        for name in (*pupil.projects, *(["draft"] if pupil.draft else []))
    ]


def _allowed(name: str) -> str:
    allowed = re.sub('[<>:"/\\\\|?*]', "_", name)
    return f"_{allowed}" if allowed.startswith("con.") else allowed


class Overview(HTMLParser):
    """The page of all work, as a browser reads it: its title, where it leads, and the names in each row."""

    def __init__(self) -> None:
        super().__init__()
        self.title = ""
        self.links: list[str] = []
        self.rows: list[list[str]] = []
        self._tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._tags.append(tag)
        self.links += [unquote(value or "") for name, value in attrs if name == "href"]
        if tag == "tr":
            self.rows.append([])

    def handle_endtag(self, tag: str) -> None:
        self._tags.pop()

    def handle_data(self, data: str) -> None:
        tag = self._tags[-1] if self._tags else ""
        if tag == "h1":
            self.title += data
        if tag in ("td", "a", "th"):
            self.rows[-1].append(data)


def check_marks(run: "Lesson", texts: str) -> None:
    """The newest version of each project is there, and nothing else."""
    found = set(_MARK.findall(texts))
    known = {versions[-1] for pupil in run.pupils for versions in pupil.projects.values()}
    known |= {pupil.draft for pupil in run.pupils if pupil.draft}
    run.world.keep("answered-stays", found == known, f"{found ^ known} is missing, or too much")


async def report(run: "Lesson") -> None:
    """The teacher checks all work, or some files, against a mission."""
    order: dict[str, Any] = {"mission": lesson_work.MISSIONS[0]}
    language = run.random.choice(("en", "zh", "xx"))
    told = await _reported(run, order, language)
    known = {"mission": order["mission"], "language": language if language != "xx" else "en", "files": _paths(run)}
    check_marks(run, json.dumps(told["texts"]))
    found = {key: told[key] for key in known}
    run.world.keep(
        "as-asked", found | {"files": sorted(told["files"])} == known | {"files": sorted(_paths(run))}, found
    )
    files = {"../../etc/x.py": "_.._etc", "A/b.py": "A", "a/b.py": "a 2"}
    data = base64.b64encode(b"stop()").decode()
    order["files"] = [{"name": name, "data": data} for name in files]
    told = await _reported(run, order, "en")
    wanted = sorted(f"{folder}/{name.rpartition('/')[2]}" for name, folder in files.items())
    run.world.keep("as-asked", sorted(told["files"]) == wanted, "a report is of {}, not {}", told["files"], wanted)
    if run.random.random() < 0.5:
        await _report_of_who_signs_out(run, order)
    for bad in (b"{", b'{"mission": "no-such"}', b'{"text": "{"}'):
        outcome, _ = await run.teacher.fetch("POST", "/api/teacher/report.html", bad)
        run.world.keep("says-why", outcome not in (DONE, "internal", "no-json"), f"{bad!r} ends in {outcome}")


async def _reported(run: "Lesson", order: dict[str, Any], language: str) -> dict[str, Any]:
    path = f"/api/teacher/report.html?language={language}"
    outcome, data = await run.teacher.fetch("POST", path, json.dumps(order).encode())
    kind = run.teacher.head.get("content-type")
    run.world.keep("as-asked", (outcome, kind) == (DONE, "text/html; charset=utf-8"), f"a report: {outcome} {kind}")
    told: dict[str, Any] = json.loads(data)
    return told


async def _report_of_who_signs_out(run: "Lesson", order: dict[str, Any]) -> None:
    """A report waits for another one; who asked for it signs out meanwhile, and gets none."""
    other = run.new_browser()
    await run.expect("right-guess", other, "teacher/sign-in", DONE, password=PASSWORD)
    twin = run.new_browser()
    twin.cookies = dict(other.cookies)
    body = json.dumps(order).encode()
    first = asyncio.create_task(run.teacher.fetch("POST", "/api/teacher/report.html", body))
    await asyncio.sleep(0.1)
    waiting = asyncio.create_task(other.fetch("POST", "/api/teacher/report.html", body))
    await asyncio.sleep(0.1)
    await run.expect("as-asked", twin, "teacher/sign-out", DONE)
    outcome, _ = await first
    run.world.keep("as-asked", outcome == DONE, f"report.html ends in {outcome}")
    outcome, _ = await waiting
    run.world.keep("out-is-out", outcome != DONE, "a teacher who has signed out gets a report")


def write_report(command: list[str]) -> None:
    """What the process does that checks work: here it lists what it was asked, and all files."""
    asked, work, page = command[4], Path(command[5]), Path(command[7])
    files = [file for file in sorted(work.rglob("*")) if file.is_file()]
    told = {
        "mission": asked,
        "language": command[command.index("--language") + 1],
        "files": [file.relative_to(work).as_posix() for file in files],
        "texts": [file.read_text(encoding="utf-8") for file in files],
    }
    page.write_text(json.dumps(told), encoding="utf-8")


ACTS = [(0.4, collect), (0.4, report)]
