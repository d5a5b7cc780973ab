"""Who comes in, and who must not: codes, names, numbers, passwords, cookies, addresses, floods, late bodies, restarts."""

import asyncio
import hashlib
import json
from typing import TYPE_CHECKING, Any

from tests.faults.browsers import DONE, Browser
from tests.faults.pupils import PASSWORD

from motorcade.classroom.app import REQUESTS
from motorcade.classroom.folder import RECORD
from motorcade.service.requests import REQUESTS as STUDIO_REQUESTS

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson, Pupil

AVATAR = "bus"
# As typed, what it is taken for, and as the class has it.
NAMES = (
    *(("Mia", "mia", "Mia"), ("MIA", "mia", "MIA"), ("\u041cia", "mia", "\u041cia"), ("M i a", "mia", "M i a")),
    *(("Ben", "ben", "Ben"), ("\u0412en", "ben", "\u0412en"), ("  Ben ", "ben", "Ben"), ("\uff22en", "ben", "\uff22en")),
    *(("Ole", "ole", "Ole"), ("\u039fle", "ole", "\u039fle"), ("O'le", "ole", "O'le"), ("Zo\u0308", "z\u00f6", "Z\u00f6")),
    *(("李雷", "李雷", "李雷"), ("Bo-2", "bo2", "Bo-2"), ("Bo 2", "bo2", "Bo 2"), ("Eva", "eva", "Eva")),
)
RESERVED = ("Teacher", "t e a c h e r", "ADMIN", "\u0422eacher", "先生", "Motorcade")
BAD = ("x" * 25, "a\u202eb", "-a", "x" + 4 * "\u0301", "a\u3164", "<b>", "a\nb", "_x", "a/b")
MISSING = ("", "   ")
_NUMBER_TRIES, _ADDRESS_TRIES = (10, 300.0), (60, 600.0)
_MOST_PUPILS, _MOST_DEVICES, _LEAST_PASSWORD = 120, 8, 8
# A request has so long; a pupil so many sockets.
_REQUEST_S, _MOST_SOCKETS = 30.0, 8
# The mission whose stars pupils earn.
MISSION = "forward-and-stop"
_KEY = "0123456789abcdef" * 2
WORK: dict[str, Any] = {"leader": {}, "followers": None, "profile": "classroom"}
# WebSockets, and whom they are for.
SOCKETS = {
    "class/stream": "pupil",
    "teacher/stream": "teacher",
    "teacher/wall": "teacher",
    "teacher/watch?pupil=01": "teacher",
    "teacher/mat": "teacher",
    "teacher/cars": "teacher",
    f"world?session={_KEY}": "member",
    "trials": "member",
    "upload": "member",
    "serial": "member",
    "/drive/ws": "member",
}


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
    return str(run.random.choice((other + code[1:], code[:-1], code + "A", "", code[::-1] if code[::-1] != code else "")))


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


async def first_password(run: "Lesson") -> None:
    """Somebody guesses the first key; the teacher has it, and it works once."""
    stranger, guess = run.new_browser(), {"key": "another-key", "password": PASSWORD}
    await run.expect("wrong-guess", stranger, "teacher/sign-in", "wrong-password", password="")
    await run.expect("wrong-guess", stranger, "teacher/first-password", "wrong-first-key", **guess)
    about = await run.expect("as-asked", stranger, "teacher/about", DONE)
    run.world.keep("as-asked", about == {"has_password": False, "signed_in": False}, about)
    key, short = {"key": "a-first-key"}, {"password": "x" * (_LEAST_PASSWORD - 1)}
    await run.expect("wrong-guess", run.teacher, "teacher/first-password", "bad-password", **key, **short)
    await run.expect("wrong-guess", run.teacher, "teacher/first-password", "bad-password", **key, password="x" * 201)
    await run.expect("right-guess", run.teacher, "teacher/first-password", DONE, **key, password=PASSWORD)
    again = {"key": "a-first-key", "password": "another password"}
    await run.expect("wrong-guess", stranger, "teacher/first-password", "wrong-first-key", **again)
    # A server that is started again has no such key.
    run.first_key = None


