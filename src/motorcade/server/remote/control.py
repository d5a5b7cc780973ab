"""A page's seat at a car, as the cockpit uses it, wherever the car is."""

from collections.abc import Callable
from typing import Any, Protocol

from motorcade.drive.input.deadman import stick_word
from motorcade.drive.session import CarControl, DriveError
from motorcade.server.remote.errors import said


class PageControl(Protocol):
    """One page at one car. What is asked of a car may take a moment, and raises ServerError where the car says no."""

    def steer(self, throttle: float, steering: float) -> None:
        """Where the stick is now, both axes -1 to 1; a car that can't be reached stands still."""

    async def request(self) -> None:
        """Ask for the wheel."""

    async def release(self) -> None:
        """Give the wheel back, or wait for it no longer."""

    async def stop(self) -> None:
        """Emergency stop."""

    async def clear(self) -> None:
        """Lift the emergency stop."""

    async def resume_program(self) -> None:
        """Let the car's own program drive again."""

    def told(self) -> dict[str, Any]:
        """What the car tells, as `motorcade.drive.wire.Telemetry` names it, and beside that

        ``you`` (whether this page ``drives`` and ``waits``, and its counts), ``paused`` (its world stands still),
        ``silent_ms`` (since the car was last heard of) and ``why`` (in each language why its state is ``away``, or
        None).
        """

    def leave(self) -> None:
        """Be gone: the wheels stand still if this page moved them."""


class LocalControl:
    """A seat at a car of this process.

    Args:
        drive: the car.
        name: what the page is called there.
        left: called when the seat is given back.
        is_paused: whether the car's world stands still.

    Raises:
        RemoteError: all seats are taken.
    """

    def __init__(
        self,
        drive: CarControl,
        name: str,
        left: Callable[[], None] = lambda: None,
        is_paused: Callable[[], bool] = lambda: False,
    ) -> None:
        self._drive = drive
        self._name = name
        self._left = left
        self._is_paused = is_paused
        try:
            self._seat = drive.join(name)
        except DriveError as problem:
            raise said(problem) from None

    def steer(self, throttle: float, steering: float) -> None:
        """As `PageControl.steer`."""
        self._seat.command(stick_word(throttle, steering))

    async def request(self) -> None:
        """As `PageControl.request`."""
        self._seat.request()

    async def release(self) -> None:
        """As `PageControl.release`."""
        self._seat.release()

    async def stop(self) -> None:
        """As `PageControl.stop`."""
        self._seat.stop()

    async def clear(self) -> None:
        """As `PageControl.clear`."""
        self._seat.clear()

    async def resume_program(self) -> None:
        """As `PageControl.resume_program`."""
        try:
            self._seat.resume_program()
        except DriveError as problem:
            raise said(problem) from None

    def told(self) -> dict[str, Any]:
        """As `PageControl.told`."""
        told = self._drive.telemetry()
        you = {"drives": self._seat.drives, "waits": told.wanted_by == self._name}
        more = {"paused": self._is_paused(), "silent_ms": 0, "why": None}
        return told._asdict() | more | {"you": you | self._seat.counts.as_dict()}

    def leave(self) -> None:
        """As `PageControl.leave`."""
        self._seat.leave()
        self._left()
