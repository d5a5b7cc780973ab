"""What a car's hardware was told and took, so that a write that failed is made again."""

from collections.abc import Callable

from motorcade.car.arbiter import MOVING, PROGRAM, STANDING
from motorcade.car.drive_board import DriveBoard

Setpoint = tuple[int, int, int]
NEUTRAL_SETPOINT = (90, 1, 0)


class Wheels:
    """A board, and what it does by the last word that it took.

    Args:
        board: its hardware; neutral from now on. Raises OSError where that can't be.

    Attributes:
        faults: how often it raised OSError since then.
        last_fault: why, the last time.
        is_neutral: whether it took ``neutral`` last.
        before_moving: called before anything else than neutral; where it raises OSError the board isn't told.
    """

    def __init__(self, board: DriveBoard) -> None:
        self.board = board
        self.faults = 0
        self.last_fault = ""
        self.before_moving: Callable[[], None] = lambda: None
        self.is_neutral = False
        self._is_programmed = False
        board.neutral()
        self.is_neutral = True

    def follow(self, state: int, setpoint: Setpoint) -> bool:
        """Do what ``state`` says, with ``setpoint`` where a command drives: False where the board fails."""
        try:
            if state in (STANDING, MOVING):
                if self._is_programmed:
                    self._end_program()
                self._leave_neutral()
                self.board.apply(*setpoint)
            elif state == PROGRAM and self._is_programmed:
                self.board.check_program()
            elif state == PROGRAM:
                self._begin_program()
            else:
                self.rest()
        except OSError as problem:
            self.note(problem)
            return False
        return True

    def rest(self) -> None:
        """Stand still, if they don't yet. Raises OSError."""
        try:
            if self._is_programmed:
                self._end_program()
        finally:
            if not self.is_neutral:
                self.board.neutral()
                self.is_neutral = not self._is_programmed

    def battery_mv(self) -> int | None:
        """The battery's voltage, or None where it can't be told."""
        try:
            return self.board.battery_mv()
        except OSError as problem:
            self.note(problem)
            return None

    def keep_alive(self) -> None:
        """All is well."""
        try:
            self.board.keep_alive()
        except OSError as problem:
            self.note(problem)

    def _begin_program(self) -> None:
        self.rest()
        self._leave_neutral()
        self._is_programmed = True
        self.board.begin_program()

    def _leave_neutral(self) -> None:
        if self.is_neutral:
            self.is_neutral = False
            self.before_moving()

    def _end_program(self) -> None:
        self.board.end_program()
        self._is_programmed = False

    def note(self, problem: OSError) -> None:
        """Count a fault."""
        self.faults += 1
        self.last_fault = str(problem) or type(problem).__name__
