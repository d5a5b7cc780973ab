"""A made-up car: a tin with two motors that takes lines of text, and its board, written from docs/write-a-board.md."""

import os
import time
from pathlib import Path

from motorcade.car.board import Board, make_levels

FRAME_S = 0.09


class Tin:
    """The hardware: commands in, a report out. ``now_s`` is its clock, which a test sets."""

    def __init__(self):
        self.now_s = 100.0
        self.frame_s = FRAME_S
        self.commands = []
        self.to_report = []
        self.line_in = b""
        self.line_out = b""
        self.busy_until_s = 0.0

    def command(self, text):
        self.commands.append(text)
        if text.startswith("SEND"):
            self.busy_until_s = self.now_s + self.frame_s


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
        return False

    def is_sending(self):
        return self.tin.now_s < self.tin.busy_until_s

    def send_frame(self, frame):
        self.tin.command(f"SEND {frame:08X}")

    def set_wheels(self, direction, speed_level):
        power = speed_level * 33
        left, right = ((power, power), (-power, power), (power, -power))[direction]
        self.tin.command(f"GO {left} {right}")

    def set_led(self, which):
        self.tin.command("DARK" if which == 4 else f"LIGHT {which}")


class RealClock(TinBoard):
    """A tin board with a real clock."""

    def now_ms(self):
        self.tin.now_s = time.monotonic()
        return int(self.tin.now_s * 1000) & 0x3FFFFFFF
