"""Check a board's clock: milliseconds that only grow and wrap at 2^30.

Portable. Under CPython it also reads the clock as it will be after days; MicroPython's modules can't be changed.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

import sys
import time

from motorcade.car.check.probe import Probe
from motorcade.errors import Phrase
from motorcade.words.ticks import TICKS_MASK, elapsed_ms, later_ms

# Whether there is another clock to compare the board's with.
HAS_CLOCK = hasattr(time, "monotonic")
_CLOCKS = (("monotonic", 0.001), ("time", 0.001), ("perf_counter", 0.001))
_NS_CLOCKS = (("monotonic_ns", 1000000), ("time_ns", 1000000), ("perf_counter_ns", 1000000))
_READS = 100
_WATCHED_MS = 50
# A clock that runs slower than half the speed, or faster than double the speed, does not count milliseconds.
_PACE = 2
_NEAR_MS = 1000


def check_clock(probe: Probe) -> None:
    """Note what is wrong with the clock."""
    before_ms = None
    for _ in range(_READS):
        now_ms = probe.call("now_ms")
        wanted = Phrase("check-expects-milliseconds")
        probe.require(type(now_ms) is int, "check-answer", method="now_ms", value=repr(now_ms), expected=wanted)
        probe.require(0 <= now_ms <= TICKS_MASK, "check-clock-unwrapped", now_ms=now_ms)
        goes_on = before_ms is None or elapsed_ms(now_ms, before_ms) <= TICKS_MASK >> 1
        probe.require(goes_on, "check-clock-goes-back", before_ms=before_ms, now_ms=now_ms)
        before_ms = now_ms
    _check_pace(probe)
    _check_wrap(probe)


def _check_wrap(probe: Probe) -> None:
    """Read the clock as it will be when the computer has been on for days, where that is possible."""
    for ahead_ms in (TICKS_MASK // 3, TICKS_MASK + 1):
        before_ms = probe.call("now_ms")
        now_ms = _read_later(lambda: probe.call("now_ms"), ahead_ms)
        if now_ms is None or (ahead_ms < TICKS_MASK and elapsed_ms(now_ms, before_ms) < _NEAR_MS):
            # The board has a clock of its own.
            return
        wraps = 0 <= now_ms <= TICKS_MASK and elapsed_ms(now_ms, later_ms(before_ms, ahead_ms)) <= _NEAR_MS
        probe.require(wraps, "check-clock-wraps-elsewhere", now_ms=now_ms)


def _check_pace(probe: Probe) -> None:
    # Read the other clock before and after the board's: a busy computer may delay the readings.
    outer_begin_ms, begin_ms, inner_begin_ms = _host_ms(), probe.call("now_ms"), _host_ms()
    probe.require(probe.wait(_WATCHED_MS), "check-clock-stands-still")
    inner_end_ms, end_ms, outer_end_ms = _host_ms(), probe.call("now_ms"), _host_ms()
    if probe.clock_is_simulated or not HAS_CLOCK:
        return
    passed_ms = elapsed_ms(end_ms, begin_ms)
    least_ms, most_ms = inner_end_ms - inner_begin_ms, outer_end_ms - outer_begin_ms
    # One more on either side, since readings are whole milliseconds.
    fits = least_ms / _PACE - 1 <= passed_ms <= most_ms * _PACE + 1
    probe.require(fits, "check-clock-pace", passed_ms=passed_ms, real_ms=most_ms)


def _read_later(read: "Callable[[], Any]", later_ms: int) -> "Any":
    """Return what ``read`` gives while this computer's clocks are ``later_ms`` ahead; None where they can't be set.

    They aren't set where there are other threads, which would see those clocks too.
    """
    threading = sys.modules.get("threading")
    if sys.implementation.name == "micropython" or (threading and threading.active_count() > 1):
        return None
    originals = [(name, getattr(time, name)) for name, _ in _CLOCKS + _NS_CLOCKS]
    try:
        for name, unit in _CLOCKS + _NS_CLOCKS:
            setattr(time, name, _ahead_by(getattr(time, name), later_ms * unit))
        return read()
    finally:
        for name, clock in originals:
            setattr(time, name, clock)


def _ahead_by(clock: "Callable[[], Any]", by: "Any") -> "Callable[[], Any]":
    return lambda: clock() + by


def _host_ms() -> float:
    """Return the time in ms by another clock than the board's; always 0 where there is none (HAS_CLOCK)."""
    return time.monotonic() * 1000 if HAS_CLOCK else 0.0
