"""Runs a sweep's tasks in processes of this computer."""

import multiprocessing
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager

from joblib import Parallel, cpu_count, delayed
from joblib.externals.loky.process_executor import TerminatedWorkerError

from motorcade.experiments.parameters import SweepError
from motorcade.experiments.plan import Plan, Task
from motorcade.experiments.schedule import Results, Workers
from motorcade.experiments.task import run_task

_LOOK_EVERY_S = 0.5
# What joblib tells when it was stopped, and when it replaces a process that has grown.
_NO_NEWS = ".* tasks (have been successfully executed|which were still being processed)|A worker stopped while"


def on_this_computer(jobs: int) -> Workers:
    """Workers that are processes of this computer, ``jobs`` of them; 0: one a core."""

    def run(plan: Plan, tasks: Sequence[int]) -> Results:
        warnings.filterwarnings("ignore", _NO_NEWS)
        parallel = Parallel(
            n_jobs=min(jobs or cpu_count(), len(tasks)),
            backend="loky",
            return_as="generator_unordered",
            batch_size=1,
            initializer=_obey_parent,
            initargs=(os.getpid(),),
        )
        told = threading.excepthook
        # Stopped, joblib kills its workers, over which a thread of its own may stumble.
        threading.excepthook = lambda what: None if getattr(parallel, "_aborting", False) else told(what)
        try:
            with _ctrl_c_put_off() as pressed:
                results = parallel(delayed(_numbered)(index, plan.task(index)) for index in tasks)
            with closing(results):
                if pressed:
                    raise KeyboardInterrupt
                yield from results
            threading.excepthook = told
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
def _ctrl_c_put_off() -> Iterator[list[int]]:
    """Workers start here: none may be left half begun, nor hear of Ctrl-C before it can ignore it.

    Yields a list that holds something afterwards where Ctrl-C was pressed.
    """
    pressed: list[int] = []
    if sys.platform == "win32" or threading.current_thread() is not threading.main_thread():
        yield pressed
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # else joblib starts it meanwhile, which lets signals through again
    handler = signal.signal(signal.SIGINT, lambda number, frame: pressed.append(number))
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # workers inherit it
    try:
        yield pressed
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, handler)


def _numbered(index: int, task: Task) -> tuple[int, bytes]:
    return index, run_task(task)
