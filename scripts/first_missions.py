"""Play the tour and the first missions as a pupil does, and say what is wrong: ``python -m scripts.first_missions``.

All is built out of the palette, by mouse and by touch, in both languages at five sizes of the window: first a program
that is nearly right, then the right one. No block moves while the cars drive or when they have driven, the first
program earns no star, the second all of them, and axe finds nothing.

``--pictures FOLDER`` keeps a picture of each step; ``--size``, ``--language``, ``--pointer`` and ``--only`` choose.
"""

import argparse
import re
import sys
import tempfile
from collections.abc import Iterator, Sequence
from itertools import count, product
from pathlib import Path
from typing import Any

from playwright.sync_api import Error, Locator, expect, sync_playwright
from scripts import chromium
from scripts.studio_process import ROOT, build_page, running_studio

from motorcade.missions.document import missions
from motorcade.missions.model import Mission
from motorcade.program.steps import Step
from motorcade.service.missions import mission_goals

sys.path.append(str(ROOT / "tests"))
from support.browser_profiles import Profiles, launched
from support.hands import DRAWN
from support.layout import serious_barriers
from support.studio_page import StudioPage

SIZES = ((390, 844), (768, 1024), (1024, 768), (1366, 768), (1440, 900))
LANGUAGES = ("en", "zh")
POINTERS = ("mouse", "touch")
MOST_MISSIONS = 8
# A block may be drawn so far beside where it was.
SLACK_PX = 1
PATIENCE_MS = 120_000
# What a block of the palette has; and where the texts of what is chosen there are.
NEW = {"direction": "forward", "speed": 2, "which": 0, "seconds": 1, "times": 2}
CHOICES = {"direction": "blocks", "speed": "levels.speed", "which": "levels.light"}
DRAWERS = {"led": "light", "repeat": "order", "together": "order", "wait": "drive", "drive": "drive"}
OWN_FIELD, NUMBER = ':scope > [role="button"]', re.compile(r"^\s*\d")
# The blocks of the leader's program by their ids, from top to bottom, with where they are; hidden ones are nowhere.
BLOCKS = """() => [...document.querySelectorAll("#leader-blocks .blocklyBlockCanvas .blocklyDraggable")]
  .filter(block => !block.closest(".blocklyFlyout"))
  .map(block => [block, block.querySelector(":scope > .blocklyPath")])
  .filter(([, path]) => path)
  .map(([block, path]) => {
    const { left, top } = path.getBoundingClientRect()
    return [block.dataset.id, path.checkVisibility({ visibilityProperty: true }) ? [left, top] : [-1, -1]]
  })
  .sort(([, a], [, b]) => a[1] - b[1] || a[0] - b[0])"""


