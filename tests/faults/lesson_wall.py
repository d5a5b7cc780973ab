"""The wall and those who look on in a simulated lesson: which worlds are shown, in which pictures, and how many."""

import asyncio
import struct
from typing import TYPE_CHECKING, Any

from tests.faults.browsers import DONE
from tests.faults.lesson_cars import SET, draw, key_of, world_of_mission
from tests.faults.lesson_doors import MISSION

from motorcade.engine.moment import moment_bytes

if TYPE_CHECKING:
    from tests.faults.browsers import SimulatedPage
    from tests.faults.lesson import Lesson, Pupil

# So many pictures are under way; and a list that is new waits for so long.
_UNDER_WAY, _LISTED_S = 2, 1.4


async def look_at_wall(run: "Lesson") -> None:
    """Two pupils play; the wall shows both, as often as it is drawn, and the row of each what is reached."""
    pupils = run.random.sample(run.pupils, min(2, len(run.pupils)))
    if not pupils or run.frozen:
        return
    pages = [await _play(run, pupil) for pupil in pupils]
    drawing = [asyncio.create_task(draw(page)) for page in pages]
    wall = (await run.teacher.open("teacher/wall")).follow()
    onlooker = (await run.teacher.open(f"teacher/watch?pupil={pupils[0].id}")).follow()
    await asyncio.sleep(_LISTED_S)
    shown = (wall.newest("wall") or {}).get("worlds", [])
    known = [pupil.id for pupil in run.pupils if pupil in pupils]
    worlds = [each for each in shown if each["pupil"]]
    run.world.keep("shows-what-is", [each["pupil"] for each in worlds] == known, "the wall shows {}", worlds)
    for world in worlds:
        page = pages[next(place for place, pupil in enumerate(pupils) if pupil.id == world["pupil"])]
        _check_world(run, world, page)
    for page in (wall, onlooker):
        run.world.keep("bounded", page.pictures == _UNDER_WAY, "{} pictures that nobody has drawn", page.pictures)
    number = (wall.newest("wall") or {})["number"]
    _check_picture(run, wall, number, shown)
    await _draw(run, wall, onlooker, number, shown)
    await _check_goals(run, pupils, pages)
    for task in drawing:
        task.cancel()
    for page in (*pages, wall, onlooker):
        page.close()


async def _play(run: "Lesson", pupil: "Pupil") -> "SimulatedPage":
    page = (await pupil.browser.open(f"world?session={key_of(pupil)}")).follow()
    mission = run.random.random() < 0.5
    # The world of before, perhaps.
    await asyncio.sleep(0.1)
    page.messages.clear()
    page.send(world_of_mission() if mission else SET)
    pupil.opened = MISSION if mission else None
    await asyncio.sleep(0.3)
    page.send({"do": "play", "speed": 1.0})
    return page


def _check_world(run: "Lesson", shown: dict[str, Any], page: "SimulatedPage") -> None:
    """What the wall knows of a world is what its own page knows."""
    hello = page.newest("hello") or {}
    own = {key: hello.get(key) for key in ("leads", "radius_m", "cars")}
    told = {key: shown.get(key) for key in own}
    run.world.keep("shows-what-is", told == own, "the wall shows {}, not {}", told, own)
    goals = page.newest("goals")
    count = len(goals["goals"]) if goals else 0
    run.world.keep("shows-what-is", len(shown["goals"]) == count, "the wall shows {} goals, not {}", shown, count)


def _check_picture(run: "Lesson", wall: "SimulatedPage", number: int, shown: list[dict[str, Any]]) -> None:
    """A picture has of each world of the list at most one part, with all its cars."""
    data = wall.picture
    told, at, places = struct.unpack_from("<I", data)[0], 4, []
    while at < len(data):
        place, cars, _ = struct.unpack_from("<HHI", data, at)
        places.append((place, cars))
        at += 8 + moment_bytes(cars)
    known = {(place, each["cars"]) for place, each in enumerate(shown)}
    is_so = told == number and at == len(data) and set(places) <= known and len(set(places)) == len(places)
    run.world.keep("shows-what-is", is_so, "a picture of list {} has {}, not of {} {}", told, places, number, known)


