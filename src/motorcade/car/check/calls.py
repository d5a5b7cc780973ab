"""Check a board's attributes, and what its methods give and take.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car.brain import (
    AVOID_RADII_MM,
    DURATIONS_MS,
    DWELLS_MS,
    FORGET_MS,
    GAP_MS,
    IDLE_STATE_MS,
    NO_LED,
    RIGHT,
    SENSE_MS,
    VOICE_GO,
)
from motorcade.car.check.probe import LONGEST_CALL_MS, Probe, brief, is_count
from motorcade.words.infrared import to_frame
from motorcade.words.receiver import MOST_WORDS
from motorcade.words.ticks import elapsed_ms
from motorcade.words.upload import IMAGE, SILENCE_MS, CarEnd

METHODS: tuple[str, ...] = (
    "now_ms",
    "load_image",
    "store_image",
    "read_serial",
    "write_serial",
    "received_frames",
    "senses_carrier",
)
METHODS += ("is_sending", "send_frame", "obstacle_mm", "sees_person", "heard_voice", "set_wheels", "set_led", "note")
_MAY_BE_0 = (DURATIONS_MS, GAP_MS, SENSE_MS)
_NOTES = (("image", 8), ("state", 3), ("start", 0), ("over", 0), ("frame", 0), ("heard", 0), ("lost", "parity"))
_WORD = 0xE4800000
# A header, a state and some words for followers.
_LEAST_WORDS = 6
# So many calls in a row; a method pauses if it does so in that many rounds, while the computer itself does not.
_CALLS = 120
# Each frame takes 50 to 86 ms.
_SENT_FRAMES = 45
_PAUSES = 4
_ROUNDS = 8
# Nobody sees what is shorter; no profile has what is longer; and a car that is so near has no room to turn.
_SHORTEST_MS = 50
_LONGEST_MS = (1 << 20) - 1
_LEAST_RADIUS_MM = 50
FRAME = to_frame(0xA4A80000)


def check_attributes(probe: Probe) -> None:
    """Note what is wrong with number, is_leader, levels and what the board can do in a tick."""
    for name, fits, key in _ATTRIBUTES:
        value = getattr(probe.board, name, None)
        if not fits(value):
            probe.breach(key, method=name, name=name, value=brief(value))
    if probe.has_breach_of("levels"):
        return
    levels = probe.board.levels
    zeros = [place for place in range(len(levels)) if levels[place] == 0 and place not in _MAY_BE_0]
    falls = [list(each) != sorted(each) for each in (levels[DURATIONS_MS:DWELLS_MS], levels[DWELLS_MS:AVOID_RADII_MM])]
    probe.require(not zeros and True not in falls, "check-levels-times", method="levels", value=repr(levels))
    _check_units(probe, levels)


def _check_units(probe: Probe, levels: "tuple[int, ...]") -> None:
    """Note levels that are seconds, microseconds or centimetres by their size: no car could do anything with them."""
    for name, times in (("durations_ms", levels[:DWELLS_MS]), ("dwells_ms", levels[DWELLS_MS:AVOID_RADII_MM])):
        if max(times) < _SHORTEST_MS:
            probe.breach("check-levels-seconds", name=name, value=repr(times))
        if max(times) > _LONGEST_MS:
            probe.breach("check-levels-microseconds", name=name, value=repr(times))
    radii = levels[AVOID_RADII_MM:IDLE_STATE_MS]
    if max(radii) < _LEAST_RADIUS_MM:
        probe.breach("check-levels-centimetres", value=repr(radii))


def check_methods(probe: Probe) -> None:
    """Note which methods of the contract are missing."""
    for name in METHODS:
        if not callable(getattr(probe.board, name, None)):
            probe.breach("check-no-method", method=name)


def _check_answer(probe: Probe, fits: "Callable[[Any], bool]", expected: str) -> None:
    """Note a method that gives a wrong type, or the same word twice."""
    value = probe.answer(probe.method, fits, expected)
    if probe.method == "heard_voice" and value:
        probe.require(probe.answer(probe.method, fits, expected) != value, "check-voice-twice", value=value)


def _check_values(probe: Probe, values: "tuple[tuple[Any, ...], ...]") -> None:
    """Note a method that doesn't take every value. The last one is given in any case: it stops wheels."""
    try:
        for arguments in values:
            probe.timed(probe.method, *arguments)
    finally:
        probe.call(probe.method, *values[-1])


def _check_pauses(probe: Probe, values: "tuple[tuple[Any, ...], ...]" = ((),), calls: int = _CALLS) -> None:
    """Note a method of which some calls take long, though most don't: a buffer fills up, or memory is collected."""
    sends = probe.method == "send_frame"
    if not probe.has_breach_of("now_ms") and not (sends and probe.has_breach_of("is_sending")):
        took_ms = _pause_ms(probe, values, calls)
        probe.require(not took_ms, "check-pauses", took_ms=took_ms, calls=calls)


