"""The drive boards of simulated cars, in a world that a page plays or that runs by itself.

A board stores its setpoint at once, from any thread. The world reads it before its next tick.
"""

import threading
import time
from collections.abc import Callable
from typing import Self

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.drive_board import DriveBoard
from motorcade.engine.moment import Moment
from motorcade.engine.simulated_camera import Scene, to_jpeg
from motorcade.engine.simulation import Simulation
from motorcade.engine.world import World
from motorcade.errors import MotorcadeError
from motorcade.words.formats import SWITCHES

NEUTRAL = (90, 1, 0)
# The most time that a world catches up on a busy computer; beyond that simulated time runs slower.
_MAX_LAG_S = 0.25


class SimulatedBoard(DriveBoard):
    """The wheels of one simulated car; each command counts from the next tick on.

    The car's program goes on while somebody drives. When it gets the wheels back, it continues from where it is then.

    Attributes:
        switched_on: the switches that are on; it has all that there are.
        setpoint: the servo's angle, the direction and the duty; None while the car's own program drives.
        read_battery_mv: reads the voltage of a battery in mV; None for none.
        ahead_mm: what the ultrasonic sensor measured before the last ticks.
    """

    switches = tuple(switch.name for switch in SWITCHES)

    def __init__(self, has_program: bool) -> None:
        self.has_program = has_program
        self.switched_on: set[str] = set()
        self.setpoint: tuple[int, int, int] | None = None
        self.read_battery_mv: Callable[[], int] | None = None
        self.ahead_mm = NOTHING_IN_SIGHT_MM

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self.setpoint = (angle_deg, direction, speed)

    def neutral(self) -> None:
        self.setpoint = NEUTRAL

    def set_switch(self, name: str, is_on: bool) -> None:
        (self.switched_on.add if is_on else self.switched_on.discard)(name)

    def battery_mv(self) -> int | None:
        return self.read_battery_mv() if self.read_battery_mv else None

    def obstacle_mm(self) -> int:
        return self.ahead_mm

    def begin_program(self) -> None:
        self.setpoint = None

    def end_program(self) -> None:
        self.setpoint = NEUTRAL


class DrivenCars:
    """The boards of a world's cars by number, each made when it is first asked for."""

    def __init__(self) -> None:
        self._boards: dict[int, SimulatedBoard] = {}

    def board(self, car: int, has_program: bool) -> SimulatedBoard:
        return self._boards.setdefault(car, SimulatedBoard(has_program))

    def driven(self, cars: int) -> list[int]:
        """Return, in order, which of the first ``cars`` somebody drives."""
        return sorted(car for car, board in list(self._boards.items()) if car < cars and board.setpoint is not None)

    def steer(self, world: Simulation) -> None:
        """Pass the boards' setpoints to the world's cars; ignore boards whose car isn't there."""
        for car, board in list(self._boards.items()):
            if car >= world.cars:
                continue
            setpoint = board.setpoint
            if setpoint is None:
                world.give_back(car)
            else:
                world.drive(car, *setpoint)
                board.ahead_mm = world.obstacle_mm(car)


class LiveWorld:
    """Run a world in real time in a thread of its own; a context manager.

    Where a car leaves the plane, 2,147 m around 0, all cars begin again in their places: nobody is there who could
    move it back, and driving goes on.

    Args:
        world: nobody else may step it meanwhile.
        clock_s: a clock in seconds that never goes back.
    """

    def __init__(self, world: World, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._world = world
        self._clock_s = clock_s
        self._driven = DrivenCars()
        self._scene = Scene(world)
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulated world", daemon=True)
        self._at_s = clock_s()
        self._lag_s = 0.0

    def board(self, car: int) -> SimulatedBoard:
        """Return the board of a car. It has a program where it follows, or leads and its image has states."""
        program = sum(self._world.mat.starts.leads[: car + 1]) - 1
        leads = self._world.mat.starts.leads[car]
        images = self._world.images
        return self._driven.board(car, has_program=not leads or images[program % len(images)][0] > 0)

    def advance(self) -> None:
        """Simulate what is due by the clock."""
        now_s = self._clock_s()
        self._lag_s = min(self._lag_s + now_s - self._at_s, _MAX_LAG_S)
        self._at_s = now_s
        ticks = int(self._lag_s * 1000 + 1e-6) // self._world.tick_ms
        self._lag_s -= ticks * self._world.tick_ms / 1000
        if ticks:
            with self._lock:
                self._driven.steer(self._world)
                try:
                    self._world.run(ticks * self._world.tick_ms)
                except MotorcadeError:
                    # The only error of a run of whole ticks: a car has left the plane.
                    self._world.reset()

    def snapshot(self) -> Moment:
        """Return what the cars show now."""
        with self._lock:
            return self._world.snapshot()

    def jpeg(self, car: int) -> bytes:
        """Return a picture of what a car's camera sees now."""
        return to_jpeg(self._scene.draw(self.snapshot(), car))

    def __enter__(self) -> Self:
        """Start time."""
        self._at_s = self._clock_s()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop time."""
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._over.wait(self._world.tick_ms / 1000):
            self.advance()


class SimulatedCamera:
    """The camera of one simulated car, for `motorcade.cameras.broadcast`.

    Args:
        jpeg: returns a picture of what it sees now.
    """

    def __init__(self, jpeg: Callable[[], bytes]) -> None:
        self.jpeg = jpeg

    def close(self) -> None:
        """There is nothing to release."""
