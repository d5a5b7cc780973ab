"""A Linux car that somebody drives and that runs the words it holds, in one process.

The brain goes on in a thread of its own whoever drives, with its states, its LED, its infrared and its uploads;
`motorcade.boards.linux.shared_wheels` says whom the wheels obey.
"""

import threading
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

from motorcade.boards.linux.board import TICK_S, Equipment
from motorcade.boards.linux.hardware_watchdog import HardwareWatchdog
from motorcade.boards.linux.raspberry_pi import InfraredSender, RaspberryPi, RaspberryPiDrive
from motorcade.boards.linux.shared_wheels import SharedWheels
from motorcade.car.loop import Car
from motorcade.config.pins import PinMap
from motorcade.config.profile import Profile
from motorcade.words.formats import HEADER
from motorcade.words.image import bytes_to_words

# How often `motorcade.car.drive_board.DriveBoard.check_program` is called at least.
_CHECKED_EVERY_MS = 50
_GOODBYE_S = 1.0


class ProgrammedDrive(RaspberryPiDrive):
    """A car that is driven and programmed. It is switched on from now on, and stands still.

    Args:
        equipment: what every Linux car has; it observes faults of the program too, as kind ``fault``.
        sender: of infrared, None for none; closed with the board.
        pins, profile, factory, watchdog, rescue: as for RaspberryPiDrive.

    Raises:
        MotorcadeError: the pin file names no wheels.
    """

    def __init__(
        self,
        equipment: Equipment,
        pins: PinMap,
        profile: Profile,
        factory: Any,
        sender: InfraredSender | None = None,
        watchdog: HardwareWatchdog | None = None,
        rescue: tuple[str, tuple[str, ...]] | None = None,
    ) -> None:
        super().__init__(pins, profile, factory, watchdog, rescue)
        limit_ms = profile.drive.watchdog_ms
        patience_ms = max(limit_ms // 2, limit_ms - _CHECKED_EVERY_MS)
        self._equipment = equipment
        self._wheels = SharedWheels(self._chassis, equipment.now_ms, patience_ms)
        self._board = RaspberryPi(replace(equipment, save=self._save), pins, profile, factory, sender, self._wheels)
        self.has_program = self._runs(equipment.image)
        self._last_fault = ""
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="car program", daemon=True)
        self._thread.start()

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self._wheels.apply(angle_deg, direction, speed)

    def neutral(self) -> None:
        self._wheels.neutral()

    def begin_program(self) -> None:
        self._wheels.begin_program()

    def check_program(self) -> None:
        self._wheels.check_program()

    def end_program(self) -> None:
        self._wheels.end_program()

    def close(self) -> None:
        self._ended.set()
        with ExitStack() as rest:
            rest.callback(super().close)
            rest.callback(self._board.close)
            rest.callback(self._thread.join, _GOODBYE_S)
            self.neutral()

    def _run(self) -> None:
        car = Car(self._board)
        try:
            while not self._ended.is_set():
                self._equipment.line.wait(TICK_S)
                self._tick(car)
        except Exception as problem:  # noqa: BLE001 - whatever it is, the driver drives on and is told
            fault = f"the car's program has ended by {type(problem).__name__}: {problem}; serve the car anew"
            self._wheels.fail(fault, is_over=True)
            self._tell(fault)

    def _tick(self, car: Car) -> None:
        fault = ""
        try:
            car.tick()
        except OSError as problem:
            fault = str(problem)
        self._wheels.beat()
        if fault:
            self._wheels.fail(fault)
        # It may come with each tick.
        if fault and fault != self._last_fault:
            self._tell(fault)
        self._last_fault = fault

    def _tell(self, fault: str) -> None:
        self._equipment.observe("fault", self._equipment.now_ms(), 0, fault)

    def _save(self, data: bytes) -> None:
        """Keep an image, which on a worn card takes seconds; no word sees to the wheels meanwhile."""
        with self._wheels.at_rest():
            self._equipment.save(data)
        self.has_program = self._runs(data)

    def _runs(self, image: bytes | None) -> bool:
        """Whether a car with that image drives; a follower does by what it hears."""
        if not self._equipment.is_leader:
            return True
        return image is not None and HEADER.decode(bytes_to_words(image)[0]).leader_states > 0
