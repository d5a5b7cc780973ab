"""Accessibility: small screens, touch, themes, zoom, screen readers, reduced motion, and first visits."""

import pytest
from playwright.sync_api import expect

from support.layout import serious_barriers
from support.soak import SOAK
from support.studio_page import PHONE, StudioPage
from support.studio_programs import EXAMPLE, FOLLOWED

DIALOGS = ("upload", "library", "examples", "share", "help")


def assert_no_barriers(studio: StudioPage) -> None:
    assert serious_barriers(studio.page) == []


def assert_fits_screen(studio: StudioPage) -> None:
    """The page is not wider than the screen."""
    assert studio.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


def test_a_first_visit_leads_to_a_swarm_by_the_visitors_own_hand(open_page) -> None:
    studio = open_page(tour=True, plain=True, level="start")
    page = studio.page
    assert_no_barriers(studio)
    expect(studio.clock).not_to_have_text("0:00.0")
    page.get_by_role("button", name=studio.say("tour.welcome.next"), exact=True).click()
    # The town drove; the pupil's own world waits for the pupil.
    expect(page.get_by_text(studio.say("tour.drag.text"))).to_be_visible()
    expect(studio.clock).to_have_text("0:00.0")
    studio.drag_out("followers", "drive", "drive", below=studio.block("followers", "The others"))
    expect(page.get_by_text(studio.say("tour.choose.text"))).to_be_visible()
    studio.pick(studio.field(studio.block("followers", "drive"), "forward"), "left")
    expect(page.get_by_text(studio.say("tour.play.text"))).to_be_visible()
    expect(studio.clock).to_have_text("0:00.0")
    studio.play()
    expect(page.get_by_role("complementary")).to_have_count(0)
    expect(page.get_by_text("12 followers turn left")).to_be_visible()
    # Nobody who comes back sees it again, unless they ask for it; then each of its cards can be skipped.
    page.reload()
    studio.wait_until_ready()
    expect(page.get_by_role("complementary")).to_have_count(0)
    studio.open_dialog("help")
    page.get_by_role("button", name=studio.say("tour.again")).click()
    page.get_by_role("button", name=studio.say("project.replaceYes")).click()
    for step in ("drag", "play"):
        expect(page.get_by_text(studio.say(f"tour.{step}.text"))).to_be_visible()
        page.get_by_role("button", name=studio.say("tour.next"), exact=True).click()
    expect(page.get_by_role("complementary")).to_have_count(0)


@pytest.mark.parametrize(
    ("size", "least"),
    [((1440, 900), 0.45), ((1366, 768), 0.45), ((1024, 768), 0.4), (PHONE, 0.4)] if SOAK else [((1024, 768), 0.4)],
)
def test_the_stage_is_the_largest_part_of_the_page(open_page, size, least) -> None:
    studio = open_page(size=size, plain=True, project=FOLLOWED)
    stage = studio.box(studio.page.get_by_role("region", name=studio.say("mat.title"), exact=True))
    assert stage["width"] * stage["height"] >= least * size[0] * size[1]
    assert_fits_screen(studio)


def test_on_a_phone_the_stage_stays_touch_builds_and_two_fingers_zoom(open_page) -> None:
    studio = open_page(size=PHONE, has_touch=True, is_mobile=True, project=EXAMPLE)
    assert_fits_screen(studio)
    # A tab stays under the finger that has scrolled to it: its tap comes before the page hears of the scrolling.
    words = studio.page.get_by_role("tab", name=studio.say("drawer.words"), exact=True)
    expect(words).not_to_be_in_viewport()
    words.evaluate("(tab) => { tab.scrollIntoView(); tab.focus({ preventScroll: true }) }")
    expect(words).to_be_in_viewport(ratio=1)
    stage, blocks = (
        studio.page.get_by_role("region", name=studio.say(key), exact=True) for key in ("mat.title", "editors.leader")
    )
    # One tap makes the blocks the larger part, the next one the stage again.
    for button, larger, smaller in (("largerBlocks", blocks, stage), ("largerStage", stage, blocks)):
        studio.page.get_by_role("button", name=studio.say(f"editors.{button}")).tap()
        assert studio.box(larger)["height"] > 1.2 * studio.box(smaller)["height"]
        expect(studio.mat_button("play")).to_be_in_viewport()
    studio.drag_out("leader", "drive", "drive", below=studio.block("leader", "left"))
    studio.expect_words(["03000000", "65800000", "6a800000", "64800000"])
    expect(studio.editor("leader")).to_be_hidden()
    expect(studio.mat_button("play")).to_be_visible()
    assert_fits_screen(studio)
    studio.page.get_by_role("button", name=studio.say("drawer.close"), exact=True).tap()
    zoom_by_two_fingers(studio)