class Builder:
    """Builds a leader's program out of the palette of a page of the first level.

    Args:
        studio: the page.
        radii_mm: how near is too near, by level.
    """

    def __init__(self, studio: StudioPage, radii_mm: Sequence[int]) -> None:
        self._studio, self._radii_mm = studio, radii_mm
        self._built: tuple[Step, ...] = ()

    def make(self, steps: Sequence[Step]) -> None:
        """Make the program have these steps: change fields, and build anew from the first other block on."""
        for at, (built, step) in enumerate(zip(self._built, steps, strict=False)):
            if not _is_alike(built, step):
                self._throw_away(at)
                break
            self._set_fields(self._block(self._built, at), built, step)
            self._built = (*self._built[:at], step, *self._built[at + 1 :])
        if len(self._built) > len(steps):
            self._throw_away(len(steps))
        for step in steps[len(self._built) :]:
            self._append(step)

    def _append(self, step: Step) -> None:
        last = self._block(self._built, len(self._built) - 1) if self._built else self._studio.hat("leader")
        if not self._built:
            last = self._studio.block("leader", self._studio.say("startBlocks.leader"))
        self._drag_out(step, below=last)
        block = self._block((*self._built, step), len(self._built), of_holders=False)
        inner: Locator | None = None
        for part in getattr(step, "steps", ()):
            if inner is None:
                self._studio.drag_into(self._drawer(part), self._name(part), block, 0)
            else:
                self._drag_out(part, below=inner)
            inner = block.locator(".blocklyDraggable").last
            self._set_fields(inner, None, part)
        self._set_fields(block, None, step)
        self._set_radius(block, step)
        self._built = (*self._built, step)

    def _drag_out(self, step: Step, below: Locator) -> None:
        self._studio.drag_out("leader", self._drawer(step), self._name(step), below=below)

    def _drawer(self, step: Step) -> str:
        if getattr(step, "unless", None) is not None:
            return "sense"
        return DRAWERS.get(step.kind, "sense")

    def _name(self, step: Step) -> str:
        """The beginning of a block's text."""
        return self._studio.say(f"startBlocks.{step.kind}").partition("\n")[0].partition("%")[0].strip()

    def _block(self, steps: Sequence[Step], at: int, *, of_holders: bool = True) -> Locator:
        """The block of a step; ``of_holders``: those around others have them already."""
        before = sum(_count(step) for step in steps[:at])
        identity = self._studio.page.evaluate(BLOCKS)[1 + before][0]
        # The block of the palette that it was made of has the same id.
        return self._studio.page.locator(f'#leader-blocks [data-id="{identity}"]:not(.blocklyFlyout *)')

    def _throw_away(self, at: int) -> None:
        """Drag a block, and all below it, onto the palette."""
        studio, block = self._studio, self._block(self._built, at)
        box, palette = studio.box(block), studio.box(studio.editor("leader").locator(".blocklyToolbox"))
        x, y = box["x"] + 12, box["y"] + 20
        goal = palette["x"] + palette["width"] / 2, palette["y"] + palette["height"] - 12
        studio.stroke([(x, y), (x + 20, y + 5), ((x + goal[0]) / 2, (y + goal[1]) / 2), goal, goal])
        self._built = self._built[:at]
        expect(block).to_have_count(0)

    def _set_fields(self, block: Locator, built: Step | None, step: Step) -> None:
        """Set what a step's block shows where it differs from the step that was ``built``; None is a new block."""
        studio = self._studio
        for name, first in NEW.items():
            wanted, shown = getattr(step, name, None), getattr(built, name, first)
            if wanted in (None, shown):
                continue
            if name in CHOICES:
                studio.pick(studio.field(block, self._choice(name, shown)), self._choice(name, wanted))
            else:
                studio.type_into(block.locator(OWN_FIELD).filter(has_text=NUMBER), str(wanted))
            studio.page.evaluate(DRAWN)

    def _set_radius(self, block: Locator, step: Step) -> None:
        """Choose how near is too near, where a drive avoids obstacles."""
        unless = getattr(step, "unless", None)
        if unless is None or unless.sense != "obstacle":
            return
        radius = self._studio.say("meaning.radius", radius=f"{self._radii_mm[unless.level] / 10:g}")
        self._studio.pick(block.locator(".blocklyDraggable").locator(OWN_FIELD).first, radius)

    def _choice(self, name: str, value: object) -> str:
        return self._studio.say(f"{CHOICES[name]}.{value}")


def _count(step: Step) -> int:
    """How many blocks a step has: those inside it, and what it minds, too."""
    return 1 + (getattr(step, "unless", None) is not None) + sum(_count(part) for part in getattr(step, "steps", ()))


def _is_alike(built: Step, step: Step) -> bool:
    """Whether a block needs new fields at most."""
    same_parts = getattr(built, "steps", ()) == getattr(step, "steps", ())
    return type(built) is type(step) and same_parts and getattr(built, "unless", None) == getattr(step, "unless", None)


