"""Projects in files, the library and links; work survives crashes of the browser and of the server."""

import json

import pytest
from playwright.sync_api import Locator, expect
from scripts.studio_process import project_link

from motorcade.mats.document import read_mat
from support.studio_page import StudioPage
from support.studio_programs import EXAMPLE, FOLLOWED

EXAMPLE_WORDS = ["02000000", "65800000", "6a800000"]
FOLLOWED_WORDS = ["02010200", "65800000", "6a800000", "b5000000"]
TURNED_WORDS = ["02000000", "65800000", "72800000"]


def turn_right(studio: StudioPage) -> None:
    """An edit of the example."""
    studio.pick(studio.field(studio.block("leader", "left"), "left"), "right")
    studio.expect_words(TURNED_WORDS)


def range_field(studio: StudioPage) -> Locator:
    """How far infrared reaches on the mat."""
    studio.look_up("swarm")
    return studio.page.get_by_role("textbox", name="Infrared range")


def save_as(studio: StudioPage, name: str) -> None:
    studio.name.fill(name)
    studio.project_menu("menu.save")


def versions(studio: StudioPage, name: str) -> Locator:
    """The button of a project in the library that shows its two versions."""
    entry = studio.dialog("library.title").get_by_role("listitem").filter(has_text=name)
    return entry.get_by_role("button", name="2 versions")


@pytest.mark.soak
def test_every_saved_version_can_be_opened(open_page) -> None:
    studio = open_page(project=EXAMPLE)
    save_as(studio, "My parade")
    expect(studio.notices).to_contain_text("version 1")
    expect(studio.page.get_by_text("Not saved")).to_be_hidden()
    turn_right(studio)
    save_as(studio, "My parade")
    expect(studio.notices).to_contain_text("version 2")

    studio.reopen()
    studio.project_menu("menu.library")
    studio.dialog("library.title").get_by_role("button", name="My parade").first.click()
    studio.expect_words(TURNED_WORDS)
    studio.project_menu("menu.library")
    versions(studio, "My parade").click()
    first = (
        studio.page.get_by_role("list", name="Versions of My parade")
        .get_by_role("listitem")
        .filter(has_text="Version 1")
    )
    first.get_by_role("button", name="Open").click()
    studio.expect_words(EXAMPLE_WORDS)
    expect(studio.name).to_have_value("My parade")


def test_two_windows_with_one_project_are_told_and_neither_overwrites(open_page) -> None:
    first = open_page(project=EXAMPLE)
    save_as(first, "Ours")
    expect(first.notices).to_contain_text("version 1")
    second = StudioPage(first.context, first.url, "en")
    second.page.goto(second.url)
    second.wait_until_ready()
    second.project_menu("menu.library")
    second.dialog("library.title").get_by_role("button", name="Ours").first.click()
    for studio in (first, second):
        expect(studio.notices).to_contain_text(studio.say("library.openElsewhere", name="Ours"))

    turn_right(second)
    second.project_menu("menu.save")
    expect(first.notices).to_contain_text(first.say("library.savedElsewhere", name="Ours", version=2))
    # The console tells of an answer that refuses.
    for studio in (first, second):
        studio.forgive("409")
    first.project_menu("menu.save")
    question = first.page.get_by_role("alertdialog", name=first.say("library.elsewhereTitle", name="Ours"))
    question.press("Escape")
    expect(question).to_be_hidden()
    first.project_menu("menu.library")
    expect(versions(first, "Ours")).to_be_visible()


