"""How much time of processors this process and its children used: however busy the machine is, it is the same."""

import os
from collections.abc import Iterator
from pathlib import Path

_PROC = Path("/proc")
# Fields of /proc/PID/stat behind the name: user and system time, and those of children that were waited for.
_TIMES = slice(11, 15)


def cpu_s() -> float:
    """Return the seconds that this process and its descendants used so far.

    Children that run count on Linux alone; elsewhere a child counts when it was waited for.
    """
    used_s = sum(os.times()[:4])
    if not (_PROC / "self" / "task").is_dir():
        return used_s
    ticks = sum(_ticks(pid) for pid in _descendants(os.getpid()))
    return used_s + ticks / os.sysconf("SC_CLK_TCK")


def _descendants(pid: int) -> Iterator[int]:
    try:
        threads = list((_PROC / str(pid) / "task").iterdir())
    except OSError:  # the process has ended
        return
    for thread in threads:
        for child in _read(thread / "children").split():
            yield int(child)
            yield from _descendants(int(child))


def _ticks(pid: int) -> int:
    # The name in parentheses may hold spaces.
    fields = _read(_PROC / str(pid) / "stat").rpartition(")")[2].split()
    return sum(map(int, fields[_TIMES]))


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:  # the process has ended
        return ""
