"""The wheels of simulated cars as the boards that drivers steer: of a world in play, or of one that goes on by itself.

A board only notes what it is told, from any thread and at once. The world obeys before its next tick.
"""

import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from motorcade.cameras.simulated import Scene, to_jpeg
from motorcade.car.drive_board import DriveBoard
from motorcade.engine.moment import Moment
from motorcade.engine.world import World, warm_up
from motorcade.runs.recording import Description

Setpoint = tuple[int, int, int]
NEUTRAL: Setpoint = (90, 1, 0)
# What a busy computer may owe a world; more is lost, and simulated time runs slower.
_MOST_OWED_S = 0.25


class SimulatedBoard(DriveBoard):
    """The wheels of one simulated car.

    Its program goes on while somebody drives, with its infrared, and has the wheels again where it has come to by then.

    Attributes:
        setpoint: the servo's angle, the direction and the duty that are wanted; None: the car's own program drives.
    """

    def __init__(self, has_program: bool) -> None:
        self.has_program = has_program
        self.setpoint: Setpoint | None = None

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        """Steer and drive from the next tick on."""
        self.setpoint = (angle_deg, direction, speed)

    def neutral(self) -> None:
        """Stand still with straight wheels from the next tick on."""
        self.setpoint = NEUTRAL

    def begin_program(self) -> None:
        """Let the car's own program have the wheels."""
        self.setpoint = None

    def end_program(self) -> None:
        """Take the wheels from the car's own program."""
        self.setpoint = NEUTRAL


class DrivenCars:
    """The boards of a world's cars, by number; made when somebody wants to drive."""

    def __init__(self) -> None:
        self._boards: dict[int, SimulatedBoard] = {}

    def board(self, car: int, has_program: bool) -> SimulatedBoard:
        """The board of a car."""
        return self._boards.setdefault(car, SimulatedBoard(has_program))

    def held(self, cars: int) -> list[int]:
        """Those of the first ``cars`` whose wheels their own program doesn't have, in order."""
        return sorted(car for car, board in list(self._boards.items()) if car < cars and board.setpoint is not None)

    def steer(self, world: World) -> None:
        """Let the world's cars do what their boards were told; a board whose car isn't there has to wait."""
        for car, board in list(self._boards.items()):
            if car >= world.cars:
                continue
            setpoint = board.setpoint
            if setpoint is None:
                world.give_back(car)
            else:
                world.drive(car, *setpoint)


class LiveWorld:
    """A world that goes on in real time, in a thread of its own; use it as a context manager.

    Args:
        world: one world, which nobody else steps meanwhile.
        clock_s: seconds that only grow.
    """

    def __init__(self, world: World, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._world = world
        self._clock_s = clock_s
        self._driven = DrivenCars()
        self._scene = Scene(Description.of(world, world.tick_ms))
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._go_on, name="simulated world", daemon=True)
        self._at_s = clock_s()
        self._owed_s = 0.0
        self.cars = world.cars

    def board(self, car: int) -> SimulatedBoard:
        """The wheels of a car. It has a program where it follows, or leads with some states of its own."""
        program = int(self._world.mat.starts.leads[: car + 1].sum()) - 1
        leads, images = bool(self._world.mat.starts.leads[car]), self._world.images
        return self._driven.board(car, has_program=not leads or images[program % len(images)][0] > 0)

    def advance(self) -> None:
        """Simulate what is due by the clock."""
        now_s = self._clock_s()
        self._owed_s = min(self._owed_s + now_s - self._at_s, _MOST_OWED_S)
        self._at_s = now_s
        ticks = int(self._owed_s * 1000 + 1e-6) // self._world.tick_ms
        self._owed_s -= ticks * self._world.tick_ms / 1000
        if ticks:
            with self._lock:
                self._driven.steer(self._world)
                self._world.run(ticks * self._world.tick_ms)

    def snapshot(self) -> Moment:
        """What the cars show now."""
        with self._lock:
            return self._world.snapshot()

    def picture(self, car: int) -> NDArray[np.uint8]:
        """What a car's camera sees now: (height, width, 3), red, green and blue."""
        return self._scene.draw(self.snapshot(), car)

    def __enter__(self) -> Self:
        """Let time go on, once all is compiled: a car whose world waits for that looks stuck."""
        warm_up(self._world)
        self._at_s = self._clock_s()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let time stand still."""
        self._over.set()
        self._thread.join()

    def _go_on(self) -> None:
        while not self._over.wait(self._world.tick_ms / 1000):
            self.advance()


class SimulatedCamera:
    """The camera of one car of a live world, as `motorcade.cameras.broadcast` wants cameras."""

    def __init__(self, world: LiveWorld, car: int) -> None:
        self._world = world
        self._car = car

    def jpeg(self) -> bytes:
        """What it sees now."""
        return to_jpeg(self._world.picture(self._car))

    def close(self) -> None:
        """There is nothing to give up."""
