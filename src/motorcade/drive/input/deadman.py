"""What a hand on a stick wants: pure, with time as an argument (ms that wrap, `motorcade.words.ticks`).

Shared by a stick at the car itself and by a driver's terminal. Whoever lets go wants the car to stand still, and after
a while wants nothing, so that others can have the wheel. A stick that was pushed already when it came, or when
something went wrong, wants nothing until it has been at rest: nothing starts by itself.
"""

from typing import NamedTuple, Protocol

from motorcade.drive.input.stick_failures import StickError
from motorcade.words.ticks import elapsed_ms

# Longer than a change of mind, shorter than the patience of those who wait.
RESTS_MS = 2000

STOP, CLEAR, RELEASE, REQUEST, RESUME, QUIT = "stop", "clear", "release", "request", "resume", "quit"

Axes = tuple[float, float]


class Reading(NamedTuple):
    """What a device says at one look.

    Attributes:
        device: its name; None while there is none.
        axes: throttle and steering, as `motorcade.drive.input.stick` takes them; None where they can't be trusted.
        orders: what was pressed since the last look, of STOP to QUIT.
        notice: why another device can't be used, as a sentence.
    """

    device: str | None
    axes: Axes | None = None
    orders: tuple[str, ...] = ()
    notice: StickError | None = None


class StickSource(Protocol):
    """A device that is open."""

    def read(self) -> Reading:
        """What it says now; doesn't wait. Raises OSError where it can't be read any more."""


class DeadmanSwitch:
    """What its axes say, once it has been at rest."""

    def __init__(self) -> None:
        self._must_rest = True
        self._is_silent = True
        self._pushed_ms = 0

    @property
    def must_rest(self) -> bool:
        """Whether it has to let go before it can drive."""
        return self._must_rest

    def distrust(self) -> None:
        """Something went wrong, or the wheel is another's: it has to let go first."""
        self._must_rest = True

    def withdraw(self) -> None:
        """It wants nothing from now on, and has to let go before it wants something again."""
        self._must_rest = self._is_silent = True

    def wish(self, axes: Axes | None, now_ms: int) -> Axes | None:
        """What it wants now: to drive, to stand still (zeros), or nothing, which is None.

        Args:
            axes: as of `Reading`; what is out of range is as None.
        """
        # Written so that what compares with nothing, nan, is out of range.
        if axes is None or not all(-1 <= axis <= 1 for axis in axes):
            self._must_rest = True
        elif not any(axes):
            self._must_rest = False
        elif not self._must_rest:
            self._pushed_ms, self._is_silent = now_ms, False
            return axes
        if not self._is_silent and elapsed_ms(now_ms, self._pushed_ms) >= RESTS_MS:
            self._is_silent = True
        return None if self._is_silent else (0.0, 0.0)
