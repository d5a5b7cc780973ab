"""Runs a sweep's tasks on all cores of this computer, or on a Dask cluster."""

import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from pathlib import Path

from motorcade.sim.sweep.parameters import SweepError
from motorcade.sim.sweep.plan import Plan, Task
from motorcade.sim.sweep.store import Store
from motorcade.sim.sweep.task import run_task

Bar = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
"""Shows how much of a total is done: what it yields is called with that."""

_LONELY_S = 30  # how long a worker stays when the process that it works for was killed

Results = Generator[tuple[int, bytes], None, None]
"""Finished tasks, in whatever order they end: the number of each, and its rows."""

Workers = Callable[[Plan, Sequence[int]], Results]
"""Runs those tasks of a plan whose numbers it is given."""


@contextmanager
def _no_bar(verb: str, total: int) -> Iterator[Callable[[int], None]]:
    yield lambda done: None


def run_sweep(plan: Plan, path: Path, workers: Workers, bar: Bar = _no_bar) -> int:
    """Make the table at ``path``; what an earlier call has finished isn't run again.

    Args:
        plan: what to run.
        path: of the table, a Parquet file.
        workers: `on_this_computer` or `on_a_cluster`.
        bar: shows how far it is, such as `motorcade.console.progress_bar`.

    Returns:
        How many tasks were run.

    Raises:
        SweepError: it can't be, or not go on; what is finished is kept.
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
    store.forget()
    return len(missing)


def _run_missing(plan: Plan, missing: Sequence[int], store: Store, workers: Workers, bar: Bar) -> None:
    done = plan.runs - sum(plan.task_runs(index) for index in missing)
    with bar("runs", plan.runs) as advance, closing(workers(plan, missing)) as results:
        advance(done)
        for index, rows in results:
            store.keep(index, rows)
            done += plan.task_runs(index)
            advance(done)


def on_this_computer(jobs: int) -> Workers:
    """Workers that are processes of this computer, ``jobs`` of them; 0: one a core."""

    def run(plan: Plan, tasks: Sequence[int]) -> Results:
        from joblib import Parallel, cpu_count, delayed
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        parallel = Parallel(
            n_jobs=min(jobs or cpu_count(), len(tasks)),
            backend="loky",
            return_as="generator_unordered",
            batch_size=1,
            initializer=_ignore_ctrl_c,
            idle_worker_timeout=_LONELY_S,
        )
        try:
            with _ctrl_c_ignored():
                results = parallel(delayed(_numbered)(index, plan.task(index)) for index in tasks)
            yield from results
        except TerminatedWorkerError:
            raise SweepError("a worker process ended at once, perhaps for want of memory: try fewer --jobs") from None

    return run


def _ignore_ctrl_c() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _ctrl_c_ignored() -> Iterator[None]:
    """For a moment, in which the workers start: they then ignore it for good, before they could be told to."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _numbered(index: int, task: Task) -> tuple[int, bytes]:
    return index, run_task(task)
