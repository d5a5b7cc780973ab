"""What a sweep has done so far, in a folder beside its table, and the table made of it in the end."""

import json
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from motorcade.config.files import replace_file
from motorcade.experiments.parameters import SweepError
from motorcade.experiments.plan import Plan
from motorcade.experiments.task import table_schema

GROUP_ROWS = 1 << 16
_MANIFEST = "sweep.json"
_LOCK = "lock"
_CONTENTS = b"motorcade.sweep"


class Store:
    """The parts of the table at ``path``: a file a task, whole or not there, in the folder ``path``.parts.

    Raises SweepError where the table or the parts there are those of another sweep, OSError where they can't be read
    or written.
    """

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path = path
        self.folder = path.with_name(f"{path.name}.parts")
        self._plan = plan

    def is_finished(self) -> bool:
        """Whether the table is there, whole."""
        if not self.path.exists():
            return False
        if contents := contents_of(self.path):
            self._check(contents, self.path.name, "choose another name with -o")
            return True
        raise SweepError(f"{self.path} is there and is no sweep's table: choose another name with -o")

    @contextmanager
    def opened(self) -> Iterator[None]:
        """The folder, made where it isn't there, for this process alone."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with _locked(self.folder / _LOCK, f"another `motorcade sweep` is at work on {self.path}: wait until it ends"):
            manifest = self.folder / _MANIFEST
            if manifest.exists():
                advice = "choose another name with -o, or delete that folder to begin anew"
                self._check(json.loads(manifest.read_bytes()), self.folder.name, advice)
            else:
                replace_file(manifest, json.dumps(self._plan.contents, indent=1).encode())
            yield

    def missing(self) -> list[int]:
        """The tasks whose part isn't there."""
        there = {path.name for path in self.folder.glob("*.parquet")}
        return [index for index in range(self._plan.tasks) if self._part(index).name not in there]

    def keep(self, index: int, rows: bytes) -> None:
        """Take the rows of task ``index``."""
        replace_file(self._part(index), rows)

    def merge(self, progress: Callable[[int], None] = lambda done: None) -> None:
        """Make the table of all parts; ``progress`` is called with how many are in it."""
        schema = table_schema(self._plan.sweep.points.parameters)
        schema = schema.with_metadata({_CONTENTS: json.dumps(self._plan.contents).encode()})
        unfinished = self.folder / "table"
        with pq.ParquetWriter(unfinished, schema, compression="zstd") as writer:
            rows = pa.Table.from_batches([], schema)
            for index in range(self._plan.tasks):
                part = self._rows(index).replace_schema_metadata(schema.metadata)
                rows = pa.concat_tables([rows, part])
                # Groups of one size, wherever the parts end.
                while len(rows) >= GROUP_ROWS:
                    writer.write_table(rows.slice(0, GROUP_ROWS).combine_chunks())
                    rows = rows.slice(GROUP_ROWS)
                progress(index + 1)
            writer.write_table(rows.combine_chunks())
        unfinished.replace(self.path)

    def forget(self) -> None:
        """Remove the parts."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _rows(self, index: int) -> pa.Table:
        try:
            return pq.read_table(self._part(index))
        except pa.ArrowInvalid:
            raise SweepError(
                f"{self._part(index)} is damaged: delete it, and the same command runs that part once more"
            ) from None

    def _part(self, index: int) -> Path:
        return self.folder / f"{self._plan.task_name(index)}.parquet"

    def _check(self, contents: dict[str, str], name: str, advice: str) -> None:
        ours = self._plan.contents
        if changed := [key for key in {**contents, **ours} if contents.get(key) != ours.get(key)]:
            verb = "are" if changed[0] in ("seeds", "parameters", "seconds") else "is"
            raise SweepError(f"{name} holds another sweep ({changed[0]} {verb} no longer the same): {advice}")


def contents_of(path: Path) -> dict[str, str] | None:
    """What a sweep's table was made from; None where the file is no such table. Raises OSError."""
    try:
        metadata = pq.read_schema(path).metadata or {}
        contents: dict[str, str] | None = json.loads(metadata.get(_CONTENTS, b"null"))
    except (pa.ArrowInvalid, ValueError):
        return None
    return contents


@contextmanager
def _locked(path: Path, refusal: str) -> Iterator[None]:
    """The file at ``path`` for this process alone; the system lets go of it however the process ends."""
    with path.open("a+b") as file:
        try:
            if sys.platform == "win32":
                import msvcrt

                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise SweepError(refusal) from None
        yield
