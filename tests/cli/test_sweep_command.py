"""The command sweep: the same table from one process, several, after a kill and from a cluster; refusals."""

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import psutil
import pyarrow.parquet as pq
import pytest

from motorcade.extras import install_command
from motorcade.lab import plan as planning
from motorcade.lab import run as running
from support.command_line import PARADE, data, refusal, run
from support.waiting import DEADLINE_S, wait_until

CAR_STEPS = 50_000
# The command with small tasks, so that there are many of them.
SMALL_TASKS = f"""
from motorcade.cli import main
from motorcade.lab import plan
plan.TASK_CAR_STEPS = {CAR_STEPS}
main()
"""
SPEC = """
format = "motorcade-sweep/1"
programs = ["parade.motorcade.json"]
seconds = 0.4
seeds = 3

[grid]
cars = [0, 2, 8]
physics.bit_error_rate = [0, 0.01]
physics.capture_ratio = ["never", 2]
"""
RUNS = 36
posix_only = pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no Ctrl-C to one process alone")
Process = subprocess.Popen[bytes]


@contextlib.contextmanager
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


@contextlib.contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[Process]]]:
    """Run a Dask cluster of processes on this computer.

    Yields the address of its scheduler, and the processes of its workers, which may not have come yet.
    """
    where = folder / "scheduler.json"
    worker = ("worker", "--scheduler-file", str(where), "--nworkers", "1", "--nthreads", "1", "--no-nanny")
    with contextlib.ExitStack() as running:
        scheduler = ("scheduler", "--port", "0", "--host", "127.0.0.1", "--scheduler-file", str(where))
        began = running.enter_context(_process(folder, *scheduler))
        processes = [running.enter_context(_process(folder, *worker)) for _ in range(workers)]
        # The file exists a moment before it holds the address.
        wait_until(lambda: where.exists() and where.read_bytes(), began)
        yield json.loads(where.read_bytes())["address"], processes


@pytest.fixture(autouse=True)
def small_tasks(monkeypatch):
    monkeypatch.setattr(planning, "TASK_CAR_STEPS", CAR_STEPS)


@pytest.fixture
def spec(tmp_path):
    (tmp_path / PARADE.name).write_bytes(PARADE.read_bytes())
    path = tmp_path / "spec.toml"
    path.write_text(SPEC, encoding="utf-8")
    return path


@pytest.fixture
def long_spec(spec):
    """Enough tasks to stop between the first and the last."""
    spec.write_text(SPEC.replace("seeds = 3", "seeds = 80"), encoding="utf-8")
    return spec


def parts_of(table):
    return {path: path.stat().st_mtime_ns for path in table.with_name(f"{table.name}.parts").glob("*.parquet")}


@contextlib.contextmanager
def sweeping(*arguments):
    """The command in its own process, which is killed at the end."""
    command = [sys.executable, "-c", SMALL_TASKS, "sweep", *map(str, arguments)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=True) as process:
        try:
            yield process
        finally:
            process.kill()


# One table


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    """The long sweep's table, made by one process without a stop."""
    folder = tmp_path_factory.mktemp("expected")
    (folder / PARADE.name).write_bytes(PARADE.read_bytes())
    spec = folder / "spec.toml"
    spec.write_text(SPEC.replace("seeds = 3", "seeds = 80"), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(planning, "TASK_CAR_STEPS", CAR_STEPS)
        result = data("sweep", spec, "-o", folder / "out.parquet", "--jobs", "1")
    assert result["tasks"] == result["tasks_run"] > 20
    return (folder / "out.parquet").read_bytes()


def test_a_table_has_a_row_a_run_in_order(spec, tmp_path, monkeypatch):
    monkeypatch.setattr(running, "GROUP_ROWS", 10)
    table = tmp_path / "out.parquet"
    result = data("sweep", spec, "-o", table, "--jobs", "1")
    assert (result["runs"], result["tasks_run"]) == (RUNS, result["tasks"])
    rows = pq.read_table(table).to_pylist()
    assert [row["run"] for row in rows] == list(range(RUNS))
    assert list(rows[0])[:4] == ["run", "program", "mat", "seed"]
    names = ("cars", "physics.bit_error_rate", "physics.capture_ratio", "seed")
    given = [tuple(row[name] for name in names) for row in rows]
    assert given == list(product((0, 2, 8), (0, 0.01), (None, 2), range(3)))
    assert {(row["program"], row["mat"]) for row in rows} == {(PARADE.name, "empty")}
    assert [path.name for path in tmp_path.iterdir() if "out" in path.name] == ["out.parquet"]


def test_a_killed_sweep_continues_with_several_processes_and_runs_no_task_twice(long_spec, tmp_path, expected):
    table = tmp_path / "out.parquet"
    with sweeping(long_spec, "-o", table, "--jobs", "2") as process:
        wait_until(lambda: len(parts_of(table)) > 3, process)
        process.kill()
        # The workers hold the other end of the pipes, so this also waits for them.
        process.communicate(timeout=DEADLINE_S)
    kept = parts_of(table)
    assert not table.exists()
    result = data("sweep", long_spec, "-o", table, "--jobs", "2")
    assert result["tasks_run"] == result["tasks"] - len(kept)
    assert table.read_bytes() == expected
    assert not table.with_name("out.parquet.parts").exists()


@posix_only
def test_ctrl_c_ends_in_a_sentence(spec, tmp_path):
    # So long that it doesn't end before the signal, however late that is.
    spec.write_text(SPEC.replace("seeds = 3", "seeds = 24000"), encoding="utf-8")
    table = tmp_path / "out.parquet"
    with sweeping(spec, "-o", table, "--jobs", "2") as process:
        known = psutil.Process(process.pid)
        wait_until(lambda: len(known.children()) > 2 and len(parts_of(table)) >= 3, process)
        # A terminal also signals the workers.
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=DEADLINE_S)
    assert (process.returncode, out) == (130, "")
    assert err == f"motorcade: stopped; the same command goes on from what is in {table}.parts\n"


