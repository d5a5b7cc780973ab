"""The wheels of a car whose process is killed or frozen: another process stops them, in real time."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest

from motorcade.drive.motor_guard import MotorGuard
from support.waiting import DEADLINE_S, wait_until

TESTS = Path(__file__).parents[1]
# A guard takes a process that is silent for so long for a frozen one, also where only the machine is busy.
QUICK_MS, PATIENT_MS = 1000, 30_000


@contextmanager
def driving(
    file: Path, failsafe_ms: int = PATIENT_MS, stderr: int = subprocess.DEVNULL, how: tuple[str, ...] = ()
) -> Iterator[subprocess.Popen]:
    """A process whose car drives, and records the calls of its board in ``file``."""
    command = [sys.executable, "-m", "support.guarded_car", str(file), str(failsafe_ms), *how]
    path = os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": path}
    with subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=stderr,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            assert process.stdout.readline() == "drives\n"
            yield process
        finally:
            process.kill()


def calls(file: Path) -> list[str]:
    return file.read_text(encoding="ascii").split()[::2]


def wait_for_last(file: Path, call: str) -> None:
    wait_until(lambda: calls(file)[-1] == call)


def freeze_while_it_drives(process: subprocess.Popen, file: Path) -> None:
    """Do what Ctrl-Z does, with the whole group. On a busy machine the car may stand still just then; try again."""
    os.killpg(process.pid, signal.SIGSTOP)
    while calls(file)[-1] != "apply":
        os.killpg(process.pid, signal.SIGCONT)
        wait_for_last(file, "apply")
        os.killpg(process.pid, signal.SIGSTOP)


def test_a_guard_that_ends_while_it_starts_is_none() -> None:
    with pytest.raises(OSError, match="guard"):
        MotorGuard(("there_is_no_such_module:stop", ()), PATIENT_MS)


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="only POSIX freezes a process")
@pytest.mark.parametrize("how", [(), ("program",)])
def test_a_frozen_process_is_killed_and_its_wheels_are_stopped(tmp_path: Path, how: tuple[str, ...]) -> None:
    file = tmp_path / "wheels"
    with driving(file, QUICK_MS, how=how) as process:
        freeze_while_it_drives(process, file)
        assert process.wait(DEADLINE_S) == -signal.SIGKILL
        wait_for_last(file, "rescue")


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="only POSIX freezes a process")
def test_a_frozen_process_whose_car_stands_is_left_alone(tmp_path: Path) -> None:
    """It was frozen before another one that is killed."""
    standing, moving = tmp_path / "standing", tmp_path / "moving"
    with driving(standing, QUICK_MS, how=("stands",)) as process, driving(moving, QUICK_MS) as other:
        os.killpg(process.pid, signal.SIGSTOP)
        freeze_while_it_drives(other, moving)
        other.wait(DEADLINE_S)
        assert process.poll() is None
        assert "rescue" not in calls(standing)
        os.killpg(process.pid, signal.SIGCONT)


@pytest.mark.parametrize(("order", "status"), [("end", 0), ("fail", 1)])
def test_a_process_that_ends_by_itself_or_by_an_exception_needs_no_rescue(
    tmp_path: Path, order: str, status: int
) -> None:
    file = tmp_path / "wheels"
    with driving(file) as process:
        process.communicate(f"{order}\n", DEADLINE_S)
        assert process.returncode == status
        assert calls(file)[-1] == "neutral"
        assert "try" not in calls(file)


def guard_of(process: subprocess.Popen | psutil.Process) -> psutil.Process:
    children = psutil.Process(process.pid).children()
    return next(child for child in children if "motorcade.drive.motor_guard" in child.cmdline())


@pytest.mark.skipif(os.name != "posix", reason="only POSIX lets a pipe's writer see that it is full")
def test_killing_the_process_stops_the_wheels_also_where_nobody_reads_the_log(tmp_path: Path) -> None:
    file, (reader, writer) = tmp_path / "wheels", os.pipe()
    os.set_blocking(writer, False)
    with suppress(BlockingIOError):
        while os.write(writer, b"x"):
            pass
    os.set_blocking(writer, True)
    with driving(file, stderr=writer) as process:
        process.kill()
        process.wait(DEADLINE_S)
        wait_for_last(file, "rescue")
    os.close(reader)
    os.close(writer)


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="only POSIX freezes a process")
def test_wheels_stop_when_their_guard_is_frozen(tmp_path: Path) -> None:
    file = tmp_path / "wheels"
    with driving(file, QUICK_MS) as process:
        guard = guard_of(process)
        guard.suspend()
        wait_for_last(file, "neutral")
        count = len(calls(file))
        # Nobody rescues the wheels now; they stand still already.
        process.kill()
        process.wait(DEADLINE_S)
        assert calls(file)[count:] == []
        guard.kill()


def test_a_guard_that_can_not_stop_the_wheels_says_so(tmp_path: Path) -> None:
    own = [str(os.getpid()), str(QUICK_MS), "os:rmdir", str(tmp_path / "nowhere")]
    command = [sys.executable, "-m", "motorcade.drive.motor_guard", *own]
    # The process that drives is gone when its end of the pipe is closed.
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "the wheels may still turn" in done.stderr


def test_wheels_without_their_guard_stand_still(tmp_path: Path) -> None:
    file = tmp_path / "wheels"
    with driving(file) as process:
        guard_of(process).kill()
        wait_for_last(file, "neutral")
        count = len(calls(file))
        process.communicate("end\n", DEADLINE_S)
        assert "apply" not in calls(file)[count:]
