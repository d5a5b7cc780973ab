"""What the teacher does in a simulated lesson: settings, names, numbers, hand-outs, stops, reports, and the end."""

import asyncio
import re
from typing import TYPE_CHECKING, Any

from tests.faults import lesson_cars, lesson_files, lesson_mat, lesson_pairs, lesson_work
from tests.faults.browsers import DONE
from tests.faults.lesson_doors import WORK, drawn_name, wanted_name
from tests.faults.pupils import PASSWORD

from motorcade.classroom.network import qr_svg
from motorcade.service.messages import MissionChoice
from motorcade.service.missions import chosen_mission
from motorcade.words.request import GO, STOP

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson, Pupil

_MARK = re.compile("# mark-[0-9]+-")
# A stop is shown so soon, before a car that can't be reached is given up.
_AT_ONCE_S = 0.4
# A car that comes back is reached within so long.
_BACK_S, _FROZEN_S = 4.0, 2.5
# Whoever is out is sent nothing any more after so long.
_LAST_WORDS_S = 2.0
# WebSockets of a pupil's that may say nothing for long.
_QUIET = ("/drive/ws", "trials", "upload", "serial")


async def settings(run: "Lesson") -> None:
    """The teacher changes settings; nonsense changes none of them."""
    changes: dict[str, Any] = {}
    if run.random.random() < 0.5:
        changes["title"] = f"Class {run.random.randrange(100)}"
    if run.random.random() < 0.4:
        changes["is_open"] = run.random.random() < 0.6
    if run.random.random() < 0.4:
        changes["stuck_minutes"] = run.random.randint(1, 60)
    await run.expect("as-asked", run.teacher, "teacher/settings", DONE, **changes)
    run.title = changes.get("title", run.title)
    run.is_open = changes.get("is_open", run.is_open)
    run.stuck_minutes = changes.get("stuck_minutes", run.stuck_minutes)
    bad = run.random.choice(({"stuck_minutes": 0}, {"stuck_minutes": 61}, {"title": "<b>"}, {"is_open": "x"}))
    await run.expect("says-why", run.teacher, "teacher/settings", ("bad-message", "bad-user-name"), **bad)


async def rename(run: "Lesson") -> None:
    """The teacher renames a pupil: also then no two names look alike."""
    pupil, typed = run.draw(run.pupils), drawn_name(run)
    if pupil is None:
        return
    wanted, alike, name = wanted_name(run, typed, but=pupil)
    await run.expect("names", run.teacher, "teacher/rename", wanted, pupil=pupil.id, name=typed)
    if wanted == DONE:
        pupil.name, pupil.alike = name, alike
    await run.expect("as-asked", run.teacher, "teacher/rename", "no-such-pupil", pupil="99", name="Zed")


async def reset_number(run: "Lesson") -> None:
    """The teacher makes a new number: the old one lets nobody in."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    old = pupil.number
    answer = await run.expect("as-asked", run.teacher, "teacher/reset-number", DONE, pupil=pupil.id)
    pupil.number = answer["number"]
    run.world.keep("as-asked", answer == pupil.about(), f"{answer}")
    taken = [each.number for each in run.pupils if each is not pupil]
    run.world.keep("as-asked", pupil.number not in taken, "two pupils have one number")
    if old != pupil.number and not run.wrong_numbers_s.get(pupil.alike):
        guess = {"code": run.code, "name": pupil.name, "number": old}
        await run.expect("wrong-guess", run.new_browser(), "class/return", "wrong-number", **guess)
        run.wrong_numbers_s.setdefault(pupil.alike, []).append(run.world.now_s)


async def new_code(run: "Lesson") -> None:
    """The teacher makes a new code: the old one lets nobody in, and who is in stays in."""
    old = run.code
    answer = await run.expect("as-asked", run.teacher, "teacher/new-code", DONE)
    run.code = answer["code"]
    run.world.keep("as-asked", run.code != old and len(run.code) == 6, f"{run.code}")
    await run.expect("wrong-guess", run.new_browser(), "class/check-code", "wrong-class-code", code=old)
    pupil = run.draw(run.pupils)
    if pupil:
        await run.expect("right-guess", pupil.browser, "projects/list", DONE)
    address = run.random.choice(run.addresses)
    await run.expect("as-asked", run.teacher, "teacher/choose-address", "not-found", address="http://evil.example/")
    chosen = await run.expect("as-asked", run.teacher, "teacher/choose-address", DONE, address=address)
    run.addresses.sort(key=lambda each: each != address)
    shown = await run.expect("as-asked", run.teacher, "teacher/addresses", DONE)
    known = {"code": run.code, "addresses": run.addresses, "local_name": None, "why_no_name": None}
    known["qr_code"] = qr_svg(f"{address}join#{run.code}")
    run.world.keep("as-asked", chosen == shown == known, f"{shown} in place of {known}")


async def freeze(run: "Lesson") -> None:
    """The teacher freezes all pages, or thaws them; pupils' work is still stored."""
    run.frozen = not run.frozen
    await run.expect("as-asked", run.teacher, "teacher/freeze", DONE, frozen=run.frozen)
    await lesson_work.save(run)


