"""Compile a program to its image: the words, the step that each comes from, and errors and warnings.

How it works
============

A word has a duration for each of its parts (motor, LED, avoidance), and each duration is one of four levels of the
profile. Steps may last any sum of levels, may contain others, and may be repeated. So the compiler does three things,
for the leader and for the followers by themselves:

1. `motorcade.program.expansion.Expander` checks each step and, for the followers, unrolls repeats: the result is a row
   of items, one for each time that a step is done.
2. The **leader** executes its words one after another (`motorcade.program.leader`). An item becomes the fewest words
   whose lengths add up to its duration (`motorcade.program.parts.cut`); parts that go on are continued by the next
   word, and a part that is over is left out of it. An item that no sum of levels can express is refused with the
   nearest durations that can be. What the leader decides becomes flow words.
3. The **followers** hear each word again and again for one dwell, then the next word. So every item has to last a
   whole number of dwells, and is sent as words that count down what is left of it. The compiler tries the dwells of
   the profile, the longest first, and takes the first that fits with at most 255 words and keeps step (`best_round`;
   the docstring of `motorcade.program.expansion` says what that means). Where the program names a dwell, each step is
   one word.

Whether follower words travel with a tag is decided before, since tagged words may repeat: with "auto" they do where
some word is passed on, unless one bare word says it all.

Nothing stops at the first mistake: each one becomes a `Diagnostic` at its step, with the values that would fix it.
Words come only from a program without errors. ``origins`` leads back from each word to its step, so that a page can
show which block a car executes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from motorcade.config.arguments import instance_of
from motorcade.config.profile import Profile, built_in_profile
from motorcade.devices import DEVICES
from motorcade.errors import Phrase
from motorcade.program.conditions import Sensing
from motorcade.program.diagnostics import Diagnostic, Fix, ProgramError, error, has_errors, warning
from motorcade.program.expansion import (
    Expander,
    Item,
    Round,
    Row,
    best_round,
    either,
    literal_round,
    longest_dwell_ms,
)
from motorcade.program.flow_steps import conditions_of
from motorcade.program.fragments import IN_TURN_STEP, ToldStep
from motorcade.program.leader import Leader
from motorcade.program.model import Followers, Program, placed_steps
from motorcade.program.parts import MOST_PIECES, cut, length_ms, nearest_sums, to_ms
from motorcade.program.steps import RepeatStep, Step
from motorcade.words.flow import IN_TURN
from motorcade.words.formats import CONTROL, FLOW
from motorcade.words.image import Image, image_words
from motorcade.words.packing import words_to_bytes

_ACCEPT_IR = CONTROL.field("accept_ir").word_mask
_FORWARD = CONTROL.field("forward").word_mask
_TARGET_AT = FLOW.field("target").low
_VALUE_AT = FLOW.field("value").low
# How many longer lengths of a together are tried. Among shorter ones 0 s is always possible.
_MOST_TRIES = 100
# What a car needs for a step of a kind, and for a condition.
_DEVICE_OF_STEP = {step.kind: device.name for device in DEVICES for step in device.steps}
_DEVICE_OF_SENSE = {"obstacle": "ultrasonic", "person": "pir", "voice": "voice", "floor": "floor"}


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
        counters: the names of the leader's four counters, "" for one without a name; empty where none has one.
    """

    words: tuple[int, ...]
    leader_states: int
    follower_words: int
    dwell_ms: int
    tagged: bool
    diagnostics: tuple[Diagnostic, ...]
    origins: tuple[tuple[str, str | None], ...]
    counters: tuple[str, ...] = ()

    @property
    def image(self) -> bytes:
        """The image's bytes. Raises ProgramError where the program has errors."""
        if has_errors(self.diagnostics):
            raise ProgramError(found for found in self.diagnostics if found.severity == "error")
        return words_to_bytes(self.words)


def compile_program(program: Program, profile: Profile | None = None) -> Compiled:
    """Compile ``program`` for cars of ``profile``, by default of the built-in one that it names.

    Raises MotorcadeError where one of both is of another kind, and where none is given and the program names one that
    isn't built in.
    """
    instance_of(Program, "program", program)
    profile = instance_of(Profile, "profile", profile or built_in_profile(program.profile))
    leader = Leader(program, profile)
    followers = _Followers(program.followers, profile, leader.told, leader.has_tells)
    diagnostics = [*leader.diagnostics, *_wrong_leader(program, leader, profile), *followers.diagnostics]
    diagnostics += _lacking(program, profile)
    words: tuple[int, ...] = ()
    origins: tuple[tuple[str, str | None], ...] = ()
    if not has_errors(diagnostics):
        leader.finish(followers.targets, len(followers.words))
        diagnostics += leader.remarks
    if not has_errors(diagnostics):
        level = -1
        if followers.words:
            level = profile.dwell_ms.index(followers.dwell_ms)
        tagged = int(followers.tagged)
        decides = int(leader.decides and bool(leader.words))
        words = image_words(Image(leader.words, followers.words, level, tagged, decides))
        origins = (("", None), *leader.origins, *((item.path, item.id) for item in followers.origins))
    return Compiled(
        words,
        leader.count,
        len(followers.words) or followers.count,
        followers.dwell_ms,
        followers.tagged,
        tuple(diagnostics),
        origins,
        leader.counters,
    )


