"""The archive of a search: a file that grows by a line for each batch of programs, and a map of the best of them."""

import json
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean
from typing import Any, BinaryIO

from matplotlib.figure import Figure
from ribs.archives import GridArchive

from motorcade.config.files import locked
from motorcade.errors import MotorcadeError, Phrase
from motorcade.missions.grading import Graded
from motorcade.program.model import Program
from motorcade.runs.drawing import picture_text

FORMAT = "motorcade-search/1"
# The map: coverage from left to right, words a minute upwards; more words count as the most.
_CELLS, _MOST_WORDS = (10, 10), 240.0
# What a block less is worth: less than any difference of grades that matters.
_BLOCK = 1e-4


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
    """The best program of each kind of behaviour: a grid of coverage and words a minute (MAP-Elites, with ribs)."""

    def __init__(self, seed: int) -> None:
        ranges = [(0.0, 1.0), (0.0, _MOST_WORDS)]
        self._grid = GridArchive(solution_dim=(), dims=_CELLS, ranges=ranges, solution_dtype=object, seed=seed)

    def add(self, candidate: Candidate) -> None:
        """Keep a candidate that has had all its runs if it is the best of its cell."""
        measures = [candidate.mean.coverage, min(candidate.mean.words, _MOST_WORDS)]
        self._grid.add_single(candidate, candidate.quality, measures)  # type: ignore[arg-type]

    def __len__(self) -> int:
        return len(self._grid)

    def sample(self) -> Candidate:
        """Draw one, each cell alike."""
        chosen: Candidate = self._grid.sample_elites(1)["solution"][0]
        return chosen

    def ranked(self) -> list[Candidate]:
        """All of them, the best first."""
        return sorted((each["solution"] for each in self._grid), key=lambda each: -each.quality)

    def draw(self, picture: Path, title: str) -> None:
        """Draw the map into a PNG, SVG or PDF file: colours are grades, numbers are blocks. Raises OSError."""
        figure = Figure(figsize=(8, 5.5), layout="constrained")
        axes = figure.add_subplot()
        edges_x, edges_y = self._grid.boundaries
        grades = [[float("nan")] * _CELLS[0] for _ in range(_CELLS[1])]
        for each in self._grid:
            column, row = self._grid.int_to_grid_index([each["index"]])[0]
            grade = each["solution"].mean.grade
            grades[row][column] = grade
            middle = (edges_x[column] + edges_x[column + 1]) / 2, (edges_y[row] + edges_y[row + 1]) / 2
            colour = "black" if grade > 0.6 else "white"
            axes.text(*middle, str(each["solution"].blocks), ha="center", va="center", color=colour)
        mesh = axes.pcolormesh(edges_x, edges_y, grades, cmap="viridis", vmin=0, vmax=1)
        figure.colorbar(mesh, ax=axes, label=picture_text("picture-grade"))
        axes.set_xlabel(picture_text("picture-coverage"))
        axes.set_ylabel(picture_text("picture-words"))
        axes.set_title(title)
        figure.savefig(picture)


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
        data = path.read_bytes() if path.exists() else b""
        whole = data[: data.rfind(b"\n") + 1]
        lines = [self._decoded(line, number) for number, line in enumerate(whole.splitlines(), start=1)]
        wanted = {"format": FORMAT, **contents}
        known = lines[0] if lines and isinstance(lines[0], dict) else {}
        changed = next((key for key in wanted if known.get(key) != wanted[key]), None)
        if lines and changed:
            raise MotorcadeError("archive-of-another-search", file=path, changed=Phrase(f"search-{changed}"))
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
                return json.loads(text)
        except ValueError:
            pass
        raise MotorcadeError("search-archive-damaged", file=self.path, line=number)


@contextmanager
def opened_archive(folder: Path, contents: Mapping[str, str]) -> Iterator[ArchiveFile]:
    """Open the archive of a search in ``folder``, which is created and locked. Raises MotorcadeError and OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder / "lock", MotorcadeError("search-is-running", folder=folder)):
        file = ArchiveFile(folder / "archive.jsonl", contents)
        with file.stream:
            yield file
