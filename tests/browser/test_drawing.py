"""The mat drawn by WebGL, as for most users; in a module of its own, since it is slow without a graphics processor."""

import io

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect

from support.browser_profiles import Profiles, launched
from support.studio_page import StudioPage
from support.studio_programs import EXAMPLE, FOLLOWED, PAIR
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
# A graphics processor, as far as the page's question goes whether there is a fast one; a program draws in its place.
FAST = """
const context = HTMLCanvasElement.prototype.getContext;
const answers = { isContextLost: false, getExtension: null, getParameter: "GPU" };
const gpu = new Proxy({ canvas: {} }, { get: (own, key) => own[key] ?? (() => (key in answers ? answers[key] : {})) });
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  return options?.failIfMajorPerformanceCaveat ? gpu : context.call(this, kind, options);
};
"""
# One of each thing that a mat may have, near the cars.
FULL = {
    **FOLLOWED,
    "mat": {
        **PAIR,
        "edge": "wall",
        "line": [{"points_m": [[0.4, 1.25], [2.5, 1.25], [2.5, 2.6]], "bend_m": 0.2}],
        "spot": [{"centre_m": [1.55, 1.6], "radius_m": 0.12}],
        "patch": [{"corners_m": [[1.5, 0.9], [1.8, 0.9], [1.65, 1.1]]}],
        "wall": [{"from_m": [1.6, 1.8], "to_m": [2.2, 1.8]}],
        "disc": [{"centre_m": [2.6, 1.0], "radius_m": 0.1}],
        "polygon": [{"corners_m": [[2.2, 0.8], [2.5, 0.8], [2.35, 1.0]]}],
        "person": [{"path": [[0, 2.3, 1.6]]}],
    },
}


@pytest.fixture(scope="module")
def browser(playwright, chromium_path):
    """A browser that draws WebGL."""
    with launched(playwright, chromium_path) as browser:
        yield browser


@pytest.fixture(scope="module")
def profiles(browser):
    return Profiles(browser, few_pictures=False)


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


def stage_of(page: StudioPage) -> np.ndarray:
    """The colours of the stage, (height, width, 3)."""
    # The whole mat, wherever the camera was.
    page.page.get_by_role("application", name=page.say("mat.canvas")).press("a")
    shown = page.page.locator("#stage canvas").first.screenshot()
    return np.asarray(Image.open(io.BytesIO(shown)).convert("RGB"), dtype=int)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """The share of pixels whose colours differ more than an edge that is drawn more softly."""
    return float((abs(one - other) > 40).any(axis=2).mean())


def test_webgl_and_a_canvas_show_the_same_mat(browser, studio) -> None:
    pages = [StudioPage.open(browser, studio.url, project=FULL, script=script) for script in ("", FAST)]
    kinds = [page.page.evaluate("document.querySelector('#stage canvas').getContext('2d') !== null") for page in pages]
    assert kinds == [True, False]
    # Nothing moves. The road alone covers more of the stage than may differ.
    wait_until(lambda: apart(*map(stage_of, pages)) < 0.01)
    for page in pages:
        page.context.close()


def test_a_page_where_nothing_moves_draws_nothing_and_is_silent_without_work(open_page) -> None:
    studio = open_page(project=FOLLOWED, script=WATCHED)
    studio.play()
    wait_until(lambda: studio.page.evaluate("contexts.some(({ state }) => state === 'running')"))
    assert not studio.page.evaluate(RESTS)
    studio.mat_button("pause").click()
    wait_until(lambda: studio.page.evaluate(RESTS))
