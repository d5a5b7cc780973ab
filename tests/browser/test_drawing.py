"""The mat as it is painted, and what that costs."""

import io

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect

from support.browser_profiles import Profiles
from support.studio_page import StudioPage
from support.studio_programs import FOLLOWED, PAIR
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
# The middle of a road and the line on it, a box and a tin, on a table.
ROAD, DARK_LINE, BOX, TIN = (134, 140, 150), (23, 24, 28), (196, 71, 58), (79, 124, 172)
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
def profiles(browser):
    return Profiles(browser, few_pictures=False)


def test_a_thousand_followers_fit_on_the_mat(show) -> None:
    studio = show(FOLLOWED)
    studio.look_up("swarm")
    followers = studio.page.get_by_role("textbox", name="Followers")
    followers.fill("1000")
    followers.press("Enter")
    expect(studio.page.get_by_text("1000 followers stand still")).to_be_visible()
    studio.play()
    expect(studio.block("followers", "right")).to_contain_class(RUNNING)


def stage_of(studio: StudioPage) -> np.ndarray:
    """The colours of the stage, (height, width, 3)."""
    # The whole mat, wherever the camera was.
    studio.page.get_by_role("application", name=studio.say("mat.canvas")).press("a")
    shown = studio.page.locator("#stage canvas").first.screenshot()
    return np.asarray(Image.open(io.BytesIO(shown)).convert("RGB"), dtype=int)


def share_of(stage: np.ndarray, colour: tuple[int, int, int]) -> float:
    """The share of pixels that have a colour, as far as the reach of infrared lets it show."""
    return float((abs(stage - np.array(colour)) < 12).all(axis=2).mean())


def test_everything_that_lies_and_stands_on_a_mat_is_seen(show) -> None:
    studio = show(FULL)
    # The smallest covers half a thousandth of the stage.
    wait_until(lambda: all(share_of(stage_of(studio), colour) > 0.0002 for colour in (ROAD, DARK_LINE, BOX, TIN)))


def test_a_page_where_nothing_moves_draws_nothing_and_is_silent_without_work(open_page) -> None:
    studio = open_page(project=FOLLOWED, script=WATCHED)
    studio.play()
    wait_until(lambda: studio.page.evaluate("contexts.some(({ state }) => state === 'running')"))
    assert not studio.page.evaluate(RESTS)
    studio.mat_button("pause").click()
    wait_until(lambda: studio.page.evaluate(RESTS))