def zoom_by_two_fingers(studio: StudioPage) -> None:
    mat = studio.page.get_by_role("application", name=studio.say("mat.canvas"))
    # A phone has no room to show it.
    scale = mat.locator("[data-part=scale]")
    expect(scale).to_be_hidden()
    width, box = scale.evaluate("scale => scale.style.width"), studio.box(mat)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    finger = studio.context.new_cdp_session(studio.page)

    def touch(kind: str, apart: float) -> None:
        points = [{"x": x - apart, "y": y, "id": 0}, {"x": x + apart, "y": y, "id": 1}] if apart else []
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 20)
    for apart in (30, 45, 60):
        touch("touchMove", apart)
    touch("touchEnd", 0)
    expect(scale).not_to_have_text("1 m")
    expect(scale).not_to_have_css("width", width)


@pytest.mark.soak
def test_reduced_motion_leaves_only_the_cars_moving(open_page) -> None:
    studio = open_page(project=EXAMPLE, reduced_motion="reduce")
    running = "() => document.getAnimations().filter(({ playState }) => playState === 'running').length"
    for name in DIALOGS:
        studio.open_dialog(name)
        assert studio.page.evaluate(running) == 0, name
        studio.page.keyboard.press("Escape")
        expect(studio.page.get_by_role("dialog")).to_have_count(0)
    studio.play()
    studio.expect_moving()
    assert studio.page.evaluate(running) == 0


def test_a_part_that_cannot_be_loaded_leaves_the_rest(open_page) -> None:
    studio = open_page(project=EXAMPLE)
    studio.forgive("ERR_FAILED", "dynamically imported module", "<ErrorBoundary>")
    studio.page.route("**/stage-*.js", lambda route: route.abort())
    studio.page.reload()
    alert = studio.page.get_by_role("alert").filter(has_text=studio.say("app.failed"))
    expect(alert).to_be_visible()
    studio.expect_words(["02000000", "65800000", "6a800000"])
    studio.page.route("**/HelpDialog*.js", lambda route: route.abort())
    studio.page.get_by_role("button", name=studio.say("help.title"), exact=True).click()
    expect(studio.notices).to_contain_text(studio.say("app.failed"))
    studio.page.unroute_all()
    alert.get_by_role("button", name=studio.say("app.reload")).click()
    studio.wait_until_ready()
    studio.open_dialog("help")


@pytest.mark.soak
def test_everything_is_in_reach_at_twice_the_size(open_page) -> None:
    studio = open_page(size=(640, 400), device_scale_factor=2, project=FOLLOWED)
    for panel in ("words", "swarm", "things", "timeline"):
        studio.look_up(panel)
        assert_fits_screen(studio)
    studio.page.get_by_role("button", name=studio.say("drawer.close"), exact=True).click()
    for editor in ("followers", "leader"):
        studio.page.get_by_role("radio", name=studio.say(f"editors.{editor}"), exact=True).click()
        expect(studio.editor(editor)).to_be_visible()
        assert_fits_screen(studio)
    for name in DIALOGS:
        studio.open_dialog(name)
        assert_fits_screen(studio)
        studio.page.keyboard.press("Escape")
        expect(studio.page.get_by_role("dialog")).to_have_count(0)


@pytest.mark.parametrize(
    ("theme", "option"), [("dark", "Dark"), pytest.param("contrast", "High contrast", marks=pytest.mark.soak)]
)
def test_a_theme_reaches_page_and_blocks_and_is_remembered(open_page, theme, option) -> None:
    studio = open_page(project=EXAMPLE)
    body, block = studio.page.locator("body"), studio.block("leader", "left")
    before = [body.screenshot(), block.screenshot()]
    studio.choose("Language and colours", item=option)
    expect(studio.page.locator(f"[data-theme={theme}]")).to_have_count(1)
    assert all(old != new for old, new in zip(before, [body.screenshot(), block.screenshot()], strict=True))
    studio.page.reload()
    expect(studio.page.locator(f"[data-theme={theme}]")).to_have_count(1)


def test_a_menu_of_a_block_is_no_higher_than_the_blocks_of_a_phone(open_page) -> None:
    studio = open_page(size=PHONE, plain=True)
    hat = studio.hat("leader")
    studio.drag_out("leader", "drive", "drive", below=hat)
    studio.field(studio.block("leader", "drive"), "+").click()
    first = studio.page.get_by_role("option").first
    expect(first).to_be_in_viewport(ratio=1)
    last = studio.page.get_by_role("option").last
    last.scroll_into_view_if_needed()
    # The menu's edge may lie within a pixel.
    expect(last).to_be_in_viewport(ratio=0.97)
