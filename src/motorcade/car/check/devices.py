"""What is probed of a board, device by device: what a method gives or takes, and what must be seen.

Portable. A new sensor is one row of PROBES, with a method of BoardObserver that shows something to it.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Sequence
    from typing import Any

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import (
    AVOID_RADII_MM,
    DURATIONS_MS,
    DWELLS_MS,
    FORGET_MS,
    FORWARD,
    GAP_MS,
    IDLE_STATE_MS,
    LEFT,
    NO_LED,
    NO_VOICE,
    RIGHT,
    SENSE_MS,
    VOICE_GO,
    VOICE_STOP,
)
from motorcade.car.check.checked_board import BoardObserver, CheckedBoard, Probe, is_count
from motorcade.car.check.signals import FRAME, check_carrier, check_line, check_sending, check_spaces, check_twice
from motorcade.car.check.store import check_store
from motorcade.errors import Phrase
from motorcade.words.infrared import parity_is_even, tagged_frame, to_frame
from motorcade.words.receiver import MOST_WORDS

_ARE_LEVELS = [True] * (FORGET_MS + 1)
# Times of a profile that may be 0.
_MAY_BE_0 = (DURATIONS_MS, GAP_MS, SENSE_MS)
# A request has to fit.
_LEAST_WORDS = 12
# Nobody sees what is shorter; no profile has what is longer; and a car that is so near has no room to turn.
_SHORTEST_MS = 50
_LONGEST_MS = (1 << 20) - 1
_LEAST_RADIUS_MM = 50
# Orders of the bytes of a frame that some computers have.
_SWAPPED = ((3, 2, 1, 0), (1, 0, 3, 2), (2, 3, 0, 1))
_TOLERANCE_MM = 30
_TOLERANCE_SHARE = 10
_DIRECTIONS = (FORWARD, LEFT, RIGHT)
# Each kind of turn, a stop from each, and changes without a stop.
_SETPOINTS = tuple([(direction, speed_level) for direction in _DIRECTIONS for speed_level in (1, 2, 3, 0)])
_SETPOINTS += ((FORWARD, 3), (LEFT, 3), (RIGHT, 1), (FORWARD, 2), (FORWARD, 0))
_LEDS = (0, 1, 2, 3, NO_LED)
_WORD = 0xE4800000
_NOTES = (("image", 8), ("state", 3), ("start", 0), ("over", 0), ("frame", 0), ("heard", 0), ("lost", "parity"))


# Each attribute of a board, what it has to be, and the sentence where it is something else.
ATTRIBUTES: "tuple[tuple[str, Callable[[Any], bool], str], ...]" = (
    ("number", lambda value: is_count(value, 0xFFFFFFFF), "check-number"),
    ("is_leader", lambda value: value in (True, False), "check-is-leader"),
    (
        "levels",
        lambda value: type(value) is tuple and [is_count(level) for level in value] == _ARE_LEVELS,
        "check-levels",
    ),
    ("most_words", lambda value: is_count(value, MOST_WORDS) and value >= _LEAST_WORDS, "check-most-words"),
    ("words_a_tick", lambda value: is_count(value) and value >= 1, "check-a-tick"),
    ("bytes_a_tick", lambda value: is_count(value) and value >= 1, "check-a-tick"),
)


def check_levels(checked: CheckedBoard) -> None:
    """Note levels whose times are 0 or fall where they can't, or are in other units by their size."""
    levels = checked.board.levels
    durations, dwells = levels[DURATIONS_MS:DWELLS_MS], levels[DWELLS_MS:AVOID_RADII_MM]
    zeros = [place for place in range(len(levels)) if levels[place] == 0 and place not in _MAY_BE_0]
    rise = list(durations) == sorted(durations) and list(dwells) == sorted(dwells)
    checked.require(not zeros and rise, "check-levels-times", value=repr(levels))
    for name, times in (("durations_ms", durations), ("dwells_ms", dwells)):
        checked.require(max(times) >= _SHORTEST_MS, "check-levels-seconds", name=name, value=repr(times))
        checked.require(max(times) <= _LONGEST_MS, "check-levels-microseconds", name=name, value=repr(times))
    radii = levels[AVOID_RADII_MM:IDLE_STATE_MS]
    checked.require(max(radii) >= _LEAST_RADIUS_MM, "check-levels-centimetres", value=repr(radii))


