"""What comes at the same moment, in the middle, on a full disk, or by somebody who is slow, in a simulated lesson."""

import asyncio
from typing import TYPE_CHECKING, Any

from tests.faults import lesson_doors, lesson_files, lesson_pairs, lesson_teacher, lesson_times, lesson_work
from tests.faults.browsers import DONE, Browser
from tests.faults.lesson_doors import AVATAR, WORK
from tests.faults.lesson_pairs import may_give, paired_now
from tests.faults.pupils import PASSWORD

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson

_CANT_STORE = ("cant-save", "class-not-stored", "undone-meanwhile")
# Until the class has tried again to store what it could not, and pages show it.
_AGAIN_S = 2.5
# Whoever isn't slow is answered so soon.
_SOON_S = 1.0
_SLOW = 6
# A large project, and how exactly it is known what is stored of it.
_BIG_BYTES, _ABOUT_BYTES = 50_000, 2_000


async def full_disk(run: "Lesson") -> None:
    """The disk is full: what has to be stored is refused and changes nothing; whoever leaves is out, for good."""
    if run.random.random() < 0.6:
        await _part_while_it_fills(run)
    run.disk.fill()
    run.disk.free_bytes = run.random.choice((0, 30))
    refused = run.random.sample((_join, _rename, _new_code, _hand_out, _save, _draft, _new_number, _pair), 3)
    leaves = run.random.sample((_sign_out_teacher, lesson_doors.leave, lesson_teacher.remove, _stop, _leave_pair), 2)
    for act in [_set_title, *refused, *leaves]:
        await act(run)
    if run.teachers_page:
        await asyncio.sleep(0.6)
        shown = run.teachers_page.newest("class") or {}
        run.world.keep("shows-what-is", bool(shown["disk"]), "the teacher isn't told that the disk is full")
    run.disk.heal()
    await asyncio.sleep(_AGAIN_S)
    # The teacher's page tells of the disk until it has taken something.
    await lesson_teacher.settings(run)
    run.paired = await paired_now(run)
    if run.random.random() < 0.5:
        await lesson_times.restart(run)
        await lesson_times.check_out(run)


async def _part_while_it_fills(run: "Lesson") -> None:
    """Somebody goes while the file is being written, and the disk is full when it is to be written without them."""
    assert run.loop
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    if len(pupil.devices) < 2:
        await lesson_doors.come_back(run, pupil)
    acts = (lesson_doors.leave, lambda run: lesson_teacher.remove_pupil(run, pupil), _sign_out_teacher)
    run.loop.late_s = 0.5
    tab, run.title = run.twin(run.teacher), f"Class {run.random.randrange(100)}"
    storing = asyncio.create_task(run.expect("as-asked", tab, "teacher/settings", DONE, title=run.title))
    await asyncio.sleep(0.1)
    going = asyncio.create_task(run.random.choice(acts)(run))
    await asyncio.sleep(0.7)
    run.disk.fill()
    run.disk.free_bytes = 0
    run.loop.late_s = 0.0
    await storing
    await going


async def _refused(run: "Lesson", browser: Browser, request: str, /, **message: Any) -> None:
    await run.expect("answered-stays", browser, request, _CANT_STORE, **message)


async def _join(run: "Lesson") -> None:
    if not run.is_open:
        return
    browser = run.new_browser()
    await _refused(run, browser, "class/join", code=run.code, name=f"F{run.joined}", avatar=AVATAR)
    await run.expect("out-is-out", browser, "projects/list", "class-session-needed")
    # Its number isn't given out again.
    run.joined += 1


async def _rename(run: "Lesson") -> None:
    for pupil in run.pupils[:1]:
        await _refused(run, run.teacher, "teacher/rename", pupil=pupil.id, name=f"F{run.joined}")


async def _set_title(run: "Lesson") -> None:
    await _refused(run, run.teacher, "teacher/settings", title="On a full disk", is_open=not run.is_open)


async def _new_code(run: "Lesson") -> None:
    await _refused(run, run.teacher, "teacher/new-code")
    await run.expect("right-guess", run.new_browser(), "class/check-code", DONE, code=run.code)


