"""The log of who drove, stopped and cleared a car: each is in it, whatever others do, and whatever the disk does."""

import asyncio
import json
import stat
from collections import Counter, deque
from datetime import UTC, datetime, timedelta
from queue import Empty, Full
from random import Random
from types import SimpleNamespace
from typing import Any

from tests.faults.disk import Disk
from tests.faults.system import THREADS, replaced
from tests.faults.track_car import Track
from tests.faults.world import Thread, World, world

from motorcade.drive import activity_log
from motorcade.drive.activity_log import OLD_FILES, ActivityLog
from motorcade.errors import MotorcadeError

_TOGETHER_S = 10.0
_MOST_BYTES, _MANY_BYTES = 1000, 1_000_000
_BEGUN = datetime(2026, 11, 22, 23, 30, tzinfo=UTC)
_DEEDS = ("drives", "ends", "stops", "clears")


class _Queue:
    """`queue.Queue`, for simulated threads."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._items: deque[Any] = deque()
        self._waiting: list[Thread] = []

    def put_nowait(self, item: Any) -> None:
        if len(self._items) >= self._most:
            raise Full
        self._items.append(item)
        for thread in self._waiting:
            world().wake(thread)

    def get(self, timeout: float) -> Any:
        if not world().wait_for(lambda: bool(self._items), self._waiting, timeout):
            raise Empty
        return self._items.popleft()

    def empty(self) -> bool:
        return not self._items


class Logged:
    """A log on a simulated disk, and what it has to have.

    Attributes:
        wanted: the lines, without their counts: when, which car, what, and who.
        count: how many records of each kind there were.
        problems: what was reported.
    """

    def __init__(self, room: World, random: Random, most_bytes: int) -> None:
        self.world, self.random, self.most_bytes = room, random, most_bytes
        self.disk = Disk(room, random)
        self.disk.create(self.disk.path("/var"), True)
        self.file = self.disk.path("/var/log.jsonl")
        # Somebody sets the clock of the computer.
        self.set_by = timedelta(0)
        self.wanted: list[tuple[str, str, str, str]] = []
        self.count = Counter[tuple[str, str, str]]()
        self.problems: list[MotorcadeError] = []
        self._since_s: dict[tuple[str, str, str], float] = {}
        self.log = ActivityLog(self.file, self.problems.append, self._now, lambda: room.now_s)

    def _now(self) -> datetime:
        return _BEGUN + timedelta(seconds=self.world.now_s) + self.set_by

    def record(self, car: str, did: str, address: str) -> None:
        """Somebody does something, by a connection of its own."""
        kind, now_s = (car, did, address), self.world.now_s
        who = f"{address}:{self.random.randrange(1 << 16)}"
        self.count[kind] += 1
        if now_s - self._since_s.get(kind, -_TOGETHER_S) >= _TOGETHER_S:
            self._since_s[kind] = now_s
            self.wanted.append((self._now().isoformat(timespec="milliseconds"), car, did, who))
        self.log.record(did, who, car)
        self.world.keep("logged", self.world.now_s == now_s, "who stops a car waits for a disk")

    def lines(self) -> list[dict[str, Any]]:
        """What is in the log, the oldest first."""
        paths = [self.disk.path(f"{self.file}.{number}") for number in range(OLD_FILES + 1, 0, -1)]
        data = [self.disk.find(path).data for path in (*paths, self.file) if path.exists()]
        sizes = [len(each) for each in data]
        is_bounded = len(sizes) <= OLD_FILES + 1 and max(sizes) <= self.most_bytes
        self.world.keep("logged", is_bounded, f"the log has {sizes} bytes")
        return [json.loads(line) for each in data for line in each.splitlines()]


async def log(run: Track) -> None:
    """Who does something is in the log, or counted behind what was alike; floods and disks delay and hide nothing."""
    disk_of: dict[str, Disk] = {}
    day = run.random.choice((_busy_day, _busy_day, _full_disk, _slow_disk))
    most_bytes = _MANY_BYTES if day is _slow_disk else _MOST_BYTES
    names = {
        (activity_log, "threading"): THREADS,
        (activity_log, "Queue"): _Queue,
        (activity_log, "MOST_BYTES"): most_bytes,
        (activity_log, "Path"): lambda path: disk_of["log"].path(path),
        (activity_log, "FileIO"): lambda path, mode: path.disk.path(path).open(mode),
        (activity_log, "os"): SimpleNamespace(
            fstat=lambda handle: SimpleNamespace(st_mode=stat.S_IFREG, st_size=disk_of["log"].size(handle))
        ),
    }
    with replaced(names):
        logged = Logged(run.world, run.random, most_bytes)
        disk_of["log"] = logged.disk
        await day(run, logged)


async def _busy_day(run: Track, logged: Logged) -> None:
    random, begin_s = run.random, run.world.now_s
    addresses = [f"10.0.0.{number}" for number in range(2, 5)]
    floods_s = random.uniform(2.0, 20.0)
    while run.world.now_s < begin_s + 35.0:
        logged.record(random.choice(("ada", "")), random.choice(_DEEDS), random.choice(addresses))
        if floods_s < run.world.now_s - begin_s < floods_s + 3.0:
            for _ in range(40):
                logged.record("ada", "stops", "10.0.0.9")
        if random.random() < 0.05:
            logged.set_by += timedelta(seconds=random.choice((-9.0, 9.0, 3e7, -3e7)))
        await asyncio.sleep(random.choice((0.5, 1.0, 4.0)))
    # A count is written though nobody does anything more.
    await asyncio.sleep(2 * _TOGETHER_S + 1.0)
    _compare(run, logged)
    logged.record("ada", "stops", "10.0.0.9")
    logged.record("ada", "stops", "10.0.0.9")
    logged.log.close()
    _compare(run, logged)
    run.keep("logged", not logged.problems, f"{logged.problems}")


def _compare(run: Track, logged: Logged) -> None:
    """Each first one is in the log as it was, and all that followed it are counted."""
    lines, counts = logged.lines(), Counter[tuple[str, str, str]]()
    for line in lines:
        counts[line.get("car", ""), line["did"], line["who"].rpartition(":")[0]] += line.get("more", 1)
    run.keep("logged", counts == logged.count, f"{counts} in place of {logged.count}")
    firsts = [(line["at"], line.get("car", ""), line["did"], line["who"]) for line in lines if "more" not in line]
    run.keep("logged", firsts == logged.wanted, f"{firsts} in place of {logged.wanted}")


async def _full_disk(run: Track, logged: Logged) -> None:
    """A disk that is full is told of once, and the log goes on when there is room again."""
    for number in range(1, 3):
        logged.disk.fill()
        for address in range(2, 6):
            logged.record("ada", "drives", f"10.0.{number}.{address}")
            await asyncio.sleep(0.1)
        codes = [problem.code for problem in logged.problems]
        run.keep("logged", codes == ["log-not-written"] * number, f"of {number} full disks is told: {codes}")
        logged.disk.heal()
        logged.record("ada", "stops", f"10.0.{number}.9")
        await asyncio.sleep(0.1)
        last = logged.lines()[-1]
        shown = last["did"], last["who"].rpartition(":")[0]
        run.keep("logged", shown == ("stops", f"10.0.{number}.9"), f"with room again the log ends with {last}")
    logged.log.close()


async def _slow_disk(run: Track, logged: Logged) -> None:
    """What a slow disk has no time for is counted, and the end waits a second for it."""
    logged.disk.slow_s = 0.2
    total = run.random.choice((3, 1500))
    for number in range(total):
        logged.record("ada", "stops", f"10.{number // 200}.0.{number % 200}")
    await asyncio.sleep(1.5)
    if total > 3:
        logged.disk.slow_s = 0.0
        await asyncio.sleep(1.0)
    lines = logged.lines()
    lost = sum(line.get("records", 0) for line in lines)
    there = len([line for line in lines if "who" in line])
    run.keep("logged", there + lost == total, f"of {total} are {there} in the log, and {lost} are said to be lost")
    run.keep("logged", bool(lost) == (total > 3), f"of {total} are {lost} lost")
    logged.disk.slow_s = 30.0
    logged.record("ada", "clears", "10.0.0.1")
    begin_s = run.world.now_s
    logged.log.close()
    run.keep("logged", run.world.now_s - begin_s < 1.5, f"the end waits {run.world.now_s - begin_s:.1f} s for a disk")


ACTS = (log,)
