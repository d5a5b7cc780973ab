"""Divide a run into slices: how many ticks a call of the kernels simulates.

Python raises KeyboardInterrupt, and calls any other handler of a signal, between two calls. So a call should be short.
How long a tick takes depends on the computer and on what the cars do, so slices follow what the ones before them took.
Ticks in which nothing happens take no time, but cars may wake up in any slice, which must be short then, too. Results
don't depend on slices.
"""

import time
from collections.abc import Callable

# Ctrl-C waits for a call at most.
CALL_S = 0.06
# The first slice: so many cars times ticks take some ms in machine code.
_FIRST = 1 << 16
_FIRST_INTERPRETED = 1 << 8
# No slice has more, for each second that it may take: a slow computer takes a few seconds if all these cars are busy.
_MOST_A_SECOND = 1 << 24


class Slices:
    """The length of slices.

    Args:
        cars: of all worlds.
        interpreted: whether plain Python runs them.
        longest_s: how long a slice should take at most.
        clock_s: seconds since any moment.

    Attributes:
        ticks: how many ticks the next slice has at most.
    """

    def __init__(
        self,
        cars: int,
        interpreted: bool = False,
        longest_s: float = CALL_S,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self.ticks = max((_FIRST_INTERPRETED if interpreted else _FIRST) // cars, 1)
        self._most = int(longest_s * _MOST_A_SECOND) // cars
        self._longest_s = longest_s
        self._clock_s = clock_s

    def measure(self, ticks: int, simulate: Callable[[], None]) -> None:
        """Simulate a slice of so many ticks; adapt the following ones where it was as long as a slice may be."""
        if ticks < self.ticks:
            simulate()
            return
        began_s = self._clock_s()
        simulate()
        fits = int(ticks * self._longest_s / max(self._clock_s() - began_s, 1e-6))
        # A slice that took long may be an accident, and one that was short, too.
        self.ticks = max(min(fits, 2 * ticks, self._most), ticks // 4, 1)
