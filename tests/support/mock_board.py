"""Boards in memory, like gpiozero's mock pins: a test sets clock and sensors, and reads what the car does."""

import time
from collections.abc import Callable

from motorcade.car.board import NOTHING_IN_SIGHT_MM, Board
from motorcade.car.drive_board import DriveBoard
from motorcade.config.profile import Profile, built_in_profile, levels_of
from motorcade.drive.session import CarControl
from motorcade.words.formats import SWITCHES

CLASSROOM = built_in_profile("classroom")
NEUTRAL = (90, 1, 0)
SWITCH_NAMES = tuple(switch.name for switch in SWITCHES)


class MockBoard(Board):
    """A car that runs words.

    Attributes:
        clock_ms: what the clock shows.
        image: what is stored; None for nothing.
        coming: bytes that the car reads at its next tick.
        answers: all bytes that it has written.
        carrier: whether another car sends infrared.
        wheels, led: what was set last.
        noted: all notes, each as (time, kind, word, detail).
    """

    levels = levels_of(CLASSROOM)

    def __init__(self, image: bytes | None = None, number: int = 0, *, is_leader: bool = True) -> None:
        self.number, self.is_leader = number, is_leader
        self.clock_ms = 0
        self.image = image
        self.coming = self.answers = b""
        self.carrier = False
        self.wheels, self.led = (0, 0), 4
        self.noted: list[tuple[int, str, int, int | str]] = []

    def now_ms(self) -> int:
        return self.clock_ms

    def load_image(self) -> bytes | None:
        return self.image

    def store_image(self, data: bytes) -> None:
        self.image = data

    def read_serial(self) -> bytes:
        data, self.coming = self.coming, b""
        return data

    def write_serial(self, data: bytes) -> None:
        self.answers += data

    def senses_carrier(self) -> bool:
        return self.carrier

    def set_wheels(self, direction: int, speed_level: int) -> None:
        self.wheels = (direction, speed_level)

    def set_led(self, which: int) -> None:
        self.led = which

    def note(self, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        self.noted.append((at_ms, kind, word, detail))


class MockDriveBoard(DriveBoard):
    """A car that is driven.

    Attributes:
        calls: all calls that move the wheels or hand them over: ("apply", angle, direction, speed), ("neutral",),
            ("begin",) and ("end",).
        notes: each setpoint with its time, ``(seconds of the clock, (angle, direction, speed))``.
        switched: each switch with its new state.
        is_broken: whether those calls fail.
        voltage_mv, ahead_mm: what the sensors read; ahead_mm below 0 is a sensor that fails.
        fed: how often the hardware watchdog was reset.
    """

    def __init__(
        self,
        clock: Callable[[], float] = time.perf_counter,
        *,
        has_program: bool = False,
        switches: tuple[str, ...] = SWITCH_NAMES,
    ) -> None:
        self.has_program, self.switches = has_program, switches
        self.calls: list[tuple[str | int, ...]] = []
        self.notes: list[tuple[float, tuple[int, int, int]]] = []
        self.switched: list[tuple[str, bool]] = []
        self.is_broken = False
        self.voltage_mv: int | None = None
        self.ahead_mm: int | None = NOTHING_IN_SIGHT_MM if has_program else None
        self.fed = 0
        self._clock = clock

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        setpoint = (angle_deg, direction, speed)
        self._call("apply", *setpoint)
        self.notes.append((self._clock(), setpoint))

    def neutral(self) -> None:
        self._call("neutral")
        self.notes.append((self._clock(), NEUTRAL))

    def battery_mv(self) -> int | None:
        return self.voltage_mv

    def obstacle_mm(self) -> int | None:
        if self.ahead_mm is not None and self.ahead_mm < 0:
            raise OSError("the sensor is broken")
        return self.ahead_mm

    def set_switch(self, name: str, is_on: bool) -> None:
        self.switched.append((name, is_on))

    def begin_program(self) -> None:
        self._call("begin")

    def end_program(self) -> None:
        self._call("end")

    def keep_alive(self) -> None:
        self.fed += 1

    def _call(self, *call: str | int) -> None:
        if self.is_broken:
            raise OSError("the cable is out")
        self.calls.append(call)

    @property
    def setpoint(self) -> tuple[int, int, int]:
        """The last setpoint."""
        return self.notes[-1][1]

    @property
    def applied(self) -> list[tuple[str | int, ...]]:
        """The setpoints of commands, without the stops that the car made by itself."""
        return [call[1:] for call in self.calls if call[0] == "apply"]

    @property
    def angles(self) -> list[str | int]:
        """The angles of commands that were executed."""
        return [setpoint[0] for setpoint in self.applied]

    @property
    def moves(self) -> bool:
        return self.setpoint[2] > 0

    def was_told(self, setpoint: tuple[int, int, int], since: int = 0) -> bool:
        """Whether this setpoint came, after the first ``since`` records."""
        return any(told == setpoint for _, told in self.notes[since:])

    def has_moved(self, since: int = 0) -> bool:
        """Whether the wheels have turned, after the first ``since`` records."""
        return any(setpoint[2] for _, setpoint in self.notes[since:])


class MockCar:
    """A car on a mock board, whose clock the test sets: ``board``, ``now_ms`` and ``control``."""

    def __init__(self, profile: Profile = CLASSROOM, board: DriveBoard | None = None) -> None:
        self.board = board or MockDriveBoard(has_program=True)
        self.now_ms = 0
        self.control = CarControl(self.board, lambda: self.now_ms, profile)

    @property
    def state(self) -> str:
        return self.control.telemetry().state
