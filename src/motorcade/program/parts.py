"""The parts of control words that steps fill: their bits, and durations as sums of the car's duration levels."""

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from heapq import heappop, heappush
from math import ceil, floor
from typing import Any, NamedTuple

from motorcade.config.profile import Profile
from motorcade.program.reactions import parts_at_once, with_unless
from motorcade.program.steps import SIMPLE_KINDS, AccompanyingStep, Step, TogetherStep, WaitStep, own_fields
from motorcade.words.formats import CONTROL

# No program holds more words than this, so no step is cut into more pieces.
MOST_PIECES = 255
# The duration of a part without seconds, which only a condition ends.
ENDLESS_MS = 1 << 40


class WordPart(NamedTuple):
    """What one step puts into a control word.

    Attributes:
        bits: its bits of the word, in their place, without those of the duration.
        duration_low: the lowest bit of its duration's field; -1 where it has none.
        duration_ms: how long it lasts; 0 where it has no duration.
    """

    bits: int
    duration_low: int
    duration_ms: int


WordParts = tuple[WordPart, ...]


class _Layout(NamedTuple):
    """Where the values of one kind of step are in a control word.

    Attributes:
        bits: what the kind sets in every step.
        mask: the fields that it sets.
        own_mask: all fields that it fills.
        places: of each value its name, lowest bit and mask, its least raw value, and the names of its raw values where
            it has some.
        duration_low: the lowest bit of its duration's field; -1 where it has none.
    """

    bits: int
    mask: int
    own_mask: int
    places: tuple[tuple[str, int, int, int, tuple[str, ...]], ...]
    duration_low: int


def word_fields(kind: type[Step]) -> tuple[str, ...]:
    """Return the fields of the control word that steps of ``kind`` fill, the most significant first."""
    used = {*kind.sets, *(own.metadata.get("word") for own in own_fields(kind))}
    return tuple(field.name for field in CONTROL.fields if field.name in used)


def _layout_of(kind: type[Step]) -> _Layout:
    places = []
    duration_low = -1
    for own in own_fields(kind):
        about = own.metadata
        if "word" not in about:
            continue
        field = CONTROL.field(about["word"])
        if own.name == "seconds":
            duration_low = field.low
        else:
            names = tuple(about["schema"].get("enum", ()))
            places.append((own.name, field.low, field.raw_mask, about["least"], names))
    return _Layout(
        bits=sum(raw << CONTROL.field(name).low for name, raw in kind.sets.items()),
        mask=sum(CONTROL.field(name).word_mask for name in kind.sets),
        own_mask=sum(CONTROL.field(name).word_mask for name in word_fields(kind)),
        places=tuple(places),
        duration_low=duration_low,
    )


_LAYOUTS = {kind: _layout_of(kind) for kind in SIMPLE_KINDS}
_ACCEPT_IR_AT = CONTROL.field("accept_ir").low
_FORWARD_AT = CONTROL.field("forward").low
_LEVEL_MASK = CONTROL.field("motor_duration").raw_mask
_DURATIONS_AT = sorted({layout.duration_low for layout in _LAYOUTS.values()} - {-1}, reverse=True)
# The kinds that step_in looks for, in the order of their bits. Of two kinds that fill the same fields, the one that
# sets more of them comes first.
_LOOKED_FOR = sorted(SIMPLE_KINDS, key=lambda kind: (-CONTROL.field(word_fields(kind)[0]).low, -len(kind.sets)))


def parts_of(step: Step) -> WordParts:
    """Return the parts of a step that is no repeat, has no two parts of one group and lasts whole milliseconds.

    Parts with a duration come first, from the word's most significant bits on.
    """
    parts = []
    for single in parts_at_once(step):
        parts.append(_part_of(single))
        if isinstance(single, AccompanyingStep) and (single.seconds is not None or single.until is not None):
            parts.append(_part_of(WaitStep(single.seconds)))
    return tuple(sorted(parts, key=lambda part: (-part.duration_low, -part.bits)))


