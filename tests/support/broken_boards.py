"""Boards that break the contract, each in one way, and part of the sentence that check_board gives."""

import os
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from motorcade.car.board import NOTHING_IN_SIGHT_MM, Board
from support.tin_car import FRAME_S, EepromTin, RealClock, TinBoard

LEVELS = TinBoard.levels


def gives(method: str, value: object) -> dict[str, Any]:
    """A board of which ``method`` always gives the same."""
    return {method: lambda self: value}


def changed(method: str, change: Callable[[Any], object]) -> dict[str, Any]:
    return {method: lambda self: change(getattr(TinBoard, method)(self))}


def go(direction: int, level: int, power: int = 33) -> str:
    left, right = ((1, 1), (-1, 1), (1, -1))[direction]
    return f"GO {left * level * power} {right * level * power}"


def light(which: int) -> str:
    return "DARK" if which == 4 else f"LIGHT {which}"


def commands(method: str, text: Callable[..., str | None], delay_s: float = 0.0) -> dict[str, Any]:
    """A board whose ``method`` gives the command ``text``, and none for None."""

    def call(self, *asked):
        command = text(*asked)
        if command is not None:
            self.tin.command(command, delay_s)

    return {method: call}


wheels, leds = partial(commands, "set_wheels"), partial(commands, "set_led")


def sends(change: Callable[[int], int], delay_s: float = 0.0, times: int = 1) -> dict[str, Any]:
    def send_frame(self, frame):
        self.tin.busy_until_s = self.tin.now_s + FRAME_S
        for again in range(times):
            self.tin.command(f"SEND {change(frame):08X}", delay_s + again * 0.06)

    return {"send_frame": send_frame}


def writes(change: Callable[[bytes], bytes]) -> dict[str, Any]:
    return {"write_serial": lambda self, data: TinBoard.write_serial(self, change(data))}


def pauses(method: str, duration_s: float = 0.03) -> dict[str, Any]:
    """A board of which every 40th call of ``method`` takes longer."""

    def call(self, *arguments):
        self.calls += 1
        if self.calls % 40 == 0:
            self.tin.now_s += duration_s
        return getattr(TinBoard, method)(self, *arguments)

    return {method: call, "calls": 0}


def measures(change: Callable[[int], int], nothing: int = NOTHING_IN_SIGHT_MM) -> dict[str, Any]:
    return {"obstacle_mm": lambda self: nothing if self.tin.distance_mm is None else change(self.tin.distance_mm)}


def senses(busy: Callable[[Any], bool]) -> dict[str, Any]:
    return {"senses_carrier": lambda self: busy(self.tin)}


def counts(units_a_s: int, mask: int) -> Any:
    """A board with a real clock that counts otherwise; ``tin`` has the right time."""

    def now_ms(self):
        RealClock.now_ms(self)
        return int(time.monotonic() * units_a_s) & mask

    return type("Counts", (RealClock,), {"now_ms": now_ms})


class NoClock(Board):
    levels = LEVELS

    def __init__(self, tin, folder):
        pass


class NotDerived:
    number, is_leader, levels = 0, False, LEVELS

    def __init__(self, tin, folder):
        self.board = TinBoard(tin, folder)
        for name in ("now_ms", "load_image", "store_image", "read_serial", "write_serial", "received_frames"):
            setattr(self, name, getattr(self.board, name))


class SlowDistance(EepromTin):
    """An average over the pings of two seconds."""

    before = (0.0, NOTHING_IN_SIGHT_MM)

    def obstacle_mm(self):
        now_mm = super().obstacle_mm()
        if now_mm != self.before[1] and self.tin.now_s > self.before[0] + 0.7:
            self.before = (self.tin.now_s, now_mm)
        return self.before[1]


def goes_back(self):
    self.tin.now_s -= 0.01
    return TinBoard.now_ms(self)


def waits_for_bytes(self):
    self.tin.now_s += 0.5
    return TinBoard.read_serial(self)


def throws_away_while_sending(self):
    """What comes while interrupts are off is gone, but for the two bytes that the hardware holds."""
    data = TinBoard.read_serial(self)
    return data[:2] if self.is_sending() else data


def writes_nothing_while_sending(self, data):
    if not self.is_sending():
        TinBoard.write_serial(self, data)


def hears_itself(self, frame):
    TinBoard.send_frame(self, frame)
    self.tin.to_report.append(frame)


