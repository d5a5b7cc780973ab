"""The schema of a mat's file: every key, what it is (its ``title``), what is allowed, and its default."""

from collections.abc import Callable, Mapping
from functools import cache

from motorcade.config.check import Schema, allowed_as, choice, flag, line, list_of, number, table, whole
from motorcade.devices import DEVICES

FORMAT = "motorcade-mat/1"
FARTHEST_M = 2000
SHORTEST_M = 0.001
LAST_S = 1_000_000
MOST_CARS = 2_000_000
# What a floor looks like changes nothing for the cars: only pages show it.
FLOORS = ("table", "classroom", "city", "night", "moon", "plain")


@cache
def mat_schema() -> Schema:
    """The JSON Schema (draft 2020-12) of a mat in JSON, or in TOML after parsing."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Motorcade mat",
        "description": "A place that cars drive on. Lengths are metres, x goes right and y up, angles are degrees "
        "counter-clockwise from the x axis, times are seconds from the start.",
        **table(
            ("size_m",),
            format=choice(FORMAT, title="the format of this file"),
            name=line(100, title="the name of the mat"),
            tick_ms=whole(1, 40, "milliseconds", title="the simulator's step", default=1),
            size_m=_size("the mat's width and height; its lower left corner is the origin"),
            edge=choice("open", "wall", title="what the mat's edge is", default="open"),
            floor=choice(*FLOORS, title="what the floor and the things on it look like", default=FLOORS[0]),
            **{thing.key: _tables(thing.key, SHAPES[thing.shape](thing.phrase)) for thing in THINGS},
            car=_tables("car", _car()),
            crowd=_tables("crowd", _crowd()),
            physics=_physics(),
        ),
    }


def _line(what: str) -> Schema:
    return table(
        points_m=_points("a point", 2, f"the points of {what}, in order"),
        width_m=number(SHORTEST_M, 1, "metres", title="how wide the line is", default=0.03),
        bend_m=number(0, FARTHEST_M, "metres", title="the radius of the arcs at its corners", default=0.0),
        closed=flag(title="whether it goes on from its last point to its first", default=False),
    )


def _points(one: str, least: int, title: str) -> Schema:
    points = list_of(_point(one), least, 1000, title=title)
    return allowed_as("mat-corners", points, minimum=least, maximum=1000, most=FARTHEST_M)


def _walk(what: str) -> Schema:
    step = list_of(_coordinate(), 3, 3, title="a time and a point", prefixItems=[number(0, LAST_S, "seconds")])
    step = allowed_as("mat-step", step, last=LAST_S, most=FARTHEST_M)
    path = list_of(step, 1, 10000, title=f"when {what} is where; they walk straight from point to point")
    return table(
        path=allowed_as("mat-path", path, minimum=1, maximum=10000, last=LAST_S, most=FARTHEST_M),
        repeats=flag(title="whether the path begins again at its end", default=False),
    )


def _speech(what: str) -> Schema:
    return table(
        ("centre_m", "radius_m"),
        at_s=number(0, LAST_S, "seconds", title=f"when {what} is said"),
        word=choice("stop", "go", title="what is said"),
        centre_m=_point("the centre of the area in which it is heard"),
        radius_m=_radius("how far from centre_m it is heard"),
    ) | {"dependentRequired": {"centre_m": ["radius_m"], "radius_m": ["centre_m"]}}


def _car() -> Schema:
    return table(
        at_m=_point("where the car starts"),
        heading_deg=_heading("where the car faces"),
        role=choice("leader", "follower", title="whether the car leads", default="follower"),
    )


def _crowd() -> Schema:
    heading = _heading("where the cars face") | {"type": ["number", "string"], "pattern": "^random$"}
    heading = allowed_as("mat-crowd-heading", heading)
    return table(
        ("corner_m", "size_m"),
        cars=whole(1, MOST_CARS, title="the number of cars"),
        leaders=whole(0, MOST_CARS, title="how many of them lead, evenly spread", default=0),
        corner_m=_point("the lower left corner of their area"),
        size_m=_size("the width and height of their area"),
        spacing_m=number(0.01, 100, "metres", title="the least distance between two cars' centres", default=0.25),
        placement=choice("grid", "random", title="whether they stand in rows or at random", default="grid"),
        heading_deg=heading,
        seed=whole(0, (1 << 32) - 1, title="the seed of the crowd's random numbers", default=0),
    ) | {"dependentRequired": {"corner_m": ["size_m"], "size_m": ["corner_m"]}}


def _physics() -> Schema:
    return table(
        ("capture_ratio",),
        collisions=flag(title="whether bodies push each other apart, and walls and obstacles hold them", default=True),
        line_of_sight=flag(title="whether walls, obstacles and cars shade infrared", default=True),
        capture_ratio={
            "title": "how many times stronger than another a frame must be to survive it",
            "type": "number",
            "exclusiveMinimum": 1,
            "maximum": 1_000_000,
        },
        beam_half_angle_deg=number(
            1, 180, "degrees", title="half of the angle of the infrared sender's cone", default=180
        ),
        bit_error_rate=number(0, 0.5, title="the probability that a bit of a frame flips on its way", default=0),
        wheel_noise=number(0, 0.5, title="the standard deviation of each wheel's speed, as a share of it", default=0),
    ) | {"default": {}}


def _heading(title: str) -> Schema:
    return number(-360, 360, "degrees", title=title, default=0)


def _radius(title: str) -> Schema:
    return number(SHORTEST_M, FARTHEST_M, "metres", title=title)


def _coordinate() -> Schema:
    return number(-FARTHEST_M, FARTHEST_M, "metres")


def _point(title: str) -> Schema:
    return allowed_as("mat-point", list_of(_coordinate(), 2, 2, title=title), most=FARTHEST_M)


def _size(title: str) -> Schema:
    length = number(SHORTEST_M, FARTHEST_M, "metres")
    return allowed_as("mat-size", list_of(length, 2, 2, title=title), least=SHORTEST_M, most=FARTHEST_M)


def _tables(name: str, items: Schema) -> Schema:
    return allowed_as("list-of-tables", list_of(items, default=[]), name=name)


# What the devices declare; what is flat lies below all else.
THINGS = tuple(sorted((thing for device in DEVICES for thing in device.things), key=lambda thing: not thing.is_flat))
# The table of a thing of each shape.
SHAPES: Mapping[str, Callable[[str], Schema]] = {
    "ends": lambda what: table(from_m=_point(f"where {what} begins"), to_m=_point(f"where {what} ends")),
    "round": lambda what: table(centre_m=_point(f"the centre of {what}"), radius_m=_radius(f"the radius of {what}")),
    "corners": lambda what: table(corners_m=_points("a corner", 3, f"the corners of {what}, in order")),
    "line": _line,
    "walk": _walk,
    "speech": _speech,
}
