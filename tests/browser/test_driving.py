"""The cars run the blocks: on the mat, in the editors, and in the description for screen readers."""

import base64
import csv
import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from support.studio_programs import EXAMPLE, FOLLOWED, LISTENING

# How a block looks while some car runs it.
RUNNING = "motorcade-running"


def test_followers_receive_words_and_turn(show) -> None:
    studio = show(FOLLOWED)
    studio.play()
    expect(studio.block("followers", "right")).to_contain_class(RUNNING)
    expect(studio.block("leader", "forward").or_(studio.block("leader", "left"))).not_to_have_count(0)
    expect(studio.page.get_by_text("1 follower turns right")).to_be_visible()
    studio.choose_car(1)
    expect(studio.page.get_by_text("Heard last: B5000000 from car 0")).to_be_visible()
    expect(studio.page.get_by_text("At x 2.00 m, y 1.00 m")).to_be_visible()


@pytest.mark.soak
def test_a_car_that_listens_stops_and_goes_at_a_word(open_page) -> None:
    studio = open_page(project=LISTENING)
    studio.play()
    expect(studio.page.get_by_text("The leader drives forward")).to_be_visible()
    studio.page.get_by_role("button", name="Say “stop”").click()
    expect(studio.page.get_by_text("The leader stands still")).to_be_visible()
    studio.page.get_by_role("button", name="Say “go”").click()
    expect(studio.page.get_by_text("The leader drives forward")).to_be_visible()


def test_a_run_is_stepped_shown_again_downloaded_and_reset(show) -> None:
    studio = show(EXAMPLE)
    studio.look_up("timeline")
    studio.page.get_by_role("button", name="One step").click()
    expect(studio.clock).to_have_text("0:00.1")
    studio.play()
    expect(studio.clock).to_have_text(re.compile(r"0:0[2-9]\.\d"))
    studio.page.get_by_role("button", name="Pause").click()
    studio.page.get_by_role("slider", name="Moment shown").press("Home")
    expect(studio.clock).to_have_text("0:00.0")
    studio.page.get_by_role("button", name="Now").click()
    expect(studio.clock).to_have_text(re.compile(r"0:0[2-9]\.\d"))
    with studio.page.expect_download() as download:
        studio.choose("Download", item="Timeline as a table (CSV)")
    rows = list(csv.DictReader(download.value.path().read_text(encoding="utf-8-sig").splitlines()))
    assert "0x65800000" in [row["word"] for row in rows]
    studio.page.get_by_role("button", name="Back to the start").click()
    expect(studio.clock).to_have_text("0:00.0")


@pytest.mark.soak
def test_the_page_makes_a_film(open_page) -> None:
    studio = open_page(project=EXAMPLE)
    studio.play()
    expect(studio.clock).to_have_text(re.compile(r"0:0[1-9]\.\d"))
    studio.mat_button("pause").click()
    studio.look_up("timeline")
    with studio.page.expect_download() as download:
        studio.choose("Download", item="as a film", exact=False)
    assert Path(download.value.suggested_filename).suffix in (".mp4", ".webm")
    content = base64.b64encode(download.value.path().read_bytes()).decode()
    film = studio.page.evaluate(
        """async content => {
            const film = document.createElement("video");
            film.src = URL.createObjectURL(await (await fetch(`data:video/webm;base64,${content}`)).blob());
            // What MediaRecorder writes has no length: a browser finds it by looking for the end.
            await new Promise(done => { film.onseeked = done; film.onloadedmetadata = () => film.currentTime = 1e9; });
            return [film.videoWidth, film.currentTime];
        }""",
        content,
    )
    assert film[0] >= 300
    assert film[1] >= 0.8


@pytest.mark.soak
def test_the_stage_is_seen_from_behind_a_car_and_from_above_again(open_page) -> None:
    studio = open_page(project=FOLLOWED)
    page = studio.page
    studio.mat_button("chaseKey").click()
    behind = page.get_by_role("img", name=studio.say("mat.chasingLeader", number=0))
    studio.play()
    studio.expect_moving()
    before = behind.screenshot()
    studio.mat_button("nextCar").click()
    follower = page.get_by_role("img", name=studio.say("mat.chasing", number=1))
    assert follower.screenshot() != before
    page.get_by_role("application", name="Stage with cars").focus()
    page.keyboard.press("p")
    expect(behind).to_be_visible()
    page.keyboard.press("c")
    expect(behind).to_be_hidden()


def test_furniture_is_dragged_onto_the_mat_and_stored_in_the_project(show) -> None:
    studio = show(EXAMPLE)
    mat = studio.page.get_by_role("application", name="Stage with cars")
    studio.look_up("things")
    studio.page.get_by_role("button", name="Add: Person").drag_to(mat, target_position={"x": 150, "y": 120})
    person = studio.page.get_by_role("listbox", name="What stands on the mat").get_by_role("option", name="Person")
    expect(person).to_be_visible()
    studio.wait_until_stored('"person"')
    studio.page.reload()
    studio.wait_until_ready()
    studio.look_up("things")
    expect(person).to_be_visible()
