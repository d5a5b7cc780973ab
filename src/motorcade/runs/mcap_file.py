"""Write and read recordings as MCAP: JSON messages with schemas, in compressed chunks, which Foxglove opens."""

import json
import os
import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import zstandard
from lz4.frame import LZ4FrameDecompressor
from mcap.exceptions import InvalidMagic, McapError
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import Writer
from numpy.typing import NDArray
from zstandard import ZstdError

from motorcade.engine.events import EVENT, KINDS, LOSS_REASONS
from motorcade.engine.moment import COLUMNS, Column, Moment
from motorcade.errors import MotorcadeError
from motorcade.runs.foxglove import SCENE_UPDATE, SCENE_UPDATE_NAME, Scene, mat_message
from motorcade.runs.recording import EVENT_FIELDS, Description, events_as_dicts, part_of

_CHUNK_BYTES = 1 << 18
# A moment of a million cars has about 100 MB.
MOST_CONTENT_BYTES = 1 << 28
_MOST_EVENTS = 10_000
_METADATA = "motorcade"


def _schema_of(column: Column) -> dict[str, Any]:
    kind = {"float32": "number", "bool": "boolean"}.get(column.packed, "integer")
    limits = {} if kind == "boolean" else {"minimum": column.least, "maximum": column.most}
    items = {"type": kind, **{name: value for name, value in limits.items() if value is not None}}
    return {"type": "array", "items": items}


CARS = {
    "title": "motorcade.Cars",
    "type": "object",
    "properties": {
        "t_ms": {"type": "integer"},
        "number": {"type": "array", "items": {"type": "integer"}},
        **{each.recorded or name: _schema_of(each) for name, each in COLUMNS.items()},
    },
}
_EVENT = {name: {"type": "string" if name in ("kind", "why") else "integer"} for name in EVENT_FIELDS}
EVENTS = {
    "title": "motorcade.Events",
    "type": "object",
    "properties": {"events": {"type": "array", "items": {"type": "object", "properties": _EVENT}}},
}
COUNTS = {"title": "motorcade.Counts", "type": "object", "properties": {"t_ms": {"type": "integer"}}}
_DAMAGE = (McapError, ZstdError, struct.error, ValueError, KeyError, RuntimeError, TypeError, MemoryError)


class McapSink:
    """Stream a run into a .part file, which becomes the MCAP file at the end. Raises OSError where that fails."""

    def __init__(self, path: Path, about: Description):
        self._path = path
        self._has_moments = False
        self._file = part_of(path).open("wb")
        self._scene = Scene(about)
        self._writer = Writer(self._file, chunk_size=_CHUNK_BYTES)
        self._writer.start(library="motorcade")
        self._writer.add_metadata(_METADATA, about.to_texts())
        # The mat has its own channel, since a player that jumps in time shows the last message of each channel.
        self._channels = {
            "/mat": self._channel("/mat", SCENE_UPDATE_NAME, SCENE_UPDATE),
            "/scene": self._channel("/scene", SCENE_UPDATE_NAME, SCENE_UPDATE),
            "/cars": self._channel("/cars", "motorcade.Cars", CARS),
            "/events": self._channel("/events", "motorcade.Events", EVENTS),
        }
        self._add("/mat", 0, mat_message(about))

    def write(self, moment: Moment) -> None:
        self._has_moments = True
        if "/counts" not in self._channels:
            integer = {"type": "integer"}
            schema = {**COUNTS, "properties": {"t_ms": integer, **dict.fromkeys(moment.counts, integer)}}
            self._channels["/counts"] = self._channel("/counts", "motorcade.Counts", schema)
        columns = moment.to_dict()
        self._add("/counts", moment.t_ms, _json({"t_ms": moment.t_ms, **columns.pop("counts")}))
        self._add("/cars", moment.t_ms, _json(columns))
        self._add("/scene", moment.t_ms, self._scene.message(moment))

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        for first in range(0, len(events), _MOST_EVENTS):
            batch = events_as_dicts(events[first : first + _MOST_EVENTS])
            self._add("/events", t_ms, _json({"events": batch}))

    def close(self) -> None:
        with self._file:
            self._writer.finish()
        if self._has_moments:
            part_of(self._path).replace(self._path)
        else:
            # Nothing was recorded: an older file of this name stays.
            part_of(self._path).unlink()

    def _channel(self, topic: str, name: str, schema: dict[str, Any]) -> int:
        number: int = self._writer.register_schema(name, "jsonschema", _json(schema))
        return self._writer.register_channel(topic, "json", number)

    def _add(self, topic: str, t_ms: int, data: bytes) -> None:
        t_ns = t_ms * 1_000_000
        self._writer.add_message(self._channels[topic], t_ns, data, t_ns)