def stops_by_itself(self, direction, speed_level):
    """Wheels that a motor driver's watchdog stops after 300 ms without a call."""
    self.tin.command(go(direction, speed_level))
    self.tin.command("GO 0 0", 0.3)


def blinks_out(self, which):
    self.tin.command(light(which))
    self.tin.command("DARK", 0.5)


def writes_over_slowly(self, data):
    with self.path.open("wb") as file:
        for place in range(0, len(data), 256):
            file.write(data[place : place + 256])


def sees_for_ever(self):
    self.has_seen = self.has_seen or self.tin.person
    return self.has_seen


def removes_first(self, data):
    new = self.path.with_suffix(".new")
    new.write_bytes(data)
    self.path.unlink(missing_ok=True)
    new.rename(self.path)


def renames_only(self, data):
    new = self.path.with_suffix(".new")
    new.write_bytes(data)
    new.replace(self.path)


def flushes_too_late(self, data):
    new = self.path.with_suffix(".new")
    with new.open("wb") as file:
        file.write(data)
        os.fsync(file.fileno())
    new.replace(self.path)


def syncs_another(self, data):
    new = self.path.with_suffix(".new")
    new.write_bytes(data)
    with self.path.with_suffix(".log").open("wb") as file:
        os.fsync(file.fileno())
    new.rename(self.path)


def leaves_the_tail(self, data):
    old = self.load_image() or b""
    TinBoard.store_image(self, data + old[len(data) :])


def swap_bytes(frame: int) -> int:
    return int.from_bytes(frame.to_bytes(4, "big"), "little")


