"""What a running word does with LEDs, obstacles, people, voices and the floor, and what it leaves alone."""

import pytest

from motorcade.car import brain, next_wakeup
from motorcade.car.senses import NOTHING
from motorcade.config.profile import built_in_profile, levels_of
from motorcade.words.formats import CONTROL

LEVELS = levels_of(built_in_profile("classroom"))
DRIVES = {"motor_enable": 1, "motor_speed": 2, "motor_duration": 2}
AVOIDS = {**DRIVES, "avoid_enable": 1, "avoid_radius": 2, "avoid_duration": 1}
AHEAD = (0, 2)


class Running:
    """The brain of a car that began a word at 0 ms."""

    def __init__(self, **fields):
        self.memory = [0] * brain.SIZE
        brain.switch_on(self.memory, 1, 0)
        self.begin(0, **fields)

    def begin(self, now, **fields):
        brain.begin_word(self.memory, CONTROL.encode(forward=1, **fields), now)

    def wheels(self, now=500, **senses):
        state = brain.wheels(self.memory, NOTHING._replace(**senses), now, LEVELS)
        return (state >> 2, state & 3)

    def led(self, now=500):
        return brain.lit_led(self.memory, now, LEVELS)

    def looks_mm(self, now):
        return brain.looks_mm(self.memory, now, LEVELS)

    def watches(self, now=500):
        return bool(brain.watches(self.memory, now, LEVELS))


@pytest.mark.parametrize("image", [(0,), (2 << 16 | 1 << 8, CONTROL.encode(**DRIVES), CONTROL.encode(led_duration=1))])
def test_a_leader_without_states_runs_no_word(image):
    car = Running(**DRIVES)
    assert brain.leader_start(car.memory, image, 500) == brain.leader_step(car.memory, image, 9000, LEVELS) == 0
    assert car.memory[brain.RUNNING] == 0


@pytest.mark.parametrize("which", range(4))
@pytest.mark.parametrize("level", [1, 2, 3])
def test_each_led_is_lit_as_long_as_the_word_says(which, level):
    car = Running(led_which=which, led_duration=level)
    assert car.led(0) == car.led(1000 * level - 1) == which
    assert car.led(1000 * level) == brain.NO_LED


@pytest.mark.parametrize("speed", [1, 2, 3])
@pytest.mark.parametrize("direction", [0, 1, 2])
def test_the_wheels_turn_as_long_as_the_word_says(direction, speed):
    car = Running(motor_enable=1, motor_direction=direction, motor_speed=speed, motor_duration=2)
    assert car.wheels(0) == car.wheels(1999) == (direction, speed)
    assert car.wheels(2000) == (0, 0)


def test_a_word_without_its_motor_bit_drives_nowhere():
    car = Running(motor_speed=2, motor_duration=2, led_duration=3)
    assert car.wheels(0) == (0, 0)
    assert brain.motor_ms(car.memory[brain.WORD], LEVELS) == 0


def test_a_word_without_its_avoid_bit_avoids_nothing():
    car = Running(**{**AVOIDS, "avoid_enable": 0})
    assert car.wheels(0, obstacle_mm=1) == AHEAD
    assert car.looks_mm(0) == 0


@pytest.mark.parametrize(("fields", "length_ms"), [(DRIVES, 2000), ({**AVOIDS, "avoid_duration": 3}, 3000), ({}, 100)])
def test_a_word_lasts_as_long_as_its_longest_block_or_the_idle_time(fields, length_ms):
    assert brain.length_ms(CONTROL.encode(**fields), LEVELS) == length_ms


def test_the_shortest_duration_of_a_profile_is_a_duration():
    assert brain.length_ms(CONTROL.encode(**DRIVES), (0, 0, 1, *LEVELS[3:])) == 1


@pytest.mark.parametrize("radius", range(4))
def test_an_obstacle_nearer_than_the_radius_turns_the_car_right(radius):
    car, radius_mm = Running(**{**AVOIDS, "avoid_radius": radius}), 100 * (radius + 1)
    assert car.wheels(0, obstacle_mm=radius_mm - 1) == (brain.RIGHT, 2)
    assert car.wheels(0, obstacle_mm=radius_mm) == AHEAD
    # When the time to avoid is over.
    assert car.wheels(999, obstacle_mm=1) == (brain.RIGHT, 2)
    assert car.wheels(1000, obstacle_mm=1) == AHEAD


