"""Write and read recordings as Parquet files: FILE.parquet, FILE.events.parquet and FILE.counts.parquet.

FILE.parquet holds the moments. A Parquet file can't be read before its end is written. So a run is streamed as Arrow
batches into FILE.parquet.part and its like. A process that is killed leaves these, with all but the last moments.
Closing converts them to Parquet files.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from motorcade.engine.events import EVENT, KINDS, LOSS_REASONS
from motorcade.engine.state import Moment
from motorcade.errors import MotorcadeError
from motorcade.runs.recording import PART, Description, part_of

_TRACK = pa.schema(
    [
        ("t_ms", pa.uint32()),
        ("car", pa.uint32()),
        ("x_m", pa.float32()),
        ("y_m", pa.float32()),
        ("heading_rad", pa.float32()),
        ("word", pa.uint32()),
        ("runs", pa.bool_()),
        ("wheels", pa.uint8()),
        ("led", pa.uint8()),
        ("sends", pa.bool_()),
    ]
)
_NAMES = pa.dictionary(pa.int8(), pa.string())
_EVENTS = pa.schema(
    [
        ("t_ms", pa.uint32()),
        ("car", pa.uint32()),
        ("kind", _NAMES),
        ("why", _NAMES),
        ("word", pa.uint32()),
        ("other", pa.uint32()),
    ]
)
_PREFIX = "motorcade."
_MOST_MOMENTS = 50
_BATCH_ROWS = 1 << 14
_GROUP_ROWS = 1 << 18


def companion(path: Path, what: str) -> Path:
    """The path of FILE.events.parquet for FILE.parquet, and the like."""
    return path.with_name(f"{path.stem}.{what}.parquet")


class ParquetSink:
    """Stream a run into Parquet files. Raises OSError where they can't be written."""

    def __init__(self, path: Path, about: Description):
        self._path = path
        self._texts = {_PREFIX + key: text for key, text in about.to_texts().items()}
        self._number = np.arange(about.cars, dtype=np.uint32)
        self._moments: list[Moment] = []
        self._batches: list[NDArray[np.void]] = []
        self._track = _Part(path, _TRACK.with_metadata(self._texts))
        self._events = _Part(companion(path, "events"), _EVENTS.with_metadata(self._texts))
        # Its columns are known with the first moment.
        self._counts: _Part | None = None

    def write(self, moment: Moment) -> None:
        self._moments.append(moment)
        if len(self._moments) >= _MOST_MOMENTS or len(self._moments) * len(self._number) >= _BATCH_ROWS:
            self._flush()

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        self._batches.append(events)
        if sum(map(len, self._batches)) >= _BATCH_ROWS:
            self._flush_events()

    def close(self) -> None:
        self._flush()
        if self._counts is None:
            # Nothing was recorded: an older file of this name stays.
            self._track.discard()
            self._events.discard()
            return
        for part in (self._track, self._events, self._counts):
            part.finish()

    def _flush(self) -> None:
        self._flush_events()
        moments, self._moments = self._moments, []
        if not moments:
            return
        times = np.array([moment.t_ms for moment in moments], np.uint32)
        columns: list[Any] = [times.repeat(len(self._number)), np.tile(self._number, len(moments))]
        columns += [np.concatenate(column) for column in list(zip(*moments, strict=True))[1:9]]
        self._track.write(columns)
        if self._counts is None:
            sums = [("t_ms", pa.uint32()), *((name, pa.int64()) for name in moments[0].counts)]
            self._counts = _Part(companion(self._path, "counts"), pa.schema(sums, metadata=self._texts))
        names = list(moments[0].counts)
        self._counts.write([times, *([moment.counts[name] for moment in moments] for name in names)])

    def _flush_events(self) -> None:
        batches, self._batches = self._batches, []
        if not batches:
            return
        events = np.concatenate(batches)
        columns: list[Any] = [np.ascontiguousarray(events[name]) for name in _EVENTS.names]
        for place, texts in ((2, KINDS), (3, LOSS_REASONS)):
            columns[place] = pa.DictionaryArray.from_arrays(columns[place].astype(np.int8), list(texts))
        self._events.write(columns)


