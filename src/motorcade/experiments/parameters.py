"""The parameters that a sweep can vary, and the points of its parameter space.

Parameters are the number of cars, the tick, a mat's physics and every number of a profile.
"""

import difflib
import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache, lru_cache
from typing import Any

from motorcade.config.check import Schema, Text, allowed, allowed_as, whole
from motorcade.config.profile import Profile, profile_from_dict, profile_schema
from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats import Mat
from motorcade.mats.schema import mat_schema

Value = bool | int | float | None
NEVER = "never"
MOST_FOLLOWERS = 1_000_000
_MOST_IN_PROFILE = (1 << 20) - 1
_PHYSICS = "physics."
_PROFILE = "profile."


@cache
def parameter_schemas() -> dict[str, Schema]:
    """The schema of the values of each parameter, by its name."""
    keys = mat_schema()["properties"]
    schemas = {"cars": whole(0, MOST_FOLLOWERS), "tick_ms": keys["tick_ms"]}
    for name, part in keys["physics"]["properties"].items():
        schemas[_PHYSICS + name] = part if "default" in part else _or_never(part)
    for name in _numbers(profile_schema()):
        schemas[_PROFILE + name] = whole(0, _MOST_IN_PROFILE)
    return schemas


def kind_of(name: str) -> type[bool] | type[int] | type[float]:
    """The Python type of a parameter's values."""
    match parameter_schemas()[name]["type"]:
        case "boolean":
            return bool
        case "integer":
            return int
        case _:
            return float


def has_range(name: str) -> bool:
    """Whether a parameter's values can be drawn from a range: they are numbers."""
    return kind_of(name) is not bool


def to_value(name: str, value: Any) -> Value:
    """Convert a value that fits a parameter's schema."""
    return None if value == NEVER else kind_of(name)(value)


def check_known(name: str, file: Text, place: str) -> None:
    """Raise MotorcadeError unless there is a parameter called ``name``; the error suggests a similar name."""
    known = parameter_schemas()
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = Phrase("did-you-mean", name=near[0]) if near else Phrase("sweep-parameters")
        raise MotorcadeError("no-such-parameter", file=file, place=place, name=name[:60], hint=hint)


def _or_never(part: Schema) -> Schema:
    values = {**part, "type": ["number", "string"], "pattern": f"^{NEVER}$"}
    return allowed_as("either", values, first=allowed(part), second=f'"{NEVER}"')


def _numbers(schema: Schema, before: str = "") -> Iterator[str]:
    """The name of every number of a profile, such as ``infrared.range_mm`` or ``speeds_mm_s[2]``."""
    for name, part in schema["properties"].items():
        if part["type"] == "object":
            yield from _numbers(part, f"{before}{name}.")
        elif part["type"] == "array":
            yield from (f"{before}{name}[{index}]" for index in range(part["maxItems"]))
        else:
            yield before + name


def mat_with(mat: Mat, values: Mapping[str, Value]) -> Mat:
    """Change ``tick_ms`` and the physics of ``mat`` as ``values`` say."""
    physics: dict[str, Any] = {
        name.removeprefix(_PHYSICS): value for name, value in values.items() if name.startswith(_PHYSICS)
    }
    tick_ms: Any = values.get("tick_ms", mat.tick_ms)
    return replace(mat, tick_ms=tick_ms, physics=replace(mat.physics, **physics))


def profile_with(profile: Profile, values: Mapping[str, Value]) -> Profile:
    """Change ``profile`` as ``values`` say. Raises MotorcadeError where the values don't fit each other."""
    changed = tuple((name.removeprefix(_PROFILE), value) for name, value in values.items() if name.startswith(_PROFILE))
    return _changed(profile, changed) if changed else profile


@lru_cache(maxsize=4096)
def _changed(profile: Profile, changed: tuple[tuple[str, Value], ...]) -> Profile:
    document = asdict(profile)
    del document["name"]
    for name, value in changed:
        *tables, key = name.split(".")
        table = document
        for each in tables:
            table = table[each]
        key, _, index = key.removesuffix("]").partition("[")
        if index:
            levels = list(table[key])
            levels[int(index)] = value
            table[key] = levels
        else:
            table[key] = value
    return profile_from_dict(document, profile.name)


@dataclass(frozen=True, slots=True)
class Grid:
    """Every combination of the values; the last parameter varies fastest. Without parameters: one point."""

    lists: Mapping[str, tuple[Value, ...]]

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters that vary."""
        return tuple(self.lists)

    @property
    def count(self) -> int:
        """The number of points."""
        return math.prod(len(values) for values in self.lists.values())

    def at(self, index: int) -> dict[str, Value]:
        """The values of point ``index``, 0 to ``count`` - 1."""
        chosen: dict[str, Value] = {}
        for name, values in reversed(list(self.lists.items())):
            index, position = divmod(index, len(values))
            chosen[name] = values[position]
        return {name: chosen[name] for name in self.lists}


@dataclass(frozen=True, slots=True)
class Range:
    """The range that a parameter is drawn from, evenly or evenly in its logarithm. Integers include ``highest``."""

    lowest: float
    highest: float
    logarithmic: bool


@dataclass(frozen=True, slots=True)
class Sample:
    """Independent draws. A draw depends only on the seed, the parameter's name and the point's number.

    So a larger count, or one more parameter, changes no other draw.
    """

    ranges: Mapping[str, Range]
    count: int
    seed: int

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the parameters that vary."""
        return tuple(self.ranges)

    def at(self, index: int) -> dict[str, Value]:
        """The values of point ``index``, 0 to ``count`` - 1."""
        return {
            name: _drawn(kind_of(name) is int, limits, _share(self.seed, name, index))
            for name, limits in self.ranges.items()
        }


def _share(seed: int, name: str, index: int) -> float:
    """A number from 0 to below 1, from 53 bits of a hash: the same with every version of every library."""
    digest = hashlib.blake2b(f"{seed}/{name}/{index}".encode(), digest_size=8).digest()
    return (int.from_bytes(digest, "big") >> 11) / (1 << 53)


def _drawn(is_whole: bool, limits: Range, share: float) -> Value:
    end = limits.highest + 1 if is_whole else limits.highest
    if limits.logarithmic:
        value = limits.lowest * (end / limits.lowest) ** share
    else:
        value = limits.lowest + (end - limits.lowest) * share
    # Rounding could reach the end, which is excluded.
    return int(min(value, limits.highest)) if is_whole else min(value, limits.highest)
