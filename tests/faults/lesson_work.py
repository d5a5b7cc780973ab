"""What pupils do in a simulated lesson: drafts, projects, missions, gifts, hands, the cable, the mat and pairs."""

import asyncio
import base64
import json
from contextlib import nullcontext
from datetime import datetime
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from msgspec import to_builtins
from tests.faults.browsers import DONE
from tests.faults.lesson_doors import FROM_HOME, MISSION, STARRED, WORK, stars_of
from tests.faults.system import Replaced

from motorcade import Program, compile_program, forward, left
from motorcade.classroom import folder as class_folder
from motorcade.classroom import room as class_state
from motorcade.classroom import running as class_running
from motorcade.classroom import shared_mat
from motorcade.program.blocks import blocks_of
from motorcade.server.studio import library
from motorcade.server.studio import uploads as studio_uploads
from motorcade.service.library import Limits
from motorcade.service.messages import MissionChoice, Port
from motorcade.service.missions import chosen_mission, list_missions
from motorcade.service.missions import open_mission as opened_mission

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson, Pupil

PROJECTS = ("project 0", "Röbot", "con.x", '<i>%&"', 60 * "n")
BAD_NAMES = ("", " ", ".", "..", "a/b", "a\\b", "x" * 61, "a\u202eb", "a\nb")
MISSIONS = [mission.id for mission in list_missions({})][:6]
SERIAL = Port("/dev/ttyTEST", "a car's cable", "serial")
GIFTS, GIFTS_S = 10, 60.0
# Few enough that a lesson comes to them.
LIMITS = Limits(projects=9, versions=4, size_bytes=1 << 17)
MOST_NEWS, MOST_MISSIONS = 5, 3
# How a project is answered that is stored as WORK.
WHOLE = WORK | dict.fromkeys(("mat", "range_mm", "level", "car"))
_STORED_S = 1.0
# What the check of all work takes.
_REPORT_S = 0.5
SOLVES, FAILS = Program([forward(2, speed=1)]), Program([forward(5, speed=3)])
IMAGE = base64.b64encode(compile_program(Program([forward(1, speed=2), left(1)])).image).decode()


def solution(program: Program = SOLVES) -> dict[str, Any]:
    """The leader's blocks of a program; this one earns stars in the first mission."""
    return blocks_of(program)[0]


def work(run: "Lesson", *pupils: "Pupil") -> tuple[str, dict[str, Any]]:
    """A mark, and a project that contains it, which these pupils may see."""
    mark = run.new_mark()
    run.may_see[mark] = {pupil.id for pupil in pupils}
    return mark, WORK | {"python": mark}


def kept(versions: list[str]) -> list[str]:
    """The versions of a project that are kept."""
    return versions[-LIMITS.versions :]


def is_full(pupil: "Pupil") -> bool:
    """Whether a pupil can begin no project any more."""
    return len(pupil.projects) >= LIMITS.projects


# The own library.