def _lacking(program: Program, profile: Profile) -> Iterator[Diagnostic]:
    """Yield a warning for each step that needs what cars of the profile lack."""
    for path, step in placed_steps(program):
        conditions = list(conditions_of(step))
        needed = {_DEVICE_OF_STEP.get(step.kind)}
        while conditions:
            condition = conditions.pop()
            conditions += condition.parts
            if isinstance(condition, Sensing):
                needed.add(_DEVICE_OF_SENSE[condition.sense])
        for device in profile.lacks:
            if device in needed:
                yield warning("car-lacks", path, step.id, what=Phrase(f"lacks-{device}"))


def _wrong_leader(program: Program, leader: Leader, profile: Profile) -> Iterator[Diagnostic]:
    """Yield what is wrong with the leader's words as a whole."""
    if has_errors(leader.diagnostics):
        return
    # A leader that stands still may send the followers their words.
    has_followers = program.followers is not None and bool(program.followers.steps)
    if not leader.count and not has_followers:
        yield warning("empty-program", "leader")
    elif leader.count > MOST_PIECES:
        steps = program.leader
        costs = leader.costs()
        yield _too_many("too-many-states", "leader", steps, leader.count, costs, profile.durations_ms[-1])
        return
    for item in leader.inexpressible.values():
        yield _not_expressible_together(item, profile.durations_ms)


