"""What the folder of a class holds in a simulated lesson: after each act every file is compared with the model."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from tests.faults.browsers import Browser
from tests.faults.class_room import EPOCH_S
from tests.faults.disk import Node
from tests.faults.lesson_doors import stars_of
from tests.faults.lesson_work import kept
from tests.faults.pupils import PASSWORD

from motorcade.classroom.folder import DRAFT, RECORD
from motorcade.server.studio.library import OWNERS, STARS, name_of
from motorcade.service.library import mission_library

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson, LessonPair, Pupil

SIGNED_IN_S = 12 * 3600.0
_MOST_SIGN_INS = 8
# Of a time in the file: a request takes a moment, and the class looks at the calendar once a second.
_ABOUT_S = 5.0
_ENDING = ".motorcade.json"
_NEWS = ("number", "kind", "name", "sender")
_SETTINGS = ("title", "is_open", "stuck_minutes", "code", "joined", "paired", "handed")


def secret_of(browser: Browser, who: str) -> str:
    """The digest of a browser's secret, as the class's or the ``teacher``'s; "" where it has none."""
    found = [secret for name, secret in browser.cookies.items() if name.startswith(f"motorcade_{who}_")]
    return hashlib.sha256(found[0].encode()).hexdigest() if found else ""


def note_teacher(run: "Lesson", browser: Browser, request: str, before: str) -> None:
    """Note that the teacher has signed in at a browser, or out; ``before`` is its secret before the request."""
    if request in ("teacher/sign-in", "teacher/first-password"):
        kept = run.sign_ins[-_MOST_SIGN_INS + 1 :] if request == "teacher/sign-in" else []
        run.sign_ins = [*kept, (secret_of(browser, "teacher"), calendar_s(run) + SIGNED_IN_S)]
    if request == "teacher/sign-out":
        run.sign_ins = [each for each in run.sign_ins if each[0] != before]


def calendar_s(run: "Lesson") -> float:
    """What the calendar of the class's computer shows."""
    return EPOCH_S + run.world.now_s + run.wall_s


def record(run: "Lesson") -> dict[str, Any]:
    """What the class's file has."""
    found: dict[str, Any] = json.loads(run.disk.find(run.folder / RECORD).data)
    return found


def check(run: "Lesson") -> None:
    """Compare the class's file and all libraries with the model."""
    _check_record(run)
    check_libraries(run)


def _check_record(run: "Lesson") -> None:
    stored = record(run)
    # A pair that nobody is in yet, or that nobody could begin, is deleted within a second; so are the libraries.
    stored["pairs"] = [pair for pair in stored["pairs"] if pair["members"]]
    known: dict[str, Any] = {key: getattr(run, key) for key in _SETTINGS}
    known["missions"] = [{"id": each["id"], "document": None} for each in run.missions]
    known["pupils"] = [_pupil(pupil) for pupil in run.pupils]
    known["pairs"] = [_pair(pair) for pair in run.pairs]
    other = {key: (stored[key], value) for key, value in known.items() if stored[key] != value}
    run.world.keep("answered-stays", not other, "the class's file: {}", other)
    _check_sign_ins(run, stored["sign_ins"])
    owners = {pupil.id for pupil in run.pupils} | {f"pair-{pair.number}" for pair in run.pairs}
    run.world.keep("answered-stays", not owners & set(stored["removed"]), f"{stored['removed']} is to be deleted")
    browsers = [*run.signed_in, *(device for pupil in run.pupils for device in pupil.devices)]
    secrets = [PASSWORD, *(secret for browser in browsers for secret in browser.cookies.values())]
    text = json.dumps(stored)
    told = [secret for secret in secrets if secret in text]
    run.world.keep("no-secrets", not told, f"{told} in the class's file")


def check_settled(run: "Lesson") -> None:
    """Some seconds later nothing is left to be deleted, and there is no pair that nobody is in."""
    stored = record(run)
    left = [pair["id"] for pair in stored["pairs"] if not pair["members"]], stored["removed"]
    run.world.keep("ended-is-gone", left == ([], []), f"{left} is left")