class McapRecording:
    """A recording in an MCAP file, which is read as far as it is undamaged. Raises MotorcadeError."""

    def __init__(self, path: Path):
        self.name = str(path)
        self.damage: MotorcadeError | None = None
        self._path = path if path.exists() or not part_of(path).exists() else part_of(path)
        try:
            with self._path.open("rb") as file:
                for record in _records(file):
                    if isinstance(record, Metadata) and record.name == _METADATA:
                        self.about = Description.from_texts(record.metadata)
                        return
                    if isinstance(record, Message):
                        break
        except InvalidMagic:
            raise MotorcadeError("not-mcap", file=path) from None
        except OSError as problem:
            raise MotorcadeError("recording-unreadable", file=path, reason=problem.strerror or problem) from None
        except _DAMAGE:
            raise MotorcadeError("mcap-cut-off", file=path) from None
        raise MotorcadeError("mcap-without-run", file=path)

    @property
    def last_ms(self) -> int:
        try:
            with self._path.open("rb") as file:
                summary = SeekingReader(file, record_size_limit=_size(file)).get_summary()
                if summary and summary.statistics:
                    return summary.statistics.message_end_time // 1_000_000
        except _DAMAGE:
            pass
        return max((moment.t_ms for moment in self.moments()), default=0)

    def moments(self) -> Iterator[Moment]:
        counts: dict[str, int] = {}
        for topic, message in self._messages("/counts", "/cars"):
            t_ms = message.pop("t_ms")
            if topic == "/counts":
                counts = message
                continue
            columns = {name: np.array(message[each.recorded or name], each.packed) for name, each in COLUMNS.items()}
            yield Moment(t_ms, **columns, counts=counts)

    def events(self) -> Iterator[NDArray[np.void]]:
        for _, message in self._messages("/events"):
            batch = message["events"]
            events = np.zeros(len(batch), EVENT)
            for name in ("t_ms", "car", "word", "other"):
                events[name] = [event[name] for event in batch]
            events["kind"] = [KINDS.index(event["kind"]) for event in batch]
            events["why"] = [LOSS_REASONS.index(event["why"]) for event in batch]
            yield events

    def _messages(self, *topics: str) -> Iterator[tuple[str, dict[str, Any]]]:
        chosen: dict[int, str] = {}
        last_ms = 0
        with self._path.open("rb") as file:
            try:
                for record in _records(file):
                    if isinstance(record, Channel) and record.topic in topics:
                        chosen[record.id] = record.topic
                    elif isinstance(record, Message) and record.channel_id in chosen:
                        last_ms = record.log_time // 1_000_000
                        yield chosen[record.channel_id], json.loads(record.data)
            except _DAMAGE:
                self.damage = MotorcadeError("recording-cut-off", file=self.name, seconds=last_ms / 1000)


def _records(file: BinaryIO) -> Iterator[McapRecord]:
    """All records of a file; a damaged or made-up length never makes this program read more than the file holds."""
    for record in StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=_size(file)).records:
        if isinstance(record, Chunk):
            yield from breakup_chunk(_bounded(record), validate_crc=True)
        else:
            yield record


def _size(file: BinaryIO) -> int:
    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    return size


def _bounded(chunk: Chunk) -> Chunk:
    """The chunk, with its content where that was compressed by LZ4. Raises McapError where it is too large."""
    size = chunk.uncompressed_size
    if chunk.compression == "zstd":
        size = max(size, zstandard.frame_content_size(chunk.data))
    elif chunk.compression == "lz4":
        # Such a frame may hold any length, whatever it says of itself.
        content = LZ4FrameDecompressor().decompress(chunk.data, MOST_CONTENT_BYTES + 1)
        return _bounded(replace(chunk, compression="", data=content, uncompressed_size=len(content)))
    if size > MOST_CONTENT_BYTES:
        raise McapError(f"a chunk of {size} bytes")
    return chunk


def _json(data: dict[str, Any]) -> bytes:
    return json.dumps(data, separators=(",", ":")).encode()
