"""Cars with infrared in one hall, which all hear each other."""

from dataclasses import dataclass, field

from motorcade.car import brain, decisions, frames, next_wakeup, step
from motorcade.car.senses import NOTHING
from motorcade.config.profile import built_in_profile, levels_of
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words

LEVELS = levels_of(built_in_profile("classroom"))
FORGET_MS = LEVELS[brain.FORGET_MS]
DWELL_MS = 8000
# As a car on a computer ticks (`motorcade.boards.computer.TICK_S`).
TICK_MS = 4
WORDS = tuple(CONTROL.encode(accept_ir=1, forward=1, led_which=led, led_duration=3) for led in range(4))
QUIET_WORD = CONTROL.encode(accept_ir=1, led_which=1, led_duration=3)


def image(words=WORDS, tagged=1):
    return image_words(Image((0x40000000,), tuple(words), 7, tagged))


@dataclass
class RadioCar:
    """A car with infrared and nothing else; ``began`` lists when it began which word with which tag."""

    number: int
    image: tuple[int, ...] = ()
    levels: tuple[int, ...] = LEVELS
    memory: list[int] = field(default_factory=lambda: [0] * brain.SIZE)
    decisions: bytearray = field(default_factory=lambda: bytearray(decisions.SIZE))
    arriving: list[int] = field(default_factory=list)
    busy: int = 0
    sent: int | None = None
    began: list[tuple[int, int, int]] = field(default_factory=list)

    @property
    def leads(self):
        return bool(self.image)

    def switch_on(self, now):
        brain.switch_on(self.memory, self.number, now)
        if self.leads:
            step.begin_program(self, now)

    def note(self, kind, at_ms, word, detail):
        if kind == step.START:
            self.began.append((at_ms, word, detail))

    def note_end(self):
        pass

    notes_flow = 0

    def note_flow(self, index):
        pass

    def received_frames(self):
        taken, self.arriving = self.arriving, []
        return taken

    def note_frame(self, frame, result):
        pass

    def heard_voice(self):
        return brain.NO_VOICE

    def sense(self, looks_mm):
        return NOTHING

    def set_outputs(self, wheels, senses):
        pass

    def air_is_busy(self):
        return self.busy

    def send_frame(self, frame):
        self.sent = frame


class Hall:
    """Cars that all hear each other; a frame that meets another is lost."""

    def __init__(self, *cars):
        self.cars = cars
        self.now = 0
        self.on_air: list[tuple[int, RadioCar, int]] = []
        self.away: set[int] = set()
        self.frames: list[tuple[int, int, int]] = []
        for car in cars:
            car.switch_on(0)

    def run(self, duration_ms):
        end_ms = self.now + duration_ms
        while self.now < end_ms:
            self._deliver()
            for car in self.cars:
                car.busy = int(bool(self.on_air) and car.number not in self.away)
                car.sent = None
                step.step(car, self.now)
            for car in self.cars:
                if car.sent is not None and car.number not in self.away:
                    self.frames.append((self.now, car.number, car.sent))
                    self.on_air.append((self.now + frames.frame_ms(car.sent, LEVELS), car, car.sent))
            # Ticks in which nothing can happen are left out.
            self.now += max(min(map(self._rest_ms, self.cars), default=0) // TICK_MS, 1) * TICK_MS

    def _rest_ms(self, car):
        """For how long nothing happens to a car."""
        free_ms = min((ends_ms - self.now for ends_ms, _, _ in self.on_air), default=0)
        word_ms = next_wakeup.word_rest_ms(car.memory, self.now, LEVELS)
        if car.leads:
            send_ms = next_wakeup.frames_rest_ms(car.memory, car.image, free_ms, self.now, LEVELS)
        else:
            send_ms = next_wakeup.relay_rest_ms(car.memory, free_ms, self.now)
        return min(word_ms, send_ms, free_ms or word_ms)

    def _deliver(self):
        ended = [each for each in self.on_air if each[0] <= self.now]
        for each in ended:
            alone = len(self.on_air) == 1
            self.on_air.remove(each)
            for car in self.cars:
                if alone and car is not each[1] and car.number not in self.away:
                    car.arriving.append(each[2])


def follower(*heard, at_ms=0):
    car = RadioCar(9)
    car.switch_on(0)
    for frame in heard:
        car.arriving.append(frame)
    step.step(car, at_ms)
    return car
