"""Run a sweep's tasks, on this computer or on a Dask cluster, and make the table of them.

The rows of finished tasks are kept in a folder beside the table until all are finished, so that a stopped sweep can go
on.
"""

import json
import logging
import multiprocessing
import os
import shutil
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, closing, contextmanager
from itertools import islice
from multiprocessing import resource_tracker
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from motorcade.config.files import locked, read_bytes, replace_file
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.lab.plan import Plan
from motorcade.lab.task import run_task, table_schema

GROUP_ROWS = 1 << 16
CONNECT_S = 10
# How long to wait for a first worker, and for another one when all have left.
_WORKERS_S = 30
_TASKS_PER_SLOT = 2  # tasks sent for each that can run at once, so that no worker waits
_PARENT_CHECK_S = 0.5
_MANIFEST = "sweep.json"
_LOCK = "lock"
_CONTENTS = b"motorcade.sweep"

ProgressBar = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
"""Shows the progress of some total; the function that it yields is called with how much is done."""

Work = Callable[[Any], bytes]
"""Does one task in a worker: a function of a module, so that other processes can import it."""

Results = Generator[tuple[int, bytes], None, None]
"""Finished tasks in any order: the number of each, and its rows."""


class Tasks(Protocol):
    """What workers have to do, such as a `Plan`."""

    def task(self, index: int) -> Any:
        """Task ``index``, which can be pickled."""


Workers = Callable[[Tasks, Iterable[int | None]], Results]
"""Runs the tasks that have the given numbers. None among these: there is no other before the next result is taken."""


