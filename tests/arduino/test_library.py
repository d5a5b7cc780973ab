"""The Arduino library compiles without a warning, its examples too, for each board."""

import subprocess
from pathlib import Path

import pytest
from scripts import debian

from motorcade.car.brain import VOICE_GO, VOICE_STOP
from motorcade.config.pins import VoiceMap, load_pins, parse_pins
from motorcade.firmware.arduino_library import library_files, library_folder, sketch_files
from support.arduino_build import MEGA, UNO
from support.strategies import CLASSROOM

MOST_FLASH_BYTES = 26 * 1024
MOST_RAM_BYTES = 1638
HERE = Path(__file__).parent
VOICE = VoiceMap(9600, ((b"\xaa\x01", VOICE_STOP), (b"\xaa\x02", VOICE_GO)))

FULLEST = """
format = "motorcade-pins/1"
name = "Fullest"
chip = "arduino-uno"
left_motor = {direction = 7, enable = 6, forward_is = "low"}
right_motor = {forward = 4, backward = 8, enable = 5}
motor_driver = {standby = 3}
leds = {led_0 = "A4", led_1 = "A5", led_2 = 10}
pixels = {signal = 13, count = 2}
ultrasonic = {signal = "A3"}
floor = {left = "A0", right = "A1", dark = "low", threshold = 40}
pir = {output = 12}
infrared = {receiver = 2, sender = 11}
voice = {receive = 9}
button = {signal = "A7", threshold = 5}
horn = {signal = "A2"}
"""


@pytest.mark.parametrize(
    ("example", "target"),
    [
        ("Uno", UNO),
        ("Mega", MEGA),
        ("mBot", UNO),
        ("AnyBoard", UNO),
        ("AnyBoard", MEGA),
        ("OwnBoard", UNO),
        ("SetNumber", UNO),
    ],
)
def test_an_example_compiles_for_its_board(compiled, example, target) -> None:
    program = compiled(f"examples/{example}", target)
    assert program.flash_bytes <= (MOST_FLASH_BYTES if target is UNO else 64 * 1024)
    assert program.ram_bytes <= (MOST_RAM_BYTES if target is UNO else 4096)


@pytest.mark.parametrize(("file", "target"), [("uno.toml", UNO), ("mega.toml", MEGA)])
def test_a_car_with_a_voice_module_or_without_most_parts_compiles(compiled, file, target) -> None:
    text = (library_folder() / file).read_text(encoding="utf-8")
    bare = text[: text.index("[left_motor]")] + "[infrared]\nreceiver = 2\n"
    for pins, voice in ((text + "[voice]\nreceive = 19\n", VOICE), (bare, None)):
        own = sketch_files(parse_pins(pins, file), CLASSROOM, is_leader=False, number=7, voice=voice)
        program = compiled("examples/Car", target, {**library_files(), **own})
        assert program.flash_bytes <= (MOST_FLASH_BYTES if target is UNO else 64 * 1024)


def test_the_fullest_car_of_an_unos_chip_fits(compiled) -> None:
    pins = parse_pins(FULLEST, "fullest.toml")
    own = sketch_files(pins, CLASSROOM, is_leader=False, number=7, voice=VOICE)
    program = compiled("examples/Car", UNO, {**library_files(), **own})
    assert program.flash_bytes <= MOST_FLASH_BYTES
    # The deepest stack comes to that.
    assert program.ram_bytes <= MOST_RAM_BYTES - 160


@pytest.mark.parametrize(("example", "target", "board"), [("Uno", MEGA, "Arduino Uno"), ("Mega", UNO, "Arduino Mega")])
def test_an_example_for_another_board_says_so(tools, tmp_path, example, target, board) -> None:
    """Otherwise an Uno's pins give a Mega's carrier to a motor."""
    folder = library_folder()
    command = ["avr-gcc", f"-mmcu={target.mcu}", "-std=gnu++11", "-x", "c++", "-fsyntax-only", f"-I{folder / 'src'}"]
    done = subprocess.run([*command, folder / "examples" / example / "car.h"], capture_output=True, encoding="utf-8")
    assert done.returncode
    assert f"This sketch is for the pins of this board: {board}" in done.stderr
    assert "Choose it in the menu Tools" in done.stderr


@pytest.mark.parametrize("example", ["Uno", "Mega", "mBot"])
def test_an_example_for_an_avr_says_so_on_any_other_chip(gxx, example) -> None:
    done = syntax(gxx, f"examples/{example}/{example}.ino")
    assert done.returncode
    assert "For another board begin with the example AnyBoard" in done.stderr


@pytest.mark.parametrize(
    ("chip", "macros"),
    [("esp32", ("ARDUINO_ARCH_ESP32", "CONFIG_IDF_TARGET_ESP32")), ("rp2040", ("ARDUINO_ARCH_RP2040",))],
)
def test_a_car_of_another_chip_compiles_for_it_alone(gxx, tmp_path, chip, macros) -> None:
    """With a mock of Arduino's core, since there is no compiler for these chips here."""
    pins = load_pins(library_folder().parent / "micropython" / f"{chip}.toml")
    for path, data in sketch_files(pins, CLASSROOM, is_leader=False, number=7).items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(data)
    sketch = tmp_path / "examples" / "Car" / "Car.ino"
    done = syntax(gxx, sketch, *macros)
    assert done.returncode == 0, done.stderr
    assert "Choose it in the menu Tools" in syntax(gxx, sketch, "ARDUINO_ARCH_SAMD").stderr


@pytest.mark.parametrize("example", ["AnyBoard", "OwnBoard"])
def test_an_example_for_any_board_compiles_for_a_core_that_has_little(gxx, example) -> None:
    done = syntax(gxx, f"examples/{example}/{example}.ino")
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def gxx(install_lock) -> str:
    with install_lock:
        found = debian.find_or_install("g++", *debian.FOR_TESTS["g++"])
    if found is None:
        pytest.skip("no g++ (on Debian: apt-get install g++)")
    return str(found)


def syntax(gxx: str, sketch: str | Path, *macros: str) -> subprocess.CompletedProcess[str]:
    """Check a sketch for a chip that defines ``macros``, with a mock of Arduino's core."""
    flags = ["-std=c++11", "-x", "c++", "-fsyntax-only", "-Wall", "-Werror", "-include", "Arduino.h"]
    include = [f"-I{HERE / 'mock'}", f"-I{library_folder() / 'src'}"]
    command = [gxx, *flags, *include, *(f"-D{macro}" for macro in macros), str(library_folder() / sketch)]
    return subprocess.run(command, capture_output=True, encoding="utf-8")
