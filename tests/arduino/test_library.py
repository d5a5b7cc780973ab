"""The Arduino library compiles without a warning, its examples too, for each board."""

import subprocess

import pytest

from motorcade.car.brain import VOICE_GO, VOICE_STOP
from motorcade.config.pins import VoiceMap, parse_pins
from motorcade.firmware.arduino_library import library_files, library_folder, sketch_files
from support.arduino_build import MEGA, UNO
from support.strategies import CLASSROOM

MOST_FLASH_BYTES = 24 * 1024
MOST_RAM_BYTES = 1638
VOICE = VoiceMap(9600, ((b"\xaa\x01", VOICE_STOP), (b"\xaa\x02", VOICE_GO)))


@pytest.mark.parametrize(
    ("example", "target"),
    [("Uno", UNO), ("Mega", MEGA), ("AnyBoard", UNO), ("AnyBoard", MEGA), ("OwnBoard", UNO), ("SetNumber", UNO)],
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


@pytest.mark.parametrize(("example", "target", "board"), [("Uno", MEGA, "Arduino Uno"), ("Mega", UNO, "Arduino Mega")])
def test_an_example_for_another_board_says_so(tools, tmp_path, example, target, board) -> None:
    """Otherwise an Uno's pins give a Mega's carrier to a motor."""
    folder = library_folder()
    command = ["avr-gcc", f"-mmcu={target.mcu}", "-std=gnu++11", "-x", "c++", "-fsyntax-only", f"-I{folder / 'src'}"]
    done = subprocess.run([*command, folder / "examples" / example / "car.h"], capture_output=True, encoding="utf-8")
    assert done.returncode
    assert f"This sketch is for the pins of an {board}" in done.stderr
    assert "Choose that board in the menu Tools" in done.stderr
