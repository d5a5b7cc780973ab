"""The JSON Schema of a mat: every key, what it is (its ``title``) and what is allowed there (its ``description``)."""

from typing import Any

FORMAT = "motorcade-mat/1"
FARTHEST_M = 2000
SHORTEST_M = 0.001
LAST_S = 1_000_000
MOST_CARS = 2_000_000

Schema = dict[str, Any]


def mat_schema() -> Schema:
    """The JSON Schema (draft 2020-12) of a mat in JSON, or in TOML once it is parsed."""
    root = _table(
        ("format", "name"),
        format=_choice("the format of this file", FORMAT),
        name=_part(
            "what the mat is called", "a line of 1 to 100 characters", type="string", minLength=1, maxLength=100
        ),
        tick_ms=_whole("the clock's step", 1, 40, "milliseconds", default=1),
        size_m=_size("the mat's width and height; its lower left corner is the origin"),
        edge=_choice("what the mat's edge is", "open", "wall", default="open"),
        wall=_tables("wall", _wall()),
        disc=_tables("disc", _disc()),
        polygon=_tables("polygon", _polygon()),
        person=_tables("person", _person()),
        voice=_tables("voice", _voice()),
        car=_tables("car", _car()),
        crowd=_tables("crowd", _crowd()),
        physics=_physics(),
    )
    about = (
        "A place that cars drive on. Lengths are metres, x goes right and y up, angles are degrees "
        "counter-clockwise from the x axis, times are seconds from the start."
    )
    return (
        {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Motorcade mat"}
        | root
        | {"description": about}
    )


def _wall() -> Schema:
    return _table(("from_m", "to_m"), from_m=_point("where the wall begins"), to_m=_point("where the wall ends"))


def _disc() -> Schema:
    return _table(
        ("centre_m", "radius_m"),
        centre_m=_point("the middle of a round obstacle"),
        radius_m=_number("the radius of a round obstacle", SHORTEST_M, FARTHEST_M, "metres"),
    )


def _polygon() -> Schema:
    allowed = f"a list of 3 to 1000 [x, y] in metres, each from -{FARTHEST_M} to {FARTHEST_M}"
    corner = {"type": "array", "items": _coordinate(), "minItems": 2, "maxItems": 2}
    corners = _part("the corners of a solid obstacle, in order", allowed, type="array", items=corner)
    return _table(("corners_m",), corners_m=corners | {"minItems": 3, "maxItems": 1000})


def _person() -> Schema:
    allowed = (
        f"a list of 1 to 10000 [t_s, x, y], t_s from 0 to {LAST_S} s, x and y from -{FARTHEST_M} to {FARTHEST_M} m"
    )
    step = {"type": "array", "items": _coordinate(), "minItems": 3, "maxItems": 3}
    step["prefixItems"] = [{"type": "number", "minimum": 0, "maximum": LAST_S}]
    path = _part("when somebody is where; they walk straight from point to point", allowed, type="array", items=step)
    return _table(
        ("path",),
        path=path | {"minItems": 1, "maxItems": 10000},
        repeats=_flag("whether the path begins anew when it is over", default=False),
    )


def _voice() -> Schema:
    table = _table(
        ("at_s", "word"),
        at_s=_number("when it is said", 0, LAST_S, "seconds"),
        word=_choice("what is said", "stop", "go"),
        centre_m=_point("the middle of where it is heard"),
        radius_m=_number("how far from centre_m it is heard", SHORTEST_M, FARTHEST_M, "metres"),
    )
    return table | {"dependentRequired": {"centre_m": ["radius_m"], "radius_m": ["centre_m"]}}


def _car() -> Schema:
    return _table(
        ("at_m",),
        at_m=_point("where the car starts"),
        heading_deg=_number("where the car looks", -360, 360, "degrees", default=0),
        role=_choice("whether the car leads", "leader", "follower", default="follower"),
    )


def _crowd() -> Schema:
    heading = _number("where the cars look", -360, 360, "degrees", default=0)
    heading |= {"type": ["number", "string"], "pattern": "^random$"}
    heading["description"] += ', or "random"'
    table = _table(
        ("cars",),
        cars=_whole("how many cars stand there", 1, MOST_CARS),
        leaders=_whole("how many of them lead, evenly spread", 0, MOST_CARS, default=0),
        corner_m=_point("the lower left corner of their area"),
        size_m=_size("the width and height of their area"),
        spacing_m=_number("the least distance of two cars' centres", 0.01, 100, "metres", default=0.25),
        placement=_choice("whether they stand in rows or anyhow", "grid", "random", default="grid"),
        heading_deg=heading,
        seed=_whole("what the dice of the crowd begin with", 0, (1 << 32) - 1, default=0),
    )
    return table | {"dependentRequired": {"corner_m": ["size_m"], "size_m": ["corner_m"]}}


def _physics() -> Schema:
    capture = {"type": "number", "exclusiveMinimum": 1, "maximum": 1_000_000}
    survives = "how many times stronger than another a frame must be to survive it"
    table = _table(
        (),
        collisions=_flag("whether bodies push each other apart, and walls and obstacles hold them", default=True),
        line_of_sight=_flag("whether walls, obstacles and cars shade infrared", default=True),
        capture_ratio=_part(survives, "a number above 1, up to 1000000", **capture),
        beam_half_angle_deg=_number("half of the infrared sender's cone", 1, 180, "degrees", default=180),
        bit_error_rate=_number("the chance of each bit of a frame to flip on its way", 0, 0.5, default=0),
        wheel_noise=_number("the spread of each wheel's speed, as a share of it", 0, 0.5, default=0),
    )
    return table | {"default": {}}


def _part(title: str, allowed: str, **more: Any) -> Schema:
    return {"title": title, "description": allowed, **more}


def _number(title: str, minimum: float, maximum: float, unit: str = "", **more: Any) -> Schema:
    allowed = f"a number from {minimum} to {maximum} {unit}".rstrip()
    return _part(title, allowed, type="number", minimum=minimum, maximum=maximum, **more)


def _whole(title: str, minimum: int, maximum: int, unit: str = "", **more: Any) -> Schema:
    allowed = f"a whole number from {minimum} to {maximum} {unit}".rstrip()
    return _part(title, allowed, type="integer", minimum=minimum, maximum=maximum, **more)


def _choice(title: str, *values: str, **more: Any) -> Schema:
    return _part(title, " or ".join(f'"{value}"' for value in values), enum=list(values), **more)


def _flag(title: str, *, default: bool) -> Schema:
    return _part(title, "true or false", type="boolean", default=default)


def _coordinate() -> Schema:
    return {"type": "number", "minimum": -FARTHEST_M, "maximum": FARTHEST_M}


def _point(title: str) -> Schema:
    allowed = f"[x, y] in metres, each from -{FARTHEST_M} to {FARTHEST_M}"
    return _part(title, allowed, type="array", items=_coordinate(), minItems=2, maxItems=2)


def _size(title: str) -> Schema:
    allowed = f"[width, height] in metres, each from {SHORTEST_M} to {FARTHEST_M}"
    length = {"type": "number", "minimum": SHORTEST_M, "maximum": FARTHEST_M}
    return _part(title, allowed, type="array", items=length, minItems=2, maxItems=2)


def _table(required: tuple[str, ...], **properties: Schema) -> Schema:
    return {
        "description": f"a table of {', '.join(properties)}",
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
    }


def _tables(name: str, table: Schema) -> Schema:
    return {"description": f"a list of tables, each under [[{name}]]", "type": "array", "items": table, "default": []}
