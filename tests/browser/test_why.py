"""The button under 'Why?' carries out what the answer names: the run is another one then, and undo takes it back."""

import re
from typing import Any

import pytest
from playwright.sync_api import expect

from motorcade.locales import catalogue
from support.soak import SOAK
from support.studio_page import PHONE
from support.studio_programs import EXAMPLE, FORWARD

TABLE = {"format": "motorcade-mat/1", "name": "Table", "size_m": [4, 3]}
LED = {"led": {"which": 1, "seconds": 3}}
FAST = {"drive": {"direction": "forward", "speed": 3, "seconds": 3}}


def project(
    *cars: tuple[float, float], leads: int = 1, forward=False, steps: Any = (LED,), leader=None, **mat: Any
) -> dict[str, Any]:
    """Cars at these places, of which the first ones lead; the followers are told something unless ``steps`` is None."""
    placed = [{"at_m": at, "role": "leader" if k < leads else "follower"} for k, at in enumerate(cars)]
    told = None if steps is None else {"accept_ir": True, "forward": forward, "steps": list(steps)}
    wait = {"wait": {"seconds": 1}}
    return {**EXAMPLE, "leader": [leader or wait], "followers": told, "mat": {**TABLE, "car": placed, **mat}}


def blocked(**mat: Any) -> dict[str, Any]:
    return project((1, 1), *mat.pop("cars", ()), leader={"repeat": {"times": 20, "steps": [FAST]}}, steps=None, **mat)


# By remedy: the project, the car that is asked, and the answer before and after.
CASES = {
    "range_mm": (project((1, 1), (2.5, 1)), 1, "why-too-far", "why-heard"),
    "remove-wall": (blocked(wall=[{"from_m": [1.4, 0.5], "to_m": [1.4, 1.5]}]), 0, "why-against-wall", "why-leads"),
    "remove-disc": (blocked(disc=[{"centre_m": [1.5, 1], "radius_m": 0.1}]), 0, "why-against-disc", "why-leads"),
    "remove-polygon": (
        blocked(polygon=[{"corners_m": [[1.4, 0.8], [1.7, 0.8], [1.7, 1.2], [1.4, 1.2]]}]),
        0,
        "why-against-polygon",
        "why-leads",
    ),
    "remove-car": (blocked(cars=((1.4, 1),)), 0, "why-against-car", "why-leads"),
    "move": (
        project((1, 1), (1.5, 1), wall=[{"from_m": [1.25, 0.5], "to_m": [1.25, 1.5]}]),
        1,
        "why-hidden",
        "why-heard",
    ),
    "leader": (project((1, 1), (1.5, 1), leads=0), 1, "why-no-leader", "why-heard"),
    "forward": (project((1, 1), (1.8, 1), (2.6, 1)), 2, "why-not-passed-on", "why-heard"),
    "listen": (
        project((1, 1), (1.5, 1), steps=({**FORWARD, "accept_ir": False},)),
        1,
        "why-does-not-listen",
        "why-heard",
    ),
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
