"""A Linux car that somebody drives and that runs its own program, in one process.

The program runs in a thread of its own, whoever drives: its states, LED, infrared and uploads go on. The wheels obey
either the driver or the program.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from gpiozero import OutputDevice

from motorcade.boards.computer import TICK_S, Equipment, HardwareWatchdog
from motorcade.boards.linux.chassis import Chassis, open_chassis
from motorcade.boards.linux.gpio_chip import HardwareError
from motorcade.boards.linux.infrared import LircSender
from motorcade.boards.linux.raspberry_pi import RaspberryPi, open_pins, rescue_call
from motorcade.car.brain import FORWARD
from motorcade.car.drive_board import DriveBoard
from motorcade.car.loop import Car
from motorcade.config.pins import PinMap
from motorcade.config.profile import Profile
from motorcade.words.formats import HEADER, SWITCHES
from motorcade.words.packing import bytes_to_words
from motorcade.words.ticks import elapsed_ms

# Longer than a write to healthy hardware takes, short enough for an emergency stop to wait.
_LOCK_TIMEOUT_S = 0.05
_STILL = (FORWARD, 0)
# `motorcade.car.drive_board.DriveBoard.check_program` is called at least this often.
_CHECK_PERIOD_MS = 50
_JOIN_TIMEOUT_S = 1.0


class SharedWheels(DriveBoard):
    """The wheels of a car that is driven and programmed.

    The program's thread calls the methods for the program. Its last setpoint is stored, and written to the wheels
    while it has them. Any other thread may call the methods for the driver; they stop the wheels even where the
    program's thread hangs in their hardware.

    Args:
        chassis: the wheels.
        clock: the time in ms that wraps at 2^30 (`motorcade.words.ticks`).
        max_silence_ms: a program without a ``heartbeat`` for so long must not drive.
    """

    def __init__(self, chassis: Chassis, clock: Callable[[], int], max_silence_ms: int) -> None:
        self._chassis = chassis
        self._clock = clock
        self._max_silence_ms = max_silence_ms
        self._lock = threading.Lock()
        self._setpoint = _STILL
        self._is_paused = False
        self._is_programmed = False
        self._fault: OSError | None = None
        self._end: OSError | None = None
        self._heartbeat_ms = clock()

    # For the program

    def set(self, direction: int, speed_level: int) -> None:
        """Set what the program asks for; arguments as of `motorcade.car.board.Board.set_wheels`."""
        with self._lock:
            self._setpoint = (direction, speed_level)
            self._follow_program()

    def heartbeat(self) -> None:
        """Note that the program is alive."""
        self._heartbeat_ms = self._clock()

    def fail(self, problem: OSError, is_over: bool = False) -> None:
        """Stop the wheels where the program has them; `check_program` then raises ``problem``.

        Args:
            problem: why the program can't control the wheels.
            is_over: whether it never will again.
        """
        with self._lock:
            if is_over:
                self._end = problem
            self._fail(problem)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Stop a program's wheels while the block runs, which may take long. No heartbeat is due meanwhile."""
        with self._lock:
            self._is_paused = True
            self._follow_program()
        try:
            yield
        finally:
            with self._lock:
                self.heartbeat()
                self._is_paused = False
                self._follow_program()

    # For the driver

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        """Take the wheels from the program and drive."""
        self._is_programmed = False
        with self._locked():
            self._chassis.apply(angle_deg, direction, speed)

    def neutral(self) -> None:
        """Take the wheels from the program and stop them, also while a write of the program hangs."""
        self._is_programmed = False
        is_locked = self._lock.acquire(timeout=_LOCK_TIMEOUT_S)
        try:
            self._chassis.neutral()
        finally:
            if is_locked:
                self._lock.release()

    def begin_program(self) -> None:
        """Give the program the wheels. Raises OSError where it is dead or hangs, or the hardware fails."""
        self._check_heartbeat()
        with self._locked():
            self._fault = None
            self._is_programmed = True
            self._write_program()

    def end_program(self) -> None:
        """Take the wheels from the program; ``neutral`` or ``apply`` has to follow."""
        self._is_programmed = False

    def check_program(self) -> None:
        """Raise OSError where the program doesn't control the wheels."""
        self._check_heartbeat()
        if not self._is_programmed:
            raise self._fault.with_traceback(None) if self._fault else HardwareError("wheels-stopped")

    def _check_heartbeat(self) -> None:
        if self._end:
            raise self._end.with_traceback(None)
        silent_ms = elapsed_ms(self._clock(), self._heartbeat_ms)
        # Paused wheels stand still, so the program may take its time.
        if silent_ms >= self._max_silence_ms and not self._is_paused:
            raise HardwareError("program-stuck", silent_ms=silent_ms)

    def _follow_program(self) -> None:
        if self._is_programmed:
            try:
                self._write_program()
            except OSError as problem:
                self._fail(problem)

    def _write_program(self) -> None:
        self._chassis.set(*(_STILL if self._is_paused else self._setpoint))
        if not self._is_programmed:
            # The driver stopped the wheels while this write hung, and the write may have moved them since.
            self._chassis.neutral()

    def _fail(self, problem: OSError) -> None:
        self._fault = problem
        if self._is_programmed:
            self._is_programmed = False
            with suppress(OSError):
                self._chassis.neutral()

    @contextmanager
    def _locked(self) -> Iterator[None]:
        if not self._lock.acquire(timeout=_LOCK_TIMEOUT_S):
            raise HardwareError("program-hangs-in-wheels")
        try:
            yield
        finally:
            self._lock.release()


