"""Run one task of a sweep: simulate its worlds, measure them, and make rows of the table."""

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from motorcade.car import brain, frames, next_wakeup
from motorcade.config.profile import Profile, levels_of
from motorcade.engine.simulation import COUNTED
from motorcade.errors import MotorcadeError, Phrase
from motorcade.lab.plan import Batch, Task, code_hash, describe
from motorcade.lab.spec import kind_of
from motorcade.words.image import holds_a_tell, parse_image_bytes
from motorcade.words.infrared import word_of
from motorcade.words.packing import bytes_to_words

if TYPE_CHECKING:
    from motorcade.engine.world import World

Numbers = NDArray[np.float64]
_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64()}


# The measures of a run: counts of the whole run, and figures of which most are of its last moment.
COUNTS = tuple(COUNTED)
FIGURES = ("lost_share", "informed_share", "leader_distance_m", "spread_m", "alignment", "moved_m")
_LOST = (*(name for name in COUNTS if name.startswith("lost_")), "deaf")


# The column of the digests of all cars at a run's checkpoints, where they are wanted.
DIGESTS = "digests"


def table_schema(parameters: Sequence[str], with_digests: bool = False) -> pa.Schema:
    """The table's columns: the run, its program, mat and seed, its parameters, its measures, maybe DIGESTS."""
    columns = [
        ("run", pa.int64()),
        ("program", pa.string()),
        ("mat", pa.string()),
        ("seed", pa.int64()),
        *((name, _TYPES[kind_of(name)]) for name in parameters),
        *((name, pa.int64()) for name in COUNTS),
        *((name, pa.float64()) for name in FIGURES),
    ]
    if with_digests:
        columns.append((DIGESTS, pa.binary()))
    return pa.schema(columns)


def run_task(task: Task) -> bytes:
    """Run a task and make its rows, as a Parquet file.

    Raises:
        MotorcadeError: this computer has another Motorcade than the one that made the task, or a run fails.
    """
    if task.code != code_hash():
        raise MotorcadeError("worker-has-other-code")
    schema = table_schema(task.parameters, task.checkpoints > 0)
    tables = []
    first_run = task.first_run
    for batch in task.batches:
        columns = {"run": range(first_run, first_run + len(batch.seeds)), **_rows(batch, task)}
        # What is undefined, and thus NaN, becomes null.
        arrays = [pa.array(columns[column.name], column.type, from_pandas=True) for column in schema]
        tables.append(pa.Table.from_arrays(arrays, schema=schema))
        first_run += len(batch.seeds)
    sink = pa.BufferOutputStream()
    pq.write_table(pa.concat_tables(tables).combine_chunks(), sink, write_page_checksum=True)
    return bytes(sink.getvalue())


def _rows(batch: Batch, task: Task) -> dict[str, Any]:
    from motorcade.engine.world import World

    count = len(batch.seeds)
    try:
        world = World(batch.mat, [batch.image], batch.profile, seeds=list(batch.seeds), threads=1)
        digests = _run(world, task)
        measured = _measures(world, batch.image, task.duration_ms)
    except (MotorcadeError, ValueError, ArithmeticError, MemoryError) as problem:
        reason: object = problem
        if not str(problem):
            reason = Phrase("too-little-memory")
        point = describe(batch.program, batch.mat_name, batch.values)
        raise MotorcadeError("sweep-point-fails", point=point, reason=reason) from None
    given = {name: [value] * count for name, value in batch.values.items()}
    return {
        "program": [batch.program] * count,
        "mat": [batch.mat_name] * count,
        "seed": batch.seeds,
        **given,
        **measured,
        **digests,
    }