class Visit:
    """A pupil's first visit; it collects what is wrong, and shoots each step."""

    def __init__(self, studio: StudioPage, language: str, folder: Path | None) -> None:
        self.studio, self.faults = studio, list[str]()
        self._language = language
        self._folder, self._numbers = folder, count(1)

    def shoot(self, step: str) -> None:
        """Keep a picture of the page as it is."""
        if not self._folder:
            return
        self._folder.mkdir(parents=True, exist_ok=True)
        self.studio.page.wait_for_timeout(400)
        self.studio.page.screenshot(path=self._folder / f"{next(self._numbers):02}-{step}.png")

    def look_for_barriers(self, step: str) -> None:
        """Ask axe."""
        self.faults += [f"{step}: {barrier}" for barrier in serious_barriers(self.studio.page)]

    def tour(self) -> None:
        """Make what the tour asks for, with a wrong choice before the right one."""
        studio, page = self.studio, self.studio.page
        page.wait_for_timeout(2500)
        self.shoot("welcome")
        studio.press(page.get_by_role("button", name=studio.say("tour.welcome.next"), exact=True))
        expect(page.get_by_text(studio.say("tour.drag.text"))).to_be_visible()
        page.wait_for_timeout(1200)
        self.shoot("tour-drag")
        self.look_for_barriers("tour")
        hat = studio.block("followers", studio.say("startBlocks.followers").partition("\n")[0])
        name = studio.say("startBlocks.drive").partition("%")[0].strip()
        studio.drag_out("followers", "drive", name, below=hat)
        expect(page.get_by_text(studio.say("tour.choose.text"))).to_be_visible()
        self.shoot("tour-choose")
        studio.press(studio.field(studio.block("followers", name), studio.say("blocks.forward")))
        self.shoot("tour-menu")
        studio.press(page.get_by_role("option", name=studio.say("blocks.left"), exact=True))
        expect(page.get_by_text(studio.say("tour.play.text"))).to_be_visible()
        self.shoot("tour-play")
        studio.press(studio.mat_button("play"))
        page.wait_for_timeout(3000)
        self.shoot("tour-drives")

    def mission(self, mission: Mission) -> None:
        """Play a mission, wrong first and then right, and go on to the next one."""
        studio = self.studio
        name = studio.say("missions.mission", name=mission.name.texts[self._language])
        goals = studio.page.get_by_role("region", name=name, exact=True).locator("li[data-progress]")
        expect(goals).to_have_count(len(mission_goals(mission)))
        self.shoot(f"{mission.id}-task")
        self.look_for_barriers(f"{mission.id}, task")
        studio.run_at("16×")
        self._show_blocks()
        larger = studio.page.get_by_role("button", name=studio.say("editors.largerBlocks"))
        if larger.is_visible():
            studio.press(larger)
        builder = Builder(studio, mission.profile.avoid_radii_mm)
        for name, program in (("wrong", mission.near_miss), ("right", mission.solution)):
            assert program
            self._show_blocks()
            builder.make(program.leader)
            self.shoot(f"{mission.id}-{name}-built")
            self._run(mission, name)

    def _show_blocks(self) -> None:
        to_blocks = self.studio.page.get_by_role("button", name=self.studio.say("missions.toBlocks"))
        if to_blocks.is_visible():
            self.studio.press(to_blocks)

    def _run(self, mission: Mission, name: str) -> None:
        studio, where = self.studio, f"{mission.id}, {name}"
        page = studio.page
        studio.press(page.get_by_role("button", name=studio.say("mat.reset"), exact=True))
        page.evaluate(DRAWN)
        before = page.evaluate(BLOCKS)
        with page.expect_response("**/api/missions/check", timeout=PATIENCE_MS) as checked:
            studio.press(studio.mat_button("play"))
            page.wait_for_timeout(300)
            self.shoot(f"{mission.id}-{name}-drives")
        stars = len(checked.value.json()["stars"])
        page.wait_for_timeout(800)
        self.shoot(f"{mission.id}-{name}-end")
        self._compare(before, page.evaluate(BLOCKS), where)
        wanted = 0 if name == "wrong" else len({goal.star for goal in mission.goals})
        if stars != wanted:
            self.faults.append(f"{where}: {stars} stars, not {wanted}")
        self.look_for_barriers(where)

    def _compare(self, before: list[Any], after: list[Any], where: str) -> None:
        places = dict(after)
        moved = [
            identity
            for identity, (x, y) in before
            if identity not in places or max(abs(places[identity][0] - x), abs(places[identity][1] - y)) > SLACK_PX
        ]
        if moved:
            self.faults.append(f"{where}: {len(moved)} of {len(before)} blocks moved")

    def go_on(self) -> None:
        """Take the one tap from a mission that is won to the next."""
        self.studio.press(self.studio.page.get_by_role("button", name=self.studio.say("missions.next"), exact=True))

    def first_mission(self, mission: Mission) -> None:
        """Open a mission from the map."""
        studio, page = self.studio, self.studio.page
        studio.press(page.get_by_role("button", name=studio.say("missions.title"), exact=True).first)
        expect(page.locator("[data-mission]")).to_have_count(len(missions()))
        self.shoot("map")
        studio.press(page.locator(f"[data-mission={mission.id}]"))
        expect(page.get_by_role("dialog")).to_have_count(0)
        question = page.get_by_role("alertdialog").get_by_role("button")
        if question.count():
            studio.press(question.last)


