"""Recordings as Parquet: FILE.parquet holds the moments, FILE.events.parquet the events, FILE.counts.parquet the sums.

A Parquet file can't be read before its end is written. So a run is streamed as
Arrow batches into FILE.parquet.part and its like, of which a killed process
leaves all but the last moments; closing turns them into Parquet, whole or not at all.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from motorcade.engine.events import EVENT, KINDS, LOSS_REASONS
from motorcade.engine.moment import Moment
from motorcade.runs.description import Description
from motorcade.runs.recording import RecordingError

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
_PART = ".part"
_MOST_FRAMES = 50
_BATCH_ROWS = 1 << 14
_GROUP_ROWS = 1 << 18


def beside(path: Path, what: str) -> Path:
    """FILE.events.parquet beside FILE.parquet, and the like."""
    return path.with_name(f"{path.stem}.{what}.parquet")


class ParquetSink:
    """Streams a run into Parquet files. Raises OSError where they can't be written."""

    def __init__(self, path: Path, about: Description):
        self._path = path
        self._texts = {_PREFIX + key: text for key, text in about.as_texts().items()}
        self._number = np.arange(about.cars, dtype=np.uint32)
        self._frames: list[Moment] = []
        self._batches: list[NDArray[np.void]] = []
        self._track = _Part(path, _TRACK.with_metadata(self._texts))
        self._events = _Part(beside(path, "events"), _EVENTS.with_metadata(self._texts))
        # Its columns are known with the first moment.
        self._counts: _Part | None = None

    def write(self, frame: Moment) -> None:
        self._frames.append(frame)
        if len(self._frames) >= _MOST_FRAMES or len(self._frames) * len(self._number) >= _BATCH_ROWS:
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
        frames, self._frames = self._frames, []
        if not frames:
            return
        times = np.array([frame.t_ms for frame in frames], np.uint32)
        columns: list[Any] = [times.repeat(len(self._number)), np.tile(self._number, len(frames))]
        columns += [np.concatenate(column) for column in list(zip(*frames, strict=True))[1:9]]
        self._track.write(columns)
        if self._counts is None:
            sums = [("t_ms", pa.uint32()), *((name, pa.int64()) for name in frames[0].counts)]
            self._counts = _Part(beside(self._path, "counts"), pa.schema(sums, metadata=self._texts))
        self._counts.write([times, *([frame.counts[name] for frame in frames] for name in frames[0].counts)])

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
    """One table on its way into a Parquet file."""

    def __init__(self, path: Path, schema: Any):
        self._path = path
        self._schema = schema
        self._part = path.with_name(path.name + _PART)
        self._file = self._part.open("wb")
        self._stream = pa.ipc.new_stream(self._file, schema, options=pa.ipc.IpcWriteOptions(compression="zstd"))

    def write(self, columns: list[Any]) -> None:
        arrays = [pa.array(column, type=field.type) for column, field in zip(columns, self._schema, strict=True)]
        self._stream.write_batch(pa.record_batch(arrays, schema=self._schema))
        self._file.flush()

    def finish(self) -> None:
        """Turn what was streamed into the Parquet file."""
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
        """Leave no trace of it."""
        self._file.close()
        self._part.unlink()


def _write_group(parquet: Any, batches: list[Any]) -> None:
    if batches:
        table = pa.Table.from_batches(batches)
        parquet.write_table(table, row_group_size=max(1, table.num_rows))
    batches.clear()


class ParquetRecording:
    """A recording in Parquet files, or in what a killed process left of them. Raises RecordingError."""

    def __init__(self, path: Path):
        self.name = str(path)
        self.complaint = ""
        self._is_damaged = False
        if path.suffix == _PART:
            path = path.with_suffix("")
            self._is_part = True
        else:
            self._is_part = not path.exists() and path.with_name(path.name + _PART).exists()
        self._path = path
        texts = {key.decode(): text.decode() for key, text in (self._schema(path).metadata or {}).items()}
        try:
            texts = {key.removeprefix(_PREFIX): text for key, text in texts.items() if key.startswith(_PREFIX)}
            self.about = Description.from_texts(texts)
        except (KeyError, TypeError, ValueError):
            raise RecordingError(f"{self.name} is a Parquet file, but holds no run of Motorcade") from None
        if self._schema(path).names != _TRACK.names:
            raise RecordingError(f"{self.name} holds only a part of a run: name the .parquet file without it")

    @property
    def last_ms(self) -> int:
        return max(self._counts(), default=0)

    def frames(self) -> Iterator[Moment]:
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
            reason = "was never finished" if self._is_part else "is damaged"
            self.complaint = f"{self.name} {reason}: what came after {t_ms / 1000:g} s is missing"

    def events(self) -> Iterator[NDArray[np.void]]:
        path = beside(self._path, "events")
        for table in self._tables(path) if self._there(path).exists() else ():
            events = np.zeros(table.num_rows, EVENT)
            for name in ("t_ms", "car", "word", "other"):
                events[name] = table[name].to_numpy()
            for name, known in (("kind", KINDS), ("why", LOSS_REASONS)):
                texts = table[name].combine_chunks().cast(pa.string())
                events[name] = pa.compute.index_in(texts, pa.array(known)).to_numpy()
            yield events

    def _counts(self) -> dict[int, dict[str, int]]:
        path = beside(self._path, "counts")
        rows: list[dict[str, int]] = []
        for table in self._tables(path) if self._there(path).exists() else ():
            rows += table.to_pylist()
        return {row.pop("t_ms"): row for row in rows}

    def _there(self, path: Path) -> Path:
        return path.with_name(path.name + _PART) if self._is_part else path

    def _schema(self, path: Path) -> Any:
        try:
            with self._there(path).open("rb") as file:
                return pa.ipc.open_stream(file).schema if self._is_part else pq.read_schema(file)
        except pa.ArrowInvalid:
            reason = "is no Parquet file, or its end is cut off, without which it can't be read"
            raise RecordingError(f"{self.name} {reason}: record the run again") from None
        except OSError as problem:
            reason = f"can't be read: {problem.strerror}" if problem.strerror else "is damaged: record the run again"
            raise RecordingError(f"{self.name} {reason}") from None

    def _tables(self, path: Path) -> Iterator[Any]:
        """Row groups of whole moments, one at a time."""
        with self._there(path).open("rb") as file:
            try:
                if self._is_part:
                    for batch in pa.ipc.open_stream(file):
                        yield pa.Table.from_batches([batch])
                else:
                    parquet = pq.ParquetFile(file, page_checksum_verification=True)
                    for group in range(parquet.num_row_groups):
                        yield parquet.read_row_group(group)
            except (pa.ArrowException, OSError):
                self._is_damaged = True
