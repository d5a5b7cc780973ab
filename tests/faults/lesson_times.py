"""What comes too late, and what passes: late bodies, restarts, damaged files, time, and the end of a lesson."""

import asyncio
from typing import TYPE_CHECKING, Any

from tests.faults import (
    lesson_cars,
    lesson_doors,
    lesson_files,
    lesson_luck,
    lesson_pairs,
    lesson_teacher,
    lesson_work,
)
from tests.faults.browsers import DONE
from tests.faults.lesson_doors import MISSION, WORK, wait_for_server
from tests.faults.pupils import PASSWORD

from motorcade.classroom.folder import RECORD

# A calendar is set by an hour, a day, a month or years; the class looks at it once a second.
_JUMPS_S = (600.0, 3600.0, 7200.0, 86_400.0, 30 * 86_400.0, 400 * 86_400.0, 9000 * 86_400.0)
_SEEN_S = 2.5
_OF_A_TEACHER: tuple[tuple[str, dict[str, Any]], ...] = (
    ("teacher/freeze", {"frozen": True}),
    ("teacher/settings", {"title": "Late"}),
    ("teacher/new-code", {}),
    ("teacher/stop-all", {}),
    ("teacher/hand-out", {"name": "late", "project": WORK}),
)

# The mission behind the first one.
_NEXT = "round-the-corner"

if TYPE_CHECKING:
    from tests.faults.browsers import SimulatedPage
    from tests.faults.lesson import Lesson, Pupil


