"""Who comes in: codes, names, numbers, passwords, devices and cookies."""

import asyncio
from typing import TYPE_CHECKING, Any

from tests.faults.browsers import DONE, Browser
from tests.faults.pupils import PASSWORD

from motorcade.classroom.messages import AVATARS

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson, Pupil

AVATAR = "bus"
# As typed, what it is taken for, and as the class has it.
NAMES = (
    *(("Mia", "mia", "Mia"), ("MIA", "mia", "MIA"), ("\u041cia", "mia", "\u041cia"), ("M i a", "mia", "M i a")),
    *(
        ("Ben", "ben", "Ben"),
        ("\u0412en", "ben", "\u0412en"),
        ("  Ben ", "ben", "Ben"),
        ("\uff22en", "ben", "\uff22en"),
    ),
    *(
        ("Ole", "ole", "Ole"),
        ("\u039fle", "ole", "\u039fle"),
        ("O'le", "ole", "O'le"),
        ("Zo\u0308", "z\u00f6", "Z\u00f6"),
    ),
    *(("李雷", "李雷", "李雷"), ("Bo-2", "bo2", "Bo-2"), ("Bo 2", "bo2", "Bo 2"), ("Eva", "eva", "Eva")),
)
RESERVED = ("Teacher", "t e a c h e r", "ADMIN", "\u0422eacher", "先生", "Motorcade")
BAD = ("x" * 25, "a\u202eb", "-a", "x" + 4 * "\u0301", "a\u3164", "<b>", "a\nb", "_x", "a/b")
MISSING = ("", "   ")
NUMBER_TRIES, ADDRESS_TRIES = (10, 300.0), (60, 600.0)
_MOST_DEVICES, _LEAST_PASSWORD, _MOST_PUPILS = 8, 8, 120
# The mission whose stars pupils earn.
MISSION = "forward-and-stop"
# Missions whose solutions earn stars, and what a pupil brings from home: of each some, and one that there is not.
STARRED = (MISSION, "round-the-corner")
FROM_HOME = {MISSION: [1, 9], "round-the-corner": [2], "long-way": [3]}
WORK: dict[str, Any] = {"leader": {}, "followers": None, "profile": "classroom"}


def stars_of(pupil: "Pupil") -> dict[str, list[int]]:
    """What a pupil has earned, or brought from home, by mission."""
    home = {mission: {star for star in stars if star <= 3} for mission, stars in FROM_HOME.items() if pupil.imported}
    known = {mission: {*home.get(mission, ()), *pupil.stars.get(mission, ())} for mission in home | pupil.stars}
    return {mission: sorted(earned) for mission, earned in known.items() if earned}


def too_many(run: "Lesson", tries_s: list[float], limit: tuple[int, float]) -> bool:
    most, window_s = limit
    return len(tries_s) >= most and run.world.now_s - tries_s[-most] < window_s


def tries_of(run: "Lesson", browser: Browser) -> list[float]:
    return run.tries_s.setdefault(browser.address or "", [])


def wanted_name(run: "Lesson", typed: str, but: "Pupil | None" = None) -> tuple[str, str, str]:
    """How a name ends that somebody types: DONE or the code; what it is taken for, and as the class has it."""
    if typed in MISSING:
        return "nickname-missing", "", ""
    if typed in BAD:
        return "bad-user-name", "", ""
    if typed in RESERVED:
        return "nickname-reserved", "", ""
    _, alike, name = next(each for each in NAMES if each[0] == typed)
    is_taken = any(pupil.alike == alike for pupil in run.pupils if pupil is not but)
    return "nickname-taken" if is_taken else DONE, alike, name


def drawn_name(run: "Lesson") -> str:
    some = [each[0] for each in NAMES]
    return run.random.choice(some if run.random.random() < 0.75 else [*RESERVED, *BAD, *MISSING])


def typed_code(run: "Lesson") -> str:
    """The code as somebody types it."""
    code = run.code
    return str(run.random.choice((code, code.lower(), f"{code[:3]}-{code[3:]}", f" {code[:2]} {code[2:]}")))


def wrong_code(run: "Lesson") -> str:
    code = run.code
    other = "A" if code[0] != "A" else "C"
    return str(
        run.random.choice((other + code[1:], code[:-1], code + "A", "", code[::-1] if code[::-1] != code else ""))
    )


# Coming in.


