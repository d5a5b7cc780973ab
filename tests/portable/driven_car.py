"""A car on a simulated microcontroller for a minute of virtual time: uploads, driving, sensors, infrared.

Portable: CPython and MicroPython run it with the same settings and must print
the same lines (test_microcontroller.py). By itself:
``node run_micropython.mjs driven_car SETTINGS PLATFORM SEED`` with JSON for each.
"""

import json

from randomness import Random
from simulated.car_parts import Air, HcSr04, Observed
from simulated.esp32 import Esp32
from simulated.flash import Flash
from simulated.microcontroller import Clock, Collector, Implementation, Microcontroller, Usb, machine_of
from simulated.pio import Rp2
from simulated.timing import time_methods
from simulated.wifi import Wifi

from motorcade.boards.on_chip.power_on import SETTINGS_FILE, Modules, load_settings, open_board
from motorcade.car.loop import Car
from motorcade.words.infrared import frame_durations_us
from motorcade.words.ticks import TICKS_MASK

SECONDS = 60
# A loop's duration on a real board, with a few long ones for garbage collection and writes to flash.
TICKS_MS = (2, 3, 3, 4, 5, 5, 7, 12)
BYTE_US = 87
PAGE_BYTES = 256
# A file that is made, closed and renamed: a page of its folder each.
PAGES_OF_FOLDER = 3
# The clock wraps in the middle of the minute.
START_MS = TICKS_MASK - 30_000


class Bench:
    """A car's board on a simulated microcontroller, and methods that change its inputs."""

    def __init__(self, settings, platform, flash=None):
        self.chip = Microcontroller(platform, START_MS)
        self.machine = machine_of(self.chip)
        self.clock = Clock(self.chip)
        self.usb = Usb(self.chip)
        self.wifi = Wifi(self.chip)
        self.flash = flash or Flash()
        # For each image that was stored: how long that took, and whether a wheel turned meanwhile.
        self.stored = []
        self._time_flash()
        self.flash.files[SETTINGS_FILE] = json.dumps(settings).encode()
        self.pins = settings["pins"]
        self.settings = settings
        self.observed = Observed(self.chip, self.pins)
        self.sonar = HcSr04(self.chip, self.pins["ultrasonic"])
        self.air = Air(self.chip, self.pins["infrared"])
        self.collector = Collector(self.chip)
        self.modules = Modules(
            platform,
            Implementation(self.chip),
            self.machine,
            self.clock,
            self.usb,
            self.collector,
            Esp32(self.chip) if platform == "esp32" else Rp2(self.chip),
            self.flash,
            self.flash.open,
            self.usb,
            self.usb,
            self.usb,
            self.wifi.modules() if "wifi" in settings else None,
        )

    def _time_flash(self):
        """Make storing cost time; a file of an image takes a sector, and littlefs erases it as the first byte comes."""
        chip, append = self.chip, self.flash.append

        def append_slowly(path, data):
            if chip.meter:
                costs, slowest = chip.meter.costs, chip.meter.flash_is_slow
                pages = -(-len(data) // PAGE_BYTES) + PAGES_OF_FOLDER
                us = costs.erase_us[slowest] + pages * costs.page_us[slowest] + costs.file_us
                turns = any(chip.duties.get(self.pins[each]["enable"]) for each in ("left_motor", "right_motor"))
                self.stored.append((us, turns))
                chip.block_all(us)
            append(path, data)

        self.flash.append = append_slowly
        time_methods(chip, self.flash, "open", "rename", "remove", "sync", "append")

    def open(self):
        """Switch the car on and return it."""
        return Car(open_board(load_settings(self.flash.open), self.modules))

    def upload(self, at_us, data, byte_us=BYTE_US):
        """Send ``data`` byte by byte, as a serial line does."""
        serial = self.pins.get("serial")
        line = self.machine.uarts[serial["receive"]] if serial else self.usb
        for place in range(len(data)):
            self.chip.at(at_us + place * byte_us, line.arrive, data[place : place + 1])

    def hear(self, at_us, durations_us):
        """Send infrared to the car from ``at_us`` on: a mark, a space, a mark and so on."""
        self.chip.at(at_us, self.air.pulses, at_us, durations_us)

    def hear_many(self, durations_us, every_us, count):
        """Send infrared to the car now and then each ``every_us``, ``count`` times."""
        self.air.pulses(self.chip.now_us, durations_us)
        if count > 1:
            self.chip.at(self.chip.now_us + every_us, self.hear_many, durations_us, every_us, count - 1)

    def hear_frame(self, frame):
        """Send ``frame`` to the car now, as another car does."""
        self.hear(self.chip.now_us, frame_durations_us(frame))

    def say(self, at_us, data):
        """Send bytes of the voice module."""
        line = self.machine.uarts[self.pins["voice"]["receive"]]
        self.chip.at(at_us, line.arrive, data)

    def show_person(self, at_us, there):
        self.chip.at(at_us, self.chip.set_input, self.pins["pir"]["output"], there)

    def show_obstacle(self, at_us, distance_mm):
        """Put the next obstacle ``distance_mm`` away; None for no obstacle."""
        self.chip.at(at_us, self._place, distance_mm)

    def _place(self, distance_mm):
        self.sonar.distance_mm = distance_mm


def play(bench, script):
    """Schedule the events of ``script``: a list of [at_ms, what, value], as in test_microcontroller.py."""
    for at_ms, what, value in script:
        if what == "air":
            bench.chip.at(at_ms * 1000, bench.wifi.arrive, bytes(value))
        elif what == "hear many":
            bench.chip.at(at_ms * 1000, bench.hear_many, *value)
        else:
            happen = {"hear": bench.hear, "person": bench.show_person, "obstacle": bench.show_obstacle}
            happen.update({"upload": bench.upload, "say": bench.say})
            happen[what](at_ms * 1000, bytes(value) if what in ("upload", "say") else value)


def lines(settings, platform, seed, script):
    """Yield a line for each output, ``at_ms what value``, and lines of the ticks' times, which the test replays."""
    bench = Bench(settings, platform)
    random = Random(seed)
    car = bench.open()
    play(bench, script)
    while bench.chip.now_us < SECONDS * 1_000_000:
        car.tick()
        bench.observed.look()
        bench.clock.sleep_ms(random.pick(TICKS_MS))
        for at_ms, what, value in bench.observed.seen:
            yield f"{at_ms} {what} {value!r}"
        bench.observed.seen.clear()
    yield f"pings {bench.sonar.pings}"
    yield f"carrier {bench.observed.carrier_hz}"
