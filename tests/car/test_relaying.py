"""When a car sends a frame again, and what it has drawn until another word comes."""

from itertools import pairwise

import pytest

from motorcade.car import brain, frames, step
from motorcade.words.formats import CONTROL
from motorcade.words.infrared import tagged_frame, to_frame
from support.radio_hall import FORGET_MS, LEVELS, QUIET_WORD, WORDS, Hall, RadioCar, follower, image


def test_a_follower_that_is_alone_passes_its_word_on_in_longer_and_longer_intervals():
    car, intervals = follower(tagged_frame(WORDS[0], 9)), []
    for now in range(1, FORGET_MS - 1):
        step.step(car, now)
        if car.memory[brain.INTERVAL] not in intervals:
            intervals.append(car.memory[brain.INTERVAL])
    assert intervals == [110, 220, 440, 880, 1760, 3520]


@pytest.mark.parametrize(("redundancy", "sends"), [(2, 0), (3, 1)])
def test_each_copy_of_a_tag_counts_once(redundancy, sends):
    levels = (*LEVELS[: brain.REDUNDANCY], redundancy, *LEVELS[brain.REDUNDANCY + 1 :])
    car = RadioCar(9, levels=levels)
    car.switch_on(0)
    car.arriving += [tagged_frame(WORDS[0], 9)] * 2
    sent = 0
    for now in range(LEVELS[brain.FIRST_INTERVAL_MS]):
        step.step(car, now)
        sent += car.sent is not None
        car.sent = None
    assert sent == sends


WANDERS = CONTROL.encode(
    accept_ir=1, motor_enable=1, motor_direction=brain.RANDOM_FORWARD, motor_speed=1, motor_duration=3
)


@pytest.mark.parametrize(("replaced_ms", "draws"), [(1, 1), (500, 1), (501, 2), (1600, 4), (3000, 6), (9000, 6)])
def test_a_word_has_drawn_a_direction_for_each_half_second_that_it_ran(replaced_ms, draws):
    """Whatever the ticks meanwhile: cars of the same number turn alike afterwards."""
    car, twin = follower(to_frame(WANDERS)), RadioCar(9)
    twin.switch_on(0)
    for _ in range(draws):
        brain.draw(twin.memory)
    car.arriving.append(to_frame(WORDS[0]))
    step.step(car, replaced_ms)
    assert [word for _, word, _ in car.began] == [WANDERS, WORDS[0]]
    # Nothing is passed on that was heard at this moment, so nothing else was drawn.
    assert car.memory[brain.RANDOM] == twin.memory[brain.RANDOM]


def test_a_leader_of_bare_words_waits_for_the_end_of_its_frame_and_a_pause():
    hall = Hall(RadioCar(0, image((QUIET_WORD,), tagged=0)))
    hall.run(2000)
    begins_ms = [at_ms for at_ms, _, _ in hall.frames]
    shortest_ms = frames.frame_ms(to_frame(QUIET_WORD), LEVELS) + LEVELS[brain.GAP_MS]
    assert len(begins_ms) > 20
    assert all(later - earlier >= shortest_ms for earlier, later in pairwise(begins_ms))


def test_a_new_image_waits_for_the_end_of_the_old_ones_last_frame():
    car = RadioCar(0, image(WORDS[:1], tagged=0))
    car.switch_on(0)
    step.step(car, 0)
    over_ms = frames.frame_ms(car.sent, LEVELS) + LEVELS[brain.GAP_MS]
    car.image = image(WORDS[1:2], tagged=0)
    step.begin_program(car, 10)
    for now in range(10, over_ms):
        car.sent = None
        step.step(car, now)
        assert car.sent is None
    step.step(car, over_ms)
    assert car.sent == to_frame(WORDS[1])