async def begin(run: "Lesson") -> None:
    """The teacher comes in, and some pupils."""
    await wait_for_server(run)
    if not run.has_password:
        await first_password(run)
    else:
        await run.expect("right-guess", run.teacher, "teacher/sign-in", DONE, password=PASSWORD)
    run.teachers_page = (await run.teacher.open("teacher/stream")).follow()
    for name, alike, _ in run.random.sample([NAMES[0], NAMES[4], NAMES[8], NAMES[15]], run.random.randint(2, 4)):
        await enter(run, name, alike)


async def wait_for_server(run: "Lesson") -> None:
    """Wait until the server answers."""
    for _ in range(40):
        await asyncio.sleep(0.3)
        if (await run.new_browser().ask("class/about"))[0] == DONE:
            return
    run.world.keep("class-goes-on", False, "the server doesn't start again")


async def first_password(run: "Lesson") -> None:
    """Somebody guesses the first key; the teacher has it, and it works once."""
    stranger, guess = run.new_browser(), {"key": "another-key", "password": PASSWORD}
    await run.expect("wrong-guess", stranger, "teacher/sign-in", "wrong-password", password="")
    await run.expect("wrong-guess", stranger, "teacher/first-password", "wrong-first-key", **guess)
    about = await run.expect("as-asked", stranger, "teacher/about", DONE)
    run.world.keep("as-asked", about == {"has_password": False, "signed_in": False}, about)
    await use_first_key(run)


async def use_first_key(run: "Lesson") -> None:
    """The teacher sets a password with the key, which works once, also where it is used twice at a moment."""
    stranger = run.new_browser()
    key, short = {"key": "a-first-key"}, {"password": "x" * (_LEAST_PASSWORD - 1)}
    await run.expect("wrong-guess", run.teacher, "teacher/first-password", "bad-password", **key, **short)
    await run.expect("wrong-guess", run.teacher, "teacher/first-password", "bad-password", **key, password="x" * 201)
    two, message = [run.teacher, run.new_browser()], key | {"password": PASSWORD}
    ends = await asyncio.gather(*(run.ask(browser, "teacher/first-password", **message) for browser in two))
    outcomes = [outcome for outcome, _ in ends]
    run.world.keep("wrong-guess", sorted(outcomes) == [DONE, "wrong-first-key"], "a key is used twice: {}", outcomes)
    run.teacher.cookies = two[outcomes.index(DONE)].cookies
    again = {"key": "a-first-key", "password": "another password"}
    await run.expect("wrong-guess", stranger, "teacher/first-password", "wrong-first-key", **again)
    # A server that is started again has no such key.
    run.first_key = None


async def enter(run: "Lesson", name: str, alike: str, shows: bool = True, address: str = "") -> "Pupil":
    """Let a pupil come in who may."""
    from tests.faults.lesson import Pupil

    browser = run.new_browser(address)
    avatar = run.in_turn(AVATARS)
    message = {"code": typed_code(run), "name": name, "avatar": avatar}
    answer = await run.expect("right-guess", browser, "class/join", DONE, **message)
    tries_of(run, browser).append(run.world.now_s)
    run.joined += 1
    pupil = Pupil(answer, alike, browser)
    run.world.keep("as-asked", answer == pupil.about() | {"avatar": avatar}, f"{answer}")
    known = (pupil.id, pupil.number.isdecimal() and len(pupil.number) == 4)
    run.world.keep("as-asked", known == (f"{run.joined:02}", True), f"{known} instead of {run.joined}")
    is_new = pupil.number not in [other.number for other in run.pupils]
    run.world.keep("as-asked", is_new, "two pupils have one number")
    run.whose[browser] = pupil
    pupil.mission = run.handed
    run.pupils.append(pupil)
    if shows and run.random.random() < 0.8:
        pupil.page = (await browser.open("class/stream")).follow()
        pupil.pages = [pupil.page]
    else:
        pupil.left_s = run.world.now_s
    return pupil


