"""What a worker does: runs a task's worlds, and makes the rows of the table from them."""

from collections.abc import Sequence

import pyarrow as pa
import pyarrow.parquet as pq

from motorcade.experiments.measures import MEASURES, run_and_measure
from motorcade.experiments.parameters import Parameter, SweepError, Value
from motorcade.experiments.plan import Batch, Task, code_hash, described

_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64()}


class OtherCodeError(SweepError):
    """A worker whose Motorcade is another than the one that asks it."""


def table_schema(parameters: Sequence[Parameter]) -> pa.Schema:
    """The table's columns: the run, what it is, its parameters, its measures."""
    return pa.schema(
        [
            ("run", pa.int64()),
            ("program", pa.string()),
            ("mat", pa.string()),
            ("seed", pa.int64()),
            *((parameter.name, _TYPES[parameter.kind]) for parameter in parameters),
            *((measure.name, pa.int64() if measure.counts else pa.float64()) for measure in MEASURES),
        ]
    )


def run_task(task: Task) -> bytes:
    """The rows of a task's runs, as a Parquet file.

    Raises:
        OtherCodeError: this computer has another Motorcade than the one that made the task.
        SweepError: some of its runs can't be, which showed only now.
    """
    if task.code != code_hash():
        raise OtherCodeError("a worker has another Motorcade than this computer: install the same one on all of them")
    schema = table_schema(task.parameters)
    tables, first_run = [], task.first_run
    for batch in task.batches:
        columns = {"run": range(first_run, first_run + len(batch.seeds)), **_rows(batch, task.duration_ms)}
        tables.append(pa.Table.from_pydict({name: list(columns[name]) for name in schema.names}, schema))
        first_run += len(batch.seeds)
    sink = pa.BufferOutputStream()
    pq.write_table(pa.concat_tables(tables).combine_chunks(), sink)
    return bytes(sink.getvalue())


def _rows(batch: Batch, duration_ms: int) -> dict[str, Sequence[Value | str]]:
    from motorcade.engine.world import World

    count = len(batch.seeds)
    try:
        world = World(batch.mat, [batch.image], batch.profile, seeds=list(batch.seeds), threads=1)
        measured = run_and_measure(world, batch.image, duration_ms)
    except (ValueError, ArithmeticError, MemoryError) as problem:
        reason = str(problem) or "this computer has too little memory for it"
        raise SweepError(f"{described(batch.program, batch.mat_name, batch.values)}: {reason}") from None
    given = {name: [value] * count for name, value in batch.values.items()}
    return {
        "program": [batch.program] * count,
        "mat": [batch.mat_name] * count,
        "seed": batch.seeds,
        **given,
        **measured,
    }
