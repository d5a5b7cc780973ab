"""Firefox and WebKitGTK as Debian has them; Playwright can drive only browsers that it brings itself.

Firefox speaks WebDriver BiDi by itself, without a window. WebKit has a driver, which speaks WebDriver over HTTP, and
needs a screen: Xvfb's. Both take scripts, and the same actions of pointers and keys, so that a walk is written once.
"""

import itertools
import json
import os
import subprocess
from base64 import b64decode
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

import httpx2
import psutil
from scripts import debian
from websockets.sync.client import ClientConnection, connect

from support.browser_profiles import FEW_PICTURES
from support.waiting import DEADLINE_S, wait_until

# Long enough for a machine that is busy with other tests.
_MINI_BROWSER = "/usr/lib/*/webkit2gtk-4.*/MiniBrowser"
# What a user finds by role and name: `named(selector, name)` lists the elements that are to be seen.
_NAMED = """
const labelOf = (e) => (e.getAttribute("aria-label")
    ?? e.getAttribute("aria-labelledby")?.split(" ").map((id) => document.getElementById(id)?.textContent).join(" ")
    ?? (e.labels?.[0] ?? e).textContent).trim();
const named = (selector, name) => [...document.querySelectorAll(selector)]
    .filter((e) => e.checkVisibility() && (name == null || labelOf(e).includes(name)))
    .sort((a, b) => (labelOf(b) === name) - (labelOf(a) === name));
"""
# What Firefox tells of a page that is left while it loads.
_LEFT = ("error loading dynamically imported module", "AbortError: The operation was aborted")
_SILENT: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
# WebKit's driver doesn't tell what a page writes on its console.
_LISTEN = """
self.faults = [];
const { error } = console;
console.error = (...told) => { self.faults.push(told.join(" ")); error(...told); };
// What is observed again with the next picture is no fault.
addEventListener("error", ({ message }) => message.startsWith("ResizeObserver loop") || self.faults.push(message));
addEventListener("unhandledrejection", (event) => self.faults.push(`${event.reason}`));
"""


class EnginePage:
    """A page in one of the engines, in a browser profile of its own. ``faults`` are the errors on its console."""

    has_touch = False

    def __init__(self) -> None:
        self.faults: list[str] = []

    # What each engine does in its own way.

    def go(self, url: str) -> None:
        """Open an address, and wait until it is loaded."""
        raise NotImplementedError

    def resize(self, width: int, height: int) -> None:
        """Give the page this size, in CSS pixels."""
        raise NotImplementedError

    def evaluate(self, body: str, *arguments: Any) -> Any:
        """What ``body``, the statements of an asynchronous function of the list ``a``, returns, as JSON."""
        raise NotImplementedError

    def perform(self, *sources: dict[str, Any]) -> None:
        """Do WebDriver's actions, of one source of input or several."""
        raise NotImplementedError

    def picture(self) -> bytes:
        """What the page shows, as PNG."""
        raise NotImplementedError

    # What a user does.

    def wait_for(self, condition: str, *arguments: Any) -> Any:
        """Wait until a script returns something that is true, and return it."""
        return wait_until(lambda: self.evaluate(_NAMED + condition, *arguments), deadline_s=DEADLINE_S)

    def box(self, selector: str, name: str | None = None, number: int = 0) -> tuple[float, float, float, float]:
        """Left, top, width and height of such an element once it is to be seen and rests; -1 is the last of them."""
        found = self.wait_for(
            """const e = named(a[0], a[1]).at(a[2]);
            e?.scrollIntoView({ block: "nearest", inline: "nearest" });
            const box = () => { const b = e.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; };
            const before = e && box();
            await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
            return e && String(box()) === String(before) && before[2] ? before : null;""",
            selector,
            name,
            number,
        )
        return tuple(found)

    def click(self, selector: str, name: str | None = None, number: int = 0, by: str = "mouse") -> None:
        """Press the middle of an element with a mouse or a finger (``touch``)."""
        left, top, width, height = self.box(selector, name, number)
        self.drag([(left + width / 2, top + height / 2)], by=by)

    def drag(self, way: list[tuple[float, float]], *, by: str = "mouse") -> None:
        """Press at the first point, move along the way, and let go at its end; with ``mouse`` or ``touch``."""
        move = [{"type": "pointerMove", "x": round(x), "y": round(y), "duration": 30} for x, y in way]
        actions = [move[0], {"type": "pointerDown", "button": 0}, *move[1:], {"type": "pointerUp", "button": 0}]
        self.perform({"type": "pointer", "id": by, "parameters": {"pointerType": by}, "actions": actions})

    def store(self, kept: dict[str, str]) -> None:
        """Write these values into the storage of the site that is open."""
        self.evaluate("Object.assign(localStorage, a[0])", kept)

    def press(self, *keys: str) -> None:
        """Press and release keys: characters, or WebDriver's codes of other keys."""
        for key in keys:
            self.hold(key)
            self.release(key)

    def hold(self, key: str) -> None:
        """Press a key."""
        self.perform({"type": "key", "id": "keyboard", "actions": [{"type": "keyDown", "value": key}]})

    def release(self, key: str) -> None:
        """Let go of a key."""
        self.perform({"type": "key", "id": "keyboard", "actions": [{"type": "keyUp", "value": key}]})

    def expect(self, selector: str, name: str | None = None) -> None:
        """Wait until such an element is to be seen."""
        self.wait_for("return named(a[0], a[1]).length > 0", selector, name)


