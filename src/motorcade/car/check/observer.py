"""What a board's outputs really did and what its sensors really got: an observer shows it to `check_board`.

Portable. An observer for new hardware derives from BoardObserver and overrides what something beside the board can
show: mock pins, an encoder, a second car's receiver, the other end of the serial line.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Sequence


class BoardObserver:
    """Shows what a board really did; a method that isn't overridden is something that nobody observes.

    No method may ask the board itself, since a mistake of the board would then show nowhere. None may wait.

    Attributes:
        within_ms: how late an output may be seen. An encoder sees a motor later than a mock pin sees its level.
        turns_on_the_spot: whether one wheel turns back while the car turns; False for a car that steers.
        leds: the LEDs that the car has.
    """

    within_ms = 100
    turns_on_the_spot = True
    leds: "Sequence[int]" = (0, 1, 2, 3)

    def wheels(self) -> "tuple[float, float] | None":
        """Return how fast the left and the right wheel turn now; None for a car without wheels.

        Positive is forward, 0 is still. Any unit will do, such as mm/s, percent of power or counts of an encoder.
        """
        return None

    def lit_leds(self) -> "Sequence[int]":
        """Return the numbers of the LEDs that are lit now."""
        return ()

    def sent_frames(self) -> "Sequence[int] | None":
        """Return the 32-bit frames that the emitter has sent since the last call; None for a car without emitter.

        A frame may be given when it begins or when it ends.
        """
        return None

    def written_bytes(self) -> bytes:
        """Return the bytes that left the serial line since the last call."""
        return b""

    def put_obstacle(self, distance_mm: int) -> "int | None":
        """Put an obstacle ``distance_mm`` ahead, or take it away for NOTHING_IN_SIGHT_MM.

        Returns:
            how far away the obstacle really is, in mm, and NOTHING_IN_SIGHT_MM for none; one that can't be moved stays
            where it is. None for a car without that sensor.
        """
        return None

    def show_carrier(self, is_on: bool) -> bool:
        """Switch the infrared of another car on or off at the receiver; return False for a car without receiver."""
        return False

    def show_person(self, is_there: bool) -> bool:
        """Let a person be near, or nobody; return False for a car without that sensor."""
        return False

    def speak(self, voice: int) -> bool:
        """Say a word, VOICE_STOP or VOICE_GO of `motorcade.car.brain`; return False for a car that can't hear."""
        return False

    def cut_power(self) -> None:
        """Throw away all that the store has not yet written for good, as a power failure does.

        ``reopen`` of `check_board` is called after it.
        """
