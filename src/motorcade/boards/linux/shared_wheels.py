"""Wheels that obey their driver or their car's program, and never both."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from motorcade.boards.linux.chassis import Chassis
from motorcade.car.brain import FORWARD
from motorcade.words.ticks import elapsed_ms

# Longer than a write to healthy hardware takes, shorter than anybody wants to wait for wheels that shall stop.
_PATIENCE_S = 0.05
_STILL = (FORWARD, 0)


class SharedWheels:
    """The wheels of a car that is driven and programmed.

    The program goes on while somebody drives, in a thread of its own. What it wants of the wheels is remembered,
    and done while it may drive. The driver's side may be called from any other thread, and stops the
    wheels even where the program's thread hangs in their hardware.

    Args:
        chassis: the wheels.
        clock: the time in ms that wraps, as `motorcade.words.ticks` says.
        patience_ms: a program that doesn't ``beat`` for so long mustn't drive.
    """

    def __init__(self, chassis: Chassis, clock: Callable[[], int], patience_ms: int) -> None:
        self._chassis = chassis
        self._clock = clock
        self._patience_ms = patience_ms
        self._lock = threading.Lock()
        self._wanted = _STILL
        self._rests = False
        self._is_programmed = False
        self._fault = self._end = ""
        self._beaten_ms = clock()

    # The program's side

    def set(self, direction: int, speed_level: int) -> None:
        """The program wants this, as `motorcade.car.board.Board.set_wheels`."""
        with self._lock:
            self._wanted = (direction, speed_level)
            self._obey_program()

    def beat(self) -> None:
        """A sign of life of the program."""
        self._beaten_ms = self._clock()

    def fail(self, reason: str, is_over: bool = False) -> None:
        """The program can't see to the wheels: where it drives they stand still, and `check_program` says why.

        ``is_over``: it never will again.
        """
        with self._lock:
            if is_over:
                self._end = reason
            self._fail(reason)

    @contextmanager
    def at_rest(self) -> Iterator[None]:
        """While the block runs, which may take long, a program that drives stands still. No sign of life is due."""
        with self._lock:
            self._rests = True
            self._obey_program()
        try:
            yield
        finally:
            with self._lock:
                self.beat()
                self._rests = False
                self._obey_program()

    # The driver's side

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        """As `motorcade.car.drive_board.DriveBoard.apply`."""
        self._is_programmed = False
        with self._locked():
            self._chassis.apply(angle_deg, direction, speed)

    def neutral(self) -> None:
        """As `motorcade.car.drive_board.DriveBoard.neutral`."""
        self._is_programmed = False
        is_locked = self._lock.acquire(timeout=_PATIENCE_S)
        try:
            self._chassis.neutral()
        finally:
            if is_locked:
                self._lock.release()

    def begin_program(self) -> None:
        """The program has the wheels. Raises OSError where it is dead or hangs, or the hardware fails."""
        self._check_beat()
        with self._locked():
            self._fault = ""
            self._is_programmed = True
            self._write_program()

    def end_program(self) -> None:
        """The program hasn't the wheels any more; ``neutral`` or ``apply`` has to follow."""
        self._is_programmed = False

    def check_program(self) -> None:
        """As `motorcade.car.drive_board.DriveBoard.check_program`."""
        self._check_beat()
        if not self._is_programmed:
            raise OSError(self._fault or "the wheels were stopped while the program drove")

    def _check_beat(self) -> None:
        if self._end:
            raise OSError(self._end)
        silent_ms = elapsed_ms(self._clock(), self._beaten_ms)
        # Wheels at rest stand still, so the program may take its time.
        if silent_ms >= self._patience_ms and not self._rests:
            raise OSError(f"the car's program has been stuck for {silent_ms} ms")

    def _obey_program(self) -> None:
        if self._is_programmed:
            try:
                self._write_program()
            except OSError as problem:
                self._fail(str(problem))

    def _write_program(self) -> None:
        self._chassis.set(*(_STILL if self._rests else self._wanted))
        if not self._is_programmed:
            # Somebody stopped the wheels while this write hung, and it may have moved them since.
            self._chassis.neutral()

    def _fail(self, reason: str) -> None:
        self._fault = reason
        if self._is_programmed:
            self._is_programmed = False
            with suppress(OSError):
                self._chassis.neutral()

    @contextmanager
    def _locked(self) -> Iterator[None]:
        if not self._lock.acquire(timeout=_PATIENCE_S):
            raise OSError("the car's program hangs in the hardware of its wheels")
        try:
            yield
        finally:
            self._lock.release()
