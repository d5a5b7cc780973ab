"""Timing on a machine that others use too: each repetition records how much processor time others used meanwhile."""

import importlib.util
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from statistics import median

import psutil
from rich.console import Console

QUIET = 0.15  # processors that others may use during a quiet repetition
FEWEST = 3  # quiet repetitions that are enough for a median
PATIENCE_S = 2.0


def has_peer(console: Console, peer: str, *modules: str) -> bool:
    """Return whether a peer's modules are installed. Where one isn't, say so: ask before anything is measured."""
    missing = [module for module in modules if importlib.util.find_spec(module) is None]
    if missing:
        # Markup would take the name of a module in brackets for a style.
        console.print(f"{peer} is not compared: {', '.join(missing)} is not installed", style="red", markup=False)
    return not missing


@dataclass
class Contestant:
    """Something that is timed repeatedly.

    Attributes:
        work: how much of it one ``run`` does, in any unit.
        run: what is timed.
        prepare: what runs before each ``run`` and is not timed.
        seconds: each repetition's time.
        others: the number of processors that other processes used meanwhile.
    """

    work: float
    run: Callable[[], object]
    prepare: Callable[[], object] = lambda: None
    seconds: list[float] = field(default_factory=list)
    others: list[float] = field(default_factory=list)

    def repeat(self) -> None:
        """Time one repetition."""
        self.prepare()
        _wait_for_quiet()
        others_s, begin_s = _others_s(), time.perf_counter()
        self.run()
        took_s = time.perf_counter() - begin_s
        self.seconds.append(took_s)
        self.others.append((_others_s() - others_s) / took_s)

    @property
    def quiet(self) -> list[float]:
        return [each for each, others in zip(self.seconds, self.others, strict=True) if others < QUIET]

    @property
    def is_quiet(self) -> bool:
        return len(self.quiet) >= FEWEST

    @property
    def counted(self) -> list[float]:
        """The times that count: those of quiet repetitions, or all where too few were quiet."""
        return self.quiet if self.is_quiet else self.seconds

    @property
    def rate(self) -> float:
        """Median of work per second."""
        return self.work / median(self.counted)

    @property
    def rates(self) -> tuple[float, float]:
        """Least and most work per second."""
        return self.work / max(self.counted), self.work / min(self.counted)

    @property
    def repetitions(self) -> str:
        return f"{len(self.quiet)} of {len(self.seconds)}" + ("" if self.is_quiet else ", [red]busy[/]")


def take_turns(contestants: Mapping[str, Contestant], wanted: int, report_progress: Callable[[str], None]) -> None:
    """Repeat each contestant until ``wanted`` repetitions were quiet, or until it had twice as many repetitions."""
    for turn in range(2 * wanted):
        for name, contestant in contestants.items():
            if len(contestant.quiet) < wanted:
                report_progress(f"turn {turn + 1}: {name}")
                contestant.repeat()


def _others_s() -> float:
    """Processor time that all other processes have used."""
    all_s, children_s = psutil.cpu_times(), os.times()
    used_s = sum(getattr(all_s, kind, 0.0) for kind in ("user", "nice", "system", "irq", "softirq", "steal"))
    return float(used_s - time.process_time() - children_s.children_user - children_s.children_system)


def _wait_for_quiet() -> None:
    begin_s = time.perf_counter()
    while time.perf_counter() - begin_s < PATIENCE_S:
        others_s = _others_s()
        time.sleep(0.2)
        if _others_s() - others_s < 0.2 * QUIET:
            return
