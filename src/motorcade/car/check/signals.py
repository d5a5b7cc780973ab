"""Check what takes more than a row of a table: a board's clock, its infrared and its serial line.

Portable. Under CPython the clock is also read as it will be after days; MicroPython's modules can't be changed.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

import sys
import time

from motorcade.car import frames
from motorcade.car.check.checked_board import GIVES_UP_MS, LONGEST_CALL_MS, CheckedBoard, with_others
from motorcade.errors import Phrase
from motorcade.words.infrared import to_frame
from motorcade.words.ticks import TICKS_MASK, elapsed_ms, later_ms

FRAME = to_frame(0xA4A80000)
# Whether there is another clock to compare the board's with.
HAS_CLOCK = hasattr(time, "monotonic")
_CLOCKS = tuple([(name, 0.001) for name in ("monotonic", "time", "perf_counter")])
_CLOCKS += tuple([(name, 1000000) for name in ("monotonic_ns", "time_ns", "perf_counter_ns")])
_READS = 100
_WATCHED_MS = 50
# A clock that runs slower than half the speed, or faster than double the speed, does not count milliseconds.
_PACE = 2
_NEAR_MS = 1000
_TRIES = 3
_SLACK_MS = 10
# A frame's end is watched more closely than other readings.
_FRAME_STEP_MS = 2
_MARK_MS = 9
# The space behind a frame's first mark takes 4.5 ms.
_SPACE_MS = 1
# What still comes on a line comes within this time, and is_sending ends within it.
_WITHIN_MS = 500
# The largest image at 115200 baud, which brings 11.5 bytes a ms, while ticks take as long as they do: some up to 20 ms.
_SAMPLE = range(64, 64 + 2044)
_GIVES_UP_MS = 10000
_TICKS = ((20, 230), (10, 115), (10, 115), (10, 115))


def check_clock(checked: CheckedBoard) -> None:
    """Note a clock that goes back, stands still, has another pace, or wraps elsewhere than at 2^30."""
    before_ms = None
    for _ in range(_READS):
        now_ms = checked.call("now_ms")
        checked.require(0 <= now_ms <= TICKS_MASK, "check-clock-unwrapped", now_ms=now_ms)
        goes_on = before_ms is None or elapsed_ms(now_ms, before_ms) <= TICKS_MASK >> 1
        checked.require(goes_on, "check-clock-goes-back", before_ms=before_ms, now_ms=now_ms)
        before_ms = now_ms
    _check_pace(checked)
    for ahead_ms in (TICKS_MASK // 3, TICKS_MASK + 1):
        before_ms = checked.call("now_ms")
        now_ms = _read_later(lambda: checked.call("now_ms"), ahead_ms)
        if now_ms is None or (ahead_ms < TICKS_MASK and elapsed_ms(now_ms, before_ms) < _NEAR_MS):
            # The board has a clock of its own.
            return
        wraps = 0 <= now_ms <= TICKS_MASK and elapsed_ms(now_ms, later_ms(before_ms, ahead_ms)) <= _NEAR_MS
        checked.require(wraps, "check-clock-wraps-elsewhere", now_ms=now_ms)


def _check_pace(checked: CheckedBoard) -> None:
    # Read the other clock before and after the board's: a busy computer may delay the readings.
    outer_begin_ms, begin_ms, inner_begin_ms = _host_ms(), checked.call("now_ms"), _host_ms()
    checked.require(checked.wait(_WATCHED_MS), "check-clock-stands-still")
    inner_end_ms, end_ms, outer_end_ms = _host_ms(), checked.call("now_ms"), _host_ms()
    if checked.clock_is_simulated or not HAS_CLOCK:
        return
    passed_ms = elapsed_ms(end_ms, begin_ms)
    least_ms, most_ms = inner_end_ms - inner_begin_ms, outer_end_ms - outer_begin_ms
    # One more on either side, since readings are whole milliseconds.
    fits = least_ms / _PACE - 1 <= passed_ms <= most_ms * _PACE + 1
    checked.require(fits, "check-clock-pace", passed_ms=passed_ms, real_ms=most_ms)


def _host_ms() -> float:
    """Return the time in ms by another clock than the board's; always 0 where there is none (HAS_CLOCK)."""
    return time.monotonic() * 1000 if HAS_CLOCK else 0.0


def _read_later(read: "Callable[[], Any]", later_ms: int) -> "Any":
    """Return what ``read`` gives while this computer's clocks are ``later_ms`` ahead; None where they can't be set.

    They aren't set where there are other threads, which would see those clocks too.
    """
    threading = sys.modules.get("threading")
    if sys.implementation.name == "micropython" or (threading and threading.active_count() > 1):
        return None
    clocks = [(name, getattr(time, name), later_ms * unit) for name, unit in _CLOCKS]
    return with_others(time, {name: lambda clock=clock, by=by: clock() + by for name, clock, by in clocks}, read)


def check_twice(checked: CheckedBoard) -> None:
    """Note a word that is given twice though nobody speaks."""
    heard = checked.call("heard_voice")
    checked.require(not heard or checked.call("heard_voice") != heard, "check-voice-twice", seen=heard)