def test_a_finished_table_is_neither_made_again_nor_replaced(spec, tmp_path):
    table = tmp_path / "out.parquet"
    data("sweep", spec, "-o", table, "--jobs", "1")
    before = table.read_bytes()
    assert data("sweep", spec, "-o", table)["tasks_run"] == 0
    (tmp_path / PARADE.name).write_text('{"format": "motorcade-program/1", "leader": [{"wait": {"seconds": 1}}]}')
    assert "out.parquet holds another sweep (program parade.motorcade.json " in refusal(2, "sweep", spec, "-o", table)
    assert table.read_bytes() == before
    (tmp_path / "other.parquet").write_bytes(spec.read_bytes())
    assert "is no sweep's table" in refusal(2, "sweep", spec, "-o", tmp_path / "other.parquet")


def test_a_table_is_a_parquet_file_and_has_that_name(spec, tmp_path):
    table = tmp_path / "table.csv"
    assert "its name must end in .parquet" in refusal(2, "sweep", spec, "-o", table)
    assert not table.exists()


# A cluster


def test_a_cluster_makes_the_same_table_though_a_worker_dies(long_spec, tmp_path, expected):
    table = tmp_path / "out.parquet"
    with (
        cluster(tmp_path, 2) as (address, (first, second)),
        sweeping(long_spec, "-o", table, "--scheduler", address, "--json") as process,
    ):
        wait_until(lambda: len(parts_of(table)) > 3, process, first, second)
        first.kill()
        out, err = process.communicate(timeout=DEADLINE_S)
    assert (process.returncode, err) == (0, "")
    result = json.loads(out)
    assert result["tasks_run"] == result["tasks"]
    assert table.read_bytes() == expected


def test_a_cluster_that_is_not_there_is_named(spec, tmp_path, monkeypatch):
    monkeypatch.setattr(running, "CONNECT_S", 0.1)
    arguments = ("sweep", spec, "-o", tmp_path / "out.parquet", "--scheduler")
    for address in ("tcp://127.0.0.1:1", "nonsense"):
        assert f"no Dask scheduler answers at {address}" in refusal(2, *arguments, address)


# Refusals


def test_programs_and_mats_that_are_not_valid_are_named(spec, tmp_path):
    def refused(code, old, new):
        spec.write_text(SPEC.replace(old, new), encoding="utf-8")
        return refusal(code, "sweep", spec, "-o", tmp_path / "out.parquet")

    assert "programs[0], 'none' can't be read: there is no such file" in refused(2, PARADE.name, "none")
    assert "programs[0], 'spec.toml' is no program" in refused(2, PARADE.name, "spec.toml")
    one_mat = SPEC.replace("cars = [0, 2, 8]", "").replace("seeds = 3", 'mats = ["none.toml"]')
    assert "mats[0]: mat none.toml can't be read" in refused(2, SPEC, one_mat)
    (tmp_path / PARADE.name).write_text('{"format": "motorcade-program/1", "leader": [{"wait": {"seconds": 0.5}}]}')
    spec.write_text(SPEC, encoding="utf-8")
    ran = run("sweep", spec, "-o", tmp_path / "out.parquet")
    assert (ran.code, ran.out) == (1, "")
    says = f"motorcade: spec.toml: programs[0], '{PARADE.name}', has errors: correct them first"
    assert ran.err.splitlines()[-1] == says


@pytest.mark.parametrize(
    ("missing", "extra", "more"),
    [("pyarrow", "sim", ()), ("distributed", "cluster", ("--scheduler", "tcp://127.0.0.1:1"))],
)
def test_what_is_not_installed_is_named_with_its_command(spec, tmp_path, monkeypatch, missing, extra, more):
    monkeypatch.setitem(sys.modules, missing, None)
    for name in [each for each in sys.modules if each.startswith("motorcade.lab.")]:
        monkeypatch.delitem(sys.modules, name)
    sentence = refusal(2, "sweep", spec, "-o", tmp_path / "out.parquet", *more)
    assert sentence == f"a sweep needs {missing}: {install_command(extra)}"
