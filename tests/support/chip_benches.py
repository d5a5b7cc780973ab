"""MicroPython cars on test benches, with their images and frames."""

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


def bench(is_leader: bool = False, text: str = ESP32, platform: str = "esp32", flash: Flash | None = None) -> Bench:
    return Bench(settings_of(parse_pins(text, "test.toml"), CLASSROOM, is_leader), platform, flash)


def board_of(a_bench: Bench):
    return a_bench.open().board