def play(visit: Visit, chosen: Sequence[Mission], *, tour: bool) -> None:
    """Play the tour, and missions one after another."""
    if tour:
        visit.tour()
    for at, mission in enumerate(chosen):
        if at:
            visit.go_on()
        else:
            visit.first_mission(mission)
        visit.mission(mission)


def visits(profiles: Profiles, url: str, given: argparse.Namespace) -> Iterator[str]:
    """Make all visits that are asked for; gives what is wrong, each with where."""
    first = [mission for mission in missions() if mission.document["path"] == "first-drive"][:MOST_MISSIONS]
    chosen = [mission for mission in first if given.only in (None, mission.id)]
    for size, language, pointer in product(SIZES, LANGUAGES, POINTERS):
        where = f"{size[0]}-{language}-{pointer}"
        wishes = ((given.size, size[0]), (given.language, language), (given.pointer, pointer))
        if any(wish not in (None, has) for wish, has in wishes):
            continue
        folder = given.pictures and given.pictures / where
        touches = pointer == "touch"
        tour = given.only is None
        studio = StudioPage.open(
            profiles, url, size=size, language=language, has_touch=touches, tour=tour, plain=True, level="start"
        )
        studio.context.set_default_timeout(PATIENCE_MS)
        visit = Visit(studio, language, folder)
        try:
            play(visit, chosen, tour=tour)
        except (AssertionError, Error) as error:
            visit.shoot("stuck")
            visit.faults.append(f"stuck: {str(error)[:600]}")
        yield from (f"{where}: {fault}" for fault in (*visit.faults, *studio.faults))
        studio.leave(profiles)


def main() -> None:
    """Play, print what is wrong, and end with 1 where something is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=Path, help="a folder for a picture of each step")
    parser.add_argument("--only", help="the id of one mission; without the tour")
    parser.add_argument("--size", type=int, choices=[size[0] for size in SIZES], help="the width of one window")
    parser.add_argument("--language", choices=LANGUAGES)
    parser.add_argument("--pointer", choices=POINTERS)
    given = parser.parse_args()
    path = chromium.find_or_install_for_tests()
    if path is None:
        sys.exit(f"No browser was found: {chromium.HOW_TO}.")
    build_page()
    expect.set_options(timeout=PATIENCE_MS)
    faults = 0
    with (
        sync_playwright() as playwright,
        launched(playwright, path, "--disable-gpu", "--disable-software-rasterizer") as browser,
        tempfile.TemporaryDirectory() as library,
        running_studio(Path(library)) as studio,
    ):
        for fault in visits(Profiles(browser), studio.url, given):
            print(fault, flush=True)
            faults += 1
    print(f"{faults} faults")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