async def stop(run: "Lesson") -> None:
    """The teacher stops all cars, or releases them."""
    if not run.stopped:
        stopping = asyncio.create_task(run.expect("stop-gets-through", run.teacher, "teacher/stop-all", DONE))
        await asyncio.sleep(_AT_ONCE_S)
        # Whatever becomes of cars that can't be reached.
        for page in [pupil.page for pupil in run.pupils if pupil.page and not pupil.page.has_ended]:
            view = page.newest("pupil") or {}
            run.world.keep("stop-gets-through", bool(view.get("stopped")), "the stop waits for something")
        away = await stopping
        wanted = [] if run.control else ["red"]
        run.world.keep("stop-gets-through", away == wanted, f"{away} could not be reached")
        state = run.control and run.control.telemetry().state
        run.world.keep("stop-gets-through", state in (None, "stopped"), f"after the stop the car is {state}")
        run.stopped, run.ordered = True, STOP
        run.car_is_stopped = run.control is not None
    else:
        await run.expect("as-asked", run.teacher, "teacher/release-all", DONE)
        run.stopped = run.car_is_stopped = False
        run.ordered = GO


async def stop_and_release(run: "Lesson") -> None:
    """Stops and releases follow each other while a car is perhaps away: the last one holds, also when it comes back."""
    orders = run.random.choices(("teacher/stop-all", "teacher/release-all"), k=3)
    if run.car and run.random.random() < 0.5:
        run.car.freeze(_FROZEN_S)
    asked = []
    for order in orders:
        asked.append(asyncio.create_task(run.expect("stop-gets-through", run.twin(run.teacher), order, DONE)))
        await asyncio.sleep(run.random.choice((0.1, _AT_ONCE_S, 1.5)))
    await asyncio.gather(*asked)
    run.stopped = run.car_is_stopped = orders[-1] == "teacher/stop-all"
    run.ordered = STOP if run.stopped else GO
    if run.control is None and run.random.random() < 0.6:
        lesson_cars.start_car(run)
    if run.car:
        await asyncio.sleep(_BACK_S)
    state = run.control and run.control.telemetry().state
    is_so = state is None or (state == "stopped") == run.stopped
    run.world.keep("stop-holds", is_so, f"after {orders} the car is {state}")
    run.car_is_stopped = state == "stopped"
    await run.check_pages()


async def pass_on(run: "Lesson") -> None:
    """The teacher gives the cable or a car to somebody, or to nobody."""
    name, pupil = run.random.choice(list(run.holders)), run.draw([None, *run.pupils])
    await run.expect("one-holder", run.teacher, "teacher/pass-on", DONE, name=name, pupil=pupil and pupil.id)
    run.holders[name] = pupil
    gone = run.out[-1].id if run.out else "99"
    await run.expect("one-holder", run.teacher, "teacher/pass-on", "no-such-pupil", name=name, pupil=gone)
    await run.expect("one-holder", run.teacher, "teacher/pass-on", "car-not-listed", name="blue", pupil=None)


async def hand_out(run: "Lesson") -> None:
    """The teacher hands out a project or a mission, to all or to some."""
    some = run.random.sample(run.pupils, run.random.randint(0, len(run.pupils)))
    to = None if run.random.random() < 0.5 else some
    pupils = run.pupils if to is None else some
    message: dict[str, Any] = {"to": None if to is None else [pupil.id for pupil in to]}
    if run.random.random() < 0.5:
        await _hand_out_mission(run, to, pupils, message)
        return
    mark, project = lesson_work.work(run, *pupils)
    await _hand_out_project(run, pupils, mark, {"name": "task", "project": project} | message)
    await run.expect("as-asked", run.teacher, "teacher/hand-out", "no-such-pupil", to=["99"], name="x", project=WORK)
    await run.expect("as-asked", run.teacher, "teacher/hand-out", "no-project", name="not there")