async def late_body(run: "Lesson") -> None:
    """A request's body comes when its sender is out: it does nothing any more."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    partner = run.draw([each for each in run.pupils if each is not pupil and run.pair_of(each) is None])
    requests: list[tuple[str, dict[str, Any]]] = [
        ("class/draft/write", {"name": "late", "project": WORK | {"python": run.new_mark()}}),
        ("projects/write", {"name": "late", "project": WORK | {"python": run.new_mark()}}),
        ("class/hand", {"raised": not pupil.hand}),
        ("projects/import", {"text": "{}"}),
        ("missions/write", {"name": "late", "document": {}}),
        ("class/take", {"name": "", "wants": True}),
    ]
    if partner:
        requests.append(("class/pair/begin", {"to": partner.id, "name": "late", "project": WORK}))
    if pupil.projects and partner:
        requests.append(("class/give", {"to": partner.id, "name": next(iter(pupil.projects))}))
    requests += [(name, {}) for name in ("projects/list", "missions", "class/draft/read", "class/classmates")]
    requests.append(("compile", {"leader": lesson_work.solution(), "followers": None, "profile": "classroom"}))
    leaves = len(pupil.devices) > 1 and run.random.random() < 0.5
    device = pupil.devices[0] if leaves else pupil.browser
    chosen = run.random.sample(requests, min(3, len(requests)))
    late = [(name, await device.begin(name, **message)) for name, message in chosen]
    teachers = None
    if run.random.random() < 0.3:
        other = run.new_browser()
        await run.expect("right-guess", other, "teacher/sign-in", DONE, password=PASSWORD)
        kept = dict(other.cookies)
        request, message = run.random.choice(_OF_A_TEACHER)
        teachers = await other.begin(request, **message)
        await asyncio.sleep(0.05)
        await run.expect("as-asked", other, "teacher/sign-out", DONE)
        other.cookies = kept
    await asyncio.sleep(0.05)
    if leaves:
        await run.expect("as-asked", run.twin(device), "class/leave", DONE)
        pupil.devices.remove(device)
    else:
        await out(run, pupil)
    for name, request in late:
        outcome, _ = await request.end()
        run.world.asked.add((name, f"late {outcome}"))
        run.world.keep("out-is-out", outcome != DONE, f"{name}, whose body came late, is done")
    if teachers:
        outcome, _ = await teachers.end()
        run.world.keep("out-is-out", outcome != DONE, "a teacher who has signed out orders something")
    lesson_files.check_left(run)
    if leaves:
        await asyncio.sleep(0.3)
        lesson_doors.note_left(run, pupil)
        await lesson_work.check_library(run, pupil)
    await run.check_pages()
    if run.random.random() < 0.3:
        await restart(run)


async def late_job(run: "Lesson") -> None:
    """The computer is busy with what a pupil asked for, and the pupil goes, or the one for whom it is: it isn't done.

    Nothing comes back behind who has gone.
    """
    pupil = run.draw(run.pupils)
    if pupil is None or run.loop is None:
        return
    other = run.draw([each for each in run.pupils if each is not pupil])
    project = WORK | {"python": run.new_mark()}
    requests: list[tuple[str, dict[str, Any]]] = [
        ("class/draft/write", {"name": "late", "project": project}),
        ("projects/write", {"name": "late", "project": project}),
    ]
    if other and lesson_pairs.may_give(run, pupil):
        if pupil.projects:
            requests += [("class/give", {"to": other.id, "name": next(iter(pupil.projects))})] * 2
        if run.pair_of(pupil) is None and run.pair_of(other) is None:
            requests += [("class/pair/begin", {"to": other.id, "name": "Parade", "project": project})] * 2
    name, message = run.random.choice(requests)
    goes, tab = pupil, run.twin(pupil.browser)
    if other and "to" in message:
        pupil.gifts_s.append(run.world.now_s)
        goes = run.random.choice((pupil, other, other))
    if name == "class/pair/begin":
        run.begun = {f"pair-{run.paired + 1}"}
    run.loop.late_s = 1.0
    storing = asyncio.create_task(tab.ask(name, **message))
    # Before the first job, or between it and the next one; a project of who goes then was given before.
    is_given = name == "class/give" and goes is pupil
    await asyncio.sleep(0.05 if is_given or run.random.random() < 0.5 else 1.05)
    run.loop.late_s = 0.0
    is_over = storing.done()
    await out(run, goes)
    outcome, _ = await storing
    run.world.keep("out-is-out", is_over or outcome != DONE, f"{name} of or for a pupil who is out is done")
    run.paired = await lesson_pairs.paired_now(run)
    await asyncio.sleep(1.2)
    run.begun.clear()
    lesson_files.check_left(run)
    lesson_files.check_settled(run)


async def late_window(run: "Lesson") -> None:
    """The computer is busy with what a pupil stores in a window, which isn't the pupil's any more when it is done."""
    pair = run.draw([pair for pair in run.pairs if len(pair.joined) > 1])
    if pair is None:
        await lesson_pairs.work_together(run)
        pair = run.draw([pair for pair in run.pairs if len(pair.joined) > 1])
    if pair is None or run.loop is None:
        return
    who, other = run.random.sample(pair.joined, 2)
    window = run.random.choice(sorted(pair.owners))
    for pupil, wants in ((pair.owners[window], False), (who, True)):
        if pupil:
            await run.expect("own-work", pupil.browser, "class/pair/take", DONE, window=window, wants=wants)
    pair.owners[window], pair.asks = who, None
    base, project = pair.versions[window], WORK | {"python": run.new_mark()}
    message = {"pair": str(pair.number), "window": window, "project": project, "base": base}
    tab = run.twin(who.browser)
    run.loop.late_s = 1.0
    storing = asyncio.create_task(tab.ask("class/pair/write", **message))
    await asyncio.sleep(0.05)
    run.loop.late_s = 0.0
    way = run.random.choice(("free", "another's", "left", "went on"))
    wanted = {"left": "not-in-a-pair", "went on": "pair-went-on"}.get(way, "window-is-free")
    if way in ("free", "another's"):
        await run.expect("own-work", who.browser, "class/pair/take", DONE, window=window, wants=False)
        pair.owners[window] = None
    if way == "another's":
        await run.expect("own-work", other.browser, "class/pair/take", DONE, window=window, wants=True)
        pair.owners[window], wanted = other, "window-of-another"
    if way == "left":
        await lesson_pairs.leave_pair(run, who)
    if way == "went on":
        await lesson_pairs.go_on(run, pair, other)
    outcome, _ = await storing
    run.world.keep("own-work", outcome == wanted, f"a window that is {way} is stored: {outcome}")
    await asyncio.sleep(1.2)
    lesson_files.check(run)


async def out(run: "Lesson", pupil: "Pupil") -> None:
    """Let a pupil be out: removed, or with the whole class."""
    if run.random.random() < 0.7:
        await lesson_teacher.remove_pupil(run, pupil)
    else:
        await lesson_teacher.end_class(run)


async def restart(run: "Lesson") -> None:
    """The server is killed and starts again; all that was answered is there."""
    run.kill(run.random.random() < 0.5)
    hang_up_all(run)
    await come_up(run)


def hang_up_all(run: "Lesson") -> None:
    """All browsers begin new connections."""
    for browser in [*run.signed_in, *(device for pupil in run.pupils for device in pupil.devices)]:
        browser.hang_up()


async def come_up(run: "Lesson") -> None:
    """Wait for the server, and open all pages; what need not survive it is as at the beginning."""
    await wait_for_server(run)
    run.frozen = run.stopped = False
    run.ordered, run.loaded = "", {}
    run.addresses = run.first_addresses()
    run.holders = dict.fromkeys(run.holders)
    run.mat, run.mat_entries, run.mat_places = "closed", [], 0
    run.tries_s.clear()
    run.wrong_numbers_s.clear()
    for pupil in run.pupils:
        pupil.hand, pupil.gifts_s, pupil.pages, pupil.opened = False, [], [], None
        pupil.left_s = run.world.now_s
        if pupil.imported:
            pupil.stars = lesson_doors.stars_of(pupil)
    for pair in run.pairs:
        pair.conducted = None
    await run.open_pages()


async def rot(run: "Lesson") -> None:
    """Somebody has damaged a file: the server says so and repairs nothing; whole again, all is there."""
    path, random = run.folder / RECORD, run.random
    node = run.disk.find(path)
    good = node.data
    cut, at = random.randrange(len(good) - 2), random.randrange(len(good))
    bad = random.choice(
        (b"", good[:cut], b"\0" * len(good), good.replace(b'"pupils"', b'"Pupils"', 1)[:at], b"[]", b"{}")
    )
    if random.random() < 0.5:
        # One wrong letter would be enough to delete everybody's work.
        wrong = random.choice(((b'"pupils"', b'"pupilr"'), (b'"pairs"', b'"pairc"'), (b'"id": "0', b'"id": "8')))
        bad = good.replace(*wrong, 1) if wrong[0] in good else b""
    node.data = node.kept = bad
    run.kill(False)
    await asyncio.sleep(2.5)
    outcome, _ = await run.new_browser().ask("class/about")
    run.world.keep("fails-closed", outcome == "unknown", f"a class whose file is {bad[:20]!r} goes on")
    run.world.keep("fails-closed", run.disk.find(path).data == bad, "a damaged file is replaced")
    node = run.disk.find(path)
    node.data = node.kept = good
    await come_up(run)


async def rest(run: "Lesson") -> None:
    """Time passes; a pupil's page may leave meanwhile, and come back."""
    pupil = run.draw([each for each in run.pupils if each.pages])
    if pupil and run.random.random() < 0.7:
        pupil.page.close()
        pupil.page, pupil.pages, pupil.left_s = None, [], run.world.now_s
    pages = [page for page in (run.teachers_page, *(each.page for each in run.pupils)) if page and page.messages]
    newest = [page.messages[-1:] for page in pages]
    rest_s = run.random.choice((5.0, 25.0))
    await asyncio.sleep(rest_s)
    for page, (before,) in zip(pages, newest, strict=True):
        count = len(page.messages) - 1 - max(at for at, message in enumerate(page.messages) if message is before)
        run.world.keep("bounded", count <= rest_s, f"a page of a class that rests gets {count} messages in {rest_s} s")
    lesson_files.check_settled(run)
    await run.check_pages()
    if pupil and pupil.page is None:
        pupil.page = (await pupil.browser.open("class/stream")).follow()
        pupil.pages = [pupil.page]


