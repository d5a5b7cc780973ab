"""Two pupils of a simulated lesson who program one project: each has a window, and nobody else gets it."""

from itertools import chain
from typing import TYPE_CHECKING

from tests.faults import lesson_files
from tests.faults.browsers import DONE
from tests.faults.lesson_work import GIFTS, GIFTS_S, free_name, is_full, work

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson, LessonPair, Pupil

# A pair's name is up to its pupils, also one that no file can have.
_TOGETHER = 4
PAIR_NAMES = ("Parade", "a/b", "..", "x" * 100, "a\nb")


async def work_together(run: "Lesson") -> None:
    """Two who are in a pair, or begin one, do one thing after the other; others try to."""
    free = [each for each in run.pupils if run.pair_of(each) is None]
    if not any(len(pair.joined) > 1 for pair in run.pairs) and len(free) > 1:
        two = run.random.sample(free, 2)
        await begin_pair(run, *two)
        await join_pair(run)
    acts = (write_window, write_window, open_next, take_window, swap, conduct)
    for act in run.random.choices(acts, k=_TOGETHER):
        await act(run)


def may_give(run: "Lesson", pupil: "Pupil") -> bool:
    """Whether a pupil may give something twice, or ask twice for a partner."""
    recent = [when_s for when_s in pupil.gifts_s if run.world.now_s - when_s < GIFTS_S]
    return len(recent) <= GIFTS - 2


def who_works(run: "Lesson") -> "Pupil | None":
    """Most often one of two who work together."""
    joined = [each for pair in run.pairs if len(pair.joined) > 1 for each in pair.joined]
    return run.draw(joined if joined and run.random.random() < 0.8 else run.pupils)


async def begin_pair(run: "Lesson", who: "Pupil | None" = None, to: "Pupil | None" = None) -> None:
    """A pupil asks another one to work together, perhaps a second time, or where one of them does already."""
    who = who or run.draw(run.pupils)
    if who is None:
        return
    to = to or run.random.choice(run.pupils)
    pair, name = run.pair_of(who), run.random.choice(PAIR_NAMES)
    mark, project = work(run, who, to)
    who.gifts_s = [when_s for when_s in who.gifts_s if run.world.now_s - when_s < GIFTS_S]
    wanted = DONE
    if len(who.gifts_s) >= GIFTS:
        wanted = "gives-too-often"
    elif (pair and (len(pair.members) > 1 or who not in pair.joined)) or run.pair_of(to) or who is to:
        wanted = "in-a-pair-already"
    allowed = (wanted, "bad-project-name") if name != "Parade" else (wanted,)
    message = {"to": to.id, "name": name, "project": project}
    outcome, _ = await run.ask(who.browser, "class/pair/begin", **message)
    run.world.keep("as-asked", outcome in allowed, f"class/pair/begin ends in {outcome}, not {wanted}")
    if wanted != "gives-too-often":
        who.gifts_s.append(run.world.now_s)
    if outcome == DONE:
        if pair:
            pair.members.append(to)
            for mark in chain.from_iterable(pair.texts.values()):
                run.may_see[mark].add(to.id)
        else:
            run.paired += 1
            new = run.new_pair(name, who, to)
            new.open(mark)
            run.pairs.append(new)
            pair = new
        pair.changed_s = run.world.now_s
    elif wanted == DONE:
        who.gifts_s.pop()
        # A name that no file can have is refused; perhaps a number was taken.
        run.paired = await paired_now(run)


async def paired_now(run: "Lesson") -> int:
    return int(lesson_files.record(run)["paired"])


def joined_pair(run: "Lesson", pupil: "Pupil") -> "LessonPair | None":
    pair = run.pair_of(pupil)
    return pair if pair and pupil in pair.joined else None


