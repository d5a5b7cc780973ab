"""A class in real browsers: the teacher's page and wall, and pupils who join by a few taps."""

import re
from itertools import product
from time import monotonic

import pytest
from playwright.sync_api import expect
from scripts.studio_process import project_link

from motorcade.locales import catalogue
from support.class_page import PROJECT
from support.class_visits import (
    DRAWN,
    SIZES,
    assert_clear,
    class_room,
    expect_cover,
    expect_drafts,
    expect_leaders,
    steer,
    tab_to,
)
from support.driven_car import DrivenCar
from support.soak import SOAK
from support.studio_page import PHONE
from support.studio_programs import EXAMPLE

LOOKS = list(product(SIZES, ("en", "zh"), ("light", "dark", "contrast"))) if SOAK else [(SIZES[3], "zh", "dark")]


@pytest.fixture(scope="module")
def room(browser, page_built, tmp_path_factory):
    """A class with a teacher and two pupils, who have a program: Mia with a phone, 小明 with a tablet in Chinese."""
    folder = tmp_path_factory.mktemp("class") / "class"
    with (
        DrivenCar() as car,
        class_room(browser, folder, "--car", f"red=127.0.0.1:{car.port}/{car.telemetry_port}") as room,
    ):
        link = project_link(room.base, EXAMPLE, "Robot")
        room.mia = room.pupil("Mia", link, size=PHONE, has_touch=True, is_mobile=True, sleeps=True)
        room.ming = room.pupil("小明", link, language="zh", theme="dark")
        yield room


@pytest.fixture
def teacher(room, request):
    """The teacher, with the first part of the page."""
    if request.node.execution_count > 1:
        # The run that failed left windows and menus open.
        room.teacher.close_windows()
        room.teacher.page.reload()
    room.teacher.part("pupils")
    return room.teacher


@pytest.mark.soak
def test_a_newcomer_with_a_shared_link_joins_and_gets_it_until_removed(room, teacher) -> None:
    cleo = room.visit()
    cleo.forgive("400", "403", "409", "401", "WebSocket")
    page, alert = cleo.page, cleo.page.get_by_role("alert").filter(visible=True)
    page.goto(project_link(room.base, EXAMPLE, "From a friend"))
    page.wait_for_url("**/join#*")
    for code, problem in (("AAAAAA", "not the code"), (f" {room.code.lower()} ", None)):
        page.get_by_label(cleo.say("class.code")).fill(code)
        cleo.button("class.next").click()
        if problem:
            expect(alert).to_contain_text(problem)
    for name, problem in (("🚗", "emoji"), ("MIA", "is taken"), ("Cleo", None)):
        page.get_by_label(cleo.say("class.nickname")).fill(name)
        cleo.button("class.comeIn").click()
        if problem:
            expect(alert).to_contain_text(problem)
    cleo.button("class.goOn").click()
    cleo.wait_for_studio()
    expect(page.get_by_role("textbox").first).to_have_value("From a friend")
    row = teacher.row("Cleo")
    row.locator("summary").click()
    row.get_by_role("button", name=teacher.say("class.remove")).click()
    question = teacher.page.get_by_role("alertdialog")
    question.get_by_role("button", name=teacher.say("class.remove")).click()
    expect_cover(cleo, "pupil.goodbye.removed")
    expect(teacher.row("Cleo")).to_have_count(0)
    page.get_by_role("link", name=cleo.say("pupil.joinAgain")).click()
    expect(page.get_by_label(cleo.say("class.code"))).to_be_visible()


def test_three_taps_lead_from_the_qr_code_into_the_studio_and_back_into_it(room) -> None:
    lin = room.visit(size=PHONE, has_touch=True, is_mobile=True)
    lin.page.goto(f"{room.base}join#{room.code}")
    lin.page.get_by_label(lin.say("class.nickname")).fill("Lin")
    expect(lin.page.get_by_text("HTTPS")).to_have_count(0)
    assert room.code not in lin.page.url
    lin.page.locator("label").filter(has=lin.page.get_by_label(lin.say("class.carNumber", number=3), exact=True)).tap()
    lin.button("class.comeIn").tap()
    number = lin.page.get_by_text(re.compile(r"^\d{4}$")).inner_text()
    lin.button("class.goOn").tap()
    lin.page.wait_for_url(room.base, wait_until="commit")
    # The tablet knows its pupil; on another one, it is the number that counts.
    again = lin.open("join")
    expect(again.get_by_role("heading", name=lin.say("class.welcomeBack", name="Lin"))).to_be_visible()
    lin.context.close()
    other = room.visit(size=PHONE)
    other.page.goto(f"{room.base}join#{room.code}")
    other.button("class.iWasHere").click()
    other.page.get_by_label(other.say("class.nickname")).fill("lin")
    other.page.get_by_label(other.say("class.number")).fill(number)
    other.button("class.comeIn").click()
    expect(other.page.get_by_role("heading", name=other.say("class.hello", name="Lin"))).to_be_visible()
    other.context.close()