async def _hand_out_project(run: "Lesson", pupils: "list[Pupil]", mark: str, message: dict[str, Any]) -> None:
    """Pupils get a project, except those who have as many as they may."""
    missed = [pupil.id for pupil in pupils if lesson_work.is_full(pupil)]
    wanted = "too-many-projects" if missed and len(missed) == len(pupils) else DONE
    answer = await run.expect("as-asked", run.teacher, "teacher/hand-out", wanted, **message)
    known = {"pupils": len(pupils) - len(missed), "missed": missed}
    run.world.keep("as-asked", answer == (known if wanted == DONE else None), f"{answer}, not {known}")
    for pupil in pupils:
        if pupil.id not in missed:
            name = lesson_work.free_name(pupil, message["name"], "")
            pupil.projects[name] = [mark]
            pupil.tell("project", name, "")


async def _hand_out_mission(
    run: "Lesson", to: "list[Pupil] | None", pupils: "list[Pupil]", message: dict[str, Any]
) -> None:
    mission = {"id": run.random.choice(lesson_work.MISSIONS)}
    if mission not in run.missions and len(run.missions) >= lesson_work.MOST_MISSIONS:
        wanted = "too-many-handed-out"
        await run.expect("bounded", run.teacher, "teacher/hand-out", wanted, mission=mission, **message)
        return
    answer = await run.expect("as-asked", run.teacher, "teacher/hand-out", DONE, mission=mission, **message)
    run.world.keep("as-asked", answer == {"pupils": len(pupils), "missed": []}, f"{answer}")
    if mission not in run.missions:
        run.missions.append(mission)
    number = run.missions.index(mission) + 1
    if to is None:
        run.handed = number
    for pupil in pupils:
        pupil.mission = number
        pupil.tell("mission", chosen_mission(MissionChoice(**mission)).name.texts, "")