async def join(run: "Lesson") -> None:
    """Somebody comes in, with whatever name, code and picture."""
    typed, browser = drawn_name(run), run.new_browser()
    wanted, alike, _ = wanted_name(run, typed)
    if run.random.random() < 0.15:
        code, avatar = wrong_code(run), AVATAR
        wanted = "wrong-class-code"
        tries_of(run, browser).append(run.world.now_s)
    elif run.random.random() < 0.1:
        code, avatar = typed_code(run), "no-such"
        wanted = "no-such-avatar"
    else:
        code, avatar = typed_code(run), AVATAR
    if wanted != "wrong-class-code" and not run.is_open:
        wanted = "class-closed"
    if wanted == DONE:
        pupil = await enter(run, typed, alike)
        _, _, name = next(each for each in NAMES if each[0] == typed)
        run.world.keep("as-asked", pupil.name == name, f"{pupil.name!r} in place of {name!r}")
    else:
        await run.expect("names", browser, "class/join", wanted, code=code, name=typed, avatar=avatar)
        run.world.keep("no-secrets", not browser.cookies, "who is refused gets a cookie")


async def check_code(run: "Lesson") -> None:
    """Somebody asks whether a code is right."""
    browser = run.new_browser()
    await run.expect("right-guess", browser, "class/check-code", DONE, code=typed_code(run))
    await run.expect("wrong-guess", browser, "class/check-code", "wrong-class-code", code=wrong_code(run))


async def come_back(run: "Lesson", pupil: "Pupil | None" = None) -> None:
    """A pupil comes back at another device; others guess the number."""
    pupil = pupil or run.draw(run.pupils)
    if pupil is None:
        return
    browser = run.new_browser()
    typed = run.random.choice([each[0] for each in NAMES if each[1] == pupil.alike] or [pupil.name])
    other = run.draw([each for each in run.pupils if each is not pupil])
    wrong = f"{(int(pupil.number) + 1) % 10_000:04}"
    guesses = [wrong, "", pupil.number[:3], pupil.number + "0", other.number if other else wrong]
    numbers_s = run.wrong_numbers_s.setdefault(pupil.alike, [])
    for guess in guesses[: run.random.randrange(3)]:
        wanted = "too-many-attempts" if too_many(run, numbers_s, NUMBER_TRIES) else "wrong-number"
        if wanted == "wrong-number":
            numbers_s.append(run.world.now_s)
        await run.expect("wrong-guess", browser, "class/return", wanted, code=typed_code(run), name=typed, number=guess)
    wanted = "too-many-attempts" if too_many(run, numbers_s, NUMBER_TRIES) else DONE
    full_width = "".join(chr(0xFF10 + int(digit)) for digit in pupil.number)
    number = run.random.choice((pupil.number, full_width, f" {pupil.number[:2]} {pupil.number[2:]}"))
    await run.expect(
        "wrong-guess", browser, "class/return", "wrong-class-code", code=wrong_code(run), name=typed, number=number
    )
    answer = await run.expect(
        "right-guess", browser, "class/return", wanted, code=typed_code(run), name=typed, number=number
    )
    if answer:
        run.world.keep("own-view", answer == pupil.about(), f"{answer} instead of {pupil.about()}")
        run.whose[browser] = pupil
        # Eight devices stay in.
        left, pupil.devices = pupil.devices[: -_MOST_DEVICES + 1], [*pupil.devices[-_MOST_DEVICES + 1 :], browser]
        for device in left:
            await run.expect("out-is-out", device, "projects/list", "class-session-needed")
        await asyncio.sleep(0.3 if left else 0.0)
        note_left(run, pupil)


async def many_devices(run: "Lesson") -> None:
    """A pupil comes back so often that the oldest device is out."""
    pupil = run.draw(run.pupils)
    for _ in range(_MOST_DEVICES):
        await come_back(run, pupil)


async def leave(run: "Lesson") -> None:
    """A pupil's device leaves the class, and the pupil comes back by the number."""
    pupil = run.draw([each for each in run.pupils if len(each.devices) > 1])
    if pupil is None:
        return
    device = pupil.devices.pop(0)
    kept = dict(device.cookies)
    await run.expect("leaves", device, "class/leave", DONE)
    run.world.keep("no-secrets", not device.cookies, "a cookie stays after leaving")
    device.cookies = kept
    run.gone.append((device, "projects/list", "class-session-needed"))
    await run.expect("out-is-out", device, "projects/list", "class-session-needed")
    about = await run.expect("out-is-out", device, "class/about", DONE)
    run.world.keep("out-is-out", about["me"] is None, about)
    await asyncio.sleep(0.3)
    note_left(run, pupil)


