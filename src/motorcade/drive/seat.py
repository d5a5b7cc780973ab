"""A place at a car that is driven: its holder's words go in here."""

from typing import TYPE_CHECKING

from motorcade.drive.telemetry import Counts
from motorcade.words.ticks import elapsed_ms, later_ms

if TYPE_CHECKING:
    from motorcade.drive.session import CarControl

# The rate is held in each tenth of a second, so that who sends too much drives on, only coarser.
_WINDOW_MS = 100


class ControlSession:
    """One who drives or watches; `CarControl.join` makes it.

    Attributes:
        number: from 1, never given twice.
        name: what others are shown.
        kind: CLIENT or LOCAL.
        counts: what became of its words.
        heard_ms: when it last sent a valid command.
    """

    def __init__(
        self, drive: "CarControl", number: int, name: str, kind: int, now_ms: int, commands_per_s: int, counts: Counts
    ) -> None:
        self.number = number
        self.name = name
        self.kind = kind
        self.counts = counts
        self.heard_ms = now_ms
        self._drive = drive
        # When the last commands came, a ring as long as a window's share of the rate.
        self._times = [later_ms(now_ms, -_WINDOW_MS)] * max(1, commands_per_s * _WINDOW_MS // 1000)
        self._next = 0

    def command(self, word: int) -> int:
        """Take a DRIVE word that came just now.

        Returns:
            APPLIED, or the place of another one in OUTCOMES.

        Raises:
            WordError: it is no DRIVE word; counted.
        """
        return self._drive.command(self, word)

    def request(self) -> bool:
        """Ask for the wheel: True where this seat has it now; else it comes when the driver stands still or leaves."""
        return self._drive.request(self)

    def release(self) -> None:
        """Give the wheel back, or wait for it no longer."""
        self._drive.release(self)

    def stop(self) -> None:
        """Emergency stop: nothing moves until somebody says ``clear``."""
        self._drive.stop()

    def clear(self) -> None:
        """Lift the emergency stop; a command with speed 0 then arms the car."""
        self._drive.clear()

    def resume_program(self) -> None:
        """Let the car run its image again. Raises DriveError where it has none, another drives or it is stopped."""
        self._drive.resume_program(self)

    def leave(self) -> None:
        """Be gone: the wheels stand still if this seat moved them. Again is harmless."""
        self._drive.leave(self)

    def takes(self, now_ms: int) -> bool:
        """Whether one more command now is within the rate; if so it counts."""
        if elapsed_ms(now_ms, self._times[self._next]) < _WINDOW_MS:
            return False
        self._times[self._next] = now_ms
        self._next = (self._next + 1) % len(self._times)
        return True