def _carrier(checked: CheckedBoard) -> "Any":
    checked.prepare("senses_carrier")
    return checked.call("senses_carrier")


def check_carrier(checked: CheckedBoard) -> None:
    """Note a carrier that never ends: cars pause between their frames."""
    _, is_free = checked.settle(lambda: not _carrier(checked))
    checked.require(is_free, "check-carrier-always", after_ms=GIVES_UP_MS)


def check_spaces(checked: CheckedBoard, show: "Callable[[bool], bool]") -> None:
    """Note a board that takes the first space of a frame for its end."""
    if not show(True):
        return
    checked.settle(lambda: _carrier(checked))
    checked.wait(_MARK_MS)
    was_busy, begin_ms = _carrier(checked), checked.call("now_ms")
    show(False)
    checked.wait(_SPACE_MS)
    # A busy computer may have looked too late.
    is_busy = _carrier(checked) or elapsed_ms(checked.call("now_ms"), begin_ms) > 2 * _SPACE_MS
    checked.require(is_busy or not was_busy, "check-carrier-spaces")


def check_sending(checked: CheckedBoard) -> None:
    """Note a board whose is_sending doesn't follow its frames, or that receives its own."""
    if checked.has_breach_of("levels"):
        return
    checked.call("received_frames")
    air_ms = frames.frame_ms(FRAME, checked.board.levels)
    for _ in range(_TRIES):
        checked.prepare("send_frame")
        begin_ms = checked.call("now_ms")
        checked.call("send_frame", FRAME)
        sends, last_ms = checked.call("is_sending"), elapsed_ms(checked.call("now_ms"), begin_ms)
        # A busy computer may have looked too late.
        checked.require(sends or last_ms >= air_ms, "check-never-sending", method="is_sending")
        if sends:
            _watch_end(checked, air_ms, begin_ms)
            break
    checked.wait(_SLACK_MS)
    checked.require(FRAME not in checked.call("received_frames"), "check-echo", method="received_frames")


def _watch_end(checked: CheckedBoard, air_ms: int, begin_ms: int) -> None:
    last_ms = 0
    while checked.call("is_sending") and last_ms < air_ms + _WITHIN_MS:
        checked.wait(_FRAME_STEP_MS)
        last_ms = elapsed_ms(checked.call("now_ms"), begin_ms)
    times = {"method": "is_sending", "after_ms": last_ms, "air_ms": air_ms}
    checked.require(last_ms >= air_ms - _SLACK_MS, "check-sends-too-short", **times)
    checked.require(last_ms < air_ms + _WITHIN_MS, "check-sends-too-long", **times)


def check_line(checked: CheckedBoard, shown: "Callable[..., Any]", method: str, sends: bool) -> None:
    """Note bytes that come or go and are lost, changed or given twice; with ``sends`` while frames are sent.

    As many come as in the largest image, of every value, in the time that a line takes.
    """
    broken = checked.has_breach_of("levels", "send_frame", "is_sending") or not checked.has_own("send_frame")
    if (sends and broken) or checked.has_breach_of("bytes_a_tick"):
        return

    def call(*arguments: "Any") -> "Any":
        return checked.call(method, *arguments)

    reads = method == "read_serial"
    give, take = (shown, call) if reads else (call, shown)
    # Also line ends, zeros and bytes that end a line in some terminals.
    sample, received = bytes([(value * 7 + value // 256) & 0xFF for value in _SAMPLE]), b""
    _take_rest(checked, take)
    given = ticks = 0
    while given < len(sample):
        tick_ms, count = _TICKS[ticks % len(_TICKS)]
        if not reads:
            count = min(count, getattr(checked.board, "bytes_a_tick", count))
        give(sample[given : given + count])
        if sends and not checked.call("is_sending"):
            checked.call("send_frame", FRAME)
        checked.wait(tick_ms)
        received += take()
        given += count
        ticks += 1
    _compare(checked, received + _take_rest(checked, take), sample, sends)


def _take_rest(checked: CheckedBoard, take: "Callable[[], bytes]") -> bytes:
    """Return what comes until nothing does for a while; a slow line brings bytes late."""
    taken = b""
    silent_ms = 0
    for _ in range(_GIVES_UP_MS // LONGEST_CALL_MS):
        checked.wait(LONGEST_CALL_MS)
        data = take()
        taken += data
        silent_ms = 0 if data else silent_ms + LONGEST_CALL_MS
        if silent_ms >= _WITHIN_MS:
            break
    return taken


def _compare(checked: CheckedBoard, received: bytes, sent: bytes, while_sending: bool) -> None:
    place = 0
    while place < min(len(received), len(sent)) and received[place] == sent[place]:
        place += 1
    details: dict[str, Any] = {"received": len(received), "sent": len(sent), "place": place}
    details["expected"] = f"0x{sent[place]:02X}" if place < len(sent) else Phrase("check-none")
    details["got"] = f"0x{received[place]:02X}" if place < len(received) else Phrase("check-none")
    key = "check-line-changes"
    if while_sending:
        key = "check-line-while-sending"
    elif len(received) != len(sent):
        key = "check-line-loses" if len(received) < len(sent) else "check-line-adds"
    checked.require(received == sent, key, **details)
