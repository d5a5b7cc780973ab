"""Check a board's attributes and methods, and what its sensors, actuators and infrared answer.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable
    from typing import Any

from motorcade.car import frames
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
from motorcade.car.check.probe import LONGEST_CALL_MS, BoardFailedError, Probe, brief, is_count
from motorcade.errors import Phrase
from motorcade.words.image import ImageError, parse_image_bytes
from motorcade.words.infrared import to_frame
from motorcade.words.receiver import MOST_WORDS
from motorcade.words.ticks import elapsed_ms

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
# What a car calls often, the clock first, and arguments that it gets in turn. At the end the car stands, and is dark.
_OFTEN_CALLED: "tuple[tuple[str, tuple[tuple[Any, ...], ...]], ...]" = (
    ("now_ms", ((),)),
    ("read_serial", ((),)),
    ("write_serial", ((b"\n",),)),
    ("received_frames", ((),)),
    ("senses_carrier", ((),)),
    ("is_sending", ((),)),
    ("obstacle_mm", ((),)),
    ("sees_person", ((),)),
    ("heard_voice", ((),)),
    ("set_wheels", ((0, 0), (1, 0), (2, 0))),
    ("set_led", ((0,), (1,), (2,), (3,), (NO_LED,))),
    ("note", (("state", 0, _WORD, 3),)),
)
# So many calls in a row; a method pauses if it does so in that many rounds, while the computer itself does not.
_CALLS = 120
_PAUSES = 4
_ROUNDS = 8
# A header, a state and some words for followers.
_LEAST_WORDS = 6
# Nobody sees what is shorter; no profile has what is longer; and a car that is so near has no room to turn.
_SHORTEST_MS = 50
_LONGEST_MS = (1 << 20) - 1
_LEAST_RADIUS_MM = 50
FRAME = to_frame(0xA4A80000)
_WITHIN_MS = 500
_TRIES = 3
_STEP_MS = 2
_SLACK_MS = 10


def check_attributes(probe: Probe) -> bool:
    """Note what is wrong with number, is_leader and levels; return False where the levels can't be used."""
    number, is_leader, levels = [_attribute(probe, name) for name in ("number", "is_leader", "levels")]
    if not is_count(number, 0xFFFFFFFF):
        probe.breach(Phrase("check-number", value=brief(number)))
    if is_leader not in (True, False):
        probe.breach(Phrase("check-is-leader", value=brief(is_leader)))
    if not isinstance(levels, tuple) or len(levels) != FORGET_MS + 1 or not all(is_count(each) for each in levels):
        probe.breach(Phrase("check-levels", value=brief(levels)))
        return False
    most_words = _attribute(probe, "most_words")
    if not is_count(most_words, MOST_WORDS) or most_words < _LEAST_WORDS:
        probe.breach(Phrase("check-most-words", value=brief(most_words)))
    for name in ("words_a_tick", "bytes_a_tick"):
        value = _attribute(probe, name)
        if not is_count(value) or value < 1:
            probe.breach(Phrase("check-a-tick", name=name, value=brief(value)))
    zeros = [place for place in range(len(levels)) if levels[place] == 0 and place not in _MAY_BE_0]
    falls = [list(each) != sorted(each) for each in (levels[DURATIONS_MS:DWELLS_MS], levels[DWELLS_MS:AVOID_RADII_MM])]
    if zeros or True in falls:
        probe.breach(Phrase("check-levels-times", value=repr(levels)))
        return False
    _check_units(probe, levels)
    return True


def _attribute(probe: Probe, name: str) -> "Any":
    return getattr(probe.board, name, None)


def _check_units(probe: Probe, levels: "tuple[int, ...]") -> None:
    """Note levels that are seconds, microseconds or centimetres by their size: no car could do anything with them."""
    for name, times in (("durations_ms", levels[:DWELLS_MS]), ("dwells_ms", levels[DWELLS_MS:AVOID_RADII_MM])):
        if max(times) < _SHORTEST_MS:
            probe.breach(Phrase("check-levels-seconds", name=name, value=repr(times)))
        if max(times) > _LONGEST_MS:
            probe.breach(Phrase("check-levels-microseconds", name=name, value=repr(times)))
    radii = levels[AVOID_RADII_MM:IDLE_STATE_MS]
    if max(radii) < _LEAST_RADIUS_MM:
        probe.breach(Phrase("check-levels-centimetres", value=repr(radii)))


def check_methods(probe: Probe) -> bool:
    """Note which methods of the contract are missing; return False where some are."""
    missing = [name for name in METHODS if not callable(getattr(probe.board, name, None))]
    for name in missing:
        probe.breach(Phrase("check-no-method", method=name))
    return not missing


def check_sensors(probe: Probe) -> None:
    """Note sensors that give a wrong type, or give the same event twice."""
    for name in ("senses_carrier", "is_sending", "sees_person"):
        probe.answer(name, lambda value: type(value) in (bool, int) and 0 <= value <= 1, "bool")
    probe.answer("obstacle_mm", is_count, "millimetres")
    voice = probe.answer("heard_voice", _is_voice, "voice")
    if voice and probe.answer("heard_voice", _is_voice, "voice") == voice:
        probe.breach(Phrase("check-voice-twice", method="heard_voice", value=voice))


