"""Compile a program to its image: the words, the step that each comes from, and errors and warnings."""

from collections.abc import Sequence
from dataclasses import dataclass

from motorcade.config.profile import Profile, built_in_profile
from motorcade.errors import Phrase
from motorcade.program.diagnostics import Diagnostic, Fix, ProgramError, error, has_errors, warning
from motorcade.program.expansion import (
    Expander,
    Item,
    Round,
    Row,
    best_round,
    can_be_sent,
    cut_for_leader,
    either,
    literal_round,
    longest_dwell_ms,
    round_with,
)
from motorcade.program.model import Followers, Program
from motorcade.program.parts import (
    MOST_PIECES,
    control_word,
    cut,
    durations_in,
    is_sum,
    nearest_sums,
    slice_of,
    to_ms,
    with_durations,
)
from motorcade.program.steps import LONGEST_S, RepeatStep, Step, TogetherStep, walk
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words, words_to_bytes

_ACCEPT_IR = CONTROL.field("accept_ir").word_mask
_FORWARD = CONTROL.field("forward").word_mask
# A together of three blocks may have no length above its own that fits, so the search stops after so many tries.
_MOST_TRIES = 100


@dataclass(frozen=True)
class Compiled:
    """A compiled program.

    Attributes:
        words: header word, leader's words, followers' words; empty where there are errors.
        leader_states, follower_words: how many there are of each, also where they are too many for an image.
        dwell_ms: how long each follower word is sent; 0 where there are none.
        tagged: whether follower words are sent with a tag; False where there are none.
        diagnostics: errors and warnings.
        origins: for each word the path and id of the step that it comes from; for the
            header ``("", None)``.
    """

    words: tuple[int, ...]
    leader_states: int
    follower_words: int
    dwell_ms: int
    tagged: bool
    diagnostics: tuple[Diagnostic, ...]
    origins: tuple[tuple[str, str | None], ...]

    @property
    def image(self) -> bytes:
        """The image's bytes. Raises ProgramError where the program has errors."""
        if has_errors(self.diagnostics):
            raise ProgramError(each for each in self.diagnostics if each.severity == "error")
        return words_to_bytes(self.words)


def compile_program(program: Program, profile: Profile | None = None) -> Compiled:
    """Compile ``program`` for cars of ``profile``, by default of the built-in one that it names.

    Raises MotorcadeError where the program names a profile that isn't built in, and none is given.
    """
    profile = profile or built_in_profile(program.profile)
    leader = _Leader(program.leader, profile)
    followers = _Followers(program.followers, profile)
    diagnostics = (*leader.diagnostics, *followers.diagnostics)
    words: tuple[int, ...] = ()
    origins: tuple[tuple[str, str | None], ...] = ()
    if not has_errors(diagnostics):
        level = profile.dwell_ms.index(followers.dwell_ms) if followers.words else -1
        words = image_words(Image(leader.words, followers.words, level, int(followers.tagged)))
        origins = (("", None), *leader.origins, *followers.origins)
    counts = (leader.count, followers.count, followers.dwell_ms, followers.tagged)
    return Compiled(words, *counts, diagnostics, origins)


class _Leader:
    """The leader's states."""

    def __init__(self, steps: Sequence[Step], profile: Profile):
        self.words: list[int] = []
        self.origins: list[tuple[str, str | None]] = []
        self._steps = steps
        self._levels_ms = profile.durations_ms
        self._expander = Expander(profile, leads=True)
        row = self._expander.expand(steps, "leader", accept_ir=False, forward=True)
        self.diagnostics = self._expander.diagnostics
        self.count = row.states
        if has_errors(self.diagnostics):
            return
        if not row.items:
            self.diagnostics.append(warning("empty-program", "leader"))
        if self.count > MOST_PIECES:
            costs = [self._expander.expand([step], "", accept_ir=False, forward=True).states for step in steps]
            self.diagnostics.append(
                _too_many("too-many-states", "leader", steps, self.count, costs, self._levels_ms[-1])
            )
            return
        levels = {duration: level for level, duration in enumerate(self._levels_ms)}
        for item in row.items:
            self._add(item, levels)

    def _add(self, item: Item, levels: dict[int, int]) -> None:
        pieces = cut_for_leader(item, self._levels_ms)
        if pieces is None:
            self.diagnostics.append(_not_expressible_together(item, self._steps, self._levels_ms))
            return
        begin_ms = 0
        for length_ms in pieces or (0,):
            parts = item.parts if len(pieces) <= 1 else slice_of(item.parts, begin_ms, length_ms)
            self.words.append(control_word(parts, levels, 0, 1))
            self.origins.append((item.path, item.id))
            begin_ms += length_ms


