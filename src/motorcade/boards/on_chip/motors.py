"""Two motors behind an L298-style driver: two direction pins and a PWM for each.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Mapping, Sequence
    from typing import Any, Protocol

    class Drivable(Protocol):
        """A motor of any kind of car; ``drive`` as Motor's."""

        def drive(self, duty: int) -> None: ...


from motorcade.car.brain import FORWARD, LEFT, RIGHT

PWM_HZ = 1000
_FULL = 65535
_DUTY_MAX = 255


class Motor:
    """One motor.

    Args:
        machine: MicroPython's module.
        pins: ``forward``, ``backward`` and, where the driver has it, ``enable``; GPIO numbers.
            Without ``enable`` the PWM is on the direction pins.
    """

    def __init__(self, machine: "Any", pins: "Mapping[str, int]") -> None:
        directions = [machine.Pin(pins[key], machine.Pin.OUT, value=0) for key in ("forward", "backward")]
        pulsed = directions
        self._directions: list[Any] = []
        if "enable" in pins:
            pulsed = [machine.Pin(pins["enable"], machine.Pin.OUT, value=0)]
            self._directions = directions
        self._pulsed = [machine.PWM(pin, freq=PWM_HZ, duty_u16=0) for pin in pulsed]

    def drive(self, duty: int) -> None:
        """Turn forward with ``duty`` 1 to 255 of full power, backward with -1 to -255; with 0 the motor coasts."""
        share = abs(duty) * _FULL // _DUTY_MAX
        if not self._directions:
            forward, backward = self._pulsed
            forward.duty_u16(share if duty > 0 else 0)
            backward.duty_u16(share if duty < 0 else 0)
            return
        # Never both at once, and no power while they change.
        self._pulsed[0].duty_u16(0)
        forward, backward = self._directions
        forward.value(0)
        backward.value(0)
        if duty > 0:
            forward.value(1)
        if duty < 0:
            backward.value(1)
        self._pulsed[0].duty_u16(share)


class Wheels:
    """The left and the right motor of a car.

    Args:
        left, right: motors with a method ``drive`` as Motor's.
        drive_duties, turn_duties: duties for speed levels 0 to 3, straight on and turning on the spot.
    """

    def __init__(
        self, left: "Drivable", right: "Drivable", drive_duties: "Sequence[int]", turn_duties: "Sequence[int]"
    ) -> None:
        self._left = left
        self._right = right
        self._duties = ((FORWARD, drive_duties, 1, 1), (LEFT, turn_duties, -1, 1), (RIGHT, turn_duties, 1, -1))

    def set(self, direction: int, speed_level: int) -> None:
        """Turn the wheels; arguments as of `motorcade.car.board.Board.set_wheels`."""
        for known, duties, left, right in self._duties:
            if known == direction:
                self._left.drive(left * duties[speed_level])
                self._right.drive(right * duties[speed_level])
