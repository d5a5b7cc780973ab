"""Boards that differ from a correct one (`support.observed_tin`) in one thing each, and what check_board says of it."""

import os
from collections.abc import Callable
from functools import partial
from typing import Any

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.words.infrared import to_frame
from support.observed_tin import FullTin
from support.tin_car import FRAME_S, TinBoard


def go(direction: int, level: int, power: int = 33) -> str:
    left, right = ((1, 1), (-1, 1), (1, -1))[direction]
    return f"GO {left * level * power} {right * level * power}"


def commands(method: str, text: Callable[..., str | None], delay_s: float = 0.0) -> dict[str, Any]:
    """A board whose ``method`` gives the command ``text``, and none for None."""

    def call(self, *asked):
        command = text(*asked)
        if command is not None:
            self.tin.command(command, delay_s)

    return {method: call}


wheels, leds = partial(commands, "set_wheels"), partial(commands, "set_led")


def light(which: int) -> str:
    return "DARK" if which == 4 else f"LIGHT {which}"


def sends(change: Callable[[int], int], delay_s: float = 0.0, times: int = 1) -> dict[str, Any]:
    def send_frame(self, frame):
        self.tin.busy_until_s = self.tin.now_s + FRAME_S
        for time in range(times):
            self.tin.command(f"SEND {change(frame):08X}", delay_s + time * 0.06)

    return {"send_frame": send_frame}


def reads(change: Callable[[bytes], bytes]) -> dict[str, Any]:
    return {"read_serial": lambda self: change(TinBoard.read_serial(self))}


def reads_at_most(count: int) -> dict[str, Any]:
    """A ring that keeps so many bytes between two calls."""
    return reads(lambda data: data[:count])


def reads_one(self):
    data, self.tin.line_in = self.tin.line_in[:1], self.tin.line_in[1:]
    return data


def writes(change: Callable[[bytes], bytes]) -> dict[str, Any]:
    return {"write_serial": lambda self, data: TinBoard.write_serial(self, change(data))}


def throws_away_while_sending(self):
    """What comes while interrupts are off is gone, but for the two bytes that the hardware holds."""
    data = TinBoard.read_serial(self)
    return data[:2] if self.is_sending() else data


def empties_the_line(self, frame):
    FullTin.send_frame(self, frame)
    self.tin.line_in = b""


def writes_nothing_while_sending(self, data):
    if not self.is_sending():
        TinBoard.write_serial(self, data)


def pauses(method: str, duration_s: float = 0.03, every: int = 40) -> dict[str, Any]:
    """A board of which every 40th call of ``method`` takes 30 ms, unless told otherwise."""

    def call(self, *arguments):
        self.calls += 1
        if self.calls % every == 0:
            self.tin.now_s += duration_s
        return getattr(FullTin, method)(self, *arguments)

    return {method: call, "calls": 0}


def measures(change: Callable[[int], int], nothing: int = NOTHING_IN_SIGHT_MM) -> dict[str, Any]:
    def obstacle_mm(self):
        return nothing if self.tin.distance_mm is None else change(self.tin.distance_mm)

    return {"obstacle_mm": obstacle_mm}


def senses(busy: Callable[[Any], bool]) -> dict[str, Any]:
    return {"senses_carrier": lambda self: busy(self.tin)}


def sees(person: Callable[[bool], bool]) -> dict[str, Any]:
    return {"sees_person": lambda self: person(self.tin.person)}


def looks_down(dark: Callable[[int], int]) -> dict[str, Any]:
    return {"dark_floor": lambda self: dark(self.tin.floor)}


def hears(change: Callable[[int], int]) -> dict[str, Any]:
    return {"heard_voice": lambda self: change(FullTin.heard_voice(self))}


def stores(store: Callable[[Any, bytes], None]) -> dict[str, Any]:
    return {"store_image": store}


class Stops:
    """Wheels that a motor driver's watchdog stops after 300 ms without a call."""

    def set_wheels(self, direction, speed_level):
        self.tin.command(go(direction, speed_level))
        self.tin.command("GO 0 0", 0.3)


class OneBehind:
    """Wheels and LEDs that do what the call before asked."""

    wheels_asked = (0, 0)
    led_asked = 4

    def set_wheels(self, direction, speed_level):
        self.tin.command(go(*self.wheels_asked))
        self.wheels_asked = (direction, speed_level)

    def set_led(self, which):
        self.tin.command(light(self.led_asked))
        self.led_asked = which