class _Followers:
    """The followers' words and their dwell."""

    def __init__(self, followers: Followers | None, profile: Profile):
        self.words: list[int] = []
        self.origins: list[tuple[str, str | None]] = []
        self.diagnostics: list[Diagnostic] = []
        self.dwell_ms = 0
        self.tagged = False
        self.count = 0
        if followers is None:
            return
        self._profile = profile
        self._dwells = ", ".join(f"{dwell / 1000:g}" for dwell in profile.dwell_ms)
        expander = Expander(profile, leads=False)
        row = expander.expand(followers.steps, "followers.steps", followers.accept_ir, followers.forward)
        self.diagnostics = expander.diagnostics
        if has_errors(self.diagnostics):
            return
        if not row.items:
            self.diagnostics.append(warning("empty-program", "followers.steps"))
            return
        self._tagged = self._is_tagged(row, followers)
        self.count = self._fewest_words(row, row.items, followers)
        found = self._round(row, followers) if self.count <= MOST_PIECES else None
        if found:
            self.count = len(found.words)
        if self.count > MOST_PIECES:
            rows = [expander.expand([step], "", accept_ir=True, forward=False) for step in followers.steps]
            costs = [
                each.total_ms // found.dwell_ms if found else self._fewest_words(each, row.items, followers)
                for each in rows
            ]
            path = "followers.steps"
            word_ms = found.dwell_ms if found else 0
            self.diagnostics.append(_too_many("too-many-words", path, followers.steps, self.count, costs, word_ms))
        if not found or self.count > MOST_PIECES:
            return
        self.words, self.dwell_ms, self.tagged = found.words, found.dwell_ms, self._tagged
        self.origins = [(row.items[position].path, row.items[position].id) for position in found.origins]
        self._warn_of_deafness(row.items, found)
        if not self.tagged:
            self._warn_of_echo(row.items, found)

    def _is_tagged(self, row: Row, followers: Followers) -> bool:
        if followers.tagged != "auto":
            return followers.tagged
        if not any(item.forward for item in row.items):
            return False
        if row.states > 1 or followers.dwell_seconds is not None:
            return row.states > 1
        bare = best_round(row.items, self._profile, tagged=False)
        return bare is None or len(bare.words) > 1

    def _fewest_words(self, row: Row, items: list[Item], followers: Followers) -> int:
        """Return how many words ``row`` takes with the longest dwell that fits all ``items``."""
        if followers.dwell_seconds is not None:
            return row.states
        dwell_ms = longest_dwell_ms(items, self._profile, self._tagged)
        return row.total_ms // dwell_ms if dwell_ms else 0

    def _round(self, row: Row, followers: Followers) -> Round | None:
        if followers.dwell_seconds is not None:
            return self._literal_round(row.items, followers.dwell_seconds)
        found = best_round(row.items, self._profile, self._tagged)
        if found is None:
            item = next((item for item in row.items if not can_be_sent(item, self._profile, self._tagged)), None)
            if item is None:
                reason = Phrase("steps-disagree")
            elif any(item.durations_ms):
                reason = Phrase("step-not-a-dwell", seconds=f"{item.total_ms / 1000:g}")
            else:
                reason = Phrase("step-takes-no-time")
            self._no_common_dwell(row.items, followers, item, reason)
        return found

    def _literal_round(self, items: list[Item], dwell_seconds: float) -> Round | None:
        dwell_ms = to_ms(dwell_seconds)
        if dwell_ms not in self._profile.dwell_ms:
            reason = Phrase("dwell-not-a-level", seconds=f"{dwell_seconds:g}")
            self._no_dwell("followers.dwell_seconds", None, reason, Fix("dwell_seconds", None))
            return None
        found = literal_round(items, dwell_ms, self._profile)
        if isinstance(found, int):
            item = items[found]
            # The compiler's own choice of how long to send a word may have more words for the step.
            fixes = [Fix("dwell_seconds", None)] if best_round(items, self._profile, self._tagged) else []
            reason = Phrase("step-not-one-word", seconds=f"{item.total_ms / 1000:g}")
            self._no_dwell(item.path, item.id, reason, *fixes)
            return None
        return found

    def _no_common_dwell(self, items: list[Item], followers: Followers, wrong: Item | None, reason: Phrase) -> None:
        """Add the error for steps that no dwell fits, about the block where one other duration would fix it."""
        fitting = _lengths_that_fit(items, self._profile, self._tagged)
        for item in items if wrong is None else [wrong]:
            block = _longest_block(followers.steps, item) if item.path in fitting else None
            if block:
                self._no_dwell(*block, reason, *(Fix("seconds", each / 1000) for each in fitting[item.path]))
                return
        self._no_dwell(*((wrong.path, wrong.id) if wrong else ("followers.steps", None)), reason)

    def _no_dwell(self, path: str, step_id: str | None, reason: object, *fixes: Fix) -> None:
        problem = error("dwell-not-expressible", path, step_id, reason=reason, dwells=self._dwells)
        self.diagnostics.append(problem.with_fixes(*fixes))

    def _warn_of_deafness(self, items: list[Item], found: Round) -> None:
        warned = set()
        for word, position in zip(found.words, found.origins, strict=True):
            item = items[position]
            deaf_ms = length_ms(word, self._profile)
            if not word & _ACCEPT_IR and deaf_ms > found.dwell_ms and item.path not in warned:
                warned.add(item.path)
                seconds = {"deaf": f"{deaf_ms / 1000:g}", "dwell": f"{found.dwell_ms / 1000:g}"}
                problem = warning("deaf-followers", item.path, item.id, **seconds)
                self.diagnostics.append(problem.with_fixes(Fix("accept_ir", True)))

    def _warn_of_echo(self, items: list[Item], found: Round) -> None:
        different = len(set(found.words))
        for word, position in zip(found.words, found.origins, strict=True):
            if word & _FORWARD and different > 1:
                item = items[position]
                fixes = [Fix("tagged", "auto")] if best_round(items, self._profile, tagged=True) else []
                self.diagnostics.append(warning("echo", item.path, item.id, count=different).with_fixes(*fixes))
                return


