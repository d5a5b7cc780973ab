"""A stick made of a gamepad's numbers: pure, with time as an argument (ms that wrap, `motorcade.words.ticks`).

The left stick drives, or the triggers do for speed, as on the car's page.
"""

from typing import NamedTuple

from motorcade.drive.input.deadman import Axes
from motorcade.words.ticks import elapsed_ms

FULL = 32767
# What a worn stick shows though nobody touches it. More than on a page: this one takes the wheel from others.
DEAD_ZONE = 0.2
# A pad whose radio is gone shows its last numbers until its computer notices, which takes up to 20 s.
LONGEST_STILL_MS = 3000


class PadNumbers(NamedTuple):
    """What a gamepad shows, each -32768 to 32767, right and down positive; a trigger at rest is 0."""

    left_x: int
    left_y: int
    right_x: int
    right_y: int
    left_trigger: int
    right_trigger: int


class PadStick:
    """A gamepad's numbers as axes, as long as there is a hand on it."""

    def __init__(self) -> None:
        self._last: PadNumbers | None = None
        self._changed_ms = 0

    def axes(self, numbers: PadNumbers, now_ms: int) -> Axes | None:
        """Throttle and steering, each -1 to 1; None where a push has been so still that no hand can be behind it."""
        if numbers != self._last:
            self._last, self._changed_ms = numbers, now_ms
        triggers = _alive(numbers.right_trigger) - _alive(numbers.left_trigger)
        stick = -_alive(numbers.left_y)
        throttle = triggers if abs(triggers) > abs(stick) else stick
        steering = _alive(numbers.left_x)
        if not (throttle or steering):
            # So that one that rests for days doesn't seem to have moved when the time wraps.
            self._changed_ms = now_ms
        return None if elapsed_ms(now_ms, self._changed_ms) > LONGEST_STILL_MS else (throttle, steering)


def _alive(number: int) -> float:
    share = max(-1.0, min(number / FULL, 1.0))
    beyond = (abs(share) - DEAD_ZONE) / (1 - DEAD_ZONE)
    return 0.0 if beyond <= 0 else beyond if share > 0 else -beyond