def test_a_raised_hand_and_a_handed_out_project_cross_the_room(room, teacher) -> None:
    room.mia.button("pupil.raiseHand").tap()
    teacher.button("class.lowerHandOf", name="Mia").click()
    expect(room.mia.button("pupil.raiseHand")).to_be_visible()
    starter = {"name": "Starter", "project": PROJECT}
    assert teacher.context.request.post(f"{room.base}api/projects/write", data=starter).ok
    part = teacher.part("handOut")
    part.get_by_role("checkbox", name="Mia").check()
    part.get_by_role("button", name="Starter", exact=True).click()
    expect(part.get_by_role("status")).to_have_text(teacher.say("class.handedOut", what="Starter", count=1))
    mia = room.mia.page
    expect(mia.get_by_text(room.mia.say("pupil.project", sender="Your teacher", name="Starter"))).to_be_visible()
    room.mia.button("pupil.open").tap()
    replace = mia.get_by_role("alertdialog").get_by_role("button", name=room.mia.say("project.replaceYes"))
    replace.or_(mia.locator("input[value=Starter]")).first.wait_for()
    if replace.is_visible():
        replace.tap()
    expect(mia.get_by_role("textbox").first).to_have_value("Starter")
    expect(room.ming.page.get_by_text("Starter")).to_have_count(0)


def test_eyes_up_covers_all_pages_and_pauses_until_work_goes_on(room, teacher) -> None:
    play = room.ming.page.locator("#mat-play")
    play.click()
    expect(play).to_have_text(room.ming.say("mat.pause"))
    teacher.button("class.freeze").click()
    for pupil in (room.mia, room.ming):
        expect_cover(pupil, "pupil.frozen")
    teacher.button("class.thaw").click()
    for pupil in (room.mia, room.ming):
        expect(pupil.page.get_by_role("dialog")).to_have_count(0)
    expect(play).to_have_text(room.ming.say("mat.play"))


def test_the_wall_shows_all_stages_also_those_that_stand_still(room, teacher) -> None:
    wall = teacher.open("wall")
    for pupil in ("Mia", "小明"):
        tile = wall.get_by_role("img", name=teacher.say("class.stageOf", name=pupil), exact=True)
        expect_leaders(tile, 1)
    before = tile.evaluate(DRAWN)
    play = room.ming.page.locator("#mat-play")
    play.click()
    wall.wait_for_function(
        f"([canvas, before]) => ({DRAWN})(canvas).join() !== before.join()", arg=[tile.element_handle(), before]
    )
    # The wall may know of it first: until the page does, another click would only play again.
    expect(play).to_have_text(room.ming.say("mat.pause"))
    play.click()
    expect(play).to_have_text(room.ming.say("mat.play"))
    wall.get_by_role("link").filter(has_text="Mia").click()
    expect(wall.get_by_role("link", name=teacher.say("class.allStages"))).to_be_visible()
    expect_leaders(wall.get_by_role("img", name=teacher.say("class.stageOf", name="Mia"), exact=True), 1)
    wall.close()


@pytest.mark.soak
def test_the_shared_mat_shows_the_cars_of_both_pupils(room, teacher) -> None:
    part = teacher.part("mat")
    teacher.button("class.matOpen").click()
    for pupil in (room.mia, room.ming):
        pupil.button("pupil.matSend").click()
        expect(pupil.button("pupil.matLeave")).to_be_visible()
    expect(part.get_by_role("listitem")).to_have_text(["Mia", "小明"])
    mat = teacher.open("mat")
    expect(mat.get_by_role("main")).to_contain_text("小明")
    teacher.button("class.matStart", mat).click()
    expect_leaders(mat.get_by_role("img"), 2)
    expect(mat.get_by_role("main").get_by_role("listitem")).to_have_count(3)
    teacher.button("class.pause", mat).click()
    expect(teacher.button("class.play", mat)).to_be_visible()
    mat.close()
    wall = teacher.open("wall")
    expect_leaders(wall.get_by_role("img", name=teacher.say("class.matTitle"), exact=True), 2)
    wall.close()
    teacher.button("class.matClose").click()
    expect(teacher.button("class.matOpen")).to_be_visible()
    expect(room.mia.button("pupil.matAgain")).to_have_count(0)


