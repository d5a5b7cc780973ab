"""The button under 'Why?' carries out what the answer names: the run is another one then, and undo takes it back."""

import re
from typing import Any

import pytest
from playwright.sync_api import expect

from motorcade.locales import catalogue
from support.soak import SOAK
from support.studio_page import PHONE
from support.studio_programs import EXAMPLE

FAST = {"drive": {"direction": "forward", "speed": 3, "seconds": 3}}


def project(*followers: tuple[float, float], leader: dict[str, Any], steps: Any, **mat: Any) -> dict[str, Any]:
    """A leader at one place and followers at these, with their programs."""
    cars = [{"at_m": (1, 1), "role": "leader"}, *({"at_m": at, "role": "follower"} for at in followers)]
    table = {"format": "motorcade-mat/1", "name": "Table", "size_m": [4, 3], "car": cars, **mat}
    return {**EXAMPLE, "leader": [leader], "followers": steps, "mat": table}


LIT = {"accept_ir": True, "forward": False, "steps": [{"led": {"which": 1, "seconds": 3}}]}
AHEAD = {"repeat": {"times": 20, "steps": [FAST]}}
WALL = {"from_m": [1.4, 0.5], "to_m": [1.4, 1.5]}
# By remedy: the project, the car that is asked, and the answer before and after.
CASES = {
    "range_mm": (project((2.5, 1), leader={"wait": {"seconds": 1}}, steps=LIT), 1, "why-too-far", "why-heard"),
    "remove-wall": (project(leader=AHEAD, steps=None, wall=[WALL]), 0, "why-against-wall", "why-leads"),
}
WAYS = [(remedy, language, way) for remedy in CASES for language in ("en", "zh") for way in ("mouse", "keyboard")]
QUICK = [("range_mm", "zh", "keyboard")]


def answer(language: str, code: str) -> re.Pattern[str]:
    """A sentence of the catalogue, with any values."""
    return re.compile(".+".join(map(re.escape, re.split(r"\{\w+\}", catalogue(language)["phrases"][code]))))


@pytest.mark.parametrize(
    ("remedy", "size"), [pytest.param("range_mm", (1366, 768), marks=pytest.mark.soak), ("remove-wall", PHONE)]
)
def test_a_tapped_bubble_and_a_tapped_car_answer_on_the_stage(open_page, remedy: str, size: tuple[int, int]) -> None:
    given, car, code, _ = CASES[remedy]
    studio = open_page(project=given, level="start", plain=True, size=size, language="zh")
    studio.play()
    bubble = studio.page.locator(f"[data-car='{car}']")
    bubble.click()
    card = studio.page.locator("#stage").get_by_role("region", name=studio.say("mat.car", number=car))
    expect(card.get_by_text(answer("zh", code))).to_be_visible()
    expect(studio.mat_button(f"remedies.{remedy}")).to_be_visible()
    inner, outer = studio.box(card), studio.box(studio.page.locator("#stage"))
    assert outer["x"] <= inner["x"]
    assert inner["x"] + inner["width"] <= outer["x"] + outer["width"]
    assert outer["y"] <= inner["y"]
    assert inner["y"] + inner["height"] <= outer["y"] + outer["height"]
    card.get_by_role("button", name=studio.say("app.dismiss")).click()
    expect(card).to_have_count(0)
    # The tip of the bubble is the car. A bubble comes and goes: its box is found in one step.
    place = bubble.evaluate("bubble => bubble.getBoundingClientRect().toJSON()")
    studio.page.mouse.click(place["x"] + place["width"] / 2, place["y"] + place["height"] + 12)
    expect(card).to_be_visible()


@pytest.mark.parametrize(("remedy", "language", "way"), WAYS if SOAK else QUICK)
def test_the_button_changes_the_run_and_undo_takes_that_back(open_page, remedy: str, language: str, way: str) -> None:
    given, car, before, after = CASES[remedy]
    studio = open_page(project=given, language=language)
    studio.play()
    studio.choose_car(car)
    button = studio.mat_button(f"remedies.{remedy}")
    expect(studio.page.get_by_text(answer(language, before))).to_be_visible()
    if way == "mouse":
        button.click()
    else:
        for _ in range(60):
            if button.evaluate("button => button === document.activeElement"):
                break
            studio.page.keyboard.press("Tab")
        expect(button).to_be_focused()
        studio.page.keyboard.press("Enter")
    expect(button).to_have_count(0)
    if studio.mat_button("play").count():
        studio.play()
    studio.choose_car(car)
    expect(studio.page.get_by_text(answer(language, after))).to_be_visible()
    undo = studio.page.get_by_role("button", name=studio.say("history.undo"), exact=True)
    undo.click()
    expect(undo).to_be_disabled()