def test_a_project_is_saved_to_a_file_and_a_link_and_opened(open_page, tmp_path) -> None:
    studio = open_page(project=FOLLOWED)
    studio.name.fill("Through a file")
    range_field(studio).fill("300")
    range_field(studio).press("Enter")
    studio.wait_until_stored('"range_mm":300')
    with studio.page.expect_download() as download:
        studio.project_menu("menu.saveFile")
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    assert path.name == "Through a file.motorcade.json"
    saved = json.loads(path.read_text(encoding="utf-8"))
    assert {each: saved[each] for each in ("format", "profile")} == {
        each: FOLLOWED[each] for each in ("format", "profile")
    }

    again = open_page()
    with again.page.expect_file_chooser() as chooser:
        again.project_menu("menu.open")
    chooser.value.set_files(path)
    again.expect_words(FOLLOWED_WORDS)
    expect(again.name).to_have_value("Through a file")
    expect(range_field(again)).to_have_value("300 mm")
    # A link holds the whole project, too.
    again.open_dialog("share")
    link = again.page.get_by_role("textbox", name="Link")
    expect(link).not_to_have_value("")
    address = link.input_value()
    again.page.keyboard.press("Escape")
    again.take(EXAMPLE)
    again.page.goto(address)
    again.page.get_by_role("alertdialog").get_by_role("button", name=again.say("project.replaceYes")).click()
    again.expect_words(FOLLOWED_WORDS)
    assert "#" not in again.page.url
    # Python text is a program too.
    with again.page.expect_file_chooser() as chooser:
        again.project_menu("menu.open")
    text = b"from motorcade import *\n\n\ndef leader():\n    forward(3)\n    right(1)\n"
    chooser.value.set_files({"name": "Turn.py", "mimeType": "", "buffer": text})
    again.page.get_by_role("alertdialog").get_by_role("button", name=again.say("project.replaceYes")).click()
    again.expect_words(["02000000", "65800000", "74800000"])
    expect(again.name).to_have_value("Turn")


def test_a_name_that_no_project_can_have_is_told_before_a_project_is_replaced(open_page) -> None:
    studio = open_page(project=EXAMPLE)
    studio.forgive("400 (Bad Request)")
    studio.page.get_by_label(studio.say("project.name")).fill("a/b")
    studio.page.get_by_role("button", name=studio.say("help.title")).click()
    studio.page.get_by_role("button", name=studio.say("tour.again")).click()
    studio.page.get_by_role("alertdialog").get_by_role("button", name=studio.say("project.saveAndOpen")).click()
    expect(studio.notices).to_contain_text("Choose another name")
    expect(studio.block("leader", "left")).to_be_visible()


def test_what_fails_by_a_mistake_of_the_page_itself_is_told(open_page) -> None:
    studio = open_page(project=EXAMPLE)
    studio.forgive("a mistake of ours")
    studio.page.evaluate("() => void Promise.reject(new Error('a mistake of ours'))")
    expect(studio.notices).to_contain_text(studio.say("app.unexpected"))


def test_blocks_and_words_are_exported(show) -> None:
    studio = show(EXAMPLE)
    for key, beginning in (("csv", "index,part,hex"), ("svg", "<svg"), ("png", "PNG")):
        with studio.page.expect_download() as download:
            studio.project_menu(f"export.{key}")
        content = download.value.path().read_bytes()
        assert beginning in content[:40].decode("utf-8", errors="replace")
        assert key == "png" or "65800000" in content.decode() or "forward" in content.decode()


def test_who_presses_play_before_a_shared_project_is_open_sees_it_play(open_page, studio) -> None:
    page, held = open_page(), []
    page.page.route("**/api/open", lambda route: held.append(route))
    with page.page.expect_request("**/api/open"):
        page.page.evaluate("link => { location.hash = new URL(link).hash }", project_link(studio.url, EXAMPLE))
    page.play()
    held.pop().continue_()
    page.expect_moving()
    expect(page.block("leader", "left")).to_contain_class("motorcade-running")


def test_work_continues_after_the_server_crashed_and_came_back(open_own_page, own_studio) -> None:
    studio = open_own_page(project=EXAMPLE)
    studio.forgive("ERR_CONNECTION_REFUSED", "ERR_CONNECTION_RESET", "ERR_EMPTY_RESPONSE", "WebSocket connection")
    studio.play()
    studio.expect_moving()
    own_studio.kill()
    studio.pick(studio.field(studio.block("leader", "left"), "left"), "right")
    expect(studio.page.get_by_role("alert").filter(has_text="server isn't answering")).to_be_visible()
    # Another language has to be fetched.
    studio.page.get_by_role("button", name=studio.say("settings.title")).click()
    studio.page.get_by_role("menuitemradio", name="中文").click()
    expect(studio.notices).to_contain_text(studio.say("settings.noTexts"))
    own_studio.start()
    expect(studio.notices).to_contain_text("The server is back.")
    expect(studio.page.get_by_role("alert").filter(has_text="server isn't answering")).to_be_hidden()
    studio.expect_words(TURNED_WORDS)
    # The cars continue too, with the newest words.
    expect(studio.block("leader", "right")).to_contain_class("motorcade-running")


