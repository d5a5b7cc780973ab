"""A road is drawn on the stage, cars are put on it, and they follow it."""

import json
import math
import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from playwright.sync_api import FloatRect, Locator, expect

from motorcade.mats.model import Line, path_of
from support.studio_page import DESKTOP, PHONE, StudioPage
from support.studio_programs import PAIR
from support.waiting import wait_until

NEAR_M = 0.04
DRIVEN_S = 5
# From opening the page until the cars drive on a road that was drawn.
MOST_TAPS = 12
CONVOY = {
    "format": "motorcade-program/1",
    "profile": "classroom",
    "leader": [],
    "followers": {"accept_ir": True, "forward": True, "steps": []},
    "mat": {**PAIR, "car": [*PAIR["car"], {"at_m": [1, 1]}, {"at_m": [3, 1]}]},  # type: ignore[dict-item]
}


def stroke_around(box: FloatRect) -> list[tuple[float, float]]:
    """An oval as a hand draws it, in pixels of the page: it ends a little before its beginning."""
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    across, high = box["width"] * 0.3, box["height"] * 0.22
    angles = [2 * math.pi * 0.98 * k / 60 for k in range(61)]
    return [(middle[0] + across * math.cos(angle), middle[1] + high * math.sin(angle)) for angle in angles]


def saved_line(studio: StudioPage) -> list[dict[str, Any]]:
    """The lines of the mat in the project's file."""
    with studio.page.expect_download() as download:
        studio.project_menu("menu.saveFile")
    lines: list[dict[str, Any]] = json.loads(download.value.path().read_text(encoding="utf-8"))["mat"]["line"]
    return lines


def off_road_m(line: Line, x: float, y: float) -> float:
    """How far a point is from the line's middle."""
    far = math.inf
    for (ax, ay), (bx, by) in pairwise(path_of(line)):
        length = math.dist((ax, ay), (bx, by)) or 1
        share = min(1, max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length**2))
        far = min(far, math.dist((x, y), (ax + (bx - ax) * share, ay + (by - ay) * share)))
    return far


def test_a_convoy_follows_a_road_that_was_drawn_with_the_mouse(open_page) -> None:
    studio = open_page(project=CONVOY)
    studio.look_up("things")
    studio.mat_button("drawRoad").click()
    expect(studio.page.get_by_text(studio.say("mat.drawHint"))).to_be_visible()
    stage = studio.box(studio.page.get_by_role("application", name=studio.say("mat.canvas")))
    studio.stroke(stroke_around(stage))
    studio.mat_button("putConvoy").first.click()
    expect(studio.page.get_by_text(studio.say("mat.drawHint"))).to_be_hidden()

    block = studio.say("blocks.follow_line").partition("\n")[0]
    for editor in ("leader", "followers"):
        if editor == "followers" and not studio.editor(editor).is_visible():
            studio.program_followers()
        studio.drag_out(editor, "sense", block, below=studio.hat(editor))
        studio.type_into(studio.field(studio.block(editor, block), "1"), "12")
    studio.look_up("things")
    studio.run_at("4×")
    studio.play()
    wait_until(lambda: seconds(studio) >= DRIVEN_S)
    studio.mat_button("pause").click()

    line = saved_line(studio)
    assert len(line) == 1
    assert line[0]["closed"]
    road = Line(tuple((x, y) for x, y in line[0]["points_m"]), bend_m=line[0]["bend_m"], closed=True)
    for car in range(4):
        studio.choose_car(car)
        x, y = place(studio)
        assert off_road_m(road, x, y) < NEAR_M, f"car {car} is at {x}, {y}"
    studio.undo()


def town_in(studio: StudioPage) -> Callable[[float, float], tuple[float, float]]:
    """Where a point of the town is on the page while roads are drawn, as a first stroke shows, which is undone."""
    stage = studio.box(studio.stage)
    left, right = ((stage["x"] + share * stage["width"], stage["y"] + stage["height"] / 2) for share in (0.3, 0.7))
    studio.stroke([left, right])
    line = saved_line(studio)[-1]["points_m"]
    studio.undo()
    per_m = (right[0] - left[0]) / (line[-1][0] - line[0][0])
    return lambda x, y: (left[0] + (x - line[0][0]) * per_m, left[1] - (y - line[0][1]) * per_m)


def loop_in_town() -> list[tuple[float, float]]:
    """A loop around the town's roads, inside its corners' trees."""
    near, far_x, far_y, bend = 0.22, 3.38, 2.58, 0.6
    corners = [(far_x - bend, near + bend, -90), (far_x - bend, far_y - bend, 0)]
    corners += [(near + bend, far_y - bend, 90), (near + bend, near + bend, 180)]
    return [
        (x + bend * math.cos(math.radians(angle + turn)), y + bend * math.sin(math.radians(angle + turn)))
        for x, y, angle in corners
        for turn in range(0, 91, 10)
    ]


@pytest.mark.parametrize(
    ("size", "touches"),
    [*(pytest.param(DESKTOP, touches, marks=pytest.mark.soak) for touches in (False, True)), (PHONE, True)],
    ids=["mouse", "touch", "phone"],
)
def test_a_beginner_draws_a_road_that_a_convoy_follows_with_few_taps(open_page, size, touches) -> None:
    studio = open_page(plain=True, level="start", size=size, has_touch=touches)
    taps = 1  # It ends the tour.

    def tap(thing: Locator, **more: Any) -> None:
        nonlocal taps
        taps += 1
        studio.press(thing, **more)

    things = studio.page.get_by_role("tab", name=studio.say("drawer.things"), exact=True)
    tap(things)
    tap(studio.mat_button("drawRoad"))
    at = town_in(studio)
    studio.stroke([at(x, y) for x, y in loop_in_town()])
    taps += 1
    tap(studio.mat_button("putConvoy").first)
    if size == PHONE:
        # There the drawer has the room of the blocks.
        tap(things)
    # What the stage has, the first level's palette has.
    tap(studio.editor("leader").get_by_role("treeitem", name=studio.say("drawers.sense"), exact=True))
    follow = studio.say("startBlocks.follow_line").partition("\n")[0]
    tap(studio.editor("leader").get_by_role("option", name=follow).last, position={"x": 12, "y": 12})
    tap(studio.mat_button("play"))
    assert taps <= MOST_TAPS
    wait_until(lambda: seconds(studio) >= 2)
    studio.mat_button("pause").click()
    drawn = saved_line(studio)[-1]
    road = Line(tuple((x, y) for x, y in drawn["points_m"]), bend_m=drawn["bend_m"], closed=True)
    for car in range(8):
        studio.choose_car(car)
        x, y = place(studio)
        assert off_road_m(road, x, y) < NEAR_M, f"car {car} is at {x}, {y}"


def seconds(studio: StudioPage) -> float:
    minutes, rest = studio.clock.inner_text().split(":")
    return 60 * int(minutes) + float(rest)


def place(studio: StudioPage) -> tuple[float, float]:
    """Where the chosen car is, in metres, as the page tells it."""
    told = re.compile(r"At x (.+) m, y (.+) m, facing")
    found = told.search(studio.page.get_by_text(told).inner_text())
    assert found
    return float(found[1]), float(found[2])
