"""Who must not get in: strangers, thieves of cookies, other sites, floods, and those who guess without end."""

import asyncio
import gzip
import hashlib
import json
import re
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from tests.faults import lesson_heads
from tests.faults.browsers import DONE, Browser
from tests.faults.class_room import FILES
from tests.faults.lesson_doors import ADDRESS_TRIES, AVATAR, NUMBER_TRIES, WORK, come_back, enter, too_many, tries_of
from tests.faults.pupils import PASSWORD

from motorcade.classroom.app import REQUESTS
from motorcade.classroom.folder import RECORD
from motorcade.service.requests import REQUESTS as STUDIO_REQUESTS

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson, Pupil

_KEY = "0123456789abcdef" * 2
# A request has so long; a pupil so many sockets.
_REQUEST_S, _MOST_SOCKETS = 30.0, 8
_MANY = 2000
_PIPELINED = b"POST /api/class/about HTTP/1.1\r\nHost: 192.168.1.5:7710\r\nContent-Length: 2\r\n\r\n{}"
# An address has at most 128 connections.
_MUTE = 140
# Pages and files for everybody.
PAGES = (
    *((path, "class.html") for path in ("/join", "/teacher", "/wall", "/mat", "/privacy")),
    ("/drive", "drive.html"),
    ("/assets/code-1.js", "assets/code-1.js"),
)
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
    for _ in range(14):
        outsider = random.choice(outsiders)
        request = run.in_turn(requests_of("member"))
        await run.expect("strangers-stay-out", outsider, request, "class-session-needed", **message_of(run, request))
        request = run.in_turn(requests_of("teacher"))
        who = random.choice([outsider, *(pupil.browser for pupil in run.pupils)])
        await run.expect("teacher-only", who, request, "teacher-session-needed", **message_of(run, request))
        await asyncio.sleep(0.15)


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
        browser.cookies = dict.fromkeys(run.teacher.cookies, secret)
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


async def fetch_files(run: "Lesson") -> None:
    """Strangers and those who are out get no timeline, picture or work; where a car has no camera that is said."""
    pupil = run.draw(run.pupils)
    paths = (f"/api/world/{_KEY}/timeline.csv", "/camera", "/camera/snapshot.jpg", "/api/projects/export")
    outsiders = [run.new_browser(), *(device for gone in run.out[-1:] for device in gone.devices[:1])]
    for path in paths:
        method = "POST" if path.endswith("export") else "GET"
        outcome, _ = await run.draw(outsiders).fetch(method, path)
        run.world.keep("strangers-stay-out", outcome == "class-session-needed", f"{path} ends in {outcome}")
    for outsider in outsiders:
        outcome, _ = await outsider.fetch("GET", "/api/teacher/work.zip")
        run.world.keep("teacher-only", outcome == "teacher-session-needed", f"all work is answered: {outcome}")
        await outsider.fetch("GET", "/")
        told = outsider.status, outsider.head.get("location")
        run.world.keep("strangers-stay-out", told == (303, "/join"), f"a stranger opens the page: {told}")
    who = run.draw([outsiders[0], run.teacher, *([pupil.browser] if pupil else [])])
    for path, file in (*run.random.sample(PAGES, 3), *([("/", "index.html")] if who is not outsiders[0] else [])):
        outcome, data = await who.fetch("GET", path)
        run.world.keep("as-asked", data.decode() == FILES[file], f"{path} is {outcome} {data[:60]!r}")
        lesson_heads.check_page(run, who, path)
    for method, path in (("GET", "/assets/code-1.js"), ("POST", "/api/missions")):
        asker = run.teacher if method == "POST" else who
        _, packed = await asker.fetch(method, path, b"{}" if method == "POST" else b"", "Accept-Encoding: gzip\r\n")
        kind = asker.head.get("content-encoding")
        run.world.keep("as-asked", kind == "gzip" and len(gzip.decompress(packed)) > len(packed), f"{path}: {kind}")
    for path in ("/authority.crt", "/class.json", "/../class.json", "/owners/01/draft.json"):
        outcome, _ = await who.fetch("GET", path)
        run.world.keep("strangers-stay-out", who.status == 404, f"{path} ends in {outcome}")
    if pupil:
        for path in paths[1:3] if not run.has_camera else ():
            outcome, _ = await pupil.browser.fetch("GET", f"{path}?car=red")
            run.world.keep("as-asked", outcome == "no-camera-here", f"{path} ends in {outcome}")


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
    run.world.keep("other-sites", outcome == DONE or browser.status == 303, f"a link ends in {outcome}")
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
    path = run.random.choice(
        (*paths, "/api//teacher/freeze", "/api/teacher/../teacher/freeze", "/api/teacher%2Ffreeze")
    )
    method = run.random.choice(("GET", "POST", "PUT", "DELETE", "HEAD"))
    outcome, _ = await who.fetch(method, path, b"{}" if method == "POST" else b"")
    run.world.keep("teacher-only", who.status in (401, 404, 405), f"{method} {path} ends in {who.status} {outcome}")