async def look_at_work(run: "Lesson") -> None:
    """The teacher looks at a pupil's projects and draft; they stay as they are."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    answer = await run.expect("as-asked", run.teacher, "teacher/library", DONE, pupil=pupil.id)
    own = await run.expect("as-asked", pupil.browser, "projects/list", DONE)
    lesson_work.check_saved_at(run, answer["draft_at"], pupil.draft_s if pupil.draft else None)
    known = {"pupil": pupil.name, "projects": own, "draft_at": answer["draft_at"]}
    run.world.keep("as-asked", answer == known, "the teacher sees {}, not {}", answer, known)
    for name, versions in list(pupil.projects.items())[:1]:
        message = {"pupil": pupil.id, "name": name}
        answer = await run.expect("as-asked", run.teacher, "teacher/project", DONE, **message)
        whole = lesson_work.WHOLE | {"python": versions[-1], "name": name, "version": 0}
        run.world.keep("as-asked", answer == whole, f"{answer}")
    wanted = DONE if pupil.draft is not None else "no-draft"
    answer = await run.expect("as-asked", run.teacher, "teacher/project", wanted, pupil=pupil.id, name="")
    if answer:
        whole = lesson_work.WHOLE | {"python": pupil.draft, "name": pupil.draft_name, "version": 0}
        run.world.keep("as-asked", answer == whole, f"{answer}")
    gone = run.out[-1].id if run.out else "99"
    for request in ("teacher/library", "teacher/project"):
        message = {"pupil": gone} | ({"name": "x"} if request == "teacher/project" else {})
        await run.expect("out-is-out", run.teacher, request, "no-such-pupil", **message)


async def teachers_library(run: "Lesson") -> None:
    """The teacher has a library of the own, and hands out from it."""
    mark, project = lesson_work.work(run, *run.pupils)
    await run.expect("as-asked", run.teacher, "projects/write", DONE, name="starter", project=project)
    run.library.setdefault("starter", []).append(mark)
    await _hand_out_project(run, run.pupils, mark, {"name": "starter"})


async def remove(run: "Lesson") -> None:
    """The teacher removes a pupil, most often one who has something, who is out at once and has left nothing."""
    have = [each for each in (*run.mat_entries, *run.holders.values()) if each in run.pupils]
    pupil = run.draw(have if have and run.random.random() < 0.7 else run.pupils)
    if pupil:
        if run.random.random() < 0.4 and not run.disk.is_full:
            await _give_all(run, pupil)
        pages = [(await pupil.browser.open(path)).follow() for path in _QUIET]
        world = (await pupil.browser.open(f"world?session={lesson_cars.key_of(pupil)}")).follow()
        await asyncio.sleep(0.2)
        await remove_pupil(run, pupil)
        await run.expect("as-asked", run.teacher, "teacher/remove", "no-such-pupil", pupil=pupil.id)
        if not run.disk.is_full:
            await run.check_pages()
        await asyncio.sleep(_LAST_WORDS_S)
        left = [path for path, page in zip(_QUIET, pages, strict=True) if not page.has_ended]
        run.world.keep("out-is-out", not left, "{}, who is out, still has {}", pupil.name, left)
        told = world.has_ended, world.codes()
        run.world.keep("out-is-out", told == (True, ["class-session-needed"]), "{} is told {}", pupil.name, told)


async def _give_all(run: "Lesson", pupil: "Pupil") -> None:
    """A pupil gets what one can have: the cable, the car, a place on the mat, a partner."""
    for name in run.holders:
        await run.expect("one-holder", run.teacher, "teacher/pass-on", DONE, name=name, pupil=pupil.id)
        run.holders[name] = pupil
    await lesson_mat.collect_of(run, pupil)
    others = [each for each in run.pupils if each is not pupil and run.pair_of(each) is None]
    if others and run.pair_of(pupil) is None:
        two = [pupil, run.random.choice(others)]
        await lesson_pairs.begin_pair(run, *run.random.sample(two, 2))
    await run.check_pages()


async def remove_pupil(run: "Lesson", pupil: "Pupil") -> None:
    """Remove a pupil, and check that the pupil is out."""
    await run.expect("leaves", run.teacher, "teacher/remove", DONE, pupil=pupil.id)
    forget(run, pupil)
    for device in pupil.devices[:2]:
        await run.expect("out-is-out", device, "projects/list", "class-session-needed")
    await _see_goodbye(run, pupil, "removed")
    lesson_files.check_left(run)


async def _see_goodbye(run: "Lesson", pupil: "Pupil", why: str) -> None:
    if pupil.page and not pupil.page.has_ended:
        await asyncio.sleep(0.6)
    if pupil.page:
        last = pupil.page.messages[-1] if pupil.page.messages else {}
        is_told = pupil.page.has_ended and (last.get("is"), last.get("why")) == ("goodbye", why)
        run.world.keep("out-is-out", is_told, f"{pupil.name}'s page goes on: {last}")
    pupil.page, pupil.pages = None, []


def forget(run: "Lesson", pupil: "Pupil") -> None:
    """Let the model know that a pupil is out."""
    pair = run.pair_of(pupil)
    if pair:
        lesson_pairs.drop_member(run, pair, pupil)
    run.pupils.remove(pupil)
    run.out.append(pupil)
    run.holders = {name: None if holder is pupil else holder for name, holder in run.holders.items()}
    if run.mat == "collecting":
        run.mat_entries = [each for each in run.mat_entries if each is not pupil]


async def end_class(run: "Lesson") -> None:
    """The teacher ends the class: a wrong password ends nothing; afterwards nobody is in it, and nothing is left."""
    await run.expect("wrong-guess", run.teacher, "teacher/end", "wrong-password", password=PASSWORD[1:])
    await run.expect("leaves", run.teacher, "teacher/end", DONE, password=PASSWORD)
    pupils = list(run.pupils)
    for pupil in pupils:
        forget(run, pupil)
    for pupil in pupils:
        await run.expect("out-is-out", pupil.browser, "projects/list", "class-session-needed")
        await _see_goodbye(run, pupil, "ended")
    run.title, run.missions, run.handed, run.frozen = "", [], None, False
    run.mat, run.mat_entries, run.mat_places = "closed", [], 0
    old, answer = run.code, await run.expect("as-asked", run.teacher, "teacher/addresses", DONE)
    run.code = answer["code"]
    run.world.keep("ended-is-gone", run.code != old, "the code stays")
    data = run.disk.find(run.folder / "class.json").data.decode()
    left = [pupil.name for pupil in pupils if f'"{pupil.name}"' in data]
    run.world.keep("ended-is-gone", not left, f"{left} stays in the class's file")
    lesson_files.check_left(run)


ACTS = [
    (1.2, settings),
    (1.2, rename),
    (0.5, reset_number),
    (0.5, new_code),
    (1.0, freeze),
    (0.8, stop),
    (0.7, stop_and_release),
    (1.2, pass_on),
    (2.0, hand_out),
    (1.4, look_at_work),
    (0.5, teachers_library),
    (1.5, remove),
    (0.4, end_class),
]
