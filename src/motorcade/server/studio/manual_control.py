"""Hands on the cars of a page's world: who sits at them, and which are held until somebody gives them back."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from motorcade.boards.simulated_drive import DrivenCars
from motorcade.config.profile import Profile
from motorcade.drive.session import CarControl, DriveError
from motorcade.server.remote.control import LocalControl
from motorcade.server.remote.errors import said
from motorcade.timing import monotonic_ms

_BEAT_S = 0.05


@dataclass(eq=False, slots=True)
class _Held:
    """A car at which somebody sits, or which stands since they left."""

    drive: CarControl
    beating: asyncio.Task[None] | None = None
    sitting: int = 0


class ManualControl:
    """The cars of one world that are driven by hand, or were and have not been told to go on with their program.

    Attributes:
        boards: what the hands do, as the world reads it.
    """

    def __init__(self) -> None:
        self.boards = DrivenCars()
        self._held: dict[int, _Held] = {}

    def sit(self, car: int, profile: Profile, page: str, is_paused: Callable[[], bool]) -> LocalControl:
        """A seat at a car, which runs its program until somebody drives. Raises RemoteError."""
        held = self._held.get(car)
        if held is None:
            held = self._held[car] = _Held(CarControl(self.boards.board(car, has_program=True), monotonic_ms, profile))
            _resume(held.drive)
        seat = LocalControl(held.drive, page, partial(self._left, car), is_paused)
        held.sitting += 1
        if held.beating is None:
            held.beating = asyncio.create_task(_beat(held.drive))
        return seat

    def give_back(self, car: int) -> None:
        """Let a car go on with its program, and lift its emergency stop where nobody sits there who could.

        Raises RemoteError: somebody drives it.
        """
        held = self._held.get(car)
        if held is None:
            return
        if not held.sitting:
            held.drive.clear()
        try:
            _resume(held.drive)
        except DriveError as problem:
            raise said(problem) from None
        self._forget_where_idle(car)

    def give_back_all(self) -> None:
        """Let all cars go on with their program at which nobody sits, but for those that the emergency stop holds."""
        for car, held in list(self._held.items()):
            if not held.sitting and held.drive.telemetry().state != "stopped":
                self.give_back(car)

    def _left(self, car: int) -> None:
        held = self._held[car]
        held.sitting -= 1
        if not held.sitting and held.beating:
            # Nothing becomes due any more: it stands still, or its program drives.
            held.beating.cancel()
            held.beating = None
        self._forget_where_idle(car)

    def _forget_where_idle(self, car: int) -> None:
        held = self._held[car]
        if not held.sitting and held.drive.telemetry().state == "program":
            del self._held[car]


async def _beat(drive: CarControl) -> None:
    while True:
        await asyncio.sleep(min(drive.beat() / 1000, _BEAT_S))


def _resume(drive: CarControl) -> None:
    """Let the car's own program drive. Raises DriveError."""
    nobody = drive.join("program")
    try:
        nobody.resume_program()
    finally:
        nobody.leave()
