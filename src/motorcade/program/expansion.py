"""A program's steps, checked and unrolled into a row of items, and the round in which a leader sends them.

What is wrong with a step by itself is found here; what is wrong with the row (too long, no dwell that fits) is found by
the compiler.

The leader sends every follower word for one dwell, then the next word, and begins again after the last. So a step has
to last a whole number of dwells. It is sent as words that count down what is left of it: 3 s of driving with a dwell of
1 s are the words '3 s', '2 s', '1 s'. A part that goes on through the whole dwell may have another duration in the
word, longer than the dwell, because the next word replaces it.

Bare words: A follower that misses a word, or comes into range in the middle of a step, still ends the step on time. It
begins a different word at once, but the same word again only when its length is over. That makes the follower up to one
frame late, and a little later with each repeat. So two words in a row differ where that is possible.

Tagged words: A follower begins the word of each dwell once, also where it is the same word as before. So equal words
may follow each other, and the longest dwell that fits is the best. No word begins again within its dwell. So a part
that stands still may end before the dwell ends: the car stands still after it, too. What is guaranteed:

- A follower that receives the first frame of each dwell does what the steps describe, one frame later. Where the leader
  or another car is sending at that time, it is later by at most another frame and a gap.
- A follower that receives a word only later begins the whole word then. So the word's parts end as late as they began,
  or when the follower receives the next word. The delays do not add up: how late a follower begins a word depends only
  on the frames of that word.
- A follower that receives no frame of a word executes the word before it until that is over, then stands still.
- A deaf word (one that does not accept infrared) may end a moment after the first frame of the next word. The follower
  then receives the next word from a later frame; the leader sends two more within 500 ms. Each further deaf word in a
  row may make the follower later by one more frame.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

from motorcade.config.profile import Profile
from motorcade.errors import Phrase
from motorcade.program.diagnostics import BEHIND, Diagnostic, Fix, error
from motorcade.program.parts import (
    MOST_PIECES,
    WordPart,
    WordParts,
    control_word,
    cut,
    durations_of,
    is_sum,
    nearest_sums,
    parts_of,
    slice_of,
    to_ms,
    with_durations,
)
from motorcade.program.reactions import reactions_of, wrong_reactions
from motorcade.program.steps import LONGEST_S, RepeatStep, Step, TogetherStep, is_deciding
from motorcade.words.formats import CONTROL

_MOTOR_ENABLE = CONTROL.field("motor_enable").word_mask
_MOTOR_SPEED = CONTROL.field("motor_speed").word_mask
_VOICE = CONTROL.field("voice").word_mask


class Item(NamedTuple):
    """One step of the row, at its ``path`` in the program; ``total_ms`` is its longest duration, or the idle time."""

    parts: WordParts
    durations_ms: tuple[int, ...]
    total_ms: int
    path: str
    id: str | None
    accept_ir: bool
    forward: bool


class Row(NamedTuple):
    """Steps in the order in which they are done.

    ``states`` (how many steps a follower does) and ``total_ms`` are those of the whole row; ``items`` lists each step
    as often as it is done, but the steps of a repeat that needs more than MOST_PIECES only once.
    """

    items: list[Item]
    states: int
    total_ms: int


class Expander:
    """Unroll the steps of one car's program; ``diagnostics`` lists what is wrong with them."""

    def __init__(self, profile: Profile):
        self.diagnostics: list[Diagnostic] = []
        self._levels_ms = profile.durations_ms
        self._idle_ms = profile.idle_state_ms

    def expand(self, steps: Sequence[Step], path: str, accept_ir: bool, forward: bool) -> Row:
        """The Row of ``steps``, which stand at ``path`` and inherit the two settings."""
        items: list[Item] = []
        states = total_ms = 0
        for position, step in enumerate(steps):
            row = self._expand_step(step, f"{path}[{position}]", accept_ir, forward)
            items.extend(row.items)
            states += row.states
            total_ms += row.total_ms
        return Row(items, states, total_ms)

    def _expand_step(self, step: Step, path: str, accept_ir: bool, forward: bool) -> Row:
        if is_deciding(step):
            self.diagnostics.append(error("followers-cannot-decide", path, step.id))
            return Row([], 0, 0)
        if step.accept_ir is not None:
            accept_ir = step.accept_ir
        if step.forward is not None:
            forward = step.forward
        if isinstance(step, RepeatStep):
            times = step.times or 1
            once = self.expand(step.steps, f"{path}.repeat.steps", accept_ir, forward)
            states = once.states * times
            items = once.items
            if states <= MOST_PIECES:
                items = items * times
            return Row(items, states, once.total_ms * times)
        item = self.item(step, path, accept_ir, forward)
        if item is None:
            return Row([], 0, 0)
        return Row([item], 1, item.total_ms)

    def item(self, step: Step, path: str, accept_ir: bool, forward: bool) -> Item | None:
        """Return the Item of a step that holds no list of others; None, with diagnostics, where it is wrong."""
        if not self._check_step(step, path):
            return None
        parts = parts_of(step)
        durations_ms = durations_of(parts)
        total_ms = max(durations_ms, default=0) or self._idle_ms
        return Item(parts, durations_ms, total_ms, path, step.id, accept_ir, forward)

    def check_settings(self, step: Step, path: str) -> None:
        """Refuse settings that a leader's step can't have."""
        if step.accept_ir:
            self.diagnostics.append(error("leader-accepts-ir", path, step.id))
        if step.forward is not None:
            allowed = f"{step.kind}, id, accept_ir"
            self.diagnostics.append(error("unknown-field", f"{path}.forward", step.id, name="forward", allowed=allowed))

    def _check_step(self, step: Step, path: str) -> bool:
        before = len(self.diagnostics)
        self.diagnostics += wrong_reactions(step, path, step.id)
        if isinstance(step, TogetherStep):
            for position, part in enumerate(step.steps):
                self.diagnostics += wrong_reactions(part, f"{path}.together[{position}]", part.id or step.id)
            if len(self.diagnostics) == before:
                self._check_conflict(step, path)
            for position, part in enumerate(step.steps):
                place = f"{path}.together[{position}]"
                self._check_duration(part, place, step.id)
                if getattr(part, "seconds", 0) is None and not part.accompanies and step.until is None:
                    self._no_seconds(part, place)
        elif getattr(step, "seconds", None) is None and step.until is None:
            self._no_seconds(step, path)
        else:
            self._check_duration(step, path, step.id)
        return len(self.diagnostics) == before

    def _no_seconds(self, step: Step, path: str) -> None:
        problem = error("missing-field", f"{path}.{step.kind}", step.id, name="seconds")
        self.diagnostics.append(problem.with_fixes(Fix("seconds", self._levels_ms[1] / 1000)))

    def _check_conflict(self, step: TogetherStep, path: str) -> None:
        seen: dict[str, str] = {}
        for position, part in enumerate(step.steps):
            for beside in (part, *reactions_of(part)):
                if beside.group in seen:
                    kinds = Phrase(f"step-{beside.kind}")
                    other = Phrase(f"step-{seen[beside.group]}")
                    if other != kinds:
                        kinds = Phrase("one-and-other", first=other, second=kinds)
                    place = f"{path}.together[{position}]"
                    problem = error("parallel-conflict", place, part.id or step.id, kinds=kinds)
                    # Behind the together, a step that accompanies others would have no duration.
                    if part.id is not None and getattr(part, "seconds", None) is not None:
                        problem = problem.with_fixes(Fix(BEHIND))
                    self.diagnostics.append(problem)
                seen[beside.group] = beside.kind

    def _check_duration(self, step: Step, path: str, step_id: str | None) -> None:
        seconds = getattr(step, "seconds", None)
        if seconds is None:
            return
        duration_ms = to_ms(seconds)
        if duration_ms is not None and is_sum(duration_ms, self._levels_ms):
            return
        below, above = nearest_sums(seconds, self._levels_ms)
        nearest = either(below, above)
        problem = error("duration-not-expressible", path, step.id or step_id, seconds=f"{seconds:g}", nearest=nearest)
        # 0 s is possible, yet nobody means it who writes half a second.
        fixes = [Fix("seconds", value) for value in (below, above) if 0 < value <= LONGEST_S]
        self.diagnostics.append(problem.with_fixes(*fixes))