@pytest.mark.soak
def test_the_cable_and_a_car_are_taken_and_passed_on(room, teacher) -> None:
    mia, ming = room.mia, room.ming
    cable, red = map(teacher.part("cars").get_by_label, (teacher.say("class.cable"), "red"))
    # Nothing is at a port of this computer: nobody is offered its cable.
    expect(ming.button("pupil.cable")).to_have_count(0)
    cable.select_option(label="小明")
    expect(ming.button("pupil.cableYours")).to_be_visible()
    expect(mia.button("pupil.cableTaken")).to_have_count(0)
    cable.select_option(label="Mia")
    mia.button("pupil.cableYours").tap()
    expect(cable).to_have_value("")
    ming.button("pupil.driveCar", car="red").click()
    with ming.context.expect_page() as opened:
        ming.bar.get_by_role("link").click()
    expect(mia.button("pupil.carTaken", car="red")).to_be_disabled()
    drive = opened.value
    steer(drive, drive.get_by_role("status").filter(has_text=ming.say("remote.moving")))
    red.select_option(label="Mia")
    expect(mia.bar.get_by_role("link")).to_be_visible()
    steer(drive, drive.get_by_text(catalogue("zh")["errors"]["not-your-turn"].replace("{car}", "red")))
    drive.close()
    mia.button("pupil.leaveCar", car="red").tap()
    expect(red).to_have_value("")


def test_a_pupil_sees_nothing_of_what_others_do(room) -> None:
    ming = room.ming
    ming.forgive("401")
    for path in ("wall", "mat", "wall?pupil=01"):
        page = ming.open(path)
        expect(page.get_by_text(ming.say("class.projectorNeedsTeacher"))).to_be_visible()
        assert page.get_by_role("img").count() == 0
        page.close()
    page = ming.open("teacher")
    expect(page.get_by_label(ming.say("class.password"))).to_be_visible()
    assert "Mia" not in page.content()
    expect_drafts(room, {"02": "Robot"})
    page.goto(f"{room.base}?pupil=01")
    expect(page.get_by_role("textbox").first).to_have_value("Robot")
    # A page of the same pupil's takes the world once it is connected.
    expect(ming.button("mat.comeBack")).to_be_visible()
    page.close()
    ming.button("mat.comeBack").click()
    asked = ming.context.request.post(f"{room.base}api/teacher/project", data={"pupil": "01", "name": ""})
    assert asked.status == 401


def test_the_teacher_looks_at_a_pupils_stage_and_at_what_the_pupil_works_on(room, teacher) -> None:
    row = teacher.row("小明")
    with teacher.context.expect_page() as opened:
        row.get_by_role("link").first.click()
    wall, page = opened.value, room.ming.page
    expect_leaders(wall.get_by_role("img", name=teacher.say("class.stageOf", name="小明"), exact=True), 1)
    blocks = wall.get_by_role("region", name=teacher.say("editors.leaderBlocks")).locator(".blocklyBlock")
    expect(blocks).to_have_count(3)
    page.locator("#leader-blocks .blocklyBlock").last.click(position={"x": 8, "y": 8})
    for key, count in (("Delete", 2), ("Control+z", 3)):
        page.keyboard.press(key)
        expect(blocks).to_have_count(count)
    wall.close()
    row.locator("summary").click()
    row.get_by_role("button", name=teacher.say("class.showProjects")).click()
    with teacher.context.expect_page() as opened:
        row.get_by_role("link", name=teacher.say("class.draft")).click()
    looks = opened.value
    expect(looks.get_by_text(teacher.say("pupil.lookAbout"))).to_be_visible()
    expect(looks.get_by_role("textbox").first).to_have_value("Robot")
    looks.close()