@pytest.mark.soak
def test_every_example_opens_and_drives(open_page) -> None:
    studio = open_page()
    studio.page.get_by_role("button", name="Examples", exact=True).click()
    examples = studio.dialog("examples.title").get_by_role("listitem")
    expect(examples).not_to_have_count(0)
    for number in range(examples.count()):
        if number:
            studio.page.get_by_role("button", name="Examples", exact=True).click()
        title = examples.nth(number).locator("b").inner_text()
        examples.nth(number).get_by_role("button").click()
        expect(studio.name).to_have_value(title)
        expect(studio.words_table.get_by_role("rowheader").nth(1)).to_be_visible()
        expect(studio.diagnostics.filter(has_text="can't")).to_have_count(0)


def test_another_project_is_framed_however_far_the_stage_was_zoomed(show) -> None:
    studio = show(EXAMPLE)
    studio.page.get_by_role("application", name=studio.say("mat.canvas")).press("+")
    expect(studio.mat_button("frame")).to_be_visible()
    mat = {"format": "motorcade-mat/1", "name": "Far", "car": [{"at_m": [40, 40], "role": "leader"}]}
    studio.take({**EXAMPLE, "mat": mat})
    expect(studio.mat_button("frame")).to_have_count(0)


def test_escape_closes_a_hint_and_the_dialog_around_it_at_once(show) -> None:
    studio = show(EXAMPLE)
    studio.open_dialog("library")
    studio.page.get_by_role("dialog").get_by_role("button", name=studio.say("app.close")).hover()
    hint = studio.page.get_by_role("tooltip")
    expect(hint).to_be_visible()
    studio.page.keyboard.press("Escape")
    expect(hint.or_(studio.page.get_by_role("dialog"))).to_have_count(0)


def test_a_mat_is_saved_as_a_file_and_opened_in_another_project(open_page, tmp_path) -> None:
    studio = open_page(project=FOLLOWED)
    studio.look_up("swarm")
    with studio.page.expect_download() as download:
        studio.mat_button("save").click()
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    assert path.name == "Pair.mat.json"
    assert len(read_mat(path).starts) == 2

    studio.take(EXAMPLE)
    # The console tells of an answer that refuses.
    studio.forgive("400")
    with studio.page.expect_file_chooser() as chooser:
        studio.mat_button("open").click()
    chooser.value.set_files(path)
    studio.wait_until_stored('"name":"Pair"')
    studio.undo()
    studio.wait_until_stored('"name":"Table"')
    with studio.page.expect_file_chooser() as chooser:
        studio.mat_button("open").click()
    chooser.value.set_files({"name": "broken.toml", "mimeType": "", "buffer": b"format ="})
    expect(studio.notices).to_contain_text("broken.toml")


def test_printing_from_the_menu_leaves_the_page_as_it_was(open_page) -> None:
    """A browser pauses a page that asks to be printed: React Aria can't look for the focus there."""
    studio = open_page(project=EXAMPLE)
    studio.project_menu("export.print")
    turn_right(studio)


def test_examples_are_offered_where_their_pictures_cannot_be_fetched(open_page) -> None:
    studio = open_page()
    studio.forgive("Failed to load resource")
    studio.page.route("**/clips-*.js", lambda route: route.abort())
    with studio.page.expect_event("requestfailed"):
        studio.open_dialog("examples")
    expect(studio.dialog("examples.title").get_by_role("listitem").first).to_be_visible()
    expect(studio.notices).to_be_empty()
