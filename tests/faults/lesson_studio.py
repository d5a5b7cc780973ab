"""A teacher's own studio beside a lesson: who has its token gets in, under names of its own, and nobody else."""

import asyncio
from typing import TYPE_CHECKING, Any

from tests.faults.browsers import DONE, Browser
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
# Requests of a page, and what they end in where they are allowed.
_LIST, _CAMERA, _TIMELINE = "/api/projects/list", "/camera", f"/api/world/{_KEY}/timeline.csv"


async def studio(run: "Lesson") -> None:
    """The studio runs for a while; strangers try to get in, other sites too, and a page with the token does."""
    process = Process(run.world, "studio", 0.001)
    loop = SimulatedLoop(process, run.network)
    run.network.link(_HOST, 0.001)
    settings: Any = {"library": run.disk.path("/studio"), "page": run.disk.path("/page"), "port": _PORT}
    names = frozenset((_NAME.partition(":")[0],))

    async def serve() -> None:
        app = make_app(Settings(token=_TOKEN, names=names, clock=loop.time, **settings))
        listener: Any = run.network.listen(process, _HOST, _PORT)
        async with serving(app, Settings(clock=loop.time, **settings), listener):
            await asyncio.Event().wait()

    loop.run(serve)
    await asyncio.sleep(_STARTS_S)
    await _without_token(run)
    await _with_token(run)
    process.end()


def _browser(run: "Lesson", token: str | None = None, host: str = _NAME) -> Browser:
    run.studios += 1
    browser = Browser(address=f"10.6.{run.studios // 200}.{1 + run.studios % 200}", host=host, server=(_HOST, _PORT))
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
    attributes = browser.attributes[_COOKIE].lower()
    is_kept = "httponly" in attributes and "samesite=strict" in attributes
    run.world.keep("no-secrets", is_kept, f"the token's cookie has {attributes}")
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


ACTS = [(0.5, studio)]