class IgnoresSameDirection:
    """Wheels whose level is set only when their direction changes."""

    direction = -1

    def set_wheels(self, direction, speed_level):
        if direction != self.direction or speed_level == 0:
            self.tin.command(go(direction, speed_level))
        self.direction = direction if speed_level else -1


class BlinksOut:
    def set_led(self, which):
        self.tin.command(light(which))
        self.tin.command("DARK", 0.5)


class SeesOnce:
    """A person is seen for ever after."""

    has_seen = False

    def sees_person(self):
        self.has_seen = self.has_seen or self.tin.person
        return self.has_seen


class OldDistance:
    """The first distance stays."""

    first_mm = None

    def obstacle_mm(self):
        if self.tin.distance_mm is not None and self.first_mm is None:
            self.first_mm = self.tin.distance_mm
        return self.first_mm or NOTHING_IN_SIGHT_MM


class SlowDistance:
    """An average over the pings of two seconds."""

    before = (0.0, NOTHING_IN_SIGHT_MM)

    def obstacle_mm(self):
        now_mm = FullTin.obstacle_mm(self)
        if now_mm != self.before[1] and self.tin.now_s > self.before[0] + 0.7:
            self.before = (self.tin.now_s, now_mm)
        return self.before[1]


def swapped(direction: int) -> int:
    return (0, 2, 1)[direction]


def swap_bytes(frame: int) -> int:
    return int.from_bytes(frame.to_bytes(4, "big"), "little")


def reverse_bits(frame: int) -> int:
    return int(f"{frame:032b}"[::-1], 2)


def rename_only(self, data):
    new = self.path.with_suffix(".new")
    new.write_bytes(data)
    new.replace(self.path)


def flush_too_late(self, data):
    new = self.path.with_suffix(".new")
    with new.open("wb") as file:
        file.write(data)
        os.fsync(file.fileno())
    new.replace(self.path)


def sync_too_late(self, data):
    new = self.path.with_suffix(".new")
    new.write_bytes(data)
    new.replace(self.path)
    with self.path.open("rb+") as file:
        os.fsync(file.fileno())


def sync_another(self, data):
    new = self.path.with_suffix(".new")
    new.write_bytes(data)
    with self.path.with_suffix(".log").open("wb") as file:
        os.fsync(file.fileno())
    new.rename(self.path)


def cache_only(self, data):
    self.tin.cache = data


def half_only(self, data):
    self.tin.cache = data
    self.tin.eeprom = data[:1024]


