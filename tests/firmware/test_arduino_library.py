"""The Arduino library as `motorcade arduino-library` writes it."""

import json
import re
import zipfile
from pathlib import Path

import pytest

from motorcade.car.brain import VOICE_GO, VOICE_STOP
from motorcade.config.pins import VoiceMap, load_pins, parse_pins
from motorcade.errors import MotorcadeError
from motorcade.firmware.arduino_library import library_folder, settings_header
from support.command_line import run
from support.strategies import CLASSROOM

UNO = (library_folder() / "uno.toml").read_text(encoding="utf-8")
VOICE = VoiceMap(9600, ((b"\xaa\x01", VOICE_STOP), (b'"go\\', VOICE_GO)))


def header(text: str = UNO, voice: VoiceMap | None = None) -> str:
    return settings_header(parse_pins(text, "car.toml"), CLASSROOM, voice)


def test_the_library_is_a_zip_file_for_the_ide(tmp_path: Path) -> None:
    done = run("arduino-library", "-o", str(tmp_path / "Motorcade.zip"), "--json")
    assert done.code == 0, done.err
    with zipfile.ZipFile(tmp_path / "Motorcade.zip") as archive:
        names = archive.namelist()
    assert {f"Motorcade/{name}" for name in json.loads(done.out)["files"]} == set(names)
    for name in ("library.properties", "keywords.txt", "src/Motorcade.h", "examples/Uno/Uno.ino", "examples/Uno/car.h"):
        assert f"Motorcade/{name}" in names
    # The IDE takes only folders with the sketch's own name.
    sketches = [Path(name) for name in names if name.endswith(".ino")]
    assert len(sketches) >= 4
    assert all(sketch.stem == sketch.parent.name for sketch in sketches)


def test_the_same_library_is_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one.zip", "two.zip"):
        assert run("arduino-library", "-o", str(tmp_path / name)).code == 0
    assert (tmp_path / "one.zip").read_bytes() == (tmp_path / "two.zip").read_bytes()


def test_a_pin_file_adds_a_sketch_for_one_car(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(
        UNO.replace("led_0 = 14", "led_0 = 17").replace("right = 17", "right = 14"), encoding="utf-8"
    )
    more = ["--pins", str(tmp_path / "mine.toml"), "--role", "follower", "--number", "70000"]
    done = run("arduino-library", "-o", str(tmp_path / "libraries"), *more)
    assert done.code == 0, done.err
    folder = tmp_path / "libraries" / "Motorcade" / "examples" / "Car"
    sketch = (folder / "Car.ino").read_text(encoding="utf-8")
    assert "const bool LEADS = false;" in sketch
    assert "const uint32_t NUMBER = 70000U;" in sketch
    assert "{17, 15, 16, 13},  // leds" in (folder / "car.h").read_text(encoding="utf-8")


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = run("arduino-library", "-o", str(tmp_path / "file" / "x.zip"))
    assert done.code != 0
    assert "x.zip" in done.err


def test_each_setting_comes_from_the_files_of_the_builder() -> None:
    text = header(UNO + "[voice]\nreceive = 19\n", VOICE)
    found = {name: value for value, name in re.findall(r"^    (.*),  // (\w+)$", text, re.MULTILINE)}
    assert found["left_motor"] == "{7, 8, 5, NO_PIN, 1}"
    assert found["infrared_sender"] == "11"
    assert found["voice"] == "19"
    assert found["voice_baud"] == "9600"
    assert found["voice_pattern_count"] == "2"
    assert f"LEVELS[] = {{{', '.join(map(str, CLASSROOM.durations_ms))}, " in text
    # Octal escapes, since a hexadecimal one would swallow a digit behind it.
    assert r'{"\252\001", 2, 1},' in text
    assert r'{"\042\147\157\134", 4, 2},' in text


@pytest.mark.parametrize(
    ("text", "voice", "says"),
    [
        (UNO + "[voice]\nreceive = 19\n", None, "--voice-map"),
        (UNO + "[voice]\nreceive = 19\n", VoiceMap(115200, VOICE.patterns), "at most 19200"),
        (UNO + "[voice]\nreceive = 19\n", VoiceMap(9600, ((b"x" * 17, VOICE_GO),)), "17 bytes"),
        (UNO.replace("enable = 5\n", ""), None, "left_motor needs a pin for enable"),
        (UNO.replace("[pir]\noutput = 12", "[serial]\ntransmit = 12\nreceive = 19"), None, "USB"),
    ],
)
def test_a_car_that_cannot_be_is_refused_in_a_sentence(text: str, voice: VoiceMap | None, says: str) -> None:
    with pytest.raises(MotorcadeError) as refused:
        header(text, voice)
    assert says in refused.value.sentence("en")
    assert refused.value.sentence("zh") != refused.value.sentence("en")


def test_a_pin_file_for_another_computer_is_refused() -> None:
    pins = load_pins(library_folder().parent / "linux" / "pins.toml")
    with pytest.raises(MotorcadeError) as refused:
        settings_header(pins, CLASSROOM)
    assert "arduino-uno" in refused.value.sentence("en")


@pytest.mark.parametrize(("chip", "macro"), [("esp32", "CONFIG_IDF_TARGET_ESP32"), ("rp2040", "ARDUINO_ARCH_RP2040")])
def test_a_car_of_each_chip_that_the_library_runs_on_gets_its_sketch(tmp_path: Path, chip: str, macro: str) -> None:
    pins = library_folder().parent / "micropython" / f"{chip}.toml"
    done = run("arduino-library", "-o", str(tmp_path), "--pins", str(pins), "--number", "3")
    assert done.code == 0, done.err
    assert "sends no infrared" in done.err
    folder = tmp_path / "Motorcade" / "examples" / "Car"
    sketch = (folder / "Car.ino").read_text(encoding="utf-8")
    assert "motorcade::ArduinoBoard<CAR> board(" in sketch
    assert "const bool LEADS = true;" in sketch
    assert "const uint32_t NUMBER = 3;" in sketch
    assert f"#if !defined({macro})\n#error" in (folder / "car.h").read_text(encoding="utf-8")


def test_a_voice_module_that_the_sketch_could_not_hear_is_refused() -> None:
    text = (library_folder().parent / "micropython" / "esp32.toml").read_text(encoding="utf-8")
    with pytest.raises(MotorcadeError) as refused:
        header(text + "[voice]\nreceive = 16\n", VOICE)
    assert "install-firmware" in refused.value.sentence("en")


def test_the_example_for_any_board_drives_no_pin() -> None:
    text = (library_folder() / "examples" / "AnyBoard" / "car.h").read_text(encoding="utf-8")
    found = {name: value for value, name in re.findall(r"^    (.*),  // (\w+)$", text, re.MULTILINE)}
    numbers = ("levels", "baud", "range_mm", "drive_duties", "turn_duties", "left_duty_percent", "right_duty_percent")
    numbers += ("pixel_count", "floor_dark", "floor_threshold", "button_pressed", "button_threshold", "voice_patterns")
    numbers += ("voice_baud", "voice_pattern_count")
    pins = {name: value for name, value in found.items() if name not in numbers}
    assert len(pins) == 16
    # The last one of a motor is a level.
    assert all(re.fullmatch(r"{?NO_PIN(, NO_PIN)*(, 1)?}?", value) for value in pins.values())