def either(below: float, above: float) -> Phrase:
    """Return the phrase for one of two durations, in seconds."""
    return Phrase("seconds-or-seconds", first=f"{below:g}", second=f"{above:g}")


class Round(NamedTuple):
    """One way to send the followers' program.

    ``origins`` gives for each word the index of the item that it comes from;
    ``keeps_step`` is False where the same bare word is sent for two dwells in a row:
    a follower then begins it late the second time.
    """

    dwell_ms: int
    words: list[int]
    origins: list[int]
    keeps_step: bool


def best_round(items: list[Item], profile: Profile, tagged: bool) -> Round | None:
    """Return the Round with the fewest words, if possible one that keeps step; None where no dwell fits."""
    fallback = None
    total_ms = sum(item.total_ms for item in items)
    for dwell_ms in reversed(profile.dwell_ms):
        if fallback and total_ms > MOST_PIECES * dwell_ms:
            break
        found = round_with(items, dwell_ms, profile, tagged)
        if found and found.keeps_step and len(found.words) <= MOST_PIECES:
            return found
        fallback = fallback or found
    return fallback


def longest_dwell_ms(items: list[Item], profile: Profile, tagged: bool) -> int | None:
    """The longest dwell that divides every step's length and that words can fill; None where there is none."""
    longest_ms = profile.durations_ms[-1]
    shared = [dwell for dwell in profile.dwell_ms if all(item.total_ms % dwell == 0 for item in items)]
    filled = (dwell for dwell in shared if dwell <= longest_ms or round_with(items, dwell, profile, tagged))
    return max(filled, default=None)


