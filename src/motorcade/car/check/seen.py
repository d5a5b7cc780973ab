"""Check what a board's outputs really did, and what its sensors say of what is shown to them.

Portable. Most checks use an observer; that of sending and that of a carrier that never ends watch the board alone.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Sequence
    from typing import Any

from motorcade.car import frames
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import FORWARD, LEFT, NO_LED, RIGHT, VOICE_GO, VOICE_STOP
from motorcade.car.check.calls import FRAME, are_frames
from motorcade.car.check.probe import LONGEST_CALL_MS, Probe
from motorcade.errors import Phrase
from motorcade.words.infrared import tagged_frame, to_frame
from motorcade.words.ticks import elapsed_ms

# A car that drives on, each kind of turn, stops from each, and changes without a stop.
_SETPOINTS = (
    ((FORWARD, 1), (FORWARD, 2), (FORWARD, 3), (FORWARD, 0))
    + ((LEFT, 1), (LEFT, 2), (LEFT, 3), (LEFT, 0))
    + ((RIGHT, 1), (RIGHT, 2), (RIGHT, 3), (RIGHT, 0))
    + ((FORWARD, 3), (LEFT, 3), (RIGHT, 1), (FORWARD, 2), (FORWARD, 0))
)
_LEDS = (0, 1, 2, 3, NO_LED, 2, NO_LED, 0, 3, 1, NO_LED)
# Both parities, every byte another one; then the longest frame, and one with a tag.
_FRAMES = (FRAME, to_frame(0xE4C25638), 0xFFFFFFFF, tagged_frame(0x64812000, 21))
# An output goes on until the next call; watchdogs of motor drivers end it sooner.
_HOLDS_MS = 1000
_PAUSE_MS = 20
_OBSTACLES_MM = (250, 600, 150, NOTHING_IN_SIGHT_MM, 400)
# Sensors need some pings, or their own time: a distance that is older than this no longer helps a car that drives.
_WITHIN_MS = 500
_TOLERANCE_MM = 30
_TOLERANCE_SHARE = 10
_MARK_MS = 9
# The space behind a frame's first mark takes 4.5 ms.
_SPACE_MS = 1
_STUCK_MS = 1000
_STEP_MS = 5
# A frame's end is watched more closely.
_FRAME_STEP_MS = 2
_TRIES = 3
_SLACK_MS = 10


def _check_wheels(probe: Probe, wheels: "Callable[[], Any]") -> None:
    """Note wheels that don't turn as set_wheels asks, do it late, or stop by themselves."""
    powers: dict[tuple[int, int], float] = {}
    try:
        for setpoint in _SETPOINTS if wheels() is not None else ():
            powers[setpoint] = _wheels_turn(probe, wheels, setpoint, setpoint not in powers)
    finally:
        probe.call("set_wheels", FORWARD, 0)
    for direction in (FORWARD, LEFT, RIGHT) if powers else ():
        first, second, third = [powers[direction, speed_level] for speed_level in (1, 2, 3)]
        shown = f"{first:g}, {second:g}, {third:g}"
        is_faster = first <= second <= third and first < third
        probe.require(is_faster, "check-wheels-speeds", direction=direction, speeds=shown)


def _wheels_turn(probe: Probe, wheels: "Callable[[], Any]", setpoint: "tuple[int, int]", watches: bool) -> float:
    """Set the wheels and return how much they turn together.

    With ``watches`` they have to go on by themselves, for a longer time at the highest level.
    """
    direction, speed_level = setpoint
    within_ms, asked = probe.observer.within_ms, {"direction": direction, "speed_level": speed_level}

    def fits(turning: "Any") -> bool:
        return _turns(turning, direction, speed_level, probe.observer.turns_on_the_spot)

    probe.call("set_wheels", direction, speed_level)
    left, right = turning = probe.see(wheels, fits, within_ms, "check-wheels-late", **asked)
    key = "check-wheels"
    if speed_level == 0:
        key = "check-wheels-run-on"
    elif direction == FORWARD and left < 0 and right < 0:
        key = "check-wheels-backward"
    elif direction != FORWARD and _turns(turning, LEFT + RIGHT - direction, speed_level, False):
        key = "check-wheels-swapped"
    probe.require(fits(turning), key, left=left, right=right, **asked)
    # A motor reaches its speed later than it begins to turn.
    probe.wait(_HOLDS_MS if watches and setpoint == (FORWARD, 3) else within_ms)
    left, right = turning = wheels()
    probe.require(fits(turning), "check-wheels-change", left=left, right=right, **asked)
    return float(abs(left) + abs(right))


def _turns(turning: "Any", direction: int, speed_level: int, on_the_spot: bool) -> bool:
    left, right = turning
    if speed_level == 0:
        return bool(left == 0 and right == 0)
    if direction == FORWARD:
        return bool(left > 0 and right > 0)
    inner, outer = (left, right) if direction == LEFT else (right, left)
    return bool(outer > 0 and (inner < 0 or (inner == 0 and not on_the_spot)))


