"""Run the portable files through random steps and print a running CRC-32 of all their results.

Portable itself: CPython and MicroPython run this file with the same seed, and must print the same lines
(test_conformance.py). To find the first step in which they differ, run them with 1 for EVERY:
``python conformance.py SEED STEPS EVERY``, ``node run_micropython.mjs conformance SEED STEPS EVERY``.
"""

import sys
from binascii import crc32

from inputs import damaged, draw_frame, draw_image
from randomness import Random

from motorcade.car import brain, decisions, frames, next_wakeup
from motorcade.car.board import NOTHING_IN_SIGHT_MM, Board, make_levels
from motorcade.car.loop import Car
from motorcade.car.senses import NOTHING, Senses
from motorcade.words import request
from motorcade.words.infrared import FrameReceiver, air_us, frame_durations_us, to_frame
from motorcade.words.ticks import TICKS_MASK, elapsed_ms, later_ms, reached
from motorcade.words.upload import READBACK_REQUEST, REQUEST, CarEnd

STEPS_OF_A_PAIR = 50
# Profiles, in the order of make_levels: the built-in one, and one whose times are no round numbers.
CLASSROOM = make_levels(
    (0, 1000, 2000, 3000),
    tuple(range(1000, 9000, 1000)),
    (100, 200, 300, 400),
    100,
    (560, 5, 250, 6, 150, 2400, 2, 10000),
)
HASTY = make_levels(
    (0, 130, 999, 1501),
    (90, 170, 333, 500, 701, 1200, 1999, 4001),
    (1, 150, 151, 499),
    37,
    (500, 0, 40, 2, 31, 333, 1, 4100),
)
# From, to: 0 and 1 ms, the period of a fast loop and of a slow one, just on time, and late by whole states.
ADVANCES_MS = ((0, 0), (1, 1), (2, 12), (2, 12), (10, 60), (50, 300), (500, 500), (300, 1100), (1000, 9000))
DIRECTIONS = ("forward", "left", "right")
RELAY_STATES = ("busy", "sensing", "waiting", "scheduled", "listening", "resting")
NOTED = {
    "image": "images taken",
    "state": "states begun",
    "heard": "frames heard",
    "start": "words begun",
    "over": "words over",
}


# Cases of leaders that decide, and what isn't 0 then.
TOLD = (
    ("called", decisions.CALLS),
    ("counted", decisions.COUNTS),
    ("heard since", decisions.VOICES),
    ("told", decisions.IS_TELLING),
    ("told in turn", decisions.TURNS),
    ("waits to tell", decisions.WAITS),
)
AT_A_WALL = Senses(*[0 for _ in NOTHING])


def total_names():
    """Return the names of the cases that a run must meet at least once."""
    names = ["clock wrapped", "states begun", "several states in a tick", "words begun", "words over", "frames heard"]
    names += ["lost: " + reason for reason in ("parity", "reserved", "check", "remote", "deaf")]
    names += ["frames sent by leaders", "frames sent by followers"]
    names += ["wheels still", "wheels forward", "wheels left", "wheels right", "led off", "led on"]
    names += ["random forward", "stopped by voice", "avoiding", "relayed program", "tagged", "tag forgotten"]
    names += ["relay " + state for state in RELAY_STATES[1:]]
    names += ["images taken", "images not stored", "images refused", "images read back", "images announced"]
    names.append("request")
    names += ["infrared right", "infrared wrong", "infrared lost"]
    names += ["decides", "no state"] + [name for name, _ in TOLD]
    return names


class Record:
    """The CRC-32 of all results so far, and how often each case was met."""

    def __init__(self):
        self.crc = 0
        self.totals = dict.fromkeys(total_names(), 0)

    def add(self, *values):
        for value in values:
            data = value if isinstance(value, bytes) else str(value).encode()
            self.crc = crc32(data + b"\n", self.crc)

    def count(self, name):
        self.totals[name] += 1
        self.add(name)