async def _new_number(run: "Lesson") -> None:
    for pupil in run.pupils[:1]:
        await _refused(run, run.teacher, "teacher/reset-number", pupil=pupil.id)


async def _hand_out(run: "Lesson") -> None:
    is_full = len(run.missions) >= lesson_work.MOST_MISSIONS
    mission = run.missions[0] if is_full else {"id": lesson_work.MISSIONS[-1]}
    await _refused(run, run.teacher, "teacher/hand-out", mission=mission)


async def _save(run: "Lesson") -> None:
    for pupil in [each for each in run.pupils if not lesson_work.is_full(each)][:1]:
        name = run.random.choice(lesson_work.PROJECTS)
        await _refused(run, pupil.browser, "projects/write", name=name, project=WORK | {"python": run.new_mark()})
        await lesson_work.check_library(run, pupil)


async def _draft(run: "Lesson") -> None:
    for pupil in run.pupils[:1]:
        project = WORK | {"python": run.new_mark()}
        await _refused(run, pupil.browser, "class/draft/write", name="a draft", project=project)
        await lesson_work.check_draft(run, pupil)


async def _pair(run: "Lesson") -> None:
    """Nobody begins a pair, or changes something in one."""
    for pair in [pair for pair in run.pairs if len(pair.joined) > 1][:1]:
        who = pair.joined[0]
        await _refused(run, who.browser, "class/pair/swap", wants=True)
        for window in [window for window, owner in pair.owners.items() if owner is who]:
            message = {"pair": str(pair.number), "window": window, "base": pair.versions[window]}
            await _refused(run, who.browser, "class/pair/write", project=WORK | {"python": run.new_mark()}, **message)
    free = [pupil for pupil in run.pupils if run.pair_of(pupil) is None and may_give(run, pupil)]
    if len(free) > 1:
        who, to = free[:2]
        who.gifts_s.append(run.world.now_s)
        await _refused(run, who.browser, "class/pair/begin", to=to.id, name="Parade", project=WORK)


async def _leave_pair(run: "Lesson") -> None:
    """Who leaves a pair is out of it, and has the project on the page alone."""
    who = run.draw([each for pair in run.pairs for each in pair.members])
    pair = who and run.pair_of(who)
    if who and pair:
        copied = await run.expect("leaves", who.browser, "class/pair/leave", DONE)
        run.world.keep("own-work", copied == "", f"on a full disk {who.name} gets {copied!r}")
        lesson_pairs.drop_member(run, pair, who)


async def _stop(run: "Lesson") -> None:
    await lesson_teacher.stop(run)


async def _sign_out_teacher(run: "Lesson") -> None:
    """On a full disk the teacher signs in, and out again."""
    other = run.new_browser()
    await run.expect("right-guess", other, "teacher/sign-in", DONE, password=PASSWORD)
    kept = dict(other.cookies)
    await run.expect("as-asked", other, "teacher/sign-out", DONE)
    other.cookies = kept
    await run.expect("out-is-out", other, "teacher/progress", "teacher-session-needed")
    run.gone.append((other, "teacher/progress", "teacher-session-needed"))


async def fill_library(run: "Lesson") -> None:
    """A pupil has so many bytes, deleted ones and old versions too: one more project finds no room, small or not."""
    pupil = run.draw([each for each in run.pupils if not lesson_work.is_full(each) and "big" not in each.projects])
    if pupil is None:
        return
    for number in range(3):
        mark, project = lesson_work.work(run, pupil)
        used = lesson_files.used_bytes(run, pupil.id)
        project["python"] = text = mark + "x" * (_BIG_BYTES + number)
        left = lesson_work.LIMITS.size_bytes - used - _BIG_BYTES
        if abs(left) < _ABOUT_BYTES:
            break
        wanted = DONE if left > 0 else "library-full"
        await run.expect("bounded", pupil.browser, "projects/write", wanted, name="big", project=project)
        if wanted == DONE:
            pupil.projects.setdefault("big", []).append(text)
    await lesson_work.check_library(run, pupil)
    if "big" in pupil.projects:
        await run.expect("as-asked", pupil.browser, "projects/delete", DONE, name="big")
        del pupil.projects["big"]
        run.disk.settle()


