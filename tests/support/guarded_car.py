"""A car in a process of its own that drives until it is told to end, or until somebody ends it; run by test_guard.py.

``python -m support.guarded_car FILE [FAILSAFE_MS]``: its board appends to FILE what it is told, and when by the clock
of all processes. It says ``drives`` once it does.
"""

import asyncio
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import built_in_profile
from motorcade.drive.safety.watchdog import watched
from motorcade.drive.session import APPLIED, CarControl
from motorcade.timing import monotonic_ms
from motorcade.words.formats import DRIVE

CLASSROOM = built_in_profile("classroom")
MOVE = DRIVE.encode(angle=40, direction=1, speed=150)
STILL = DRIVE.encode(angle=40, direction=1, speed=0)


class FileBoard(DriveBoard):
    """Wheels that go on as they were told last, whatever becomes of the process."""

    def __init__(self, file: str) -> None:
        self._file = file

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        note(self._file, "apply")

    def neutral(self) -> None:
        note(self._file, "neutral")

    def rescue(self) -> tuple[str, tuple[str, ...]]:
        return "support.guarded_car:rescue", (self._file,)


def note(file: str, told: str) -> None:
    with Path(file).open("a", encoding="ascii") as notes:
        notes.write(f"{told} {time.monotonic()}\n")


def rescue(file: str) -> None:
    """Called by the guard; as those of a process that has just died, the pins are free at the second try."""
    tried_before = "try" in Path(file).read_text(encoding="ascii")
    note(file, "try")
    if not tried_before:
        raise OSError("the pins are held")
    note(file, "rescue")


heard: list[str] = []


def listen() -> None:
    for line in sys.stdin:
        heard.append(line.strip())


async def drive_until_told(file: str, failsafe_ms: int) -> None:
    limits = replace(CLASSROOM.drive, failsafe_ms=failsafe_ms)
    drive = CarControl(FileBoard(file), monotonic_ms, replace(CLASSROOM, drive=limits))
    threading.Thread(target=listen, daemon=True).start()
    async with watched(drive):
        seat = drive.join("test")
        told = False
        while "end" not in heard:
            if "fail" in heard:
                raise ZeroDivisionError
            outcome = seat.command(MOVE)
            if outcome == APPLIED and not told:
                told = True
                print("drives", flush=True)
            elif outcome != APPLIED:
                seat.command(STILL)
            await asyncio.sleep(0.04)


if __name__ == "__main__":
    asyncio.run(drive_until_told(sys.argv[1], int(sys.argv[2]) if sys.argv[2:] else CLASSROOM.drive.failsafe_ms))