async def join_pair(run: "Lesson") -> None:
    """A pupil comes into a pair, asked or not."""
    asked = [each for pair in run.pairs for each in pair.members if each not in pair.joined]
    who = run.draw(asked or run.pupils)
    if who is None:
        return
    pair = run.pair_of(who)
    await run.expect("as-asked", who.browser, "class/pair/join", DONE if pair else "not-in-a-pair")
    if pair and who not in pair.joined:
        pair.joined.append(who)
        pair.changed_s = run.world.now_s
        held = [window for window, owner in pair.owners.items() if owner]
        pair.owners["leader" if held == ["followers"] else "followers"] = who


async def write_window(run: "Lesson") -> None:
    """A pupil writes a window: only the own one, and only from its newest version; others aren't let in."""
    who = who_works(run)
    if who is None:
        return
    window = run.random.choice(("leader", "followers"))
    pair = joined_pair(run, who)
    mark, project = work(run, *(pair.members if pair else [who]))
    base = pair.versions[window] if pair else 1
    wanted = DONE
    if pair is None:
        wanted = "not-in-a-pair"
    elif pair.owners[window] is None:
        wanted = "window-is-free"
    elif pair.owners[window] is not who:
        wanted = "window-of-another"
    elif run.random.random() < 0.2:
        base, wanted = base + 1, "saved-elsewhere"
    number = str(pair.number if pair else 1)
    message = {"pair": number, "window": window, "project": project, "base": base}
    answer = await run.expect("own-work", who.browser, "class/pair/write", wanted, **message)
    if answer is not None and pair:
        pair.texts[window].append(mark)
        run.world.keep("as-asked", answer == pair.versions[window], f"{answer}")
    read = await run.expect(
        "own-work", who.browser, "class/pair/read", DONE if pair else "not-in-a-pair", window=window
    )
    if read and pair:
        found = (read["project"]["python"], read["version"])
        known = (pair.texts[window][-1], pair.versions[window])
        run.world.keep("answered-stays", found == known, f"{found}, not {known}")


async def open_next(run: "Lesson") -> None:
    """A pupil opens a mission for both, perhaps one who doesn't know yet that the other one has."""
    who = who_works(run)
    if who is None:
        return
    pair, wanted = joined_pair(run, who), DONE
    mark, project = work(run, *(pair.members if pair else [who]))
    number = pair.number if pair else 1
    if pair is None:
        wanted = "not-in-a-pair"
    elif run.random.random() < 0.2:
        number, wanted = number - 1, "pair-went-on"
    message = {"pair": str(number), "name": "Parade", "project": project, "mission": {"id": "follow-me"}}
    await run.expect("own-work", who.browser, "class/pair/open", wanted, **message)
    if wanted == DONE and pair:
        _note_next(run, pair, mark)


async def go_on(run: "Lesson", pair: "LessonPair", who: "Pupil") -> None:
    """One of a pair opens the next mission for both."""
    mark, project = work(run, *pair.members)
    message = {"pair": str(pair.number), "name": "Parade", "project": project, "mission": {"id": "follow-me"}}
    await run.expect("own-work", who.browser, "class/pair/open", DONE, **message)
    _note_next(run, pair, mark)


def _note_next(run: "Lesson", pair: "LessonPair", mark: str) -> None:
    run.paired += 1
    pair.number, pair.name, pair.conducted = run.paired, "Parade", None
    pair.open(mark)
    pair.mission = "follow-me"


async def take_window(run: "Lesson") -> None:
    """A pupil takes a window, or gives it back: not one that another has who is here."""
    who = who_works(run)
    if who is None:
        return
    window, wants = run.random.choice(("leader", "followers")), run.random.random() < 0.6
    pair, wanted = joined_pair(run, who), DONE
    owner = pair.owners[window] if pair else None
    if owner and not owner.pages and 16.0 < run.world.now_s - owner.left_s < 21.0:
        # A server that started within this time has counted for less long.
        return
    if pair is None:
        wanted = "not-in-a-pair"
    elif pair.owners[window] not in (None, who) and not run.is_away(pair.owners[window]):
        wanted = "window-of-another"
    await run.expect("own-work", who.browser, "class/pair/take", wanted, window=window, wants=wants)
    if wanted == DONE and pair:
        pair.owners[window] = who if wants else None
        pair.asks = None


