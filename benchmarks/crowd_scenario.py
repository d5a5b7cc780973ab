"""The scenario for benchmarks of crowds: a walled mat for any number of cars, with all physics except wheel noise."""

import json
import math
from typing import TYPE_CHECKING

import numpy as np

from motorcade.mats import Mat, parse_mat
from motorcade.mats.schema import FORMAT
from motorcade.program.compiler import compile_program
from motorcade.program.model import Followers, Program
from motorcade.program.steps import avoid, forward, led, left, pir, together, voice, wander

if TYPE_CHECKING:
    # `benchmarks/against.py` runs this with older sources, too.
    from motorcade.program.steps import Step

TICK_MS = 20
NEIGHBOURS = 6.5  # mean number of cars within a car's range of infrared
RANGE_M = 1.0
AREA_OF_OBSTACLE_M2 = 100
CARS_OF_LEADER = 100
CARS_OF_PERSON = 2_000
VOICES = 600  # one a second
PHYSICS = {"capture_ratio": 4, "beam_half_angle_deg": 170, "bit_error_rate": 0.0001}


def programs(tagged: bool = False) -> list[bytes]:
    """Images for the leaders, so that they send different words at a time; some words are passed on."""
    leader = [together(forward(3), led(0, 1)), left(1), wander(3), together(forward(2), voice())]
    words: list[Step] = [
        together(wander(3), led(0, 2), forward=True),
        together(forward(3, speed=2), avoid(2, 3)),
        together(wander(3), pir()),
        together(wander(2), voice(), forward=True),
        together(wander(3), avoid(1, 3), pir(), led(1, 1)),
    ]
    turned = [words[k:] + words[:k] for k in range(len(words))]
    return [
        compile_program(Program([*leader, wander(1 + k % 3)], Followers(steps, tagged=tagged))).image
        for k, steps in enumerate(turned)
    ]


def side_m(cars: int) -> float:
    """Side of the square in which ``cars`` cars have NEIGHBOURS on average, the cars at its edge included."""
    low, high = 1.5 * RANGE_M, math.sqrt(cars)
    for _ in range(60):
        side = (low + high) / 2
        r = RANGE_M / side
        # The probability of two points anywhere in a unit square to be less than r apart.
        if (cars - 1) * (math.pi * r**2 - 8 / 3 * r**3 + r**4 / 2) > NEIGHBOURS:
            low = side
        else:
            high = side
    return round(side, 3)


def crowd_mat(cars: int) -> Mat:
    """The mat, with its cars placed at random."""
    side, dice = side_m(cars), np.random.RandomState(cars)
    places = dice.uniform(0.6, side - 0.6, (max(round(side**2 / AREA_OF_OBSTACLE_M2), 1), 2)).round(3).tolist()
    document = {
        "format": FORMAT,
        "name": f"crowd of {cars} cars",
        "tick_ms": TICK_MS,
        "size_m": [side, side],
        "edge": "wall",
        "wall": [{"from_m": [x - 0.4, y - 0.15], "to_m": [x + 0.4, y + 0.15]} for x, y in places[::3]],
        "disc": [{"centre_m": place, "radius_m": 0.2} for place in places[1::3]],
        "polygon": [{"corners_m": [[x - 0.2, y - 0.2], [x + 0.2, y - 0.2], [x, y + 0.3]]} for x, y in places[2::3]],
        "person": [_person(side, dice) for _ in range(max(cars // CARS_OF_PERSON, 1))],
        "voice": [_voice(at_s, side, dice) for at_s in range(1, VOICES + 1)],
        "crowd": [
            {
                "cars": cars,
                "leaders": max(cars // CARS_OF_LEADER, 1),
                "corner_m": [0.01, 0.01],
                "size_m": [side - 0.02, side - 0.02],
                "spacing_m": 0.16,
                "placement": "random",
                "heading_deg": "random",
            }
        ],
        "physics": PHYSICS,
    }
    return parse_mat(json.dumps(document), "crowd", "JSON")


def _person(side: float, dice: np.random.RandomState) -> dict[str, object]:
    """A person who walks around four places at 1 m/s."""
    corners = dice.uniform(0, min(side, 8), (4, 2)) + dice.uniform(0, max(side - 8, 0), 2)
    path, t_s = [], 0.0
    for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        path.append([round(t_s, 3), *here.round(3).tolist()])
        t_s += max(math.dist(here, there), 0.1)
    return {"path": [*path, [round(t_s, 3), *path[0][1:]]], "repeats": True}


def _voice(at_s: int, side: float, dice: np.random.RandomState) -> dict[str, object]:
    """A voice at any place that says stop or, one second later, go; it is heard up to a quarter of the side away."""
    centre_m = dice.uniform(0, side, 2).round(3).tolist()
    return {"at_s": at_s, "word": ("go", "stop")[at_s % 2], "centre_m": centre_m, "radius_m": side / 4}


def neighbours(x_m: np.ndarray, y_m: np.ndarray) -> float:
    """How many cars are within RANGE_M of a car: the mean over up to 2,000 of the cars."""
    order = np.argsort(x_m)
    x_m, y_m = x_m[order], y_m[order]
    some = np.linspace(0, len(x_m) - 1, min(len(x_m), 2000)).astype(int)
    first = np.searchsorted(x_m, x_m[some] - RANGE_M)
    end = np.searchsorted(x_m, x_m[some] + RANGE_M, side="right")
    found = 0
    for one, low, high in zip(some, first, end, strict=True):
        away = np.hypot(x_m[low:high] - x_m[one], y_m[low:high] - y_m[one])
        found += int(np.count_nonzero(away <= RANGE_M)) - 1
    return found / len(some)
