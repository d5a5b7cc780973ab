"""Boards that break the contract, each in one way, and part of the sentence that check_board gives."""

import time
from collections.abc import Callable
from typing import Any

from motorcade.car.board import Board
from support.tin_car import RealClock, TinBoard

FRAME_ON_AIR_S = 0.06


def gives(method: str, value: object) -> dict[str, Any]:
    """A board of which ``method`` always gives the same."""
    return {method: lambda self: value}


def changed(method: str, change: Callable[[Any], object]) -> dict[str, Any]:
    return {method: lambda self: change(getattr(TinBoard, method)(self))}


def counts(units_a_s: int, mask: int) -> Any:
    """A board with a real clock that counts otherwise; ``tin`` has the right time."""

    def now_ms(self):
        RealClock.now_ms(self)
        return int(time.monotonic() * units_a_s) & mask

    return type("Counts", (RealClock,), {"now_ms": now_ms})


class NoClock(Board):
    levels = TinBoard.levels

    def __init__(self, tin, folder):
        pass


class NotDerived:
    number, is_leader, levels = 0, False, TinBoard.levels

    def __init__(self, tin, folder):
        self.board = TinBoard(tin, folder)
        for name in ("now_ms", "load_image", "store_image", "read_serial", "write_serial", "received_frames"):
            setattr(self, name, getattr(self.board, name))


def goes_back(self):
    self.tin.now_s -= 0.01
    return TinBoard.now_ms(self)


def waits_for_bytes(self):
    self.tin.now_s += 0.5
    return TinBoard.read_serial(self)


def sends_and_waits(self, frame):
    TinBoard.send_frame(self, frame)
    self.tin.now_s += FRAME_ON_AIR_S


def hears_itself(self, frame):
    TinBoard.send_frame(self, frame)
    self.tin.to_report.append(frame)


def is_unplugged(self):
    raise RuntimeError("no PIR at pin 7")


def writes_over_slowly(self, data):
    with self.path.open("wb") as file:
        for place in range(0, len(data), 256):
            file.write(data[place : place + 256])


def removes_first(self, data):
    new = self.path.with_suffix(".new")
    new.write_bytes(data)
    self.path.unlink(missing_ok=True)
    new.rename(self.path)


def leaves_the_tail(self, data):
    old = self.load_image() or b""
    TinBoard.store_image(self, data + old[len(data) :])


def takes_small_ones(self, data):
    if len(data) > 512:
        raise OSError("the EEPROM has 512 bytes")
    TinBoard.store_image(self, data)


def drives_at_three_speeds(self, direction, speed_level):
    TinBoard.set_wheels(self, direction, [0, 1, 2].index(speed_level))


IN_MEMORY = {
    "image": None,
    "load_image": lambda self: self.image,
    "store_image": lambda self, data: setattr(self, "image", data),
}
# The name, what the board has instead, and part of the sentence.
BROKEN: list[tuple[str, Any, str]] = [
    ("not wrapped", {"now_ms": lambda self: int((self.tin.now_s + 1.7e9) * 1000)}, "wrap at 2^30"),
    ("goes back", {"now_ms": goes_back}, "went back"),
    ("stands still", gives("now_ms", 5), "stands still"),
    ("float clock", {"now_ms": lambda self: self.tin.now_s * 1000 % 2**30}, "whole milliseconds"),
    ("no clock", NoClock, "override now_ms"),
    ("not derived", NotDerived, "no method set_wheels"),
    ("too few levels", {"levels": (0, 1000, 2000, 3000)}, "levels is (0, 1000, 2000, 3000)"),
    ("shuffled levels", {"levels": TinBoard.levels[::-1]}, "make_levels"),
    ("bad number", {"number": -1}, "number is -1"),
    ("bad role", {"is_leader": "leader"}, "is_leader is 'leader'"),
    ("frames stay", {"received_frames": lambda self: self.tin.to_report}, "same frames twice"),
    (
        "frames are checked",
        changed("received_frames", lambda frames: [each for each in frames if each.bit_count() % 2 == 0]),
        "odd parity",
    ),
    (
        "frames as text",
        changed("received_frames", lambda frames: [f"{each:08X}" for each in frames] + ["A4A80000"]),
        "ints of 32 bits",
    ),
    ("no frames at all", gives("received_frames", None), "received_frames() gave None"),
    ("deaf", changed("received_frames", lambda frames: ()), "gave none in all"),
    ("line as text", changed("read_serial", bytes.decode), "read_serial() gave ''"),
    ("line stays", {"read_serial": lambda self: self.tin.line_in}, "each byte is given once"),
    ("line waits", {"read_serial": waits_for_bytes}, "read_serial took 500 ms"),
    ("wheels of three speeds", {"set_wheels": drives_at_three_speeds}, "set_wheels(0, 3) raised ValueError"),
    ("wheels by one argument", {"set_wheels": lambda self, direction: None}, "set_wheels(0, 0) raised TypeError"),
    ("no darkness", {"set_led": lambda self, which: (10, 11, 12, 13)[which]}, "set_led(4) raised IndexError"),
    ("sends and waits", {"send_frame": sends_and_waits, **gives("is_sending", False)}, "send_frame took 60 ms"),
    ("never sending", gives("is_sending", False), "right after send_frame"),
    ("sends for ever", {"is_sending": lambda self: self.tin.busy_until_s > 0}, "still True"),
    (
        "sends too short",
        {"is_sending": lambda self: self.tin.now_s < self.tin.busy_until_s - 0.06},
        "is on the air for",
    ),
    ("hears itself", {"send_frame": hears_itself}, "can't hear while it sends"),
    ("no distance", gives("obstacle_mm", None), "obstacle_mm() gave None"),
    ("far in metres", gives("obstacle_mm", 1.5), "obstacle_mm() gave 1.5"),
    ("says words", gives("heard_voice", "stop"), "heard_voice() gave 'stop'"),
    ("says it again", gives("heard_voice", 1), "gave 1 twice"),
    ("person by volts", gives("sees_person", 1023), "sees_person() gave 1023"),
    ("sensor unplugged", {"sees_person": is_unplugged}, "no PIR at pin 7"),
    ("forgets", {"store_image": lambda self, data: None}, "load_image() gave None"),
    ("in memory only", IN_MEMORY, "has lost the image"),
    ("writes over", {"store_image": lambda self, data: self.path.write_bytes(data)}, "a cut of power in store_image"),
    ("writes over slowly", {"store_image": writes_over_slowly}, "a cut of power in store_image"),
    ("removes first", {"store_image": removes_first}, "a cut of power in store_image"),
    ("leaves the tail", {"store_image": leaves_the_tail}, "load_image() gave"),
    ("takes small ones", {"store_image": takes_small_ones}, "the EEPROM has 512 bytes"),
    ("stores text", changed("load_image", lambda data: None if data is None else bytearray(data)), "bytearray"),
    ("notes states", {"note": lambda self, kind, *more: {"state": 1, "frame": 2}[kind]}, "raised KeyError"),
]
# The same in real time.
BAD_CLOCKS = [
    ("wraps in twelve days", counts(1000, -1), "on for some days"),
    ("wraps too soon", counts(1000, 0xFFFFFFF), "neither sooner nor later"),
    ("microseconds", counts(1_000_000, 0x3FFFFFFF), "count milliseconds"),
]