class ProgrammedDrive(SharedWheels):
    """A car that is driven and programmed: two motors, or one motor and a servo.

    Its program runs from now on, and its wheels stand still.

    Args:
        equipment, pins, profile, factory, sender: as for RaspberryPi. The observer of ``equipment`` gets faults of the
            program too, as kind ``fault``.
        watchdog: gets a sign of life as long as all is well, and is disarmed at the end; None for none.
        gpio_chip: that of ``factory``, as for `open_gpio`.
    """

    def __init__(
        self,
        equipment: Equipment,
        pins: PinMap,
        profile: Profile,
        factory: Any,
        sender: LircSender | None = None,
        watchdog: HardwareWatchdog | None = None,
        gpio_chip: int | None = None,
    ) -> None:
        self._watchdog = watchdog
        self._has_ultrasonic = pins.has("ultrasonic")
        self._rescue = rescue_call(pins, gpio_chip)
        self._resources = ExitStack()
        if watchdog is not None:
            self._resources.callback(watchdog.close)
        self._resources.callback(factory.close)
        chassis = open_chassis(pins, profile, factory, self._resources)
        self._switches = {
            each.name: self._resources.enter_context(OutputDevice(pins.pin(each.name, "signal"), pin_factory=factory))
            for each in SWITCHES
            if pins.has(each.name)
        }
        self.switches = tuple(self._switches)
        limit_ms = profile.drive.watchdog_ms
        max_silence_ms = max(limit_ms // 2, limit_ms - _CHECK_PERIOD_MS)
        self._equipment = equipment
        super().__init__(chassis, equipment.now_ms, max_silence_ms)
        self._board = RaspberryPi(replace(equipment, save=self._save), pins, profile, factory, sender, self)
        self.has_program = self._has_program(equipment.image)
        self._last_fault = ""
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="car program", daemon=True)
        self._thread.start()

    def set_switch(self, name: str, is_on: bool) -> None:
        self._switches[name].value = is_on

    def battery_mv(self) -> int | None:
        return self._equipment.battery_mv()

    def obstacle_mm(self) -> int | None:
        return self._board.obstacle_mm() if self._has_ultrasonic else None

    def keep_alive(self) -> None:
        if self._watchdog is not None:
            self._watchdog.keep_alive()

    def rescue(self) -> tuple[str, tuple[str, ...]]:
        return self._rescue

    def close(self) -> None:
        self._ended.set()
        with self._resources, ExitStack() as cleanup:
            # Once more after the program has ended: it may have moved the wheels since.
            cleanup.callback(self.neutral)
            cleanup.callback(self._board.close)
            cleanup.callback(self._thread.join, _JOIN_TIMEOUT_S)
            self.neutral()

    def _run(self) -> None:
        car = Car(self._board)
        try:
            while not self._ended.is_set():
                self._equipment.line.wait(TICK_S)
                self._tick(car)
        except Exception as problem:  # noqa: BLE001 - whatever it is, the driver can drive on and sees the fault
            fault = HardwareError("program-ended", kind=type(problem).__name__, reason=problem)
            self.fail(fault, is_over=True)
            self._report(str(fault))

    def _tick(self, car: Car) -> None:
        fault = None
        try:
            car.tick()
        except OSError as problem:
            fault = problem
        self.heartbeat()
        if fault:
            self.fail(fault)
        # The same fault may come with each tick.
        text = str(fault) if fault else ""
        if text and text != self._last_fault:
            self._report(text)
        self._last_fault = text

    def _report(self, fault: str) -> None:
        self._equipment.observe("fault", self._equipment.now_ms(), 0, fault)

    def _save(self, data: bytes) -> None:
        """Store an image, which takes seconds on a worn card; the program can't control the wheels meanwhile."""
        with self.paused():
            self._equipment.save(data)
        self.has_program = self._has_program(data)

    def _has_program(self, image: bytes | None) -> bool:
        """Return whether a car with that image can drive by it; a follower drives by what it hears."""
        if not self._equipment.is_leader:
            return True
        return image is not None and HEADER.decode(bytes_to_words(image)[0]).leader_states > 0


def open_drive(
    equipment: Equipment,
    pins: PinMap,
    profile: Profile,
    gpio_chip: int | None = None,
    watchdog: Path | None = None,
) -> ProgrammedDrive:
    """Open the board of a car that somebody drives, and that words drive when the driver gives them the wheels.

    ``watchdog`` is the device of a hardware watchdog, None to use none. Raises what `open_car` raises.
    """
    factory, sender = open_pins(equipment, pins, profile, gpio_chip)
    armed = HardwareWatchdog(watchdog) if watchdog else None
    return ProgrammedDrive(equipment, pins, profile, factory, sender, armed, gpio_chip)
