"""What a recording says about the run in it: its mat, its cars and how they were programmed."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from motorcade.config.profile import TABLES, Profile

if TYPE_CHECKING:
    from motorcade.engine.world import World

FORMAT = "motorcade-recording/1"


@dataclass(frozen=True, slots=True)
class Description:
    """One run. Lengths in metres, times in ms as their names say.

    Attributes:
        mat: the mat's name.
        size_m: its width and height; None for a plane without end.
        walled: whether its edge is a wall.
        walls: x0, y0, x1, y1 of each.
        discs: x, y and radius of each round obstacle.
        polygons: the corners of each other obstacle.
        people: for each its path of (t_s, x_m, y_m), and whether it begins anew at its end.
        physics: which physics hold, as a mat's file names them.
        profile: what the levels mean for these cars.
        images: the leaders' images in hexadecimal; the k-th leader runs the k-th, and so on round.
        leaders: the numbers of the cars that lead.
        cars: how many cars there are.
        seed: what the run's dice began with.
        tick_ms: the simulator's step.
        every_ms: how far apart the recorded moments are.
    """

    mat: str
    size_m: tuple[float, float] | None
    walled: bool
    walls: tuple[tuple[float, float, float, float], ...]
    discs: tuple[tuple[float, float, float], ...]
    polygons: tuple[tuple[tuple[float, float], ...], ...]
    people: tuple[tuple[tuple[tuple[float, float, float], ...], bool], ...]
    physics: Mapping[str, bool | float | None]
    profile: Profile
    images: tuple[str, ...]
    leaders: tuple[int, ...]
    cars: int
    seed: int
    tick_ms: int
    every_ms: int

    @classmethod
    def of(cls, world: "World", every_ms: int, index: int = 0) -> "Description":
        """The description of world number ``index`` in ``world``."""
        mat = world.mat
        return cls(
            mat=mat.name,
            size_m=mat.size_m,
            walled=mat.walled,
            walls=mat.walls,
            discs=mat.discs,
            polygons=mat.polygons,
            people=tuple((person.path, person.repeats) for person in mat.people),
            physics=asdict(mat.physics),
            profile=world.profile,
            images=tuple(image.hex() for image in world.images),
            leaders=tuple(np.flatnonzero(mat.starts.leads).tolist()),
            cars=world.cars,
            seed=int(world.seeds[index]),
            tick_ms=world.tick_ms,
            every_ms=every_ms,
        )

    @classmethod
    def from_texts(cls, texts: Mapping[str, str]) -> "Description":
        """What `as_texts` made. Raises ValueError, KeyError or TypeError where it is something else."""
        if texts.get("format") != FORMAT:
            raise ValueError("no run of Motorcade")
        values = {field.name: _tuples(json.loads(texts[field.name])) for field in fields(cls) if field.name != "mat"}
        profile = json.loads(texts["profile"])
        values["profile"] = Profile(
            **{key: TABLES[key](**value) if key in TABLES else _tuples(value) for key, value in profile.items()}
        )
        return cls(mat=texts["mat"], **values)

    def as_texts(self) -> dict[str, str]:
        """The description as texts by name: ``mat`` and ``format`` as they are, all else as JSON."""
        values = asdict(self)
        mat = values.pop("mat")
        return {"format": FORMAT, "mat": mat, **{key: json.dumps(value) for key, value in values.items()}}

    def as_dict(self) -> dict[str, Any]:
        """The description for JSON."""
        return {"format": FORMAT, **asdict(self)}

    @property
    def diameter_m(self) -> float:
        """How wide a car is."""
        return self.profile.body.diameter_mm / 1000

    def people_at(self, t_ms: int) -> list[tuple[float, float]]:
        """Where the people are at a moment, (x, y) in metres."""
        places = []
        for path, repeats in self.people:
            times, xs, ys = zip(*path, strict=True)
            t_s = t_ms / 1000
            if repeats and times[-1] > 0:
                t_s %= times[-1]
            places.append((float(np.interp(t_s, times, xs)), float(np.interp(t_s, times, ys))))
        return places


def _tuples(value: Any) -> Any:
    """Lists as tuples, all the way down."""
    return tuple(_tuples(each) for each in value) if isinstance(value, list) else value