async def draft(run: "Lesson") -> None:
    """A pupil stores a draft, and reads it."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    if run.random.random() < 0.7:
        mark, project = work(run, pupil)
        mission = run.random.choice((None, {"id": MISSION}))
        more = {"place": f"tab {run.random.randrange(3)}", "mission": mission}
        message = {"name": "a draft", "project": project} | more
        await run.expect("as-asked", pupil.browser, "class/draft/write", DONE, **message)
        pupil.draft, pupil.draft_name, pupil.draft_s = mark, "a draft", run.world.now_s
        pupil.draft_more = more | {"mission": mission and mission | {"document": None}}
    await check_draft(run, pupil)


async def check_draft(run: "Lesson", pupil: "Pupil") -> None:
    read = await run.expect("answered-stays", pupil.browser, "class/draft/read", DONE)
    known = {"name": pupil.draft_name, "project": pupil.draft and WHOLE | {"python": pupil.draft}} | pupil.draft_more
    saved_at = read.pop("saved_at")
    run.world.keep("answered-stays", read == known, "a draft is {}, not {}", read, known)
    check_saved_at(run, saved_at, pupil.draft_s if pupil.draft else None)


def check_saved_at(run: "Lesson", shown: str | None, saved_s: float | None) -> None:
    """When something was saved, as the disk has it; nothing where there is none."""
    if saved_s is None:
        run.world.keep("answered-stays", not shown, "what isn't there was saved at {}", shown)
    else:
        shown_s = datetime.fromisoformat(shown or "1990-01-01T00:00Z").timestamp()
        run.world.keep("answered-stays", abs(shown_s - saved_s) < _STORED_S, "saved at {}, not {}", shown, saved_s)


async def save(run: "Lesson") -> None:
    """A pupil stores a project, with or without the version that it was made of."""
    pupil, name = run.draw(run.pupils), run.in_turn(PROJECTS)
    if pupil is None:
        return
    mark, project = work(run, pupil)
    versions = pupil.projects.get(name, [])
    base = run.random.choice((None, None, len(versions), len(versions) + 1, 0))
    wanted = DONE
    if base is not None and base != len(versions):
        wanted = "saved-elsewhere" if base else "project-exists"
    elif not versions and is_full(pupil):
        wanted = "too-many-projects"
    message = {"name": name, "project": project} | ({} if base is None else {"base": base})
    answer = await run.expect("answered-stays", pupil.browser, "projects/write", wanted, **message)
    if answer:
        pupil.projects[name] = [*versions, mark]
        run.world.keep("as-asked", answer["version"] == len(versions) + 1, answer)
        if run.random.random() < 0.3:
            # The same once more makes no new version.
            again = await run.expect("as-asked", pupil.browser, "projects/write", DONE, name=name, project=project)
            run.world.keep("as-asked", again["version"] == answer["version"], again)
    if run.random.random() < 0.2:
        bad = run.random.choice(BAD_NAMES)
        await run.expect(
            "says-why", pupil.browser, "projects/write", ("bad-project-name", "bad-message"), name=bad, project=WORK
        )


async def read(run: "Lesson") -> None:
    """A pupil reads projects, old versions too, and tries names of others."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    await check_library(run, pupil)
    other = run.draw([each for each in run.pupils if each is not pupil and each.projects])
    if other:
        name = next(iter(other.projects))
        guesses = [f"../{other.id}/{name}", f"{other.id}/{name}", f"owners/{other.id}", f"..\\{other.id}\\{name}"]
        if name not in pupil.projects:
            guesses.append(name)
        guess = run.random.choice(guesses)
        for request in ("projects/read", "projects/history", "projects/delete"):
            await run.expect("own-work", pupil.browser, request, ("no-project", "bad-project-name"), name=guess)
        await run.expect("own-work", pupil.browser, "projects/list", "bad-message", owner=other.id)


async def check_library(run: "Lesson", pupil: "Pupil") -> None:
    """All that a pupil has stored is there, and nothing else."""
    listed = await run.expect("answered-stays", pupil.browser, "projects/list", DONE)
    found = {each["name"]: each["versions"] for each in listed}
    known = {name: len(kept(versions)) for name, versions in pupil.projects.items()}
    run.world.keep("answered-stays", found == known, f"{pupil.name} has {found}, not {known}")
    in_order = sorted(listed, key=lambda each: (each["saved_at"], each["name"]), reverse=True)
    run.world.keep("as-asked", listed == in_order, "the one saved last isn't first: {}", listed)
    saved_at = {each["name"]: each["saved_at"] for each in listed}
    for name, versions in list(pupil.projects.items())[:2]:
        answer = await run.expect("answered-stays", pupil.browser, "projects/read", DONE, name=name)
        whole = WHOLE | {"python": versions[-1], "name": name, "version": len(versions)}
        run.world.keep("answered-stays", answer == whole, "{}, not {}", answer, whole)
        oldest = 1 + len(versions) - len(kept(versions))
        number = run.random.randint(oldest, len(versions))
        answer = await run.expect("answered-stays", pupil.browser, "projects/read", DONE, name=name, version=number)
        run.world.keep("answered-stays", answer["python"] == versions[number - 1], f"{name}: {answer['python']!r}")
        wrong = {"name": name, "version": run.random.choice((oldest - 1, len(versions) + 1))}
        await run.expect("as-asked", pupil.browser, "projects/read", "no-version", **wrong)
        history = await run.expect("as-asked", pupil.browser, "projects/history", DONE, name=name)
        numbers = [each["version"] for each in history]
        run.world.keep("as-asked", numbers == [*range(len(versions), oldest - 1, -1)], f"{numbers}")
        run.world.keep("as-asked", history[0]["saved_at"] == saved_at[name], "{} and {}", history[0], saved_at[name])
    own = await run.expect("answered-stays", pupil.browser, "missions/own", DONE)
    run.world.keep("answered-stays", sorted(each["name"] for each in own) == sorted(pupil.missions), f"{own}")
    await check_draft(run, pupil)