async def enter(run: "Lesson", name: str, alike: str) -> "Pupil":
    """Let a pupil come in who may."""
    from tests.faults.lesson import Pupil

    browser = run.new_browser()
    answer = await run.expect(
        "right-guess", browser, "class/join", DONE, code=typed_code(run), name=name, avatar=AVATAR
    )
    tries_of(run, browser).append(run.world.now_s)
    run.joined += 1
    pupil = Pupil(answer, alike, browser)
    known = (pupil.id, pupil.number.isdecimal() and len(pupil.number) == 4)
    run.world.keep("as-asked", known == (f"{run.joined:02}", True), f"{known} instead of {run.joined}")
    is_new = pupil.number not in [other.number for other in run.pupils]
    run.world.keep("as-asked", is_new, "two pupils have one number")
    check_cookies(run, browser)
    run.whose[browser] = pupil
    pupil.mission = run.handed
    run.pupils.append(pupil)
    if run.random.random() < 0.8:
        pupil.page = (await browser.open("class/stream")).follow()
        pupil.pages = [pupil.page]
    else:
        pupil.left_s = run.world.now_s
    return pupil


def check_cookies(run: "Lesson", browser: Browser) -> None:
    """No script reads a session's secret, and no other site sends it."""
    for name, attributes in browser.attributes.items():
        is_kept = "httponly" in attributes.lower() and "samesite=strict" in attributes.lower()
        run.world.keep("no-secrets", is_kept, f"the cookie {name} has {attributes}")


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


async def come_back(run: "Lesson") -> None:
    """A pupil comes back at another device; others guess the number."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    browser = run.new_browser()
    typed = run.random.choice([each[0] for each in NAMES if each[1] == pupil.alike])
    other = run.draw([each for each in run.pupils if each is not pupil])
    wrong = f"{(int(pupil.number) + 1) % 10_000:04}"
    guesses = [wrong, "", pupil.number[:3], pupil.number + "0", other.number if other else wrong]
    numbers_s = run.wrong_numbers_s.setdefault(pupil.alike, [])
    for guess in guesses[: run.random.randrange(3)]:
        wanted = "too-many-attempts" if too_many(run, numbers_s, _NUMBER_TRIES) else "wrong-number"
        if wanted == "wrong-number":
            numbers_s.append(run.world.now_s)
        await run.expect(
            "wrong-guess", browser, "class/return", wanted, code=typed_code(run), name=typed, number=guess
        )
    wanted = "too-many-attempts" if too_many(run, numbers_s, _NUMBER_TRIES) else DONE
    full_width = "".join(chr(0xFF10 + int(digit)) for digit in pupil.number)
    number = run.random.choice((pupil.number, full_width, f" {pupil.number[:2]} {pupil.number[2:]}"))
    await run.expect("wrong-guess", browser, "class/return", "wrong-class-code", code=wrong_code(run), name=typed, number=number)  # noqa: E501
    answer = await run.expect(
        "right-guess", browser, "class/return", wanted, code=typed_code(run), name=typed, number=number
    )
    if answer:
        run.world.keep("own-view", answer["id"] == pupil.id, f"{answer['id']} instead of {pupil.id}")
        check_cookies(run, browser)
        run.whose[browser] = pupil
        # Eight devices stay in.
        left, pupil.devices = pupil.devices[: -_MOST_DEVICES + 1], [*pupil.devices[-_MOST_DEVICES + 1 :], browser]
        for device in left:
            await run.expect("out-is-out", device, "projects/list", "class-session-needed")
        await asyncio.sleep(0.3 if left else 0.0)
        note_left(run, pupil)


async def many_devices(run: "Lesson") -> None:
    """A pupil comes back so often that the oldest device is out."""
    for _ in range(_MOST_DEVICES):
        await come_back(run)


async def leave(run: "Lesson") -> None:
    """A pupil's device leaves the class, and the pupil comes back by the number."""
    pupil = run.draw([each for each in run.pupils if len(each.devices) > 1])
    if pupil is None:
        return
    device = pupil.devices.pop(0)
    kept = dict(device.cookies)
    await run.expect("as-asked", device, "class/leave", DONE)
    run.world.keep("no-secrets", not device.cookies, "a cookie stays after leaving")
    device.cookies = kept
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
    known = await run.expect("as-asked", stranger, "class/about", DONE)
    told = (known["me"], known["is_open"], known["title"])
    run.world.keep("as-asked", told == (None, run.is_open, run.title), f"{told}")
    known = await run.expect("as-asked", stranger, "teacher/about", DONE)
    run.world.keep("as-asked", known == {"has_password": True, "signed_in": False}, known)
    known = await run.expect("as-asked", run.teacher, "teacher/about", DONE)
    run.world.keep("as-asked", known["signed_in"], known)
    if pupil:
        known = await run.expect("as-asked", pupil.browser, "class/about", DONE)
        run.world.keep("own-view", known["me"]["id"] == pupil.id, known)


