"""The points of a sweep's parameter space: every combination of lists, or draws from ranges."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass

from motorcade.experiments.parameters import Parameter, Value


@dataclass(frozen=True, slots=True)
class Grid:
    """Every combination of the values; the last parameter varies fastest. Without parameters: one point."""

    lists: Mapping[Parameter, tuple[Value, ...]]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """What varies."""
        return tuple(self.lists)

    @property
    def count(self) -> int:
        """How many points there are."""
        return math.prod(len(values) for values in self.lists.values())

    def at(self, index: int) -> dict[str, Value]:
        """The values of point ``index``, 0 to ``count`` - 1."""
        chosen: dict[str, Value] = {}
        for parameter, values in reversed(list(self.lists.items())):
            index, position = divmod(index, len(values))
            chosen[parameter.name] = values[position]
        return {parameter.name: chosen[parameter.name] for parameter in self.lists}


@dataclass(frozen=True, slots=True)
class Range:
    """Where a parameter is drawn from: evenly, or evenly in its logarithm. Whole numbers include ``highest``."""

    lowest: float
    highest: float
    logarithmic: bool


@dataclass(frozen=True, slots=True)
class Sample:
    """Independent draws. A draw depends on the seed, the parameter's name and the point's number alone.

    So a larger count, or one more parameter, leaves the other draws as they were.
    """

    ranges: Mapping[Parameter, Range]
    count: int
    seed: int

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """What varies."""
        return tuple(self.ranges)

    def at(self, index: int) -> dict[str, Value]:
        """The values of point ``index``, 0 to ``count`` - 1."""
        return {
            parameter.name: _drawn(parameter, limits, _share(self.seed, parameter.name, index))
            for parameter, limits in self.ranges.items()
        }


def _share(seed: int, name: str, index: int) -> float:
    """A number from 0 to below 1: a hash's 53 bits, the same with every version of every library."""
    digest = hashlib.blake2b(f"{seed}/{name}/{index}".encode(), digest_size=8).digest()
    return (int.from_bytes(digest, "big") >> 11) / (1 << 53)


def _drawn(parameter: Parameter, limits: Range, share: float) -> Value:
    whole = parameter.kind is int
    end = limits.highest + 1 if whole else limits.highest
    if limits.logarithmic:
        value = limits.lowest * (end / limits.lowest) ** share
    else:
        value = limits.lowest + (end - limits.lowest) * share
    # Rounding could reach the open end.
    return int(min(value, limits.highest)) if whole else min(value, limits.highest)