# Floods and rates.


async def flood(run: "Lesson") -> None:
    """One sends requests without end, and is refused; all others notice nothing."""
    pupil = run.draw(run.pupils)
    network = f"fd00:{run.random.randrange(1 << 16):x}::"
    strangers = [run.new_browser(f"{network}{number}") for number in (1, 2)]
    # Two devices of a pupil are one, and so are two addresses of a network.
    two = [pupil.browser, run.twin(pupil.browser)] if pupil and run.random.random() < 0.6 else strangers
    who, request = two[0], "class/about" if two is strangers else "projects/place"
    await asyncio.sleep(2.1)
    outcomes = [(await run.ask(two[number % 2], request))[0] for number in range(60)]
    done = outcomes.count(DONE)
    run.world.keep("bounded", 40 <= done <= 44 and outcomes[-1] == "requests-too-fast", f"{done} of 60 are answered")
    others = [each.browser for each in run.pupils if each is not pupil]
    for other in [run.teacher, run.new_browser(), run.new_browser("fd01::1"), *others[:1]]:
        await run.expect("nobody-waits", other, "class/about", DONE)
    await asyncio.sleep(2.1)
    await run.expect("nobody-waits", who, request, DONE)
    # The teacher isn't kept waiting.
    outcomes = [(await run.ask(run.teacher, "projects/place"))[0] for _ in range(60)]
    run.world.keep("nobody-waits", outcomes == [DONE] * 60, "the teacher may not ask: {}", outcomes[-1])


async def flood_by_teacher(run: "Lesson") -> None:
    """The teacher's browsers have one rate, of 500 requests a second; it is nobody else's, at whatever address."""
    other = run.new_browser(run.teacher.address or "")
    await run.expect("right-guess", other, "teacher/sign-in", DONE, password=PASSWORD)
    run.signed_in.append(other)
    await asyncio.sleep(2.1)
    statuses = [*await _statuses(run.teacher, 600), *await _statuses(other, 600)]
    done = statuses.count(404)
    is_so = 1000 <= done <= 1010 and statuses.count(429) == len(statuses) - done
    run.world.keep("bounded", is_so, f"of 1200 requests of the teacher {done} are answered")
    outsiders = [run.new_browser(run.teacher.address or ""), *(pupil.browser for pupil in run.pupils[:1])]
    for outsider in outsiders:
        await run.expect("nobody-waits", outsider, "class/about", DONE)
    await asyncio.sleep(2.1)
    await run.expect("nobody-waits", run.teacher, "teacher/progress", DONE)


async def _statuses(browser: Browser, count: int) -> list[int]:
    """Send the same request so often at once, and return the statuses of the answers."""
    reader, writer = await browser.stream("/api/teacher/nothing", "POST", count)
    found, data = [], b""
    with suppress(OSError):
        while len(found) < count and (more := await reader.read(1 << 16)):
            data += more
            found = re.findall(rb"HTTP/1\.1 ([0-9]{3}) ", data)
    writer.transport.abort()
    return [int(status) for status in found]


async def guess_without_end(run: "Lesson") -> None:
    """An address that has guessed too often has to wait, also with what is right; nobody else has."""
    browser = run.new_browser()
    wrong = (
        ("class/check-code", "wrong-class-code", {"code": "AAAAAA" if run.code != "AAAAAA" else "CCCCCC"}),
        ("teacher/sign-in", "wrong-password", {"password": "xxxxxxxx"}),
        ("teacher/first-password", "wrong-first-key", {"key": "x", "password": "xxxxxxxx"}),
        ("class/return", "wrong-number", {"code": run.code, "name": f"Nobody {browser.address}", "number": "0000"}),
    )
    for number in range(ADDRESS_TRIES[0]):
        if number in (7, 17) and run.is_open:
            # Who joins has tried, too: no address fills the class.
            await enter(run, f"G{run.joined}", f"g{run.joined}", shows=False, address=browser.address or "")
            continue
        # Of one name ten wrong numbers are allowed.
        request, code, message = wrong[number % 4 if number < 36 else number % 3]
        await run.expect("wrong-guess", browser, request, code, **message)
        tries_of(run, browser).append(run.world.now_s)
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
        await asyncio.sleep(ADDRESS_TRIES[1])
        await run.expect("right-guess", browser, "class/check-code", DONE, code=run.code)


