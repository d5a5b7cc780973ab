"""Make foxglove.SceneUpdate messages in JSON, which Foxglove's 3D panel draws.

The schema describes only the fields that are sent here; their names and meanings are Foxglove's
(https://docs.foxglove.dev/docs/sdk/schemas/scene-update). Lengths are in metres.
"""

import json
import math
from typing import Any

import numpy as np

from motorcade.engine.moment import Moment
from motorcade.runs.palette import LEADER, LEDS, WordColours, rgb
from motorcade.runs.recording import Description

FRAME_ID = "mat"
# With more cars than this neither their numbers nor their LEDs are drawn.
_MOST_DETAILED = 50
_HEIGHT_M = 0.06
_WALL_HEIGHT_M = 0.1
_WALL_WIDTH_M = 0.02
_UPRIGHT = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
_STILL: dict[str, Any] = {"lifetime": {"sec": 0, "nsec": 0}, "frame_locked": False, "metadata": []}
_PRIMITIVES = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
SCENE_UPDATE_NAME = "foxglove.SceneUpdate"
Corners = tuple[tuple[float, float], ...]


def mat_message(about: Description) -> bytes:
    """Make the message of what doesn't move: the mat's edge, walls and obstacles."""
    mat, dark, grey = about.mat, _colour("#3a3a3a"), _colour("#8c8c8c")
    cubes = [_wall(*wall, dark) for wall in mat.walls]
    lines = []
    if mat.size_m:
        width_m, height_m = mat.size_m
        corners: Corners = ((0.0, 0.0), (width_m, 0.0), (width_m, height_m), (0.0, height_m))
        if mat.walled:
            cubes += _walls_around(corners, dark)
        lines.append(_loop(corners, dark))
    cylinders = [_cylinder(x, y, 2 * radius, _WALL_HEIGHT_M, grey, _WALL_HEIGHT_M / 2) for x, y, radius in mat.discs]
    for corners in mat.polygons:
        cubes += _walls_around(corners, grey)
    return _message(0, mat={"cubes": cubes, "lines": lines, "cylinders": cylinders})


class Scene:
    """Make the messages of what moves in a run: cars and people."""

    def __init__(self, about: Description):
        self._about = about
        self._colours = WordColours(about.images)

    def message(self, moment: Moment) -> bytes:
        """Make the message of a moment."""
        people = [
            _cylinder(x, y, 0.3, 1.0, _colour("#5b8fd6", 0.6), 0.5) for x, y in self._about.people_at(moment.t_ms)
        ]
        cars = {"triangles": self._bodies(moment)}
        if len(moment.x_m) <= _MOST_DETAILED:
            cars |= self._details(moment)
        return _message(moment.t_ms, cars=cars, people={"cylinders": people})

    def _bodies(self, moment: Moment) -> list[Any]:
        """A flat triangle for each car that points ahead, in one list for each colour; thousands of cars are drawn."""
        radius_m = self._about.diameter_m / 2
        angles = moment.heading[:, None] + np.array([0, math.radians(140), -math.radians(140)], np.float32)
        xs = moment.x_m[:, None] + radius_m * np.cos(angles)
        ys = moment.y_m[:, None] + radius_m * np.sin(angles)
        colours = (self._colours.of(moment.word, moment.runs) * 255).astype(np.uint32)
        keys = colours[:, 0] << 16 | colours[:, 1] << 8 | colours[:, 2]
        triangles = []
        for key in np.unique(keys).tolist():
            chosen = keys == key
            corners = zip(xs[chosen].ravel().tolist(), ys[chosen].ravel().tolist(), strict=True)
            points = [{"x": round(x, 3), "y": round(y, 3), "z": _HEIGHT_M} for x, y in corners]
            triangles.append(_triangles(points, _colour(f"#{key:06x}")))
        return triangles

    def _details(self, moment: Moment) -> dict[str, list[Any]]:
        """The number of each car, and its LED where one is on."""
        places = list(zip(moment.x_m.tolist(), moment.y_m.tolist(), strict=True))
        wide_m = self._about.diameter_m
        lit = [(place, led) for place, led in zip(places, moment.led.tolist(), strict=True) if led < len(LEDS)]
        leds = [_cylinder(x, y, wide_m / 3, 0.03, _colour(LEDS[led]), _HEIGHT_M + 0.015) for (x, y), led in lit]
        return {"cylinders": leds, "texts": [_text(x, y, str(car), wide_m / 2) for car, (x, y) in enumerate(places)]}