async def delete(run: "Lesson") -> None:
    """A pupil deletes a project: it is no longer there, and its name is free."""
    pupil = run.draw([each for each in run.pupils if each.projects])
    if pupil is None:
        return
    name = run.random.choice(list(pupil.projects))
    await run.expect("as-asked", pupil.browser, "projects/delete", DONE, name=name)
    del pupil.projects[name]
    # What was deleted may come back with a power failure, but not later.
    run.disk.settle()
    await run.expect("as-asked", pupil.browser, "projects/read", "no-project", name=name)
    await run.expect("as-asked", pupil.browser, "projects/delete", "no-project", name=name)


async def own_missions(run: "Lesson") -> None:
    """A pupil writes a mission, reads and deletes it."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    document = chosen_mission(MissionChoice(id=MISSION)).document
    await run.expect("as-asked", pupil.browser, "missions/write", DONE, name="mine", document=document)
    pupil.missions["mine"] = ["motorcade-mission/1"]
    answer = await run.expect("answered-stays", pupil.browser, "missions/read", DONE, name="mine")
    run.world.keep("answered-stays", answer["id"] == "own", answer["id"])
    if run.random.random() < 0.5:
        await run.expect("as-asked", pupil.browser, "missions/delete", DONE, name="mine")
        pupil.missions.clear()
        run.disk.settle()
    await run.expect("as-asked", pupil.browser, "missions/read", "no-project", name="other")


async def export_and_import(run: "Lesson") -> None:
    """A pupil takes all work home and brings it back: nothing is lost, and nothing doubled."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    answer = await run.expect("answered-stays", pupil.browser, "projects/export", DONE)
    text = answer["text"]
    lost = [mark for versions in pupil.projects.values() for mark in kept(versions) if mark not in text]
    run.world.keep("answered-stays", not lost and not answer["left_out"], f"{lost} isn't in the file")
    done = await run.expect("as-asked", pupil.browser, "projects/import", DONE, text=text)
    new = [each for each in done["projects"] if each["versions"]]
    run.world.keep("as-asked", not new and not done["left_out"], f"{new} is doubled")
    document = json.loads(text)
    if document["projects"] and not is_full(pupil) and run.random.random() < 0.5:
        mark, project = work(run, pupil)
        saved = await run.expect("as-asked", pupil.browser, "save-text", DONE, **project)
        versions = [{"saved_at": "2026-01-01T00:00:00.000Z", "text": saved["text"]}]
        more = {"format": "motorcade-projects/1", "projects": [{"name": "from home", "versions": versions}]}
        more["stars"] = FROM_HOME
        await run.expect("as-asked", pupil.browser, "projects/import", DONE, text=json.dumps(more))
        if "from home" not in pupil.projects:
            pupil.projects["from home"] = [mark]
        else:
            free = next(name for name in map("from home ({})".format, range(2, 50)) if name not in pupil.projects)
            pupil.projects[free] = [mark]
        pupil.imported = True
    bad = run.in_turn(("", "[]", "{", '{"format": 5}', text[: len(text) // 2]))
    await run.expect("says-why", pupil.browser, "projects/import", "no-projects-file", text=bad)
    await check_library(run, pupil)


async def check_stars(run: "Lesson") -> None:
    """A program is checked; what a pupil earns stays, and the teacher sees it."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    for mission in run.random.sample(STARRED, run.random.choice((1, 2))):
        solves = chosen_mission(MissionChoice(id=mission)).solution
        program = run.random.choice((solves, FAILS))
        message = {"mission": {"id": mission}, "leader": solution(program)}
        answer = await run.expect("as-asked", pupil.browser, "missions/check", DONE, **message)
        run.world.keep("as-asked", bool(answer["stars"]) == (program is solves), f"a program earns {answer['stars']}")
        pupil.stars[mission] = sorted({*answer["stars"], *stars_of(pupil).get(mission, ())})
        is_so = answer["earned"] == pupil.stars[mission]
        run.world.keep("answered-stays", is_so, f"{answer['earned']}: {pupil.stars}")
    progress = await run.expect("as-asked", run.teacher, "teacher/progress", DONE)
    known = {each.id: stars_of(each) for each in run.pupils}
    run.world.keep("answered-stays", progress["stars"] == known, "the teacher sees {}", progress["stars"])
    rows = [{"id": each.id, "name": each.name, "stars": each.stars} for each in list_missions({})]
    run.world.keep("as-asked", progress["missions"] == rows, "the teacher sees {}", progress["missions"])
    found = {each["id"]: each["earned"] for each in await run.expect("as-asked", pupil.browser, "missions", DONE)}
    wanted = {each["id"]: stars_of(pupil).get(each["id"], []) for each in rows}
    run.world.keep("answered-stays", found == wanted, "{} sees the stars {}", pupil.name, found)


async def studio_requests(run: "Lesson") -> None:
    """Any other request of the studio is answered, and says what may be done."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    able = await run.expect("as-asked", pupil.browser, "capabilities", DONE)
    known = {"serial_ports": True, "downloads": True, "driving": True, "most_cars": 500}
    run.world.keep("own-view", able == known | {"classroom": "pupil", "cars": ""}, f"{able}")
    able = await run.expect("as-asked", run.teacher, "capabilities", DONE)
    run.world.keep("own-view", able == known | {"classroom": "teacher", "cars": "/api/teacher/cars"}, f"{able}")
    cable = {"port": SERIAL.port, "description": SERIAL.description, "kind": "serial"}
    virtual = {"port": "virtual", "description": "", "kind": "virtual"}
    for browser, has_cable in ((pupil.browser, run.holders[""] is pupil), (run.teacher, True)):
        listed = await run.expect("one-holder", browser, "ports", DONE)
        wanted = [cable] if has_cable else [virtual]
        run.world.keep("one-holder", listed == wanted, "{} is offered {}, not {}", browser.address, listed, wanted)
    leader = {"leader": solution(), "followers": None, "profile": "classroom"}
    requests: list[tuple[str, dict[str, Any]]] = [
        ("profiles", {}),
        ("examples", {}),
        ("opening", {}),
        ("calibration/moves", {}),
        ("calibration/fit", {"readings": {"slow": "30 1"}}),
        ("missions", {}),
        ("projects/place", {}),
        ("compile", leader),
        ("save-text", WORK),
        ("mission", {"id": MISSION}),
        ("decompile", {"image": IMAGE, "profile": "classroom"}),
        ("blocks-to-python", leader),
    ]
    for _ in range(6):
        request, message = run.in_turn(requests)
        await run.ask(pupil.browser, request, **message)
    rest = (
        "python-to-blocks",
        "remedy",
        "open",
        "example",
        "mats/open",
        "missions/notes",
        "missions/open",
        "missions/save-text",
    )
    for _ in range(5):
        request = run.in_turn((*rest, "event-table"))
        outcome, _ = await run.ask(pupil.browser, request, nonsense=5)
        run.world.keep("says-why", outcome != DONE, f"{request} with nonsense ends in {outcome}")


# With others.


async def give(run: "Lesson") -> None:
    """A pupil gives a copy of a project, as often as is allowed."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    takers = [each for each in run.pupils if each is not pupil]
    classmates = await run.expect("as-asked", pupil.browser, "class/classmates", DONE)
    others = [{"id": each.id, "name": each.name, "avatar": each.avatar} for each in takers]
    run.world.keep("own-view", classmates == others, f"{classmates}")
    gone = run.out[-1].id if run.out else "99"
    await run.expect("as-asked", pupil.browser, "class/give", "no-such-pupil", to=gone, name="x")
    if not takers or not pupil.projects:
        return
    count = run.random.choice((1, 1, 1, 2, 12))
    await _give(run, pupil, takers, count)
    givers = [each for each in takers if each.projects]
    if count > GIFTS and givers:
        # Who is given much to gives as before.
        await _give(run, run.draw(givers), [pupil], 1)


async def _give(run: "Lesson", pupil: "Pupil", takers: "list[Pupil]", count: int) -> None:
    name = run.random.choice((max(pupil.projects, key=len), *pupil.projects))
    for _ in range(count):
        taker = run.draw(takers)
        pupil.gifts_s = [when_s for when_s in pupil.gifts_s if run.world.now_s - when_s < GIFTS_S]
        if len(pupil.gifts_s) >= GIFTS:
            await run.expect("bounded", pupil.browser, "class/give", "gives-too-often", to=taker.id, name=name)
            continue
        ends = "too-many-projects" if is_full(taker) else DONE
        copied = await run.expect("as-asked", pupil.browser, "class/give", ends, to=taker.id, name=name)
        pupil.gifts_s.append(run.world.now_s)
        if ends != DONE:
            continue
        wanted = free_name(taker, name, f" ({pupil.name})")
        run.world.keep("as-asked", copied == wanted, f"{copied!r} in place of {wanted!r}")
        mark = pupil.projects[name][-1]
        taker.projects[copied] = [mark]
        run.may_see[mark].add(taker.id)
        taker.tell("project", copied, pupil.name)
        await asyncio.sleep(0.06)


def free_name(taker: "Pupil", name: str, ending: str) -> str:
    """The name of a copy in a library."""
    wishes = [ending, *(f"{ending} {number}" for number in range(2, 60))]
    names = (name[: 60 - len(each)] + each for each in wishes)
    return next(each for each in names if each not in taker.projects)


async def see_news(run: "Lesson") -> None:
    """A pupil has seen news."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    number = run.random.randint(0, pupil.told + 1)
    await run.expect("as-asked", pupil.browser, "class/seen", DONE, number=number)
    pupil.news = [news for news in pupil.news if news[0] > number]


async def raise_hand(run: "Lesson") -> None:
    """A pupil raises a hand, or lowers it; the teacher lowers it."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    was_raised, pupil.hand = pupil.hand, run.random.random() < 0.7
    if pupil.hand and not was_raised:
        pupil.hand_s = run.world.now_s
    await run.expect("as-asked", pupil.browser, "class/hand", DONE, raised=pupil.hand)
    if run.random.random() < 0.2:
        await run.expect("as-asked", run.teacher, "teacher/lower-hand", DONE, pupil=pupil.id)
        pupil.hand = False
    if run.random.random() < 0.1:
        await run.expect("as-asked", run.teacher, "teacher/lower-hand", "no-such-pupil", pupil="99")


async def take(run: "Lesson") -> None:
    """A pupil takes the cable or a car, or gives it back: one at a time has it."""
    name = run.random.choice(list(run.holders))
    holder = run.holders[name]
    others = [each for each in run.pupils if each is not holder]
    pupil = run.draw(others if run.random.random() < 0.7 else run.pupils)
    if pupil is None:
        return
    wants = run.random.random() < 0.6
    wanted = DONE if holder in (None, pupil) else "held-by-another"
    await run.expect("one-holder", pupil.browser, "class/take", wanted, name=name, wants=wants)
    if wanted == DONE:
        run.holders[name] = pupil if wants else None
    if run.random.random() < 0.15:
        await run.expect("as-asked", pupil.browser, "class/take", "car-not-listed", name="blue", wants=True)


async def enter_mat(run: "Lesson", image: str | None = "") -> None:
    """A pupil sends a program to the shared mat, or takes it off."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    if image == "":
        image = run.random.choice((IMAGE, IMAGE, None, "AAAA"))
    is_in = pupil in run.mat_entries
    wanted: str | tuple[str, ...] = DONE
    if run.mat != "collecting":
        wanted = "mat-is-closed"
    elif image and not is_in and len(run.mat_entries) >= run.mat_places:
        wanted = "mat-is-full"
    elif image == "AAAA":
        wanted = ("bad-image", "image-damaged", "image-length", "bad-message", "image-too-short", "image-size")
    outcome, _ = await run.ask(pupil.browser, "class/mat", image=image)
    if image == "AAAA" and run.mat == "collecting":
        run.world.keep("says-why", outcome != DONE, "a damaged program is on the mat")
        return
    run.world.keep("as-asked", outcome == wanted, f"class/mat ends in {outcome}, not {wanted}")
    if outcome == DONE:
        run.mat_entries = [each for each in run.mat_entries if each is not pupil or image]
        if image and not is_in:
            run.mat_entries.append(pupil)


async def open_mission(run: "Lesson") -> None:
    """A pupil opens a mission that was handed out; no other number leads to one."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    count = len(run.missions)
    number = run.random.randint(1, count) if count else 1
    answer = await run.expect("as-asked", pupil.browser, "class/mission", DONE if count else "not-found", number=number)
    if answer:
        stars = stars_of(pupil)
        known = to_builtins(opened_mission(MissionChoice(**run.missions[number - 1]), stars))
        run.world.keep("as-asked", answer == known, f"{answer['id']}")
    for wrong in (0, -1, count + 1):
        await run.expect("as-asked", pupil.browser, "class/mission", "not-found", number=wrong)


def names(run: "Lesson") -> Replaced:
    """What the modules take from the system, beside the names of every class."""

    def set_time(path: Any, times: tuple[float, float]) -> None:
        run.disk.find(path).changed_s = times[1]

    def checked(command: list[str], **options: object) -> None:
        run.world.sleep(_REPORT_S)
        run.write_report(command)

    return {
        (library, "FileLock"): lambda *arguments, **named: nullcontext(),
        (library, "os"): SimpleNamespace(utime=set_time),
        (class_running, "listed_ports"): lambda: [SERIAL],
        (class_running, "has_cable"): lambda: True,
        (class_state, "_MOST_NEWS"): MOST_NEWS,
        (class_state, "_MOST_MISSIONS"): MOST_MISSIONS,
        (studio_uploads, "ports"): list,
        (studio_uploads, "time"): SimpleNamespace(sleep=run.world.sleep),
        (studio_uploads, "secrets"): SimpleNamespace(randbelow=run.random.randrange),
        (class_folder, "subprocess"): SimpleNamespace(run=checked, TimeoutExpired=TimeoutError),
        (shared_mat, "secrets"): SimpleNamespace(randbits=run.random.getrandbits),
    }


ACTS = [
    (2.0, draft),
    (4.0, save),
    (1.5, read),
    (0.6, delete),
    (0.4, own_missions),
    (0.6, export_and_import),
    (0.3, check_stars),
    (0.8, studio_requests),
    (2.0, give),
    (0.8, see_news),
    (1.2, raise_hand),
    (2.0, take),
    (1.0, enter_mat),
    (0.7, open_mission),
]
