"""Write and read recordings as MCAP: JSON messages with schemas, in compressed chunks, which Foxglove opens.

What its 3D panel draws are foxglove.SceneUpdate messages. Their schema describes only the fields that are sent here;
names and meanings are Foxglove's (https://docs.foxglove.dev/docs/sdk/schemas/scene-update). Lengths are in metres.
"""

import json
import math
import os
import struct
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

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

from motorcade.config.files import opened
from motorcade.devices.declaration import Column
from motorcade.engine.events import EVENT, KINDS, LOSS_REASONS
from motorcade.engine.moment import COLUMNS, Moment
from motorcade.engine.pictures import LEDS
from motorcade.errors import InputError, MotorcadeError
from motorcade.mats.model import Corners
from motorcade.runs.recording import (
    EVENT_FIELDS,
    LEADER,
    WHICH,
    Description,
    Sink,
    WordColours,
    events_as_dicts,
    part_of,
    rgb,
)

_T = TypeVar("_T")
_CHUNK_BYTES = 1 << 18
# A moment of a million cars has about 100 MB.
MOST_CONTENT_BYTES = 1 << 28
_MOST_EVENTS = 10_000
_METADATA = "motorcade"

# With more cars than this neither their numbers nor their LEDs are drawn.
_MOST_DETAILED = 50
_HEIGHT_M = 0.06
_WALL_HEIGHT_M = 0.1
_EDGE_HEIGHT_M = 0.01
_WALL_WIDTH_M = 0.02
_PRIMITIVES = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
# What an entity says of itself, as long as it has no primitives.
_EMPTY: dict[str, Any] = {
    "frame_id": "mat",
    "lifetime": {"sec": 0, "nsec": 0},
    "frame_locked": False,
    "metadata": [],
    **{name: [] for name in _PRIMITIVES},
}


def _mat_message(about: Description) -> bytes:
    """Make the message of what doesn't move: the mat's edge, walls and obstacles."""
    mat = about.mat
    dark = _colour("#3a3a3a")
    grey = _colour("#8c8c8c")
    cubes = [_wall(*wall, dark) for wall in mat.walls]
    if mat.size_m:
        width_m, height_m = mat.size_m
        corners: Corners = ((0.0, 0.0), (width_m, 0.0), (width_m, height_m), (0.0, height_m))
        cubes += _walls_around(corners, dark, _WALL_HEIGHT_M if mat.walled else _EDGE_HEIGHT_M)
    cylinders = [_cylinder(x, y, 2 * radius, _WALL_HEIGHT_M, grey, _WALL_HEIGHT_M / 2) for x, y, radius in mat.discs]
    for corners in mat.polygons:
        cubes += _walls_around(corners, grey)
    return _message(0, mat={"cubes": cubes, "cylinders": cylinders})