def check_actuators(probe: Probe) -> None:
    """Note wheels, LEDs and ``note`` where they don't take every value."""
    for direction in range(RIGHT + 1):
        for speed_level in range(4):
            probe.act("set_wheels", direction, speed_level)
    probe.act("set_wheels", 0, 0)
    for which in range(NO_LED + 1):
        probe.act("set_led", which)
    for kind, detail in _NOTES:
        probe.act("note", kind, 0, _WORD, detail)


def check_pauses(probe: Probe) -> None:
    """Note methods of which some calls take long, though most don't: a buffer that fills up, or a garbage collector."""
    for name, arguments in _OFTEN_CALLED:
        if not probe.has_own(name) or probe.has_breach_of(name):
            continue
        try:
            took_ms = _pause_ms(probe, name, arguments)
        except BoardFailedError:
            continue
        if took_ms:
            probe.breach(Phrase("check-pauses", method=name, took_ms=took_ms, calls=_CALLS))
            # Every other method would seem to pause too.
            if name == "now_ms":
                return


def _pause_ms(probe: Probe, name: str, arguments: "tuple[tuple[Any, ...], ...]") -> int:
    """Return how long the method pauses in every _CALLS calls; 0 where it doesn't, or this computer itself pauses."""
    pauses = 0
    for _ in range(_ROUNDS):
        longest_ms, began_ms = 0, probe.call("now_ms")
        before_ms = began_ms
        for place in range(_CALLS):
            probe.call(name, *arguments[place % len(arguments)])
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


def check_sending(probe: Probe) -> None:
    """Note what is wrong with send_frame and is_sending, and with received_frames while nothing comes.

    A board that has no infrared doesn't override send_frame; there is nothing to check then.
    """
    try:
        _take_frames(probe)
        if probe.has_own("send_frame"):
            for _ in range(_TRIES):
                if _sends_right(probe):
                    break
            _check_echo(probe)
    except BoardFailedError:
        pass


def check_hearing(probe: Probe, hear: "Callable[[int], Any] | None") -> None:
    """Note frames that are lost, given twice, or dropped for their parity, which the board must not check."""
    if hear is None:
        # A leader receives nothing.
        if not probe.board.is_leader:
            probe.miss("received_frames", "hear")
        return
    for frame, key in ((FRAME, "check-frame"), (FRAME ^ 1, "check-frame-of-odd-parity")):
        received: list[int] = []
        if probe.has_breach_of("received_frames"):
            return
        try:
            _take_frames(probe)
            hear(frame)
            for _ in range(_WITHIN_MS // _STEP_MS):
                received += _take_frames(probe)
                probe.wait(_STEP_MS)
        except BoardFailedError:
            return
        if received != [frame]:
            shown = ", ".join([f"0x{each:08X}" for each in received[:_TRIES]]) or Phrase("check-none")
            probe.breach(Phrase(key, method="received_frames", value=shown, frame=f"0x{frame:08X}"))


def is_image_or_none(value: object) -> bool:
    """Return whether ``value`` is None or an image's bytes."""
    if value is None:
        return True
    try:
        return type(value) is bytes and bool(parse_image_bytes(value))
    except ImageError:
        return False


def _is_voice(value: object) -> bool:
    return is_count(value, VOICE_GO)


def _take_frames(probe: Probe) -> "list[int]":
    received = probe.answer("received_frames", _are_frames, "frames") or ()
    again = (probe.answer("received_frames", _are_frames, "frames") or ()) if received else ()
    if received and list(received) == list(again):
        probe.breach(Phrase("check-frames-twice", method="received_frames"))
    return list(received)


def _are_frames(value: object) -> bool:
    if not isinstance(value, (list, tuple)):
        return False
    return all(is_count(frame, 0xFFFFFFFF) for frame in value)


def _sends_right(probe: Probe) -> bool:
    """Send a frame and watch it; return False where this computer was too busy to judge that."""
    air_ms = frames.frame_ms(FRAME, probe.board.levels)
    for _ in range(_WITHIN_MS // _STEP_MS):
        if not probe.call("is_sending"):
            break
        probe.wait(_STEP_MS)
    begin_ms = probe.call("now_ms")
    probe.call("send_frame", FRAME)
    returned_ms = elapsed_ms(probe.call("now_ms"), begin_ms)
    sends = probe.call("is_sending")
    looked_ms = elapsed_ms(probe.call("now_ms"), begin_ms)
    if not sends:
        if returned_ms > LONGEST_CALL_MS:
            probe.breach(Phrase("check-send-waits", method="send_frame", took_ms=returned_ms))
            return True
        if looked_ms < air_ms:
            probe.breach(Phrase("check-never-sending", method="is_sending"))
            return True
        return False
    last_ms = looked_ms
    while probe.call("is_sending") and last_ms < air_ms + _WITHIN_MS:
        probe.wait(_STEP_MS)
        last_ms = elapsed_ms(probe.call("now_ms"), begin_ms)
    if last_ms < air_ms - _SLACK_MS:
        probe.breach(Phrase("check-sends-too-short", method="is_sending", after_ms=last_ms, air_ms=air_ms))
    if last_ms >= air_ms + _WITHIN_MS:
        probe.breach(Phrase("check-sends-too-long", method="is_sending", after_ms=last_ms, air_ms=air_ms))
    return True


def _check_echo(probe: Probe) -> None:
    probe.wait(_SLACK_MS)
    if FRAME in _take_frames(probe):
        probe.breach(Phrase("check-echo", method="received_frames"))
