"""A Dask cluster of processes on this computer."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from support.waiting import wait_until

Process = subprocess.Popen[bytes]


@contextmanager
def _process(folder: Path, *arguments: str) -> Iterator[Process]:
    """A process of Dask, which imports this checkout and logs into a file."""
    with (folder / f"{arguments[0]}.log").open("ab") as log:
        command = [sys.executable, "-m", f"distributed.cli.dask_{arguments[0]}", *arguments[1:], "--no-dashboard"]
        process = subprocess.Popen(command, stdout=log, stderr=log, cwd=folder)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[Process]]]:
    """The address of a scheduler, and the processes of its workers, which may not have come yet."""
    where = folder / "scheduler.json"
    worker = ("worker", "--scheduler-file", str(where), "--nworkers", "1", "--nthreads", "1", "--no-nanny")
    with ExitStack() as running:
        scheduler = ("scheduler", "--port", "0", "--host", "127.0.0.1", "--scheduler-file", str(where))
        began = running.enter_context(_process(folder, *scheduler))
        processes = [running.enter_context(_process(folder, *worker)) for _ in range(workers)]
        # The file exists a moment before it holds the address.
        wait_until(lambda: where.exists() and where.read_bytes(), began)
        yield json.loads(where.read_bytes())["address"], processes
