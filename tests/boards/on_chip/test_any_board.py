"""Cars on MicroPython whose parts are of other kinds than those of a car that somebody wires."""

import pytest
from driven_car import Bench

from motorcade.boards.on_chip.any_board import COLOURS
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import FORWARD, LEFT, NO_LED, RIGHT
from support.chip_benches import ANALOG_PINS, all_kinds


def bench_of(platform: str) -> Bench:
    return Bench(all_kinds(platform), platform)


@pytest.mark.parametrize("platform", ANALOG_PINS)
def test_motors_of_all_kinds_turn_together(platform):
    bench = bench_of(platform)
    board = bench.open().board
    levels, duties = bench.chip.levels, bench.chip.duties
    assert levels[19] == 1  # the driver is awake
    for direction, level, left, right in ((FORWARD, 3, 1, 1), (LEFT, 2, -1, 1), (RIGHT, 1, 1, -1), (FORWARD, 0, 0, 0)):
        board.set_wheels(direction, level)
        power = (0, 85, 170, 255)[level] * 65535 // 255
        assert duties[5] == duties[13] == duties[18] == power
        if level:
            assert (levels.get(4, 0), levels.get(12, 0)) == (left < 0, right > 0)
        assert duties[14] - duties[15] == left * power
        assert (levels.get(16, 0), levels.get(17, 0)) == (right > 0, right < 0)


def test_each_side_gets_its_share_of_the_duties():
    bench = Bench(all_kinds("rp2") | {"duty_percents": [90, 100]}, "rp2")
    bench.open().board.set_wheels(LEFT, 3)
    assert (bench.chip.duties[5], bench.chip.duties[15]) == (229 * 65535 // 255,) * 2
    assert (bench.chip.duties[13], bench.chip.duties[18]) == (65535, 65535)


@pytest.mark.parametrize("platform", ANALOG_PINS)
def test_all_pixels_show_the_colour_of_the_led(platform):
    bench = bench_of(platform)
    sent = []
    bench.chip.listeners.append(lambda what, pin, value: sent.append((pin, value)) if what == "pixels" else None)
    board = bench.open().board
    # A leader is yellow and a follower blue until its program lights an LED; nobody holds this one's button.
    shown = [NO_LED, 1]
    for which in (0, 1, 2, 3, NO_LED):
        board.set_led(which)
        shown.append(which)
    expected = [(21, bytes(COLOURS[which]) * 3) for which in shown]
    if platform == "rp2":
        expected = [(21, int.from_bytes(bytes((*COLOURS[which], 0)), "big")) for which in shown for _ in range(3)]
    assert sent == expected


@pytest.mark.parametrize("platform", ANALOG_PINS)
def test_the_sensors_of_a_shop_car_are_read(platform):
    bench = bench_of(platform)
    left, right = ANALOG_PINS[platform]
    board = bench.open().board
    for left_volts, right_volts, dark in ((0, 0, 3), (65535, 0, 2), (20000, 30000, 1), (30000, 65535, 0)):
        bench.chip.levels.update({left: left_volts, right: right_volts})
        assert board.dark_floor() == dark
    # The ping itself is no echo.
    for distance_mm, expected in ((None, NOTHING_IN_SIGHT_MM), (150, 150), (None, NOTHING_IN_SIGHT_MM)):
        bench.sonar.distance_mm = distance_mm
        found = []
        for _ in range(80):
            found.append(board.obstacle_mm())
            bench.clock.sleep_ms(5)
        assert abs(found[-1] - expected) <= 1
        assert min(found) >= 149


# A button that nobody presses connects its pin with nothing.
@pytest.mark.parametrize(("level", "leads"), [(0, True), (None, False)])
def test_whoever_holds_the_button_at_power_on_has_a_leader(level, leads):
    bench = bench_of("rp2")
    if level is not None:
        bench.chip.levels[0] = level
    assert bench.open().board.is_leader is leads
