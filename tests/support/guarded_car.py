"""A car in a process of its own that drives until it is told to end, or until it is killed.

For test_motor_guard.py and benchmarks/drive_ends.py.

``python -m support.guarded_car FILE [FAILSAFE_MS [program|stands]]``: its board appends each call to FILE, a line with
the method and the time in seconds by the clock that all processes share. The process prints ``drives`` when the wheels
turn, and obeys three lines on its standard input: ``end``, ``fail``, and ``hang``, which holds the interpreter's lock.
A car that runs its own ``program`` obeys nobody, and drives until it is killed; one that ``stands`` drove before.
"""

import asyncio
import ctypes
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

from motorcade.car.arbiter import APPLIED
from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import built_in_profile
from motorcade.drive.motor_guard import MotorGuard
from motorcade.drive.server import watched
from motorcade.drive.session import CarControl, ControlSession
from motorcade.timing import monotonic_ms
from motorcade.words.formats import DRIVE

CLASSROOM = built_in_profile("classroom")
MOVE = DRIVE.encode(angle=40, direction=1, speed=150)
STILL = DRIVE.encode(angle=40, direction=1, speed=0)
PERIOD_S = 0.04


class FileBoard(DriveBoard):
    """Wheels that keep their last setpoint, whatever becomes of the process."""

    def __init__(self, file: str) -> None:
        self._file = file

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        record(self._file, "apply")

    def neutral(self) -> None:
        record(self._file, "neutral")

    def rescue(self) -> tuple[str, tuple[str, ...]]:
        return "support.guarded_car:rescue", (self._file,)


def record(file: str, call: str) -> None:
    with Path(file).open("a", encoding="ascii") as calls:
        calls.write(f"{call} {time.monotonic()}\n")


def rescue(file: str) -> None:
    """Called by the guard. The first try fails, as after the death of a process that still holds the pins."""
    tried_before = "try" in Path(file).read_text(encoding="ascii")
    record(file, "try")
    if not tried_before:
        raise OSError("the pins are held")
    record(file, "rescue")


def note_rescue(file: str) -> None:
    """Called by the guard of tests/cli/noted_pi_car.py."""
    with Path(file).open("a", encoding="ascii") as notes:
        notes.write("rescued 0\n")


def read_order(loop: asyncio.AbstractEventLoop, order: asyncio.Future[str]) -> None:
    loop.call_soon_threadsafe(order.set_result, sys.stdin.readline().strip())


async def drive(file: str, failsafe_ms: int) -> None:
    """Repeat a command every 40 ms, which a guard watches in real time, until a line comes."""
    limits = replace(CLASSROOM.drive, failsafe_ms=failsafe_ms)
    control = CarControl(FileBoard(file), monotonic_ms, replace(CLASSROOM, drive=limits))
    loop = asyncio.get_running_loop()
    order: asyncio.Future[str] = loop.create_future()
    threading.Thread(target=read_order, args=(loop, order), daemon=True).start()
    async with watched(control):
        session, has_driven = ControlSession(control, "test"), False
        while not order.done():
            if session.command(MOVE) != APPLIED:
                session.command(STILL)
            elif not has_driven:
                has_driven = True
                print("drives", flush=True)
            await asyncio.wait([order], timeout=PERIOD_S)
        if order.result() == "hang":
            # Unlike CDLL it keeps the lock, so that no thread of this process runs.
            ctypes.PyDLL(None).sleep(60)
        if order.result() == "fail":
            raise ZeroDivisionError


def run_program(file: str, failsafe_ms: int, stands: bool) -> None:
    """Move the wheels without any command, as a car's own program does; once, or again and again."""
    guard = MotorGuard(FileBoard(file).rescue(), failsafe_ms)
    guard.beat(moves=True)
    record(file, "apply")
    guard.beat(moves=not stands)
    print("drives", flush=True)
    while True:
        time.sleep(PERIOD_S)
        guard.beat(moves=not stands)


if __name__ == "__main__":
    of_car = int(sys.argv[2]) if sys.argv[2:] else CLASSROOM.drive.failsafe_ms
    if sys.argv[3:]:
        run_program(sys.argv[1], of_car, sys.argv[3] == "stands")
    else:
        asyncio.run(drive(sys.argv[1], of_car))
