"""Collect the work of a class: one ZIP file with a folder for each pupil, and a page that lists all."""

import re
import zipfile
from collections.abc import Iterable
from html import escape
from itertools import chain, count
from pathlib import PurePosixPath, PureWindowsPath
from typing import BinaryIO, NamedTuple
from urllib.parse import quote

from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.messages import Draft
from motorcade.classroom.record import Pupil
from motorcade.errors import MotorcadeError, Phrase
from motorcade.service.documents import project_text
from motorcade.service.messages import LibraryEntry, decode
from motorcade.service.missions import list_missions

_ENDING = ".motorcade.json"
# What Windows allows in no name of a file.
_FORBIDDEN = re.compile(r'[<>:"/\\|?*\x00-\x1f]')
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}"
    "table{border-collapse:collapse;width:100%}th,td{border:1px solid #999;padding:.4rem .6rem;text-align:left;"
    "vertical-align:top}"
)


class _Work(NamedTuple):
    """What a pupil has made: the folder in the ZIP file, the projects and their files, and the stars by mission."""

    pupil: Pupil
    folder: str
    projects: list[tuple[LibraryEntry, str]]
    draft: str | None
    stars: dict[str, list[int]]


def write_work(file: BinaryIO, folder: ClassFolder, pupils: Iterable[Pupil], title: str, language: str) -> None:
    """Write the newest versions of all projects of these pupils, their drafts, and ``overview.html``.

    A file that can't be read is left out; the page says so.
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        works = [_add(archive, folder, pupil) for pupil in pupils]
        archive.writestr("overview.html", overview(works, title, language))


def _add(archive: zipfile.ZipFile, folder: ClassFolder, pupil: Pupil) -> _Work:
    place = f"{pupil.id} {_file_name(pupil.name, set())}"
    projects, taken = [], {"draft"}
    for entry in folder.list(pupil.id):
        try:
            data = folder.read(pupil.id, entry.name)
        except MotorcadeError:
            projects.append((entry, ""))
            continue
        name = f"{_file_name(entry.name, taken)}{_ENDING}"
        archive.writestr(f"{place}/{name}", data)
        projects.append((entry, name))
    return _Work(pupil, place, projects, _add_draft(archive, folder, pupil, place), folder.stars(pupil.id))


def _add_draft(archive: zipfile.ZipFile, folder: ClassFolder, pupil: Pupil, place: str) -> str | None:
    try:
        found = folder.read_draft(pupil.id)
        draft = decode(found[0], Draft) if found else None
    except MotorcadeError:
        return None
    if draft is None:
        return None
    name = f"draft{_ENDING}"
    archive.writestr(f"{place}/{name}", project_text(draft.project))
    return name


def _file_name(name: str, taken: set[str]) -> str:
    """A name that every file system allows, as near to ``name`` as possible; unlike those taken, to which it is added.

    A project that is opened from such a file gets its name.
    """
    allowed = _FORBIDDEN.sub("_", name).strip(". ") or "_"
    if PureWindowsPath(allowed).is_reserved():
        allowed = f"_{allowed}"
    wishes = chain([allowed], (f"{allowed} {number}" for number in count(2)))
    found = next(each for each in wishes if each.casefold() not in taken)
    taken.add(found.casefold())
    return found


def overview(works: Iterable[_Work], title: str, language: str) -> str:
    """The page that lists all pupils' projects and stars, as HTML in a language."""
    words = {key: escape(Phrase(f"overview-{key}").sentence(language)) for key in _WORDS}
    missions = {each.id: each.name.get(language) or each.name["en"] for each in list_missions({})}
    rows = []
    for work in works:
        items = [_link(work.folder, file, entry.name, entry.saved_at, words) for entry, file in work.projects]
        if work.draft:
            items.append(_link(work.folder, work.draft, words["draft"], "", words, is_html=True))
        stars = [
            f"<li>{escape(missions.get(each, each))}: {'★' * len(earned)}</li>"
            for each, earned in work.stars.items()
            if earned
        ]
        cells = (escape(work.pupil.name), f"<ul>{''.join(items)}</ul>", f"<ul>{''.join(stars)}</ul>")
        rows.append(f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>")
    heads = "".join(f"<th scope=col>{words[key]}</th>" for key in ("pupil", "projects", "stars"))
    name = escape(title) or words["title"]
    return (
        f'<!doctype html><html lang="{escape(language)}"><meta charset=utf-8>'
        f"<meta name=viewport content=width=device-width><title>{name}</title><style>{_STYLE}</style><h1>{name}</h1>"
        f"<table><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table></html>\n"
    )


_WORDS = ("title", "pupil", "projects", "stars", "draft", "unreadable")


def _link(folder: str, file: str, name: str, saved_at: str, words: dict[str, str], is_html: bool = False) -> str:
    text = name if is_html else escape(name)
    if not file:
        return f"<li>{text} ({words['unreadable']})</li>"
    when = f" ({escape(saved_at[:16].replace('T', ' '))} UTC)" if saved_at else ""
    return f'<li><a href="{quote(str(PurePosixPath(folder) / file))}">{text}</a>{when}</li>'
