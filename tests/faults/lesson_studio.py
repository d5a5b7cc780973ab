"""A teacher's own studio beside a lesson: who has its token gets in, under names of its own, and nobody else."""

import asyncio
from typing import TYPE_CHECKING, Any

from tests.faults import lesson_https
from tests.faults.browsers import DONE, Browser, SimulatedPage
from tests.faults.lesson_cars import SET
from tests.faults.lesson_doors import WORK
from tests.faults.loop import SimulatedLoop
from tests.faults.world import Process

from motorcade.server.running import serving
from motorcade.server.studio.app import make_app
from motorcade.server.studio.sessions import Settings

if TYPE_CHECKING:
    from tests.faults.lesson import Lesson

_HOST, _PORT = "studio", 7700
_NAME = "studio.local:7700"
_TOKEN = "a-token-that-is-long"
_COOKIE = f"motorcade_{_PORT}"
_STARTS_S = 0.5
_KEY = "0123456789abcdef" * 2
# Worlds of an address, and in all; a page that says nothing for so long is idle.
_MOST_OF_ONE, _MOST, _IDLE_S = 16, 64, 600.0
# Requests of a page, and what they end in where they are allowed.
_LIST, _CAMERA, _TIMELINE = "/api/projects/list", "/camera", f"/api/world/{_KEY}/timeline.csv"


async def studio(run: "Lesson") -> None:
    """The studio runs for a while; strangers try to get in, other sites too, and a page with the token does."""
    process = Process(run.world, "studio", 0.001)
    loop = SimulatedLoop(process, run.network)
    run.network.link(_HOST, 0.001)
    tls, trusts = run.random.choice(((None, None), lesson_https.contexts()))
    settings: Any = {"library": run.disk.path("/studio"), "page": run.disk.path("/page"), "port": _PORT}
    names = frozenset((_NAME.partition(":")[0],))

    async def serve() -> None:
        app = make_app(Settings(token=_TOKEN, names=names, clock=loop.time, **settings))
        listener: Any = run.network.listen(process, _HOST, _PORT)
        async with serving(app, Settings(clock=loop.time, **settings), listener, tls):
            await asyncio.Event().wait()

    loop.run(serve)
    run.studio_tls = trusts
    await asyncio.sleep(_STARTS_S)
    await _without_token(run)
    await _with_token(run)
    await run.random.choices((_many_worlds, _work_alone, _many_in_all), (0.3, 0.6, 0.1))[0](run)
    process.end()


def _browser(run: "Lesson", token: str | None = None, host: str = _NAME) -> Browser:
    run.studios += 1
    address = f"10.6.{run.studios // 200}.{1 + run.studios % 200}"
    browser = Browser(address=address, host=host, server=(_HOST, _PORT), tls=run.studio_tls)
    if token is not None:
        browser.cookies[_COOKIE] = token
    return browser


async def _ends(run: "Lesson", browser: Browser, path: str, wanted: str | int, headers: str = "") -> None:
    """Ask for something, which has to end in a code, or in a status."""
    method, body = ("POST", b"{}") if path.startswith(_LIST) else ("GET", b"")
    outcome, _ = await browser.fetch(method, path, body, headers)
    told = outcome if isinstance(wanted, str) else browser.status
    run.world.keep("strangers-stay-out", told == wanted, f"{path} {headers} of {browser.cookies} ends in {told}")


async def _without_token(run: "Lesson") -> None:
    """Nothing but the whole token lets in, and it is shown by a page's address, a cookie, or that of a picture."""
    wrong = (None, "", _TOKEN[:-1], _TOKEN + "x", _TOKEN.upper(), "x" * len(_TOKEN))
    for token in run.random.sample(wrong, 3):
        browser = _browser(run, token)
        for path in (_LIST, _TIMELINE, _CAMERA, f"{_CAMERA}?token={token}", f"{_LIST}?token={_TOKEN}"):
            await _ends(run, browser, path, "token-needed")
        for path, status in (("/", 401), ("/drive", 401), (f"/?token={token}", 403)):
            await _ends(run, browser, path, status)
        page = await browser.open(run.random.choice(("world?session=" + _KEY, "trials", "cars", "upload", "/drive/ws")))
        run.world.keep("strangers-stay-out", page.refused == "token-needed", f"{token!r} opens a page: {page.refused}")
        kept = browser.cookies.get(_COOKIE)
        run.world.keep("no-secrets", kept == token, f"a stranger is given {kept!r}")


