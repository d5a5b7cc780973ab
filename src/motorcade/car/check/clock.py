"""A board's clock: milliseconds that go on, never back, and wrap at 2^30.

Portable.
"""

from motorcade.car.check.probe import BoardFailedError, Probe
from motorcade.car.check.surroundings import HAS_CLOCK, host_ms, read_later
from motorcade.words.ticks import TICKS_MASK, elapsed_ms, later_ms

_READS = 100
_WATCHED_MS = 50
# Half or double the pace is no badly set clock, it counts something else.
_PACE = 2
_NEAR_MS = 1000


def check_clock(probe: Probe) -> bool:
    """Note what is wrong with the clock; False where nothing else can be timed by it."""
    try:
        return _readings_fit(probe) and _goes_on(probe) and _wraps(probe)
    except BoardFailedError:
        return False


def _readings_fit(probe: Probe) -> bool:
    before_ms = None
    for _ in range(_READS):
        now_ms = probe.call("now_ms")
        if type(now_ms) is not int:
            probe.breach(f"now_ms() gave {now_ms!r}; it has to give whole milliseconds, an int")
            return False
        if not 0 <= now_ms <= TICKS_MASK:
            probe.breach(f"now_ms() gave {now_ms}; it has to wrap at 2^30: give now & 0x3FFFFFFF")
            return False
        if before_ms is not None and elapsed_ms(now_ms, before_ms) > TICKS_MASK >> 1:
            probe.breach(f"now_ms() went back from {before_ms} to {now_ms}; take a clock that never does")
            return False
        before_ms = now_ms
    return True


def _wraps(probe: Probe) -> bool:
    """Read the clock as it will be when the computer has been on for days, where that can be had."""
    for ahead_ms in (TICKS_MASK // 3, TICKS_MASK + 1):
        before_ms = probe.call("now_ms")
        now_ms = read_later(lambda: probe.call("now_ms"), ahead_ms)
        if now_ms is None or (ahead_ms < TICKS_MASK and elapsed_ms(now_ms, before_ms) < _NEAR_MS):
            # The board has a clock of its own.
            return True
        if not 0 <= now_ms <= TICKS_MASK or elapsed_ms(now_ms, later_ms(before_ms, ahead_ms)) > _NEAR_MS:
            probe.breach(
                f"now_ms() will give {now_ms} once the computer has been on for some days; "
                "it has to wrap at 2^30, neither sooner nor later: give now & 0x3FFFFFFF"
            )
            return False
    return True


def _goes_on(probe: Probe) -> bool:
    # Read around the board's clock, so that a computer that is busy meanwhile does it no injustice.
    outer_begin_ms, begin_ms, inner_begin_ms = host_ms(), probe.call("now_ms"), host_ms()
    if not probe.wait(_WATCHED_MS):
        probe.breach("now_ms() stands still, or counts something longer than milliseconds")
        return False
    inner_end_ms, end_ms, outer_end_ms = host_ms(), probe.call("now_ms"), host_ms()
    if probe.clock_is_simulated or not HAS_CLOCK:
        return True
    passed_ms = elapsed_ms(end_ms, begin_ms)
    least_ms, most_ms = inner_end_ms - inner_begin_ms, outer_end_ms - outer_begin_ms
    # One more on either side: whole milliseconds were begun before, and are begun now.
    if least_ms / _PACE - 1 <= passed_ms <= most_ms * _PACE + 1:
        return True
    probe.breach(f"now_ms() went on by {passed_ms} in {most_ms:.3f} ms; it has to count milliseconds")
    return False
