"""A mat and its document, the tables and lists that its file holds."""

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motorcade.engine.errors import MatError
from motorcade.mats.crowd import Crowd, IsFree, Points, place_crowd
from motorcade.mats.model import Mat, Person, Physics, Starts, Voice
from motorcade.mats.nearness import obstructed
from motorcade.mats.outlines import check_outlines
from motorcade.mats.schema import FORMAT, MOST_CARS
from motorcade.mats.shape import check_shape, filled

_Cars = tuple[Points, Points, Points, NDArray[np.bool_]]


def mat_of(document: Any, called: str) -> Mat:
    """The mat in ``document``. Raises MatError, about the mat called ``called``."""
    check_shape(document, called)
    whole = filled(document)
    mat = Mat(
        name=whole["name"],
        starts=Starts.of([], []),
        tick_ms=int(whole["tick_ms"]),
        size_m=_pair(whole["size_m"]) if "size_m" in whole else None,
        walled=whole["edge"] == "wall",
        walls=tuple((*_pair(wall["from_m"]), *_pair(wall["to_m"])) for wall in whole["wall"]),
        discs=tuple((*_pair(disc["centre_m"]), float(disc["radius_m"])) for disc in whole["disc"]),
        polygons=tuple(tuple(map(_pair, polygon["corners_m"])) for polygon in whole["polygon"]),
        people=tuple(_person(person) for person in whole["person"]),
        voices=tuple(_voice(voice) for voice in whole["voice"]),
        physics=Physics(**{key: _float(value) for key, value in whole["physics"].items()}),
    )
    check_outlines(mat, called)
    return replace(mat, starts=_placed(mat, whole["car"], whole["crowd"], called))


def document_of(mat: Mat) -> dict[str, Any]:
    """The document of ``mat``, but for its cars."""
    document: dict[str, Any] = {
        "format": FORMAT,
        "name": mat.name,
        "tick_ms": mat.tick_ms,
        "edge": "wall" if mat.walled else "open",
        "wall": [{"from_m": wall[:2], "to_m": wall[2:]} for wall in mat.walls],
        "disc": [{"centre_m": [x, y], "radius_m": radius} for x, y, radius in mat.discs],
        "polygon": [{"corners_m": corners} for corners in mat.polygons],
        "person": [asdict(person) for person in mat.people],
        "voice": [{"at_s": voice.at_s, "word": voice.word} | _where(voice) for voice in mat.voices],
        "physics": {key: value for key, value in asdict(mat.physics).items() if value is not None},
    }
    if mat.size_m is not None:
        document["size_m"] = mat.size_m
    plain: dict[str, Any] = _plain(document)
    return plain


def _plain(value: Any) -> Any:
    """NumPy's numbers as Python's, all the way down."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def _where(voice: Voice) -> dict[str, Any]:
    return {} if voice.radius_m is None else {"centre_m": [voice.x_m, voice.y_m], "radius_m": voice.radius_m}


def _pair(values: list[float]) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _float(value: Any) -> Any:
    return value if isinstance(value, bool) else float(value)


def _person(person: dict[str, Any]) -> Person:
    return Person(tuple((float(t_s), float(x), float(y)) for t_s, x, y in person["path"]), person["repeats"])


def _voice(voice: dict[str, Any]) -> Voice:
    at_s, word = float(voice["at_s"]), voice["word"]
    if "radius_m" not in voice:
        return Voice(at_s, word)
    return Voice(at_s, word, *_pair(voice["centre_m"]), float(voice["radius_m"]))


def _placed(mat: Mat, cars: list[dict[str, Any]], crowds: list[dict[str, Any]], called: str) -> Starts:
    """Where all cars stand: first each of ``cars``, then crowd by crowd."""
    total = len(cars) + sum(int(crowd["cars"]) for crowd in crowds)
    if total > MOST_CARS:
        raise MatError("too-many-cars", mat=called, count=total, most=MOST_CARS)
    listed = np.array([car["at_m"] for car in cars], float).reshape(-1, 2)
    heading = np.radians(np.array([car["heading_deg"] for car in cars], float))
    leads = np.array([car["role"] == "leader" for car in cars], np.bool_)
    parts = [(listed[:, 0], listed[:, 1], heading, leads)]
    groups = [(f"car[{number}]", 1) for number in range(len(cars))]
    for number, table in enumerate(crowds):
        crowd = _crowd(mat, table, called, f"crowd[{number}]")
        parts.append(place_crowd(crowd, _room(mat, parts[0], crowd.spacing_m)))
        groups.append((crowd.place, crowd.cars))
    return _joined(parts, groups)


def _joined(parts: Sequence[_Cars], groups: Sequence[tuple[str, int]]) -> Starts:
    x_m, y_m, heading, leads = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Starts(x_m, y_m, heading, leads, tuple(groups))


def _crowd(mat: Mat, table: dict[str, Any], called: str, place: str) -> Crowd:
    if "corner_m" in table:
        corner_m, size_m = _pair(table["corner_m"]), _pair(table["size_m"])
    elif mat.size_m is not None:
        corner_m, size_m = (0.0, 0.0), mat.size_m
    else:
        raise MatError("no-area", mat=called, place=place)
    heading = table["heading_deg"]
    return Crowd(
        mat=called,
        place=place,
        cars=int(table["cars"]),
        leaders=int(table["leaders"]),
        corner_m=corner_m,
        size_m=size_m,
        spacing_m=float(table["spacing_m"]),
        anyhow=table["placement"] == "random",
        heading=None if heading == "random" else math.radians(heading),
        seed=int(table["seed"]),
    )


def _room(mat: Mat, listed: _Cars, spacing_m: float) -> IsFree:
    """Says where a car of a crowd may stand: half its spacing from what stands there, all of it from other cars."""
    cars = tuple((float(x), float(y), spacing_m / 2) for x, y in zip(listed[0], listed[1], strict=True))

    def is_free(x_m: Points, y_m: Points) -> NDArray[np.bool_]:
        free = np.ones(len(x_m), np.bool_)
        for _, indices in obstructed(x_m, y_m, spacing_m / 2, mat.walls, mat.discs + cars, mat.polygons):
            free[indices] = False
        return free

    return is_free
