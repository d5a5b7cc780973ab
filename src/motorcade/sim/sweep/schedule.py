"""Runs a sweep's tasks on all cores of this computer, or on a Dask cluster."""

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from pathlib import Path

from motorcade.sim.sweep.parameters import SweepError
from motorcade.sim.sweep.plan import Plan, Task
from motorcade.sim.sweep.store import Store
from motorcade.sim.sweep.task import run_task

Bar = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
"""Shows how much of a total is done: what it yields is called with that."""

_LOOK_EVERY_S = 0.5

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
            initializer=_obey_parent,
            initargs=(os.getpid(),),
        )
        try:
            with _ctrl_c_put_off():
                results = parallel(delayed(_numbered)(index, plan.task(index)) for index in tasks)
            yield from results
        except TerminatedWorkerError:
            raise SweepError("a worker process ended at once, perhaps for want of memory: try fewer --jobs") from None

    return run


def _obey_parent(parent_pid: int) -> None:
    """Leave Ctrl-C to the parent, and never outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with, args=(parent_pid,), daemon=True).start()


def _leave_with(parent_pid: int) -> None:
    if sys.platform == "win32":
        parent = multiprocessing.parent_process()
        if parent is None:
            return
        parent.join()
    else:
        while os.getppid() == parent_pid:
            time.sleep(_LOOK_EVERY_S)
    os._exit(1)


@contextmanager
def _ctrl_c_put_off() -> Iterator[None]:
    """What starts meanwhile never hears of Ctrl-C, not even before it could ignore it; here it comes afterwards."""
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # else joblib starts it meanwhile, which lets signals through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _numbered(index: int, task: Task) -> tuple[int, bytes]:
    return index, run_task(task)