def _wheels_fault(observer: BoardObserver, asked: "tuple[int, int]", turning: "tuple[float, float]") -> str:
    direction, speed_level = asked
    if _turn(turning, direction, speed_level, observer.turns_on_the_spot):
        return ""
    if speed_level == 0:
        return "check-wheels-run-on"
    if direction == FORWARD and max(turning) < 0:
        return "check-wheels-backward"
    if direction != FORWARD and _turn(turning, LEFT + RIGHT - direction, speed_level, False):
        return "check-wheels-swapped"
    return "check-wheels"


def _turn(turning: "tuple[float, float]", direction: int, speed_level: int, on_the_spot: bool) -> bool:
    """Return whether the wheels do what was asked."""
    if speed_level == 0:
        return turning[0] == 0 and turning[1] == 0
    if direction == FORWARD:
        return min(turning) > 0
    left, right = turning
    inner, outer = (left, right) if direction == LEFT else (right, left)
    return outer > 0 and (inner < 0 or (inner == 0 and not on_the_spot))


def _compare_speeds(checked: CheckedBoard, seen: "list[tuple[tuple[int, int], tuple[float, float]]]") -> None:
    """Note levels of which a higher one is not faster."""
    powers = {}
    for asked, (left, right) in seen:
        powers[asked] = abs(left) + abs(right)
    for direction in _DIRECTIONS:
        first, second, third = [powers[direction, speed_level] for speed_level in (1, 2, 3)]
        shown = f"{first:g}, {second:g}, {third:g}"
        is_faster = first <= second <= third and first < third
        checked.require(is_faster, "check-wheels-speeds", direction=direction, speeds=shown)


def _led_fault(observer: BoardObserver, which: int, lit: "Sequence[int]") -> str:
    if sorted(lit) == [led for led in observer.leds if led == which]:
        return ""
    if which == NO_LED:
        return "check-led-dark"
    if which in lit:
        return "check-led-others"
    return "check-led"


def _obstacle_fault(observer: BoardObserver, real_mm: int, measured_mm: int) -> str:
    if real_mm >= NOTHING_IN_SIGHT_MM:
        if measured_mm >= NOTHING_IN_SIGHT_MM:
            return ""
        return "check-obstacle-none"
    if abs(measured_mm - real_mm) <= max(_TOLERANCE_MM, real_mm / _TOLERANCE_SHARE):
        return ""
    if abs(measured_mm - real_mm / 10) <= max(1, real_mm / 10 / _TOLERANCE_SHARE):
        return "check-obstacle-centimetres"
    if abs(measured_mm - 2 * real_mm) <= real_mm / _TOLERANCE_SHARE:
        return "check-obstacle-double"
    return "check-obstacle"


def _floor_fault(observer: BoardObserver, dark: int, seen: int) -> str:
    if seen == dark:
        return ""
    if seen != 3 - dark:
        return "check-floor"
    if dark in (0, 3):
        return "check-floor-inverted"
    return "check-floor-swapped"


def _voice_fault(observer: BoardObserver, spoken: int, heard: "list[int]") -> str:
    if heard == [spoken]:
        return ""
    if heard[:2] == [spoken, spoken]:
        return "check-voice-twice"
    return "check-voice"


def _received_fault(observer: BoardObserver, frame: int, received: "list[int]") -> str:
    if received == [frame]:
        return ""
    if received[:2] == [frame, frame]:
        return "check-frame-twice"
    if parity_is_even(frame):
        return "check-frame"
    return "check-frame-of-odd-parity"