class Firefox(EnginePage):
    """Firefox without a window."""

    has_touch = True

    def __init__(self, socket: ClientConnection) -> None:
        super().__init__()
        self._socket = socket
        self._numbers = itertools.count(1)
        self._send("session.new", capabilities={})
        self._send("session.subscribe", events=["log.entryAdded"])
        # The tab that it opens itself may not leave its first page.
        self._page = self._send("browsingContext.create", type="tab")["context"]
        self._send("browsingContext.activate", context=self._page)

    def _send(self, method: str, **parameters: Any) -> Any:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            told = json.loads(self._socket.recv(DEADLINE_S))
            if told.get("method") == "log.entryAdded" and told["params"]["level"] == "error":
                text = told["params"]["text"]
                if not any(each in text for each in _LEFT):
                    self.faults.append(text)
            if told.get("id") != number:
                continue
            if "error" in told:
                raise RuntimeError(f"{method}: {told['message']}")
            return told["result"]

    def go(self, url: str) -> None:
        self._send("browsingContext.navigate", context=self._page, url=url, wait="complete")

    def resize(self, width: int, height: int) -> None:
        self._send("browsingContext.setViewport", context=self._page, viewport={"width": width, "height": height})

    def evaluate(self, body: str, *arguments: Any) -> Any:
        told = self._send(
            "script.evaluate",
            expression=f"(async (a) => {{ {body} }})({json.dumps(arguments)}).then((v) => JSON.stringify(v ?? null))",
            target={"context": self._page},
            awaitPromise=True,
        )
        if told["type"] == "exception":
            raise RuntimeError(told["exceptionDetails"]["text"])
        return json.loads(told["result"]["value"])

    def perform(self, *sources: dict[str, Any]) -> None:
        self._send("input.performActions", context=self._page, actions=sources)

    def picture(self) -> bytes:
        return b64decode(self._send("browsingContext.captureScreenshot", context=self._page)["data"])