class ScriptedBoard(Board):
    """A board that gives the car random inputs and records all its outputs."""

    def __init__(self, random, record, levels, is_leader):
        self.number = random.bits()
        self.is_leader = is_leader
        self.levels = levels
        self.clock_ms = 0
        self.frames = ()
        self._random = random
        self._record = record
        self._stored = None if random.one_in(3) else draw_image(random)
        self._arriving = b""

    def now_ms(self):
        return self.clock_ms

    def load_image(self):
        return self._stored

    def store_image(self, data):
        if self._random.one_in(8):
            self._record.count("images not stored")
            raise OSError("no space")
        self._stored = data

    def read_serial(self):
        random = self._random
        if not self._arriving and random.one_in(8):
            sent = READBACK_REQUEST if random.one_in(4) else draw_image(random)
            if random.one_in(2):
                sent = request.check_request(crc32(sent), random.below(256)) + sent
            self._arriving = damaged(random, sent)
        size = len(self._arriving) if random.one_in(2) else random.below(9)
        data = self._arriving[:size]
        self._arriving = self._arriving[size:]
        return data

    def write_serial(self, data):
        self._record.add(data)
        if data.startswith(b"ERR"):
            self._record.count("images refused")
        elif data.startswith(b"OK check"):
            self._record.count("images announced")
        elif not data.startswith(b"OK"):
            self._record.count("images read back")

    def received_frames(self):
        return self.frames

    def senses_carrier(self):
        return self._random.one_in(4)

    def is_sending(self):
        return self._random.one_in(8)

    def send_frame(self, frame):
        self._record.add(frame)
        self._record.count("frames sent by " + ("leaders" if self.is_leader else "followers"))

    def obstacle_mm(self):
        near_mm = self._random.pick(self.levels[brain.AVOID_RADII_MM : brain.IDLE_STATE_MS])
        return self._random.pick((near_mm - 1, near_mm, NOTHING_IN_SIGHT_MM))

    def sees_person(self):
        return self._random.one_in(4)

    def dark_floor(self):
        return self._random.pick((0, 0, 1, 2, 3))

    def heard_voice(self):
        return self._random.pick((brain.VOICE_STOP, brain.VOICE_GO)) if self._random.one_in(12) else brain.NO_VOICE

    def set_wheels(self, direction, speed_level):
        self._record.add(speed_level)
        self._record.count("wheels " + (DIRECTIONS[direction] if speed_level else "still"))

    def set_led(self, which):
        self._record.add(which)
        self._record.count("led off" if which == brain.NO_LED else "led on")

    def note(self, kind, at_ms, word, detail):
        self._record.add(kind, at_ms, word, detail)
        if kind == "lost":
            self._record.count("lost: " + detail)
        elif kind != "frame":
            self._record.count(NOTED[kind])


class Pair:
    """A leader and a follower, switched on at the same time, often shortly before the clock wraps."""

    def __init__(self, random, record):
        self._random = random
        self._record = record
        self._clock_ms = TICKS_MASK - random.below(20000) if random.one_in(3) else random.below(TICKS_MASK + 1)
        levels = random.pick((CLASSROOM, HASTY))
        self._leader = Car(ScriptedBoard(random, record, levels, True))
        self._follower = Car(ScriptedBoard(random, record, levels, False))

    def step(self):
        random, record = self._random, self._record
        low, high = random.pick(ADVANCES_MS)
        before_ms = self._clock_ms
        self._clock_ms = (before_ms + random.between(low, high)) & TICKS_MASK
        if self._clock_ms < before_ms:
            record.count("clock wrapped")
        held, tag = self._follower.memory[brain.WORD], self._follower.memory[brain.TAG] & brain.TAG_MASK
        self._follower.board.frames = [draw_frame(random, held, tag) for _ in range(random.pick((0, 0, 0, 1, 1, 3)))]
        states = record.totals["states begun"]
        for car in (self._leader, self._follower):
            car.board.clock_ms = self._clock_ms
            car.tick()
            self._look_inside(car)
        if record.totals["states begun"] > states + 1:
            record.count("several states in a tick")

    def _look_inside(self, car):
        memory, levels, record = car.memory, car.board.levels, self._record
        in_the_way = brain.wheels(memory, AT_A_WALL, self._clock_ms, levels)
        free = brain.wheels(memory, NOTHING, self._clock_ms, levels)
        record.add(in_the_way, free, *memory)
        record.add(*car.image)
        record.add(next_wakeup.word_rest_ms(memory, self._clock_ms, levels))
        is_decider = car.board.is_leader and decisions.decides(car.decisions)
        if is_decider:
            record.count("decides")
            record.add(*car.decisions)
            record.add(decisions.watches(memory, car.decisions))
            for name, place in TOLD:
                if car.decisions[place]:
                    record.count(name)
            if not memory[brain.RUNNING]:
                record.count("no state")
        if is_decider and car.decisions[decisions.TELLS]:
            rests = [
                next_wakeup.tells_rest_ms(memory, car.decisions, car.image, free, self._clock_ms, levels)
                for free in (0, 70)
            ]
        elif car.board.is_leader:
            rests = [next_wakeup.frames_rest_ms(memory, car.image, free, self._clock_ms, levels) for free in (0, 70)]
        else:
            rests = [next_wakeup.relay_rest_ms(memory, free, self._clock_ms) for free in (0, 70)]
        record.add(*rests)
        if in_the_way != free:
            record.count("avoiding")
        if memory[brain.DRAWS]:
            record.count("random forward")
        if memory[brain.STOPPED]:
            record.count("stopped by voice")
        if car.board.is_leader and not frames.is_tagged(car.image):
            if memory[brain.RELAYED]:
                record.count("relayed program")
        elif memory[brain.RELAY]:
            record.count("relay " + RELAY_STATES[memory[brain.RELAY]])
        if memory[brain.TAG]:
            record.count("tag forgotten" if memory[brain.TAG] & brain.FORGOTTEN else "tagged")


