"""Does it work? The luck meter, a run played from before it went wrong, two runs compared, and a run that stops."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from playwright.sync_api import expect

from motorcade.missions.document import built_in_mission
from support.layout import serious_barriers
from support.studio_page import PHONE, StudioPage
from support.studio_programs import EXAMPLE

OpenPage = Callable[..., StudioPage]
TRIED = re.compile(r"200 次里成功 \d+ 次")
TABLE = {"format": "motorcade-mat/1", "name": "Table", "size_m": [4, 3]}


def noisy_mission(path: Path) -> Path:
    """A mission in noisy air, begun with a program without checks: some cars obey what nobody said."""
    start = {
        "leader": [{"wait": {"seconds": 3}}],
        "followers": {"tagged": False, "steps": [{"led": {"which": 1, "seconds": 2}}]},
    }
    document: dict[str, Any] = {**built_in_mission("noisy-air").document, "seconds": 20, "start": start}
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def open_mission(studio: StudioPage, path: Path) -> None:
    studio.page.get_by_role("button", name=studio.say("missions.title"), exact=True).press("Enter")
    with studio.page.expect_file_chooser() as chooser:
        studio.page.get_by_role("button", name=studio.say("missions.openFile")).press("Enter")
    chooser.value.set_files(path)
    expect(studio.page.locator("li[data-progress]")).to_have_count(5)
    # Until its words have come, nothing can be tried.
    studio.wait_until_ready()


def test_a_lucky_program_is_found_out_and_its_failure_is_played(open_page: OpenPage, tmp_path: Path) -> None:
    """By keyboard, in Chinese, while the cars drive."""
    studio = open_page(language="zh", size=(1024, 768))
    page = studio.page
    page.get_by_role("tab", name=studio.say("drawer.sure")).press("Enter")
    part = page.get_by_role("region", name=studio.say("luck.title"))
    expect(part).to_contain_text(studio.say("luck.noGoal"))
    open_mission(studio, noisy_mission(tmp_path / "noisy.mission.json"))
    page.locator("#mat-play").press("Enter")
    meter = page.get_by_role("button", name=TRIED)
    # Below a list of goals that is longer than its place.
    expect(meter).to_be_in_viewport(ratio=0.8)
    meter.press("Enter")
    expect(part.get_by_role("meter", name=TRIED)).to_be_visible()
    failed = part.get_by_role("list", name=studio.say("luck.failed")).get_by_role("listitem")
    expect(failed.first).to_contain_text("小车")
    assert serious_barriers(page) == []
    # It is played from before that moment, with its seed.
    seed = int(re.findall(r"\d+", failed.first.locator("b").inner_text())[0])
    failed.first.get_by_role("button").first.press("Enter")
    expect(part.get_by_role("button", name=studio.say("luck.usual"))).to_be_visible()
    assert page.evaluate("sessionStorage['motorcade.world.seed']") == str(seed)
    # Compared with a run of other luck, it parts at a word.
    failed.first.get_by_role("button").nth(1).press("Enter")
    sheet = page.get_by_role("dialog", name=studio.say("compare.title"))
    expect(sheet.get_by_role("status")).to_contain_text(re.compile(r"小车 \d+ 在 [\d.]+ 秒"))
    expect(sheet.get_by_role("img")).to_have_count(2)
    assert serious_barriers(page) == []
    before = sheet.get_by_role("slider").get_attribute("aria-valuetext")
    sheet.get_by_role("slider").press("ArrowRight")
    expect(sheet.get_by_role("slider")).not_to_have_attribute("aria-valuetext", str(before))
    page.keyboard.press("Escape")
    expect(sheet).to_have_count(0)
    page.get_by_role("button", name=studio.say("missions.leave")).press("Enter")
    expect(part.get_by_role("meter")).to_have_count(0)


def test_a_run_stops_where_a_tapped_wall_is_touched(open_page: OpenPage) -> None:
    """On a phone, too: the thing is tapped on the stage, and the timeline is at hand at every level."""
    wall = {"from_m": [1.5, 0.5], "to_m": [1.5, 1.5]}
    drive = {"drive": {"direction": "forward", "speed": 3, "seconds": 3}}
    mat = {**TABLE, "car": [{"at_m": [1, 1], "role": "leader"}], "wall": [wall]}
    project = {**EXAMPLE, "leader": [drive], "followers": None, "mat": mat}
    studio = open_page(project=project, size=PHONE, level="start", plain=True)
    page = studio.page
    page.get_by_role("button", name=studio.say("drawer.open")).press("Enter")
    page.get_by_role("tab", name=studio.say("drawer.things")).press("Enter")
    page.get_by_role("option", name=re.compile(studio.say("mat.things.wall"))).click()
    page.get_by_role("button", name=studio.say("stops.whenTouched")).press("Enter")
    page.locator("#mat-play").press("Enter")
    notice = page.get_by_role("status").filter(has_text="car 0 touches a wall")
    expect(notice).to_be_visible()
    assert serious_barriers(page) == []
    expect(page.locator("#mat-play")).to_contain_text(studio.say("mat.play"))
    notice.get_by_role("button", name=studio.say("stops.look")).press("Enter")
    expect(page.get_by_role("tab", name=studio.say("drawer.timeline"))).to_have_attribute("aria-selected", "true")
    notice.get_by_role("button", name=studio.say("stops.goOn")).press("Enter")
    expect(notice).to_have_count(0)
    # It can be taken away again.
    page.get_by_role("tab", name=studio.say("drawer.sure")).press("Enter")
    listed = page.get_by_role("list", name=studio.say("stops.chosen"))
    listed.get_by_role("button").press("Enter")
    expect(listed.get_by_role("listitem")).to_have_count(0)
