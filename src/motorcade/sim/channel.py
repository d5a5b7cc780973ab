"""Infrared between cars, frame by frame: air time, range, half duplex, collisions.

A frame reaches every car that is within range of its sender when it begins. It
is lost at a receiver that sends at any moment of it, and where another
frame reaches the same receiver at any moment of it, that one is lost too.
"""

from dataclasses import dataclass, field

from motorcade.words.infrared import air_us

SENDING = "sending"
COLLISION = "collision"


@dataclass(slots=True)
class Frame:
    """A frame on the air; ``lost`` says why for each receiver that can't make it out."""

    sender: int
    bits: int
    begin_us: int
    end_us: int
    receivers: list[int]
    lost: dict[int, str] = field(default_factory=dict)


class Channel:
    """The air between ``cars`` cars.

    Args:
        cars: how many there are; they are numbered from 0.
        unit_us: the infrared unit.
    """

    def __init__(self, cars: int, unit_us: int):
        self._unit_us = unit_us
        self._sending: list[Frame | None] = [None] * cars
        self._arriving: list[list[Frame]] = [[] for _ in range(cars)]
        self._on_air: list[Frame] = []

    def is_sending(self, car: int) -> bool:
        """Whether this car's frame is on the air."""
        return self._sending[car] is not None

    def senses_carrier(self, car: int) -> bool:
        """Whether a frame of another car reaches this one."""
        return bool(self._arriving[car])

    def begin(self, sender: int, bits: int, now_us: int, receivers: list[int]) -> None:
        """Car ``sender`` begins a frame that reaches ``receivers``."""
        frame = Frame(sender, bits, now_us, now_us + air_us(bits, self._unit_us), receivers)
        self._sending[sender] = frame
        self._on_air.append(frame)
        for other in self._arriving[sender]:
            other.lost[sender] = SENDING
        for receiver in receivers:
            arriving = self._arriving[receiver]
            if self._sending[receiver] is not None:
                frame.lost[receiver] = SENDING
            for other in arriving:
                other.lost.setdefault(receiver, COLLISION)
                frame.lost.setdefault(receiver, COLLISION)
            arriving.append(frame)

    def ended(self, now_us: int) -> list[Frame]:
        """The frames that ended by ``now_us``, first those that ended first; they are off the air then."""
        over = sorted((frame for frame in self._on_air if frame.end_us <= now_us), key=lambda f: (f.end_us, f.sender))
        for frame in over:
            self._on_air.remove(frame)
            self._sending[frame.sender] = None
            for receiver in frame.receivers:
                self._arriving[receiver].remove(frame)
        return over
