"""Parts of a car: two motors, an ultrasonic sensor and the image in the flash of a chip, and sources of voice input.

Portable.
"""

# For the type checker alone: MicroPython has no typing.
MYPY = False
if MYPY:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Any, Protocol

    class Drivable(Protocol):
        """A motor of any kind of car; ``drive`` as Motor's."""

        def drive(self, duty: int) -> None: ...


from binascii import crc32

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import FORWARD, LEFT, NO_VOICE, RIGHT, VOICE_STOP
from motorcade.words.ticks import TICKS_MASK, elapsed_ms

PWM_HZ = 1000
_FULL = 65535
_DUTY_MAX = 255
# All echoes of a ping have faded after this time, also where no obstacle is near.
PING_EVERY_MS = 60
# An older distance is no longer true for a moving car.
STALE_MS = 3 * PING_EVERY_MS
_TRIGGER_US = 10
# Sound travels 343 m/s at 20 °C, there and back.
_MM_PER_2000_US = 343
NEW = ".new"
_CHECKSUM_BYTES = 4


class Motor:
    """One motor behind an L298-style driver: two direction pins and a PWM.

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


class MotorPair:
    """The left and the right motor of a car.

    Args:
        left, right: motors with a method ``drive`` as Motor's.
        drive_duties, turn_duties: duties for speed levels 0 to 3, straight on and turning on the spot.
        percents: the share of its duty that each motor gets.
    """

    def __init__(
        self,
        left: "Drivable",
        right: "Drivable",
        drive_duties: "Sequence[int]",
        turn_duties: "Sequence[int]",
        percents: "Sequence[int]",
    ) -> None:
        self._left = left
        self._right = right
        self._percents = percents
        self._duties = ((FORWARD, drive_duties, 1, 1), (LEFT, turn_duties, -1, 1), (RIGHT, turn_duties, 1, -1))

    def set(self, direction: int, speed_level: int) -> None:
        """Turn the wheels; arguments as of `motorcade.car.board.Board.set_wheels`."""
        for known, duties, left, right in self._duties:
            if known == direction:
                left_percent, right_percent = self._percents
                self._left.drive(left * (duties[speed_level] * left_percent // 100))
                self._right.drive(right * (duties[speed_level] * right_percent // 100))


class Ultrasonic:
    """An HC-SR04 that is read without waiting: interrupts time the echo, and the last distance measured is the answer.

    Args:
        machine, clock: MicroPython's modules machine and time.
        pins: ``trigger`` and ``echo``, GPIO numbers.
        range_mm: a distance beyond it counts as nothing in sight.
        interrupt: further arguments of machine.Pin.irq, such as ``{"hard": True}`` where the chip has that.
    """

    def __init__(
        self, machine: "Any", clock: "Any", pins: "Mapping[str, int]", range_mm: int, interrupt: "dict[str, bool]"
    ) -> None:
        self._clock = clock
        self._range_mm = range_mm
        self._trigger = machine.Pin(pins["trigger"], machine.Pin.OUT, value=0)
        self._rose_us = 0
        self._width_us = 0
        self._has_pinged = False
        self._has_answer = False
        self._pinged_ms = 0
        self._distance_mm = NOTHING_IN_SIGHT_MM
        echo = machine.Pin(pins["echo"], machine.Pin.IN)
        echo.irq(self._take_edge, machine.Pin.IRQ_RISING | machine.Pin.IRQ_FALLING, **interrupt)

    def _take_edge(self, pin: "Any") -> None:
        """Note when the echo began and ended. Runs as an interrupt: short, and without allocation."""
        if pin.value():
            self._rose_us = self._clock.ticks_us()
        elif self._rose_us:
            self._width_us = (self._clock.ticks_us() - self._rose_us) & TICKS_MASK
            self._rose_us = 0

    def distance_mm(self) -> int:
        """Return the last distance to an obstacle; NOTHING_IN_SIGHT_MM where none was measured lately.

        Ping where that is due. The first distance is known a few ms after the first call.
        """
        now_ms = self._clock.ticks_ms()
        waited_ms = elapsed_ms(now_ms, self._pinged_ms)
        if self._width_us:
            distance_mm = self._width_us * _MM_PER_2000_US // 2000
            self._distance_mm = distance_mm if distance_mm <= self._range_mm else NOTHING_IN_SIGHT_MM
            self._width_us = 0
            self._has_answer = True
        if not self._has_pinged or waited_ms >= PING_EVERY_MS:
            if not self._has_answer or waited_ms >= STALE_MS:
                self._distance_mm = NOTHING_IN_SIGHT_MM
            self._ping(now_ms)
        return self._distance_mm

    def is_measuring(self) -> bool:
        """Return whether an echo may be on its way: its interrupt must not be late."""
        if not self._has_pinged or self._width_us:
            return False
        return elapsed_ms(self._clock.ticks_ms(), self._pinged_ms) < PING_EVERY_MS and not self._has_answer

    def _ping(self, now_ms: int) -> None:
        self._has_pinged = True
        self._pinged_ms = now_ms
        self._has_answer = False
        self._trigger.value(1)
        self._clock.sleep_us(_TRIGGER_US)
        self._trigger.value(0)


class SerialVoice:
    """A module that recognises words by itself, such as one with an LD3320, and reports them over a UART.

    Args:
        read: returns the bytes that came since the last call, ``b""`` for none; never waits.
        patterns: pairs of the bytes that the module sends and the voice that they mean.
            No pattern contains another (`motorcade.config.pins` checks that).
    """

    def __init__(self, read: "Callable[[], bytes]", patterns: "Sequence[tuple[bytes, int]]") -> None:
        self._read = read
        self._patterns = patterns
        self._longest = max([len(pattern) for pattern, voice in patterns])
        self._recent = b""

    def heard_voice(self) -> int:
        """Return what was heard since the last call: NO_VOICE, VOICE_STOP or VOICE_GO; VOICE_STOP where both were.

        Bytes that match no pattern are ignored.
        """
        data = self._read()
        latest = NO_VOICE
        for i in range(len(data)):
            self._recent = (self._recent + data[i : i + 1])[-self._longest :]
            for pattern, voice in self._patterns:
                if self._recent.endswith(pattern):
                    self._recent = b""
                    if latest != VOICE_STOP:
                        latest = voice
                    break
        return latest


class ImageFile:
    """An image in a file, and its CRC-32 behind it: a chip checks that much faster than each word.

    A cut of power at any byte leaves the old image or the new one, whole.

    Args:
        path: of the file; while an image is written there is a second file beside it.
        files: MicroPython's module os.
        open_file: the function open.
    """

    def __init__(self, path: str, files: "Any", open_file: "Callable[..., Any]") -> None:
        self._path = path
        self._files = files
        self._open = open_file

    def load(self) -> bytes | None:
        """Return the image's bytes, None where there is no whole image."""
        # A FAT file system removes the old file before it renames the new one: in between there is only the new one.
        for path in (self._path, self._path + NEW):
            try:
                with self._open(path, "rb") as file:
                    data: bytes = file.read()
            except OSError:
                continue
            image = data[:-_CHECKSUM_BYTES]
            if image and data[-_CHECKSUM_BYTES:] == _checksum(image):
                return image
        return None

    def save(self, data: bytes) -> None:
        """Replace the image. Raises OSError; the old image is kept then."""
        new = self._path + NEW
        try:
            with self._open(new, "wb") as file:
                file.write(data + _checksum(data))
            self._sync()
            self._files.rename(new, self._path)
            self._sync()
        except OSError:
            # Otherwise a full flash would stay full.
            self._remove(new)
            raise

    def _sync(self) -> None:
        # Ports without sync write at once.
        if hasattr(self._files, "sync"):
            self._files.sync()

    def _remove(self, path: str) -> None:
        try:
            self._files.remove(path)
        except OSError:
            pass


def _checksum(data: bytes) -> bytes:
    return crc32(data).to_bytes(_CHECKSUM_BYTES, "big")
