"""A stick at the car itself, which has priority over everybody on the network.

A thread reads it, because a device's driver may block and the car's event loop must not. Where that thread hangs no
commands come, and the car's failsafe stops the wheels.
"""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from concurrent.futures import Future
from contextlib import AbstractContextManager, asynccontextmanager

from motorcade.car.arbiter import HALTED, LOCAL, NEEDS_NEUTRAL, WATCHING
from motorcade.drive.input.deadman import (
    CLEAR,
    QUIT,
    RELEASE,
    RESUME,
    STOP,
    CommandStream,
    DeadmanSwitch,
    Reading,
    StickSource,
    stick_word,
)
from motorcade.drive.session import CarControl, ControlSession, DriveError, Who
from motorcade.errors import MotorcadeError, Phrase
from motorcade.timing import monotonic_ms

# A car takes 100 commands a second.
PERIOD_S = 0.02
JOIN_S = 2.0
# Outcomes after which a stick has to be released before it can drive.
_NOT_DONE = (WATCHING, NEEDS_NEUTRAL, HALTED)

Report = Callable[[Phrase | MotorcadeError], None]


class LocalStick:
    """Drive a car by the readings of a device.

    A released stick sends nothing, so others can drive. A stick that is pushed has the wheel until it has been
    released for `motorcade.drive.input.deadman.RESTS_MS`; when it is unplugged the car stands still.

    Args:
        control: the car.
        report: takes a sentence when a device comes or goes, or an order can't be followed.
    """

    def __init__(self, control: CarControl, report: Report) -> None:
        self._control = control
        self._report = report
        self._device: str | None = None
        self._session: ControlSession | None = None
        self._reset()

    def take(self, reading: Reading, now_ms: int) -> None:
        """Do what a reading commands; to be called in each period, less than 100 times a second."""
        reports: list[Phrase | MotorcadeError] = []
        if reading.device != self._device:
            reports += self._change(reading.device)
        if self._session:
            for order in reading.orders:
                try:
                    self._obey(order, self._session)
                except DriveError as problem:
                    reports.append(problem)
            self._steer(reading, self._session, now_ms)
        if reading.notice:
            reports.append(reading.notice)
        # Last, because whoever writes them may block.
        for each in reports:
            self._report(each)

    def leave(self) -> None:
        """End the session: the wheels stand still if the stick moved them."""
        if self._session:
            self._session.leave()
        self._session = self._device = None

    def _reset(self) -> None:
        self._switch = DeadmanSwitch()
        self._stream = CommandStream(self._control.failsafe_ms, rearm=True)

    def _change(self, device: str | None) -> list[Phrase]:
        """Replace one device by another. Returns the sentences that report it."""
        reports = [Phrase("stick-gone", device=self._device)] if self._device else []
        self.leave()
        self._reset()
        if device:
            self._device, self._session = device, self._control.join(f"{device} at the car", Who(kind=LOCAL))
            reports.append(Phrase("stick-connected", device=device))
        return reports

    def _steer(self, reading: Reading, session: ControlSession, now_ms: int) -> None:
        axes = self._switch.update(reading.axes, now_ms)
        if axes is None:
            self._stream.drop()
            if session.drives:
                session.release()
            return
        self._stream.set_word(stick_word(*axes), now_ms)
        word = self._stream.next_word(now_ms)
        if word is not None and session.command(word) in _NOT_DONE:
            self._switch.distrust()

    def _obey(self, order: str, session: ControlSession) -> None:
        """Follow an order. Raises DriveError."""
        if order == STOP:
            session.stop()
        elif order == CLEAR:
            session.clear()
        elif order in (RELEASE, RESUME):
            self._switch.withdraw()
            session.release()
        if order == RESUME:
            session.resume_program()


@asynccontextmanager
async def reading_input(
    control: CarControl,
    opening: AbstractContextManager[StickSource],
    report: Report,
    leave: Callable[[], None],
) -> AsyncIterator[None]:
    """Drive a car by a stick while the block runs. Raises OSError or MotorcadeError where it can't be opened.

    The stick is opened, read and closed in a thread of its own, which also calls ``report`` (see `LocalStick`), and
    ``leave`` when the user of the stick quits.
    """
    opened: Future[None] = Future()
    ended = threading.Event()
    arguments = (LocalStick(control, report), opening, opened, ended, report, leave)
    # A daemon, so that a device's driver that hangs can't keep the process from ending.
    thread = threading.Thread(target=_read, args=arguments, name="stick at the car", daemon=True)
    thread.start()
    try:
        await asyncio.wrap_future(opened)
        yield
    finally:
        ended.set()
        await asyncio.to_thread(thread.join, JOIN_S)


def _read(
    stick: LocalStick,
    opening: AbstractContextManager[StickSource],
    opened: "Future[None]",
    ended: threading.Event,
    report: Report,
    leave: Callable[[], None],
) -> None:
    try:
        with opening as source:
            opened.set_result(None)
            while not ended.wait(PERIOD_S):
                reading = source.read()
                stick.take(reading, monotonic_ms())
                if QUIT in reading.orders:
                    leave()
    except (OSError, MotorcadeError) as problem:
        if opened.done():
            report(Phrase("stick-unreadable", reason=problem))
        else:
            opened.set_exception(problem)
    finally:
        opened.cancel()
        stick.leave()
