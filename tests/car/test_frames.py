"""Which frames a car takes and sends, and when: after restarts, absences and among two leaders."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.car import brain, frames, step
from motorcade.words.formats import CONTROL
from motorcade.words.infrared import slot_tags, tag_of, tagged_frame, to_frame
from support.radio_hall import DWELL_MS, FORGET_MS, LEVELS, QUIET_WORD, WORDS, Hall, RadioCar, follower, image


def begun_words(car, since_ms=0):
    return [(at_ms // DWELL_MS, tag) for at_ms, _, tag in car.began if at_ms >= since_ms]


def test_followers_begin_each_slot_once_beyond_a_round_of_tags():
    leader, *followers = cars = [RadioCar(0, image(WORDS[:1])), RadioCar(1), RadioCar(2)]
    Hall(*cars).run(70 * DWELL_MS)
    for car in followers:
        assert begun_words(car) == [(slot, slot % 31 + 1) for slot in range(70)]
        # The same word begins in every slot at the same time, but for the leader's wait for free air.
        lags_ms = [at_ms % DWELL_MS for at_ms, _, _ in car.began]
        assert max(lags_ms) - min(lags_ms) < 100
    assert leader.memory[brain.TAG] == 8


@pytest.mark.parametrize("away_s", [5, 15, 40, 600])
def test_a_follower_that_was_away_takes_the_next_word(away_s):
    cars = [RadioCar(0, image()), RadioCar(1), RadioCar(2)]
    hall = Hall(*cars)
    hall.run(20_000)
    hall.away.add(2)
    hall.run(away_s * 1000)
    hall.away.clear()
    back_ms = hall.now
    hall.run(2 * DWELL_MS)
    slot = back_ms // DWELL_MS
    begun = begun_words(cars[2], back_ms)
    assert (slot + 1, (slot + 1) % 31 + 1) in begun
    assert len(begun) == len(set(begun)) <= 3


@pytest.mark.parametrize("slots", [20, 40])
def test_a_restarted_leader_is_followed_within_the_time_to_forget_and_a_slot(slots):
    """After 20 slots its tag 1 looks old, after 40 new."""
    cars = [RadioCar(0, image()), RadioCar(1), RadioCar(2)]
    hall = Hall(*cars)
    hall.run(slots * DWELL_MS - 1000)
    cars[0].switch_on(hall.now)
    restart_ms = hall.now
    hall.run(3 * DWELL_MS)
    for car in cars[1:]:
        begun = [(at_ms, tag) for at_ms, _, tag in car.began if at_ms > restart_ms]
        assert begun[0][0] - restart_ms < FORGET_MS + DWELL_MS
        assert {tag for _, tag in begun} <= {1, 2, 3}


def test_the_word_of_a_new_image_begins_at_once():
    cars = [RadioCar(0, image(WORDS[:2])), RadioCar(1)]
    hall = Hall(*cars)
    hall.run(DWELL_MS + 3000)
    cars[0].image = image(WORDS[2:])
    step.begin_program(cars[0], hall.now)
    at_ms = hall.now
    hall.run(500)
    assert [(word, tag) for begun_ms, word, tag in cars[1].began if begun_ms > at_ms] == [(WORDS[2], 3)]


def test_a_replaced_tag_that_a_neighbour_still_sends_does_not_come_back():
    car = follower(tagged_frame(WORDS[0], 20))
    step.step(car, FORGET_MS)
    for second, tag, word in ((1, 1, WORDS[1]), (2, 20, WORDS[0]), (3, 2, WORDS[2])):
        car.arriving.append(tagged_frame(word, tag))
        step.step(car, FORGET_MS + 1000 * second)
    assert [tag for _, _, tag in car.began] == [20, 1, 2]


def test_a_bare_word_after_a_tagged_one_waits_for_free_air():
    car = follower(tagged_frame(WORDS[0], 1))
    for now in range(1, FORGET_MS + 1):
        car.busy = 1
        step.step(car, now)
    car.arriving.append(to_frame(WORDS[1]))
    for now in range(FORGET_MS + 1, FORGET_MS + 4):
        car.busy, car.sent = 0, None
        step.step(car, now)
        assert car.sent is None


@pytest.mark.parametrize("tagged", [0, 1])
def test_a_leader_that_was_silent_for_a_week_sends_a_new_image(tagged):
    car = RadioCar(0, (0,))
    car.switch_on(0)
    week_ms = (1 << 29) + 10
    car.image = image(tagged=tagged)
    step.begin_program(car, week_ms)
    step.step(car, week_ms)
    assert car.sent is not None


@pytest.mark.parametrize("tagged", [0, 1])
def test_a_leader_whose_ticks_are_late_does_not_fall_behind(tagged):
    car = RadioCar(0, image(tagged=tagged))
    car.switch_on(0)
    begins_ms = 19 * DWELL_MS
    for now in range(0, begins_ms + 800, 797):
        step.step(car, now)
    # Slot 19 has the last of the four words.
    assert car.memory[brain.SLOT] == 3


def test_a_leader_sends_three_frames_in_half_a_second_and_then_seldom():
    hall = Hall(RadioCar(0, image((QUIET_WORD,))))
    hall.run(DWELL_MS)
    at_ms = [at for at, _, _ in hall.frames]
    assert at_ms[0] == 0
    assert sum(at <= 500 + LEVELS[brain.SENSE_MS] for at in at_ms) == 3
    assert 5 <= len(at_ms) <= 10
    assert {tag_of(frame) for _, _, frame in hall.frames} == {1}


def test_a_leader_sends_tagged_frames_of_the_seeds_word():
    hall = Hall(RadioCar(0, image()))
    hall.run(DWELL_MS + 100)
    assert [frame for at, _, frame in hall.frames if at in (0, DWELL_MS)] == [
        tagged_frame(WORDS[0], 1),
        tagged_frame(WORDS[1], 2),
    ]


def test_cars_are_silent_when_no_new_tag_comes():
    cars = [RadioCar(0, image()), RadioCar(1), RadioCar(2)]
    hall = Hall(*cars)
    hall.run(1000)
    hall.away.add(0)
    hall.run(30_000)
    assert max(at for at, _, _ in hall.frames) < FORGET_MS + 1000


def test_a_word_without_forward_is_not_passed_on():
    cars = [RadioCar(0, image((QUIET_WORD,))), RadioCar(1)]
    hall = Hall(*cars)
    hall.run(3 * DWELL_MS)
    assert {number for _, number, _ in hall.frames} == {0}


@pytest.mark.parametrize(
    ("held", "tag", "begins"),
    [(5, 5, 0), (5, 6, 1), (5, 20, 1), (5, 21, 0), (5, 4, 0), (31, 1, 1), (1, 31, 0), (20, 4, 1)],
)
def test_a_car_begins_a_word_with_a_newer_tag_only(held, tag, begins):
    car = follower(tagged_frame(WORDS[0], held))
    car.arriving.append(tagged_frame(WORDS[1], tag))
    step.step(car, 100)
    assert len(car.began) == 1 + begins


def test_the_same_word_with_a_newer_tag_begins_again():
    car = follower(tagged_frame(WORDS[0], 1), tagged_frame(WORDS[0], 2))
    assert [tag for _, _, tag in car.began] == [1, 2]


@pytest.mark.parametrize(("at_ms", "begins"), [(FORGET_MS - 1, 0), (FORGET_MS, 1)])
def test_a_bare_word_is_taken_when_the_tag_is_forgotten(at_ms, begins):
    car = follower(tagged_frame(WORDS[0], 1))
    car.arriving.append(to_frame(WORDS[1]))
    step.step(car, at_ms)
    assert len(car.began) == 1 + begins


@pytest.mark.parametrize(("tag", "begins"), [(20, 0), (19, 1), (21, 1), (60, 1)])
def test_a_car_that_has_forgotten_takes_every_tag_but_its_own(tag, begins):
    car = follower(tagged_frame(WORDS[0], 20))
    car.arriving.append(tagged_frame(WORDS[1], tag))
    step.step(car, FORGET_MS)
    assert len(car.began) == 1 + begins


def test_an_older_tag_makes_a_car_repeat_its_own_soon():
    car = follower(tagged_frame(WORDS[0], 9))
    for now in range(1, 5000):
        step.step(car, now)
    car.sent = None
    car.arriving.append(tagged_frame(WORDS[1], 8))
    sent_ms = []
    for now in range(5000, 5200):
        car.sent = None
        step.step(car, now)
        if car.sent is not None:
            sent_ms.append(now - 5000)
            assert car.sent == tagged_frame(WORDS[0], 9)
    first_ms = LEVELS[brain.FIRST_INTERVAL_MS]
    assert first_ms // 2 <= sent_ms[0] <= first_ms + LEVELS[brain.SENSE_MS]


@pytest.mark.parametrize("replaces", [False, True])
def test_a_car_that_receives_its_tag_twice_in_an_interval_is_silent_in_it(replaces):
    car = follower(tagged_frame(WORDS[0], 20 if replaces else 9))
    now, sent = 0, []
    if replaces:
        now = FORGET_MS
        car.arriving.append(tagged_frame(WORDS[0], 9))
        step.step(car, now)
    end_ms = now + 9000
    while now < end_ms:
        now += 1
        car.sent = None
        if now % 10 == 0:
            car.arriving.append(tagged_frame(WORDS[0], 9))
        step.step(car, now)
        sent += [now] if car.sent is not None else []
    assert sent == []


@pytest.mark.parametrize("missing", [0, 1])
def test_a_car_is_silent_in_an_interval_from_that_copy_of_its_tag_on_that_makes_enough(missing):
    car = follower(tagged_frame(WORDS[0], 9))
    # The frame that began the word counts too.
    car.arriving += [tagged_frame(WORDS[0], 9)] * (LEVELS[brain.REDUNDANCY] - 1 - missing)
    sent = []
    for now in range(1, LEVELS[brain.FIRST_INTERVAL_MS]):
        step.step(car, now)
        sent += [car.sent] if car.sent else []
        car.sent = None
    assert sent == [tagged_frame(WORDS[0], 9)] * missing


def test_a_bare_word_that_comes_again_while_it_runs_does_not_begin_again():
    car = follower(to_frame(WORDS[0]))
    end_ms = brain.length_ms(WORDS[0], LEVELS)
    for now in (1, end_ms // 2, end_ms - 1, end_ms):
        car.arriving.append(to_frame(WORDS[0]))
        step.step(car, now)
    assert [at_ms for at_ms, _, _ in car.began] == [0, end_ms]


@given(st.integers(0, 0x1FFFFF), st.integers(1, 31), st.lists(st.integers(0, 31), min_size=1, max_size=3, unique=True))
def test_a_tagged_frame_with_one_to_three_flipped_bits_is_lost(word, tag, bits):
    car = follower(tagged_frame(WORDS[0], tag - 1 or 31))
    car.arriving.append(tagged_frame(word << 11, tag) ^ sum(1 << bit for bit in bits))
    step.step(car, 1)
    assert len(car.began) == 1
    kinds = (brain.LOST_PARITY, brain.LOST_CHECK, brain.LOST_RESERVED, brain.LOST_REMOTE)
    parity, *others = [car.memory[kind] for kind in kinds]
    # Flipped bits can take the whole tag away; then the frame looks bare and is ignored.
    assert parity + sum(others) <= 1
    # They can also make it look like one of a remote control, whose parity means nothing.
    assert parity == len(bits) % 2 or others[-1]


def test_a_wrong_check_is_counted_by_itself():
    car = follower(tagged_frame(WORDS[0], 5) ^ 0b11 << 20)
    assert car.began == []
    assert car.memory[brain.LOST_CHECK] == 1


# Its frames with the tags 19 and 31 end as a remote control's do.
LIKE_REMOTE = CONTROL.encode(accept_ir=1, forward=1, motor_enable=1, motor_direction=2, motor_speed=3, motor_duration=3)


@pytest.mark.parametrize("frame", [tagged_frame(LIKE_REMOTE, 19), tagged_frame(LIKE_REMOTE, 31), 0x807F_E01F, 0x04FB])
def test_a_frame_that_ends_like_a_remote_controls_is_refused_and_counted_by_itself(frame):
    car = follower(frame)
    assert car.began == []
    lost = [car.memory[place] for place in (brain.LOST_PARITY, brain.LOST_RESERVED, brain.LOST_CHECK)]
    assert (car.memory[brain.LOST_REMOTE], lost) == (1, [0, 0, 0])


@pytest.mark.parametrize("words", [(LIKE_REMOTE,), (LIKE_REMOTE, WORDS[1])])
def test_no_slot_is_lost_by_a_word_that_looks_like_a_remote_control(words):
    others = [RadioCar(1), RadioCar(2)]
    Hall(RadioCar(0, image(words)), *others).run(70 * DWELL_MS)
    tags = slot_tags(words, 70)
    assert tags != [slot % 31 + 1 for slot in range(70)]
    for car in others:
        assert begun_words(car) == list(enumerate(tags))
        assert [word for _, word, _ in car.began] == [words[slot % len(words)] for slot in range(70)]


def test_bare_and_tagged_leaders_in_one_hall():
    tagged, bare = RadioCar(0, image()), RadioCar(1, image((QUIET_WORD,), tagged=0))
    car = RadioCar(2)
    hall = Hall(tagged, car)
    hall.run(DWELL_MS)
    hall.cars = (*hall.cars, bare)
    bare.switch_on(hall.now)
    hall.run(2 * DWELL_MS)
    # The bare leader never leaves the air free, so the tagged one falls silent; the car then follows the bare one.
    tags = [tag for _, _, tag in car.began]
    assert tags[0] == 1
    assert tags[-1] == 0


def test_of_two_tagged_leaders_a_car_follows_whose_tags_are_newer():
    first, second, car = RadioCar(0, image()), RadioCar(1, image(WORDS[::-1])), RadioCar(2)
    hall = Hall(first, car)
    hall.run(3 * DWELL_MS)
    hall.cars = (first, second, car)
    second.switch_on(hall.now)
    hall.run(5 * DWELL_MS)
    assert begun_words(car) == [(slot, slot + 1) for slot in range(8)]
    assert {word for at_ms, word, _ in car.began} <= set(WORDS)


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
