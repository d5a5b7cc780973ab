"""A Raspberry Pi on gpiozero's mock pins: its pin files, the state of its pins, and a clock that a test sets."""

from motorcade.words.infrared import air_us, frame_durations_us, to_frame

HEAD = 'format = "motorcade-pins/1"\nname = "Car"\nchip = "raspberry-pi"\n'
ENABLED = """
[left_motor]
forward = 5
backward = 6
enable = 12
[right_motor]
forward = 16
backward = 26
enable = 13
[duties]
drive = [0, 51, 102, 255]
turn = [0, 17, 34, 85]
"""
LEDS = "[leds]\nled_0 = 17\nled_1 = 27\nled_2 = 22\nled_3 = 10\n"
SENSORS = "[ultrasonic]\ntrigger = 23\necho = 24\n[pir]\noutput = 25\n[infrared]\nreceiver = 4\nsender = 18\n"
STEERED = "[drive_motor]\nforward = 5\nbackward = 6\nenable = 12\n[servo]\nsignal = 19\n"
LEFT_MOTOR, RIGHT_MOTOR = (5, 6, 12), (16, 26, 13)
LEDS_AT = (17, 27, 22, 10)
RECEIVER, PIR = 4, 25
FORWARD_1_S = to_frame(0xE4800000)


class Clock:
    """A clock in seconds that only a test moves."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


class Line:
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

    def __init__(self, clock: Clock) -> None:
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
