"""The shared mat of a simulated lesson: whose programs are on it, what pages show of it, and its world."""

import asyncio
from typing import TYPE_CHECKING

from tests.faults import lesson_work
from tests.faults.browsers import DONE

from motorcade.errors import Phrase
from motorcade.service.messages import MissionChoice, sentences
from motorcade.service.missions import chosen_mission

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson, Pupil

_AT_ONCE_S = 0.4
_MISSION = "follow-me"


async def mat(run: "Lesson") -> None:
    """The teacher opens the shared mat, starts and closes it."""
    opens = run.mat == "closed" or run.random.random() < 0.2
    if opens:
        await _open(run)
        bad = run.random.choice(({"places": 0}, {"places": 61}, {"followers": 11}))
        await run.expect("says-why", run.teacher, "teacher/mat/open", "bad-message", **bad)
    if run.mat == "collecting" and run.random.random() < 0.7:
        if run.random.random() < 0.7:
            await lesson_work.enter_mat(run, image=lesson_work.IMAGE)
        if run.mat_entries and run.random.random() < 0.3:
            await _close_while_it_starts(run)
        else:
            wanted = DONE if run.mat_entries else "mat-is-empty"
            await run.expect("as-asked", run.teacher, "teacher/mat/start", wanted)
            run.mat, run.mat_started_s = "running" if run.mat_entries else run.mat, run.world.now_s
    elif not opens:
        await run.expect("as-asked", run.teacher, "teacher/mat/close", DONE)
        run.mat, run.mat_entries, run.mat_places = "closed", [], 0
    if run.random.random() < 0.3:
        await _look_at_mat(run)
    await run.check_pages()


async def _open(run: "Lesson") -> None:
    """Programs are collected for a parade, or for a mission, which has so many leaders."""
    places, followers = run.random.choice((1, 2, 30)), run.random.randrange(3)
    message = {"places": places, "followers": followers}
    plan = {"mission": None, "title": sentences(Phrase("parade"))}
    if run.random.random() < 0.3:
        message = {"mission": {"id": _MISSION}}
        chosen = chosen_mission(MissionChoice(id=_MISSION))
        places, plan = len(chosen.mat.starts.leaders), {"mission": _MISSION, "title": chosen.name.texts}
        followers = (len(chosen.mat.starts) - places) // places
    await run.expect("as-asked", run.teacher, "teacher/mat/open", DONE, **message)
    run.mat, run.mat_entries, run.mat_places, run.mat_followers = "collecting", [], places, followers
    run.mat_plan = plan


async def collect_of(run: "Lesson", pupil: "Pupil") -> None:
    """A pupil's program is on the mat, and perhaps another's."""
    if run.mat != "collecting":
        await run.expect("as-asked", run.teacher, "teacher/mat/open", DONE, places=30, followers=0)
        run.mat, run.mat_entries, run.mat_places, run.mat_followers = "collecting", [], 30, 0
        run.mat_plan = {"mission": None, "title": sentences(Phrase("parade"))}
    for each in dict.fromkeys((pupil, run.random.choice(run.pupils))):
        if each in run.mat_entries or len(run.mat_entries) < run.mat_places:
            await run.expect("as-asked", each.browser, "class/mat", DONE, image=lesson_work.IMAGE)
            run.mat_entries += [each] if each not in run.mat_entries else []


async def _close_while_it_starts(run: "Lesson") -> None:
    """The mat is closed, or opened anew, while its world is built: no program of before drives on it."""
    assert run.loop
    run.loop.late_s = 1.0
    starting = asyncio.create_task(run.expect("as-asked", run.teacher, "teacher/mat/start", "mat-is-closed"))
    await asyncio.sleep(_AT_ONCE_S)
    run.loop.late_s = 0.0
    run.mat, run.mat_entries, run.mat_places = run.random.choice((("closed", [], 0), ("collecting", [], 30)))
    run.mat_followers, run.mat_plan = 2, {"mission": None, "title": sentences(Phrase("parade"))}
    request = "teacher/mat/close" if run.mat == "closed" else "teacher/mat/open"
    await run.expect("as-asked", run.twin(run.teacher), request, DONE)
    await starting


async def _look_at_mat(run: "Lesson") -> None:
    """The page of the mat knows its world, whole, and changes nothing in it but how it plays."""
    page = (await run.teacher.open("teacher/mat")).follow()
    await asyncio.sleep(0.4)
    first = page.messages[0] if page.messages else {}
    entries = len(run.mat_entries) if run.mat_plan.get("mission") is None else run.mat_places
    cars = [entries * (1 + run.mat_followers)] if run.mat == "running" else []
    told = [(each["pupil"], each["cars"], len(each["leads"])) for each in first.get("worlds", [])]
    known = [("", count, entries) for count in cars]
    is_so = (first.get("is"), first.get("number"), told) == ("wall", 1, known) and not page.has_ended
    run.world.keep("shows-what-is", is_so, "the page of the mat is told {}, not {}", first, known)
    for message in ({"do": "set", "mat": {}, "image": "", "profile": "classroom"}, {"do": "step", "ticks": 1}):
        page.send(message)
    await asyncio.sleep(0.2)
    codes = page.codes()
    run.world.keep("one-holder", len(codes) == 2 and codes[1] == "not-in-this-world", "the mat is changed: {}", codes)
    page.close()


ACTS = [(2.0, mat)]