def test_everything_is_done_by_keyboard_alone(room, teacher) -> None:
    kay = room.visit()
    page = kay.page
    page.goto(f"{room.base}join")
    for field, text in (("class.code", room.code), ("class.nickname", "Kay")):
        box = page.get_by_label(kay.say(field))
        expect(box).to_be_visible()
        tab_to(page, box)
        page.keyboard.type(text)
        page.keyboard.press("Enter")
    for thing in (kay.button("class.goOn"), kay.button("pupil.raiseHand")):
        thing.wait_for()
        tab_to(page, thing)
        page.keyboard.press("Enter")
    tab_to(teacher.page, teacher.page.get_by_role("button", name=teacher.say("class.lowerHandOf", name="Kay")))
    teacher.page.keyboard.press("Enter")
    expect(kay.button("pupil.raiseHand")).to_be_visible()
    tab_to(teacher.page, teacher.row("Kay").locator("summary"))
    teacher.page.keyboard.press("Enter")
    expect(teacher.row("Kay").get_by_role("button", name=teacher.say("class.remove"))).to_be_visible()
    kay.context.close()


@pytest.mark.parametrize(("size", "language", "theme"), LOOKS)
def test_no_page_of_the_class_has_barriers_or_is_too_wide(room, size, language, theme) -> None:
    looks = {"motorcade.language": language, "motorcade.settings": f'{{"theme": "{theme}", "toured": true}}'}
    newcomer, teacher = room.visit(language=language, theme=theme, size=size), room.teacher
    newcomer.page.goto(f"{room.base}join#{room.code}")
    newcomer.page.get_by_label(newcomer.say("class.nickname")).wait_for()
    teacher.page.evaluate("looks => Object.assign(localStorage, looks)", looks)
    view, wall = teacher.open("teacher"), teacher.open("wall")
    parts = view.get_by_role("navigation").get_by_role("button")
    wall.get_by_role("img").first.wait_for()
    pages = [newcomer.page, room.ming.page if language == "zh" else room.mia.page, view, wall]
    if SOAK:
        pages += [newcomer.open("privacy"), newcomer.open("join"), teacher.open("mat"), teacher.open("teacher")]
    for page in pages:
        page.set_viewport_size({"width": size[0], "height": size[1]})
        assert_clear(page)
    for part in parts.all()[1:] if SOAK else parts.all()[-1:]:
        part.click()
        assert_clear(view)
    for page in pages[2:]:
        page.close()
    newcomer.context.close()


def test_a_tablet_without_a_network_for_ten_minutes_loses_nothing(room, teacher) -> None:
    mia, page = room.mia, room.mia.page
    mia.forgive("WebSocket", "ERR_INTERNET_DISCONNECTED")
    mia.context.set_offline(True)
    page.get_by_role("textbox").first.fill("Asleep")
    # As a tablet that sleeps: what was due meanwhile happens once.
    page.clock.fast_forward("10:00")
    mia.context.set_offline(False)
    expect_drafts(room, {"01": "Asleep"})
    mia.button("pupil.raiseHand").tap()
    teacher.button("class.lowerHandOf", name="Mia").click()
    expect(page.get_by_role("textbox").first).to_have_value("Asleep")


@pytest.mark.parametrize("kill", range(10 if SOAK else 1))
def test_after_the_server_was_killed_all_are_back_and_nothing_is_lost(room, teacher, kill) -> None:
    pupils = {"01": room.mia, "02": room.ming}
    for visit in (*pupils.values(), teacher):
        visit.forgive("WebSocket", "ERR_CONNECTION")
    lost = teacher.page.get_by_text(teacher.say("class.linkLost"))
    names = {number: visit.page.get_by_role("textbox").first for number, visit in pupils.items()}
    names["01"].fill(f"Before {kill}")
    room.kill()
    expect(lost).to_be_visible()
    names["02"].fill(f"Meanwhile {kill}")
    room.start_again()
    began_s = monotonic()
    expect(lost).to_have_count(0)
    for name in ("Mia", "小明"):
        expect(teacher.row(name).and_(teacher.page.locator(":not([data-away])"))).to_be_visible()
    assert not SOAK or monotonic() - began_s < 5
    after = {"01": f"Before {kill}", "02": f"Meanwhile {kill}"}
    expect_drafts(room, after)
    for number, visit in pupils.items():
        play = visit.page.locator("#mat-play")
        play.click()
        expect(play).to_have_text(visit.say("mat.pause"))
        play.click()
        expect(play).to_have_text(visit.say("mat.play"))
        if SOAK:
            visit.page.reload()
            visit.wait_for_studio()
        expect(names[number]).to_have_value(after[number])