@pytest.mark.parametrize("radius", range(4))
def test_the_ultrasonic_sensor_works_only_while_an_obstacle_matters(radius):
    fields = {**AVOIDS, "avoid_radius": radius, "avoid_duration": 2, "motor_duration": 1}
    assert Running(**fields).looks_mm(0) == Running(**fields).looks_mm(999) == 100 * (radius + 1)
    # Then the wheels stand, or it avoids nothing any more.
    assert Running(**fields).looks_mm(1000) == 0
    assert Running(**AVOIDS).looks_mm(1000) == 0
    assert Running(**{**AVOIDS, "motor_speed": 0}).looks_mm(0) == 0
    for speed in (1, 3):
        assert Running(**{**AVOIDS, "motor_speed": speed}).looks_mm(0) == 300


def test_a_person_stops_only_a_word_that_minds_people():
    assert Running(**DRIVES).wheels(person=1) == AHEAD
    assert Running(**DRIVES, pir=1).wheels(person=1) == (0, 0)
    assert Running(**DRIVES, pir=1).wheels(person=0) == AHEAD


def test_a_car_watches_for_what_its_word_minds_and_for_nothing_else():
    """A car that watches nothing sleeps."""
    assert not Running(**DRIVES).watches()
    assert Running(**DRIVES, pir=1).watches()
    assert Running(**DRIVES, floor=1).watches()
    assert Running(**AVOIDS).watches()
    assert not Running(**AVOIDS).watches(1000)
    assert not Running(**DRIVES, floor=1).watches(2000)
    over = Running(**DRIVES, pir=1)
    over.memory[brain.RUNNING] = 0
    assert not over.watches()


def test_a_voice_stops_a_word_that_listens_and_the_next_one_if_it_listens_too():
    car = Running(**DRIVES, voice=1)
    brain.hear_voice(car.memory, brain.VOICE_STOP)
    assert car.wheels() == (0, 0)
    car.begin(0, **DRIVES, voice=1)
    assert car.wheels() == (0, 0)
    brain.hear_voice(car.memory, brain.VOICE_GO)
    assert car.wheels() == AHEAD
    brain.hear_voice(car.memory, brain.VOICE_STOP)
    # A word that doesn't listen drives.
    car.begin(0, **DRIVES)
    assert car.wheels() == AHEAD
    brain.hear_voice(car.memory, brain.VOICE_STOP)
    assert car.wheels() == AHEAD


def test_random_driving_over_a_line_drives_on_light_floor_and_stands_on_dark():
    car = Running(**{**DRIVES, "motor_direction": brain.RANDOM_FORWARD, "motor_duration": 3}, floor=1)
    directions = {car.wheels(now)[0] for now in range(0, 3000, 500)}
    assert {car.wheels(now)[1] for now in range(0, 3000, 500)} == {2}
    assert directions <= {brain.FORWARD, brain.LEFT, brain.RIGHT}
    for dark in (1, 2, 3):
        assert car.wheels(2500, dark_floor=dark) == (0, 0)


@pytest.mark.parametrize("number", [0, 1, 0xFFFFFFFE, 0xFFFFFFFF])
def test_a_car_of_any_number_draws_random_numbers(number):
    """The generator would stay at 0 for ever."""
    memory = [0] * brain.SIZE
    brain.switch_on(memory, number, 0)
    assert all(brain.draw(memory) for _ in range(3))


# The floor: the protocol's section "The floor"


FORWARD, LEFT, RIGHT, RANDOM = range(4)
LIGHT, LEFT_DARK, RIGHT_DARK, BOTH = range(4)


def floor_fields(direction, speed=2, duration=2, floor=1, **more):
    motor = {"motor_enable": 1, "motor_direction": direction, "motor_speed": speed, "motor_duration": duration}
    return {"floor": floor, **motor, **more}


def over_floor(direction, *arguments, **more):
    return Running(**floor_fields(direction, *arguments, **more))