# The teacher's password.


async def guess_password(run: "Lesson") -> None:
    """A stranger guesses the password, a pupil too; the teacher signs in at another browser, and out."""
    stranger, pupil = run.new_browser(), run.draw(run.pupils)
    guesses = ("", PASSWORD.upper(), PASSWORD + " ", PASSWORD[:-1], "x" * 300)
    guess = run.random.choice(guesses)
    await run.expect("wrong-guess", stranger, "teacher/sign-in", "wrong-password", password=guess)
    tries_of(run, stranger).append(run.world.now_s)
    await run.expect("wrong-guess", stranger, "teacher/freeze", "teacher-session-needed", frozen=False)
    if pupil and not too_many(run, tries_of(run, pupil.browser), _ADDRESS_TRIES):
        await run.expect("wrong-guess", pupil.browser, "teacher/sign-in", "wrong-password", password=guess)
        tries_of(run, pupil.browser).append(run.world.now_s)
    key = {"key": run.random.choice(("a-first-key", "", "None")), "password": "another password"}
    await run.expect("wrong-guess", run.new_browser(), "teacher/first-password", "wrong-first-key", **key)
    other = run.new_browser()
    await run.expect("right-guess", other, "teacher/sign-in", DONE, password=PASSWORD)
    check_cookies(run, other)
    run.signed_in.append(other)
    await run.expect("right-guess", other, "teacher/progress", DONE)


async def sign_out(run: "Lesson") -> None:
    """The teacher signs out at one browser; its cookie is worth nothing then, and the others stay."""
    await guess_password(run)
    other, page = run.signed_in.pop(), None
    page = (await other.open("teacher/stream")).follow()
    kept = dict(other.cookies)
    await run.expect("as-asked", other, "teacher/sign-out", DONE)
    other.cookies = kept
    await run.expect("out-is-out", other, "teacher/progress", "teacher-session-needed")
    await run.expect("right-guess", run.teacher, "teacher/progress", DONE)
    await asyncio.sleep(6.0)
    run.world.keep("out-is-out", page.has_ended, "a page of a teacher who has signed out goes on")


# Who must not get in.


def requests_of(kind: str) -> list[str]:
    """The requests for a kind of people: ``teacher``, ``member``, or ``open`` to everybody."""
    guarded = [name for name, (_, exchange) in REQUESTS.items() if not exchange.is_open]
    if kind == "teacher":
        return [name for name in guarded if name.startswith("teacher/")] + ["teacher/nothing"]
    return [name for name in guarded if name.startswith("class/")] + list(STUDIO_REQUESTS) + ["class/nothing"]


