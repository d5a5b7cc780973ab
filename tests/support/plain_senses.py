"""What a car of the plain world senses: an obstacle, a person, a voice; it checks everything in the world each time."""

import math
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.engine import layout
from motorcade.engine.geometry import COSINES, FAR_UM, cosine, disc_to_cone, segment_in_cone, sine
from motorcade.mats import Person
from motorcade.mats.model import Line, path_of

if TYPE_CHECKING:
    from support.plain_world import PlainWorld


def ahead_of(heading: int) -> tuple[float, float]:
    """The direction of a binary angle, as the kernels compute it."""
    cosines: Any = COSINES
    return cosine(heading, cosines), sine(heading, cosines)


def disc_in_cone(ahead: float, aside: float, radius: float, cone_cos: float, cone_sin: float) -> float:
    distance, outside = disc_to_cone(ahead, aside, radius, cone_cos, cone_sin)
    return max(distance, 0.0) if outside <= 0.0 else FAR_UM


def obstacle_mm(world: "PlainWorld", car: int) -> int:
    ahead_x, ahead_y = ahead_of(world.heading[car])
    radius, cone = world.rules.radius, (world.rules.cone_cos, world.rules.cone_sin)

    def seen(x: float, y: float) -> tuple[float, float]:
        return x * ahead_x + y * ahead_y, y * ahead_x - x * ahead_y

    nearest = FAR_UM
    for other, (x, y) in enumerate(zip(world.x, world.y, strict=True)):
        if other != car:
            ahead, aside = seen(x - world.x[car], y - world.y[car])
            nearest = min(nearest, disc_in_cone(ahead - radius, aside, radius, *cone))
    front_x, front_y = world.x[car] + radius * ahead_x, world.y[car] + radius * ahead_y
    for disc_x, disc_y, disc_radius in world.discs:
        nearest = min(nearest, disc_in_cone(*seen(disc_x - front_x, disc_y - front_y), disc_radius, *cone))
    for x0, y0, x1, y1 in world.walls:
        ends = *seen(x0 - front_x, y0 - front_y), *seen(x1 - front_x, y1 - front_y)
        nearest = min(nearest, segment_in_cone(*ends, *cone))
    whole = int(nearest) // 1000
    return whole if nearest < FAR_UM and whole <= world.rules.ultrasonic_range_mm else NOTHING_IN_SIGHT_MM


def dark_floor(world: "PlainWorld", car: int) -> int:
    floor, (ahead_x, ahead_y) = world.profile.floor, ahead_of(world.heading[car])
    front_x, front_y = (at[car] + floor.ahead_mm * 1000 * by for at, by in ((world.x, ahead_x), (world.y, ahead_y)))
    dark = 0
    for sensor, side in ((1, 1), (2, -1)):
        aside = side * floor.apart_mm * 500
        x, y = front_x - aside * ahead_y, front_y + aside * ahead_x
        dark += sensor * is_dark(world, math.floor(x + 0.5), math.floor(y + 0.5))
    return dark


@cache
def _path_um(line: Line) -> list[tuple[int, int]]:
    """The points of a line in µm: computed once, since each car asks for them in each tick."""
    return [(round(px * 1e6), round(py * 1e6)) for px, py in path_of(line)]


def is_dark(world: "PlainWorld", x: int, y: int) -> bool:
    mat = world.mat
    for line in mat.lines:
        for (x0, y0), (x1, y1) in pairwise(_path_um(line)):
            squared = (x1 - x0) ** 2 + (y1 - y0) ** 2
            part = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / squared if squared else 0.0
            part = min(max(part, 0.0), 1.0)
            if math.hypot(x - x0 - part * (x1 - x0), y - y0 - part * (y1 - y0)) <= round(line.width_m / 2 * 1e6) + 0.5:
                return True
    for spot_x, spot_y, radius in mat.spots:
        if math.hypot(x - round(spot_x * 1e6), y - round(spot_y * 1e6)) <= round(radius * 1e6) + 0.5:
            return True
    for patch in mat.patches:
        corners = [(round(cx * 1e6), round(cy * 1e6)) for cx, cy in patch]
        sides = list(pairwise([*corners, corners[0]]))
        crossed = [x < x0 + (y - y0) / (y1 - y0) * (x1 - x0) for (x0, y0), (x1, y1) in sides if (y0 > y) != (y1 > y)]
        is_on_edge = any(
            (x - x0) * (y1 - y0) == (y - y0) * (x1 - x0)
            and min(x0, x1) <= x <= max(x0, x1)
            and min(y0, y1) <= y <= max(y0, y1)
            for (x0, y0), (x1, y1) in sides
        )
        if is_on_edge or sum(crossed) % 2:
            return True
    return False


def sees_person(world: "PlainWorld", car: int) -> bool:
    if not world.mat.people:
        return False
    ahead_x, ahead_y = ahead_of(world.heading[car])
    for person in world.mat.people:
        x, y = _person_at(world, person)
        dx, dy = x - world.x[car], y - world.y[car]
        distance = math.sqrt(dx * dx + dy * dy)
        if distance <= world.rules.pir_range and dx * ahead_x + dy * ahead_y >= world.rules.pir_cos * distance:
            return True
    return False


def _person_at(world: "PlainWorld", person: Person) -> tuple[float, float]:
    path = [(round(t_s * 1000), x * 1e6, y * 1e6) for t_s, x, y in person.path]
    at_ms = world.now_ms % path[-1][0] if person.repeats and path[-1][0] else world.now_ms
    for (t0, x0, y0), (t1, x1, y1) in pairwise(path):
        if t0 <= at_ms < t1:
            part = (at_ms - t0) / (t1 - t0)
            return math.floor(x0 + part * (x1 - x0) + 0.5), math.floor(y0 + part * (y1 - y0) + 0.5)
    return path[-1][1], path[-1][2]


def voice_at(world: "PlainWorld", car: int) -> int:
    heard = world.said
    for voice in sorted(world.mat.voices, key=lambda each: each.at_s):
        if world.now_ms - world.mat.tick_ms < round(voice.at_s * 1000) <= world.now_ms:
            away = math.hypot(world.x[car] - voice.x_m * 1e6, world.y[car] - voice.y_m * 1e6)
            if voice.radius_m is None or away <= voice.radius_m * 1e6:
                heard = layout.VOICES[voice.word]
    return heard