async def set_calendar(run: "Lesson") -> None:
    """Somebody sets the computer's calendar, forward or back: no rate, no age and no session depends on it."""
    raised_s = [(pupil, run.world.now_s) for pupil in run.pupils if pupil.hand]
    set_s = run.random.choice((-1.0, 1.0)) * run.random.choice(_JUMPS_S)
    run.wall_s += set_s
    run.sign_ins = [(secret, until_s + set_s) for secret, until_s in run.sign_ins]
    await run.expect("right-guess", run.teacher, "teacher/progress", DONE)
    pupil = run.draw(run.pupils)
    if pupil:
        await run.expect("right-guess", pupil.browser, "projects/list", DONE)
        if run.random.random() < 0.5:
            await lesson_doors.come_back(run, pupil)
    # The class sees it, and the file has it.
    await asyncio.sleep(_SEEN_S)
    if run.random.random() < 0.4:
        await restart(run)
    else:
        rows = {row["id"]: row for row in (run.teachers_page.newest("class") or {}).get("pupils", [])}
        for pupil, _ in raised_s:
            age_s = rows[pupil.id]["hand_s"]
            run.world.keep("shows-what-is", 0 <= age_s <= run.world.now_s, f"{pupil.name} raises a hand for {age_s} s")
    await run.expect("right-guess", run.teacher, "teacher/progress", DONE)


