"""Check that a board's outputs do what its methods ask: an observer shows what wheels, LEDs and emitter did.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Sequence
    from typing import Any

from motorcade.car import frames
from motorcade.car.brain import FORWARD, LEFT, NO_LED, RIGHT
from motorcade.car.check.probe import BoardFailedError, Probe
from motorcade.errors import Phrase
from motorcade.words.infrared import tagged_frame, to_frame

# A car that drives on, each kind of turn, stops from each, and changes without a stop.
_SETPOINTS = (
    ((FORWARD, 1), (FORWARD, 2), (FORWARD, 3), (FORWARD, 0))
    + ((LEFT, 1), (LEFT, 2), (LEFT, 3), (LEFT, 0))
    + ((RIGHT, 1), (RIGHT, 2), (RIGHT, 3), (RIGHT, 0))
    + ((FORWARD, 3), (LEFT, 3), (RIGHT, 1), (FORWARD, 2), (FORWARD, 0))
)
_LEDS = (0, 1, 2, 3, NO_LED, 2, NO_LED, 0, 3, 1, NO_LED)
# Both parities, every byte another one; then the longest frame, and one with a tag.
_FRAMES = (to_frame(0xA4A80000), to_frame(0xE4C25638), 0xFFFFFFFF, tagged_frame(0x64812000, 21))
# An output goes on until the next call; watchdogs of motor drivers end it sooner.
_HOLDS_MS = 1000
_PAUSE_MS = 20


def check_wheels(probe: Probe) -> None:
    """Note wheels that don't turn as set_wheels asks, do it late, or stop by themselves."""
    wheels = probe.offer("set_wheels", "wheels")
    if wheels is None or wheels() is None or probe.has_breach_of("set_wheels"):
        return
    try:
        powers: dict[tuple[int, int], float] = {}
        for direction, speed_level in _SETPOINTS:
            power = _wheels_turn(probe, wheels, direction, speed_level, (direction, speed_level) not in powers)
            if power is None:
                return
            powers[direction, speed_level] = power
        _check_speeds(probe, powers)
    except BoardFailedError:
        pass
    finally:
        probe.act("set_wheels", FORWARD, 0)


def _wheels_turn(
    probe: Probe, wheels: "Callable[[], Any]", direction: int, speed_level: int, watches: bool
) -> "float | None":
    """Set the wheels and return how much they turn together; note a breach and return None where they turn otherwise.

    With ``watches`` they have to go on by themselves, for a longer time at the highest level.
    """

    def fits(turning: "Any") -> bool:
        return _turns(turning, direction, speed_level, probe.observer.turns_on_the_spot)

    asked = {"method": "set_wheels", "direction": direction, "speed_level": speed_level}
    probe.call("set_wheels", direction, speed_level)
    late_ms, turning = probe.settle(wheels, fits)
    if late_ms is None:
        probe.breach(_wheel_fault(turning, direction, speed_level, asked))
        return None
    if late_ms > probe.observer.within_ms:
        probe.breach(Phrase("check-wheels-late", after_ms=late_ms, within_ms=probe.observer.within_ms, **asked))
        return None
    # A motor reaches its speed later than it begins to turn.
    probe.wait(_HOLDS_MS if watches and speed_level == 3 and direction == FORWARD else probe.observer.within_ms)
    turning = wheels()
    if not fits(turning):
        probe.breach(Phrase("check-wheels-change", left=turning[0], right=turning[1], **asked))
        return None
    return float(abs(turning[0]) + abs(turning[1]))


def _turns(turning: "Any", direction: int, speed_level: int, on_the_spot: bool) -> bool:
    left, right = turning
    if speed_level == 0:
        return bool(left == 0 and right == 0)
    if direction == FORWARD:
        return bool(left > 0 and right > 0)
    inner, outer = (left, right) if direction == LEFT else (right, left)
    return bool(outer > 0 and (inner < 0 or (inner == 0 and not on_the_spot)))


def _wheel_fault(turning: "Any", direction: int, speed_level: int, asked: "dict[str, Any]") -> Phrase:
    left, right = turning
    key = "check-wheels"
    if speed_level == 0:
        key = "check-wheels-run-on"
    elif direction == FORWARD and left < 0 and right < 0:
        key = "check-wheels-backward"
    elif direction != FORWARD and _turns(turning, LEFT + RIGHT - direction, speed_level, False):
        key = "check-wheels-swapped"
    return Phrase(key, left=left, right=right, **asked)


