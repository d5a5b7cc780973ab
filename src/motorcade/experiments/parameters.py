"""What a sweep can vary: the number of cars, the tick, a mat's physics and every number of a profile."""

import difflib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, lru_cache
from typing import Any

from motorcade.config.profile import Profile, built_in_profile, parse_profile
from motorcade.mats import Mat, Physics
from motorcade.mats.schema import mat_schema

Value = bool | int | float | None
NEVER = "never"
MOST_FOLLOWERS = 1_000_000
MOST_IN_PROFILE = (1 << 20) - 1
_PHYSICS = "physics."
_PROFILE = "profile."
_KINDS: dict[str, type[bool] | type[int] | type[float]] = {"boolean": bool, "integer": int, "number": float}


class SweepError(ValueError):
    """A sweep that can't be; its text says where and what to do."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """Something that a sweep can vary.

    ``kind`` is bool, int or float. ``lowest`` and ``highest`` are allowed, but for an ``open_below`` one the lowest;
    ``optional`` ones also take 'never', which is None here.
    """

    name: str
    kind: type[bool] | type[int] | type[float]
    lowest: float = -math.inf
    highest: float = math.inf
    open_below: bool = False
    optional: bool = False

    def read(self, value: object, place: str) -> Value:
        """``value`` of a TOML file as one of this parameter. Raises SweepError that names ``place``."""
        if self.optional and value == NEVER:
            return None
        if self.kind is bool and isinstance(value, bool):
            return value
        if self.kind is not bool and isinstance(value, int | float) and not isinstance(value, bool):
            whole = isinstance(value, int) or self.kind is float
            above = value > self.lowest if self.open_below else value >= self.lowest
            if whole and above and value <= self.highest and math.isfinite(value):
                return self.kind(value)
        raise SweepError(f"{place} is {_shown(value)}; allowed: {self.allowed}")

    @property
    def allowed(self) -> str:
        """The values that it takes, in words."""
        if self.kind is bool:
            return "true or false"
        text = "whole numbers" if self.kind is int else "numbers"
        if math.isfinite(self.lowest):
            text += f" above {self.lowest:g}" if self.open_below else f" from {self.lowest:.15g}"
        if math.isfinite(self.highest):
            text += f" to {self.highest:.15g}"
        return text + (f", or '{NEVER}'" if self.optional else "")


def _shown(value: object) -> str:
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 40 else f"{text[:40]}…"


def parameter_named(name: str, place: str) -> Parameter:
    """The parameter called ``name``. Raises SweepError that names ``place`` and what is near."""
    known = _known()
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]}?" if near else "there are cars, tick_ms, physics.… and profile.…"
        raise SweepError(f"{place}: there is no parameter '{name[:60]}'; {hint}")
    return known[name]


@cache
def _known() -> dict[str, Parameter]:
    keys = mat_schema()["properties"]
    parameters = [Parameter("cars", int, 0, MOST_FOLLOWERS), _of_schema("tick_ms", keys["tick_ms"])]
    physics = keys["physics"]["properties"]
    parameters += [_of_schema(_PHYSICS + field.name, physics[field.name], field.default) for field in fields(Physics)]
    parameters += [Parameter(_PROFILE + name, int, 0, MOST_IN_PROFILE) for name, _ in _numbers(_TYPICAL)]
    return {parameter.name: parameter for parameter in parameters}


def _of_schema(name: str, schema: Mapping[str, Any], default: object = 0) -> Parameter:
    return Parameter(
        name,
        _KINDS[schema["type"]],
        schema.get("minimum", schema.get("exclusiveMinimum", -math.inf)),
        schema.get("maximum", math.inf),
        open_below="exclusiveMinimum" in schema,
        optional=default is None,
    )


_TYPICAL = built_in_profile("classroom")


def _numbers(table: Any, before: str = "") -> Iterator[tuple[str, int]]:
    """Every number of a profile with its name, such as ``infrared.range_mm`` or ``speeds_mm_s[2]``."""
    for field in fields(table):
        value = getattr(table, field.name)
        if is_dataclass(value):
            yield from _numbers(value, f"{before}{field.name}.")
        elif isinstance(value, tuple):
            yield from ((f"{before}{field.name}[{index}]", each) for index, each in enumerate(value))
        elif isinstance(value, int):
            yield before + field.name, value


def mat_with(mat: Mat, values: Mapping[str, Value]) -> Mat:
    """``mat`` with the parameters ``tick_ms`` and ``physics.…`` of ``values``."""
    physics: dict[str, Any] = {
        name.removeprefix(_PHYSICS): value for name, value in values.items() if name.startswith(_PHYSICS)
    }
    tick_ms: Any = values.get("tick_ms", mat.tick_ms)
    return replace(mat, tick_ms=tick_ms, physics=replace(mat.physics, **physics))


def profile_with(profile: Profile, values: Mapping[str, Value]) -> Profile:
    """``profile`` with the parameters ``profile.…`` of ``values``. Raises MotorcadeError where they don't fit."""
    changed = tuple((name, value) for name, value in values.items() if name.startswith(_PROFILE))
    return _profile_with(profile, changed) if changed else profile


@lru_cache(maxsize=4096)
def _profile_with(profile: Profile, changed: tuple[tuple[str, Any], ...]) -> Profile:
    for name, value in changed:
        profile = _replaced(profile, name.removeprefix(_PROFILE), value)
    # Read back as a file would be, so that a profile is checked in one place.
    lines = (f"{field.name} = {_toml(getattr(profile, field.name))}" for field in fields(profile))
    return parse_profile("\n".join(line for line in lines if not line.startswith("name ")), profile.name)


def _replaced(table: Any, path: str, value: int) -> Any:
    """``table`` with the number at ``path`` replaced, in a table or a list of it."""
    key, _, rest = path.partition(".")
    if rest:
        return replace(table, **{key: _replaced(getattr(table, key), rest, value)})
    key, _, index = key.removesuffix("]").partition("[")
    if not index:
        return replace(table, **{key: value})
    levels = list(getattr(table, key))
    levels[int(index)] = value
    return replace(table, **{key: tuple(levels)})


def _toml(value: Any) -> str:
    if is_dataclass(value):
        return "{" + ", ".join(f"{field.name} = {_toml(getattr(value, field.name))}" for field in fields(value)) + "}"
    return str(list(value)) if isinstance(value, tuple) else str(value)