def _check_sign_ins(run: "Lesson", stored: list[dict[str, Any]]) -> None:
    """The browsers in which the teacher is signed in are in the file, and for how long, whatever the calendar shows."""
    found = [each["device"] for each in stored]
    run.world.keep("answered-stays", found == [secret for secret, _ in run.sign_ins], f"{len(found)} sign-ins: {found}")
    late_s = [each["until_s"] - until_s for each, (_, until_s) in zip(stored, run.sign_ins, strict=True)]
    is_so = all(abs(each_s) < _ABOUT_S for each_s in late_s)
    run.world.keep("answered-stays", is_so, f"the teacher is signed out {late_s} s too late")


def _pupil(pupil: "Pupil") -> dict[str, Any]:
    return {
        **{key: getattr(pupil, key) for key in ("id", "name", "avatar", "number", "mission", "told")},
        "devices": [secret_of(device, "class") for device in pupil.devices],
        "news": [dict(zip(_NEWS, news, strict=True)) for news in pupil.news],
    }


def _pair(pair: "LessonPair") -> dict[str, Any]:
    return {
        "id": str(pair.number),
        "name": pair.name,
        "members": [pupil.id for pupil in pair.members],
        "joined": [pupil.id for pupil in pair.joined],
        "owners": {window: owner and owner.id for window, owner in pair.owners.items()},
        "asks": pair.asks and pair.asks.id,
    }


# The libraries.


def check_libraries(run: "Lesson") -> None:
    """Whoever is in has what was answered, and no more; whoever is out has left nothing."""
    found = check_left(run)
    for owner, projects in _libraries(run):
        stored = dict(_projects(found.get(owner)))
        is_so = stored.keys() == projects.keys() and all(
            len(files) == len(kept(projects[name])) and all(map(_has, files, kept(projects[name])))
            for name, files in stored.items()
        )
        run.world.keep("answered-stays", is_so, "{} has {}, not {}", owner, stored, projects)
    for pupil in run.pupils:
        files = found[pupil.id].entries if pupil.id in found else {}
        _check_more(run, pupil, {name: node.data for name, node in files.items() if not node.is_folder})


def check_left(run: "Lesson") -> dict[str, Node]:
    """Whoever is out has left nothing. Returns the folders of those who are in."""
    try:
        folders = run.disk.find(run.folder / OWNERS).entries
    except OSError:
        return {}
    found = {name_of(name) or name: node for name, node in folders.items()}
    left = found.keys() - {owner for owner, _ in _libraries(run)} - run.begun
    run.world.keep("ended-is-gone", not left, f"{left} is left")
    return found


def _has(file: bytes, text: str) -> bool:
    return text.encode() in file


def _libraries(run: "Lesson") -> Iterator[tuple[str, Mapping[str, list[str]]]]:
    """By their owners the projects that there are, each with a text of each of its versions."""
    yield "teacher", run.library
    for pupil in run.pupils:
        yield pupil.id, pupil.projects
        yield mission_library(pupil.id), pupil.missions
    for pair in run.pairs:
        yield f"pair-{pair.number}", pair.texts | ({"mission": [pair.mission]} if pair.mission else {})


def _projects(folder: Node | None) -> Iterator[tuple[str, list[bytes]]]:
    """The projects in a library, and the files of each, the oldest version first."""
    for name, node in folder.entries.items() if folder else ():
        # A file that is empty, or its folder alone, is what a full disk leaves.
        files = [file.data for _, file in sorted(node.entries.items()) if file.data and not file.is_folder]
        project = name_of(name)
        if project is not None and files:
            yield project, files


def _check_more(run: "Lesson", pupil: "Pupil", files: dict[str, bytes]) -> None:
    """A pupil's draft and stars."""
    draft = json.loads(files.get(DRAFT, b"null"))
    found = (draft["name"], draft["project"]["python"]) if draft else ("", None)
    run.world.keep("answered-stays", found == (pupil.draft_name, pupil.draft), f"{pupil.name}'s draft: {found}")
    stars = json.loads(files[STARS])["stars"] if STARS in files else {}
    known = stars_of(pupil)
    run.world.keep("answered-stays", stars == known, f"{pupil.name} has {stars}, not {known}")


def used_bytes(run: "Lesson", owner: str) -> int:
    """What an owner's projects take, with all versions and those that were deleted."""

    def size(node: Node) -> int:
        inside = node.entries.items()
        return sum(size(each) if each.is_folder else len(each.data) * name.endswith(_ENDING) for name, each in inside)

    return size(check_left(run)[owner]) if owner in check_left(run) else 0