def _check_speeds(probe: Probe, powers: "dict[tuple[int, int], float]") -> None:
    for direction in (FORWARD, LEFT, RIGHT):
        first, second, third = [powers[direction, speed_level] for speed_level in (1, 2, 3)]
        if not (first <= second <= third and first < third):
            shown = f"{first:g}, {second:g}, {third:g}"
            probe.breach(Phrase("check-wheels-speeds", method="set_wheels", direction=direction, speeds=shown))
            return


def check_leds(probe: Probe) -> None:
    """Note LEDs that aren't lit as set_led asks, or late, or go out by themselves."""
    lit_leds = probe.offer("set_led", "lit_leds")
    if lit_leds is None or not probe.observer.leds or probe.has_breach_of("set_led"):
        return
    try:
        for which in _LEDS:
            if not _led_is_lit(probe, lit_leds, which):
                return
    except BoardFailedError:
        pass
    finally:
        probe.act("set_led", NO_LED)


def _led_is_lit(probe: Probe, lit_leds: "Callable[[], Sequence[int]]", which: int) -> bool:
    wanted = [which] if which in probe.observer.leds else []

    def fits(lit: "Sequence[int]") -> bool:
        return sorted(lit) == wanted

    probe.call("set_led", which)
    late_ms, lit = probe.settle(lit_leds, fits)
    if late_ms is None:
        key = "check-led-dark" if which == NO_LED else "check-led-others" if which in lit else "check-led"
        probe.breach(Phrase(key, method="set_led", which=which, lit=_shown(lit)))
        return False
    if late_ms > probe.observer.within_ms:
        within_ms = probe.observer.within_ms
        probe.breach(Phrase("check-led-late", method="set_led", which=which, after_ms=late_ms, within_ms=within_ms))
        return False
    probe.wait(_HOLDS_MS if which == _LEDS[0] else _PAUSE_MS)
    lit = lit_leds()
    if not fits(lit):
        probe.breach(Phrase("check-led-changes", method="set_led", which=which, lit=_shown(lit)))
    return fits(lit)


def _shown(lit: "Sequence[int]") -> "Any":
    return ", ".join([str(led) for led in lit]) or Phrase("check-none")


def check_sent(probe: Probe) -> None:
    """Note frames that the emitter sends with other bits, late, twice or never."""
    sent_frames = probe.offer("send_frame", "sent_frames")
    if sent_frames is None or sent_frames() is None or probe.has_breach_of("send_frame"):
        return
    try:
        # Frames that were sent before may come late.
        probe.wait(_HOLDS_MS)
        for frame in _FRAMES:
            if not _is_sent(probe, sent_frames, frame):
                return
    except BoardFailedError:
        pass


def _is_sent(probe: Probe, sent_frames: "Callable[[], Sequence[int]]", frame: int) -> bool:
    air_ms = frames.frame_ms(frame, probe.board.levels)
    probe.settle(lambda: probe.call("is_sending"), lambda sends: not sends)
    sent_frames()
    sent: list[int] = []

    def take() -> "list[int]":
        sent.extend(sent_frames())
        return sent

    probe.call("send_frame", frame)
    late_ms, _ = probe.settle(take, bool)
    # A frame that is sent twice is on the air for as long once more.
    probe.wait(air_ms + probe.observer.within_ms)
    take()
    asked = f"0x{frame:08X}"
    if sent != [frame]:
        shown = ", ".join([f"0x{each:08X}" for each in sent]) or Phrase("check-none")
        probe.breach(Phrase(_sent_fault(sent, frame), method="send_frame", frame=asked, sent=shown))
        return False
    if late_ms is not None and late_ms > air_ms + probe.observer.within_ms:
        probe.breach(Phrase("check-sent-late", method="send_frame", frame=asked, after_ms=late_ms, air_ms=air_ms))
        return False
    return True


def _sent_fault(sent: "list[int]", frame: int) -> str:
    if not sent:
        return "check-sent-nothing"
    if len(sent) > 1 and sent[0] == frame:
        return "check-sent-again"
    octets = [frame >> place & 0xFF for place in (24, 16, 8, 0)]
    reversed_bits = 0
    for place in range(32):
        reversed_bits |= (frame >> place & 1) << (31 - place)
    known = (
        (frame ^ 1, "check-sent-parity"),
        (octets[3] << 24 | octets[2] << 16 | octets[1] << 8 | octets[0], "check-sent-bytes"),
        (octets[1] << 24 | octets[0] << 16 | octets[3] << 8 | octets[2], "check-sent-bytes"),
        (octets[2] << 24 | octets[3] << 16 | octets[0] << 8 | octets[1], "check-sent-bytes"),
        (reversed_bits, "check-sent-bits"),
        (frame ^ 0xFFFFFFFF, "check-sent-inverted"),
    )
    for changed, key in known:
        if sent[0] == changed:
            return key
    return "check-sent"
