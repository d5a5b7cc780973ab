"""A car whose profile was measured drives in a simulated world as it does on the floor: it bends, and it rolls on."""

import math
from dataclasses import replace

import pytest

from motorcade import Pose, Program, World, compile_program, formation, forward, open_table, pir, together
from motorcade.config.calibration import MOVES, fit, measured_profile
from motorcade.config.profile import MeasuredWheels, built_in_profile
from motorcade.engine import kernels
from motorcade.mats import Person
from motorcade.service.calibration import LAMP_S, UNPLUG_S, move_image

CLASSROOM = built_in_profile("classroom")
MEASURED = replace(
    CLASSROOM, speeds_mm_s=(0, 91, 185, 270), turn_rates_deg_s=(0, 40, 80, 118), wheels=MeasuredWheels(-300, 90)
)
BEGINS_MS = (UNPLUG_S + LAMP_S) * 1000


def read(profile, move):
    """What a ruler shows after a move of a simulated car: mm ahead and to the left, or degrees."""
    world = World(open_table(formation(1)), [move_image(move, CLASSROOM)], profile=profile)
    world.run(BEGINS_MS)
    before = world.snapshot()
    # Longer than anything rolls on.
    world.run(move.seconds * 1000 + 2000)
    after = world.snapshot()
    heading = float(before.heading[0])
    if move.turns:
        turned = math.degrees(float(after.heading[0]) - heading)
        return ((turned if move.direction == "left" else -turned) % 360,)
    x_mm = 1000 * float(after.x_m[0] - before.x_m[0])
    y_mm = 1000 * float(after.y_m[0] - before.y_m[0])
    across = math.cos(heading), math.sin(heading)
    return x_mm * across[0] + y_mm * across[1], y_mm * across[0] - x_mm * across[1]


def test_a_simulated_car_is_measured_as_what_its_profile_says():
    found = fit({move.key: [read(MEASURED, move)] for move in MOVES})
    again = measured_profile(found, CLASSROOM, MEASURED.name)
    assert again.wheels.drift_mrad_per_m == pytest.approx(-300, abs=2)
    assert again.wheels.stopping_ms == pytest.approx(90, abs=1)
    assert again.speeds_mm_s == MEASURED.speeds_mm_s
    assert again.turn_rates_deg_s[3] == 118


def test_a_car_that_is_given_back_rolls_on_from_nothing():
    """Its program drives, but for the person in front of it."""
    mat = replace(open_table((Pose(0, 0),), tick_ms=20), people=(Person(((0.0, 1.0, 0.0),)),))
    world = World(mat, [compile_program(Program([together(forward(3, speed=3), pir())])).image], MEASURED)
    world.drive(0, speed=MEASURED.motor.pwm_max)
    world.run(500)
    world.give_back(0)
    given_back = world.snapshot().x_m[0]
    world.run(1000)
    assert world.snapshot().x_m[0] == given_back > 0.1


@pytest.mark.parametrize("wheels", [MeasuredWheels(), MeasuredWheels(left_duty_percent=90)])
def test_a_car_that_drives_straight_on_is_stepped_where_something_happens(monkeypatch, wheels):
    """A car of one state has a turn every 3 s; between them it moves on at once."""
    ticks = []
    step_cars = kernels.step_cars

    def counted(arrays, now):
        ticks.append(now.tick)
        return step_cars(arrays, now)

    monkeypatch.setattr(kernels, "step_cars", counted)
    image = compile_program(Program([forward(3)])).image
    world = World(open_table(formation(1)), [image], replace(CLASSROOM, wheels=wheels), kernels="interpreted")
    world.run(30_000)
    assert world.snapshot().x_m[0] > 1
    assert len(ticks) < 300