# At the same moment.


async def at_once(run: "Lesson") -> None:
    """Two want the same at the same moment: one of them gets it, and nothing is lost."""
    act = run.random.choice((_take_at_once, _ask_at_once, _join_at_once, _save_at_once, _give_at_once))
    await act(run)


async def _both(run: "Lesson", promise: str, asked: list[tuple[Browser, str, dict[str, Any]]], other: str) -> int:
    """Send two requests at once, of which one is done and the other one ends so; return the place of the former."""
    ends = await asyncio.gather(*(run.ask(browser, name, **message) for browser, name, message in asked))
    outcomes = [outcome for outcome, _ in ends]
    run.world.keep(promise, sorted(outcomes) == sorted((DONE, other)), "{} at once: {}", asked[0][1], outcomes)
    return outcomes.index(DONE)


async def _take_at_once(run: "Lesson") -> None:
    free = [name for name, holder in run.holders.items() if holder is None]
    if not free or len(run.pupils) < 2:
        return
    name, two = run.random.choice(free), run.random.sample(run.pupils, 2)
    asked = [(pupil.browser, "class/take", {"name": name, "wants": True}) for pupil in two]
    run.holders[name] = two[await _both(run, "one-holder", asked, "held-by-another")]


async def _ask_at_once(run: "Lesson") -> None:
    """Two ask a third one to work together."""
    free = [pupil for pupil in run.pupils if run.pair_of(pupil) is None and may_give(run, pupil)]
    if len(free) < 3:
        return
    *two, third = run.random.sample(free, 3)
    marks, asked = [], []
    for pupil in two:
        mark, project = lesson_work.work(run, pupil, third)
        marks.append(mark)
        asked.append((pupil.browser, "class/pair/begin", {"to": third.id, "name": "Parade", "project": project}))
        pupil.gifts_s.append(run.world.now_s)
    place = await _both(run, "as-asked", asked, "in-a-pair-already")
    run.may_see[marks[1 - place]] = {two[1 - place].id}
    run.paired = await paired_now(run)
    pair = run.new_pair("Parade", two[place], third)
    pair.number = next(
        int(stored["id"]) for stored in lesson_files.record(run)["pairs"] if third.id in stored["members"]
    )
    pair.open(marks[place])
    pair.changed_s = run.world.now_s
    run.pairs.append(pair)
    # What was stored for the other one is deleted within a second.
    await asyncio.sleep(1.2)


async def _join_at_once(run: "Lesson") -> None:
    """Two newcomers want one name."""
    if not run.is_open:
        return
    from tests.faults.lesson import Pupil

    name, two = f"J{run.joined}", [run.new_browser(), run.new_browser()]
    message = {"code": run.code, "name": name, "avatar": AVATAR}
    place = await _both(run, "names", [(browser, "class/join", message) for browser in two], "nickname-taken")
    run.joined += 1
    about = await run.expect("own-view", two[place], "class/about", DONE)
    pupil = Pupil(about["me"], name.lower(), two[place])
    pupil.mission, pupil.left_s = run.handed, run.world.now_s
    run.whose[two[place]] = pupil
    run.pupils.append(pupil)
    for browser in two:
        lesson_doors.tries_of(run, browser).append(run.world.now_s)


async def _save_at_once(run: "Lesson") -> None:
    """Two tabs of a pupil save a project that both began from the same version."""
    pupil = run.draw([pupil for pupil in run.pupils if pupil.projects])
    if pupil is None:
        return
    tab, name = run.twin(pupil.browser), next(iter(pupil.projects))
    base, marks, asked = len(pupil.projects[name]), [], []
    for browser in (pupil.browser, tab):
        mark, project = lesson_work.work(run, pupil)
        marks.append(mark)
        asked.append((browser, "projects/write", {"name": name, "project": project, "base": base}))
    place = await _both(run, "answered-stays", asked, "saved-elsewhere")
    pupil.projects[name].append(marks[place])
    await lesson_work.check_library(run, pupil)


