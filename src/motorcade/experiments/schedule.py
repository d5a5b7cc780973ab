"""Runs what a sweep has not run yet, and makes its table."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from pathlib import Path

from motorcade.experiments.plan import Plan
from motorcade.experiments.store import Store

Bar = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
"""Shows how much of a total is done: what it yields is called with that."""

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
        workers: `motorcade.experiments.processes.on_this_computer` or `motorcade.experiments.cluster.on_a_cluster`.
        bar: shows how far it is, such as `motorcade.cli.console.progress_bar`.

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