def length_ms(word: int, profile: Profile) -> int:
    """Return how long a car is busy with a word that the compiler made, in milliseconds."""
    return max(durations_in(word, profile.durations_ms)) or profile.idle_state_ms


def _too_many(code: str, path: str, steps: Sequence[Step], count: int, costs: list[int], word_ms: int) -> Diagnostic:
    """Return the error for too many states or words, each of which lasts ``word_ms`` (0 where that is not known)."""
    costliest = costs.index(max(costs))
    place = f"{path}[{costliest}]"
    cost = max(costs)
    if cost > 1:
        hint, page_hint = Phrase("shorten-step", place=place, cost=cost), Phrase("shorten-block", cost=cost)
    else:
        hint = page_hint = Phrase("too-many-steps", most=MOST_PIECES)
    step = steps[costliest]
    problem = error(code, place, step.id, count=count, cost=cost, hint=hint, page_hint=page_hint)
    left = MOST_PIECES - count + cost
    if isinstance(step, RepeatStep) and left * step.times // cost > 0:
        return problem.with_fixes(Fix("times", left * step.times // cost))
    if getattr(step, "seconds", None) is not None and cost > 1 and left * word_ms > 0:
        return problem.with_fixes(Fix("seconds", left * word_ms / 1000))
    return problem


def _not_expressible_together(item: Item, steps: Sequence[Step], levels_ms: tuple[int, ...]) -> Diagnostic:
    """Return the Diagnostic for a together whose blocks are possible only alone: the nearest for its longest block.

    Where one block alone is the longest, the Diagnostic is about this block; ``steps`` are the whole program's.
    """

    def fits(seconds: float) -> bool:
        total_ms = round(seconds * 1000)
        durations_ms = tuple(
            total_ms if duration == item.total_ms else min(duration, total_ms) for duration in item.durations_ms
        )
        return cut(durations_ms, levels_ms[1:], levels_ms) is not None

    seconds = item.total_ms / 1000
    below, above = nearest_sums(seconds, levels_ms)
    while not fits(below):
        below, _ = nearest_sums(below, levels_ms)
    for _ in range(_MOST_TRIES):
        if fits(above):
            break
        _, above = nearest_sums(above, levels_ms)
    nearest = either(below, above) if fits(above) else Phrase("some-seconds", first=f"{below:g}")
    block = _longest_block(steps, item)
    path, step_id = block or (item.path, item.id)
    problem = error("duration-not-expressible", path, step_id, seconds=f"{seconds:g}", nearest=nearest)
    lengths = [each for each in (below, above) if block and 0 < each <= LONGEST_S]
    alone = (each for each in lengths if cut_for_leader(_lasting(item, round(each * 1000)), levels_ms))
    return problem.with_fixes(*(Fix("seconds", each) for each in alone))


def _longest_block(steps: Sequence[Step], item: Item) -> tuple[str, str | None] | None:
    """The path and id of the one block of ``item`` that lasts longest; None where there is no such block."""
    step = dict(walk(steps, item.path.partition("[")[0]))[item.path]
    if not isinstance(step, TogetherStep):
        return None if getattr(step, "seconds", None) is None else (item.path, item.id)
    times_s = [getattr(part, "seconds", None) or 0 for part in step.steps]
    longest_s = max(times_s, default=0)
    if not longest_s or times_s.count(longest_s) > 1:
        return None
    position = times_s.index(longest_s)
    return f"{item.path}.together[{position}]", step.steps[position].id or item.id


def _lasting(item: Item, length_ms: int) -> Item:
    """Return ``item`` with another duration in the place of its longest."""
    longest_ms = max(item.durations_ms, default=0)
    durations_ms = tuple(length_ms if each == longest_ms else each for each in item.durations_ms)
    parts = with_durations(item.parts, durations_ms)
    return item._replace(parts=parts, durations_ms=durations_ms, total_ms=max(durations_ms, default=length_ms))


def _lengths_that_fit(items: list[Item], profile: Profile, tagged: bool) -> dict[str, list[int]]:
    """For each step that alone keeps all from being sent: the durations near its own with which all can be sent.

    Returns the nearest shorter and the nearest longer duration in milliseconds, by the step's path.
    """
    found: dict[str, list[int]] = {}
    for dwell_ms in profile.dwell_ms:
        wrong = {item.path: item for item in items if not round_with([item], dwell_ms, profile, tagged)}
        if len(wrong) != 1:
            continue
        (item,) = wrong.values()
        longest_ms = max(item.durations_ms, default=0)
        below_ms = longest_ms // dwell_ms * dwell_ms
        for length_ms in (below_ms, below_ms + dwell_ms):
            is_length = 0 < length_ms <= LONGEST_S * 1000 and is_sum(length_ms, profile.durations_ms)
            if is_length and round_with([_lasting(item, length_ms)], dwell_ms, profile, tagged):
                found.setdefault(item.path, []).append(length_ms)
        if item.path in found:
            shorter = [each for each in found[item.path] if each < longest_ms]
            longer = [each for each in found[item.path] if each > longest_ms]
            found[item.path] = sorted(shorter)[-1:] + sorted(longer)[:1]
    return {path: lengths for path, lengths in found.items() if lengths}
