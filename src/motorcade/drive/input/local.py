"""A stick at the car itself, which comes before everybody on the network: its readings drive by a seat of its own.

No thread and no clock in here: `motorcade.drive.input.feeding` brings both.
"""

from collections.abc import Callable

from motorcade.car.arbiter import HALTED, LOCAL, NEEDS_NEUTRAL, WATCHING
from motorcade.drive.command_stream import CommandStream
from motorcade.drive.drive_failures import DriveError
from motorcade.drive.input.deadman import CLEAR, RELEASE, RESUME, STOP, DeadmanSwitch, Reading
from motorcade.drive.input.stick import stick_word
from motorcade.drive.session import CarControl, ControlSession

# What the car did not do, a hand that goes on pushing no longer wants.
_NOT_DONE = (WATCHING, NEEDS_NEUTRAL, HALTED)


class LocalStick:
    """Drives a car by what a device at it says.

    A stick at rest sends nothing, so others drive. One that is pushed has the wheel until it has been at rest for
    `motorcade.drive.input.deadman.RESTS_MS`; one that vanishes leaves a car that stands.

    Args:
        drive: the car.
        say: takes a sentence when a device comes or goes, or an order can't be followed.
    """

    def __init__(self, drive: CarControl, say: Callable[[str], None]) -> None:
        self._drive = drive
        self._say = say
        self._device: str | None = None
        self._seat: ControlSession | None = None
        self._hand = DeadmanSwitch()
        self._helm = CommandStream(drive.failsafe_ms, rearm=True)

    def take(self, reading: Reading, now_ms: int) -> None:
        """Do what the device says; to be called again and again, fewer than 100 times a second."""
        sentences = self._change(reading.device) if reading.device != self._device else []
        if self._seat:
            for order in reading.orders:
                sentences += self._obey(order, self._seat)
            self._steer(reading, self._seat, now_ms)
        if reading.notice:
            sentences.append(str(reading.notice))
        # Last, since who writes them may have to wait.
        for each in sentences:
            self._say(each)

    def leave(self) -> None:
        """Nobody drives by it any more: the wheels stand still if it moved them."""
        if self._seat:
            self._seat.leave()
        self._seat = self._device = None

    def _change(self, device: str | None) -> list[str]:
        """Let one device go and another one come: the sentences that tell of it."""
        told = [f"{self._device} is gone"] if self._device else []
        self.leave()
        self._hand, self._helm = DeadmanSwitch(), CommandStream(self._drive.failsafe_ms, rearm=True)
        if device:
            self._device, self._seat = device, self._drive.join(f"{device} at the car", LOCAL)
            told.append(f"{device} is there: it drives this car before everybody on the network")
        return told

    def _steer(self, reading: Reading, seat: ControlSession, now_ms: int) -> None:
        wish = self._hand.wish(reading.axes, now_ms)
        if wish is None:
            self._helm.drop()
            if self._drive.drives(seat):
                seat.release()
            return
        self._helm.wish(stick_word(*wish), now_ms)
        word = self._helm.next_word(now_ms)
        if word is not None and seat.command(word) in _NOT_DONE:
            self._hand.distrust()

    def _obey(self, order: str, seat: ControlSession) -> list[str]:
        """Follow an order: a sentence where that can't be."""
        if order == STOP:
            seat.stop()
        elif order == CLEAR:
            seat.clear()
        elif order in (RELEASE, RESUME):
            self._hand.withdraw()
            seat.release()
        try:
            if order == RESUME:
                seat.resume_program()
        except DriveError as problem:
            return [str(problem)]
        return []