async def _draw(
    run: "Lesson", wall: "SimulatedPage", onlooker: "SimulatedPage", number: int, shown: list[dict[str, Any]]
) -> None:
    """Pictures go on as they are drawn; a page that sees no tile is sent none."""
    before = wall.pictures, onlooker.pictures
    for _ in range(4):
        wall.send({"number": number})
        onlooker.send({"do": "shown", "frame": onlooker.pictures})
        await asyncio.sleep(0.25)
    now = wall.pictures, onlooker.pictures
    is_so = now[0] - before[0] in (3, 4) and now[1] - before[1] >= _UNDER_WAY
    run.world.keep("shows-what-is", is_so, f"of pictures that are drawn {before} go on to {now}")
    for seen, wanted in (([], False), ([0], True)):
        for _ in range(3):
            wall.send({"number": number, "seen": seen})
            await asyncio.sleep(0.15)
        before_seen = wall.pictures
        wall.send({"number": number})
        await asyncio.sleep(0.3)
        is_so = (wall.pictures > before_seen) == wanted
        is_same = (wall.newest("wall") or {}).get("number") == number
        run.world.keep("shows-what-is", is_so or not is_same, f"a wall that shows {seen}: {wall.pictures} pictures")


async def _check_goals(run: "Lesson", pupils: "list[Pupil]", pages: "list[SimulatedPage]") -> None:
    await asyncio.sleep(0.6)
    rows = {row["id"]: row for row in (run.teachers_page.newest("class") or {})["pupils"]} if run.teachers_page else {}
    for pupil, page in zip(pupils, pages, strict=True):
        goals = (page.newest("goals") or {"goals": []})["goals"]
        known = sum(goal["progress"] == "met" for goal in goals), len(goals)
        row = rows.get(pupil.id, {})
        told = row.get("goals_met"), row.get("goals")
        run.world.keep("shows-what-is", told == known, "{} has reached {}, not {}", pupil.name, told, known)


async def wall_of_nobody(run: "Lesson") -> None:
    """Only pupils of the class can be looked at; without worlds the wall is empty, and pages end with the sign-in."""
    gone = run.out[-1].id if run.out else "99"
    page = (await run.teacher.open(f"teacher/watch?pupil={gone}")).follow()
    await asyncio.sleep(0.3)
    told = page.has_ended, page.codes()
    run.world.keep("out-is-out", told == (True, ["no-such-pupil"]), "who looks at nobody is told {}", told)


async def many_changes(run: "Lesson") -> None:
    """Whatever changes often is shown a few times a second, and as it is at last."""
    pages = [page for page in (run.teachers_page, *(pupil.page for pupil in run.pupils)) if page and not page.has_ended]
    kind = run.random.choice(("freeze", "hand"))
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    await asyncio.sleep(0.5)
    before = [len(page.messages) for page in pages]
    began_s = run.world.now_s
    for number in range(16):
        if kind == "freeze":
            run.frozen = number % 2 == 0
            await run.expect("as-asked", run.teacher, "teacher/freeze", DONE, frozen=run.frozen)
        else:
            pupil.hand, pupil.hand_s = number % 2 == 0, run.world.now_s
            await run.expect("as-asked", pupil.browser, "class/hand", DONE, raised=pupil.hand)
        await asyncio.sleep(0.05)
    took_s = run.world.now_s - began_s
    for page, count in zip(pages, before, strict=True):
        every_s = 0.25 if page is run.teachers_page else 0.1
        shown = len(page.messages) - count
        run.world.keep("bounded", shown <= took_s / every_s + 2, f"in {took_s} s a page is sent {shown} times")
    await run.check_pages()


async def ping_pages(run: "Lesson") -> None:
    """A page that says nothing for long is asked whether it is there, and is dropped where it doesn't answer."""
    pupil = run.draw([each for each in run.pupils if each.page and not each.page.has_ended])
    if pupil is None:
        return
    mute = (await pupil.browser.open("trials")).follow()
    mute.is_mute = True
    there = (await pupil.browser.open("trials")).follow()
    await asyncio.sleep(22.0)
    run.world.keep("page-stays", mute.pings == there.pings == 1, f"in 22 s a page is asked {mute.pings} times")
    run.world.keep("page-stays", not mute.has_ended, "a page that is mute for 22 s is dropped")
    await asyncio.sleep(22.0)
    ended = mute.has_ended, there.has_ended
    run.world.keep("page-stays", ended == (True, False), "of a page that is mute, and one that isn't: {}", ended)
    there.close()
    outcome, _ = await run.ask(pupil.browser, "projects/list")
    run.world.keep("page-stays", outcome == DONE, f"a pupil who has a page is told {outcome}")


ACTS = [(0.35, look_at_wall), (0.3, wall_of_nobody), (0.25, ping_pages), (0.3, many_changes)]
