"""A simulated board: what a car's loop sees of its world."""

from typing import Protocol

from motorcade.car.board import Board, make_levels
from motorcade.profile import Profile
from motorcade.sim.channel import Channel


class Surroundings(Protocol):
    """What a board needs of the world around it; ``voice`` is what every car hears in this tick."""

    seed: int
    levels: tuple[int, ...]
    now_ms: int
    voice: int
    channel: Channel

    def obstacle_mm(self, car: int) -> int:
        """Distance from the front of ``car`` to what its ultrasonic cone touches first."""

    def sees_person(self, car: int) -> bool:
        """Whether somebody stands in the PIR sector of ``car``."""

    def note(self, car: int, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        """Take what the loop of ``car`` tells of."""


def levels_of(profile: Profile) -> tuple[int, ...]:
    """The profile's integers for the brain."""
    infrared = profile.infrared
    return make_levels(
        profile.durations_ms,
        profile.dwell_ms,
        profile.avoid_radii_mm,
        profile.idle_state_ms,
        infrared.unit_us,
        infrared.gap_ms,
        infrared.relay_period_ms,
        infrared.sense_ms,
    )


class SimulatedBoard(Board):
    """The board of car ``index`` in ``world``.

    ``direction``, ``speed_level`` and ``led`` are what the car set last.
    """

    def __init__(self, world: Surroundings, index: int, image: bytes | None):
        self._world = world
        self._image = image
        self.index = index
        self.number = (world.seed * 1_000_003 + index) & 0xFFFFFFFF
        self.is_leader = image is not None
        self.levels = world.levels
        self.direction = 0
        self.speed_level = 0
        self.led = 4
        self.outbox: int | None = None
        self.inbox: list[int] = []

    def now_ms(self) -> int:
        return self._world.now_ms

    def load_image(self) -> bytes | None:
        return self._image

    def received_frames(self) -> list[int]:
        frames, self.inbox = self.inbox, []
        return frames

    def senses_carrier(self) -> bool:
        return self._world.channel.senses_carrier(self.index)

    def is_sending(self) -> bool:
        return self._world.channel.is_sending(self.index)

    def send_frame(self, frame: int) -> None:
        self.outbox = frame

    def obstacle_mm(self) -> int:
        return self._world.obstacle_mm(self.index)

    def sees_person(self) -> bool:
        return self._world.sees_person(self.index)

    def heard_voice(self) -> int:
        return self._world.voice

    def set_wheels(self, direction: int, speed_level: int) -> None:
        self.direction = direction
        self.speed_level = speed_level

    def set_led(self, which: int) -> None:
        self.led = which

    def note(self, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        self._world.note(self.index, kind, at_ms, word, detail)