async def strangers_ask(run: "Lesson") -> None:
    """Strangers, who was removed, and thieves of cookies send any requests; pupils send those of the teacher."""
    random, outsiders = run.random, [run.new_browser(), await thief(run)]
    outsiders += [device for pupil in run.out[-2:] for device in pupil.devices[:1]]
    for _ in range(8):
        outsider = random.choice(outsiders)
        request = random.choice(requests_of("member"))
        await run.expect("strangers-stay-out", outsider, request, "class-session-needed", **message_of(run, request))
        request = random.choice(requests_of("teacher"))
        who = random.choice([outsider, *(pupil.browser for pupil in run.pupils)])
        await run.expect("teacher-only", who, request, "teacher-session-needed", **message_of(run, request))
        await asyncio.sleep(0.1)


def message_of(run: "Lesson", request: str) -> dict[str, Any]:
    """A message that would do something, if it were allowed."""
    pupil = run.draw([*run.pupils, *run.out])
    whom = pupil.id if pupil else "01"
    known: dict[str, dict[str, Any]] = {
        "class/draft/write": {"name": "x", "project": WORK},
        "projects/write": {"name": "stolen", "project": WORK},
        "projects/read": {"name": "project 0"},
        "projects/delete": {"name": "project 0"},
        "class/hand": {"raised": True},
        "class/take": {"name": "", "wants": True},
        "class/give": {"to": whom, "name": "project 0"},
        "class/pair/begin": {"to": whom, "name": "x", "project": WORK},
        "teacher/freeze": {"frozen": not run.frozen},
        "teacher/remove": {"pupil": whom},
        "teacher/rename": {"pupil": whom, "name": "Renamed"},
        "teacher/end": {"password": PASSWORD},
        "teacher/library": {"pupil": whom},
        "teacher/project": {"pupil": whom, "name": ""},
        "teacher/settings": {"title": "Taken"},
        "teacher/reset-number": {"pupil": whom},
        "teacher/pass-on": {"name": "", "pupil": whom},
    }
    return known.get(request, {})


async def thief(run: "Lesson") -> Browser:
    """Somebody with the names of cookies, and values that are in files or easy to guess."""
    browser, pupil = run.new_browser(), run.draw(run.pupils)
    record = json.loads(run.disk.find(run.folder / RECORD).data)
    names = [name for device in [run.teacher, *([pupil.browser] if pupil else [])] for name in device.cookies]
    digests = [each["device"] for each in record["sign_ins"]]
    digests += [device for each in record["pupils"] for device in each["devices"]]
    empty = hashlib.sha256(b"").hexdigest()
    values = [*digests, "", "01", record["id"], record["code"], empty, "x" * 500]
    browser.cookies = {name: run.random.choice(values) for name in names}
    if pupil and run.random.random() < 0.4:
        # A pupil's secret in the place of the teacher's.
        (secret,) = list(pupil.browser.cookies.values())[:1] or [""]
        browser.cookies = {name: secret for name in run.teacher.cookies}
    return browser


async def open_sockets(run: "Lesson") -> None:
    """Whoever opens a WebSocket gets in only where it is for them."""
    random, pupil = run.random, run.draw(run.pupils)
    people = {"stranger": run.new_browser(), "teacher": run.teacher}
    if pupil:
        people["pupil"] = pupil.browser
    if run.out:
        people["removed"] = run.out[-1].browser
    for path in random.sample(list(SOCKETS), 4):
        who = random.choice(list(people))
        whom = SOCKETS[path]
        is_in = who == whom or (whom == "member" and who in ("pupil", "teacher"))
        if is_in:
            continue
        headers = "" if random.random() < 0.5 else "Origin: http://192.168.1.5:7710\r\n"
        page = (await people[who].open(path, headers=headers)).follow()
        await asyncio.sleep(0.1)
        is_left = bool(page.refused) or (who == "teacher" and bool(page.codes()))
        run.world.keep("strangers-stay-out", is_left, f"{who} is let in at {path}: {page.messages}")
        page.close()