def round_with(items: list[Item], dwell_ms: int, profile: Profile, tagged: bool) -> Round | None:
    """Return the Round with this dwell; None where it can't express some step."""
    levels = profile.duration_levels
    slots: list[tuple[int, WordParts]] = []
    for position, item in enumerate(items):
        left = _slots(item, dwell_ms, profile)
        if not left:
            return None
        slots.extend((position, parts) for parts in left)
    words: list[int] = []
    keeps_step = True
    for number, (position, parts) in enumerate(slots):
        neighbours: set[int] = set()
        if not tagged:
            neighbours.update(words[-1:])
            # The first word follows the last one.
            if number == len(slots) - 1:
                neighbours.update(words[:1])
        first = None
        for word in _words(parts, items[position], dwell_ms, levels, tagged):
            if first is None:
                first = word
            if word not in neighbours:
                words.append(word)
                break
        else:
            if first is None:
                return None
            words.append(first)
            keeps_step = False
    return Round(dwell_ms, words, [position for position, _ in slots], keeps_step)


def literal_round(items: list[Item], dwell_ms: int, profile: Profile) -> Round | int:
    """Return a Round of one word a step, sent for ``dwell_ms``; or the index of the first step that isn't one word."""
    levels = profile.duration_levels
    words = []
    for position, item in enumerate(items):
        if any(duration not in levels for duration in item.durations_ms):
            return position
        words.append(control_word(item.parts, levels, item.accept_ir, item.forward))
    return Round(dwell_ms, words, list(range(len(items))), True)


@cache
def _lengths(levels_ms: tuple[int, ...], dwell_ms: int) -> tuple[int, ...]:
    """Return the levels that are a whole number of dwells."""
    return tuple(level for level in levels_ms if level and level % dwell_ms == 0)


def _slots(item: Item, dwell_ms: int, profile: Profile) -> list[WordParts]:
    """Return what is left of the step at the beginning of each dwell; nothing where it isn't made of whole dwells.

    A follower that does not accept infrared receives the next word only when its
    own is over. So such a step is cut into pieces, each of which a word can hold,
    and the words count down each piece by itself.
    """
    if item.total_ms % dwell_ms:
        return []
    pieces: tuple[int, ...] | None = (item.total_ms,)
    if not item.accept_ir:
        pieces = cut(item.durations_ms, _lengths(profile.durations_ms, dwell_ms), profile.durations_ms)
    slots = []
    begin_ms = 0
    for length_ms in pieces or ():
        piece = item.parts
        if length_ms < item.total_ms:
            piece = slice_of(piece, begin_ms, length_ms)
        slots.append(piece)
        slots.extend(slice_of(piece, offset_ms, length_ms) for offset_ms in range(dwell_ms, length_ms, dwell_ms))
        begin_ms += length_ms
    return slots


def _words(parts: WordParts, item: Item, dwell_ms: int, levels: dict[int, int], tagged: bool) -> Iterator[int]:
    """Yield the words that do what ``parts`` describe for one dwell, the simplest first; none where no word does."""
    durations = durations_of(parts)
    if all(duration in levels for duration in durations):
        yield control_word(parts, levels, item.accept_ir, item.forward)
    # A word that listens for voices has to last as long as voices have an effect.
    may_rest = tagged and not any(part.bits & _VOICE for part in parts)
    timed = [part for part in parts if part.duration_low >= 0]
    choices = [_durations(part, item, dwell_ms, levels, may_rest and _stands_still(part)) for part in timed]
    if not all(choices):
        return
    plain = [choice[0] for choice in choices]
    if plain != list(durations):
        yield control_word(with_durations(parts, plain), levels, item.accept_ir, item.forward)
    for position, choice in enumerate(choices):
        for duration in choice[1:]:
            changed = [*plain[:position], duration, *plain[position + 1 :]]
            yield control_word(with_durations(parts, changed), levels, item.accept_ir, item.forward)


def _stands_still(part: WordPart) -> bool:
    """Whether a part holds the wheels still, which they also do after it."""
    return part.bits & _MOTOR_ENABLE > 0 and part.bits & _MOTOR_SPEED == 0


def _durations(part: WordPart, item: Item, dwell_ms: int, levels: dict[int, int], may_be_short: bool) -> list[int]:
    """Return the durations that a word may hold for a part that is not over yet, the simplest first."""
    left_ms = part.duration_ms
    own = []
    if left_ms in levels:
        own.append(left_ms)
    # The next word can't replace a deaf word early, and a block that ends within the dwell must end on time.
    if not item.accept_ir or left_ms < dwell_ms:
        return own
    others = [duration for duration in levels if duration >= dwell_ms and duration != left_ms]
    # Best is one that lasts beyond the dwell, so that the wheels don't stop while the next word is on its way.
    others.sort(key=lambda duration: (duration == dwell_ms, duration > left_ms, -duration))
    if may_be_short and not own and not others:
        return [max(levels)]
    return own + others