class WebKit(EnginePage):
    """WebKitGTK's small browser, in a window. Its driver takes a finger for a mouse."""

    def __init__(self, address: str) -> None:
        super().__init__()
        self._http = httpx2.Client(base_url=address, timeout=DEADLINE_S, trust_env=False)
        (browser,) = Path("/").glob(_MINI_BROWSER[1:])
        options = {"webkitgtk:browserOptions": {"binary": str(browser), "args": ["--automation"]}}
        session = self._send("/session", capabilities={"alwaysMatch": options})["sessionId"]
        self._session = f"/session/{session}"
        self._send(f"{self._session}/timeouts", script=int(DEADLINE_S * 1000))

    def _send(self, path: str, **body: Any) -> Any:
        told = self._http.post(path, json=body).json()["value"]
        if isinstance(told, dict) and "error" in told:
            raise RuntimeError(f"{path}: {told['message'] or told['error']}")
        return told

    def go(self, url: str) -> None:
        self.gather()
        self._send(f"{self._session}/url", url=url)
        self.evaluate(_LISTEN)
        # Without a graphics processor its pictures are most of its work.
        self.evaluate(FEW_PICTURES)

    def resize(self, width: int, height: int) -> None:
        frame = self.evaluate("return [outerWidth - innerWidth, outerHeight - innerHeight]")
        self._send(f"{self._session}/window/rect", width=width + frame[0], height=height + frame[1])

    def evaluate(self, body: str, *arguments: Any) -> Any:
        script = f"""const [a, done] = arguments;
            (async () => {{ {body} }})()
                .then((v) => JSON.stringify({{ v }}))
                .then(done, (e) => done(JSON.stringify({{ e: `${{e}}` }})));"""
        told = json.loads(self._send(f"{self._session}/execute/async", script=script, args=[arguments]))
        if "e" in told:
            raise RuntimeError(told["e"])
        return told.get("v")

    def perform(self, *sources: dict[str, Any]) -> None:
        self._send(f"{self._session}/actions", actions=sources)

    def gather(self) -> None:
        """Take the faults of the page that is about to be left."""
        self.faults += self.evaluate("return self.faults ?? []")

    def close(self) -> None:
        """End the browser."""
        self.gather()
        self._http.delete(self._session)
        self._http.close()

    def picture(self) -> bytes:
        return b64decode(self._http.get(f"{self._session}/screenshot").json()["value"])


@contextmanager
def _process(command: list[str], **options: Any) -> Iterator[subprocess.Popen]:
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, **options) as process:
        try:
            yield process
        finally:
            process.terminate()


@contextmanager
def firefox(folder: Path) -> Iterator[Firefox]:
    """A Firefox with its profile in the empty ``folder``."""
    port = folder / "WebDriverBiDiServer.json"
    command = ["firefox-esr", "--headless", "--no-remote", "--profile", str(folder), "--remote-debugging-port", "0"]
    with _process(command, **_SILENT) as process:
        text = wait_until(lambda: port.exists() and port.read_text(), process)
        told = json.loads(text)
        address = f"ws://{told['ws_host']}:{told['ws_port']}/session"
        with connect(address, max_size=None, proxy=None) as socket:
            yield Firefox(socket)


@contextmanager
def webkit(folder: Path) -> Iterator[WebKit]:
    """A WebKitGTK with a screen of its own; it keeps what it stores in ``folder``."""
    with ExitStack() as stack:
        reader, writer = os.pipe()
        screen = ["Xvfb", "-displayfd", str(writer), "-screen", "0", "1600x1200x24", "-nolisten", "tcp"]
        stack.enter_context(_process(screen, pass_fds=[writer], stderr=subprocess.DEVNULL))
        os.close(writer)
        with os.fdopen(reader) as display:
            environment = {**os.environ, "DISPLAY": f":{display.readline().strip()}", "HOME": str(folder)}
        driver = stack.enter_context(_process(["WebKitWebDriver", "-p", "0"], env=environment, **_SILENT))
        # It doesn't tell which port it got.
        (place,) = wait_until(
            lambda: [
                c.laddr for c in psutil.Process(driver.pid).net_connections("inet4") if c.status == psutil.CONN_LISTEN
            ],
            driver,
        )
        yield stack.enter_context(closing(WebKit(f"http://{place.ip}:{place.port}")))


# By the engine's name: its command, Debian's packages, and what starts it.
ENGINES: dict[str, tuple[str, tuple[str, ...], Callable[[Path], AbstractContextManager[EnginePage]]]] = {
    "firefox": ("firefox-esr", ("firefox-esr", debian.CHINESE), firefox),
    "webkit": ("WebKitWebDriver", debian.FOR_TESTS["WebKitWebDriver"], webkit),
}