async def other_sites(run: "Lesson") -> None:
    """A page of another site, or a name that points here, gets nothing, though the browser sends its cookies."""
    random, browser = run.random, run.random.choice([run.teacher, *(pupil.browser for pupil in run.pupils)])
    kinds = (
        ("foreign-host", "Host: evil.example\r\n"),
        ("foreign-host", "Host: 192.168.1.5.evil.example:7710\r\n"),
        ("foreign-origin", "Origin: http://evil.example\r\n"),
        ("foreign-origin", "Origin: null\r\n"),
        ("foreign-origin", "Origin: http://192.168.1.5:80\r\n"),
        ("foreign-origin", "Sec-Fetch-Site: cross-site\r\n"),
        ("foreign-origin", "Sec-Fetch-Site: same-site\r\n"),
        ("foreign-origin", "Origin: http://192.168.1.5:7710\r\nOrigin: http://evil.example\r\n"),
    )
    code, headers = random.choice(kinds)
    outcome, _ = await browser.post("class/hand", b'{"raised": true}', headers)
    run.world.keep("other-sites", outcome == code, f"{headers!r} ends in {outcome}")
    page = await browser.open("class/stream" if browser is not run.teacher else "teacher/stream", headers=headers)
    # A header that comes twice the library of WebSockets refuses by itself.
    run.world.keep("other-sites", page.refused in (code, "no-json"), f"{headers!r} opens a stream: {page.refused!r}")
    outcome, _ = await browser.fetch("GET", "/", headers="Sec-Fetch-Site: cross-site\r\n")
    run.world.keep("other-sites", outcome == DONE or browser.status in (303, 503), f"a link ends in {outcome}")
    own = "Origin: http://192.168.1.5:7710\r\nSec-Fetch-Site: same-origin\r\n"
    outcome, _ = await browser.post("class/about", b"{}", own)
    run.world.keep("as-asked", outcome == DONE, f"the own page is refused: {outcome}")


async def bad_bodies(run: "Lesson") -> None:
    """Nonsense gives a sentence; what is too large is refused, also where its length is a lie."""
    browser = run.random.choice([run.new_browser(), run.teacher, *(pupil.browser for pupil in run.pupils)])
    for body in run.random.sample((b"", b"[]", b"{", b"null", b'{"name": 5}', b"\xff", b'{"to": "' + b"x" * 900), 2):
        outcome, _ = run.answered(browser, "class/check-code", *await browser.post("class/check-code", body))
        run.world.keep("says-why", outcome == "bad-message", f"{body!r} ends in {outcome}")
    for length in run.random.sample(("1048577", "-1", "9" * 20), 1):
        outcome, _ = await browser.post("class/check-code", b"", f"Content-Length: {length}\r\n")
        run.world.keep("bounded", outcome in ("body-too-large", "unknown", "no-json"), f"length {length}: {outcome}")
        browser.hang_up()
    if run.random.random() < 0.2:
        big = b"%x\r\n" % (1 << 16) + b" " * (1 << 16) + b"\r\n"
        headers = "Transfer-Encoding: chunked\r\nContent-Length-Not: 0\r\n"
        outcome, _ = await browser.fetch("POST", "/api/class/check-code", big * 17 + b"0\r\n\r\n", headers)
        run.world.keep("bounded", outcome in ("body-too-large", "unknown"), f"1.1 MB in pieces: {outcome}")
        browser.hang_up()


async def no_other_way(run: "Lesson") -> None:
    """No other method, and no other spelling of an address, leads to what is the teacher's."""
    who = run.random.choice([run.new_browser(), *(pupil.browser for pupil in run.pupils)])
    paths = ("/api/teacher/freeze", "/api/teacher/work.zip", "/api/teacher/report.html", "/api/teacher/stream")
    path = run.random.choice((*paths, "/api//teacher/freeze", "/api/teacher/../teacher/freeze", "/api/teacher%2Ffreeze"))
    method = run.random.choice(("GET", "POST", "PUT", "DELETE", "HEAD"))
    outcome, _ = await who.fetch(method, path, b"{}" if method == "POST" else b"")
    run.world.keep("teacher-only", who.status in (401, 404, 405), f"{method} {path} ends in {who.status} {outcome}")