async def _with_token(run: "Lesson") -> None:
    """Who opens the page with the token is in, until another browser; other sites and other names are not."""
    browser = _browser(run)
    await _ends(run, browser, f"/?token={_TOKEN}", 303)
    told = browser.head.get("location"), browser.cookies.get(_COOKIE)
    run.world.keep("no-secrets", told == ("/", _TOKEN), f"the page leads to {told}")
    run.world.keep("no-secrets", len(browser.given) == 1, f"the page gives {browser.given}")
    told = sorted(browser.attributes[_COOKIE].lower().strip().split("; "))
    known = ["httponly", "max-age=604800", "path=/", "samesite=strict", *(["secure"] if run.studio_tls else [])]
    run.world.keep("no-secrets", told == known, f"the token's cookie has {told}, not {known}")
    await _ends(run, browser, _LIST, DONE)
    await _ends(run, browser, _TIMELINE, "no-world")
    run.world.keep("guarded-pages", browser.head.get("cache-control") == "no-store", "a browser keeps an answer")
    page = (await browser.open(f"world?session={_KEY}")).follow()
    await asyncio.sleep(0.1)
    run.world.keep("as-asked", not page.has_ended, f"no world for who has the token: {page.refused}")
    page.close()
    await _ends(run, _browser(run), f"{_CAMERA}?token={_TOKEN}", "no-world")
    for host in (f"127.0.0.1:{_PORT}", "localhost", "192.168.1.9"):
        await _ends(run, _browser(run, _TOKEN, host), _LIST, DONE)
    for host in ("evil.example", "studio.local.evil.example", "studio", "studio.local:x"):
        await _ends(run, _browser(run, _TOKEN, host), _LIST, "foreign-host")
    for headers in ("Origin: http://evil.example", "Sec-Fetch-Site: same-site", "Origin: null"):
        await _ends(run, browser, _LIST, "foreign-origin", f"{headers}\r\n")


async def _open_worlds(run: "Lesson", browser: Browser, count: int, first: int = 0) -> list[SimulatedPage]:
    return [(await browser.open(f"world?session={first + number:032x}")).follow() for number in range(count)]


async def _many_worlds(run: "Lesson") -> None:
    """An address has sixteen worlds; one that is left, or isn't used for long, gives way to another."""
    browser = _browser(run, _TOKEN)
    pages = await _open_worlds(run, browser, _MOST_OF_ONE)
    refused = (await _open_worlds(run, browser, 1, 100))[0]
    await asyncio.sleep(0.2)
    told = refused.has_ended, refused.codes(), [page for page in pages if page.has_ended]
    run.world.keep("bounded", told == (True, ["too-many-sessions-of-one"], []), f"a 17th world: {told}")
    other = (await _open_worlds(run, _browser(run, _TOKEN), 1, 200))[0]
    left = run.random.random() < 0.7
    if left:
        pages.pop(3).close()
        await asyncio.sleep(0.1)
    else:
        await asyncio.sleep(_IDLE_S / 2)
        for page in pages[1:]:
            page.send({"do": "pause"})
        await asyncio.sleep(_IDLE_S / 2 + 2.0)
    newer = (await _open_worlds(run, browser, 1, 100))[0]
    await asyncio.sleep(0.2)
    ended = [place for place, page in enumerate(pages) if page.has_ended]
    told = newer.has_ended, ended, pages[0].codes()
    known = (False, [], []) if left else (False, [0], ["session-was-idle"])
    run.world.keep("bounded", told == known, f"one more world: {told}, not {known}")
    run.world.keep("bounded", not other.has_ended, "the world of another address gives way")
    for page in [*pages, newer, other]:
        page.close()


async def _many_in_all(run: "Lesson") -> None:
    """There are 64 worlds in all, whoever has them."""
    pages = []
    for number in range(_MOST // _MOST_OF_ONE):
        pages += await _open_worlds(run, _browser(run, _TOKEN), _MOST_OF_ONE, 1000 * (number + 1))
    late = (await _open_worlds(run, _browser(run, _TOKEN), 1, 9000))[0]
    await asyncio.sleep(0.3)
    told = late.has_ended, late.codes(), [page for page in pages if page.has_ended]
    run.world.keep("bounded", told == (True, ["too-many-sessions"], []), f"a 65th world: {told}")
    for page in pages:
        page.close()


async def _work_alone(run: "Lesson") -> None:
    """Who has the token has one library and all ports; a world is kept for a minute without a page."""
    browser, other = _browser(run, _TOKEN), _browser(run, _TOKEN)
    _, able = await browser.ask("capabilities")
    known = {"serial_ports": True, "downloads": True, "driving": True, "most_cars": 2000, "classroom": ""}
    run.world.keep("own-view", able == known | {"cars": "/api/cars"}, f"the studio can {able}")
    project = WORK | {"python": "# alone"}
    _, saved = await browser.ask("projects/write", name="alone", project=project)
    _, listed = await other.ask("projects/list")
    names = [(each["name"], each["versions"]) for each in listed]
    run.world.keep("answered-stays", (saved["version"], names) == (1, [("alone", 1)]), f"{saved} {names}")
    page = (await browser.open(f"world?session={_KEY}")).follow()
    page.send(SET)
    await asyncio.sleep(0.4)
    run.world.keep("as-asked", bool(page.newest("hello")), f"no world: {page.messages[-1:]}")
    await _ends(run, browser, _TIMELINE, DONE)
    page.close()
    await asyncio.sleep(55.0)
    await _ends(run, browser, _TIMELINE, DONE)
    await asyncio.sleep(8.0)
    await _ends(run, browser, _TIMELINE, "no-world")
    await browser.ask("projects/delete", name="alone")


ACTS = [(0.35, studio)]