def _sent_fault(observer: BoardObserver, frame: int, sent: "list[int]") -> str:
    if sent == [frame]:
        return ""
    if not sent:
        return "check-sent-nothing"
    if sent[0] == frame:
        return "check-sent-again"
    bits, sent_bits = f"{frame:032b}", f"{sent[0]:032b}"
    orders = [[bits[8 * octet : 8 * octet + 8] for octet in order] for order in _SWAPPED]
    if sent_bits in ["".join(order) for order in orders]:
        return "check-sent-bytes"
    if sent_bits == "".join(reversed(bits)):
        return "check-sent-bits"
    return {frame ^ 1: "check-sent-parity", frame ^ 0xFFFFFFFF: "check-sent-inverted"}.get(sent[0], "check-sent")


def _listed(form: str) -> "Callable[[Sequence[int]], Any]":
    return lambda values: ", ".join([form.format(value) for value in values]) or Phrase("check-none")


PROBES: "tuple[Probe, ...]" = (
    Probe("now_ms", gives="milliseconds"),
    Probe(
        "set_wheels",
        takes=((FORWARD, 0),) + _SETPOINTS,
        needs="observe.wheels",
        steps=_SETPOINTS,
        late="check-wheels-late",
        changes="check-wheels-changes",
        fault=_wheels_fault,
        compare=_compare_speeds,
    ),
    Probe(
        "set_led",
        takes=tuple([(which,) for which in _LEDS]),
        needs="observe.lit_leds",
        steps=_LEDS + (2, NO_LED, 0, 3, 1, NO_LED),
        late="check-led-late",
        changes="check-led-changes",
        fault=_led_fault,
        shown=_listed("{}"),
    ),
    Probe(
        "obstacle_mm",
        gives="millimetres",
        needs="observe.put_obstacle",
        steps=(250, 600, 150, NOTHING_IN_SIGHT_MM, 400),
        late="check-obstacle-late",
        fault=_obstacle_fault,
    ),
    Probe(
        "sees_person",
        gives="bool",
        needs="observe.show_person",
        steps=(False, True, False),
        sentences=("check-person-none", "check-person"),
    ),
    Probe(
        "dark_floor",
        gives="floor",
        needs="observe.show_floor",
        steps=(0, 1, 3, 2, 0),
        late="check-floor-late",
        fault=_floor_fault,
    ),
    Probe(
        "heard_voice",
        gives="voice",
        needs="observe.speak",
        steps=(VOICE_STOP, VOICE_GO),
        late="check-voice-late",
        fault=_voice_fault,
        comes_once=True,
        shown=lambda heard: heard[0] if heard else NO_VOICE,
        checks=(("", check_twice),),
    ),
    Probe(
        "received_frames",
        gives="frames",
        needs="hear",
        # The brain checks parity, and counts what is odd.
        steps=(FRAME, FRAME ^ 1),
        late="check-frame-late",
        fault=_received_fault,
        comes_once=True,
        shown=_listed("0x{:08X}"),
    ),
    Probe(
        "senses_carrier",
        gives="bool",
        needs="observe.show_carrier",
        steps=(True, False),
        sentences=("check-carrier-none", "check-carrier"),
        within_ms=100,
        checks=(("", check_carrier), ("observe.show_carrier", check_spaces)),
    ),
    Probe("is_sending", gives="bool"),
    Probe(
        "send_frame",
        takes=((FRAME,),),
        calls=45,
        needs="observe.sent_frames",
        # Both parities, every byte another one; then the longest frame, and one with a tag.
        steps=(FRAME, to_frame(0xE4C25638), 0xFFFFFFFF, tagged_frame(0x64812000, 21)),
        late="check-sent-late",
        fault=_sent_fault,
        comes_once=True,
        shown=_listed("0x{:08X}"),
        checks=(("", check_sending),),
    ),
    Probe(
        "read_serial",
        gives="bytes",
        checks=(("say", check_line, "read_serial", False), ("say", check_line, "read_serial", True)),
    ),
    Probe(
        "write_serial",
        takes=((b"\n",),),
        checks=(
            ("observe.written_bytes", check_line, "write_serial", False),
            ("observe.written_bytes", check_line, "write_serial", True),
        ),
    ),
    Probe("note", takes=tuple([(kind, 0, _WORD, detail) for kind, detail in _NOTES])),
    # They may take longer: check_store says how long.
    Probe("load_image", gives="image", takes=()),
    Probe("store_image", takes=(), checks=(("", check_store),)),
)
