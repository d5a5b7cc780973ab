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

    A car that holds a codeword image runs it from being switched on, whoever drives, with its LED, its infrared and
    its uploads. Only its wheels obey somebody else meanwhile.

    Attributes:
        has_program: whether the image has something to drive by; an upload may change it.
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
        """Give the wheels to the codeword image, where it has come to by now. Called only where ``has_program``."""

    def check_program(self) -> None:
        """Raise OSError where the image has the wheels and what runs it is dead or hangs: nobody else would stop them.

        Called every 50 ms or more often while the image has the wheels. Never waits.
        """

    def end_program(self) -> None:
        """Take the wheels from the codeword image; ``neutral`` or ``apply`` follows at once."""

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