LEVELS = TinBoard.levels
OFTEN_CALLED: tuple[str, ...] = (
    "now_ms",
    "read_serial",
    "write_serial",
    "received_frames",
    "senses_carrier",
    "is_sending",
)
OFTEN_CALLED += ("obstacle_mm", "sees_person", "heard_voice", "set_wheels", "set_led", "note")
# Found without an observer: the name, what the board has instead, and part of the sentence.
ALONE: list[tuple[str, Any, str]] = [
    ("levels in seconds", {"levels": (0, 1, 2, 3, 1, 2, 3, 4, 5, 6, 7, 8, *LEVELS[12:])}, "look like seconds"),
    ("durations in seconds", {"levels": (0, 1, 2, 3, *LEVELS[4:])}, "durations_ms (0, 1, 2, 3)"),
    ("dwells in seconds", {"levels": (*LEVELS[:4], *range(1, 9), *LEVELS[12:])}, "dwells_ms (1, 2,"),
    ("durations in µs", {"levels": (0, 10**6, 2 * 10**6, 3 * 10**6, *LEVELS[4:])}, "look like microseconds"),
    ("radii in cm", {"levels": (*LEVELS[:12], 10, 20, 30, 40, *LEVELS[16:])}, "look like centimetres"),
    ("no words", {"most_words": 0}, "most_words is 0"),
    ("too many words", {"most_words": 2044}, "most_words is 2044"),
    ("no bytes a tick", {"bytes_a_tick": 0}, "bytes_a_tick is 0"),
    ("no words a tick", {"words_a_tick": None}, "words_a_tick is None"),
    ("keeps 64 bytes", reads_at_most(64), "read_serial lost bytes"),
    ("keeps 128 bytes", reads_at_most(128), "read_serial lost bytes"),
    ("reads a byte a call", {"read_serial": reads_one}, "read_serial lost bytes"),
    ("reads 7 bits", reads(lambda data: bytes(byte & 0x7F for byte in data)), "read_serial changed bytes"),
    ("reads lines", reads(lambda data: data.replace(b"\r", b"\n")), "is 0x0A in place of 0x0D"),
    ("drops zeros", reads(lambda data: data.replace(b"\0", b"")), "0x00, is the first that is missing"),
    ("drops flow control", reads(lambda data: data.translate(None, b"\x11\x13")), "read_serial lost bytes"),
    ("throws bytes away while it sends", {"read_serial": throws_away_while_sending}, "while infrared is sent"),
    ("empties the line when it sends", {"send_frame": empties_the_line}, "while infrared is sent"),
    *((f"pauses in {name}", pauses(name), f"{name} took 30 ms in some of 120 calls") for name in OFTEN_CALLED),
    ("pauses in send_frame", pauses("send_frame"), "send_frame took 30 ms in some of 45 calls"),
    (
        "pauses in load_image",
        {**pauses("load_image", 3), "store_image": FullTin.store_image},
        "load_image took 3000 ms; it may take 1500 ms at most",
    ),
    ("stores slowly", pauses("store_image", 3, 1), "store_image took 3000 ms; it may take 1500 ms at most"),
    ("pauses in store_image", pauses("store_image", 12), "store_image took 12000 ms; it may take"),
    ("always senses carrier", senses(lambda tin: True), "senses_carrier() is True for 1000 ms without a break"),
    ("carrier upside down", senses(lambda tin: not tin.carrier), "senses_carrier() is True for 1000 ms"),
    ("store without fsync", stores(rename_only), "call os.fsync"),
    ("store that syncs before it flushes", stores(flush_too_late), "call os.fsync"),
    ("store that syncs after the rename", stores(sync_too_late), "call os.fsync"),
    ("store that syncs another file", stores(sync_another), "call os.fsync"),
]
# Found with an observer only.
OBSERVED: list[tuple[str, Any, str]] = [
    ("wheels late", wheels(go, 0.3), "the wheels do what set_wheels(0, 1) asks"),
    ("wheels a little late", wheels(go, 0.12), "it has to show within 100 ms"),
    ("zero ignored", wheels(lambda d, v: go(d, v) if v else None), "set_wheels(0, 0) doesn't stop"),
    ("turns go on", wheels(lambda d, v: go(d, v) if v or not d else None), "set_wheels(1, 0) doesn't stop"),
    ("creeps", wheels(lambda d, v: go(d, v) if v else "GO 5 5"), "doesn't stop the wheels: the left one turns by 5"),
    ("left and right swapped", wheels(lambda d, v: go(swapped(d), v)), "left and right are swapped"),
    ("backward", wheels(lambda d, v: go(d, v, -33)), "both wheels turn backward"),
    ("left motor turned round", wheels(lambda d, v: f"GO {-33 * v} {33 * v}"), "set_wheels(0, 1) makes the left wheel"),
    ("right motor dead", wheels(lambda d, v: f"{go(d, v).rsplit(' ', 1)[0]} 0"), "and the right one by 0"),
    ("no turns", wheels(lambda d, v: go(0, v)), "set_wheels(1, 1) makes the left wheel turn by 33"),
    ("turns about one wheel", wheels(lambda d, v: go(0, v) if d == 0 else f"GO 0 {33 * v}"), "set_wheels(1, 1) makes"),
    ("left only", wheels(lambda d, v: go(min(d, 1), v)), "left and right are swapped: set_wheels(2, 1)"),
    ("one speed", wheels(lambda d, v: go(d, min(v, 1))), "66, 66, 66 at the levels"),
    ("speeds reversed", wheels(lambda d, v: go(d, (0, 3, 2, 1)[v])), "a higher level is faster"),
    ("stop by themselves", Stops, "without another call"),
    ("one call behind", OneBehind, "set_wheels(0, 1) makes"),
    ("level only with direction", IgnoresSameDirection, "a higher level is faster"),
    ("LEDs late", leds(light, 0.3), "set_led(0) shows"),
    ("4 ignored", leds(lambda k: None if k == 4 else light(k)), "set_led(4) leaves LED 3 lit"),
    ("LEDs reversed", leds(lambda k: light((3, 2, 1, 0, 4)[k])), "set_led(0) lights LED 3"),
    ("LEDs from 1", leds(lambda k: light((4, 0, 1, 2, 4)[k])), "set_led(0) lights LED none"),
    (
        "LEDs stay",
        leds(lambda k: "LIGHT " + " ".join(map(str, range(k + 1))) if k < 4 else "DARK"),
        "leaves other LEDs",
    ),
    (
        "LEDs upside down",
        leds(lambda k: "LIGHT " + " ".join(str(o) for o in range(4) if o != k)),
        "set_led(0) lights LED",
    ),
    ("LED 2 dead", leds(lambda k: "DARK" if k == 2 else light(k)), "set_led(2) lights LED none"),
    ("LED goes out", BlinksOut, "some time after set_led(0)"),
    ("sends other parity", sends(lambda frame: frame ^ 1), "with another parity bit"),
    ("sends no parity", sends(lambda frame: frame & ~1), "with another parity bit"),
    ("sends parity of its own", sends(lambda frame: to_frame(frame) ^ 1), "with another parity bit"),
    ("sends bytes swapped", sends(swap_bytes), "with its bytes swapped"),
    ("sends halves swapped", sends(lambda frame: frame >> 16 | (frame & 0xFFFF) << 16), "with its bytes swapped"),
    ("sends words of 16 bits swapped", sends(lambda f: swap_bytes(f >> 16 | (f & 0xFFFF) << 16)), "its bytes swapped"),
    ("sends bits reversed", sends(reverse_bits), "the most significant bit is sent first"),
    ("sends inverted", sends(lambda frame: frame ^ 0xFFFFFFFF), "zeros and ones exchanged"),
    ("sends 24 bits", sends(lambda frame: frame & 0xFFFFFF00), "exactly the bits"),
    ("sends twice", sends(lambda frame: frame, times=2), "sends each frame once"),
    ("sends nothing", sends(lambda frame: frame, times=0), "sent nothing"),
    ("sends late", sends(lambda frame: frame, delay_s=0.3), "was on the air only after"),
    ("writes lines", writes(lambda data: data.replace(b"\n", b"\r\n")), "write_serial added bytes"),
    ("writes 64 bytes", writes(lambda data: data[:64]), "write_serial lost bytes"),
    ("writes 7 bits", writes(lambda data: bytes(byte & 0x7F for byte in data)), "write_serial changed bytes"),
    ("writes nothing", writes(lambda data: b""), "write_serial lost bytes"),
    ("writes twice", writes(lambda data: data * 2), "write_serial added bytes"),
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
    ("µs of the echo", measures(lambda distance_mm: distance_mm * 2000 // 343), "gives 1457 where"),
    ("always 0", measures(lambda distance_mm: 0, 0), "gives 0 where an obstacle"),
    ("0 for nothing", measures(lambda distance_mm: distance_mm, 0), "gives 0 where no obstacle is"),
    ("range for nothing", measures(lambda distance_mm: distance_mm, 4000), "gives 4000 where no obstacle is"),
    ("never an obstacle", measures(lambda distance_mm: NOTHING_IN_SIGHT_MM), "where an obstacle is 250 mm away"),
    ("an old distance", OldDistance, "gives 250 where an obstacle is 600 mm away"),
    ("a slow distance", SlowDistance, "too late for a car that drives"),
    ("nobody is seen", sees(lambda person: False), "doesn't become True"),
    ("everybody is seen", sees(lambda person: True), "sees_person() isn't False"),
    ("PIR upside down", sees(lambda person: not person), "sees_person() isn't False"),
    ("a person stays", SeesOnce, "sees_person() isn't False"),
    ("no floor is dark", looks_down(lambda dark: 0), "gives 0 where the floor under its sensors is 1"),
    ("light is dark", looks_down(lambda dark: 3 - dark), "takes light floor for dark"),
    ("sensors swapped", looks_down(lambda dark: (0, 2, 1, 3)[dark]), "the left sensor is the right one"),
    ("deaf to words", hears(lambda voice: 0), "where the word 1 was spoken"),
    ("stop is go", hears(lambda voice: (0, 2, 1)[voice]), "gave 2 in 500 ms where the word 1"),
    ("deaf to go", hears(lambda voice: (0, 1, 0)[voice]), "gave 0 in 500 ms where the word 2"),
    (
        "never written for good",
        {"store_image": cache_only},
        "a power failure after store_image had returned leaves None",
    ),
    ("half written for good", {"store_image": half_only}, "a power failure after store_image had returned leaves"),
]


def mutant(changes: Any, kind: type) -> type:
    """A board of ``kind`` that has ``changes``: a dict of attributes, or a class with them."""
    if isinstance(changes, dict):
        return type("Mutant", (kind,), changes)
    return type("Mutant", (changes, kind), {})
