"""Search for programs that solve a mission: at random, by racing, or by MAP-Elites.

A search goes in batches. A batch is made from the outcomes of all batches but the last few, which are still at work, so
that the programs and the archive don't depend on how many workers there are, or how fast they are. The archive is a
file that grows by a line for each batch, and a map of the best programs.
"""

import hashlib
import json
import zlib
from bisect import insort
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from random import Random
from statistics import fmean
from typing import Any, BinaryIO, Literal

import msgspec
import numpy as np
from matplotlib.figure import Figure

from motorcade.config.files import locked, parse, read_bytes, replace_file
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.lab.grading import Graded, grade_runs
from motorcade.lab.plan import code_hash
from motorcade.lab.programs import ProgramSource
from motorcade.lab.run import ProgressBar, Workers, no_bar
from motorcade.missions.check import check_program
from motorcade.missions.model import Mission
from motorcade.missions.schema import GOALS
from motorcade.program.compiler import compile_program
from motorcade.program.model import Program, count_blocks
from motorcade.runs.drawing import picture_text

_MOST_BYTES = 1 << 28
FORMAT = "motorcade-search/1"
# The map: coverage from left to right, words a minute upwards; more words count as the most.
_CELLS = 10
_MOST_WORDS = 240.0
# Of the best programs.
_SAVED = 3
# A mean that is a bound of a cell may be a little less in floating point.
_ROUNDING = 1e-9
# What a block less is worth: less than any difference of grades that matters.
_BLOCK = 1e-4

Method = Literal["map-elites", "racing", "random"]
# What a search's outcome depends on, beside what a sweep's does.
GRADED_BY = ("missions", "program")
# The runs of a batch, which share a World.
_BATCH_RUNS = 32
# MAP-Elites and racing draw this share of their programs anew, and change others for the rest.
_DRAWN = {"map-elites": 0.1, "racing": 0.3}
# Racing gives more runs to the best one of so many that had equally many, and changes one of so many best ones.
_REDUCTION_FACTOR = 4
_PARENTS = 10


@dataclass(slots=True)
class Candidate:
    """A program that is tried, and the outcomes of its runs.

    Attributes:
        image: its bytes for the leader.
        blocks: how many it has.
        runs: the outcomes of the runs that it has had.
        is_chosen: whether it was given more runs than its first.
    """

    program: Program
    image: bytes
    blocks: int
    runs: list[Graded] = field(default_factory=list)
    is_chosen: bool = False

    @property
    def mean(self) -> Graded:
        """The mean of the runs."""
        return Graded(*map(fmean, zip(*self.runs, strict=True)))

    @property
    def quality(self) -> float:
        """Its grade, less a little for each block: of two programs with one grade the shorter is better."""
        return self.mean.grade - _BLOCK * self.blocks

    def to_dict(self, seeds: Sequence[int]) -> dict[str, Any]:
        """The line of the archive about its last runs, which had ``seeds``."""
        runs = [list(run) for run in self.runs[-len(seeds) :]]
        return {"program": self.program.as_dict(), "blocks": self.blocks, "seeds": list(seeds), "runs": runs}


