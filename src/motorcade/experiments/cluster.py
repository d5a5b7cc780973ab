"""Runs a sweep's tasks on a Dask cluster."""

import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from itertools import islice

from distributed import Client, Future, KilledWorker, wait

from motorcade.experiments.parameters import SweepError
from motorcade.experiments.plan import Plan
from motorcade.experiments.schedule import Results, Workers
from motorcade.experiments.task import run_task

CONNECT_S = 10
# How long to wait for a first worker, and for another one when all have left.
WORKERS_S = 30
_AHEAD = 2  # tasks sent for each that can run at once, so that no worker waits


def on_a_cluster(address: str) -> Workers:
    """The workers of the Dask scheduler at ``address``, such as ``tcp://192.168.1.5:8786``.

    The rows come back to this computer, so the cluster needs no common disk. What a worker ran when it died, Dask
    gives to another one.
    """

    def run(plan: Plan, tasks: Sequence[int]) -> Results:
        with _connected(address) as client:
            left, sent = iter(tasks), dict[Future[bytes], int]()
            while True:
                slots = _slots(client, address)
                for index in islice(left, max(_AHEAD * slots - len(sent), 0)):
                    # Nothing is kept from an earlier call: a part that is there isn't asked for.
                    sent[client.submit(run_task, plan.task(index), pure=False)] = index
                if not sent:
                    return
                for future in _ended(client, sent, address):
                    yield sent.pop(future), future.result()

    return run


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    for name in ("distributed", "distributed.client", "distributed.core"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what goes wrong ends in a sentence of ours
    try:
        client = Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TypeError):
        raise SweepError(
            f"no Dask scheduler answers at {address}: start one with `dask scheduler`, and take the address it prints"
        ) from None
    try:
        yield client
    except KilledWorker:
        raise SweepError(
            "one task ended several workers of the cluster, perhaps for want of memory: "
            "give them more, or take the --jobs of this computer"
        ) from None
    except CancelledError:
        raise SweepError(
            f"the Dask scheduler at {address} has gone; what is done is kept: start it again, and give the same command"
        ) from None
    finally:
        client.close(timeout=CONNECT_S)


def _slots(client: Client, address: str) -> int:
    """How many tasks the cluster runs at once; waits for a worker where there is none."""
    while True:
        threads: dict[str, int] = client.nthreads()
        if threads:
            return sum(threads.values())
        try:
            client.wait_for_workers(1, WORKERS_S)
        except TimeoutError:
            raise SweepError(
                f"the cluster at {address} has no workers: start some with `dask worker {address} --nthreads 1`"
            ) from None


def _ended(client: Client, sent: dict[Future[bytes], int], address: str) -> set[Future[bytes]]:
    """Those of the tasks that have ended, one at least."""
    while True:
        try:
            return set(wait(list(sent), timeout=WORKERS_S, return_when="FIRST_COMPLETED").done)
        except TimeoutError:
            _slots(client, address)
