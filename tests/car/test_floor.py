"""What a car does over dark and light floor: the protocol's section "The floor"."""

import pytest

from motorcade.car import brain, next_wakeup
from motorcade.car.senses import NOTHING
from motorcade.config.profile import built_in_profile, levels_of
from motorcade.words.formats import CONTROL

LEVELS = levels_of(built_in_profile("classroom"))
FORWARD, LEFT, RIGHT, RANDOM = range(4)
LIGHT, LEFT_DARK, RIGHT_DARK, BOTH = range(4)


def word_of(direction, speed=2, duration=2, floor=1, **more):
    motor = {"motor_enable": 1, "motor_direction": direction, "motor_speed": speed, "motor_duration": duration}
    return CONTROL.encode(forward=1, floor=floor, **motor, **more)


class Driver:
    """The brain of a leader that runs one word."""

    def __init__(self, word):
        self.memory = [0] * brain.SIZE
        brain.switch_on(self.memory, 1, 0)
        brain.leader_start(self.memory, (0x01000000, word), 0)

    def wheels(self, dark_floor, now, **senses):
        state = brain.wheels(self.memory, NOTHING._replace(dark_floor=dark_floor, **senses), now, LEVELS)
        return (state >> 2, state & 3)


@pytest.mark.parametrize(
    ("dark", "direction"), [(LIGHT, FORWARD), (LEFT_DARK, LEFT), (RIGHT_DARK, RIGHT), (BOTH, FORWARD)]
)
@pytest.mark.parametrize("speed", [1, 2, 3])
def test_forward_follows_a_line_at_the_level_of_the_word(dark, direction, speed):
    assert Driver(word_of(FORWARD, speed)).wheels(dark, 500) == (direction, speed)


@pytest.mark.parametrize("direction", [FORWARD, LEFT, RIGHT])
@pytest.mark.parametrize("dark", [LIGHT, LEFT_DARK, RIGHT_DARK, BOTH])
def test_without_the_bit_the_floor_means_nothing(direction, dark):
    assert Driver(word_of(direction, floor=0)).wheels(dark, 500) == (direction, 2)


@pytest.mark.parametrize("direction", [LEFT, RIGHT])
@pytest.mark.parametrize("dark", [LEFT_DARK, RIGHT_DARK, BOTH])
def test_a_turn_ends_at_a_line_and_stands_until_its_time_is_over(direction, dark):
    driver = Driver(word_of(direction))
    assert driver.wheels(LIGHT, 300) == (direction, 2)
    assert driver.wheels(dark, 400) == (0, 0)
    # It stands on, whatever it senses then.
    assert driver.wheels(LIGHT, 1900) == (0, 0)


@pytest.mark.parametrize("direction", [LEFT, RIGHT])
def test_a_turn_first_leaves_the_line_under_it(direction):
    driver = Driver(word_of(direction))
    assert driver.wheels(BOTH, 0) == driver.wheels(BOTH, 199) == (direction, 2)
    assert driver.wheels(BOTH, 200) == (0, 0)
    # A car that stands over a line is woken at that moment.
    assert next_wakeup.word_rest_ms(Driver(word_of(direction)).memory, 0, LEVELS) == 200


def test_the_next_turn_looks_for_its_own_line():
    driver = Driver(word_of(LEFT, duration=1))
    driver.memory[brain.HOLDS] = 1
    assert driver.wheels(BOTH, 500) == (0, 0)
    brain.begin_word(driver.memory, word_of(RIGHT), 1000)
    assert driver.wheels(LIGHT, 1300) == (RIGHT, 2)


def test_wandering_stands_on_dark_and_goes_on_with_the_same_draws():
    on_dark, free = Driver(word_of(RANDOM, duration=3)), Driver(word_of(RANDOM, duration=3))
    for now in range(0, 3000, 100):
        way = free.wheels(LIGHT, now)
        if now % 700 < 300:
            assert on_dark.wheels(1 + now // 100 % 3, now) == (0, 0)
        else:
            assert on_dark.wheels(LIGHT, now) == way


@pytest.mark.parametrize("direction", [FORWARD, LEFT, RANDOM])
def test_people_voices_and_obstacles_come_before_the_floor(direction):
    guarded = word_of(direction, pir=1, voice=1, avoid_enable=1, avoid_radius=3, avoid_duration=3)
    assert Driver(guarded).wheels(LEFT_DARK, 500, person=1) == (0, 0)
    assert Driver(guarded).wheels(LEFT_DARK, 500, obstacle_mm=399) == (RIGHT, 2)
    stopped = Driver(guarded)
    brain.hear_voice(stopped.memory, brain.VOICE_STOP)
    assert stopped.wheels(RIGHT_DARK, 500) == (0, 0)


@pytest.mark.parametrize("word", [word_of(FORWARD, speed=0), CONTROL.encode(forward=1, floor=1, led_duration=1)])
def test_a_car_that_stands_does_not_mind_the_floor(word):
    driver = Driver(word)
    assert driver.wheels(LEFT_DARK, 100) == (0, 0)
    assert not brain.minds_floor(driver.memory, 100, LEVELS)


def test_the_floor_is_watched_as_long_as_the_motor_runs():
    driver = Driver(word_of(FORWARD, duration=1, led_which=1, led_duration=3))
    assert brain.watches(driver.memory, 999, LEVELS)
    assert not brain.watches(driver.memory, 1000, LEVELS)
