"""Cars whose process is killed or frozen while its wheels turn, and when their guards had stopped the wheels."""

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
LOOK_S = 0.002


@contextmanager
def driving(file: Path) -> Iterator[subprocess.Popen[str]]:
    """A process whose wheels turn; it notes in ``file`` what they are told."""
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
    return [(told, float(at_s)) for told, at_s in map(str.split, file.read_text(encoding="ascii").splitlines())]


def end_ms(name: str, after_s: float) -> float | None:
    """From the last command to wheels that stand, where the process ends like this; None where it stood already."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "wheels"
        with driving(file) as process:
            time.sleep(after_s)
            os.killpg(process.pid, getattr(signal, name))
            told = notes(file)
            if told[-1][0] != "apply":
                return None
            end_s = time.monotonic() + DEADLINE_S
            while notes(file)[-1][0] != "rescue" and time.monotonic() < end_s:
                time.sleep(LOOK_S)
            last, at_s = notes(file)[-1]
            return (at_s - told[-1][1]) * 1000 if last == "rescue" else float("inf")


def ends_ms(name: str, count: int) -> list[float]:
    """Two at a time, each after a different part of the car's own period."""
    with ThreadPoolExecutor(2) as pool:
        found = pool.map(lambda number: end_ms(name, 0.5 + number / count / 10), range(count))
        return [each for each in found if each is not None]