def _run(world: "World", task: Task) -> dict[str, list[bytes]]:
    """Run every world to its end; return the column DIGESTS where it is wanted."""
    if not task.checkpoints:
        world.run(task.duration_ms)
        return {}
    found = []
    for tick in checkpoint_ticks(task.duration_ms // world.tick_ms, task.checkpoints):
        world.run((tick - world.tick) * world.tick_ms)
        found.append(car_digests(world).astype("<u8"))
    return {DIGESTS: [digests.tobytes() for digests in np.stack(found, axis=1)]}


def checkpoint_ticks(ticks: int, checkpoints: int) -> list[int]:
    """Return after which ticks of a run of ``ticks`` its checkpoints are; the last one is its end."""
    count = min(checkpoints, ticks)
    return [ticks * number // count for number in range(1, count + 1)]


def car_digests(world: "World") -> NDArray[np.uint64]:
    """Return a digest of each car, (worlds, cars), in the order of numbers: of its brain, place, heading and wheels."""
    cars = world.state
    digests = np.full(world.worlds * world.cars, 0xCBF29CE484222325, np.uint64)
    # FNV-1a, over numbers in place of bytes.
    for row in (*np.asarray(cars.memory)[: brain.SIZE], cars.x, cars.y, cars.heading, cars.wheels):
        digests = (digests ^ np.asarray(row).astype(np.uint32)) * np.uint64(0x100000001B3)
        digests ^= digests >> np.uint64(29)
    in_order = np.empty((world.worlds, world.cars), np.uint64)
    numbers = np.asarray(cars.number).reshape(world.worlds, world.cars)
    np.put_along_axis(in_order, numbers.astype(np.int64), digests.reshape(in_order.shape), axis=1)
    return in_order


def _measures(world: "World", image: bytes, duration_ms: int) -> dict[str, NDArray[Any]]:
    """Return each measure's values, one for each world, NaN where undefined."""
    counts = world.counts()
    lost = np.sum([counts[name] for name in _LOST], axis=0)
    with np.errstate(invalid="ignore"):
        lost_share = lost / (lost + counts["heard"])
    ends = _ends(world, last_word(image, world.profile, duration_ms, world.tick_ms))
    return {name: counts[name] for name in COUNTS} | {"lost_share": lost_share} | ends


def _ends(world: "World", word: int | None) -> dict[str, Numbers]:
    """The measures of the last moment; an informed follower holds ``word``."""
    starts = world.mat.starts
    ends = [world.snapshot(index) for index in range(world.worlds)]
    x_m, y_m, heading, words = (
        np.stack([getattr(end, name) for end in ends]) for name in ("x_m", "y_m", "heading", "word")
    )
    leads = np.asarray(starts.leads)
    follows = ~leads
    undefined = np.full(world.worlds, np.nan)
    distance_m = _to_nearest(x_m[:, follows], y_m[:, follows], x_m[:, leads], y_m[:, leads])
    informed = words[:, follows] == word
    spread_m = np.sqrt(np.var(x_m, axis=1) + np.var(y_m, axis=1))
    alignment = np.hypot(np.mean(np.cos(heading), axis=1), np.mean(np.sin(heading), axis=1))
    moved_m = np.mean(np.hypot(x_m - np.asarray(starts.x_m), y_m - np.asarray(starts.y_m)), axis=1)
    informed_share = leader_distance_m = undefined
    if follows.any() and word is not None:
        informed_share = informed.mean(axis=1)
    if follows.any() and leads.any():
        leader_distance_m = distance_m.mean(axis=1)
    return {
        "informed_share": informed_share,
        "leader_distance_m": leader_distance_m,
        "spread_m": spread_m,
        "alignment": alignment,
        "moved_m": moved_m,
    }


def _to_nearest(x_m: Numbers, y_m: Numbers, leaders_x_m: Numbers, leaders_y_m: Numbers) -> Numbers:
    """The distance of each point from the nearest leader of its world; all arrays have a row for each world."""
    nearest_m = np.full(x_m.shape, np.inf)
    for leader_x_m, leader_y_m in zip(leaders_x_m.T, leaders_y_m.T, strict=True):
        np.minimum(nearest_m, np.hypot(x_m - leader_x_m[:, None], y_m - leader_y_m[:, None]), out=nearest_m)
    return nearest_m


@lru_cache(maxsize=1024)
def last_word(image: bytes, profile: Profile, duration_ms: int, tick_ms: int) -> int | None:
    """The follower word in the last frame that a leader with ``image`` has completed by ``duration_ms``.

    None where it has completed none, and where it depends on what the leader senses. The brain itself computes the
    frames.
    """
    if holds_a_tell(parse_image_bytes(image)):
        return None
    words = bytes_to_words(image)
    levels = levels_of(profile)
    memory = [0] * brain.SIZE
    brain.switch_on(memory, 0, 0)
    frames.leader_begin(memory, words, 0)
    now_ms = 0
    last = None
    while now_ms < duration_ms:
        frame = frames.leader_frame(memory, words, 0, now_ms, levels)
        if frame != frames.NO_FRAME:
            if now_ms + frames.frame_ms(frame, levels) > duration_ms:
                break
            last = word_of(frame)
        due_ms = now_ms + max(next_wakeup.frames_rest_ms(memory, words, 0, now_ms, levels), 1)
        now_ms = -(-due_ms // tick_ms) * tick_ms
    return last