IN_MEMORY = {
    "image": None,
    "load_image": lambda self: self.image,
    "store_image": lambda self, data: setattr(self, "image", data),
}
# Found without an observer: the name, what the board has instead, and part of the sentence.
ALONE: list[tuple[str, Any, str]] = [
    ("not wrapped", {"now_ms": lambda self: int((self.tin.now_s + 1.7e9) * 1000)}, "wrap at 2^30"),
    ("goes back", {"now_ms": goes_back}, "went back"),
    ("stands still", gives("now_ms", 5), "stands still"),
    ("float clock", {"now_ms": lambda self: self.tin.now_s * 1000 % 2**30}, "whole milliseconds"),
    ("no clock", NoClock, "override now_ms"),
    ("not derived", NotDerived, "no method set_wheels"),
    ("too few levels", {"levels": (0, 1000, 2000, 3000)}, "levels is (0, 1000, 2000, 3000)"),
    ("shuffled levels", {"levels": LEVELS[::-1]}, "make_levels"),
    ("durations in seconds", {"levels": (0, 1, 2, 3, *LEVELS[4:])}, "durations_ms (0, 1, 2, 3)"),
    ("dwells in seconds", {"levels": (*LEVELS[:4], *range(1, 9), *LEVELS[12:])}, "dwells_ms (1, 2,"),
    ("durations in µs", {"levels": (0, 10**6, 2 * 10**6, 3 * 10**6, *LEVELS[4:])}, "look like microseconds"),
    ("radii in cm", {"levels": (*LEVELS[:12], 10, 20, 30, 40, *LEVELS[16:])}, "look like centimetres"),
    ("bad number", {"number": -1}, "number is -1"),
    ("bad role", {"is_leader": "leader"}, "is_leader is 'leader'"),
    ("no words", {"most_words": 0}, "most_words is 0"),
    ("too many words", {"most_words": 2044}, "most_words is 2044"),
    ("no bytes a tick", {"bytes_a_tick": 0}, "bytes_a_tick is 0"),
    ("no words a tick", {"words_a_tick": None}, "words_a_tick is None"),
    ("frames stay", {"received_frames": lambda self: self.tin.to_report}, "same frames twice"),
    (
        "frames are checked",
        changed("received_frames", lambda frames: [each for each in frames if each.bit_count() % 2 == 0]),
        "odd parity",
    ),
    ("no frames at all", gives("received_frames", None), "received_frames() gave None"),
    ("deaf", changed("received_frames", lambda frames: ()), "gave none in all"),
    ("hears itself", {"send_frame": hears_itself}, "can't hear while it sends"),
    ("line as text", changed("read_serial", bytes.decode), "read_serial() gave ''"),
    ("line stays", {"read_serial": lambda self: self.tin.line_in}, "each byte is given once"),
    ("line waits", {"read_serial": waits_for_bytes}, "read_serial took 500 ms"),
    ("keeps 128 bytes", changed("read_serial", lambda data: data[:128]), "read_serial lost bytes"),
    ("reads lines", changed("read_serial", lambda data: data.replace(b"\r", b"\n")), "is 0x0A in place of 0x0D"),
    (
        "drops zeros",
        changed("read_serial", lambda data: data.replace(b"\0", b"")),
        "0x00, is the first that is missing",
    ),
    ("throws bytes away while it sends", {"read_serial": throws_away_while_sending}, "while infrared is sent"),
    ("no darkness", {"set_led": lambda self, which: (10, 11, 12, 13)[which]}, "set_led(4) raised IndexError"),
    ("never sending", gives("is_sending", False), "right after send_frame"),
    ("sends for ever", {"is_sending": lambda self: self.tin.busy_until_s > 0}, "still True"),
    (
        "sends too short",
        {"is_sending": lambda self: self.tin.now_s < self.tin.busy_until_s - 0.06},
        "is on the air for",
    ),
    ("no distance", gives("obstacle_mm", None), "obstacle_mm() gave None"),
    ("says words", gives("heard_voice", "stop"), "heard_voice() gave 'stop'"),
    ("says it again", gives("heard_voice", 1), "gave 1 twice"),
    ("person by volts", gives("sees_person", 1023), "sees_person() gave 1023"),
    ("three floor sensors", gives("dark_floor", 7), "dark_floor() gave 7"),
    *(
        (f"pauses in {name}", pauses(name), f"{name} took 30 ms in some of")
        for name in ("now_ms", "received_frames", "set_wheels", "send_frame", "note")
    ),
    ("pauses in store_image", pauses("store_image", 12), "store_image took 12000 ms; it may take"),
    ("forgets", {"store_image": lambda self, data: None}, "load_image() gave None"),
    ("in memory only", IN_MEMORY, "has lost the image"),
    ("writes over slowly", {"store_image": writes_over_slowly}, "a cut of power in store_image"),
    ("removes first", {"store_image": removes_first}, "a cut of power in store_image"),
    ("leaves the tail", {"store_image": leaves_the_tail}, "load_image() gave"),
    (
        "stores text",
        {**changed("load_image", lambda data: data and bytearray(data)), "store_image": TinBoard.store_image},
        "bytearray",
    ),
    ("store without fsync", {"store_image": renames_only}, "call os.fsync"),
    ("store that syncs before it flushes", {"store_image": flushes_too_late}, "call os.fsync"),
    ("store that syncs another file", {"store_image": syncs_another}, "call os.fsync"),
    ("always senses carrier", senses(lambda tin: True), "senses_carrier() is True for 1000 ms without a break"),
    ("notes states", {"note": lambda self, kind, *more: {"state": 1, "frame": 2}[kind]}, "raised KeyError"),
]
# Found with an observer only.
OBSERVED: list[tuple[str, Any, str]] = [
    ("wheels a little late", wheels(go, 0.12), "it has to show within 100 ms"),
    ("turns go on", wheels(lambda d, v: go(d, v) if v or not d else None), "set_wheels(1, 0) doesn't stop"),
    ("creeps", wheels(lambda d, v: go(d, v) if v else "GO 5 5"), "doesn't stop the wheels: the left one turns by 5"),
    ("left and right swapped", wheels(lambda d, v: go((0, 2, 1)[d], v)), "left and right are swapped"),
    ("backward", wheels(lambda d, v: go(d, v, -33)), "both wheels turn backward"),
    ("right motor dead", wheels(lambda d, v: f"{go(d, v).rsplit(' ', 1)[0]} 0"), "and the right one by 0"),
    ("turns about one wheel", wheels(lambda d, v: go(0, v) if d == 0 else f"GO 0 {33 * v}"), "set_wheels(1, 1) makes"),
    ("one speed", wheels(lambda d, v: go(d, min(v, 1))), "66, 66, 66 at the levels"),
    ("speeds reversed", wheels(lambda d, v: go(d, (0, 3, 2, 1)[v])), "a higher level is faster"),
    ("stop by themselves", {"set_wheels": stops_by_itself}, "without another call"),
    ("LEDs late", leds(light, 0.3), "set_led(0) shows"),
    ("4 ignored", leds(lambda k: None if k == 4 else light(k)), "set_led(4) leaves LED 3 lit"),
    ("LEDs reversed", leds(lambda k: light((3, 2, 1, 0, 4)[k])), "set_led(0) lights LED 3"),
    ("LEDs stay", leds(lambda k: f"LIGHT {k} 3" if k < 4 else "DARK"), "leaves other LEDs"),
    ("LED goes out", {"set_led": blinks_out}, "some time after set_led(0)"),
    ("sends other parity", sends(lambda frame: frame ^ 1), "with another parity bit"),
    ("sends bytes swapped", sends(swap_bytes), "with its bytes swapped"),
    ("sends halves swapped", sends(lambda frame: frame >> 16 | (frame & 0xFFFF) << 16), "with its bytes swapped"),
    ("sends bits reversed", sends(lambda frame: int(f"{frame:032b}"[::-1], 2)), "most significant bit is sent first"),
    ("sends inverted", sends(lambda frame: frame ^ 0xFFFFFFFF), "zeros and ones exchanged"),
    ("sends 24 bits", sends(lambda frame: frame & 0xFFFFFF00), "exactly the bits"),
    ("sends twice", sends(lambda frame: frame, times=2), "sends each frame once"),
    ("sends nothing", sends(lambda frame: frame, times=0), "sent nothing"),
    ("sends late", sends(lambda frame: frame, delay_s=0.3), "was on the air only after"),
    ("writes lines", writes(lambda data: data.replace(b"\n", b"\r\n")), "write_serial added bytes"),
    ("writes nothing", writes(lambda data: b""), "write_serial lost bytes"),
    ("writes nothing while it sends", {"write_serial": writes_nothing_while_sending}, "while infrared is sent"),
    ("never senses carrier", senses(lambda tin: False), "senses_carrier() is False while"),
    ("senses marks alone", senses(lambda tin: tin.carrier), "False in the first space of a frame"),
    (
        "senses for long",
        senses(lambda t: t.carrier or t.now_s < t.carrier_until_s + 0.3),
        "still True more than 100 ms",
    ),
    ("centimetres", measures(lambda distance_mm: distance_mm // 10), "that is centimetres"),
    ("inches", measures(lambda distance_mm: round(distance_mm / 25.4)), "gives 10 where an obstacle is 250 mm away"),
    ("there and back", measures(lambda distance_mm: 2 * distance_mm), "so halve it"),
    ("0 for nothing", measures(lambda distance_mm: distance_mm, 0), "gives 0 where no obstacle is"),
    ("an old distance", measures(lambda distance_mm: 250), "gives 250 where an obstacle is 600 mm away"),
    ("a slow distance", SlowDistance, "too late for a car that drives"),
    ("nobody is seen", {"sees_person": lambda self: False}, "doesn't become True"),
    ("everybody is seen", {"sees_person": lambda self: True}, "sees_person() isn't False"),
    ("a person stays", {"sees_person": sees_for_ever, "has_seen": False}, "sees_person() isn't False"),
    ("no floor is dark", {"dark_floor": lambda self: 0}, "gives 0 where the floor under its sensors is 1"),
    ("light is dark", {"dark_floor": lambda self: 3 - self.tin.floor}, "takes light floor for dark"),
    ("sensors swapped", changed("dark_floor", lambda dark: (0, 2, 1, 3)[dark]), "the left sensor is the right one"),
    ("stop is go", changed("heard_voice", lambda voice: (0, 2, 1)[voice]), "gave 2 in 500 ms where the word 1"),
    ("deaf to go", changed("heard_voice", lambda voice: (0, 1, 0)[voice]), "gave 0 in 500 ms where the word 2"),
    (
        "never written for good",
        {"load_image": EepromTin.load_image, "store_image": lambda self, data: setattr(self.tin, "cache", data)},
        "a power failure after store_image had returned leaves None",
    ),
]
# The clock in real time.
BAD_CLOCKS = [
    ("wraps in twelve days", counts(1000, -1), "on for some days"),
    ("wraps too soon", counts(1000, 0xFFFFFFF), "neither sooner nor later"),
    ("microseconds", counts(1_000_000, 0x3FFFFFFF), "count milliseconds"),
]


def mutant(changes: Any) -> type:
    """A correct board but for ``changes``: a dict of attributes, or a class of its own."""
    if not isinstance(changes, dict):
        return changes
    return type("Mutant", (TinBoard if "store_image" in changes else EepromTin,), changes)
