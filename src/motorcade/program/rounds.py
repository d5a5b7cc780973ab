"""The followers' words: which dwell, and which durations, so that a follower does what the blocks say.

The leader sends every word for one dwell and then the next, for ever. So a
step has to last a whole number of dwells, and it is sent as words that count
down what is left of it: 3 s of driving under a dwell of 1 s are the words
'3 s', '2 s', '1 s'. A follower that misses one, or comes into range in the
middle, still ends on time.

A follower takes a different word at once, but the same word again only when
its length is over, and that costs it up to a frame: it would fall behind a
little with each repeat. So no two words in a row are the same where that can be
helped. A block that goes on through the whole dwell anyway may carry another
duration, longer than the dwell, for the next word cuts it off.
"""

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

from motorcade.config.profile import Profile
from motorcade.program.expansion import Item
from motorcade.program.parts import Avoidance, Light, Motor, Parts, control_word, slice_of
from motorcade.program.timing import MOST_PIECES, cut


class Round(NamedTuple):
    """One way to send the followers' program.

    ``origins`` gives for each word the index of the item that it comes from;
    ``keeps_step`` is false where a follower must wait for a repeat of the same
    word and falls behind.
    """

    dwell_ms: int
    words: list[int]
    origins: list[int]
    keeps_step: bool


def best_round(items: list[Item], profile: Profile) -> Round | None:
    """The Round with the fewest words among those that keep step, or else among all that fit; None for none."""
    fallback = None
    total_ms = sum(item.total_ms for item in items)
    for dwell_ms in reversed(profile.dwell_ms):
        if fallback and total_ms > MOST_PIECES * dwell_ms:
            break
        found = round_with(items, dwell_ms, profile)
        if found and found.keeps_step and len(found.words) <= MOST_PIECES:
            return found
        fallback = fallback or found
    return fallback


def longest_dwell_ms(items: list[Item], profile: Profile) -> int | None:
    """The longest dwell that divides every step's length and that a word can last; None where there is none."""
    longest_ms = profile.durations_ms[-1]
    shared = [dwell for dwell in profile.dwell_ms if all(item.total_ms % dwell == 0 for item in items)]
    return max((dwell for dwell in shared if dwell <= longest_ms), default=None)


def fits(item: Item, profile: Profile) -> bool:
    """Whether any dwell can express this step alone."""
    return any(round_with([item], dwell_ms, profile) for dwell_ms in profile.dwell_ms)


def round_with(items: list[Item], dwell_ms: int, profile: Profile) -> Round | None:
    """The Round under this dwell, or None where some step can't be expressed with it."""
    levels = {duration: level for level, duration in enumerate(profile.durations_ms)}
    slots: list[tuple[int, Parts]] = []
    for position, item in enumerate(items):
        left = _slots(item, dwell_ms, profile)
        if not left:
            return None
        slots.extend((position, parts) for parts in left)
    words: list[int] = []
    keeps_step = True
    for number, (position, parts) in enumerate(slots):
        item = items[position]
        taken = set(words[-1:])
        if number and number == len(slots) - 1:
            taken.add(words[0])
        word = None
        for word in _words(parts, item, dwell_ms, levels):
            if word not in taken:
                break
        else:
            if word is None:
                return None
            word = next(_words(parts, item, dwell_ms, levels))
            keeps_step = False
        words.append(word)
    return Round(dwell_ms, words, [position for position, _ in slots], keeps_step)


def literal_round(items: list[Item], dwell_ms: int, profile: Profile) -> Round | int:
    """Each step as one word, sent for ``dwell_ms``; or the index of the first step that isn't one word."""
    levels = {duration: level for level, duration in enumerate(profile.durations_ms)}
    words = []
    for position, item in enumerate(items):
        if any(duration not in levels for duration in item.durations_ms):
            return position
        words.append(control_word(item.parts, levels, item.accept_ir, item.forward))
    return Round(dwell_ms, words, list(range(len(items))), True)


@cache
def _lengths(levels_ms: tuple[int, ...], dwell_ms: int) -> tuple[int, ...]:
    """The levels that are whole dwells."""
    return tuple(level for level in levels_ms if level and level % dwell_ms == 0)


def _slots(item: Item, dwell_ms: int, profile: Profile) -> list[Parts]:
    """What is left of the step at the beginning of each dwell; empty where it isn't made of dwells.

    A follower that is deaf meanwhile hears the next word only when its own is
    over, so a deaf step is cut into pieces that words can hold, and what is left
    is that of its piece.
    """
    if item.total_ms % dwell_ms:
        return []
    pieces: tuple[int, ...] | None = (item.total_ms,)
    if not item.accept_ir:
        pieces = cut(item.durations_ms, _lengths(profile.durations_ms, dwell_ms), profile.durations_ms)
    slots = []
    begin_ms = 0
    for length_ms in pieces or ():
        piece = item.parts if length_ms == item.total_ms else slice_of(item.parts, begin_ms, length_ms)
        slots.append(piece)
        slots.extend(slice_of(piece, offset_ms, length_ms) for offset_ms in range(dwell_ms, length_ms, dwell_ms))
        begin_ms += length_ms
    return slots


def _words(parts: Parts, item: Item, dwell_ms: int, levels: dict[int, int]) -> Iterator[int]:
    """The words that do what ``parts`` say for one dwell, the plainest first; none where no word does."""
    durations = parts.durations_ms
    if all(duration in levels for duration in durations):
        yield control_word(parts, levels, item.accept_ir, item.forward)
    choices = [_durations(duration, item, dwell_ms, levels) for duration in durations]
    if not all(choices):
        return
    plain = [choice[0] for choice in choices]
    if plain != list(durations):
        yield control_word(_with_durations(parts, plain), levels, item.accept_ir, item.forward)
    for position, choice in enumerate(choices):
        for duration in choice[1:]:
            changed = [*plain[:position], duration, *plain[position + 1 :]]
            yield control_word(_with_durations(parts, changed), levels, item.accept_ir, item.forward)


def _durations(left_ms: int, item: Item, dwell_ms: int, levels: dict[int, int]) -> list[int]:
    """The durations by which a block with ``left_ms`` to go may stand in a word, the plainest first."""
    own = [left_ms] if left_ms in levels else []
    # A word that makes deaf can't be cut off, and a block that ends within the dwell must end on time.
    if not item.accept_ir or left_ms < dwell_ms:
        return own
    others = [duration for duration in levels if duration >= dwell_ms and duration != left_ms]
    # Best is one that lasts beyond the dwell, so that the wheels don't stop while the next word is on its way.
    return own + sorted(others, key=lambda duration: (duration == dwell_ms, duration > left_ms, -duration))


def _with_durations(parts: Parts, durations: list[int]) -> Parts:
    given = iter(durations)
    motor, light, guard, voice, pir = parts
    return Parts(
        motor and Motor(motor[0], motor[1], next(given)),
        light and Light(light[0], next(given)),
        guard and Avoidance(guard[0], next(given)),
        voice,
        pir,
    )
