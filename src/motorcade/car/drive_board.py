"""The contract of a drivable car's hardware: a motor and a steering servo.

Portable. A board for new hardware derives from DriveBoard and overrides what the hardware has. Two threads may call its
methods, one at a time; only ``neutral`` may also be called while another method hangs.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Sequence


class DriveBoard:
    """One drivable car's hardware. Every method may raise OSError: the car then stops until the method works again.

    A car that holds a codeword image runs it from the moment it is switched on, whoever drives: its LED, infrared and
    uploads go on. Only its wheels obey the driver.

    Attributes:
        has_program: whether the image can drive the car; an upload may change it.
        switches: the names of those of `motorcade.words.formats` that it has.
    """

    has_program = False
    switches: "tuple[str, ...]" = ()

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        """Steer and drive.

        Args:
            angle_deg: of the servo, 0 to 180; 90 is the centre, less is right.
            direction: 1 forward, 0 backward.
            speed: PWM duty, 0 to 255.
        """
        raise OSError("this board has no wheels: override apply")

    def neutral(self) -> None:
        """Stop the wheels and centre the steering, at once."""
        raise OSError("this board has no wheels: override neutral")

    def battery_mv(self) -> int | None:
        """Return the battery's voltage in mV; None where nothing measures it."""
        return None

    def obstacle_mm(self) -> int | None:
        """Return the distance to the nearest obstacle ahead, without waiting; None where the car has no such sensor.

        A sensor that finds nothing gives a distance that no obstacle has, such as
        `motorcade.car.board.NOTHING_IN_SIGHT_MM`.
        """
        return None

    def set_switch(self, name: str, is_on: bool) -> None:
        """Switch something on or off; only what is in ``switches``."""

    def begin_program(self) -> None:
        """Give the wheels to the codeword image, at its present state. Called only where ``has_program`` is true."""

    def check_program(self) -> None:
        """Raise OSError where the image drives the wheels and its program has ended or hangs; it must never wait.

        Called every 50 ms or more often while the image drives: nothing else would stop the wheels then.
        """

    def end_program(self) -> None:
        """Take the wheels from the codeword image; ``neutral`` or ``apply`` follows at once."""

    def keep_alive(self) -> None:
        """Reset a hardware watchdog. Called every 50 ms or more often as long as nothing is wrong."""

    def rescue(self) -> "tuple[str, Sequence[str]] | None":
        """Return what another process has to call to stop the wheels when this process has ended.

        Returns:
            ``"module:function"`` and its arguments, which are strings; None where the hardware stops by itself.
        """
        return None

    def close(self) -> None:
        """Stop, and release the hardware."""
        self.neutral()