async def pass_a_night(run: "Lesson") -> None:
    """The computer is switched off for more than half a day: the teacher has to sign in again, and pupils needn't."""
    run.kill(False)
    run.wall_s += lesson_files.SIGNED_IN_S + run.random.choice((1.0, 3600.0, 86_400.0))
    hang_up_all(run)
    await wait_for_server(run)
    for browser in run.signed_in:
        await run.expect("out-is-out", browser, "teacher/progress", "teacher-session-needed")
    run.signed_in = [run.teacher]
    await run.expect("right-guess", run.teacher, "teacher/sign-in", DONE, password=PASSWORD)
    await come_up(run)


async def new_password(run: "Lesson") -> None:
    """The teacher has forgotten the password: a new one is set with a key, and every other browser is out."""
    run.first_key = "a-first-key"
    run.kill(False)
    hang_up_all(run)
    await wait_for_server(run)
    others = [run.twin(browser) for browser in run.signed_in]
    await run.expect("right-guess", others[0], "teacher/progress", DONE)
    await lesson_doors.use_first_key(run)
    for browser in others:
        await run.expect("out-is-out", browser, "teacher/progress", "teacher-session-needed")
    run.signed_in = [run.teacher]
    await come_up(run)


async def check_out(run: "Lesson") -> None:
    """Whoever has left is out."""
    for browser, request, code in run.gone[-3:]:
        browser.hang_up()
        await run.expect("out-is-out", browser, request, code)