@contextmanager
def no_bar(verb: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show nothing."""
    yield lambda done: None


def run_sweep(plan: Plan, path: Path, workers: Workers, bar: ProgressBar = no_bar) -> int:
    """Make the table at ``path``, a Parquet file; tasks that an earlier call has finished don't run again.

    Args:
        workers: of `on_this_computer` or `on_a_cluster`.
        bar: shows the progress, such as `motorcade.cli.console.progress_bar`.

    Returns:
        The number of tasks that were run.

    Raises:
        MotorcadeError: it can't begin or go on; what is finished is kept.
        OSError: the table or its parts can't be read or written.
    """
    store = Store(path, plan)
    missing: list[int] = []
    if not store.is_finished():
        with store.opened():
            missing = store.missing()
            if missing:
                _run_missing(plan, missing, store, workers, bar)
            with bar("table", plan.tasks) as advance:
                store.merge(advance)
    store.remove_parts()
    return len(missing)


def _run_missing(plan: Plan, missing: Sequence[int], store: "Store", workers: Workers, bar: ProgressBar) -> None:
    done = plan.runs - sum(plan.task_runs(index) for index in missing)
    with bar("runs", plan.runs) as advance, closing(workers(plan, missing)) as results:
        advance(done)
        for index, rows in results:
            store.keep(index, rows)
            done += plan.task_runs(index)
            advance(done)


class Store:
    """The parts of the table at ``path``: one complete file for each finished task, in the folder ``path``.parts.

    Raises MotorcadeError where the table or the parts there belong to another sweep, OSError where they can't be read
    or written.
    """

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path = path
        self.folder = path.with_name(f"{path.name}.parts")
        self._plan = plan

    def is_finished(self) -> bool:
        """Whether the complete table is there."""
        if not self.path.exists():
            return False
        self._check(_contents_of(self.path), self.path.name, Phrase("other-table-name"))
        return True

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Create the folder if necessary, and lock it for this process."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with locked(self.folder / _LOCK, MotorcadeError("sweep-is-running", file=self.path)):
            manifest = self.folder / _MANIFEST
            if manifest.exists():
                contents = _contents(read_bytes(manifest), InputError("sweep-file-damaged", file=manifest))
                self._check(contents, self.folder.name, Phrase("other-table-or-delete"))
            else:
                replace_file(manifest, json.dumps(self._plan.contents, indent=1).encode())
            yield

    def missing(self) -> list[int]:
        """The tasks that have no part."""
        there = {path.name for path in self.folder.glob("*.parquet")}
        return [index for index in range(self._plan.tasks) if self._part(index).name not in there]

    def keep(self, index: int, rows: bytes) -> None:
        """Write the part of task ``index``."""
        replace_file(self._part(index), rows)

    def merge(self, progress: Callable[[int], None] = lambda done: None) -> None:
        """Make the table of all parts; ``progress`` is called with the number of parts that are in it."""
        schema = table_schema(self._plan.sweep.points.parameters, self._plan.checkpoints > 0)
        schema = schema.with_metadata({_CONTENTS: json.dumps(self._plan.contents).encode()})
        unfinished = self.folder / "table"
        # What a killed sweep, or somebody else, has left there: it may be a pipe, or a link to another file.
        unfinished.unlink(missing_ok=True)
        with pq.ParquetWriter(unfinished, schema, compression="zstd", write_page_checksum=True) as writer:
            rows = pa.Table.from_batches([], schema)
            for index in range(self._plan.tasks):
                part = read_rows(self._part(index))
                if part.schema != schema or len(part) != self._plan.task_runs(index):
                    raise InputError("sweep-file-damaged", file=self._part(index))
                rows = pa.concat_tables([rows, part.replace_schema_metadata(schema.metadata)])
                # The groups have one size, whatever the sizes of the parts.
                while len(rows) >= GROUP_ROWS:
                    writer.write_table(rows.slice(0, GROUP_ROWS).combine_chunks())
                    rows = rows.slice(GROUP_ROWS)
                progress(index + 1)
            writer.write_table(rows.combine_chunks())
        unfinished.replace(self.path)

    def remove_parts(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _part(self, index: int) -> Path:
        return self.folder / f"{self._plan.task_name(index)}.parquet"

    def _check(self, contents: dict[str, str], name: str, advice: Phrase) -> None:
        ours = self._plan.contents
        if changed := [key for key in {**contents, **ours} if contents.get(key) != ours.get(key)]:
            raise InputError("table-of-another-sweep", file=name, changed=changed[0], advice=advice)


def read_rows(path: Path | BinaryIO, columns: list[str] | None = None, repeating: list[str] | None = None) -> pa.Table:
    """Read a sweep's table or part, or some of its columns. Raises MotorcadeError where it is damaged, and OSError.

    ``repeating`` are columns whose equal values take memory once.
    """
    with _damaged_as(InputError("sweep-file-damaged", file=path)):
        return pq.read_table(path, columns=columns, read_dictionary=repeating, page_checksum_verification=True)


def _contents_of(path: Path) -> dict[str, str]:
    """Read what a sweep's table was made from. Raises MotorcadeError where the file is no such table, and OSError."""
    refusal = InputError("not-a-sweep-table", file=path)
    with _damaged_as(refusal):
        metadata = pq.read_schema(path).metadata or {}
    return _contents(metadata.get(_CONTENTS, b""), refusal)


@contextmanager
def _damaged_as(refusal: MotorcadeError) -> Iterator[None]:
    """Raise ``refusal`` where what the block reads is damaged."""
    try:
        yield
    except (pa.ArrowException, UnicodeError):
        raise refusal from None
    except OSError as problem:
        # What pyarrow itself raises has no number of an error of the system.
        if problem.errno is not None:
            raise
        raise refusal from None


def _contents(data: bytes, refusal: MotorcadeError) -> dict[str, str]:
    """Return `Plan.contents` from its JSON; raise ``refusal`` where ``data`` is nothing like it."""
    try:
        return msgspec.json.decode(data, type=dict[str, str])
    except (msgspec.DecodeError, RecursionError, UnicodeError):
        raise refusal from None


def on_this_computer(jobs: int, work: Work = run_task) -> Workers:
    """Make workers that are processes of this computer, at most ``jobs``; 0 is one for each core."""

    def run(plan: Tasks, tasks: Iterable[int | None]) -> Results:
        # Spawned processes start clean on every system, and each only when there is a task for it.
        context = multiprocessing.get_context("spawn")
        processes = jobs or os.cpu_count() or 1
        ends = context.Event()
        pool = ProcessPoolExecutor(processes, context, _begin_worker, (ends,))
        left = iter(tasks)
        sent = dict[Future[bytes], int]()
        try:
            while True:
                with _ctrl_c_postponed():
                    for index in _next(left, _TASKS_PER_SLOT * processes - len(sent)):
                        sent[pool.submit(work, plan.task(index))] = index
                if not sent:
                    return
                for future in wait(sent, return_when=FIRST_COMPLETED).done:
                    yield sent.pop(future), future.result()
        except BrokenProcessPool:
            raise MotorcadeError("sweep-worker-ended") from None
        finally:
            ends.set()
            pool.shutdown(cancel_futures=True)

    return run


def chosen_workers(scheduler: str, jobs: int, work: Work = run_task) -> Workers:
    """Make workers of the Dask scheduler at an address, or without one of this computer."""
    if scheduler:
        return on_a_cluster(scheduler, work)
    return on_this_computer(jobs, work)


def _next(left: Iterator[int | None], count: int) -> Iterator[int]:
    """Yield at most ``count`` numbers of tasks, up to a None."""
    for index in islice(left, count):
        if index is None:
            return
        yield index


def _begin_worker(ends: Event) -> None:
    """Leave Ctrl-C to the parent; end when it ends, or when it sets ``ends``, in the middle of a task too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        parent = multiprocessing.parent_process()
        while not ends.wait(_PARENT_CHECK_S) and parent is not None and parent.is_alive():
            pass
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _ctrl_c_postponed() -> Iterator[None]:
    """Postpone Ctrl-C while workers start: none may be left half started, or get Ctrl-C before it ignores it."""
    if sys.platform == "win32" or threading.current_thread() is not threading.main_thread():
        yield
        return
    # Started by the pool it would unblock signals.
    resource_tracker.ensure_running()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    # Another thread may still get it (a progress bar draws in one), and Python runs the handler in this one.
    pressed = threading.Event()
    handler = signal.signal(signal.SIGINT, lambda number, frame: pressed.set())
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if pressed.is_set():
            signal.raise_signal(signal.SIGINT)


def on_a_cluster(address: str, work: Work = run_task) -> Workers:
    """Make workers of the Dask scheduler at ``address``, such as ``tcp://192.168.1.5:8786``.

    The rows come back to this computer, so the cluster needs no common disk. Dask gives the tasks of a worker that
    died to another one.
    """
    from distributed import wait as wait_for

    def run(plan: Tasks, tasks: Iterable[int | None]) -> Results:
        with _connected(address) as client:
            left = iter(tasks)
            sent = dict[Future[bytes], int]()
            while True:
                slots = _slots(client, address)
                for index in _next(left, max(_TASKS_PER_SLOT * slots - len(sent), 0)):
                    # pure=False: Dask must not reuse the result of an earlier call.
                    sent[client.submit(work, plan.task(index), pure=False)] = index
                if not sent:
                    return
                try:
                    ended = wait_for(list(sent), timeout=_WORKERS_S, return_when="FIRST_COMPLETED").done
                except TimeoutError:
                    continue
                for future in ended:
                    yield sent.pop(future), future.result()

    return run


@contextmanager
def _connected(address: str) -> Iterator[Any]:
    from distributed import Client, KilledWorker

    for name in ("distributed", "distributed.client", "distributed.core"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # its failures become our errors
    try:
        client = Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TypeError):
        raise MotorcadeError("no-dask-scheduler", address=address) from None
    try:
        yield client
    except KilledWorker:
        raise MotorcadeError("dask-workers-killed") from None
    except CancelledError:
        raise MotorcadeError("dask-scheduler-gone", address=address) from None
    finally:
        client.close(timeout=CONNECT_S)


def _slots(client: Any, address: str) -> int:
    """How many tasks the cluster runs at once; wait for a worker where there is none."""
    while True:
        threads: dict[str, int] = client.nthreads()
        if threads:
            return sum(threads.values())
        try:
            client.wait_for_workers(1, _WORKERS_S)
        except TimeoutError:
            raise MotorcadeError("dask-without-workers", address=address) from None
