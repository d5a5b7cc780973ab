"""A made-up car: a tin with two motors that takes lines of text; its board, and its observer."""

import os
import time
from pathlib import Path

from motorcade.car.board import NOTHING_IN_SIGHT_MM, Board, make_levels
from motorcade.car.check.checked_board import BoardObserver

FRAME_S = 0.09
SPACE_S = 0.005


class Tin:
    """The hardware; ``now_s`` is its clock, which a test sets. A command may come late: only the observer sees when."""

    def __init__(self):
        self.now_s = 100.0
        self.frame_s = FRAME_S
        self.commands = []
        self.to_report = []
        self.line_in = self.line_out = b""
        self.busy_until_s = self.carrier_until_s = 0.0
        self.carrier = self.person = False
        self.distance_mm = None
        self.floor = 0
        self.spoken = []
        self.eeprom = self.cache = None

    def command(self, text, delay_s=0.0):
        self.commands.append((self.now_s + delay_s, text))
        if text.startswith("SEND"):
            self.busy_until_s = self.now_s + self.frame_s

    def done(self, *kinds):
        """The arguments of all commands of these kinds that are done by now, in the order of their times."""
        due = sorted((at_s, place) for place, (at_s, _) in enumerate(self.commands) if at_s <= self.now_s)
        texts = [self.commands[place][1].split() for _, place in due]
        return [text[1:] for text in texts if text[0] in kinds]


class TinBoard(Board):
    number = 12
    is_leader = False
    levels = make_levels(
        (0, 1000, 2000, 3000),
        tuple(range(1000, 9000, 1000)),
        (100, 200, 300, 400),
        100,
        (560, 5, 250, 6, 150, 2400, 2, 10000),
    )

    def __init__(self, tin, folder):
        self.tin = tin
        self.path = Path(folder) / "image"

    def now_ms(self):
        return int(self.tin.now_s * 1000) & 0x3FFFFFFF

    def load_image(self):
        return self.path.read_bytes() if self.path.exists() else None

    def store_image(self, data):
        new = self.path.with_suffix(".new")
        with new.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        new.replace(self.path)

    def read_serial(self):
        data, self.tin.line_in = self.tin.line_in, b""
        return data

    def write_serial(self, data):
        self.tin.line_out += data

    def received_frames(self):
        frames, self.tin.to_report = self.tin.to_report, []
        return frames

    def senses_carrier(self):
        return self.tin.carrier or self.tin.now_s < self.tin.carrier_until_s

    def is_sending(self):
        return self.tin.now_s < self.tin.busy_until_s

    def send_frame(self, frame):
        self.tin.command(f"SEND {frame:08X}")

    def obstacle_mm(self):
        return NOTHING_IN_SIGHT_MM if self.tin.distance_mm is None else self.tin.distance_mm

    def sees_person(self):
        return self.tin.person

    def dark_floor(self):
        return self.tin.floor

    def heard_voice(self):
        return self.tin.spoken.pop(0) if self.tin.spoken else 0

    def set_wheels(self, direction, speed_level):
        power = speed_level * 33
        left, right = ((power, power), (-power, power), (power, -power))[direction]
        self.tin.command(f"GO {left} {right}")

    def set_led(self, which):
        self.tin.command("DARK" if which == 4 else f"LIGHT {which}")


class EepromTin(TinBoard):
    """A correct board whose store is no file: a page of an EEPROM, written for good by a command of its own."""

    def load_image(self):
        return self.tin.cache

    def store_image(self, data):
        self.tin.cache = self.tin.eeprom = data


class RealClock(TinBoard):
    """A tin board with a real clock."""

    def now_ms(self):
        self.tin.now_s = time.monotonic()
        return int(self.tin.now_s * 1000) & 0x3FFFFFFF


class TinObserver(BoardObserver):
    """What a tin did, and hands that move things before its sensors."""

    def __init__(self, tin):
        self.tin = tin
        self.frames_seen = 0

    def wheels(self):
        return tuple(map(float, (self.tin.done("GO") or [(0, 0)])[-1]))

    def lit_leds(self):
        return [int(led) for led in (self.tin.done("LIGHT", "DARK") or [()])[-1]]

    def sent_frames(self):
        sent = self.tin.done("SEND")
        new, self.frames_seen = sent[self.frames_seen :], len(sent)
        return [int(frame, 16) for (frame,) in new]

    def written_bytes(self):
        data, self.tin.line_out = self.tin.line_out, b""
        return data

    def put_obstacle(self, distance_mm):
        self.tin.distance_mm = None if distance_mm == NOTHING_IN_SIGHT_MM else distance_mm
        return distance_mm

    def show_carrier(self, is_on):
        if self.tin.carrier and not is_on:
            self.tin.carrier_until_s = self.tin.now_s + SPACE_S
        self.tin.carrier = is_on
        return True

    def show_person(self, is_there):
        self.tin.person = is_there
        return True

    def show_floor(self, dark):
        self.tin.floor = dark
        return True

    def speak(self, voice):
        self.tin.spoken.append(voice)
        return True

    def cut_power(self):
        self.tin.cache = self.tin.eeprom