async def get_stuck(run: "Lesson") -> None:
    """A pupil opens a mission, and makes no step: the teacher sees that after some minutes, and not before."""
    pupil = run.draw([pupil for pupil in run.pupils if pupil.page and not pupil.page.has_ended])
    if pupil is None or run.teachers_page is None:
        return
    await run.expect("as-asked", run.teacher, "teacher/settings", DONE, stuck_minutes=1)
    run.stuck_minutes = 1
    page = (await pupil.browser.open(f"world?session={lesson_cars.key_of(pupil)}")).follow()
    begun = await _begin_mission(run, pupil, page, MISSION)
    await run.check_pages()
    if begun:
        row = _row(run, pupil)
        run.world.keep("shows-what-is", row["stuck_s"] is None, f"{pupil.name}, who begins, is stuck")
    if run.random.random() < 0.3:
        # A mission that is opened anew has nothing reached, so that the same is a step again.
        for mission in (_NEXT, MISSION):
            await _reach(run, pupil, page)
            begun = await _begin_mission(run, pupil, page, mission)
        await asyncio.sleep(45.0)
        await _reach(run, pupil, page)
        await asyncio.sleep(20.0)
        row = _row(run, pupil)
        run.world.keep("shows-what-is", row["stuck_s"] is None, f"{pupil.name}, who has made a step, is stuck")
        begun = False
    if begun and run.random.random() < 0.5:
        await _be_away(run, pupil, 70.0)
    await asyncio.sleep(70.0)
    row = _row(run, pupil)
    run.world.keep("shows-what-is", bool(row["stuck_s"]), f"{pupil.name}, who makes no step, isn't stuck: {row}")
    page.close()


async def _begin_mission(run: "Lesson", pupil: "Pupil", page: "SimulatedPage", mission: str) -> bool:
    """Open a mission, with a program that solves the first one; return whether it is another one."""
    page.send(lesson_cars.world_of_mission(mission) | {"image": lesson_luck.GOOD})
    await asyncio.sleep(0.5)
    before, pupil.opened = pupil.opened, mission
    return before != mission


async def _reach(run: "Lesson", pupil: "Pupil", page: "SimulatedPage") -> None:
    """A pupil's program reaches goals of a mission, and the teacher sees how many."""
    if run.frozen:
        await run.expect("as-asked", run.teacher, "teacher/freeze", DONE, frozen=False)
        run.frozen = False
    page.send({"do": "play", "speed": 4.0})
    drawing = asyncio.create_task(lesson_cars.draw(page))
    await asyncio.sleep(6.0)
    drawing.cancel()
    goals = (page.newest("goals") or {"goals": []})["goals"]
    known = sum(goal["progress"] == "met" for goal in goals), len(goals)
    row = _row(run, pupil)
    is_so = (row["goals_met"], row["goals"]) == known and (known[0] > 0 or pupil.opened != MISSION)
    run.world.keep("shows-what-is", is_so, f"{pupil.name} has reached {known}, and not {row}")


async def _be_away(run: "Lesson", pupil: "Pupil", seconds: float) -> None:
    """While no page of a pupil is connected no time passes until the pupil is stuck."""
    pupil.page.close()
    pupil.page, pupil.pages, pupil.left_s = None, [], run.world.now_s
    await asyncio.sleep(seconds)
    pupil.page = (await pupil.browser.open("class/stream")).follow()
    pupil.pages = [pupil.page]
    await asyncio.sleep(3.0)
    run.world.keep("shows-what-is", _row(run, pupil)["stuck_s"] is None, f"{pupil.name}, who was away, is stuck")


def _row(run: "Lesson", pupil: "Pupil") -> dict[str, Any]:
    """What the teacher's page shows of a pupil."""
    shown = run.teachers_page and run.teachers_page.newest("class")
    return next((row for row in (shown or {}).get("pupils", []) if row["id"] == pupil.id), {})


async def end(run: "Lesson") -> None:
    """At the end the server starts once more, and everybody has what was answered."""
    await restart(run)
    for pupil in run.pupils:
        await lesson_work.check_library(run, pupil)
    for pupil in run.out[-2:]:
        await run.expect("out-is-out", pupil.browser, "projects/list", "class-session-needed")
    await check_out(run)


ACTS = [
    (2.5, late_body),
    (0.5, late_job),
    (0.5, late_window),
    (0.6, restart),
    (0.4, rot),
    (0.8, rest),
    (0.7, set_calendar),
    (0.3, pass_a_night),
    (0.25, new_password),
    (0.3, get_stuck),
]
