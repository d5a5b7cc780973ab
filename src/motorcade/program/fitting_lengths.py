"""Other lengths of a step with which a program that can't be sent or done could be."""

import re
from collections.abc import Sequence

from motorcade.config.profile import Profile
from motorcade.errors import Phrase
from motorcade.program.diagnostics import Diagnostic, Fix, error
from motorcade.program.expansion import Item, cut_for_leader, either, round_with
from motorcade.program.parts import cut, is_sum, nearest_sums, with_durations
from motorcade.program.steps import LONGEST_S, Step, TogetherStep

# A together of three blocks may have no length above its own that fits, so the search stops after so many tries.
_MOST_TRIES = 100


def not_expressible_together(item: Item, steps: Sequence[Step], levels_ms: tuple[int, ...]) -> Diagnostic:
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
    block = longest_block(steps, item)
    path, step_id = block or (item.path, item.id)
    problem = error("duration-not-expressible", path, step_id, seconds=f"{seconds:g}", nearest=nearest)
    lengths = [each for each in (below, above) if block and 0 < each <= LONGEST_S]
    alone = (each for each in lengths if cut_for_leader(lasting(item, round(each * 1000)), levels_ms))
    return problem.with_fixes(*(Fix("seconds", each) for each in alone))


def longest_block(steps: Sequence[Step], item: Item) -> tuple[str, str | None] | None:
    """The path and id of the one block of ``item`` that lasts longest; None where there is no such block."""
    first, *inner = map(int, re.findall(r"\[(\d+)\]", item.path))
    step = steps[first]
    for position in inner:
        step = step.steps[position]  # type: ignore[attr-defined]
    if not isinstance(step, TogetherStep):
        return None if getattr(step, "seconds", None) is None else (item.path, item.id)
    times_s = [getattr(part, "seconds", None) or 0 for part in step.steps]
    longest_s = max(times_s, default=0)
    if not longest_s or times_s.count(longest_s) > 1:
        return None
    position = times_s.index(longest_s)
    return f"{item.path}.together[{position}]", step.steps[position].id or item.id


def lasting(item: Item, length_ms: int) -> Item:
    """Return ``item`` with another duration in the place of its longest."""
    longest_ms = max(item.durations_ms, default=0)
    durations_ms = tuple(length_ms if each == longest_ms else each for each in item.durations_ms)
    parts = with_durations(item.parts, durations_ms)
    return item._replace(parts=parts, durations_ms=durations_ms, total_ms=max(durations_ms, default=length_ms))


def lengths_that_fit(items: list[Item], profile: Profile, tagged: bool) -> dict[str, list[int]]:
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
            if is_length and round_with([lasting(item, length_ms)], dwell_ms, profile, tagged):
                found.setdefault(item.path, []).append(length_ms)
        if item.path in found:
            shorter = [each for each in found[item.path] if each < longest_ms]
            longer = [each for each in found[item.path] if each > longest_ms]
            found[item.path] = sorted(shorter)[-1:] + sorted(longer)[:1]
    return {path: lengths for path, lengths in found.items() if lengths}
