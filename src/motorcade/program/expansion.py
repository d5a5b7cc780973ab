"""A program's steps, checked and unrolled into a row of single steps.

What can be wrong with a step by itself is found here; what can be wrong with
the row (too long, no dwell that fits) is the compiler's.
"""

from collections.abc import Sequence
from typing import NamedTuple

from motorcade.config.profile import Profile
from motorcade.program.diagnostics import Diagnostic, Phrase, error, phrase
from motorcade.program.parts import Parts, parts_of
from motorcade.program.steps import PirStep, RepeatStep, Step, TogetherStep, VoiceStep, WaitStep
from motorcade.program.timing import MOST_PIECES, cut, is_sum, nearest_sums, pieces_needed, to_ms

# Three blocks may have no common length above theirs at all, so the search for one ends.
_MOST_TRIES = 100


class Item(NamedTuple):
    """One step of the row."""

    parts: Parts
    durations_ms: tuple[int, ...]
    total_ms: int
    path: str
    id: str | None
    accept_ir: bool
    forward: bool


class Row(NamedTuple):
    """Steps one behind the other.

    ``states`` (of a leader's states, of a follower's steps) and ``total_ms`` are those
    of the whole row; ``items`` lists each step as often as it is done, but no repeat
    in full that would count more than MOST_PIECES.
    """

    items: list[Item]
    states: int
    total_ms: int


class Expander:
    """Unrolls the steps of one car's program; ``diagnostics`` gathers what is wrong with them."""

    def __init__(self, profile: Profile, leads: bool):
        self.diagnostics: list[Diagnostic] = []
        self._levels_ms = profile.durations_ms
        self._idle_ms = profile.idle_state_ms
        self._leads = leads

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
        self._check_settings(step, path)
        accept_ir = accept_ir if step.accept_ir is None else step.accept_ir
        forward = forward if step.forward is None else step.forward
        if isinstance(step, RepeatStep):
            once = self.expand(step.steps, f"{path}.repeat.steps", accept_ir, forward)
            states = once.states * step.times
            times = step.times if states <= MOST_PIECES else 1
            return Row(once.items * times, states, once.total_ms * step.times)
        if not self._check_step(step, path):
            return Row([], 0, 0)
        parts = parts_of(step)
        durations_ms = parts.durations_ms
        total_ms = max(durations_ms, default=0) or self._idle_ms
        item = Item(parts, durations_ms, total_ms, path, step.id, accept_ir, forward)
        return Row([item], self._states_of(item) if self._leads else 1, total_ms)

    def _states_of(self, item: Item) -> int:
        if item.total_ms > MOST_PIECES * self._levels_ms[-1]:
            return pieces_needed(item.total_ms, self._levels_ms)
        return max(1, len(cut_for_leader(item, self._levels_ms) or ()))

    def _check_settings(self, step: Step, path: str) -> None:
        if not self._leads:
            return
        if step.accept_ir:
            self.diagnostics.append(error("leader-accepts-ir", path, step.id))
        if step.forward is not None:
            allowed = f"{step.kind}, id, accept_ir"
            self.diagnostics.append(error("unknown-field", f"{path}.forward", step.id, name="forward", allowed=allowed))

    def _check_step(self, step: Step, path: str) -> bool:
        before = len(self.diagnostics)
        if isinstance(step, TogetherStep):
            self._check_conflict(step, path)
            for position, part in enumerate(step.steps):
                self._check_duration(part, path, step.id, position)
        elif isinstance(step, (VoiceStep, PirStep)) and step.seconds is None:
            self.diagnostics.append(error("missing-field", f"{path}.{step.kind}", step.id, name="seconds"))
        else:
            self._check_duration(step, path, step.id)
        return len(self.diagnostics) == before

    def _check_conflict(self, step: TogetherStep, path: str) -> None:
        seen: dict[str, str] = {}
        for position, part in enumerate(step.steps):
            # Waiting is standing still with the motor's own bits.
            block = "drive" if isinstance(part, WaitStep) else part.kind
            if block in seen:
                kinds = ", ".join(dict.fromkeys((seen[block], part.kind)))
                place = f"{path}.together[{position}]"
                self.diagnostics.append(error("parallel-conflict", place, part.id or step.id, kinds=kinds))
            seen[block] = part.kind

    def _check_duration(self, step: Step, path: str, step_id: str | None, position: int | None = None) -> None:
        """Check how long ``step`` lasts; with ``position`` it is that part of the together at ``path``."""
        seconds = getattr(step, "seconds", None)
        if seconds is None:
            return
        duration_ms = to_ms(seconds)
        if duration_ms is None or not is_sum(duration_ms, self._levels_ms):
            place = path if position is None else f"{path}.together[{position}]"
            self.diagnostics.append(self.not_expressible(seconds, place, step.id or step_id))

    def not_expressible(self, seconds: float, path: str, step_id: str | None) -> Diagnostic:
        """The Diagnostic for a duration that no levels add up to, with the nearest that some do."""
        nearest = _either(*nearest_sums(seconds, self._levels_ms))
        return error("duration-not-expressible", path, step_id, seconds=f"{seconds:g}", nearest=nearest)

    def not_expressible_together(self, item: Item) -> Diagnostic:
        """The same for blocks each of which could be expressed alone: the nearest lengths of their longest."""

        def fits(seconds: float) -> bool:
            total_ms = round(seconds * 1000)
            durations_ms = tuple(
                total_ms if duration == item.total_ms else min(duration, total_ms) for duration in item.durations_ms
            )
            return cut(durations_ms, self._levels_ms[1:], self._levels_ms) is not None

        seconds = item.total_ms / 1000
        below, above = nearest_sums(seconds, self._levels_ms)
        while not fits(below):
            below, _ = nearest_sums(below, self._levels_ms)
        for _ in range(_MOST_TRIES):
            if fits(above):
                break
            _, above = nearest_sums(above, self._levels_ms)
        nearest = _either(below, above) if fits(above) else phrase("single", first=f"{below:g}")
        return error("duration-not-expressible", item.path, item.id, seconds=f"{seconds:g}", nearest=nearest)


def cut_for_leader(item: Item, levels_ms: tuple[int, ...]) -> tuple[int, ...] | None:
    """The lengths of the states that a leader's step becomes; None where the levels can't express it."""
    return cut(item.durations_ms, levels_ms[1:], levels_ms)


def _either(below: float, above: float) -> Phrase:
    return phrase("or", first=f"{below:g}", second=f"{above:g}")