def _message(t_ms: int, **entities: dict[str, list[Any]]) -> bytes:
    stamp = {"sec": t_ms // 1000, "nsec": t_ms % 1000 * 1_000_000}
    every = [{"timestamp": stamp, "id": name, **_EMPTY, **parts} for name, parts in entities.items()]
    return json.dumps({"deletions": [], "entities": every}, separators=(",", ":")).encode()


def _colour(text: str, alpha: float = 1.0) -> dict[str, float]:
    red, green, blue = rgb(text)
    return {"r": round(red, 3), "g": round(green, 3), "b": round(blue, 3), "a": alpha}


def _pose(x: float, y: float, z: float = 0.0, heading: float = 0.0) -> dict[str, Any]:
    turned = {"x": 0.0, "y": 0.0, "z": round(math.sin(heading / 2), 4), "w": round(math.cos(heading / 2), 4)}
    return {"position": {"x": round(x, 4), "y": round(y, 4), "z": z}, "orientation": turned}


def _cylinder(x: float, y: float, wide_m: float, high_m: float, colour: dict[str, float], z: float) -> dict[str, Any]:
    size = {"x": wide_m, "y": wide_m, "z": high_m}
    return {"pose": _pose(x, y, z), "size": size, "bottom_scale": 1.0, "top_scale": 1.0, "color": colour}


def _text(x: float, y: float, text: str, high_m: float) -> dict[str, Any]:
    return {
        "pose": _pose(x, y, _HEIGHT_M + 0.1),
        "billboard": True,
        "font_size": high_m,
        "scale_invariant": False,
        "color": _colour("#202020"),
        "text": text,
    }


def _wall(
    x0: float, y0: float, x1: float, y1: float, colour: dict[str, float], high_m: float = _WALL_HEIGHT_M
) -> dict[str, Any]:
    size = {"x": math.hypot(x1 - x0, y1 - y0) + _WALL_WIDTH_M, "y": _WALL_WIDTH_M, "z": high_m}
    middle = _pose((x0 + x1) / 2, (y0 + y1) / 2, high_m / 2, math.atan2(y1 - y0, x1 - x0))
    return {"pose": middle, "size": size, "color": colour}


def _walls_around(corners: Corners, colour: dict[str, float], high_m: float = _WALL_HEIGHT_M) -> list[dict[str, Any]]:
    return [_wall(*a, *b, colour, high_m) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]


def _triangles(points: list[dict[str, float]], colour: dict[str, float]) -> dict[str, Any]:
    return {"pose": _pose(0.0, 0.0), "points": points, "color": colour, "colors": [], "indices": []}


def _schema_like(example: Any) -> dict[str, Any]:
    """The JSON schema of values like ``example``."""
    if isinstance(example, dict):
        return {"type": "object", "properties": {key: _schema_like(value) for key, value in example.items()}}
    if isinstance(example, list):
        return {"type": "array", "items": _schema_like(example[0])}
    return {"type": {bool: "boolean", int: "integer", float: "number", str: "string"}[type(example)]}


def _example() -> dict[str, Any]:
    """A message with one of each thing."""
    colour = _colour(LEADER)
    corner = {"x": 0.0, "y": 0.0, "z": 0.0}
    cube = _wall(0.0, 0.0, 1.0, 0.0, colour)
    entity = {
        "timestamp": {"sec": 0, "nsec": 0},
        "id": "",
        **_EMPTY,
        "metadata": [{"key": "", "value": ""}],
        "arrows": [{}],
        "cubes": [cube],
        "spheres": [cube],
        "cylinders": [_cylinder(0.0, 0.0, 1.0, 1.0, colour, 0.0)],
        "lines": [{}],
        "triangles": [{**_triangles([corner], colour), "colors": [colour], "indices": [0]}],
        "texts": [_text(0.0, 0.0, "", 1.0)],
        "models": [{}],
    }
    deletion = {"timestamp": {"sec": 0, "nsec": 0}, "type": 0, "id": ""}
    return {"deletions": [deletion], "entities": [entity]}


_SCENE_UPDATE = {"title": "foxglove.SceneUpdate", **_schema_like(_example())}


def _schema_of(column: Column) -> dict[str, Any]:
    kind = {"float32": "number", "bool": "boolean"}.get(column.packed, "integer")
    limits = zip(("minimum", "maximum"), column.limits or (), strict=False)
    return {"type": "array", "items": {"type": kind, **dict(limits)}}


_CARS = {
    "title": "motorcade.Cars",
    "type": "object",
    "properties": {
        **{name: {"type": "integer"} for name in ("t_ms", *WHICH)},
        "number": {"type": "array", "items": {"type": "integer"}},
        **{column.recorded: _schema_of(column) for column in COLUMNS.values()},
    },
}
_EVENT = {name: {"type": "integer"} for name in EVENT_FIELDS} | {name: {"type": "string"} for name in ("kind", "why")}
_EVENTS = {
    "title": "motorcade.Events",
    "type": "object",
    "properties": {"events": {"type": "array", "items": {"type": "object", "properties": _EVENT}}},
}
_DAMAGE = (
    *(McapError, ZstdError, struct.error, ValueError, LookupError, RuntimeError, TypeError, AttributeError),
    *(ArithmeticError, MemoryError),
)


class McapSink(Sink):
    """Stream a run into a .part file, which becomes the MCAP file at the end. Raises OSError where that fails."""

    def __init__(self, path: Path, about: Description):
        self._path = path
        self._about = about
        self._colours = WordColours(about.images)
        self._has_moments = False
        # A player needs times that rise: those of a run go on from the last of the run before.
        self._run = self._begun_ms = self._last_ms = 0
        # What an ended recording, or somebody else, has left there: it may be a pipe, or a link to another file.
        part_of(path).unlink(missing_ok=True)
        self._file = part_of(path).open("xb")
        self._writer = Writer(self._file, chunk_size=_CHUNK_BYTES)
        self._writer.start(library="motorcade")
        self._writer.add_metadata(_METADATA, about.to_texts())
        # The mat has its own channel, since a player that jumps in time shows the last message of each channel.
        schemas = {"/mat": _SCENE_UPDATE, "/scene": _SCENE_UPDATE, "/cars": _CARS, "/events": _EVENTS}
        self._channels = {topic: self._channel(topic, schema) for topic, schema in schemas.items()}
        self._add("/mat", 0, _mat_message(about))

    def write(self, moment: Moment) -> None:
        self._has_moments = True
        self._set_run(moment.run)
        if "/counts" not in self._channels:
            properties = {key: {"type": "integer"} for key in ("t_ms", *WHICH, *moment.counts)}
            schema = {"title": "motorcade.Counts", "type": "object", "properties": properties}
            self._channels["/counts"] = self._channel("/counts", schema)
        columns = moment.to_dict()
        which = {name: columns[name] for name in ("t_ms", *WHICH)}
        self._add("/counts", moment.t_ms, _json(which | columns.pop("counts")))
        self._add("/cars", moment.t_ms, _json(columns))
        if not moment.world:
            self._add("/scene", moment.t_ms, self._scene(moment))

    def write_events(self, t_ms: int, events: NDArray[np.void]) -> None:
        self._set_run(int(events["run"][0]))
        for first in range(0, len(events), _MOST_EVENTS):
            batch = events_as_dicts(events[first : first + _MOST_EVENTS])
            self._add("/events", t_ms, _json({"events": batch}))

    def _set_run(self, run: int) -> None:
        if run != self._run:
            self._run = run
            self._begun_ms = self._last_ms

    def close(self) -> None:
        with self._file:
            self._writer.finish()
        if self._has_moments:
            part_of(self._path).replace(self._path)
        else:
            # Nothing was recorded: an older file of this name stays.
            part_of(self._path).unlink()

    def _scene(self, moment: Moment) -> bytes:
        """Make the message of what moves: cars and people."""
        people = [
            _cylinder(x, y, 0.3, 1.0, _colour("#5b8fd6", 0.6), 0.5) for x, y in self._about.people_at(moment.t_ms)
        ]
        cars = {"triangles": self._bodies(moment)}
        if len(moment.x_m) <= _MOST_DETAILED:
            cars |= self._details(moment)
        return _message(moment.t_ms, cars=cars, people={"cylinders": people})

    def _bodies(self, moment: Moment) -> list[Any]:
        """A flat triangle for each car that points ahead, in one list for each colour; thousands of cars are drawn."""
        radius_m = self._about.diameter_m / 2
        angles = moment.heading[:, None] + np.array([0, math.radians(140), -math.radians(140)], np.float32)
        xs = moment.x_m[:, None] + radius_m * np.cos(angles)
        ys = moment.y_m[:, None] + radius_m * np.sin(angles)
        colours = (self._colours.of(moment.word, moment.runs) * 255).astype(np.uint32)
        keys = colours[:, 0] << 16 | colours[:, 1] << 8 | colours[:, 2]
        triangles = []
        for key in np.unique(keys).tolist():
            chosen = keys == key
            corners = zip(xs[chosen].ravel().tolist(), ys[chosen].ravel().tolist(), strict=True)
            points = [{"x": round(x, 3), "y": round(y, 3), "z": _HEIGHT_M} for x, y in corners]
            triangles.append(_triangles(points, _colour(f"#{key:06x}")))
        return triangles

    def _details(self, moment: Moment) -> dict[str, list[Any]]:
        """The number of each car, and its LED where one is on."""
        places = list(zip(moment.x_m.tolist(), moment.y_m.tolist(), strict=True))
        wide_m = self._about.diameter_m
        lit = [(place, led) for place, led in zip(places, moment.led.tolist(), strict=True) if led < len(LEDS)]
        leds = [_cylinder(x, y, wide_m / 3, 0.03, _colour(LEDS[led]), _HEIGHT_M + 0.015) for (x, y), led in lit]
        return {"cylinders": leds, "texts": [_text(x, y, str(car), wide_m / 2) for car, (x, y) in enumerate(places)]}

    def _channel(self, topic: str, schema: dict[str, Any]) -> int:
        number: int = self._writer.register_schema(schema["title"], "jsonschema", _json(schema))
        return self._writer.register_channel(topic, "json", number)

    def _add(self, topic: str, t_ms: int, data: bytes) -> None:
        self._last_ms = self._begun_ms + t_ms
        t_ns = self._last_ms * 1_000_000
        self._writer.add_message(self._channels[topic], t_ns, data, t_ns)


class McapRecording:
    """A recording in an MCAP file, which is read as far as it is undamaged. Raises MotorcadeError."""

    def __init__(self, path: Path):
        self.name = str(path)
        self.damage: MotorcadeError | None = None
        self._path = path
        if not path.exists() and part_of(path).exists():
            self._path = part_of(path)
        try:
            with opened(self._path) as file:
                for record in _records(file):
                    if isinstance(record, Metadata) and record.name == _METADATA:
                        self.about = Description.from_texts(record.metadata)
                        return
                    if isinstance(record, Message):
                        break
        except InvalidMagic:
            raise InputError("not-mcap", file=path) from None
        except OSError as problem:
            raise InputError("recording-unreadable", file=path, reason=problem) from None
        except _DAMAGE:
            raise InputError("mcap-cut-off", file=path) from None
        raise InputError("mcap-without-run", file=path)

    @property
    def last_ms(self) -> int:
        try:
            with opened(self._path) as file:
                summary = SeekingReader(file, record_size_limit=_size(file)).get_summary()
                if summary and summary.statistics:
                    return summary.statistics.message_end_time // 1_000_000
        except _DAMAGE:
            pass
        return max((moment.t_ms for moment in self.moments()), default=0)

    def moments(self) -> Iterator[Moment]:
        counts: dict[str, int] = {}

        def read(topic: str, message: dict[str, Any]) -> Iterator[Moment]:
            which: dict[str, Any] = {name: int(message.pop(name)) for name in ("t_ms", *WHICH)}
            if topic == "/counts":
                counts.clear()
                counts.update(message)
                return
            columns: dict[str, Any] = {}
            for name, column in COLUMNS.items():
                columns[name] = np.array(message[column.recorded], column.packed)
                if columns[name].shape != (self.about.cars,):
                    raise ValueError(f"{name} has another number of cars")
            yield Moment(**which, **columns, counts=dict(counts))

        return self._read(read, "/counts", "/cars")

    def events(self) -> Iterator[NDArray[np.void]]:
        def read(topic: str, message: dict[str, Any]) -> Iterator[NDArray[np.void]]:
            batch = message["events"]
            events = np.zeros(len(batch), EVENT)
            for name in ("t_ms", "car", "word", "other", *WHICH):
                events[name] = [event[name] for event in batch]
            events["kind"] = [KINDS.index(event["kind"]) for event in batch]
            events["why"] = [LOSS_REASONS.index(event["why"]) for event in batch]
            yield events

        return self._read(read, "/events")

    def _read(self, read: Callable[[str, dict[str, Any]], Iterator[_T]], *topics: str) -> Iterator[_T]:
        """Yield what ``read`` makes of the messages of these topics, up to the first that it can't read."""
        chosen: dict[int, str] = {}
        last_ms = 0
        with opened(self._path) as file:
            try:
                for record in _records(file):
                    if isinstance(record, Channel) and record.topic in topics:
                        chosen[record.id] = record.topic
                    elif isinstance(record, Message) and record.channel_id in chosen:
                        last_ms = record.log_time // 1_000_000
                        yield from list(read(chosen[record.channel_id], json.loads(record.data)))
            except _DAMAGE:
                self.damage = InputError("recording-cut-off", file=self.name, seconds=last_ms / 1000)


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
