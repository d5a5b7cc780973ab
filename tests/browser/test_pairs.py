"""One project, two windows: two pupils of a class."""

from playwright.sync_api import Locator, Page, expect
from scripts.studio_process import project_link

from motorcade.locales import catalogue
from motorcade.missions.document import built_in_mission
from support.class_visits import class_room
from support.soak import SOAK
from support.studio_programs import FOLLOWED
from support.waiting import wait_until

TEXTS = catalogue("en")["page"]


def say(key: str, **values: str) -> str:
    section, name = key.split(".")
    text = TEXTS[section][name]
    for each, value in values.items():
        text = text.replace(f"{{{{{each}}}}}", value)
    return text


def button(page: Page, key: str) -> Locator:
    return page.get_by_role("button", name=say(key), exact=True)


def bar(page: Page) -> Locator:
    return page.get_by_role("region", name=say("pair.title"), exact=True)


def seconds(page: Page, editor: str) -> Locator:
    """The number in the last block of a program."""
    blocks = page.get_by_role("region", name=say(f"editors.{editor}Blocks"), exact=True)
    return blocks.locator(".blocklyBlockCanvas .blocklyBlock").last.locator(":scope > .blocklyNumberField")


def show(page: Page, editor: str) -> None:
    page.get_by_role("radio", name=say(f"editors.{editor}"), exact=True).click()


def type_seconds(page: Page, editor: str, text: str) -> None:
    show(page, editor)
    seconds(page, editor).click()
    page.keyboard.type(text)
    page.keyboard.press("Enter")


def expect_seconds(page: Page, editor: str, text: str) -> None:
    show(page, editor)
    expect(seconds(page, editor)).to_contain_text(text)


def expect_windows(page: Page, leader: str, followers: str) -> None:
    expect(bar(page)).to_contain_text(say("pair.leader", name=leader))
    expect(bar(page)).to_contain_text(say("pair.followers", name=followers))


def clock(page: Page) -> str:
    return page.get_by_role("status", name=say("mat.time")).inner_text()


def expect_mission(page: Page, progress: str) -> None:
    """The whole task is there: story or outcome, zones, goals and bits; all goals stand so."""
    goals = page.get_by_role("list", name=say("missions.goals")).locator("li")
    expect(goals).to_have_count(3)
    expect(goals.and_(page.locator(f"[data-progress={progress}]"))).to_have_count(3)
    expect(page.get_by_role("group", name=say("missions.bits"))).to_be_visible()


def expect_same_time(one: Page, other: Page) -> None:
    """Both worlds stand, at the same time."""
    for page in (one, other):
        expect(button(page, "mat.play")).to_be_visible()
    wait_until(lambda: clock(one) == clock(other))


def open_mission(page: Page, mission: str) -> None:
    button(page, "missions.title").first.click()
    page.locator(f"[data-mission={mission}]").click()


def expect_story(page: Page, mission: str) -> None:
    expect(page.get_by_text(built_in_mission(mission).document["story"]["en"])).to_be_visible()


def test_who_opens_the_next_mission_takes_the_one_along_who_began(browser, page_built, tmp_path) -> None:
    with class_room(browser, tmp_path / "class") as room:
        mia, bo = room.pupil("Mia"), room.pupil("Bo", language="en")
        one, other = mia.page, bo.page
        open_mission(one, "forward-and-stop")
        button(one, "pair.begin").click()
        one.get_by_role("dialog").get_by_role("button", name="Bo", exact=True).click()
        button(other, "pair.come").click()
        # The other one shows what was opened before.
        expect_windows(one, "you", "Bo")
        open_mission(other, "lights-on")
        told = say("pair.wentOn", name="Bo", mission=built_in_mission("lights-on").name.texts["en"])
        expect(one.get_by_text(told)).to_be_visible()
        for page in (one, other):
            expect_story(page, "lights-on")
        expect(other.get_by_text(told)).to_have_count(0)
        expect(other.get_by_text(say("pair.ended"))).to_have_count(0)
        one.reload()
        expect_story(one, "lights-on")
        expect_windows(one, "you", "Bo")
        expect_windows(other, "Mia", "you")