class _Followers:
    """The followers' words and their dwell; ``origins`` are the items that the words come from.

    Behind the words of their own steps are those that they are told. ``targets`` are the bits that name them in a tell.
    """

    def __init__(self, followers: Followers | None, profile: Profile, told: Sequence[ToldStep], has_tells: bool):
        self.words: list[int] = []
        self.origins: list[Item] = []
        self.diagnostics: list[Diagnostic] = []
        self.targets: dict[ToldStep, int] = {}
        self.dwell_ms = 0
        self.tagged = False
        self.count = 0
        self._has_tells = has_tells
        self._profile = profile
        self._followers = followers or Followers([])
        if followers is not None and (followers.steps or not has_tells):
            self._compile_steps(followers)
        if has_tells and not has_errors(self.diagnostics):
            self._add_told(told)

    def _add_told(self, told: Sequence[ToldStep]) -> None:
        """Add the words of the steps that followers are told, each once."""
        settings = self._followers
        self.tagged = True
        if settings.tagged is False:
            problem = error("tell-untagged", "followers.tagged")
            self.diagnostics.append(problem.with_fixes(Fix("tagged", "auto")))
        if not self.words:
            self.dwell_ms = self._profile.dwell_ms[0]
            if settings.dwell_seconds is not None:
                self.dwell_ms = self._named_dwell_ms(settings.dwell_seconds)
            if not self.dwell_ms:
                return
        own = len(self.words)
        if own and IN_TURN_STEP not in told:
            self.diagnostics.append(warning("followers-never-told", "followers.steps"))
        for step in told:
            if step.step is None:
                continue
            made = self._told_word(replace(step.step, id=step.id), step)
            if made is None:
                continue
            word, item = made
            if word not in self.words:
                self.words.append(word)
                self.origins.append(item)
            self.targets[step] = self.words.index(word) << _TARGET_AT
        count = own
        if len(self.words) == own:
            count = 0
        self.targets[IN_TURN_STEP] = IN_TURN << _TARGET_AT | count << _VALUE_AT
        if IN_TURN_STEP in told and not own:
            self.diagnostics.append(error("nothing-in-turn", "followers.steps"))
        self.count = len(self.words)
        if self.count > MOST_PIECES:
            self.diagnostics.append(error("too-many-told", "leader", count=self.count, most=MOST_PIECES))

    def _told_word(self, step: Step, told: ToldStep) -> tuple[int, Item] | None:
        """Return the word of a step that followers are told, and its item; None, with an error, where it is none."""
        settings = self._followers
        accept_ir = settings.accept_ir
        forward = settings.forward
        if step.accept_ir is not None:
            accept_ir = step.accept_ir
        if step.forward is not None:
            forward = step.forward
        expander = Expander(self._profile)
        item = expander.item(step, told.path, accept_ir, forward)
        self.diagnostics += expander.diagnostics
        if item is None:
            return None
        found = literal_round([item], self.dwell_ms, self._profile)
        if isinstance(found, int):
            longest = self._profile.durations_ms[-1] / 1000
            seconds = f"{item.total_ms / 1000:g}"
            problem = error("tell-not-one-word", told.path, told.id, seconds=seconds, most=f"{longest:g}")
            self.diagnostics.append(problem.with_fixes(Fix("seconds", longest)))
            return None
        return found.words[0], item

    def _compile_steps(self, followers: Followers) -> None:
        """Compile the followers' own steps."""
        profile = self._profile
        path = "followers.steps"
        expander = Expander(profile)
        row = expander.expand(followers.steps, path, followers.accept_ir, followers.forward)
        self._items = row.items
        self._tagged = self._is_tagged(row)
        self.diagnostics = expander.diagnostics
        if has_errors(self.diagnostics):
            self._refuse_items()
            return
        if not row.items:
            self.diagnostics.append(warning("empty-program", path))
            return
        self.count = self._fewest_words(row)
        found = None
        if self.count <= MOST_PIECES:
            found = self._round()
        if found:
            self.count = len(found.words)
        if self.count > MOST_PIECES:
            rows = [expander.expand([step], "", accept_ir=True, forward=False) for step in followers.steps]
            word_ms = 0
            costs = [self._fewest_words(step_row) for step_row in rows]
            if found:
                word_ms = found.dwell_ms
                costs = [step_row.total_ms // word_ms for step_row in rows]
            self.diagnostics.append(_too_many("too-many-words", path, followers.steps, self.count, costs, word_ms))
        elif found:
            self.words = found.words
            self.dwell_ms = found.dwell_ms
            self.tagged = self._tagged
            self.origins = [row.items[position] for position in found.origins]
            self._warn()

    def _is_tagged(self, row: Row) -> bool:
        if self._has_tells:
            return True
        if self._followers.tagged != "auto":
            return self._followers.tagged
        if not any(item.forward for item in row.items):
            return False
        if row.states > 1 or self._followers.dwell_seconds is not None:
            return row.states > 1
        bare = best_round(row.items, self._profile, tagged=False)
        return bare is None or len(bare.words) > 1

    def _fewest_words(self, row: Row) -> int:
        """Return how many words ``row`` takes with the longest dwell that fits all items."""
        if self._followers.dwell_seconds is not None:
            return row.states
        dwell_ms = longest_dwell_ms(self._items, self._profile, self._tagged)
        if dwell_ms is None:
            return 0
        return row.total_ms // dwell_ms

    def _round(self) -> Round | None:
        """Return the round in which the words are sent; None, with an error, where there is none."""
        dwell_seconds = self._followers.dwell_seconds
        if dwell_seconds is not None:
            return self._literal_round(dwell_seconds)
        found = best_round(self._items, self._profile, self._tagged)
        if found is None and not self._refuse_items():
            self._no_dwell("followers.steps", None, Phrase("steps-disagree"))
        return found

    def _literal_round(self, dwell_seconds: float) -> Round | None:
        dwell_ms = self._named_dwell_ms(dwell_seconds)
        if not dwell_ms:
            return None
        found = literal_round(self._items, dwell_ms, self._profile)
        if isinstance(found, int):
            self._refuse_items()
            return None
        return found

    def _named_dwell_ms(self, dwell_seconds: float) -> int:
        """Return the dwell that the program names; 0, with an error, where the profile has no such one."""
        dwell_ms = to_ms(dwell_seconds)
        if dwell_ms in self._profile.dwell_ms:
            return dwell_ms
        reason = Phrase("dwell-not-a-level", seconds=f"{dwell_seconds:g}")
        self._no_dwell("followers.dwell_seconds", None, reason, Fix("dwell_seconds", None))
        return 0

    def _refuse_items(self) -> bool:
        """Add an error for each step that can't be expressed, whatever the others are; return whether there is one."""
        dwell_ms = None
        if self._followers.dwell_seconds is not None:
            dwell_ms = to_ms(self._followers.dwell_seconds)
        fixes = []
        if dwell_ms and best_round(self._items, self._profile, self._tagged):
            fixes.append(Fix("dwell_seconds", None))
        refused: set[str] = set()
        for item in self._items:
            # A repeated step comes several times.
            if item.path in refused:
                continue
            reason = self._refusal(item, dwell_ms)
            if reason:
                refused.add(item.path)
                self._no_dwell(item.path, item.id, reason, *fixes)
        return bool(refused)

    def _refusal(self, item: Item, dwell_ms: int | None) -> Phrase | None:
        """Return why a step can't be expressed with a dwell, with any for None; None where it can."""
        seconds = f"{item.total_ms / 1000:g}"
        if dwell_ms in self._profile.dwell_ms:
            if isinstance(literal_round([item], dwell_ms, self._profile), int):
                return Phrase("step-not-one-word", seconds=seconds)
        elif dwell_ms is None and not best_round([item], self._profile, self._tagged):
            if any(item.durations_ms):
                return Phrase("step-not-a-dwell", seconds=seconds)
            return Phrase("step-takes-no-time")
        return None

    def _no_dwell(self, path: str, step_id: str | None, reason: Phrase, *fixes: Fix) -> None:
        dwells = ", ".join(f"{dwell / 1000:g}" for dwell in self._profile.dwell_ms)
        problem = error("dwell-not-expressible", path, step_id, reason=reason, dwells=dwells)
        self.diagnostics.append(problem.with_fixes(*fixes))

    def _warn(self) -> None:
        """Warn of steps in which followers are deaf for longer than a word is sent, and of old words passed on."""
        deaf: set[str] = set()
        different = len(set(self.words))
        is_told = self.tagged
        for word, item in zip(self.words, self.origins, strict=True):
            deaf_ms = length_ms(word, self._profile)
            if not word & _ACCEPT_IR and deaf_ms > self.dwell_ms and item.path not in deaf:
                deaf.add(item.path)
                seconds = {"deaf": f"{deaf_ms / 1000:g}", "dwell": f"{self.dwell_ms / 1000:g}"}
                problem = warning("deaf-followers", item.path, item.id, **seconds)
                self.diagnostics.append(problem.with_fixes(Fix("accept_ir", True)))
            if word & _FORWARD and different > 1 and not is_told:
                is_told = True
                problem = warning("echo", item.path, item.id, count=different)
                if best_round(self._items, self._profile, tagged=True):
                    problem = problem.with_fixes(Fix("tagged", "auto"))
                self.diagnostics.append(problem)


def _too_many(code: str, path: str, steps: Sequence[Step], count: int, costs: list[int], word_ms: int) -> Diagnostic:
    """Return the error for too many states or words, each of which lasts ``word_ms`` (0 where that is not known)."""
    cost = max(costs)
    costliest = costs.index(cost)
    place = f"{path}[{costliest}]"
    if cost > 1:
        hint = Phrase("shorten-step", place=place, cost=cost)
        page_hint = Phrase("shorten-block", cost=cost)
    else:
        hint = page_hint = Phrase("too-many-steps", most=MOST_PIECES)
    step = steps[costliest]
    problem = error(code, place, step.id, count=count, cost=cost, hint=hint, page_hint=page_hint)
    left = MOST_PIECES - count + cost
    if isinstance(step, RepeatStep) and step.times and left * step.times // cost > 0:
        return problem.with_fixes(Fix("times", left * step.times // cost))
    if getattr(step, "seconds", None) is not None and cost > 1 and left * word_ms > 0:
        return problem.with_fixes(Fix("seconds", left * word_ms / 1000))
    return problem


def _not_expressible_together(item: Item, levels_ms: tuple[int, ...]) -> Diagnostic:
    """Return the Diagnostic for a together whose blocks are possible only alone: the nearest for its longest block."""

    def fits(seconds: float) -> bool:
        total_ms = round(seconds * 1000)
        durations_ms = []
        for duration_ms in item.durations_ms:
            if duration_ms == item.total_ms:
                durations_ms.append(total_ms)
            else:
                durations_ms.append(min(duration_ms, total_ms))
        return cut(tuple(durations_ms), levels_ms[1:], levels_ms) is not None

    seconds = item.total_ms / 1000
    below, above = nearest_sums(seconds, levels_ms)
    while not fits(below):
        below, _ = nearest_sums(below, levels_ms)
    for _ in range(_MOST_TRIES):
        if fits(above):
            break
        _, above = nearest_sums(above, levels_ms)
    nearest = Phrase("some-seconds", first=f"{below:g}")
    if fits(above):
        nearest = either(below, above)
    return error("duration-not-expressible", item.path, item.id, seconds=f"{seconds:g}", nearest=nearest)