async def guess_a_number(run: "Lesson") -> None:
    """Guessers at many addresses try one name: it has to wait, and who is in stays in."""
    pupil = run.draw(run.pupils)
    if pupil is None:
        return
    numbers_s = run.wrong_numbers_s.setdefault(pupil.alike, [])
    wrong = f"{(int(pupil.number) + 7) % 10_000:04}"
    for _ in range(NUMBER_TRIES[0] + 1):
        wanted = "too-many-attempts" if too_many(run, numbers_s, NUMBER_TRIES) else "wrong-number"
        if wanted == "wrong-number":
            numbers_s.append(run.world.now_s)
        await run.expect(
            "wrong-guess", run.new_browser(), "class/return", wanted, code=run.code, name=pupil.name, number=wrong
        )
    await run.expect("nobody-waits", pupil.browser, "projects/list", DONE)
    if run.random.random() < 0.5:
        await asyncio.sleep(NUMBER_TRIES[1])
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
    # One asks without end, and takes no answer.
    mute = (await asyncio.open_connection("server", 7710, local_addr=(address, 0)))[1]
    mute.transport.pause_reading()  # type: ignore[attr-defined]
    mute.write(_PIPELINED * _MANY)
    # Two send a long body, a letter at a time, and in pieces that a slow line carries.
    letters = (await asyncio.open_connection("server", 7710, local_addr=(address, 0)))[1]
    letters.write(halves[1] + b"Content-Length: 9000\r\n\r\n")
    slow = await asyncio.open_connection("server", 7710, local_addr=(address, 0))
    slow[1].write(halves[1] + b"Content-Length: 90000\r\n\r\n")
    await asyncio.sleep(1.0)
    run.world.keep("bounded", run.is_connected(mute), "a connection is closed at once")
    for _ in range(int(_REQUEST_S) + 1):
        letters.write(b"x")
        slow[1].write(b"x" * 1400)
        await asyncio.sleep(2.0)
    kept = run.is_connected(letters), run.is_connected(slow[1])
    run.world.keep("bounded", kept == (False, True), f"of slow bodies, of letters and of pieces, these stay: {kept}")
    slow[1].transport.abort()
    run.world.keep("bounded", not run.is_connected(mute), "a connection is kept that takes nothing")
    mute.transport.abort()
    for (reader, writer), half in zip(streams, halves, strict=True):
        run.world.keep("bounded", reader.at_eof() or writer.is_closing(), f"a connection is kept that said {half!r}")
        writer.transport.abort()
    await run.check_pages()


async def flood_connections(run: "Lesson") -> None:
    """Mute connections of one address, or of many: each has its bound, and nobody else is shut out."""
    addresses = [f"10.5.0.{number}" for number in range(run.random.choice((1, 1, 1, 5)))]
    writers = []
    for address in addresses * _MUTE:
        with suppress(OSError):
            writers.append((await asyncio.open_connection("server", 7710, local_addr=(address, 0)))[1])
    for each in [run.new_browser(), run.teacher, *(pupil.browser for pupil in run.pupils[:1])]:
        await run.expect("nobody-waits", each, "class/about", DONE)
    await run.check_pages()
    for writer in writers:
        writer.transport.abort()


async def flood_socket(run: "Lesson") -> None:
    """A page that sends without end, or pings, or opens sockets without end, loses them; the others keep theirs."""
    pupil = run.draw([each for each in run.pupils if each.page])
    if pupil is None:
        return
    for kind in run.random.sample(("messages", "pings", "sockets", "nonsense"), 2):
        await _flood_by(run, pupil, kind)


async def _flood_by(run: "Lesson", pupil: "Pupil", kind: str) -> None:
    if kind == "sockets":
        pages = [(await pupil.browser.open("class/stream")).follow() for _ in range(_MOST_SOCKETS + 3)]
        await asyncio.sleep(0.5)
        left = [page for page in pages if not page.has_ended]
        stay = [number for number, page in enumerate(pages) if page in left]
        run.world.keep("bounded", left == pages[-_MOST_SOCKETS:], f"of {len(pages)} sockets of one {stay} stay")
        for page in pages:
            page.close()
        # The oldest ones gave way, and that was the page's own.
        if pupil.page:
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


async def come_and_go(run: "Lesson") -> None:
    """A pupil's pages come and go, more often than there are places: none is used up, and a page that stays does."""
    pupil = run.draw([each for each in run.pupils if each.page and not each.page.has_ended])
    if pupil is None:
        return
    paths = ["trials", "upload", "serial", "/drive/ws", f"world?session={_KEY[:-2]}{pupil.id}"]
    paths = [run.random.choice(paths)] * _MOST_SOCKETS if run.random.random() < 0.5 else paths * 2
    for path in paths:
        page = (await pupil.browser.open(path)).follow()
        await asyncio.sleep(0.05)
        run.world.keep("page-stays", not page.has_ended, "{} of {} is hung up", path, pupil.name)
        page.close()
        await asyncio.sleep(0.05)
    await run.check_pages()


ACTS = [
    (0.5, come_and_go),
    (1.5, strangers_ask),
    (1.5, open_sockets),
    (0.6, fetch_files),
    (1.0, other_sites),
    (0.7, bad_bodies),
    (0.7, no_other_way),
    (0.3, flood),
    (0.06, flood_by_teacher),
    (0.12, guess_without_end),
    (0.2, say_nothing),
    (0.15, flood_connections),
    (0.5, flood_socket),
    (0.2, guess_a_number),
]
