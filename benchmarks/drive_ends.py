"""Kill or freeze a car's process while its wheels turn, and measure when its guard has stopped the wheels."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1] / "tests"
DEADLINE_S = 30
POLL_S = 0.002
# In place of a signal: the interpreter's lock is held, so that no thread of the process runs.
HANG = "hang"


@contextmanager
def driving(file: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a process that drives; it writes each command of its wheels, and when, to ``file``."""
    environment = {**os.environ, "PYTHONPATH": str(TESTS)}
    with subprocess.Popen(
        [sys.executable, "-m", "support.guarded_car", str(file)],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout
        process.stdout.readline()
        try:
            yield process
        finally:
            process.kill()


def notes(file: Path) -> list[tuple[str, float]]:
    """Return the commands to the wheels and their times, without a last line that is not yet complete."""
    whole_lines = file.read_text(encoding="ascii").split("\n")[:-1]
    return [(command, float(at_s)) for command, at_s in map(str.split, whole_lines)]


def end_ms(name: str, after_s: float) -> float | None:
    """Send a signal to a driving car and return the time from its last command until the wheels stand still.

    Args:
        name: the name of the signal, or HANG.
        after_s: when the signal is sent, from the start of the car.

    Returns:
        None where the wheels stood still already.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "wheels"
        with driving(file) as process:
            time.sleep(after_s)
            if name == HANG:
                assert process.stdin
                process.stdin.write("hang\n")
                process.stdin.flush()
                # The next command of its loop may still come before it hangs.
                process.wait(DEADLINE_S)
            else:
                os.killpg(process.pid, getattr(signal, name))
            commands = [note for note in notes(file) if note[0] not in ("try", "rescue")]
            if commands[-1][0] != "apply":
                return None
            end_s = time.monotonic() + DEADLINE_S
            while notes(file)[-1][0] != "rescue" and time.monotonic() < end_s:
                time.sleep(POLL_S)
            last, at_s = notes(file)[-1]
            return (at_s - commands[-1][1]) * 1000 if last == "rescue" else float("inf")


def ends_ms(name: str, count: int) -> list[float]:
    """Return `end_ms` of ``count`` cars, two at a time, each at a different moment of the car's period."""
    with ThreadPoolExecutor(2) as pool:
        found = pool.map(lambda number: end_ms(name, 0.5 + number / count / 10), range(count))
        return [each for each in found if each is not None]