# Floods and rates.


async def flood(run: "Lesson") -> None:
    """One sends requests without end, and is refused; all others notice nothing."""
    pupil = run.draw(run.pupils)
    who = pupil.browser if pupil and run.random.random() < 0.6 else run.new_browser()
    request = "projects/place" if pupil and who is pupil.browser else "class/about"
    await asyncio.sleep(2.1)
    outcomes = [(await run.ask(who, request))[0] for _ in range(60)]
    done = outcomes.count(DONE)
    run.world.keep("bounded", 40 <= done <= 44 and outcomes[-1] == "requests-too-fast", f"{done} of 60 are answered")
    others = [each.browser for each in run.pupils if each is not pupil]
    for other in [run.teacher, run.new_browser(), *others[:1]]:
        await run.expect("nobody-waits", other, "class/about", DONE)
    await asyncio.sleep(2.1)
    await run.expect("nobody-waits", who, request, DONE)


async def guess_without_end(run: "Lesson") -> None:
    """An address that has guessed too often has to wait, also with what is right; nobody else has."""
    browser = run.new_browser()
    wrong = (
        ("class/check-code", "wrong-class-code", {"code": "AAAAAA" if run.code != "AAAAAA" else "CCCCCC"}),
        ("teacher/sign-in", "wrong-password", {"password": "xxxxxxxx"}),
        ("teacher/first-password", "wrong-first-key", {"key": "x", "password": "xxxxxxxx"}),
        ("class/return", "wrong-number", {"code": run.code, "name": "Nobody", "number": "0000"}),
    )
    for number in range(_ADDRESS_TRIES[0]):
        # Of one name ten wrong numbers are allowed.
        request, code, message = wrong[number % 4 if number < 36 else number % 3]
        await run.expect("wrong-guess", browser, request, code, **message)
        if number % 30 == 29:
            await asyncio.sleep(2.1)
    for request, message in (
        ("class/check-code", {"code": run.code}),
        ("teacher/sign-in", {"password": PASSWORD}),
        ("class/join", {"code": run.code, "name": "Eva", "avatar": AVATAR}),
    ):
        await run.expect("wrong-guess", browser, request, "too-many-attempts", **message)
    # Of the same network of IPv6 another address is no other one.
    await run.expect("nobody-waits", run.new_browser(), "class/check-code", DONE, code=run.code)
    if run.random.random() < 0.5:
        await asyncio.sleep(_ADDRESS_TRIES[1])
        await run.expect("right-guess", browser, "class/check-code", DONE, code=run.code)