def _part_of(step: Any) -> WordPart:
    bits, _, _, places, duration_low = _LAYOUTS[type(step)]
    for name, low, _, least, names in places:
        value = getattr(step, name)
        if names:
            value = least + names.index(value)
        bits |= value << low
    if duration_low < 0:
        return WordPart(bits, -1, 0)
    duration_ms: int | None = ENDLESS_MS
    if step.seconds is not None:
        duration_ms = to_ms(step.seconds)
    if duration_ms is None:
        raise ValueError(f"{step.seconds} s are no whole milliseconds")
    return WordPart(bits, duration_low, duration_ms)


def durations_of(parts: WordParts) -> tuple[int, ...]:
    """Return how long each part that has a duration lasts, in milliseconds."""
    return tuple([duration_ms for _, low, duration_ms in parts if low >= 0])


def with_durations(parts: WordParts, durations_ms: Iterable[int]) -> WordParts:
    """Return ``parts`` with other durations, one for each part that has one."""
    given = iter(durations_ms)
    return tuple([WordPart(bits, low, next(given) if low >= 0 else 0) for bits, low, _ in parts])


def slice_of(parts: WordParts, begin_ms: int, length_ms: int) -> WordParts:
    """Return the share of ``parts`` in the piece that begins at ``begin_ms`` and lasts ``length_ms``.

    A part that is over before the piece is left out; a part of 0 ms is in the first piece.
    """
    left = []
    for part in parts:
        bits, low, duration_ms = part
        if low < 0:
            left.append(part)
        elif duration_ms > begin_ms or begin_ms == 0:
            left.append(WordPart(bits, low, min(duration_ms - begin_ms, length_ms)))
    return tuple(left)


def control_word(parts: WordParts, levels: dict[int, int], accept_ir: int, forward: int) -> int:
    """Return the control word of ``parts``. Raises KeyError where a duration is no key of ``levels`` (ms -> level)."""
    word = accept_ir << _ACCEPT_IR_AT | forward << _FORWARD_AT
    for bits, low, duration_ms in parts:
        word |= bits
        if low >= 0:
            word |= levels[duration_ms] << low
    return word


def durations_in(word: int, levels_ms: tuple[int, ...]) -> tuple[int, ...]:
    """Return how long each part of a control word lasts, in milliseconds; 0 for a part that the word doesn't have."""
    return tuple([levels_ms[word >> low & _LEVEL_MASK] for low in _DURATIONS_AT])


def length_ms(word: int, profile: Profile) -> int:
    """Return how long a car is busy with a word that the compiler made, in milliseconds."""
    return max(durations_in(word, profile.durations_ms)) or profile.idle_state_ms


def step_in(word: int, levels_ms: tuple[int, ...], longest_ms: int | None = None) -> Step:
    """Return the step that a control word holds, its parts cut to ``longest_ms``; durations are levels 0 to 3."""
    found: dict[str, Step] = {}
    told = 0
    for kind in _LOOKED_FOR:
        layout = _LAYOUTS[kind]
        # A kind may fill a bit that another kind tells by itself.
        if kind.group not in found and layout.own_mask & ~told and _holds(word, layout):
            values: dict[str, Any] = {}
            for name, low, mask, least, names in layout.places:
                raw = word >> low & mask
                values[name] = raw
                if names:
                    values[name] = names[raw - least]
            if layout.duration_low >= 0:
                duration_ms = levels_ms[word >> layout.duration_low & _LEVEL_MASK]
                if longest_ms is not None:
                    duration_ms = min(duration_ms, longest_ms)
                values["seconds"] = to_seconds(duration_ms)
            found[kind.group] = kind(**values)
            told |= layout.own_mask
    steps = with_unless(list(found.values()))
    companions = [step for step in steps if isinstance(step, AccompanyingStep)]
    if len(steps) == 1 and not companions:
        return steps[0]
    if len(steps) == 2 and len(companions) == 1 and isinstance(steps[0], WaitStep):
        return replace(companions[0], seconds=steps[0].seconds)
    return TogetherStep(tuple(steps))


def _holds(word: int, layout: _Layout) -> bool:
    """Whether a control word holds a step of the kind that is laid out so."""
    if word & layout.mask != layout.bits or not word & layout.own_mask:
        return False
    for _, low, mask, least, names in layout.places:
        raw = word >> low & mask
        if raw < least or (names and raw >= least + len(names)):
            return False
    return True