class _Part:
    """A table that is streamed into a .part file, and converted to Parquet at its end."""

    def __init__(self, path: Path, schema: Any):
        self._path = path
        self._schema = schema
        self._part = part_of(path)
        self._file = self._part.open("wb")
        self._stream = pa.ipc.new_stream(self._file, schema, options=pa.ipc.IpcWriteOptions(compression="zstd"))

    def write(self, columns: list[Any]) -> None:
        arrays = [pa.array(column, type=field.type) for column, field in zip(columns, self._schema, strict=True)]
        self._stream.write_batch(pa.record_batch(arrays, schema=self._schema))
        self._file.flush()

    def finish(self) -> None:
        """Convert the .part file to the Parquet file."""
        self._stream.close()
        self._file.close()
        whole = self._path.with_name(self._path.name + ".new")
        floats = [field.name for field in self._schema if pa.types.is_floating(field.type)]
        names = [field.name for field in self._schema if pa.types.is_dictionary(field.type)]
        with (
            self._part.open("rb") as file,
            pq.ParquetWriter(
                whole,
                self._schema,
                compression="zstd",
                use_dictionary=[*names, "word"] if names or floats else False,
                use_byte_stream_split=floats,
                write_page_checksum=True,
            ) as parquet,
        ):
            batches: list[Any] = []
            for batch in pa.ipc.open_stream(file):
                batches.append(batch)
                if sum(each.num_rows for each in batches) >= _GROUP_ROWS:
                    _write_group(parquet, batches)
            _write_group(parquet, batches)
        whole.replace(self._path)
        self._part.unlink()

    def discard(self) -> None:
        """Remove the .part file."""
        self._file.close()
        self._part.unlink()


def _write_group(parquet: Any, batches: list[Any]) -> None:
    if batches:
        table = pa.Table.from_batches(batches)
        parquet.write_table(table, row_group_size=max(1, table.num_rows))
    batches.clear()


class ParquetRecording:
    """A recording in Parquet files, or in the .part files of a killed process. Raises MotorcadeError."""

    def __init__(self, path: Path):
        self.name = str(path)
        self.damage: MotorcadeError | None = None
        self._is_damaged = False
        if path.suffix == PART:
            path = path.with_suffix("")
            self._is_part = True
        else:
            self._is_part = not path.exists() and part_of(path).exists()
        self._path = path
        metadata = self._schema(path).metadata or {}
        try:
            texts = {key.decode(): text.decode() for key, text in metadata.items()}
            texts = {key.removeprefix(_PREFIX): text for key, text in texts.items() if key.startswith(_PREFIX)}
            self.about = Description.from_texts(texts)
        except (KeyError, TypeError, ValueError):
            raise MotorcadeError("parquet-without-run", file=self.name) from None
        if self._schema(path).names != _TRACK.names:
            raise MotorcadeError("parquet-of-part", file=self.name)

    @property
    def last_ms(self) -> int:
        return max(self._counts(), default=0)

    def moments(self) -> Iterator[Moment]:
        cars = self.about.cars
        counts = self._counts()
        t_ms = 0
        for table in self._tables(self._path):
            columns = [column.to_numpy() for column in table.columns]
            for first in range(0, table.num_rows - cars + 1, cars):
                t_ms = int(columns[0][first])
                here = (column[first : first + cars] for column in columns[2:])
                yield Moment._make((t_ms, *here, counts.get(t_ms, {})))
        if self._is_part or self._is_damaged:
            code = "recording-unfinished" if self._is_part else "recording-damaged"
            self.damage = MotorcadeError(code, file=self.name, seconds=t_ms / 1000)

    def events(self) -> Iterator[NDArray[np.void]]:
        path = companion(self._path, "events")
        for table in self._tables(path) if self._there(path).exists() else ():
            events = np.zeros(table.num_rows, EVENT)
            for name in ("t_ms", "car", "word", "other"):
                events[name] = table[name].to_numpy()
            for name, known in (("kind", KINDS), ("why", LOSS_REASONS)):
                texts = table[name].combine_chunks().cast(pa.string())
                events[name] = pa.compute.index_in(texts, pa.array(known)).to_numpy()
            yield events

    def _counts(self) -> dict[int, dict[str, int]]:
        path = companion(self._path, "counts")
        rows: list[dict[str, int]] = []
        for table in self._tables(path) if self._there(path).exists() else ():
            rows += table.to_pylist()
        return {row.pop("t_ms"): row for row in rows}

    def _there(self, path: Path) -> Path:
        return part_of(path) if self._is_part else path

    def _schema(self, path: Path) -> Any:
        try:
            with self._there(path).open("rb") as file:
                return pa.ipc.open_stream(file).schema if self._is_part else pq.read_schema(file)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError, UnicodeError):
            raise MotorcadeError("not-parquet", file=self.name) from None
        except OSError as problem:
            if problem.strerror:
                raise MotorcadeError("recording-unreadable", file=self.name, reason=problem.strerror) from None
            raise MotorcadeError("parquet-damaged", file=self.name) from None

    def _tables(self, path: Path) -> Iterator[Any]:
        """Read the row groups, each of complete moments, one at a time."""
        with self._there(path).open("rb") as file:
            try:
                if self._is_part:
                    for batch in pa.ipc.open_stream(file):
                        yield pa.Table.from_batches([batch])
                else:
                    parquet = pq.ParquetFile(file, page_checksum_verification=True)
                    for group in range(parquet.num_row_groups):
                        yield parquet.read_row_group(group)
            except (pa.ArrowException, OSError, UnicodeError):
                self._is_damaged = True
