"""Cars that somebody drives: a servo steers their front wheels, and they move like a bicycle.

**The model** is the kinematic bicycle about the body's middle, which lies midway between the axles (Polack et al. 2017,
"The kinematic bicycle model"). With the wheel base b, front wheels turned by d and the speed v of the middle: the
middle moves at the angle s to the heading, where tan s = tan d / 2, and the heading turns by v cos s tan d / b a
second. Wheels don't skid, and the servo and the motor act without delay. Duty `motor.pwm_max` drives as fast as the
profile's fastest level.

The brain of a driven car goes on, with its infrared, its LED and its random draws; only its wheels obey the driver. Its
displacement (how far it moves in a tick, in x and y) changes with every tick, so it looks around in every tick. In
everything else it is like other cars: it pushes and is pushed.
"""

import math
from collections.abc import Sequence
from itertools import chain
from typing import Any, NamedTuple

from motorcade.car import brain
from motorcade.car.senses import NOTHING
from motorcade.config.profile import Profile
from motorcade.engine import bodies, clearance
from motorcade.engine.backend import in_kernel
from motorcade.engine.bodies import DISPLACEMENT_BITS, NOISE_MS
from motorcade.engine.geometry import FULL_TURN, ahead_of, mix
from motorcade.engine.state import DRIVEN, Arrays, Buffer, CarArrays, Driven, Floats, Now, Rules
from motorcade.words.ticks import TICKS_MASK, later_ms

# Rows of a matrix of driven cars.
WORLD = 0
NUMBER = 1  # within its world
PLACE = 2  # its index in the arrays of CarArrays
AHEAD = 3  # 2^-12 µm a tick along its heading
ASIDE = 4  # and to its left
TURN = 5  # binary angle a tick
TURNED = 6  # the same for this tick, with wheel noise
CENTRE_DEG = 90
_STEPS = 1 << DISPLACEMENT_BITS


class Motion(NamedTuple):
    """How a driven car moves in a tick: 2^-12 µm along its heading and to its left, and the angle by which it turns."""

    ahead: int
    aside: int
    turn: int


def motion_of(angle_deg: int, direction: int, speed: int, profile: Profile, tick_ms: int) -> Motion:
    """The motion of a car with its servo at ``angle_deg`` (0-180, above 90 is left), forward (1) or back (0)."""
    length = profile.speeds_mm_s[-1] * min(speed / profile.motor.pwm_max, 1.0) * tick_ms * (1 if direction else -1)
    steered = math.tan(math.radians((angle_deg - CENTRE_DEG) * profile.servo.steering_deg / CENTRE_DEG))
    ahead = length / math.sqrt(1.0 + steered * steered / 4.0)
    turn = ahead * steered / (profile.body.wheel_base_mm * 1000) / math.tau * FULL_TURN
    # Rounded towards 0, so that no car is faster than the fastest.
    return Motion(int(ahead * _STEPS), int(ahead * steered / 2.0 * _STEPS), round(turn))


@in_kernel
def find(world: int, begin: int, end: int, cars: CarArrays, driven: Driven) -> None:
    """Find the indices of the driven cars of a world again after a sort."""
    for k in range(driven.shape[1]):
        if driven[WORLD, k] != world:
            continue
        for i in range(begin, end):
            if cars.number[i] == driven[NUMBER, k]:
                driven[PLACE, k] = i


@in_kernel
def set_out(arrays: Arrays, now: Now) -> None:
    """Set the displacement of each driven car of a world for a tick, along the heading in the middle of its turn."""
    cars = arrays.cars
    driven = arrays.driven
    rules = arrays.rules
    for k in range(driven.shape[1]):
        if driven[WORLD, k] != now.world:
            continue
        i = int(driven[PLACE, k])
        ahead = float(driven[AHEAD, k])
        aside = float(driven[ASIDE, k])
        turn = float(driven[TURN, k])
        if rules.wheel_noise > 0.0 and ahead != 0.0:
            bits = mix(now.seed, cars.number[i], now.ms // NOISE_MS)
            left = 1.0 + rules.wheel_noise * rules.normals[bits & 1023]
            right = 1.0 + rules.wheel_noise * rules.normals[bits >> 10 & 1023]
            share = (left + right) / 2.0
            turn = math.floor(turn * share + (right - left) * ahead / _STEPS * rules.wheel_turn + 0.5)
            ahead, aside = ahead * share, aside * share
        driven[TURNED, k] = int(turn)
        heading = int(cars.heading[i]) + int(turn) // 2
        ahead_x, ahead_y = ahead_of(heading, rules.cosines)
        if bodies.stands(i, cars, rules) and ahead != 0.0:
            clearance.wake_near(i, arrays, now)
        cars.displacement_x[i] = math.floor(ahead * ahead_x - aside * ahead_y + 0.5)
        cars.displacement_y[i] = math.floor(ahead * ahead_y + aside * ahead_x + 0.5)
        cars.clear[i] = clearance.for_any_displacement(cars.clear[i], now.tick)


@in_kernel
def turn_round(world: int, cars: CarArrays, driven: Driven) -> None:
    """Turn each driven car of a world, after all cars have moved."""
    for k in range(driven.shape[1]):
        if driven[WORLD, k] == world:
            i = driven[PLACE, k]
            cars.heading[i] = (int(cars.heading[i]) + int(driven[TURNED, k])) & 0xFFFFFFFF


def give_back(i: int, tick: int, cars: CarArrays, rules: Rules) -> None:
    """Give the wheels of car ``i`` back to its program, between two ticks.

    Where the wheels depend on sensors, or on what the program does in the next tick, the car's turn in that tick
    sets them. Other cars may have counted on it that the car stands. Who drives by hand stops at once: the car rolls
    on from what its own program does.
    """
    now = tick * rules.tick_ms & TICKS_MASK
    last = later_ms(now, -rules.tick_ms)
    cars.displacement_x[i] = 0
    cars.displacement_y[i] = 0
    bodies.set_displacement(i, brain.wheels(cars.memory[:, i], NOTHING, last, rules.levels), cars, rules)
    cars.due[i] = now
    for j in range(cars.x.shape[0]):
        cars.clear[j] = clearance.due_now(tick)


@in_kernel
def shown_wheels(ahead: float, aside: float, speeds: Floats) -> int:
    """The wheels that a driven car shows: DRIVEN and the lowest level that is at least as fast as it is."""
    speed = math.sqrt(ahead * ahead + aside * aside) / _STEPS
    level = 0
    while level < speeds.shape[0] and speeds[level] < speed:
        level += 1
    return DRIVEN + level


def matrix_of(columns: Sequence[Sequence[int]]) -> Any:
    """The buffer of the matrix of driven cars with these columns."""
    numbers = chain.from_iterable([column[row] for column in columns] for row in range(TURNED + 1))
    return Buffer.of("int64", numbers, len(columns), TURNED + 1)


def columns_of(matrix: bytes) -> list[list[int]]:
    """The columns of a matrix of driven cars."""
    numbers = memoryview(matrix).cast("q").tolist()
    count = len(numbers) // (TURNED + 1)
    return [numbers[column::count] for column in range(count)]