async def guess_a_number(run: "Lesson") -> None:
    """Guessers at many addresses try one name: it has to wait, and who is in stays in."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    numbers_s = run.wrong_numbers_s.setdefault(pupil.alike, [])
    wrong = f"{(int(pupil.number) + 7) % 10_000:04}"
    for _ in range(_NUMBER_TRIES[0] + 1):
        wanted = "too-many-attempts" if too_many(run, numbers_s, _NUMBER_TRIES) else "wrong-number"
        if wanted == "wrong-number":
            numbers_s.append(run.world.now_s)
        await run.expect("wrong-guess", run.new_browser(), "class/return", wanted, code=run.code, name=pupil.name, number=wrong)  # noqa: E501
    await run.expect("nobody-waits", pupil.browser, "projects/list", DONE)
    if run.random.random() < 0.5:
        await asyncio.sleep(_NUMBER_TRIES[1])
        await come_back(run)


async def say_nothing(run: "Lesson") -> None:
    """Connections that say nothing, or half of something, are closed; a page that goes on keeps its own."""
    halves = (
        b"",
        b"POST /api/class/join HTTP/1.1\r\nHost: 192.168.1.5:7710\r\n",
        b"POST /api/class/check-code HTTP/1.1\r\nHost: 192.168.1.5:7710\r\nContent-Length: 99\r\n\r\n{",
    )
    address = f"10.4.0.{run.random.randrange(250)}"
    streams = []
    for half in halves:
        reader, writer = await asyncio.open_connection("server", 7710, local_addr=(address, 0))
        writer.write(half)
        streams.append((reader, writer))
    await asyncio.sleep(_REQUEST_S * 2 + 2.0)
    for (reader, writer), half in zip(streams, halves, strict=True):
        run.world.keep("bounded", reader.at_eof() or writer.is_closing(), f"a connection is kept that said {half!r}")
        writer.transport.abort()
    await run.check_pages()


async def flood_socket(run: "Lesson") -> None:
    """A page that sends without end, or pings, or opens sockets without end, loses them; the others keep theirs."""
    pupil = run.draw([each for each in run.pupils if each.page])
    if pupil is None:
        return
    kind = run.random.choice(("messages", "pings", "sockets", "nonsense"))
    if kind == "sockets":
        pages = [(await pupil.browser.open("class/stream")).follow() for _ in range(_MOST_SOCKETS + 3)]
        await asyncio.sleep(0.5)
        left = [page for page in pages if not page.has_ended]
        run.world.keep("bounded", len(left) == _MOST_SOCKETS, f"{len(left)} sockets of one pupil")
        run.world.keep("bounded", pages[-1] in left, "the newest socket gives way")
        for page in pages:
            page.close()
        # The oldest ones gave way, and that was the page's own.
        pupil.page.close()
        await asyncio.sleep(0.3)
        pupil.page = (await pupil.browser.open("class/stream")).follow()
        pupil.pages = [pupil.page]
        return
    page = (await pupil.browser.open(f"world?session={_KEY[:-2]}{pupil.id}")).follow()
    await asyncio.sleep(0.1)
    if kind == "nonsense":
        page.send(b"{", 1)
        page.send({"do": "nonsense"})
        page.send(b"\xff\xfe", 2)
        await asyncio.sleep(0.3)
        codes = page.codes()
        run.world.keep("says-why", not page.has_ended and set(codes) == {"bad-message"}, f"nonsense gives {codes}")
    else:
        count = 560 if kind == "messages" else 340
        for number in range(count):
            page.send({"do": "pause"} if kind == "messages" else b"", 1 if kind == "messages" else 9)
            if number % 50 == 49:
                await asyncio.sleep(0.01)
        await asyncio.sleep(0.5)
        run.world.keep("bounded", page.has_ended, f"a page may send {count} {kind} at once")
    page.close()
    await run.check_pages()


# Late bodies, restarts, time.


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
    chosen = run.random.sample(requests, min(3, len(requests)))
    late = [(name, await pupil.browser.begin(name, **message)) for name, message in chosen]
    teachers = None
    if run.random.random() < 0.3:
        other = run.new_browser()
        await run.expect("right-guess", other, "teacher/sign-in", DONE, password=PASSWORD)
        kept = dict(other.cookies)
        teachers = await other.begin("teacher/freeze", frozen=not run.frozen)
        await asyncio.sleep(0.05)
        await run.expect("as-asked", other, "teacher/sign-out", DONE)
        other.cookies = kept
    await asyncio.sleep(0.05)
    await out(run, pupil)
    for name, request in late:
        outcome, _ = await request.end()
        run.world.asked.add((name, f"late {outcome}"))
        run.world.keep("out-is-out", outcome != DONE, f"{name}, whose body came late, is done")
    if teachers:
        outcome, _ = await teachers.end()
        run.world.keep("out-is-out", outcome != DONE, "a teacher who has signed out freezes the class")
    run.check_folders()
    await run.check_pages()
    if run.random.random() < 0.3:
        await restart(run)


async def out(run: "Lesson", pupil: "Pupil") -> None:
    """Let a pupil be out: removed, or with the whole class."""
    from tests.faults import lesson_teacher

    if run.random.random() < 0.7:
        await lesson_teacher.remove_pupil(run, pupil)
    else:
        await lesson_teacher.end_class(run)


async def restart(run: "Lesson") -> None:
    """The server is killed and starts again; all that was answered is there."""
    run.kill(run.random.random() < 0.5)
    for browser in [*run.signed_in, *(device for pupil in run.pupils for device in pupil.devices)]:
        browser.hang_up()
    await come_up(run)


async def come_up(run: "Lesson") -> None:
    """Wait for the server, and open all pages; what need not survive it is as at the beginning."""
    await wait_for_server(run)
    run.frozen = run.stopped = False
    run.holders = dict.fromkeys(run.holders)
    run.mat, run.mat_entries, run.mat_places = "closed", [], 0
    run.tries_s.clear()
    run.wrong_numbers_s.clear()
    for pupil in run.pupils:
        pupil.hand, pupil.gifts_s, pupil.pages = False, [], []
        pupil.left_s = run.world.now_s
        if pupil.imported:
            pupil.stars = {MISSION: sorted({1, *pupil.stars.get(MISSION, ())})}
    for pair in run.pairs:
        pair.conducted = None
    await run.open_pages()


async def wait_for_server(run: "Lesson") -> None:
    """Wait until the server answers."""
    for _ in range(40):
        await asyncio.sleep(0.3)
        if (await run.new_browser().ask("class/about"))[0] == DONE:
            return
    run.world.keep("class-goes-on", False, "the server doesn't start again")


async def rot(run: "Lesson") -> None:
    """Somebody has damaged a file: the server says so and repairs nothing; whole again, all is there."""
    path, random = run.folder / RECORD, run.random
    node = run.disk.find(path)
    good = node.data
    cut, at = random.randrange(len(good) - 2), random.randrange(len(good))
    bad = random.choice((b"", good[:cut], b"\0" * len(good), good.replace(b'"pupils"', b'"Pupils"', 1)[:at], b"[]", b"{}"))
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
    await asyncio.sleep(run.random.choice((5.0, 25.0)))
    await run.check_pages()
    if pupil and pupil.page is None:
        pupil.page = (await pupil.browser.open("class/stream")).follow()
        pupil.pages = [pupil.page]


async def set_calendar(run: "Lesson") -> None:
    """Somebody sets the computer's calendar a little: no rate and no session depends on it."""
    run.wall_s += run.random.choice((-3600.0, -600.0, 600.0, 3600.0)) * (abs(run.wall_s) < 7200)
    await run.expect("right-guess", run.teacher, "teacher/progress", DONE)


async def end(run: "Lesson") -> None:
    """At the end the server starts once more, and everybody has what was answered."""
    from tests.faults import lesson_work

    await restart(run)
    for pupil in run.pupils:
        await lesson_work.check_library(run, pupil)
    for pupil in run.out[-2:]:
        await run.expect("out-is-out", pupil.browser, "projects/list", "class-session-needed")


ACTS = [
    (3.0, join),
    (0.5, check_code),
    (1.5, come_back),
    (0.2, many_devices),
    (0.8, leave),
    (0.7, about),
    (0.8, guess_password),
    (0.4, sign_out),
    (1.5, strangers_ask),
    (1.5, open_sockets),
    (1.0, other_sites),
    (0.7, bad_bodies),
    (0.7, no_other_way),
    (0.25, flood),
    (0.12, guess_without_end),
    (0.2, say_nothing),
    (0.3, flood_socket),
    (0.2, guess_a_number),
    (2.5, late_body),
    (0.6, restart),
    (0.4, rot),
    (0.8, rest),
    (0.4, set_calendar),
]
