"""What the cars of a world show at one moment: the one type of engine, recordings, pictures and cameras.

This module needs NumPy and no Numba.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Lengths = NDArray[np.float64] | NDArray[np.float32]
_NO_COUNTS: Mapping[str, int] = {}  # not a mappingproxy: moments are sent to other processes


class Moment(NamedTuple):
    """What the cars show at a moment; the arrays are in the order of the cars' numbers.

    Attributes:
        t_ms: the simulated time.
        x_m, y_m, heading: metres and radians from -pi to pi; float64 from `World.snapshot`, float32 in recordings.
        word: uint32, the word that each car executes or holds; 0 for none.
        runs: whether that word's length is not yet over.
        wheels: direction * 4 + speed level (directions forward, left, right); direction 3 where somebody drives the
            car.
        led: the LED that is on, 4 for none.
        sends: whether the car's frame is on the air.
        counts: what was counted since the run began, by name, as in `World.counts`; empty where nobody asked for it.
    """

    t_ms: int
    x_m: Lengths
    y_m: Lengths
    heading: Lengths
    word: NDArray[np.uint32]
    runs: NDArray[np.bool_]
    wheels: NDArray[np.uint8]
    led: NDArray[np.uint8]
    sends: NDArray[np.bool_]
    counts: Mapping[str, int] = _NO_COUNTS

    def in_single_precision(self) -> "Moment":
        """The same moment with positions and headings as float32, as recordings and pictures hold them."""
        x_m, y_m, heading = (np.asarray(each, np.float32) for each in (self.x_m, self.y_m, self.heading))
        return self._replace(x_m=x_m, y_m=y_m, heading=heading)

    def to_dict(self) -> dict[str, Any]:
        """The moment for JSON: lists in the order of car numbers, lengths and angles to a millionth."""
        x_m, y_m, heading = (np.round(each.astype(float), 6).tolist() for each in (self.x_m, self.y_m, self.heading))
        return {
            "t_ms": self.t_ms,
            "number": list(range(len(self.x_m))),
            "x_m": x_m,
            "y_m": y_m,
            "heading_rad": heading,
            "word": self.word.tolist(),
            "runs": self.runs.tolist(),
            "wheels": self.wheels.tolist(),
            "led": self.led.tolist(),
            "sends": self.sends.tolist(),
            "counts": dict(self.counts),
        }