def _check_leds(probe: Probe, lit_leds: "Callable[[], Sequence[int]]") -> None:
    """Note LEDs that aren't lit as set_led asks, or late, or go out by themselves."""
    within_ms = probe.observer.within_ms
    try:
        for place, which in enumerate(_LEDS if probe.observer.leds else ()):
            wanted = [which] if which in probe.observer.leds else []
            probe.call("set_led", which)

            def fits(lit: "Sequence[int]", wanted: "list[int]" = wanted) -> bool:
                return sorted(lit) == wanted

            lit = probe.see(lit_leds, fits, within_ms, "check-led-late", which=which)
            key = "check-led-dark" if which == NO_LED else "check-led-others" if which in lit else "check-led"
            probe.require(fits(lit), key, which=which, lit=_shown(lit))
            probe.wait(_PAUSE_MS if place else _HOLDS_MS)
            lit = lit_leds()
            probe.require(fits(lit), "check-led-changes", which=which, lit=_shown(lit))
    finally:
        probe.call("set_led", NO_LED)


def _shown(values: "Sequence[int]", form: str = "{}") -> "Any":
    return ", ".join([form.format(value) for value in values]) or Phrase("check-none")


def _carrier(probe: Probe) -> "Any":
    # As the loop of a car does: some boards look at their receiver's edges only here.
    probe.call("received_frames")
    return probe.call("senses_carrier")


