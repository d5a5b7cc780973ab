"""Run the portable files through random steps; print a running sum of all their results, and which cases were met.

Portable itself: CPython and MicroPython run this file with the same seed, and must print the same lines
(test_conformance.py). To find the first step in which they differ, run them with 1 for EVERY:
``node run_micropython.mjs conformance SEED STEPS EVERY``.
"""

from binascii import crc32

from motorcade.car import brain, decisions, frames, next_wakeup
from motorcade.car.senses import NOTHING, Senses
from motorcade.car.step import STATE
from motorcade.words import request
from motorcade.words.infrared import FrameReceiver, air_us, frame_durations_us, to_frame
from motorcade.words.ticks import elapsed_ms, reached
from motorcade.words.upload import REQUEST, CarEnd
from support.brain_steps import Steps

AT_A_WALL = Senses(*[0 for _ in NOTHING])
# What isn't 0 in the memory of a car, and of a leader that decides.
REMEMBERED = (("random forward", brain.DRAWS), ("stopped by voice", brain.STOPPED))
DECIDED = (
    ("called", decisions.CALLS),
    ("heard since", decisions.VOICES),
    ("told", decisions.IS_TELLING),
    ("told in turn", decisions.TURNS),
    ("waits to tell", decisions.WAITS),
)
NAMES = ("", "ada", "\u963f\u8fbe", "a b", "x" * 33)


class MetSteps(Steps):
    """Random steps that also ask when a car has to be called next, and what else was met."""

    def __init__(self, seed):
        Steps.__init__(self, seed)
        self.met = set()
        self.states = 0

    def note(self, kind, at_ms, word, detail):
        self.met.add(f"noted {kind}")
        self.states += kind == STATE
        Steps.note(self, kind, at_ms, word, detail)

    def note_end(self):
        self.met.add("ended by its condition")
        Steps.note_end(self)

    def note_frame(self, frame, result):
        self.met.add(f"frame {result}")
        Steps.note_frame(self, frame, result)

    def set_outputs(self, wheels, senses):
        self.met.add(f"wheels {wheels >> 2 if wheels & 3 else 'still'}")
        self.met.add(f"led {brain.lit_led(self.memory, self.now, self.levels)}")
        Steps.set_outputs(self, wheels, senses)

    def send_frame(self, frame):
        self.met.add("leader sends" if self.leads else "follower sends")
        Steps.send_frame(self, frame)

    def step(self, number):
        before_ms, self.states = self.now, 0
        Steps.step(self, number)
        if self.states > 1:
            self.met.add("several states in a tick")
        if self.now < before_ms:
            self.met.add("clock wrapped")
        memory, d, now, levels = self.memory, self.decisions, self.now, self.levels
        free, in_the_way = [brain.wheels(memory, senses, now, levels) for senses in (NOTHING, AT_A_WALL)]
        decides = self.leads and decisions.decides(d)
        self.add(free, in_the_way, brain.watches(memory, now, levels), next_wakeup.word_rest_ms(memory, now, levels))
        for free_ms in (0, 70):
            if decides and d[decisions.TELLS]:
                self.add(next_wakeup.tells_rest_ms(memory, d, self.image, free_ms, now, levels))
            elif self.leads:
                self.add(next_wakeup.frames_rest_ms(memory, self.image, free_ms, now, levels))
            else:
                self.add(next_wakeup.relay_rest_ms(memory, free_ms, now))
        if free != in_the_way:
            self.met.add("avoiding")
        for name, place in REMEMBERED:
            if memory[place]:
                self.met.add(name)
        if decides:
            self.add(decisions.watches(memory, d))
            self.met.add("decides" if memory[brain.RUNNING] else "no state")
            for name, place in DECIDED:
                if d[place]:
                    self.met.add(name)
            if sum(d[decisions.COUNTS : decisions.CALLS]):
                self.met.add("counted")
        if not self.leads or frames.is_tagged(self.image):
            self.met.add(f"relay {memory[brain.RELAY]}")
        elif memory[brain.RELAYED]:
            self.met.add("relayed program")
        if memory[brain.TAG]:
            self.met.add("tag forgotten" if memory[brain.TAG] & brain.FORGOTTEN else "tagged")


def damaged(steps, data):
    """Return ``data``, in half of the cases with one bit wrong or cut off."""
    kind, at = steps.draw() >> 30, (steps.draw() >> 8) % len(data)
    if kind == 0:
        return data[:at] + bytes([data[at] ^ 1 << (steps.draw() >> 29)]) + data[at + 1 :]
    return data[:at] if kind == 1 else data


def events(steps, data):
    """Add and return what the car's end of a line finds in ``data``."""
    car_end, found = CarEnd(), []
    for came, at_ms in ((data, 1000), (b"", 2000)):
        car_end.receive_data(came, at_ms)
    event = car_end.next_event()
    while event is not None:
        found.append(event)
        steps.add(crc32(event.kind.encode()), crc32(event.image), crc32(event.answer))
        steps.met.add(event.kind)
        event = car_end.next_event()
    return found


def step_line(steps):
    """An upload, and a request with its answer and among other bytes, on a line that damages some bytes."""
    steps.new_line()
    events(steps, steps.line)
    name = NAMES[(steps.draw() >> 8) % len(NAMES)]
    sent = request.car_request("abnsg"[(steps.draw() >> 8) % 5], steps.draw() >> 24, name[:32])
    for event in events(steps, damaged(steps, sent)):
        if event.kind == REQUEST and (asked := request.read_request(event.image)):
            steps.add(crc32(request.answer_line(asked, (("role", "leader"), ("name", asked.name)))))
    upload, requests, rest = request.split_requests(steps.line + damaged(steps, sent) + sent[: steps.draw() >> 27])
    steps.add(crc32(upload), len(requests), crc32(rest), 1 if request.is_car_name(name) else 0)


def step_infrared(steps, receiver):
    """One frame into a receiver that keeps the state that earlier frames left."""
    frame, unit_us = to_frame(steps.draw()), (500, 560, 620, 560)[steps.draw() >> 30]
    durations_us = frame_durations_us(frame, unit_us)
    steps.add(air_us(frame, unit_us), *durations_us)
    jitter_percent = (0, 10, 20, 50)[steps.draw() >> 30]
    if steps.draw() >> 29 == 0:
        durations_us = durations_us[: steps.draw() % len(durations_us)]
    for i, nominal_us in enumerate(durations_us):
        take = receiver.receive_space if i & 1 else receiver.receive_mark
        take(nominal_us * (100 - jitter_percent + steps.draw() % (2 * jitter_percent + 1)) // 100)
    found = receiver.next_frame()
    steps.add(1 if found is None else found)
    steps.met.add("infrared lost" if found is None else "infrared right" if found == frame else "infrared wrong")


def lines(seed, count, every):
    """The lines that a run prints: the sum every ``every`` steps, then the cases."""
    cars, lines, receiver = MetSteps(seed), MetSteps(seed + 1), FrameReceiver()
    for number in range(count):
        cars.step(number)
        if number % 8 == 0:
            step_line(lines)
            step_infrared(lines, receiver)
            then = lines.draw() >> 2
            lines.add(elapsed_ms(cars.now, then), reached(cars.now, then))
        if (number + 1) % every == 0:
            yield f"step {number + 1} sums {cars.sum:08x} {lines.sum:08x}"
    for name in sorted(cars.met | lines.met):
        yield f"met {name}"