def note_left(run: "Lesson", pupil: "Pupil") -> None:
    """A page of a device that is out ends."""
    if pupil.page and pupil.page.has_ended:
        run.world.keep("page-stays", pupil.page.messages[-1].get("why") == "left", f"{pupil.page.messages[-1:]}")
        pupil.page, pupil.pages, pupil.left_s = None, [], run.world.now_s


async def about(run: "Lesson") -> None:
    """Anybody asks what everybody may know, and no more."""
    stranger, pupil = run.new_browser(), run.draw(run.pupils)
    known = {"me": None, "is_open": run.is_open, "title": run.title, "avatars": list(AVATARS)}
    told = await run.expect("as-asked", stranger, "class/about", DONE)
    run.world.keep("own-view", told == known, "a stranger is told {}, not {}", told, known)
    if pupil:
        told = await run.expect("as-asked", pupil.browser, "class/about", DONE)
        run.world.keep("own-view", told == known | {"me": pupil.about()}, "{} is told {}", pupil.name, told)
    known = await run.expect("as-asked", stranger, "teacher/about", DONE)
    run.world.keep("as-asked", known == {"has_password": True, "signed_in": False}, known)
    known = await run.expect("as-asked", run.teacher, "teacher/about", DONE)
    run.world.keep("as-asked", known == {"has_password": True, "signed_in": True}, known)


async def fill(run: "Lesson") -> None:
    """So many come in that the class is full: no two have one number, and nobody else comes in. Then it ends."""
    from tests.faults import lesson_teacher

    if not run.is_open:
        return
    while len(run.pupils) < _MOST_PUPILS:
        name = f"P{run.joined}"
        await enter(run, name, name.lower(), shows=False)
    browser = run.new_browser()
    await run.expect(
        "bounded", browser, "class/join", "class-full", code=typed_code(run), name="One more", avatar=AVATAR
    )
    run.world.keep("bounded", not browser.cookies, "who finds no place gets a cookie")
    await lesson_teacher.end_class(run)


# The teacher's password.


async def guess_password(run: "Lesson") -> None:
    """A stranger guesses the password, a pupil too; the teacher signs in at another browser, and out."""
    stranger, pupil = run.new_browser(), run.draw(run.pupils)
    guesses = ("", PASSWORD.upper(), PASSWORD + " ", PASSWORD[:-1], "x" * 300)
    guess = run.random.choice(guesses)
    await run.expect("wrong-guess", stranger, "teacher/sign-in", "wrong-password", password=guess)
    tries_of(run, stranger).append(run.world.now_s)
    await run.expect("wrong-guess", stranger, "teacher/freeze", "teacher-session-needed", frozen=False)
    if pupil and not too_many(run, tries_of(run, pupil.browser), ADDRESS_TRIES):
        await run.expect("wrong-guess", pupil.browser, "teacher/sign-in", "wrong-password", password=guess)
        tries_of(run, pupil.browser).append(run.world.now_s)
    key = {"key": run.random.choice(("a-first-key", "", "None")), "password": "another password"}
    await run.expect("wrong-guess", run.new_browser(), "teacher/first-password", "wrong-first-key", **key)
    other = run.new_browser()
    await run.expect("right-guess", other, "teacher/sign-in", DONE, password=PASSWORD)
    run.signed_in.append(other)
    await run.expect("right-guess", other, "teacher/progress", DONE)


async def sign_out(run: "Lesson") -> None:
    """The teacher signs out at one browser; its cookie is worth nothing then, and the others stay."""
    await guess_password(run)
    other = run.signed_in.pop()
    paths = ("teacher/stream", "teacher/wall", "teacher/mat", "teacher/cars", "trials", "upload", "serial")
    pages = [(await other.open(path)).follow() for path in paths]
    kept = dict(other.cookies)
    await run.expect("as-asked", other, "teacher/sign-out", DONE)
    other.cookies = kept
    await run.expect("out-is-out", other, "teacher/progress", "teacher-session-needed")
    await run.expect("right-guess", run.teacher, "teacher/progress", DONE)
    await asyncio.sleep(2.0)
    left = [path for path, page in zip(paths, pages, strict=True) if not page.has_ended]
    run.world.keep("out-is-out", not left, "a teacher who has signed out still has {}", left)


ACTS = [
    (3.0, join),
    (0.5, check_code),
    (1.5, come_back),
    (0.4, many_devices),
    (0.8, leave),
    (0.7, about),
    (0.8, guess_password),
    (0.4, sign_out),
    (0.06, fill),
]
