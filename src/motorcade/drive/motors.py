"""What a car's hardware was commanded and accepted, so that a write that failed is made again."""

from collections.abc import Callable

from motorcade.car.arbiter import MOVING, PROGRAM, STANDING
from motorcade.car.drive_board import DriveBoard

Setpoint = tuple[int, int, int]
NEUTRAL_SETPOINT = (90, 1, 0)


class Wheels:
    """Make a board follow the arbiter's state.

    Args:
        board: its hardware, which is set to neutral. Raises OSError where that fails.

    Attributes:
        faults: how often the board has raised OSError since then.
        last_fault: the reason of the last one.
        is_neutral: whether ``neutral`` is the last command that the board accepted.
        before_moving: called before any command but neutral; where it raises OSError the board gets no command.
    """

    def __init__(self, board: DriveBoard) -> None:
        self.board = board
        self.faults = 0
        self.last_fault = ""
        self.before_moving: Callable[[], None] = lambda: None
        self._is_programmed = False
        board.neutral()
        self.is_neutral = True

    def follow(self, state: int, setpoint: Setpoint) -> bool:
        """Do what ``state`` says, with ``setpoint`` where a command drives. False where the board fails."""
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
                self._stand_still()
        except OSError as problem:
            self.count_fault(problem)
            return False
        return True

    def battery_mv(self) -> int | None:
        """The battery's voltage; None where it is unknown."""
        try:
            return self.board.battery_mv()
        except OSError as problem:
            self.count_fault(problem)
            return None

    def keep_alive(self) -> None:
        """Feed the hardware watchdog, if the board has one."""
        try:
            self.board.keep_alive()
        except OSError as problem:
            self.count_fault(problem)

    def count_fault(self, problem: OSError) -> None:
        """Count a fault, and keep its reason."""
        self.faults += 1
        self.last_fault = str(problem) or type(problem).__name__

    def _stand_still(self) -> None:
        try:
            if self._is_programmed:
                self._end_program()
        finally:
            if not self.is_neutral:
                self.board.neutral()
                self.is_neutral = not self._is_programmed

    def _begin_program(self) -> None:
        self._stand_still()
        self._leave_neutral()
        self._is_programmed = True
        self.board.begin_program()

    def _end_program(self) -> None:
        self.board.end_program()
        self._is_programmed = False

    def _leave_neutral(self) -> None:
        if self.is_neutral:
            self.is_neutral = False
            self.before_moving()
