"""Check what a board's sensors say of obstacles, infrared, persons and words that an observer shows to them.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from typing import Any

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import VOICE_GO, VOICE_STOP
from motorcade.car.check.probe import BoardFailedError, Probe
from motorcade.errors import Phrase
from motorcade.words.ticks import elapsed_ms

_OBSTACLES_MM = (250, 600, 150, NOTHING_IN_SIGHT_MM, 400)
# Sensors need some pings, or their own time: a distance that is older than this no longer helps a car that drives.
_SENSES_WITHIN_MS = 500
_TOLERANCE_MM = 30
_TOLERANCE_SHARE = 10
_MARK_MS = 9
# The space behind a frame's first mark takes 4.5 ms.
_SPACE_MS = 1
_STUCK_MS = 1000
_STEP_MS = 5


def check_inputs(probe: Probe) -> None:
    """Note what is wrong with the sensors that an observer shows something to."""
    for check in (_check_stuck_carrier, _check_carrier, _check_obstacles, _check_person, _check_voice):
        try:
            check(probe)
        except BoardFailedError:
            pass


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
    probe.breach(Phrase("check-carrier-always", method="senses_carrier", after_ms=_STUCK_MS))


def _check_carrier(probe: Probe) -> None:
    show = probe.offer("senses_carrier", "show_carrier")
    if show is None or probe.has_breach_of("senses_carrier") or not show(False):
        return
    within_ms = probe.observer.within_ms
    key = ""
    try:
        late_ms, _ = probe.settle(lambda: _carrier(probe), _is_false)
        if late_ms is None:
            key = "check-carrier-always"
            return
        show(True)
        late_ms, _ = probe.settle(lambda: _carrier(probe), bool)
        if late_ms is None or late_ms > within_ms:
            key = "check-carrier-never" if late_ms is None else "check-carrier-late"
            return
        probe.wait(_MARK_MS)
        begin_ms = probe.call("now_ms")
        show(False)
        probe.wait(_SPACE_MS)
        busy = _carrier(probe)
        # A busy computer may have looked too late.
        if not busy and elapsed_ms(probe.call("now_ms"), begin_ms) <= 2 * _SPACE_MS:
            key = "check-carrier-spaces"
            return
        late_ms, _ = probe.settle(lambda: _carrier(probe), _is_false)
        if late_ms is None or late_ms > within_ms:
            key = "check-carrier-stays"
    finally:
        show(False)
        if key:
            probe.breach(Phrase(key, method="senses_carrier", after_ms=late_ms, within_ms=within_ms))


def _check_obstacles(probe: Probe) -> None:
    put = probe.offer("obstacle_mm", "put_obstacle")
    if put is None or probe.has_breach_of("obstacle_mm"):
        return
    for asked_mm in _OBSTACLES_MM:
        real_mm = put(asked_mm)
        if real_mm is None:
            return
        late_ms, measured_mm = _settle_near(probe, real_mm)
        if late_ms is None:
            key = _distance_fault(measured_mm, real_mm)
            probe.breach(Phrase(key, method="obstacle_mm", measured_mm=measured_mm, real_mm=real_mm))
            return
        if late_ms > _SENSES_WITHIN_MS:
            probe.breach(Phrase("check-obstacle-late", method="obstacle_mm", real_mm=real_mm, after_ms=late_ms))
            return


def _settle_near(probe: Probe, real_mm: float) -> "tuple[int | None, int]":
    return probe.settle(lambda: probe.call("obstacle_mm"), lambda measured_mm: _is_near(measured_mm, real_mm))


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


def _check_person(probe: Probe) -> None:
    show = probe.offer("sees_person", "show_person")
    if show is None or probe.has_breach_of("sees_person"):
        return
    try:
        for is_there in (False, True, False):
            if not show(is_there):
                return
            late_ms, _ = probe.settle(lambda: probe.call("sees_person"), bool if is_there else _is_false)
            if late_ms is None or late_ms > _SENSES_WITHIN_MS:
                key = "check-person" if is_there else "check-person-nobody"
                probe.breach(Phrase(key, method="sees_person", within_ms=_SENSES_WITHIN_MS))
                return
    finally:
        show(False)


def _is_false(value: "Any") -> bool:
    return not value


def _check_voice(probe: Probe) -> None:
    speak = probe.offer("heard_voice", "speak")
    if speak is None or probe.has_breach_of("heard_voice"):
        return
    for voice in (VOICE_STOP, VOICE_GO):
        if not speak(voice):
            return
        late_ms, heard = probe.settle(lambda: probe.call("heard_voice"), bool)
        if heard != voice or late_ms is None or late_ms > _SENSES_WITHIN_MS:
            within_ms = _SENSES_WITHIN_MS
            probe.breach(Phrase("check-voice", method="heard_voice", value=heard, spoken=voice, within_ms=within_ms))
            return
        if not _falls_silent(probe):
            probe.breach(Phrase("check-voice-twice", method="heard_voice", value=voice))
            return


def _falls_silent(probe: Probe) -> bool:
    for _ in range(_SENSES_WITHIN_MS // _STEP_MS):
        if probe.call("heard_voice"):
            return False
        probe.wait(_STEP_MS)
    return True