def _pause_ms(probe: Probe, values: "tuple[tuple[Any, ...], ...]", calls: int) -> int:
    """Return how long the method pauses in every ``calls`` calls; 0 where it doesn't, or this computer itself pauses.

    A frame is sent when the one before is over.
    """
    pauses = 0
    for _ in range(_ROUNDS):
        longest_ms, began_ms = 0, probe.call("now_ms")
        before_ms = began_ms
        for place in range(calls):
            if probe.method == "send_frame":
                probe.settle(lambda: probe.call("is_sending"), lambda sends: not sends)
                before_ms = probe.call("now_ms")
            probe.call(probe.method, *values[place % len(values)])
            now_ms = probe.call("now_ms")
            longest_ms, before_ms = max(longest_ms, elapsed_ms(now_ms, before_ms)), now_ms
        if longest_ms <= LONGEST_CALL_MS:
            return 0
        pauses += not _computer_pauses(probe, elapsed_ms(before_ms, began_ms))
        if pauses == _PAUSES:
            return longest_ms
    return 0


def _computer_pauses(probe: Probe, duration_ms: int) -> bool:
    """Return whether the time jumps within ``duration_ms`` though the board is asked for nothing but the time."""
    if probe.clock_is_simulated:
        return False
    began_ms = before_ms = probe.call("now_ms")
    while elapsed_ms(before_ms, began_ms) < duration_ms:
        now_ms = probe.call("now_ms")
        if elapsed_ms(now_ms, before_ms) > LONGEST_CALL_MS:
            return True
        before_ms = now_ms
    return False


def is_image_or_none(value: object) -> bool:
    """Return whether ``value`` is None or an image's bytes."""
    if value is None:
        return True
    if type(value) is not bytes:
        return False
    end = CarEnd()
    end.receive_data(value, 0)
    end.receive_data(b"", SILENCE_MS)
    event = end.next_event()
    return event is not None and event.kind == IMAGE and event.image == value


def is_bytes(value: object) -> bool:
    """Return whether ``value`` is bytes."""
    return type(value) is bytes


def are_frames(value: object) -> bool:
    """Return whether ``value`` is a list or tuple of frames."""
    return isinstance(value, (list, tuple)) and all(is_count(frame, 0xFFFFFFFF) for frame in value)


def _is_flag(value: object) -> bool:
    return type(value) in (bool, int) and value in (0, 1)


def _is_voice(value: object) -> bool:
    return is_count(value, VOICE_GO)


def _are_levels(value: object) -> bool:
    return isinstance(value, tuple) and len(value) == FORGET_MS + 1 and all(is_count(each) for each in value)


_ATTRIBUTES: "tuple[tuple[str, Callable[[Any], bool], str], ...]" = (
    ("number", lambda value: is_count(value, 0xFFFFFFFF), "check-number"),
    ("is_leader", lambda value: value in (True, False), "check-is-leader"),
    ("levels", _are_levels, "check-levels"),
    ("most_words", lambda value: is_count(value, MOST_WORDS) and value >= _LEAST_WORDS, "check-most-words"),
    ("words_a_tick", lambda value: is_count(value) and value >= 1, "check-a-tick"),
    ("bytes_a_tick", lambda value: is_count(value) and value >= 1, "check-a-tick"),
)
_WHEELS = tuple([(direction, speed_level) for direction in range(RIGHT + 1) for speed_level in range(4)]) + ((0, 0),)
_LEDS = tuple([(which,) for which in range(NO_LED + 1)])
# What each method gives, or takes: rows of `motorcade.car.check.CHECKS`.
CALLED: "tuple[tuple[Any, ...], ...]" = (
    ("senses_carrier", "", _check_answer, _is_flag, "bool"),
    ("is_sending", "", _check_answer, _is_flag, "bool"),
    ("sees_person", "", _check_answer, _is_flag, "bool"),
    ("obstacle_mm", "", _check_answer, is_count, "millimetres"),
    ("heard_voice", "", _check_answer, _is_voice, "voice"),
    ("received_frames", "", _check_answer, are_frames, "frames"),
    ("read_serial", "", _check_answer, is_bytes, "bytes"),
    ("write_serial", "", _check_values, ((b"ERR only a check of this board\n",),)),
    ("set_wheels", "", _check_values, _WHEELS),
    ("set_led", "", _check_values, _LEDS),
    ("note", "", _check_values, tuple([(kind, 0, _WORD, detail) for kind, detail in _NOTES])),
)
# What a car calls often, the clock first, and arguments that it gets in turn. At the end the car stands, and is dark.
PAUSES: "tuple[tuple[Any, ...], ...]" = (
    ("now_ms", "", _check_pauses),
    ("read_serial", "", _check_pauses),
    ("write_serial", "", _check_pauses, ((b"\n",),)),
    ("received_frames", "", _check_pauses),
    ("senses_carrier", "", _check_pauses),
    ("is_sending", "", _check_pauses),
    ("obstacle_mm", "", _check_pauses),
    ("sees_person", "", _check_pauses),
    ("heard_voice", "", _check_pauses),
    ("set_wheels", "", _check_pauses, ((0, 0), (1, 0), (2, 0))),
    ("set_led", "", _check_pauses, _LEDS),
    ("note", "", _check_pauses, (("state", 0, _WORD, 3),)),
    ("send_frame", "", _check_pauses, ((FRAME,),), _SENT_FRAMES),
)
