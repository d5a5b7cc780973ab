"""The contract of a drivable car's hardware: a motor and a steering servo.

Portable. A board for new hardware derives from DriveBoard and overrides what it
has. Its methods may be called from two threads, one at a time; only ``neutral``
may also come while another of them hangs.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Sequence


class DriveBoard:
    """One drivable car's hardware. Every method may raise OSError: the car then stands still until it works again.

    Attributes:
        has_program: whether the board holds a codeword image that it can run by itself.
    """

    has_program = False

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        """Steer and drive.

        Args:
            angle_deg: of the servo, 0 to 180; 90 is the centre, below it is right.
            direction: 1 forward, 0 backward.
            speed: PWM duty, 0 to 255.
        """
        raise OSError("this board has no wheels: override apply")

    def neutral(self) -> None:
        """Stop the wheels and centre the steering, at once."""
        raise OSError("this board has no wheels: override neutral")

    def battery_mv(self) -> int | None:
        """The battery's voltage in mV; None where nothing measures it."""
        return None

    def begin_program(self) -> None:
        """Let the codeword image drive, from its beginning where it stood still. Called only where ``has_program``."""

    def end_program(self) -> None:
        """Keep the codeword image from driving; ``neutral`` or ``apply`` follows at once."""

    def keep_alive(self) -> None:
        """All is well: for a hardware watchdog. Called every 50 ms or more often, until something is wrong."""

    def rescue(self) -> "tuple[str, Sequence[str]] | None":
        """What another process shall call to make the wheels stand still once this process is dead.

        Returns:
            ``"module:function"`` and its arguments, texts; None where the hardware stops by itself.
        """
        return None

    def close(self) -> None:
        """Neutral, and the hardware is free for others."""
        self.neutral()