class BestPrograms:
    """The best program of each kind of behaviour (MAP-Elites): a grid of coverage and words a minute."""

    def __init__(self, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        # By column and row.
        self._best: dict[tuple[int, int], Candidate] = {}

    def add(self, candidate: Candidate) -> None:
        """Keep a candidate that has had all its runs if it is the best of its cell."""
        shares = candidate.mean.coverage, candidate.mean.words / _MOST_WORDS
        column, row = (min(int(share * _CELLS + _ROUNDING), _CELLS - 1) for share in shares)
        known = self._best.get((column, row))
        if known is None or candidate.quality > known.quality:
            self._best[column, row] = candidate

    def __len__(self) -> int:
        return len(self._best)

    def sample(self) -> Candidate:
        """Draw one, each cell alike."""
        return list(self._best.values())[self._random.integers(len(self._best))]

    def ranked(self) -> list[Candidate]:
        """All of them, the best first."""
        return sorted(self._best.values(), key=lambda candidate: -candidate.quality)

    def draw(self, picture: Path, title: str) -> None:
        """Draw the map into a PNG, SVG or PDF file: colours are grades, numbers are blocks. Raises OSError."""
        figure = Figure(figsize=(8, 5.5), layout="constrained")
        axes = figure.add_subplot()
        edges_x, edges_y = (np.linspace(0, most, _CELLS + 1) for most in (1, _MOST_WORDS))
        grades = np.full((_CELLS, _CELLS), np.nan)
        for (column, row), candidate in self._best.items():
            grades[row, column] = grade = candidate.mean.grade
            middle = float(edges_x[column : column + 2].mean()), float(edges_y[row : row + 2].mean())
            colour = "black" if grade > 0.6 else "white"
            axes.text(*middle, str(candidate.blocks), ha="center", va="center", color=colour)
        mesh = axes.pcolormesh(edges_x, edges_y, grades, cmap="viridis", vmin=0, vmax=1)
        figure.colorbar(mesh, ax=axes, label=picture_text("picture-grade"))
        axes.set_xlabel(picture_text("picture-coverage"))
        axes.set_ylabel(picture_text("picture-words"))
        axes.set_title(title)
        drawn = BytesIO()
        figure.savefig(drawn, format=picture.suffix[1:])
        replace_file(picture, drawn.getvalue())


class ArchiveFile:
    """The file: a line for what the search is, then a line for each batch, each with its checksum.

    What a crash left of a last line is cut off.

    Args:
        path: the file; it need not be there.
        contents: what the search depends on; a file with other contents is refused.

    Attributes:
        path: the file.
        stream: what it is written with.
        batches: those that are in the file.

    Raises:
        MotorcadeError: it is damaged, or of another search.
        OSError: it can't be read or written.
    """

    def __init__(self, path: Path, contents: Mapping[str, str]) -> None:
        self.path = path
        data = b""
        if path.exists():
            data = read_bytes(path, _MOST_BYTES)
        whole = data[: data.rfind(b"\n") + 1]
        lines = [self._decoded(line, number) for number, line in enumerate(whole.splitlines(), start=1)]
        wanted = {"format": FORMAT, **contents}
        known = lines[0] if lines and isinstance(lines[0], dict) else {}
        changed = next((key for key in wanted if known.get(key) != wanted[key]), None)
        if lines and changed:
            raise InputError("archive-of-another-search", file=path, changed=Phrase(f"search-{changed}"))
        self.stream: BinaryIO = path.open("r+b" if path.exists() else "xb")
        self.stream.truncate(len(whole))
        self.stream.seek(len(whole))
        if not lines:
            self.append(wanted)
        self.batches = lines[1:]

    def append(self, line: Mapping[str, Any]) -> None:
        """Write a line; it is there even if this process is killed. Raises OSError."""
        text = json.dumps(line, ensure_ascii=False, separators=(",", ":")).encode()
        self.stream.write(b"%08x %s\n" % (zlib.crc32(text), text))
        self.stream.flush()

    def _decoded(self, line: bytes, number: int) -> Any:
        checksum, _, text = line.partition(b" ")
        try:
            if int(checksum, 16) == zlib.crc32(text):
                return parse(text, "JSON", str(self.path))
        except (ValueError, MotorcadeError):
            pass
        raise InputError("search-archive-damaged", file=self.path, line=number)


@contextmanager
def opened_archive(folder: Path, contents: Mapping[str, str]) -> Iterator[ArchiveFile]:
    """Open the archive of a search in ``folder``, which is created and locked. Raises MotorcadeError and OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder / "lock", MotorcadeError("search-is-running", folder=folder)):
        file = ArchiveFile(folder / "archive.jsonl", contents)
        with file.stream:
            yield file


# A candidate, and the seeds of the runs that a batch gives it.
Tried = tuple[Candidate, tuple[int, ...]]


@dataclass(frozen=True, slots=True)
class GradingTask:
    """Runs of one task: run k leads with ``images[programs[k]]`` and has ``seeds[k]``."""

    code: str
    mission: Mission
    images: tuple[bytes, ...]
    programs: tuple[int, ...]
    seeds: tuple[int, ...]


def do_task(task: GradingTask) -> bytes:
    """Do a task; return the outcome of each run as JSON, a list of `Graded`. Raises MotorcadeError."""
    if task.code != code_hash(GRADED_BY):
        raise MotorcadeError("worker-has-other-code")
    return json.dumps(grade_runs(task.mission, task.images, task.programs, task.seeds)).encode()


class _TriedLine(msgspec.Struct):
    program: dict[str, Any]
    runs: list[Graded]


class _BatchLine(msgspec.Struct):
    programs: list[_TriedLine]


def _outcomes(line: Any, batch: Sequence[Tried]) -> list[Graded] | None:
    """Return what a line of the archive says of a batch; None where it isn't about these programs and runs."""
    try:
        tried = msgspec.convert(line, _BatchLine).programs
    except msgspec.ValidationError:
        return None
    expected = [(candidate.program.as_dict(), len(seeds)) for candidate, seeds in batch]
    if [(candidate.program, len(candidate.runs)) for candidate in tried] != expected:
        return None
    return [run for candidate in tried for run in candidate.runs]


class Search:
    """One search; it makes the tasks of workers, and takes their results.

    Args:
        mission: whose goals grade the programs.
        method: how programs are chosen.
        runs: how many runs to do; the last batch may go beyond.
        seed: of the search's random numbers.
        ahead: how many batches may be at work at once; another number makes other programs.
        start: programs to begin with.

    Attributes:
        contents: all that the archive depends on; more runs only make it longer.
        best: the archive's map.
        done: the runs whose outcomes are known.

    Raises:
        MotorcadeError: the mission can't be graded, or the budget is 0.
    """

    def __init__(
        self,
        mission: Mission,
        method: Method,
        runs: int,
        seed: int = 0,
        ahead: int = 8,
        start: Sequence[Program] = (),
    ) -> None:
        if runs < 1:
            raise InputError("search-without-runs", runs=runs)
        # Else a run changes nothing.
        if not any(GOALS[goal.kind].decided_by == "run" for goal in mission.goals):
            raise InputError("mission-not-gradable", mission=mission.name)
        self.mission = mission
        self.method = method
        self.runs = runs
        self.best = BestPrograms(seed)
        self.done = 0
        self._seed = seed
        self._ahead = ahead
        self._start = deque(start)
        document = json.dumps([mission.document, [program.as_dict() for program in start]], sort_keys=True)
        self.contents = {
            "mission": f"{mission.id} {hashlib.sha256(document.encode()).hexdigest()[:16]}",
            "method": method,
            "seed": str(seed),
            "ahead": str(ahead),
            "code": code_hash(GRADED_BY),
        }
        self._source = ProgramSource(mission)
        self._given = self._made = self._taken = 0
        self._batches: dict[int, list[Tried]] = {}
        # Racing: all candidates after their first run, and those that have had all runs; the best first.
        self._begun: list[Candidate] = []
        self._raced: list[Candidate] = []
        # The batches that no worker has begun.
        self._waiting: deque[int] = deque()

    def run(self, archive: ArchiveFile, workers: Workers, bar: ProgressBar = no_bar) -> None:
        """Do all runs that are not in the archive, and write them there. Raises MotorcadeError and OSError."""
        for _ in range(self._ahead):
            self._make()
        for number, line in enumerate(archive.batches):
            if number not in self._batches:
                break
            runs = _outcomes(line, self._batches[number])
            if runs is None:
                raise InputError("search-archive-damaged", file=archive.path, line=number + 2)
            self._take(number, runs)
        results: dict[int, list[Graded]] = {}
        with bar("runs", self.runs) as advance, closing(workers(self, self._numbers())) as finished:
            advance(min(self.done, self.runs))
            for number, data in finished:
                results[number] = [Graded(*run) for run in json.loads(data)]
                while self._taken in results:
                    taken = self._taken
                    batch = self._batches[taken]
                    self._take(taken, results.pop(taken))
                    archive.append({"programs": [candidate.to_dict(seeds) for candidate, seeds in batch]})
                advance(min(self.done, self.runs))

    def _numbers(self) -> Iterator[int | None]:
        """The batches to do; None while the next one waits for outcomes."""
        while self._waiting or self._batches:
            if self._waiting:
                yield self._waiting.popleft()
            else:
                yield None

    def task(self, index: int) -> GradingTask:
        """The task of a batch."""
        batch = self._batches[index]
        programs = [number for number, (_, seeds) in enumerate(batch) for _ in seeds]
        seeds = [seed for _, seeds in batch for seed in seeds]
        images = tuple(candidate.image for candidate, _ in batch)
        return GradingTask(code_hash(GRADED_BY), self.mission, images, tuple(programs), tuple(seeds))

    def _make(self) -> None:
        """Make the next batch, from what is known now; none when enough runs are on their way."""
        if self._given >= self.runs:
            return
        random = Random(f"{self._seed}/{self._made}")
        batch = self._chosen() if self.method == "racing" else []
        seeds = self.mission.seeds
        if self.method == "racing":
            seeds = self.mission.seeds[:1]
        count = sum(len(given) for _, given in batch)
        while count + len(seeds) <= max(_BATCH_RUNS, len(seeds)):
            program = self._program(random)
            image = compile_program(program, self.mission.profile).image
            batch.append((Candidate(program, image, count_blocks(program)), seeds))
            count += len(seeds)
        self._batches[self._made] = batch
        self._waiting.append(self._made)
        self._made += 1
        self._given += count

    def _take(self, number: int, runs: list[Graded]) -> None:
        """Take the outcomes of a batch, in the order of batches, and make another one."""
        outcomes = iter(runs)
        for candidate, seeds in self._batches.pop(number):
            candidate.runs += [next(outcomes) for _ in seeds]
            if len(candidate.runs) == len(self.mission.seeds):
                self.best.add(candidate)
                insort(self._raced, candidate, key=lambda other: -other.quality)
            if len(candidate.runs) == len(seeds):
                insort(self._begun, candidate, key=lambda other: -other.runs[0].grade)
        if number in self._waiting:
            self._waiting.remove(number)
        self.done += len(runs)
        self._taken = number + 1
        self._make()

    def _program(self, random: Random) -> Program:
        """Make a program to try."""
        if self._start:
            return self._start.popleft()
        if self.method == "random" or random.random() < _DRAWN[self.method]:
            return self._source.draw(random)
        if self.method == "map-elites" and len(self.best):
            return self._source.change(random, self.best.sample().program)
        if self.method == "racing" and (parents := (self._raced or self._begun)[:_PARENTS]):
            return self._source.change(random, random.choice(parents).program)
        return self._source.draw(random)

    def _chosen(self) -> list[Tried]:
        """Racing by successive halving without waiting (ASHA, Li et al. 2020): who gets the rest of the seeds."""
        rest = self.mission.seeds[1:]
        if not rest:
            return []
        best = self._begun[: len(self._begun) // _REDUCTION_FACTOR]
        waiting = [candidate for candidate in best if not candidate.is_chosen]
        chosen = waiting[: _BATCH_RUNS // 2 // len(rest)]
        for candidate in chosen:
            candidate.is_chosen = True
        return [(candidate, rest) for candidate in chosen]

    def save_best(self, folder: Path) -> list[tuple[Path, Candidate]]:
        """Write the best programs as projects with the mission's mat, which the studio opens. Raises OSError."""
        saved = []
        for number, candidate in enumerate(self.best.ranked()[:_SAVED], start=1):
            path = folder / f"best-{number}.motorcade.json"
            project = candidate.program.as_dict() | {"mat": self.mission.mat_document}
            replace_file(path, (json.dumps(project, indent=1, ensure_ascii=False) + "\n").encode())
            saved.append((path, candidate))
        return saved

    def shortest(self) -> Candidate | None:
        """The shortest program in the archive that the check gives all stars; None where there is none."""
        solved = [candidate for candidate in self.best.ranked() if candidate.mean.grade == 1]
        for candidate in sorted(solved, key=lambda candidate: candidate.blocks):
            checked = check_program(self.mission, candidate.program)
            if len(checked.stars) == self.mission.stars:
                return candidate
        return None
