"""MicroPython cars on test benches, with their images and frames."""

from typing import Any

from driven_car import Bench
from simulated.flash import Flash

from motorcade.config.pins import parse_pins
from motorcade.firmware.car_files import settings_of, templates
from motorcade.words.infrared import to_frame
from support.strategies import CLASSROOM

SMALL = bytes.fromhex("01000000 64800000")
FRAME = to_frame(0xA4A80000)
ESP32 = (templates() / "esp32.toml").read_text(encoding="utf-8")
RP2040 = (templates() / "rp2040.toml").read_text(encoding="utf-8")
# A car whose parts are of all kinds beyond those of a car that somebody wires.
_ALL_KINDS = """
format = "motorcade-pins/1"
name = "Car"
chip = "{chip}"
[left_motor]
direction = 4
enable = 5
forward_is = "low"
[right_motor]
direction = 12
enable = 13
[left_rear_motor]
forward = 14
backward = 15
[right_rear_motor]
forward = 16
backward = 17
enable = 18
[motor_driver]
standby = 19
[pixels]
signal = 21
count = 3
[ultrasonic]
signal = 22
[floor]
left = {left}
right = {right}
dark = "low"
threshold = 40
[infrared]
receiver = 2
[button]
signal = 0
"""
ANALOG_PINS = {"rp2": (26, 27), "esp32": (32, 33)}


def all_kinds(platform: str) -> dict[str, Any]:
    """The settings of a follower with parts of all kinds."""
    chip = {"rp2": "rp2040", "esp32": "esp32"}[platform]
    left, right = ANALOG_PINS[platform]
    pins = parse_pins(_ALL_KINDS.format(chip=chip, left=left, right=right), "car.toml")
    return settings_of(pins, CLASSROOM, False, number=7)


def bench(is_leader: bool = False, text: str = ESP32, platform: str = "esp32", flash: Flash | None = None) -> Bench:
    return Bench(settings_of(parse_pins(text, "test.toml"), CLASSROOM, is_leader), platform, flash)


def board_of(a_bench: Bench):
    return a_bench.open().board