def _check_stuck_carrier(probe: Probe) -> None:
    # Cars pause between their frames: no air is busy for so long.
    for _ in range(_STUCK_MS // _STEP_MS):
        if not _carrier(probe):
            return
        probe.wait(_STEP_MS)
    probe.breach("check-carrier-always", after_ms=_STUCK_MS)


def _check_carrier(probe: Probe, show: "Callable[[bool], bool]") -> None:
    within_ms = probe.observer.within_ms

    def see(is_on: bool, late: str, never: str) -> None:
        found = probe.see(lambda: _carrier(probe), lambda busy: bool(busy) == is_on, within_ms, late)
        probe.require(bool(found) == is_on, never, after_ms=_STUCK_MS, within_ms=within_ms)

    try:
        if not show(False):
            return
        late_ms, _ = probe.settle(lambda: _carrier(probe), _is_false)
        probe.require(late_ms is not None, "check-carrier-always", after_ms=_STUCK_MS)
        show(True)
        see(True, "check-carrier-late", "check-carrier-never")
        probe.wait(_MARK_MS)
        begin_ms = probe.call("now_ms")
        show(False)
        probe.wait(_SPACE_MS)
        # A busy computer may have looked too late.
        is_busy = _carrier(probe) or elapsed_ms(probe.call("now_ms"), begin_ms) > 2 * _SPACE_MS
        probe.require(is_busy, "check-carrier-spaces")
        see(False, "check-carrier-stays", "check-carrier-stays")
    finally:
        show(False)


def _check_obstacles(probe: Probe, put: "Callable[[int], int | None]") -> None:
    for asked_mm in _OBSTACLES_MM:
        real_mm = put(asked_mm)
        if real_mm is None:
            return

        def fits(measured_mm: int, real_mm: int = real_mm) -> bool:
            return _is_near(measured_mm, real_mm)

        measured_mm = probe.see(
            lambda: probe.call("obstacle_mm"), fits, _WITHIN_MS, "check-obstacle-late", real_mm=real_mm
        )
        key = _distance_fault(measured_mm, real_mm)
        probe.require(fits(measured_mm), key, measured_mm=measured_mm, real_mm=real_mm)


def _is_near(measured_mm: int, real_mm: float) -> bool:
    if real_mm >= NOTHING_IN_SIGHT_MM or measured_mm >= NOTHING_IN_SIGHT_MM:
        return measured_mm >= NOTHING_IN_SIGHT_MM and real_mm >= NOTHING_IN_SIGHT_MM
    return abs(measured_mm - real_mm) <= max(_TOLERANCE_MM, real_mm / _TOLERANCE_SHARE)


def _distance_fault(measured_mm: int, real_mm: float) -> str:
    if real_mm >= NOTHING_IN_SIGHT_MM:
        return "check-obstacle-none"
    if abs(measured_mm - real_mm / 10) <= max(1, real_mm / 10 / _TOLERANCE_SHARE):
        return "check-obstacle-centimetres"
    if abs(measured_mm - 2 * real_mm) <= real_mm / _TOLERANCE_SHARE:
        return "check-obstacle-double"
    return "check-obstacle"


def _check_person(probe: Probe, show: "Callable[[bool], bool]") -> None:
    try:
        for is_there in (False, True, False):
            if not show(is_there):
                return
            key = "check-person" if is_there else "check-person-nobody"
            fits = bool if is_there else _is_false
            seen = probe.see(lambda: probe.call("sees_person"), fits, _WITHIN_MS, key)
            probe.require(fits(seen), key, within_ms=_WITHIN_MS)
    finally:
        show(False)


def _is_false(value: "Any") -> bool:
    return not value


def _check_voice(probe: Probe, speak: "Callable[[int], bool]") -> None:
    for voice in (VOICE_STOP, VOICE_GO):
        if not speak(voice):
            return
        late_ms, heard = probe.settle(lambda: probe.call("heard_voice"), bool)
        is_heard = heard == voice and late_ms is not None and late_ms <= _WITHIN_MS
        probe.require(is_heard, "check-voice", value=heard, spoken=voice, within_ms=_WITHIN_MS)
        for _ in range(_WITHIN_MS // _STEP_MS):
            probe.require(not probe.call("heard_voice"), "check-voice-twice", value=voice)
            probe.wait(_STEP_MS)


def _take_frames(probe: Probe) -> "list[int]":
    def take() -> "list[int]":
        return list(probe.fitting("received_frames", probe.call("received_frames"), are_frames, "frames"))

    received = take()
    probe.require(not received or received != take(), "check-frames-twice", method="received_frames")
    return received


def _check_sending(probe: Probe) -> None:
    """Note what is wrong with send_frame and is_sending, and a board that receives its own frames."""
    if probe.has_breach_of("levels"):
        return
    _take_frames(probe)
    for _ in range(_TRIES):
        if _sends_right(probe):
            break
    probe.wait(_SLACK_MS)
    probe.require(FRAME not in _take_frames(probe), "check-echo", method="received_frames")


def _sends_right(probe: Probe) -> bool:
    """Send a frame and watch it; return False where this computer was too busy to judge that."""
    air_ms = frames.frame_ms(FRAME, probe.board.levels)
    probe.settle(lambda: probe.call("is_sending"), _is_false)
    begin_ms = probe.call("now_ms")
    probe.call("send_frame", FRAME)
    returned_ms = elapsed_ms(probe.call("now_ms"), begin_ms)
    sends = probe.call("is_sending")
    last_ms = elapsed_ms(probe.call("now_ms"), begin_ms)
    if not sends:
        probe.require(returned_ms <= LONGEST_CALL_MS, "check-send-waits", took_ms=returned_ms)
        probe.require(last_ms >= air_ms, "check-never-sending", method="is_sending")
        return False
    while probe.call("is_sending") and last_ms < air_ms + _WITHIN_MS:
        probe.wait(_FRAME_STEP_MS)
        last_ms = elapsed_ms(probe.call("now_ms"), begin_ms)
    times = {"method": "is_sending", "after_ms": last_ms, "air_ms": air_ms}
    probe.require(last_ms >= air_ms - _SLACK_MS, "check-sends-too-short", **times)
    probe.require(last_ms < air_ms + _WITHIN_MS, "check-sends-too-long", **times)
    return True


def _check_sent(probe: Probe, sent_frames: "Callable[[], Sequence[int] | None]") -> None:
    """Note frames that the emitter sends with other bits, late, twice or never."""
    if probe.has_breach_of("levels") or sent_frames() is None:
        return
    # Frames that were sent before may come late.
    probe.wait(_HOLDS_MS)
    for frame in _FRAMES:
        air_ms = frames.frame_ms(frame, probe.board.levels)
        probe.settle(lambda: probe.call("is_sending"), _is_false)
        sent_frames()
        sent: list[int] = []
        probe.call("send_frame", frame)
        late_ms, _ = probe.settle(lambda sent=sent: sent.extend(sent_frames() or ()) or sent, bool)  # type: ignore[misc]
        # A frame that is sent twice is on the air for as long once more.
        probe.wait(air_ms + probe.observer.within_ms)
        sent.extend(sent_frames() or ())
        asked = f"0x{frame:08X}"
        probe.require(sent == [frame], _sent_fault(sent, frame), frame=asked, sent=_shown(sent, "0x{:08X}"))
        begins = late_ms is None or late_ms <= air_ms + probe.observer.within_ms
        probe.require(begins, "check-sent-late", frame=asked, after_ms=late_ms, air_ms=air_ms)


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


def _check_hearing(probe: Probe, hear: "Callable[[int], Any]") -> None:
    """Note frames that are lost, given twice, or dropped for their parity, which the board must not check."""
    for frame, key in ((FRAME, "check-frame"), (FRAME ^ 1, "check-frame-of-odd-parity")):
        received: list[int] = []
        _take_frames(probe)
        hear(frame)
        for _ in range(_WITHIN_MS // _FRAME_STEP_MS):
            received += _take_frames(probe)
            probe.wait(_FRAME_STEP_MS)
        shown = _shown(received[:_TRIES], "0x{:08X}")
        probe.require(received == [frame], key, value=shown, frame=f"0x{frame:08X}")


# Rows of `motorcade.car.check.CHECKS`.
SEEN: "tuple[tuple[str, str, Callable[..., Any]], ...]" = (
    ("set_wheels", "observe.wheels", _check_wheels),
    ("set_led", "observe.lit_leds", _check_leds),
    ("senses_carrier", "", _check_stuck_carrier),
    ("senses_carrier", "observe.show_carrier", _check_carrier),
    ("obstacle_mm", "observe.put_obstacle", _check_obstacles),
    ("sees_person", "observe.show_person", _check_person),
    ("heard_voice", "observe.speak", _check_voice),
    ("send_frame", "", _check_sending),
    ("send_frame", "observe.sent_frames", _check_sent),
    ("received_frames", "hear", _check_hearing),
)