@pytest.mark.parametrize(
    ("dark", "direction"), [(LIGHT, FORWARD), (LEFT_DARK, LEFT), (RIGHT_DARK, RIGHT), (BOTH, FORWARD)]
)
@pytest.mark.parametrize("speed", [1, 2, 3])
def test_forward_follows_a_line_at_the_level_of_the_word(dark, direction, speed):
    assert over_floor(FORWARD, speed).wheels(dark_floor=dark) == (direction, speed)


@pytest.mark.parametrize("direction", [FORWARD, LEFT, RIGHT])
@pytest.mark.parametrize("dark", [LIGHT, LEFT_DARK, RIGHT_DARK, BOTH])
def test_without_the_bit_the_floor_means_nothing(direction, dark):
    assert over_floor(direction, floor=0).wheels(dark_floor=dark) == (direction, 2)


@pytest.mark.parametrize("direction", [LEFT, RIGHT])
@pytest.mark.parametrize("dark", [LEFT_DARK, RIGHT_DARK, BOTH])
def test_a_turn_ends_at_a_line_and_stands_until_its_time_is_over(direction, dark):
    car = over_floor(direction)
    assert car.wheels(300, dark_floor=LIGHT) == (direction, 2)
    assert car.wheels(400, dark_floor=dark) == (0, 0)
    # It stands on, whatever it senses then.
    assert car.wheels(1900, dark_floor=LIGHT) == (0, 0)


@pytest.mark.parametrize("direction", [LEFT, RIGHT])
def test_a_turn_first_leaves_the_line_under_it(direction):
    car = over_floor(direction)
    assert car.wheels(0, dark_floor=BOTH) == car.wheels(199, dark_floor=BOTH) == (direction, 2)
    assert car.wheels(200, dark_floor=BOTH) == (0, 0)
    # A car that stands over a line is woken at that moment.
    assert next_wakeup.word_rest_ms(over_floor(direction).memory, 0, LEVELS) == 200


def test_the_next_turn_looks_for_its_own_line():
    car = over_floor(LEFT, duration=1)
    assert car.wheels(500, dark_floor=BOTH) == (0, 0)
    car.begin(1000, **floor_fields(RIGHT))
    assert car.wheels(1300, dark_floor=LIGHT) == (RIGHT, 2)


def test_wandering_stands_on_dark_and_goes_on_with_the_same_draws():
    on_dark, free = over_floor(RANDOM, duration=3), over_floor(RANDOM, duration=3)
    for now in range(0, 3000, 100):
        way = free.wheels(now, dark_floor=LIGHT)
        if now % 700 < 300:
            assert on_dark.wheels(now, dark_floor=1 + now // 100 % 3) == (0, 0)
        else:
            assert on_dark.wheels(now, dark_floor=LIGHT) == way


@pytest.mark.parametrize("direction", [FORWARD, LEFT, RANDOM])
def test_people_voices_and_obstacles_come_before_the_floor(direction):
    guarded = {"pir": 1, "voice": 1, "avoid_enable": 1, "avoid_radius": 3, "avoid_duration": 3}
    assert over_floor(direction, **guarded).wheels(500, dark_floor=LEFT_DARK, person=1) == (0, 0)
    assert over_floor(direction, **guarded).wheels(500, dark_floor=LEFT_DARK, obstacle_mm=399) == (RIGHT, 2)
    stopped = over_floor(direction, **guarded)
    brain.hear_voice(stopped.memory, brain.VOICE_STOP)
    assert stopped.wheels(500, dark_floor=RIGHT_DARK) == (0, 0)


@pytest.mark.parametrize("fields", [floor_fields(FORWARD, speed=0), {"floor": 1, "led_duration": 1}])
def test_a_car_that_stands_does_not_mind_the_floor(fields):
    car = Running(**fields)
    assert car.wheels(100, dark_floor=LEFT_DARK) == (0, 0)
    assert not brain.minds_floor(car.memory, 100, LEVELS)


def test_the_floor_is_watched_as_long_as_the_motor_runs():
    car = over_floor(FORWARD, duration=1, led_which=1, led_duration=3)
    assert car.watches(999)
    assert not car.watches(1000)
