"""Do in Python what tests/export/brain_steps.c does in C: random steps of cars, and a running sum of all results.

Portable: MicroPython and a browser's Python run it, too.
"""

from motorcade.car import brain, decisions, step
from motorcade.car.senses import Senses
from motorcade.words import receiver, request
from motorcade.words.blocks import crc32_of
from motorcade.words.flow import DECIDES, IN_TURN, TAGGED, TELL, highest_level, word_fault
from motorcade.words.infrared import tagged_frame, to_frame
from motorcade.words.packing import bytes_to_words
from motorcade.words.ticks import TICKS_MASK, later_ms

# For the type checker alone: MicroPython has no such module.
MYPY = False
if MYPY:
    from collections.abc import Iterator

STEPS_OF_A_CAR = 512
STEPS_OF_A_LINE = 1024
MOST_IMAGE_WORDS = 24
CLASSROOM = (0, 1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100, 200, 300, 400, 100)
HASTY = (0, 130, 999, 1501, 90, 170, 333, 500, 701, 1200, 1999, 4001, 1, 150, 151, 499, 37)
DURATIONS_MS = (0, 70_001, 300_000, 1_048_575)
DWELLS_MS = (70_000, 90_001, 131_072, 262_144, 300_000, 500_000, 1_000_000, 1_048_575)
# The largest numbers that a profile may have.
SLOW = DURATIONS_MS + DWELLS_MS + (65_536, 70_000, 300_000, 1_048_575, 66_000)
LEVELS = (
    CLASSROOM + (560, 5, 250, 6, 150, 2400, 2, 10000),  # noqa: RUF005
    HASTY + (500, 0, 40, 2, 31, 333, 1, 4100),  # noqa: RUF005
    SLOW + (1_048_575, 1_048_575, 1_048_575, 70_000, 66_000, 1_048_575, 1_048_575, 1_048_575),  # noqa: RUF005
)
ADVANCES_MS = (0, 1, 3, 4, 4, 7, 12, 20, 20, 20, 20, 50, 100, 300, 700, 5000)
FROM_OWN_TAG = (30, 30, 0, 29)
OBSTACLES_MM = (50, 150, 350, 1_048_576)


