"""The contract of a board: all that the loop of a car needs from its hardware.

Portable. A board for new hardware derives from Board and overrides what the hardware has. A method that isn't
overridden is a sensor that finds nothing, or an actuator that isn't there.
"""

# For the type checker alone: MicroPython has no such module.
MYPY = False
if MYPY:
    from collections.abc import Callable

from motorcade.car.brain import VOICE_GO, VOICE_STOP
from motorcade.car.senses import NOTHING, Senses
from motorcade.words.receiver import MOST_WORDS

NOTHING_IN_SIGHT_MM = NOTHING.obstacle_mm
# The spoken words that a car knows, by the names that files and people use.
VOICE_WORDS = (("stop", VOICE_STOP), ("go", VOICE_GO))


def make_levels(
    durations_ms: tuple[int, ...],
    dwells_ms: tuple[int, ...],
    avoid_radii_mm: tuple[int, ...],
    idle_state_ms: int,
    infrared: tuple[int, ...],
) -> tuple[int, ...]:
    """Return the profile's integers in the order that `motorcade.car.brain` lists.

    Args:
        durations_ms, dwells_ms, avoid_radii_mm: the 4, 8 and 4 levels of the profile.
        idle_state_ms: the length of a state in which nothing has a duration.
        infrared: the profile's keys unit_us, gap_ms, relay_period_ms, sense_ms, first_interval_ms, last_interval_ms,
            redundancy and forget_ms.
    """
    if len(durations_ms) != 4 or len(dwells_ms) != 8 or len(avoid_radii_mm) != 4 or len(infrared) != 8:
        raise ValueError("a profile has 4 durations, 8 dwells, 4 avoidance radii and 8 figures for infrared")
    return tuple(durations_ms) + tuple(dwells_ms) + tuple(avoid_radii_mm) + (idle_state_ms,) + tuple(infrared)


class Board:
    """One car's hardware.

    Attributes:
        number: the car's own number, 0 to 2^32 - 1; seeds its random draws.
        is_leader: whether this car leads or follows.
        levels: what make_levels gave for the car's profile.
        most_words: how many words the largest image has that the board can store, 12 to 511.
        words_a_tick: how many words of an upload one tick checks at most, 1 or more; on a slow chip a small number
            keeps ticks short.
        bytes_a_tick: how many bytes of answers one tick writes at most; few where writing waits for a slow line.
        name: what the car is called; empty where nobody has named it.
        kind: the kind of board in one word, such as esp32; empty where it has none.
        version: of Motorcade on the board; empty where it is unknown.
        sender: a number that changes with each new sender at the serial line, where the line knows: what the one
            before left unfinished is dropped.
    """

    number = 0
    is_leader = False
    levels: tuple[int, ...] = ()
    most_words = MOST_WORDS
    words_a_tick = MOST_WORDS
    bytes_a_tick = 4 * MOST_WORDS
    name = ""
    kind = ""
    version = ""
    sender = 0

    def now_ms(self) -> int:
        """Return the clock's reading: milliseconds that wrap at 2^30."""
        raise OSError("this board has no clock: override now_ms")

    def load_image(self) -> bytes | None:
        """Return the stored image's bytes; None where no image was ever stored."""
        return None

    def store_image(self, data: bytes) -> None:
        """Store ``data`` so that after a power cut the store holds the whole old image or the whole new one.

        Raises OSError.
        """

    def read_serial(self) -> bytes:
        """Return the bytes that came since the last call, ``b""`` for none. Never wait."""
        return b""

    def write_serial(self, data: bytes) -> None:
        """Send ``data`` over the serial line."""

    def answer_requests(self, answer: "Callable[[bytes], bytes]") -> bool:
        """Answer requests that came beside the serial line, as those of others in a network do; a slow chip one a call.

        ``answer`` takes the bytes of a request and returns those of its answer. Return whether there was one.
        """
        return False

    def needs_rest(self) -> bool:
        """Return whether work waits that takes a slow chip tenths of a second, such as a handshake of TLS."""
        return False

    def work_at_rest(self) -> None:
        """Do some of that work; the wheels stand meanwhile."""

    def store_name(self, name: str) -> None:
        """Keep ``name`` as the car's, also while the power is off. Raises OSError where the board can't."""
        raise OSError("this board keeps no name")

    def battery_mv(self) -> int | None:
        """Return the battery's voltage in mV; None where nothing measures it. Raises OSError."""
        return None

    def read_inputs(self, part: str) -> int:
        """Return the digital inputs of ``part``, a table of a pin file, as bits: the first one the lowest.

        0 where the part isn't there. The methods of simple sensors below read by it.
        """
        return 0

    # Written by scripts/generate.py from motorcade.devices; don't edit.

    def set_wheels(self, direction: int, speed_level: int) -> None:
        """Drive forward (0) or turn on the spot, left (1) or right (2), at level 0 (stop) to 3."""

    def set_led(self, which: int) -> None:
        """Light LED 0 to 3 and no other; 4 for none."""

    def obstacle_mm(self) -> int:
        """Return the distance to the nearest obstacle ahead; NOTHING_IN_SIGHT_MM for none."""
        return NOTHING_IN_SIGHT_MM

    def heard_voice(self) -> int:
        """Return the voice command since the last call: NO_VOICE, VOICE_STOP or VOICE_GO of `motorcade.car.brain`."""
        return 0

    def sees_person(self) -> bool:
        """Return whether the PIR sensor detects somebody."""
        return self.read_inputs("pir") > 0

    def dark_floor(self) -> int:
        """Return which floor sensors are over dark floor: 1 for the left one plus 2 for the right one."""
        return self.read_inputs("floor")

    def received_frames(self) -> list[int] | tuple[int, ...]:
        """Return the 32-bit infrared frames that ended since the last call, in order.

        The board doesn't check their parity.
        """
        return ()

    def senses_carrier(self) -> bool:
        """Return whether other cars send infrared here now."""
        return False

    def is_sending(self) -> bool:
        """Return whether this car sends a frame now."""
        return False

    def send_frame(self, frame: int) -> None:
        """Begin to send 32 bits by infrared; called only while nothing is being sent."""

    def senses(self, looks_mm: int) -> Senses:
        """Read all sensors; with ``looks_mm`` 0 no obstacle matters and the ultrasonic sensor stays off."""
        return Senses(
            self.obstacle_mm() if looks_mm else NOTHING_IN_SIGHT_MM,
            1 if self.sees_person() else 0,
            self.dark_floor(),
        )

    # End of the section.

    def note(self, kind: str, at_ms: int, word: int, detail: int | str) -> None:
        """Report an event to observers; hardware may ignore it.

        Args:
            kind: image (one was stored), state, start, over, frame, heard or lost.
            at_ms: when it happened.
            word: the word; the number of bytes for ``image``.
            detail: a state's index, the tag of a word that starts (0: bare), or why a frame was lost: parity, reserved,
                check or deaf.
        """