def _message(t_ms: int, **entities: dict[str, list[Any]]) -> bytes:
    stamp = {"sec": t_ms // 1000, "nsec": t_ms % 1000 * 1_000_000}
    every = [
        {
            "timestamp": stamp,
            "frame_id": FRAME_ID,
            "id": name,
            **_STILL,
            **{primitive: parts.get(primitive, []) for primitive in _PRIMITIVES},
        }
        for name, parts in entities.items()
    ]
    return json.dumps({"deletions": [], "entities": every}, separators=(",", ":")).encode()


def _colour(text: str, alpha: float = 1.0) -> dict[str, float]:
    red, green, blue = rgb(text)
    return {"r": round(red, 3), "g": round(green, 3), "b": round(blue, 3), "a": alpha}


def _pose(x: float, y: float, z: float = 0.0, heading: float = 0.0) -> dict[str, Any]:
    turned = {"x": 0.0, "y": 0.0, "z": round(math.sin(heading / 2), 4), "w": round(math.cos(heading / 2), 4)}
    return {
        "position": {"x": round(x, 4), "y": round(y, 4), "z": z},
        "orientation": turned if heading else _UPRIGHT,
    }


def _cylinder(x: float, y: float, wide_m: float, high_m: float, colour: dict[str, float], z: float) -> dict[str, Any]:
    size = {"x": wide_m, "y": wide_m, "z": high_m}
    return {"pose": _pose(x, y, z), "size": size, "bottom_scale": 1.0, "top_scale": 1.0, "color": colour}


def _text(x: float, y: float, text: str, high_m: float) -> dict[str, Any]:
    return {
        "pose": _pose(x, y, _HEIGHT_M + 0.1),
        "billboard": True,
        "font_size": high_m,
        "scale_invariant": False,
        "color": _colour("#202020"),
        "text": text,
    }


def _wall(x0: float, y0: float, x1: float, y1: float, colour: dict[str, float]) -> dict[str, Any]:
    size = {"x": math.hypot(x1 - x0, y1 - y0) + _WALL_WIDTH_M, "y": _WALL_WIDTH_M, "z": _WALL_HEIGHT_M}
    middle = _pose((x0 + x1) / 2, (y0 + y1) / 2, _WALL_HEIGHT_M / 2, math.atan2(y1 - y0, x1 - x0))
    return {"pose": middle, "size": size, "color": colour}


def _walls_around(corners: Corners, colour: dict[str, float]) -> list[dict[str, Any]]:
    return [_wall(*a, *b, colour) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]


def _loop(corners: Corners, colour: dict[str, float]) -> dict[str, Any]:
    points = [{"x": x, "y": y, "z": _WALL_HEIGHT_M} for x, y in corners]
    return {
        "type": 1,  # a closed line
        "pose": _pose(0.0, 0.0),
        "thickness": _WALL_WIDTH_M,
        "scale_invariant": False,
        "points": points,
        "color": colour,
        "colors": [],
        "indices": [],
    }


def _triangles(points: list[dict[str, float]], colour: dict[str, float]) -> dict[str, Any]:
    return {"pose": _pose(0.0, 0.0), "points": points, "color": colour, "colors": [], "indices": []}


def _schema(example: Any) -> dict[str, Any]:
    """The JSON schema of values like ``example``."""
    if isinstance(example, dict):
        return {"type": "object", "properties": {key: _schema(value) for key, value in example.items()}}
    if isinstance(example, list):
        return {"type": "array", "items": _schema(example[0])}
    return {"type": {bool: "boolean", int: "integer", float: "number", str: "string"}[type(example)]}


def _example() -> dict[str, Any]:
    """A message with one of each thing."""
    colour, corner = _colour(LEADER), {"x": 0.0, "y": 0.0, "z": 0.0}
    cube = _wall(0.0, 0.0, 1.0, 0.0, colour)
    lists = {"colors": [colour], "indices": [0]}
    entity = {
        "timestamp": {"sec": 0, "nsec": 0},
        "frame_id": FRAME_ID,
        "id": "",
        **_STILL,
        "metadata": [{"key": "", "value": ""}],
        "arrows": [{}],
        "cubes": [cube],
        "spheres": [cube],
        "cylinders": [_cylinder(0.0, 0.0, 1.0, 1.0, colour, 0.0)],
        "lines": [{**_loop(((0.0, 0.0),), colour), **lists}],
        "triangles": [{**_triangles([corner], colour), **lists}],
        "texts": [_text(0.0, 0.0, "", 1.0)],
        "models": [{}],
    }
    deletion = {"timestamp": {"sec": 0, "nsec": 0}, "type": 0, "id": ""}
    return {"deletions": [deletion], "entities": [entity]}


SCENE_UPDATE = {"title": SCENE_UPDATE_NAME, **_schema(_example())}
