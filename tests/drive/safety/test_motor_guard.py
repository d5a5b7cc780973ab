"""The wheels of a car whose process is killed or frozen: another process stops them."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

from motorcade.drive.safety.motor_guard import MotorGuard

TESTS = Path(__file__).parents[2]
DEADLINE_S = 60
# A guard takes a process that a busy machine lets wait for so long for a frozen one.
QUICK_MS, PATIENT_MS = 1000, 30_000


@contextmanager
def driving(file: Path, failsafe_ms: int = PATIENT_MS) -> Iterator[subprocess.Popen]:
    """A process whose car drives, and notes what its wheels are told in ``file``."""
    command = [sys.executable, "-m", "support.guarded_car", str(file), str(failsafe_ms)]
    path = os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": path}
    with subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            assert process.stdout.readline() == "drives\n"
            yield process
        finally:
            process.kill()


def last_told(file: Path) -> str:
    return file.read_text(encoding="ascii").splitlines()[-1].split()[0]


def wait_for_rescue(file: Path) -> None:
    end_s = time.monotonic() + DEADLINE_S
    while last_told(file) != "rescue":
        assert time.monotonic() < end_s, "nobody stopped the wheels"
        time.sleep(0.01)


def freeze_while_it_drives(process: subprocess.Popen, file: Path) -> None:
    """As Ctrl-Z does, with all of its group. A busy machine's car may stand still at any moment, and is let go on."""
    end_s = time.monotonic() + DEADLINE_S
    os.killpg(process.pid, signal.SIGSTOP)
    while last_told(file) != "apply":
        assert time.monotonic() < end_s, "it never drove"
        os.killpg(process.pid, signal.SIGCONT)
        time.sleep(0.05)
        os.killpg(process.pid, signal.SIGSTOP)


def test_killing_the_process_stops_the_wheels(tmp_path: Path) -> None:
    file = tmp_path / "wheels"
    with driving(file) as process:
        process.kill()
        process.wait(DEADLINE_S)
        wait_for_rescue(file)


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="only POSIX freezes a process")
def test_a_frozen_process_is_killed_and_its_wheels_are_stopped(tmp_path: Path) -> None:
    file = tmp_path / "wheels"
    with driving(file, QUICK_MS) as process:
        freeze_while_it_drives(process, file)
        assert process.wait(DEADLINE_S) == -signal.SIGKILL
        wait_for_rescue(file)


def test_a_process_that_ends_by_itself_needs_no_rescue(tmp_path: Path) -> None:
    file = tmp_path / "wheels"
    with driving(file) as process:
        process.communicate("end\n", DEADLINE_S)
        assert process.returncode == 0
        assert last_told(file) == "neutral"
        assert "try" not in file.read_text(encoding="ascii")


def test_a_process_that_ends_by_an_exception_leaves_the_wheels_still(tmp_path: Path) -> None:
    file = tmp_path / "wheels"
    with driving(file) as process:
        process.communicate("fail\n", DEADLINE_S)
        assert process.returncode == 1
        assert last_told(file) == "neutral"


def test_wheels_without_their_guard_stand_still(tmp_path: Path) -> None:
    file = tmp_path / "wheels"
    with driving(file) as process:
        guard = next(
            child
            for child in psutil.Process(process.pid).children()
            if "motorcade.drive.safety.motor_guard" in child.cmdline()
        )
        guard.kill()
        end_s = time.monotonic() + DEADLINE_S
        while last_told(file) != "neutral":
            assert time.monotonic() < end_s, "the wheels go on without a guard"
            time.sleep(0.01)
        length = len(file.read_text(encoding="ascii"))
        process.communicate("end\n", DEADLINE_S)
        assert "apply" not in file.read_text(encoding="ascii")[length:]


def beat_on(guard: MotorGuard) -> None:
    """More often than any pipe can hold."""
    for _ in range(1 << 21):
        guard.beat(False)


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="only POSIX freezes a process")
def test_a_guard_that_hangs_is_as_good_as_gone() -> None:
    guard = MotorGuard(("json:dumps", ("",)), 300)
    process = next(
        each for each in psutil.Process().children() if "motorcade.drive.safety.motor_guard" in each.cmdline()
    )
    process.suspend()
    try:
        with pytest.raises(OSError, match="is gone"):
            beat_on(guard)
    finally:
        process.kill()
        guard.dismiss()
