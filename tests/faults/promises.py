"""The table of README.md: how often each promise was tried in the simulated room, and each fault made.

Its words stand there; ``python -m tests.faults --promises`` prints it with the figures of now.
"""

import re
from collections.abc import Mapping
from pathlib import Path

README = Path(__file__).with_name("README.md")
BEGIN, END = "<!-- python -m tests.faults --promises -->", "<!-- end -->"

# By which scenarios each row of the table is tried, with the scenario before a colon.
PROMISES = (
    ("uploads:image-whole", "class:class-whole", "uploads:no-rubbish"),
    ("uploads:acknowledged-stays", "uploads:verified", "shelf:verified", "shelf:shows-what-is"),
    (
        *("uploads:says-what-it-holds", "uploads:upload-ends", "uploads:goes-on", "shelf:says-what-it-holds"),
        *("shelf:upload-ends", "shelf:goes-on", "shelf:says-why"),
    ),
    (
        *("driving:stands-in-time", "driving:gone-stops", "keys:stands-in-time", "lesson:stands-in-time"),
        *("lesson:gone-stops", "track:stands-in-time", "track:gone-stops"),
    ),
    ("driving:guarded", "track:guarded"),
    ("driving:no-old-command", "driving:sent", "lesson:no-old-command", "track:no-old-command", "track:sent"),
    (
        *("driving:stop-gets-through", "driving:stop-holds", "keys:stop-gets-through", "lesson:stop-gets-through"),
        *("lesson:stop-holds", "track:stop-gets-through", "track:stop-holds"),
    ),
    (
        *("driving:one-driver", "driving:leaves-standing", "driving:drives-again", "lesson:drives-again"),
        *("track:one-driver", "track:drives-again", "track:goes-on"),
    ),
    ("driving:armed", "driving:held-stick", "track:armed", "track:held-stick"),
    ("driving:horn-ends", "track:horn-ends"),
    ("track:switches",),
    ("track:over-rate",),
    ("track:believed",),
    ("track:places", "track:own-session"),
    ("track:limits",),
    ("track:as-asked", "track:says-why", "track:shows-what-is"),
    ("track:logged",),
    ("track:floods",),
    (
        *("fleet:image-whole", "fleet:verified", "fleet:says-what-it-holds", "lesson:image-whole"),
        "lesson:verified",
    ),
    (
        *("fleet:stop-gets-through", "fleet:stop-holds", "fleet:away-first", "shelf:stop-gets-through"),
        "shelf:away-first",
    ),
    ("fleet:nobody-waits", "fleet:goes-on", "shelf:nobody-waits"),
    (
        *("fleet:found", "fleet:work-bounded", "fleet:near-only", "fleet:safe-text", "fleet:only-ports"),
        *("uploads:only-ports", "uploads:finds-ports", "lesson:found", "lesson:safe-text", "lesson:only-ports"),
        *("shelf:found", "shelf:work-bounded", "shelf:safe-text", "shelf:only-ports"),
    ),
    (
        *("class:answered-stays", "class:in-the-class", "class:class-goes-on", "lesson:answered-stays"),
        *("lesson:as-asked", "lesson:shows-what-is", "lesson:page-stays", "lesson:class-goes-on", "lesson:says-why"),
        *("lesson:nobody-waits", "lesson:right-guess", "uploads:says-why"),
    ),
    (
        *("class:work-of-others", "class:own-view", "class:teacher-only", "lesson:work-of-others", "lesson:own-view"),
        *("lesson:teacher-only", "lesson:own-work"),
    ),
    ("lesson:out-is-out", "lesson:ended-is-gone"),
    ("lesson:leaves",),
    ("lesson:wrong-guess",),
    ("lesson:names",),
    ("lesson:no-secrets",),
    ("lesson:other-sites", "lesson:guarded-pages"),
    ("lesson:one-holder",),
    ("keys:strangers-stay-out", "keys:drives-again", "keys:logged", "keys:goes-on"),
    ("keys:revoked-are-out", "keys:fails-closed", "uploads:fails-closed", "lesson:fails-closed"),
    ("class:stop-gets-through",),
    (
        *("class:connections-bounded", "class:memory-bounded", "driving:connections-bounded", "driving:memory-bounded"),
        *("lesson:connections-bounded", "lesson:memory-bounded", "lesson:bounded"),
        *("track:connections-bounded", "track:memory-bounded"),
    ),
    ("class:strangers-stay-out", "class:no-traceback", "lesson:strangers-stay-out", "lesson:no-traceback"),
)
# What is done in the runs, in the order of the sentence above the table.
FAULTS = (
    *("kill", "power failure", "full disk", "disk error", "cut", "half-open", "stall", "pulled cable", "freeze"),
    *("busy loop", "guard", "hardware fails", "hardware hangs", "stranger"),
)


def written_table() -> str:
    """The table as it is in README.md."""
    return README.read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0].strip()


def figures(table: str) -> list[int]:
    """The figures of a table: of the sentence above it, and of its last column."""
    lead, *rows = table.splitlines()
    told = re.findall(r"\d[\d,]*", lead) + [row.strip("| ").rpartition("|")[2] for row in rows[3:]]
    return [int(figure.replace(",", "")) for figure in told]


def figures_now(runs: int, tried: Mapping[str, int], faults: Mapping[str, int]) -> list[int]:
    """The same of so many runs; ``tried`` counts each promise by its name with its scenario."""
    return [runs, *(faults[name] for name in FAULTS), *(sum(tried[name] for name in names) for names in PROMISES)]


def table(now: list[int]) -> str:
    """The table with the figures of now, but for the runs without their third digit and those behind it."""
    lead, *rows = written_table().splitlines()
    shown = iter([f"{now[0]}", *(f"{_rounded(count):,}" for count in now[1:])])
    lead = re.sub(r"\d[\d,]*", lambda _: next(shown), lead)
    return "\n".join([lead, *rows[:3], *(re.sub(r"[\d,]+ \|$", f"{next(shown)} |", row) for row in rows[3:])])


def _rounded(count: int) -> int:
    factor = 10 ** max(0, len(str(count)) - 2)
    return count // factor * factor