if SOAK:

    def test_two_pupils_program_one_project_through_a_power_cut(browser, page_built, tmp_path) -> None:
        with class_room(browser, tmp_path / "class") as room:
            mia, bo = room.pupil("Mia", project_link(room.base, FOLLOWED, "Ours")), room.pupil("Bo", language="en")
            for visit in (room.teacher, mia, bo):
                visit.forgive("ERR_CONNECTION", "WebSocket")
            one, other = mia.page, bo.page
            expect(one.get_by_role("textbox").first).to_have_value("Ours")
            button(one, "pair.begin").click()
            one.get_by_role("dialog").get_by_role("button", name="Bo", exact=True).click()
            expect(bar(other)).to_contain_text(say("pair.asked", name="Mia", project="Ours"))
            button(other, "pair.come").click()
            expect_windows(one, "you", "Bo")
            expect_windows(other, "Mia", "you")

            # The other's blocks can't be changed.
            type_seconds(one, "leader", "3")
            expect_seconds(other, "leader", "3")
            seconds(other, "leader").click(force=True)
            other.keyboard.type("9")
            other.keyboard.press("Escape")
            expect_seconds(other, "leader", "3")

            # One live world: what one plays, the other plays too, and both stand at the same moment.
            button(one, "mat.play").click()
            expect(button(other, "mat.pause")).to_be_visible()
            button(other, "mat.pause").click()
            expect_same_time(one, other)

            # What is edited while the server is gone arrives when it is back.
            room.kill()
            type_seconds(one, "leader", "2")
            type_seconds(other, "followers", "3")
            room.start_again()
            expect_seconds(other, "leader", "2")
            expect_seconds(one, "followers", "3")

            button(one, "pair.swap").click()
            button(other, "pair.agree").click()
            expect_windows(one, "Bo", "you")
            type_seconds(one, "followers", "2")
            expect_seconds(other, "followers", "2")

            button(other, "pair.leave").click()
            expect(bar(other)).to_have_count(0)
            expect_windows(one, "free", "you")
            button(one, "pair.take").click()
            type_seconds(one, "leader", "1")
            # The one who has left goes on alone with a copy.
            expect_seconds(other, "leader", "2")

    def test_two_pupils_play_one_mission_and_both_get_its_stars(browser, page_built, tmp_path) -> None:
        """Also at another tablet, which comes in the middle of a run, and after a power cut."""
        with class_room(browser, tmp_path / "class") as room:
            mia, bo = room.pupil("Mia", size=(1440, 900)), room.pupil("Bo", language="en")
            for visit in (room.teacher, mia, bo):
                visit.forgive("ERR_CONNECTION", "WebSocket")
            one, other = mia.page, bo.page
            button(one, "missions.title").first.click()
            one.locator("[data-mission=flip-the-lamp]").click()
            button(one, "pair.begin").click()
            one.get_by_role("dialog").get_by_role("button", name="Bo", exact=True).click()
            button(other, "pair.come").click()
            for page in (one, other):
                expect(page.get_by_text(built_in_mission("flip-the-lamp").document["story"]["en"])).to_be_visible()

            # The run ends on both pages, and Bo gets no star before it is won.
            button(one, "mat.play").click()
            for page in (one, other):
                expect(page.get_by_text(say("missions.again"))).to_be_visible()
            expect_same_time(one, other)
            room.kill()
            room.start_again()
            button(other, "pair.swap").click()
            button(one, "pair.agree").click()
            expect_windows(one, "Bo", "you")
            # Bits 22 and 21 choose the lamp; the second word is the followers', whose window Mia has now.
            bits = one.get_by_role("group", name=say("missions.bits")).get_by_role("button")
            bits.and_(one.get_by_role("button", name="bit 22")).nth(1).press(" ")
            button(one, "mat.play").click()
            expect(button(other, "mat.pause")).to_be_visible()

            # Bo goes on at another tablet.
            tablet = room.visit()
            about = bo.context.request.post(f"{room.base}api/class/about", data={}).json()["me"]
            coming = {"code": room.code, "name": about["name"], "number": about["number"]}
            assert tablet.context.request.post(f"{room.base}api/class/return", data=coming).ok
            bo.context.close()
            room.visits.remove(bo)
            tablet.page.goto(room.base)
            for page in (one, tablet.page):
                expect_mission(page, "met")
            expect_same_time(one, tablet.page)
            earned = {"flip-the-lamp": [1, 2, 3]}

            def stars() -> dict:
                asked = room.teacher.context.request.post(f"{room.base}api/teacher/progress", data={})
                return asked.json()["stars"]

            # Each page has the run checked when it has ended.
            wait_until(lambda: stars() == {"01": earned, "02": earned})
