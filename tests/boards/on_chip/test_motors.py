"""Motors of a MicroPython car: their pins, and no power while a direction changes."""

from motorcade.boards.on_chip.motors import Motor
from support.chip_benches import bench, board_of


def power_of(chip, forward, backward) -> int:
    return chip.duties.get(forward, 0) - chip.duties.get(backward, 0)


def test_a_driver_without_enable_has_the_pwm_on_its_direction_pins():
    a_bench = bench()
    motor = Motor(a_bench.machine, {"forward": 2, "backward": 5})
    for duty in (255, 100, 0, -100, -255):
        motor.drive(duty)
        assert power_of(a_bench.chip, 2, 5) == (abs(duty) * 65535 // 255) * (1 if duty >= 0 else -1)


def test_a_motor_changes_its_direction_without_power():
    a_bench = bench()
    board = board_of(a_bench)
    happened = []
    a_bench.chip.listeners.append(lambda *what: happened.append(what))
    board.set_wheels(1, 3)
    board.set_wheels(2, 3)
    left = a_bench.pins["left_motor"]
    levels, power, powers_at_changes = {}, 0, []
    for what, pin, value in happened:
        if what == "level" and pin in left.values():
            levels[pin] = value
            powers_at_changes.append(power)
        if (what, pin) == ("duty", left["enable"]):
            power = value
        assert not levels.get(left["forward"]) or not levels.get(left["backward"])
    assert set(powers_at_changes) == {0}
    assert power == 65535
