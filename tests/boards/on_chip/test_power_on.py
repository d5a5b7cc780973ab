"""A MicroPython car from power-on to its end: with few parts, without settings, with faults."""

import json

import pytest
from simulated.flash import Flash
from simulated.microcontroller import Reset

from motorcade.boards.on_chip import power_on
from motorcade.boards.on_chip.parts import ImageFile
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.config.pins import parse_pins
from motorcade.firmware.car_files import settings_of
from support.chip_benches import FRAME, SMALL, bench
from support.strategies import CLASSROOM


def test_a_stopped_car_switches_its_wheels_and_leds_off(capsys):
    flash = Flash()
    ImageFile("car.image", flash, flash.open).save(SMALL)
    a_bench = bench(is_leader=True, flash=flash)
    lit = []
    a_bench.chip.listeners.append(lambda *what: lit.append(what))
    power_on.start(a_bench.modules, lambda: a_bench.chip.now_us > 500_000)
    assert ("duty", 25, 180 * 257) in lit
    a_bench.observed.look()
    assert a_bench.chip.duties[25] == a_bench.chip.duties[33] == 0
    assert not any(a_bench.chip.levels.get(pin) for pin in (18, 19, 21, 22))
    assert capsys.readouterr().out == ""


def test_an_interrupt_returns_to_a_prompt_that_obeys_ctrl_c(capsys):
    a_bench, characters = bench(is_leader=True), []
    a_bench.chip.at(90_000, lambda: characters.append(a_bench.usb.interrupt_character))
    a_bench.chip.at(100_000, a_bench.usb.arrive, b"\x03\x03\x03")
    power_on.start(a_bench.modules, lambda: a_bench.chip.now_us > 5_000_000)
    assert a_bench.chip.now_us < 200_000
    assert characters == [-1]
    assert a_bench.usb.interrupt_character == 3
    assert "Ctrl-D starts it again" in capsys.readouterr().out


@pytest.mark.parametrize("content", [None, b"", b"{", b"[]", b"{}", json.dumps({"format": "motorcade-car/9"}).encode()])
def test_a_board_without_its_settings_says_how_to_get_them(content, capsys):
    a_bench = bench()
    if content is None:
        del a_bench.flash.files["car.json"]
    else:
        a_bench.flash.files["car.json"] = content
    power_on.start(a_bench.modules, lambda: False)
    assert "install-firmware" in capsys.readouterr().out


def test_a_failing_car_stops_prints_the_error_and_restarts(capsys):
    a_bench = bench(is_leader=True)

    def fail():
        raise MemoryError

    with pytest.raises(Reset):
        power_on.start(a_bench.modules, lambda: a_bench.chip.now_us > 100_000 and fail())
    assert "starts again" in capsys.readouterr().out
    assert a_bench.chip.duties[25] == 0


def test_a_car_without_a_number_gets_one_from_its_chip():
    first, second = (bench().open().board.number for _ in range(2))
    assert first == second
    a_bench = bench()
    a_bench.machine.unique_id = lambda: b"another"
    assert a_bench.open().board.number != first


def test_missing_parts_find_nothing_and_do_nothing():
    text = 'format = "motorcade-pins/1"\nname = "Bare"\nchip = "esp32"\n[leds]\nled_2 = 21\n'
    wanted = settings_of(parse_pins(text, "bare.toml"), CLASSROOM, False)
    full = bench()
    board = power_on.open_board(wanted, full.modules)
    board.send_frame(FRAME)
    board.set_wheels(0, 3)
    board.set_led(1)
    assert not any(full.chip.levels.get(pin) for pin in (18, 19, 21, 22, 25, 26, 4))
    board.set_led(2)
    assert full.chip.levels[21] == 1
    assert (board.is_sending(), board.senses_carrier(), board.received_frames()) == (False, False, ())
    assert (board.obstacle_mm(), board.sees_person(), board.heard_voice()) == (NOTHING_IN_SIGHT_MM, False, 0)
    assert board.dark_floor() == 0