async def _give_at_once(run: "Lesson") -> None:
    """One gets two projects of one name."""
    givers = [pupil for pupil in run.pupils if pupil.projects and may_give(run, pupil)]
    if not givers or len(run.pupils) < 2:
        return
    giver = run.random.choice(givers)
    takers = [each for each in run.pupils if len(each.projects) < lesson_work.LIMITS.projects - 1]
    taker = run.draw([each for each in takers if each is not giver])
    if taker is None:
        return
    tab, name = run.twin(giver.browser), next(iter(giver.projects))
    message = {"to": taker.id, "name": name}
    ends = await asyncio.gather(*(run.ask(each, "class/give", **message) for each in (giver.browser, tab)))
    run.world.keep("as-asked", [outcome for outcome, _ in ends] == [DONE, DONE], f"two gifts at once: {ends}")
    mark, copies = giver.projects[name][-1], {copied for _, copied in ends}
    run.may_see[mark].add(taker.id)
    for _ in ends:
        wanted = lesson_work.free_name(taker, name, f" ({giver.name})")
        run.world.keep("answered-stays", wanted in copies, f"{wanted!r} isn't among {copies}")
        taker.projects[wanted] = [mark]
        giver.gifts_s.append(run.world.now_s)
    # Either comes first.
    stored = next(stored for stored in lesson_files.record(run)["pupils"] if stored["id"] == taker.id)
    for news in stored["news"][-2:]:
        run.world.keep("answered-stays", news["name"] in copies, f"news of {news['name']!r}, not of {copies}")
        taker.tell("project", news["name"], giver.name)
    await lesson_work.check_library(run, taker)


# Slow and cut off.


async def slow_bodies(run: "Lesson") -> None:
    """One sends requests whose bodies don't come: all others are answered at once, and that one by other requests."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    requests = ("compile", "projects/read", "projects/write", "missions/check", "class/draft/write", "class/hand")
    late = [await pupil.browser.begin(name, name="slow", project=WORK) for name in run.random.sample(requests, _SLOW)]
    await asyncio.sleep(0.1)
    others = [each for each in run.pupils if each is not pupil]
    began_s = run.world.now_s
    await run.expect("nobody-waits", run.teacher, "teacher/progress", DONE)
    for other in others[:2]:
        await run.expect("nobody-waits", other.browser, "projects/list", DONE)
        leader = {"leader": lesson_work.solution(), "followers": None, "profile": "classroom"}
        await run.expect("nobody-waits", other.browser, "compile", DONE, **leader)
    await run.expect("nobody-waits", pupil.browser, "class/draft/read", DONE)
    took_s = run.world.now_s - began_s
    run.world.keep("nobody-waits", took_s < _SOON_S, f"others wait {took_s} s for the bodies of {pupil.name}")
    for request in late:
        request.hang_up()


async def killed(run: "Lesson") -> None:
    """The server is killed while somebody is removed: the pupil is in with all work, or out without any."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    removal = asyncio.create_task(run.teacher.ask("teacher/remove", pupil=pupil.id))
    await asyncio.sleep(run.random.choice((0.006, 0.01, 0.02, 0.03)))
    run.kill(run.random.random() < 0.5)
    outcome, _ = await removal
    lesson_times.hang_up_all(run)
    await lesson_doors.wait_for_server(run)
    is_in, _ = await run.ask(pupil.browser, "projects/list")
    run.world.keep("out-is-out", outcome != DONE or is_in != DONE, f"{pupil.name}, who was removed, is in")
    if is_in != DONE:
        pupil.page, pupil.pages = None, []
        lesson_teacher.forget(run, pupil)
    await lesson_times.come_up(run)
    if is_in == DONE:
        await lesson_work.check_library(run, pupil)
    lesson_files.check_left(run)


ACTS = [(0.4, fill_library), (0.9, full_disk), (1.6, at_once), (0.5, slow_bodies), (0.5, killed)]