class Steps:
    """The world of one run; it is the ``car`` of `motorcade.car.step`, too."""

    def __init__(self, seed: int):
        self.state = seed
        self.sum = 0
        self.bits = 0
        self.now = 0
        self.leads = False
        self.memory = [0] * brain.SIZE
        self.decisions = bytearray(decisions.SIZE)
        self.image: tuple[int, ...] = (0,)
        self.levels = LEVELS[0]
        self.receiver = [0] * receiver.SIZE
        self.buffer = bytearray(MOST_IMAGE_WORDS * 4)
        self.line = b""

    def draw(self) -> int:
        x = self.state
        x ^= x << 13 & 0xFFFFFFFF
        x ^= x >> 17
        x ^= x << 5 & 0xFFFFFFFF
        self.state = x
        return x

    def add(self, *values: int) -> None:
        total = self.sum
        for value in values:
            total = ((total << 8 | total >> 24) + value) & 0xFFFFFFFF
        self.sum = total

    def note(self, kind: int, at_ms: int, word: int, detail: int) -> None:
        self.add(kind, at_ms, word, detail)

    def note_end(self) -> None:
        self.add(self.memory[brain.STATE])

    notes_flow = 1

    def note_flow(self, index: int) -> None:
        self.add(index)

    def received_frames(self) -> "Iterator[int]":
        while self.bits & 7 == 0:
            self.bits >>= 3
            yield self._draw_frame()

    def _draw_frame(self) -> int:
        word = self.draw() & 0xFFFFF800
        kind = self.draw() >> 24
        frame = to_frame(word | 0x80000000 if kind & 1 else self.memory[brain.WORD])
        if kind & 2:
            own = self.memory[brain.TAG] & brain.TAG_MASK
            frame = tagged_frame(frame, (own + FROM_OWN_TAG[kind >> 6]) % 31 + 1)
        if kind & 12 == 0:
            frame ^= (3 if kind & 16 else 1) << (self.draw() >> 27) & 0xFFFFFFFF
        return frame

    def note_frame(self, frame: int, result: int) -> None:
        self.add(frame + result)

    def heard_voice(self) -> int:
        voice = self.bits >> 8 & 15
        return voice if voice < 3 else 0

    def sense(self, looks_mm: int) -> Senses:
        self.add(looks_mm)
        return Senses(OBSTACLES_MM[self.bits >> 12 & 3], 1 if self.bits >> 14 & 3 == 0 else 0, self.bits >> 16 & 3)

    def set_outputs(self, wheels: int, senses: Senses) -> None:
        self.add(wheels + brain.lit_led(self.memory, self.now, self.levels) * 16)

    def air_is_busy(self) -> int:
        return 1 if self.bits >> 16 & 3 == 0 else 0

    def send_frame(self, frame: int) -> None:
        self.add(frame)

    def _new_car(self) -> None:
        random = self.draw()
        self.image = self._drawn_image(random & 7, random >> 3 & 7, 256 << (random >> 7 & 7) | random >> 6 & 1)
        self.now = self.draw() & TICKS_MASK
        if random >> 10 & 3 == 0:
            self.now |= 0x3FFF0000
        self.leads = bool(random >> 12 & 1)
        self.levels = LEVELS[(random >> 18 & 255) % 3]
        brain.switch_on(self.memory, self.draw(), self.now)
        receiver.switch_on(self.receiver, 6 + (random >> 14 & 15))
        self.line = b""
        self._begin_program()

    def _begin_program(self) -> None:
        if self.leads:
            decisions.survey(self.decisions, self.image, 0, len(self.image), self.levels)
            step.begin_program(self, self.now)

    def _drawn_image(self, leader_states: int, follower_words: int, low: int) -> tuple[int, ...]:
        """Any image; the leader of every second one decides, and the car has to understand each of its words."""
        header = leader_states << 24 | follower_words << 16 | (low if follower_words else 0)
        if leader_states and self.draw() >> 31:
            header |= DECIDES
        words = [self.draw() & 0xFFFFF800 for _ in range(leader_states + follower_words)]
        for place in range(leader_states if header & DECIDES else 0):
            words[place] = self._leader_word(words[place], header)
        return (header,) + tuple(words)  # noqa: RUF005

    def _leader_word(self, word: int, header: int) -> int:
        leader_states, follower_words = header >> 24, header >> 16 & 255
        drawn = self.draw()
        if word >> 31:
            op, condition, value, target = (word >> 28 & 7) % 5, (word >> 16 & 15) % 7, drawn >> 24, drawn >> 16 & 255
            level = (word >> 13 & 3) % (highest_level(condition) + 1)
            if op == TELL and drawn >> 8 & 1:
                target, value = IN_TURN, value % (follower_words + 1)
            elif op == TELL:
                target %= follower_words or 1
            else:
                target %= leader_states
            drawn = 1 << 31 | op << 28 | target << 20 | condition << 16 | word & 0x9800 | level << 13 | value << 1
        else:
            until = (drawn >> 28) % 5
            level = (drawn >> 25 & 3) % (highest_level(until) + 1)
            drawn = word & 0x7FFFF800 | until << 7 | (drawn >> 27 & 1) << 6 | level << 4
        first, second, third, fourth = drawn.to_bytes(4, "big")
        fault = word_fault(first, second, third, fourth, leader_states, follower_words, header & TAGGED)
        return word & 0x7FFFF800 if fault else drawn

    def new_line(self) -> None:
        random = self.draw()
        line = bytearray()
        if random & 7 == 0:
            line += bytes(4) if random >> 3 & 1 else b"\0\0\0\xff"
        low = 256 << (random >> 11 & 7) | random >> 14 & 1
        image = bytearray()
        for word in self._drawn_image(random >> 5 & 7, random >> 8 & 7, low):
            image += word.to_bytes(4, "big")
        if random >> 4 & 1:
            line += request.check_request(crc32_of(image, 0, len(image), 0), random >> 15 & 255)
        line += image
        if random >> 24 & 3 == 0:
            line[(random >> 26) % len(line)] ^= 1 << (random >> 23 & 7)
        if random >> 30 == 0:
            line = line[: len(line) - len(line) // 4]
        self.line = bytes(line)

    def _take_events(self) -> int:
        while (event := receiver.next_event(self.receiver, self.buffer, 3, self.now)) > receiver.WORKING:
            self.add(event, *self.receiver)
            if event == receiver.IMAGE:
                self._take_image(bytes(self.buffer[self.receiver[receiver.START] :])[: self.receiver[receiver.LENGTH]])
        return event

    def _take_image(self, data: bytes) -> None:
        self.image = bytes_to_words(data)
        self._begin_program()

    def _serve_serial(self) -> None:
        if not self.line and self.bits >> 18 & 15 == 0:
            self.new_line()
        self._take_events()
        count = min(self.bits >> 22 & 31, len(self.line), receiver.room(self.receiver, self.buffer, self.now))
        if count == 0:
            return
        end = self.receiver[receiver.END]
        self.buffer[end : end + count] = self.line[:count]
        self.line = self.line[count:]
        receiver.add(self.receiver, count, self.now)
        self.add(self._take_events())

    def step(self, number: int) -> None:
        if number % STEPS_OF_A_CAR == 0:
            self._new_car()
        self.bits = self.draw()
        self.now = later_ms(self.now, ADVANCES_MS[self.bits >> 28] << (7 if self.levels == LEVELS[2] else 0))
        self._serve_serial()
        step.step(self, self.now)
        if number % 8 == 0:
            self.add(*self.memory)
            if self.leads:
                self.add(*self.decisions)


def sums(seed: int, steps: int) -> list[str]:
    """Return the sum after each STEPS_OF_A_LINE steps, in hexadecimal."""
    world = Steps(seed)
    lines = []
    for number in range(steps):
        world.step(number)
        if (number + 1) % STEPS_OF_A_LINE == 0:
            lines.append(f"{world.sum:08x}")
    return lines