def to_seconds(duration_ms: int) -> float:
    """Return whole seconds as an integer, others as a float."""
    if duration_ms % 1000 == 0:
        return duration_ms // 1000
    return duration_ms / 1000


def lasting(step: Step, duration_ms: int | None) -> Step:
    """Return the same step, of a kind that has seconds, with another duration, or with none."""
    changes: dict[str, Any] = {"seconds": None}
    if duration_ms is not None:
        changes["seconds"] = to_seconds(duration_ms)
    return replace(step, **changes)


@lru_cache(maxsize=4096)
def to_ms(seconds: float) -> int | None:
    """Return ``seconds`` in milliseconds; None where that is no whole number."""
    duration_ms = round(seconds * 1000)
    return duration_ms if abs(duration_ms - seconds * 1000) < 1e-6 else None


@lru_cache(maxsize=4096)
def cut(
    durations_ms: tuple[int, ...], lengths_ms: tuple[int, ...], levels_ms: tuple[int, ...]
) -> tuple[int, ...] | None:
    """Cut steps that start together, and last ``durations_ms``, into the fewest pieces that words can hold.

    Each piece lasts one of ``lengths_ms``, all above 0; a step either goes on through the whole piece or ends in it
    after one of ``levels_ms``. Among cuts into the same number of pieces it takes the one whose
    first pieces are longest.

    Returns the pieces' lengths in order, or None where there is no such cut. Steps of 0 ms make no piece.
    """
    total_ms = max(durations_ms, default=0)
    if total_ms == 0:
        return ()
    longest_first = sorted(lengths_ms, reverse=True)
    if not longest_first or total_ms > MOST_PIECES * longest_first[0]:
        return None
    came_from: dict[int, tuple[int, int]] = {}
    reached = [0]
    while reached and total_ms not in came_from:
        beyond = []
        for begin in reached:
            for length in longest_first:
                end = begin + length
                if end > total_ms or end in came_from:
                    continue
                if all(d <= begin or d >= end or d - begin in levels_ms for d in durations_ms):
                    came_from[end] = (begin, length)
                    beyond.append(end)
        reached = beyond
    if total_ms not in came_from:
        return None
    pieces = []
    at = total_ms
    while at:
        at, length = came_from[at]
        pieces.append(length)
    return tuple(reversed(pieces))


@lru_cache(maxsize=4096)
def is_sum(duration_ms: int, levels_ms: tuple[int, ...]) -> bool:
    """Whether levels add up to ``duration_ms``."""
    return duration_ms >= _smallest_sums(levels_ms).get(duration_ms % levels_ms[1], duration_ms + 1)


def nearest_sums(duration_s: float, levels_ms: tuple[int, ...]) -> tuple[float, float]:
    """The largest sum of levels below ``duration_s`` (at least 0) and the smallest above it, in seconds."""
    below_ms = ceil(duration_s * 1000 - 1e-6) - 1
    above_ms = floor(duration_s * 1000 + 1e-6) + 1
    step_ms = levels_ms[1]
    below = [0]
    above = []
    for residue, smallest in _smallest_sums(levels_ms).items():
        if smallest <= below_ms:
            below.append(below_ms - (below_ms - residue) % step_ms)
        above.append(max(smallest, above_ms + (residue - above_ms) % step_ms))
    return max(below) / 1000, min(above) / 1000


@lru_cache(maxsize=64)
def _smallest_sums(levels_ms: tuple[int, ...]) -> dict[int, int]:
    """For each remainder modulo the shortest duration the smallest sum of levels that leaves it.

    Every larger number with that remainder is a sum too: add the shortest duration.
    """
    step_ms = levels_ms[1]
    smallest: dict[int, int] = {}
    open_sums = [0]
    while open_sums:
        found = heappop(open_sums)
        if found % step_ms in smallest:
            continue
        smallest[found % step_ms] = found
        for level in levels_ms[2:]:
            heappush(open_sums, found + level)
    return smallest
