"""The contract of a board: all that the loop of a car asks of the hardware under it.

Portable. A board for new hardware derives from Board and overrides what it has;
what it doesn't override is a sensor that finds nothing or an actuator that isn't there.
"""

from motorcade.car.brain import VOICE_GO, VOICE_STOP

NOTHING_IN_SIGHT_MM = 1 << 20
# The spoken words that a car knows, by the names that files and people use.
VOICE_WORDS = (("stop", VOICE_STOP), ("go", VOICE_GO))


def make_levels(
    durations_ms: tuple[int, ...],
    dwells_ms: tuple[int, ...],
    avoid_radii_mm: tuple[int, ...],
    idle_state_ms: int,
    unit_us: int,
    gap_ms: int,
    relay_period_ms: int,
    sense_ms: int,
) -> tuple[int, ...]:
    """The profile's integers in the order that `motorcade.car.brain` reads them: 4, 8, 4 and five single ones."""
    if len(durations_ms) != 4 or len(dwells_ms) != 8 or len(avoid_radii_mm) != 4:
        raise ValueError("a profile has 4 durations, 8 dwells and 4 avoidance radii")
    singles = (idle_state_ms, unit_us, gap_ms, relay_period_ms, sense_ms)
    return tuple(durations_ms) + tuple(dwells_ms) + tuple(avoid_radii_mm) + singles


class Board:
    """One car's hardware.

    Attributes:
        number: the car's own number, 0 to 2^32 - 1; seeds its random draws.
        is_leader: whether this car leads or follows.
        levels: what make_levels gave for the car's profile.
    """

    number = 0
    is_leader = False
    levels: tuple[int, ...] = ()

    def now_ms(self) -> int:
        """The clock: milliseconds that wrap at 2^30."""
        raise OSError("this board has no clock: override now_ms")

    def load_image(self) -> bytes | None:
        """The stored image's bytes, or None where none was ever stored."""
        return None

    def store_image(self, data: bytes) -> None:
        """Keep ``data`` so that a cut of power leaves the old image or this one, whole. Raises OSError."""

    def read_serial(self) -> bytes:
        """The bytes that came since the last call; ``b""`` for none. Never waits."""
        return b""

    def write_serial(self, data: bytes) -> None:
        """Send ``data`` to whoever is at the other end of the serial line."""

    def received_frames(self) -> list[int] | tuple[int, ...]:
        """The 32-bit infrared frames that ended since the last call, parity unchecked, in order."""
        return ()

    def senses_carrier(self) -> bool:
        """Whether infrared of other cars is on the air around this one."""
        return False

    def is_sending(self) -> bool:
        """Whether this car's own frame is on the air."""
        return False

    def send_frame(self, frame: int) -> None:
        """Begin to send 32 bits by infrared; called only while nothing is being sent."""

    def obstacle_mm(self) -> int:
        """Distance to the nearest obstacle ahead."""
        return NOTHING_IN_SIGHT_MM

    def sees_person(self) -> bool:
        """Whether the PIR sensor sees somebody."""
        return False

    def heard_voice(self) -> int:
        """What was said since the last call: NO_VOICE, VOICE_STOP or VOICE_GO of `motorcade.car.brain`."""
        return 0

    def set_wheels(self, direction: int, speed_level: int) -> None:
        """Drive forward (0) or turn on the spot, left (1) or right (2), at level 0 (stand still) to 3."""

    def set_led(self, which: int) -> None:
        """Light LED 0 to 3 and no other; 4 for none."""

    def note(self, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        """Something happened that an observer may want to know; real hardware needn't care.

        ``kind`` is image (one was taken; ``word`` is its number of bytes), state,
        start, over, frame, heard or lost; ``detail`` is a state's index, or why a
        frame was lost: parity, reserved or deaf.
        """
