"""The studio's page as a user finds it: its parts by role and name, and what a user does with them."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import Browser, BrowserContext, CDPSession, FloatRect, Locator, Page, Route, expect
from scripts.studio_process import project_link

from motorcade.locales import catalogue
from support.browser_profiles import Profiles, Watched, storing
from support.waiting import wait_until

DESKTOP, PHONE = (1400, 900), (390, 844)
SHARED = "Shared"
# Long enough for a machine that is slow and busy with other tests.
PATIENCE_MS = 60_000
# The first page of each process waits for the server's processes too, while all the others begin.
FIRST_MS = 2 * PATIENCE_MS
expect.set_options(timeout=PATIENCE_MS)


class StudioPage(Watched):
    """A page in a browser profile."""

    def __init__(
        self,
        context: BrowserContext,
        url: str,
        language: str,
        size: tuple[int, int] = DESKTOP,
        script: str = "",
        touches: bool = False,
    ) -> None:
        super().__init__(context, url)
        self.url = url
        self._size, self._script, self._touches = size, script, touches
        self._crashed = False
        self._taken = 0
        self._finger: CDPSession | None = None
        self._texts = catalogue(language)["page"]
        context.set_default_timeout(PATIENCE_MS)
        self.page = self._new_page()

    @classmethod
    def open(
        cls,
        browser: Browser | Profiles,
        url: str,
        *,
        project: dict[str, Any] | None = None,
        language: str | None = "en",
        theme: str = "light",
        size: tuple[int, int] = DESKTOP,
        tour: bool = False,
        plain: bool = False,
        level: str = "words",
        build: Path | None = None,
        script: str = "",
        **options: Any,
    ) -> "StudioPage":
        """Open the page, at first with a project that somebody shared; without the tour, as if it had been seen before.

        Args:
            browser: gives this visit a profile.
            url: the studio's address.
            project: opened by a link; None for a new project.
            language: as if it had been chosen before; None for what the browser prefers.
            theme: as if it had been chosen before.
            size: width and height of the window in pixels.
            tour: show the tour of a first visit.
            plain: leave the page's areas as a first visit finds them; else both editors and the words show at once
                where there is room.
            level: of the page, as if it had been chosen before.
            build: a folder with another build of the page, shown in place of the studio's own.
            script: runs in each page before its own.
            options: more of Playwright's options for a browser profile.
        """
        settings: dict[str, Any] = {"theme": theme, "toured": not tour, "level": level}
        if not plain and size[0] > PHONE[0]:
            settings |= {"shares": {"blocks": 0.65}, "drawer": {"tab": "words", "open": True}}
        kept = {"motorcade.settings": json.dumps(settings)}
        if language:
            kept["motorcade.language"] = language
        base, _, token = url.partition("?token=")
        context = browser.new_context(
            viewport={"width": size[0], "height": size[1]},
            storage_state=storing(base, kept),
            # It would store the whole site in each profile.
            service_workers="block",
            **options,
        )
        if token:
            cookie = f"motorcade_{base.rstrip('/').rpartition(':')[2]}"
            context.add_cookies([{"name": cookie, "value": token, "url": base}])
        if build:
            context.route(f"{base}**", lambda route: _answer_from(build, route))
        studio = cls(context, base, language or "en", size, script, bool(options.get("has_touch")))
        studio.page.goto(project_link(base, project, SHARED) if project else base)
        studio.wait_until_ready()
        if project:
            studio._expect_shared(SHARED)
        return studio

    def leave(self, profiles: Profiles) -> None:
        """End the visit; the next one gets its profile, unless a page of it crashed."""
        if self._crashed:
            self.context.close()
            return
        self.look_away()
        profiles.take_back(self.context)

    def reopen(self) -> None:
        """Open another page in the same browser, as after a crash."""
        self.page = self._new_page()
        self.page.goto(self.url)
        self.wait_until_ready()

    def _new_page(self) -> Page:
        page = self.context.new_page()
        page.set_viewport_size({"width": self._size[0], "height": self._size[1]})
        if self._script:
            page.add_init_script(self._script)
        page.on("websocket", lambda socket: self._check_url(socket.url))
        page.on("crash", self._hear_crash)
        return page

    def _hear_crash(self, _: Page) -> None:
        self._crashed = True

    def wait_until_ready(self) -> None:
        """Wait for blocks, words and cars, whether or not the words show."""
        expect(self.page.locator("main[data-compiled]")).to_be_attached(timeout=FIRST_MS)
        expect(self.page.locator("#mat-play")).to_be_enabled(timeout=PATIENCE_MS)
        expect(self.page.locator("#stage canvas").first).to_be_attached()

    def take(self, project: dict[str, Any]) -> None:
        """Open another project in the same page, by a link."""
        self._taken += 1
        name = f"{SHARED} {self._taken}"
        unsaved = self.page.get_by_text(self.say("project.unsaved"), exact=True).is_visible()
        self.page.evaluate("link => { location.hash = new URL(link).hash }", project_link(self.url, project, name))
        if unsaved:
            self.page.get_by_role("alertdialog").get_by_role("button", name=self.say("project.replaceYes")).click()
        self._expect_shared(name)

    def _expect_shared(self, name: str) -> None:
        expect(self.name).to_have_value(name)
        expect(self.page.get_by_text(self.say("project.unsaved"), exact=True)).to_be_attached()

    def say(self, key: str, **values: object) -> str:
        """The page's text for a key, in its language; with a ``count``, in the form of that number."""
        *path, last = key.split(".")
        texts = self._texts
        for part in path:
            texts = texts[part]
        forms = (last, *([f"{last}_one"] if values.get("count") == 1 else []), f"{last}_other")
        text = next(texts[form] for form in forms if form in texts)
        return re.sub(r"\{\{(\w+)\}\}", lambda found: str(values[found[1]]), text)

    # The editors.

    def editor(self, name: str) -> Locator:
        """The leader's or the followers'."""
        return self.page.get_by_role("region", name=self.say(f"editors.{name}"), exact=True)

    def program_followers(self) -> None:
        self.page.get_by_role("radio", name=self.say("editors.followers"), exact=True).click()
        expect(self.editor("followers")).to_be_visible()

    def block(self, editor: str, text: str) -> Locator:
        """The lowest block that contains this text."""
        blocks = self.page.get_by_role("region", name=self.say(f"editors.{editor}Blocks"), exact=True)
        return blocks.locator(".blocklyDraggable").filter(has_text=text).last

    def hat(self, editor: str) -> Locator:
        """The first block of a program, while it has no other blocks."""
        return self.block(editor, self.say(f"blocks.{editor}").partition("\n")[0])

    def field(self, block: Locator, value: str) -> Locator:
        """A block's own field that contains this text."""
        return block.locator(':scope > [role="button"]').filter(has_text=value)

    def drag_out(self, editor: str, drawer: str, block: str, *, below: Locator) -> None:
        """Drag a block out of a drawer and drop it below another; with a finger, where the profile has touch."""
        height = self._take_out(editor, drawer, block)
        place = self.box(below)
        self._drop(place["x"] + 12, place["y"] + place["height"] + height / 2)

    def drag_into(self, drawer: str, block: str, holder: Locator, row: int | None = None) -> None:
        """Drag a block out of a drawer into the leader's ``holder``: its first gap, or one of its rows.

        Args:
            row: counts the rows from 0; each is 48 px high while it is empty. None: a condition, for the gap.
        """
        height = self._take_out("leader", drawer, block)
        if row is None:
            gap = self.box(holder.locator(":scope > .blocklyOutlinePath").first)
            self._drop(gap["x"] + 10, gap["y"] + gap["height"] / 2)
        else:
            outline = self.box(holder.locator(":scope > .blocklyPath").first)
            self._drop(outline["x"] + 30, outline["y"] + 56 + 80 * row + height / 2)

    def drag_onto_stage(self, button: Locator, x: float, y: float) -> None:
        """Drag a thing of the palette onto the stage, to a point as shares of its width and height."""
        taken, stage = self.box(button), self.box(self.stage)
        self._hold(taken["x"] + taken["width"] / 2, taken["y"] + taken["height"] / 2)
        self._drop(stage["x"] + x * stage["width"], stage["y"] + y * stage["height"])

    def stroke(self, points: Sequence[tuple[float, float]]) -> None:
        """Draw over the page from point to point; with a finger, where the profile has touch."""
        mouse = self.page.mouse
        first, *others = points
        if self._touches:
            self._touch("touchStart", *first)
            for place in others:
                self._touch("touchMove", *place)
            self._touch("touchEnd")
            return
        mouse.move(*first)
        mouse.down()
        for place in others:
            mouse.move(*place)
        mouse.up()

    def press(self, thing: Locator, **more: Any) -> None:
        """Click something, or tap it where the profile has touch."""
        (thing.tap if self._touches else thing.click)(**more)

    def _take_out(self, editor: str, drawer: str, block: str) -> float:
        """Take hold of a block in a drawer; return the block's height."""
        self.press(self.editor(editor).get_by_role("treeitem", name=self.say(f"drawers.{drawer}"), exact=True))
        option = self.editor(editor).get_by_role("option", name=block).first
        taken, editors = self.box(option), self.box(self.editor(editor))
        if (hidden := taken["y"] + taken["height"] - editors["y"] - editors["height"]) > 0:
            # A drawer of many blocks.
            self._scroll_drawer(editor, hidden + taken["height"])
            wait_until(lambda: self.box(option)["y"] < taken["y"] - hidden)
            taken = self.box(option)
        self._hold(taken["x"] + 12, taken["y"] + taken["height"] / 2)
        return taken["height"]

    def _scroll_drawer(self, editor: str, distance: float) -> None:
        drawer = self.box(self.editor(editor).locator(".blocklyFlyoutBackground").filter(visible=True))
        # A finger may begin on a block; a wheel turns between the blocks and the scrollbar.
        x, y = drawer["x"] + (40 if self._touches else drawer["width"] - 24), drawer["y"] + drawer["height"] * 0.9
        if not self._touches:
            self.page.mouse.move(x, y)
            self.page.mouse.wheel(0, distance)
            return
        self._touch("touchStart", x, y)
        for step in range(1, 9):
            self._touch("touchMove", x, y - distance * step / 8)
        self._touch("touchEnd")

    def _hold(self, x: float, y: float) -> None:
        if self._touches:
            self._touch("touchStart", x, y)
            self._touch("touchMove", x + 40, y + 10)
        else:
            self.page.mouse.move(x, y)
            self.page.mouse.down()

    def _drop(self, x: float, y: float) -> None:
        if self._touches:
            for aside in (30, 5, 0):
                self._touch("touchMove", x + aside, y + aside)
            self._touch("touchEnd")
        else:
            self.page.mouse.move(x + 30, y + 30, steps=4)
            self.page.mouse.move(x, y, steps=4)
            self.page.mouse.up()

    def _touch(self, kind: str, *place: float) -> None:
        if self._finger is None:
            self._finger = self.context.new_cdp_session(self.page)
        points = [{"x": place[0], "y": place[1]}] if place else []
        self._finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def box(self, thing: Locator) -> FloatRect:
        """The box of an element once it is in view."""
        thing.scroll_into_view_if_needed()
        box = thing.bounding_box()
        assert box
        return box

    def pick(self, field: Locator, option: str) -> None:
        """Choose an option of a field with a list."""
        self.press(field)
        self.press(self.page.get_by_role("option", name=option))

    def type_into(self, field: Locator, text: str) -> None:
        """Enter a number or text in a field."""
        self.press(field)
        self.page.keyboard.type(text)
        self.page.keyboard.press("Enter")

    def undo(self) -> None:
        self.page.get_by_role("button", name=self.say("history.undo"), exact=True).click()

    # The drawer and its words.

    def look_up(self, panel: str) -> None:
        """Open the drawer at one of its panels."""
        # The tab of an open panel closes it, so the page has to be there before it is asked whether it is open.
        self.page.locator("#drawer").wait_for()
        tab = self.page.get_by_role("tab", name=self.say(f"drawer.{panel}"), exact=True)
        if not self.page.locator("#drawer[data-open]").count() or tab.get_attribute("aria-selected") != "true":
            tab.click()
        expect(self.page.get_by_role("tabpanel", name=self.say(f"drawer.{panel}"), exact=True)).to_be_visible()

    @property
    def words_table(self) -> Locator:
        return self.page.get_by_role("grid", name=self.say("words.table"))

    def expect_words(self, words: list[str]) -> None:
        """Wait until the table shows exactly these words, in hexadecimal, as `motorcade compile` prints them."""
        self.look_up("words")
        expect(self.words_table.get_by_role("rowheader")).to_contain_text([word.upper() for word in words])

    @property
    def diagnostics(self) -> Locator:
        return self.page.get_by_role("list", name=self.say("words.diagnostics")).get_by_role("listitem")

    # The stage.

    @property
    def stage(self) -> Locator:
        return self.page.get_by_role("application", name=self.say("mat.canvas"))

    def mat_button(self, key: str) -> Locator:
        return self.page.get_by_role("button", name=self.say(f"mat.{key}"), exact=True)

    def play(self) -> None:
        self.mat_button("play").click()

    def run_at(self, speed: str) -> None:
        """Let the time of the world pass so many times as fast, as the list of speeds names it; by keyboard."""
        transport = self.page.get_by_role("group", name=self.say("mat.transport"))
        transport.get_by_role("button", name=self.say("mat.speed")).press("Enter")
        self.page.get_by_role("option", name=speed, exact=True).press("Enter")

    @property
    def clock(self) -> Locator:
        return self.page.get_by_role("status", name=self.say("mat.time"))

    def expect_moving(self) -> None:
        """Wait until the world's time changes."""
        expect(self.clock).not_to_have_text(self.clock.inner_text())

    def choose_car(self, number: int) -> None:
        """Show a car's details in the drawer."""
        self.look_up("things")
        field = self.page.get_by_role("textbox", name=self.say("mat.carNumber"), exact=True)
        field.fill(str(number))
        field.press("Enter")
        expect(self.page.get_by_role("region", name=self.say("mat.car", number=number))).to_be_visible()

    # Projects, menus and dialogs.

    @property
    def name(self) -> Locator:
        return self.page.get_by_role("textbox", name=self.say("project.name"))

    def wait_until_stored(self, text: str) -> None:
        """Wait until the browser's storage contains this text of the newest work."""
        holds = (
            "text => Object.keys(localStorage).some(key => /autosave/.test(key) && localStorage[key].includes(text))"
        )
        self.page.wait_for_function(holds, arg=text)

    def choose(self, menu: str, *, item: str, exact: bool = True) -> None:
        self.page.get_by_role("button", name=menu, exact=True).click()
        self.page.get_by_role("menu").get_by_role("menuitem", name=item, exact=exact).or_(
            self.page.get_by_role("menuitemradio", name=item, exact=exact)
        ).click()

    def project_menu(self, key: str) -> None:
        self.choose(self.say("menu.project"), item=self.say(key))

    def open_dialog(self, name: str) -> None:
        """Open one of the page's dialogs by its menu or button."""
        if name == "help":
            # A narrow header has no button for it.
            self.choose(self.say("settings.title"), item=self.say("help.title"))
        else:
            self.project_menu(f"menu.{name}")
        expect(self.dialog(f"{name}.title")).to_be_visible()
        # Until the focus is in it, it hears no key.
        self.page.wait_for_function("document.activeElement.closest('[role=dialog]') !== null")

    def dialog(self, key: str) -> Locator:
        """The dialog with this title."""
        return self.page.get_by_role("dialog", name=self.say(key))

    @property
    def notices(self) -> Locator:
        return self.page.get_by_role("log", name=self.say("app.notices"))


def _answer_from(build: Path, route: Route) -> None:
    """Answer a request with the file of a build of the page; what isn't there is asked of the server."""
    file = build / (urlsplit(route.request.url).path.lstrip("/") or "index.html")
    if file.is_file():
        route.fulfill(path=file)
    else:
        route.continue_()
