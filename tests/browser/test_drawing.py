"""The mat drawn by WebGL, as for most users; in a module of its own, since it is slow without a graphics processor."""

import pytest
from playwright.sync_api import expect

from support.browser_profiles import Profiles, launched
from support.studio_page import StudioPage
from support.studio_programs import EXAMPLE, FOLLOWED
from support.waiting import wait_until

# How a block looks while some car runs it.
RUNNING = "motorcade-running"
# Counts the pictures that the page asks for, and keeps what it sounds with.
WATCHED = """
asked = 0;
const ask = requestAnimationFrame;
requestAnimationFrame = (draw) => { asked++; return ask(draw); };
contexts = [];
AudioContext = class extends AudioContext { constructor(...given) { super(...given); contexts.push(this); } };
"""
# Whether the page asks for no picture of its own while the screen shows 20, and nothing sounds.
RESTS = """async () => {
  const before = asked;
  for (let k = 0; k < 20; k++) await new Promise(requestAnimationFrame);
  return asked - before === 20 && contexts.every(({ state }) => state !== "running");
}"""


@pytest.fixture(scope="module")
def browser(playwright, chromium_path):
    """A browser that draws WebGL."""
    with launched(playwright, chromium_path) as browser:
        yield browser


@pytest.fixture(scope="module")
def profiles(browser):
    return Profiles(browser)


def test_a_thousand_followers_fit_on_the_mat(open_page) -> None:
    studio = open_page(project=FOLLOWED)
    studio.look_up("swarm")
    followers = studio.page.get_by_role("textbox", name="Followers")
    followers.fill("1000")
    followers.press("Enter")
    expect(studio.page.get_by_text("1000 followers stand still")).to_be_visible()
    studio.play()
    expect(studio.block("followers", "right")).to_contain_class(RUNNING)


def test_webgl_that_is_a_program_is_found_by_its_speed_whatever_its_name(browser, studio) -> None:
    name = "WebGLRenderingContext.prototype.getParameter = () => 'Apple GPU'"
    studio = StudioPage.open(browser, studio.url, project=EXAMPLE, script=name)
    stage = studio.page.locator("#stage canvas").first
    assert stage.evaluate("canvas => canvas.getContext('2d') !== null")
    studio.context.close()


def test_a_page_where_nothing_moves_draws_nothing_and_is_silent_without_work(open_page) -> None:
    studio = open_page(project=FOLLOWED, script=WATCHED)
    studio.play()
    wait_until(lambda: studio.page.evaluate("contexts.some(({ state }) => state === 'running')"))
    assert not studio.page.evaluate(RESTS)
    studio.mat_button("pause").click()
    wait_until(lambda: studio.page.evaluate(RESTS))