async def swap(run: "Lesson") -> None:
    """A pupil asks to swap windows, once or twice, or agrees; nobody swaps alone."""
    who = who_works(run)
    for _ in range(run.random.choice((1, 2))):
        if who:
            await _swap(run, who)


async def _swap(run: "Lesson", who: "Pupil") -> None:
    wants, pair = run.random.random() < 0.8, joined_pair(run, who)
    wanted = DONE
    if pair is None or (wants and len(pair.joined) < 2):
        wanted = "not-in-a-pair"
    await run.expect("own-work", who.browser, "class/pair/swap", wanted, wants=wants)
    if wanted != DONE or pair is None:
        return
    if not wants:
        pair.asks = None
    elif pair.asks in (None, who):
        pair.asks = who
    else:
        pair.owners = {"leader": pair.owners["followers"], "followers": pair.owners["leader"]}
        pair.asks = None


async def conduct(run: "Lesson") -> None:
    """A pupil plays the worlds of both."""
    who = who_works(run)
    if who is None:
        return
    pair = joined_pair(run, who)
    played = {"playing": run.random.random() < 0.5, "speed": 2.0, "seed": 7, "t_ms": run.random.randrange(1000)}
    asked_s = run.world.now_s
    await run.expect("own-work", who.browser, "class/pair/conduct", DONE if pair else "not-in-a-pair", **played)
    if pair:
        number = pair.conducted["number"] + 1 if pair.conducted else 1
        pair.conducted = {"number": number, "by": who.id} | played
        pair.conducted_s = asked_s


async def leave_pair(run: "Lesson", who: "Pupil | None" = None) -> None:
    """A pupil leaves the pair, whatever it is called, and has a copy; who refuses gets none."""
    asked = [each for pair in run.pairs for each in pair.members if each not in pair.joined]
    who = who or run.draw(asked or [each for each in run.pupils if run.pair_of(each)] or run.pupils)
    if who is None:
        return
    pair = run.pair_of(who)
    copied = await run.expect("leaves", who.browser, "class/pair/leave", DONE)
    if pair is None or who not in pair.joined:
        run.world.keep("own-work", copied in ("", {}, None), f"{who.name} gets {copied!r} of a pair of others")
    elif is_full(who):
        run.world.keep("bounded", copied == "", f"{who.name}, who has all projects, gets {copied!r}")
    elif pair.name == "Parade":
        wanted = free_name(who, pair.name, "")
        run.world.keep("as-asked", copied == wanted, f"{copied!r}, not {wanted!r}")
    if copied and pair:
        who.projects[copied] = pair.texts["leader"][-1:]
        run.may_see[pair.texts["leader"][-1]].add(who.id)
    if pair:
        drop_member(run, pair, who)


async def ask_again(run: "Lesson") -> None:
    """Whose partner has left asks somebody else into the pair, who finds what is there."""
    alone = [each for pair in run.pairs if len(pair.members) == 1 for each in pair.joined]
    if not alone:
        await work_together(run)
        pair = run.draw([pair for pair in run.pairs if len(pair.joined) > 1])
        if pair is None:
            return
        leaving = run.draw(pair.joined)
        await leave_pair(run, leaving)
        alone = [each for each in pair.joined if each is not leaving]
    free = [each for each in run.pupils if run.pair_of(each) is None]
    if alone and free:
        await begin_pair(run, run.draw(alone), run.draw(free))


def drop_member(run: "Lesson", pair: "LessonPair", who: "Pupil") -> None:
    """A pupil is no longer in a pair."""
    pair.members.remove(who)
    pair.joined = [each for each in pair.joined if each is not who]
    pair.owners = {window: None if owner is who else owner for window, owner in pair.owners.items()}
    pair.asks = None
    if not pair.joined:
        run.pairs.remove(pair)


ACTS = [
    (1.5, begin_pair),
    (1.2, join_pair),
    (4.0, work_together),
    (1.2, leave_pair),
    (0.6, ask_again),
]
