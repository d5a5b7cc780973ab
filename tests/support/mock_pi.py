"""A Raspberry Pi on gpiozero's mock pins: its pin files, the state of its pins, and a clock that a test sets."""

import threading

from motorcade.boards import lines
from motorcade.car.brain import NO_VOICE
from motorcade.car.check.checked_board import BoardObserver
from motorcade.words.infrared import air_us, frame_durations_us, to_frame

HEAD = 'format = "motorcade-pins/1"\nname = "Car"\nchip = "raspberry-pi"\n'
DUTIES = "[duties]\ndrive = [0, 51, 102, 255]\nturn = [0, 17, 34, 85]\n"
ENABLED = (
    """
[left_motor]
forward = 5
backward = 6
enable = 12
[right_motor]
forward = 16
backward = 26
enable = 13
"""
    + DUTIES
)
LEDS = "[leds]\nled_0 = 17\nled_1 = 27\nled_2 = 22\nled_3 = 10\n"
SENSORS = (
    "[ultrasonic]\ntrigger = 23\necho = 24\n[pir]\noutput = 25\n[floor]\nleft = 20\nright = 21\n"
    "[infrared]\nreceiver = 4\nsender = 18\n"
)
STEERED = "[drive_motor]\nforward = 5\nbackward = 6\nenable = 12\n[servo]\nsignal = 19\n"
LEFT_MOTOR, RIGHT_MOTOR = (5, 6, 12), (16, 26, 13)
LEDS_AT = (17, 27, 22, 10)
RECEIVER, PIR = 4, 25
FORWARD_1_S = to_frame(0xE4800000)


class PiClock:
    """A clock in seconds that only a test moves."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self._lock = threading.Lock()

    def __call__(self) -> float:
        return self.now_s

    def advance(self, duration_s: float) -> None:
        """Move the clock, from any thread."""
        with self._lock:
            self.now_s += duration_s

    def wait_ms(self, duration_ms: int) -> None:
        self.advance(duration_ms / 1000)


class PiLine(lines.WaitingLine):
    """A line for uploads: bytes to the car, and its answers."""

    def __init__(self) -> None:
        self.sent = b""
        self.answered = b""

    def read(self) -> bytes:
        data, self.sent = self.sent, b""
        return data

    def write(self, data: bytes) -> None:
        self.answered += data


class Sender:
    """An infrared sender that notes its frames; it is busy for a frame's length, or for as long as a test says."""

    ended_s = 0.0
    busy = False
    closed = False

    def __init__(self, clock: PiClock) -> None:
        self.frames: list[int] = []
        self._clock = clock

    def send(self, frame: int) -> None:
        self.frames.append(frame)
        self.ended_s = self._clock() + air_us(frame, 560) / 1e6

    def is_sending(self) -> bool:
        return self.busy or self._clock() < self.ended_s

    def close(self) -> None:
        self.closed = True


def shown(pins, numbers):
    """Return the state of the pins, or a PWM's duty, of 255."""
    return tuple(round(pins.pin(number).state * 255, 3) for number in numbers)


def wheels(pins):
    return shown(pins, LEFT_MOTOR), shown(pins, RIGHT_MOTOR)


def pulse_us(pins, pin=19):
    return round(pins.pin(pin).state / pins.pin(pin).frequency * 1e6, 6)


def beam(clock, pins, frame, unit_us=560):
    """Send a frame to the receiver, whose output is low while there is carrier."""
    pin = pins.pin(RECEIVER)
    for at, duration_us in enumerate(frame_durations_us(frame, unit_us)):
        (pin.drive_high if at % 2 else pin.drive_low)()
        clock.now_s += duration_us / 1e6
    pin.drive_high()


class Voice:
    """Words that a test says."""

    def __init__(self) -> None:
        self.words: list[int] = []

    def __call__(self) -> int:
        return self.words.pop(0) if self.words else NO_VOICE


class LineObserver(BoardObserver):
    """What a board without pins sends, and words spoken to it."""

    def __init__(self, line: PiLine, voice: Voice) -> None:
        self.line = line
        self.voice = voice

    def written_bytes(self):
        data, self.line.answered = self.line.answered, b""
        return data

    def speak(self, voice):
        self.voice.words.append(voice)
        return True


class PiObserver(LineObserver):
    """The mock pins of a Raspberry Pi, with the parts that its pin file (``wired``) names."""

    def __init__(self, line, voice, wired, pins, sender):
        super().__init__(line, voice)
        self.wired = wired
        self.pins = pins
        self.sender = sender
        self.sent = 0
        self.leds = [led for led in range(4) if wired.pin("leds", f"led_{led}") is not None]
        self.turns_on_the_spot = not wired.has("servo")

    def level(self, part, key):
        number = self.wired.pin(part, key)
        return 0 if number is None else self.pins.pin(number).state

    def power(self, part):
        enable = 1 if self.wired.pin(part, "enable") is None else self.level(part, "enable")
        return (self.level(part, "forward") - self.level(part, "backward")) * enable

    def wheels(self):
        if self.wired.has("servo"):
            power = self.power("drive_motor")
            # 1500 µs is straight on; the inner wheel of a full turn, 500 µs more (left) or less, stands still.
            lean = (pulse_us(self.pins, self.wired.pin("servo", "signal")) - 1500) / 1000
            return power * (1 - max(lean, 0)), power * (1 - max(-lean, 0))
        if not self.wired.has("left_motor"):
            return None
        return self.power("left_motor"), self.power("right_motor")

    def lit_leds(self):
        return [led for led in self.leds if self.level("leds", f"led_{led}")]

    def sent_frames(self):
        if self.wired.pin("infrared", "sender") is None:
            return None
        new, self.sent = self.sender.frames[self.sent :], len(self.sender.frames)
        return new

    def put_obstacle(self, distance_mm):
        return None

    def drive(self, part, key, is_high):
        """Drive an input of the car, if it has that."""
        number = self.wired.pin(part, key)
        if number is not None:
            (self.pins.pin(number).drive_high if is_high else self.pins.pin(number).drive_low)()
        return number is not None

    def show_carrier(self, is_on):
        return self.drive("infrared", "receiver", not is_on)

    def show_floor(self, dark):
        return self.drive("floor", "left", dark & 1) and self.drive("floor", "right", dark & 2)

    def show_person(self, is_there):
        return self.drive("pir", "output", is_there)