def step_ticks(random, record):
    now, then = random.bits() & TICKS_MASK, random.bits() & TICKS_MASK
    record.add(elapsed_ms(now, then), later_ms(now, then), reached(now, then))


def step_upload(random, record):
    """The car's end of an upload, on a line that damages some bytes."""
    image, car_end = draw_image(random), CarEnd()
    if random.one_in(2):
        car_end.receive_data(damaged(random, request.check_request(crc32(image), random.below(256))), 300)
    car_end.receive_data(damaged(random, image), 1000)
    car_end.receive_data(b"", 2000)
    event = car_end.next_event()
    while event is not None:
        record.add(event.kind, event.image, event.answer)
        event = car_end.next_event()


def step_request(random, record):
    """A request, on a line that damages some bytes, and its answer; and requests among other bytes."""
    name = random.pick(("", "ada", "\u963f\u8fbe", "a b", "x" * 33))
    data = request.car_request(random.pick(("a", "b", "n", "s", "g")), random.below(256), name[:32])
    car_end = CarEnd()
    car_end.receive_data(damaged(random, data), 1000)
    event = car_end.next_event()
    if event is not None and event.kind == REQUEST:
        record.add(*request.read_request(event.image))
        record.add(request.answer_line(request.read_request(event.image), (("role", "leader"), ("name", "ada"))))
        record.count("request")
    upload, requests, rest = request.split_requests(
        draw_image(random) + damaged(random, data) + data[: random.below(48)]
    )
    record.add(upload, len(requests), rest, 1 if request.is_car_name(name) else 0)


def step_infrared(random, record, receiver):
    """One frame into a receiver that keeps the state that earlier frames left."""
    frame = to_frame(random.bits())
    unit_us = random.pick((500, 560, 620))
    durations_us = frame_durations_us(frame, unit_us)
    record.add(air_us(frame, unit_us), *durations_us)
    jitter_percent = random.pick((0, 10, 20, 20, 50))
    if random.one_in(8):
        durations_us = durations_us[: random.below(len(durations_us))]
    for i, nominal_us in enumerate(durations_us):
        duration_us = nominal_us * random.between(100 - jitter_percent, 100 + jitter_percent) // 100
        if i & 1:
            receiver.receive_space(duration_us)
        else:
            receiver.receive_mark(duration_us)
    found = receiver.next_frame()
    record.add(found)
    if found is None:
        record.count("infrared lost")
    else:
        record.count("infrared right" if found == frame else "infrared wrong")


def lines(seed, steps, every):
    """The lines that a run prints: the CRC-32 every ``every`` steps, then the totals."""
    random, record, receiver = Random(seed), Record(), FrameReceiver()
    for step in range(steps):
        if step % STEPS_OF_A_PAIR == 0:
            pair = Pair(random, record)
        pair.step()
        step_ticks(random, record)
        step_upload(random, record)
        step_request(random, record)
        step_infrared(random, record, receiver)
        if (step + 1) % every == 0:
            yield f"step {step + 1} crc32 {record.crc:08x}"
    for name in total_names():
        yield f"total {record.totals[name]} {name}"


if __name__ == "__main__":
    for line in lines(*[int(argument) for argument in sys.argv[1:]]):
        print(line)
