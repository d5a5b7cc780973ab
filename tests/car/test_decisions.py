"""Leaders that decide: the brain against a second interpreter of the protocol's section, and each rule by itself."""

from itertools import pairwise
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motorcade.car import brain, decisions, frames, next_wakeup, step
from motorcade.car.senses import Senses
from motorcade.config.profile import levels_of
from motorcade.words.flow import CALL, CHANCE, COUNT, COUNTER, IN_TURN, JUMP, OBSTACLE, PERSON, RETURN, TELL, VOICE
from motorcade.words.formats import FLOW, STATE
from motorcade.words.image import Image, holds_a_tell, image_words
from motorcade.words.infrared import tag_of, word_of
from motorcade.words.ticks import TICKS_MASK
from support.deciding_leader import OFF, DecidingLeader, deciding_images
from support.strategies import BRISK, CLASSROOM

BEGINS_MS = st.sampled_from([0, 12_345, TICKS_MASK - 3000])
NEAR = Senses(150, 0, 0)
SOMEBODY = Senses(1 << 20, 1, 0)


class Leader:
    """A leader whose senses a test sets; the ``car`` of `motorcade.car.step`."""

    leads = True

    def __init__(self, image, profile=CLASSROOM, now_ms=0):
        self.image, self.levels = image_words(image), levels_of(profile)
        self.memory, self.decisions = [0] * brain.SIZE, bytearray(decisions.SIZE)
        self.senses, self.voice, self.busy = OFF, 0, 0
        self.looks, self.began, self.sent = [], [], []
        self.ended, self.executed = [], []
        self.wheels = None
        brain.switch_on(self.memory, 1, now_ms & TICKS_MASK)
        self.begin(now_ms)

    def begin(self, now_ms):
        decisions.survey(self.decisions, self.image, 0, len(self.image), self.levels)
        step.begin_program(self, now_ms & TICKS_MASK)

    def tick(self, now_ms, senses=OFF, voice=0):
        self.senses, self.voice, self.now_ms = senses, voice, now_ms
        step.step(self, now_ms & TICKS_MASK)
        return self

    def note(self, kind, at_ms, word, detail):
        assert kind == step.STATE
        self.began.append((detail, at_ms))

    def note_end(self):
        self.ended.append(self.memory[brain.STATE])

    notes_flow = 1

    def note_flow(self, index):
        self.executed.append(index)

    def heard_voice(self):
        return self.voice

    def sense(self, looks_mm):
        self.looks.append(looks_mm)
        return self.senses

    def set_outputs(self, wheels, senses):
        assert senses is self.senses
        self.wheels = wheels

    def air_is_busy(self):
        return self.busy

    def send_frame(self, frame):
        self.sent.append((self.now_ms, word_of(frame), tag_of(frame)))

    @property
    def state(self):
        return self.memory[brain.STATE] if self.memory[brain.RUNNING] else None

    @property
    def counters(self):
        return tuple(self.decisions[decisions.COUNTS : decisions.COUNTS + 4])


@st.composite
def moments(draw):
    """Ticks: how late each is, what is said, what is sensed."""
    late = st.sampled_from([1, 5, 5, 5, 20, 20, 100, 333, 1000, 7000])
    obstacles = st.sampled_from([50, 150, 250, 350, 1 << 20])
    senses = st.builds(Senses, obstacles, st.integers(0, 1), st.integers(0, 3))
    return draw(st.lists(st.tuples(late, st.sampled_from([0, 0, 0, 1, 2]), senses), min_size=1, max_size=60))


@given(
    image=deciding_images(tells=False),
    ticks=moments(),
    begins_ms=BEGINS_MS,
    profile=st.sampled_from([CLASSROOM, BRISK]),
)
def test_words_do_what_a_second_interpreter_does(image, ticks, begins_ms, profile):
    # Directions that are drawn share the generator with conditions, and are no matter of these words.
    image = image._replace(leader=tuple(word if word >> 31 else word & ~(3 << 27) for word in image.leader))
    leader = Leader(image, profile, begins_ms)
    numbers = SimpleNamespace(memory=list(leader.memory))
    other = DecidingLeader(image, profile, lambda: brain.draw(numbers.memory), begins_ms)
    now_ms = begins_ms
    for late_ms, voice, senses in ticks:
        leader.tick(now_ms, senses, voice)
        seen = other.tick(now_ms, voice, senses)
        assert (leader.state, leader.counters) == (seen.state, seen.counters)
        assert leader.began == [(index, at_ms & TICKS_MASK) for index, at_ms in other.began]
        assert leader.sent == []
        now_ms += late_ms


@settings(max_examples=10 * settings().max_examples)
@given(
    word=st.integers(0, (1 << 30) - 1),
    floor=st.booleans(),
    ticks=moments(),
)
def test_a_step_without_seconds_goes_on_without_a_gap_when_its_word_begins_again(word, floor, ticks):
    turns = word >> 27 & 3 in (brain.LEFT, brain.RIGHT)
    durations = 3 << 23 | 3 << 19 | 3 << 14
    word = word & ~0xFFF | durations | 0b11 << 29 | 1 << 25 | (floor and not turns) << 11
    until = STATE.encode(until=PERSON)
    again = FLOW.encode(op=JUMP, target=0, condition=PERSON, if_not=1)
    image = Image([word | until, again], [], -1, 0, 1)
    leader, unbroken = Leader(image), Leader(image)
    unbroken.levels = (*unbroken.levels[:3], 1 << 20, *unbroken.levels[4:])
    now_ms = 0
    for late_ms, voice, senses in ticks:
        shown = []
        for car in (leader, unbroken):
            car.tick(now_ms, senses._replace(person=0), voice)
            shown.append((car.wheels, brain.lit_led(car.memory, now_ms, car.levels)))
        assert shown[0] == shown[1]
        now_ms += late_ms


def test_a_turn_to_a_line_without_seconds_turns_on_when_its_word_begins_again():
    words = [STATE.encode(motor_enable=1, motor_direction=1, motor_speed=1, motor_duration=3, floor=1, until=PERSON)]
    words.append(FLOW.encode(op=JUMP, target=0, condition=PERSON, if_not=1))
    leader = Leader(Image(words, [], -1, 0, 1)).tick(0)
    dark = Senses(1 << 20, 0, 3)
    wheels = [
        leader.tick(now_ms, senses).wheels for now_ms, senses in [(100, OFF), (500, dark), (2999, OFF), (3000, OFF)]
    ]
    assert wheels == [brain.LEFT * 4 + 1, brain.STILL, brain.STILL, brain.LEFT * 4 + 1]


@given(
    image=deciding_images(draws=False),
    ticks=moments(),
    begins_ms=BEGINS_MS,
    profile=st.sampled_from([CLASSROOM, BRISK]),
)
def test_tells_open_the_slots_of_a_second_interpreter(image, ticks, begins_ms, profile):
    leader = Leader(image, profile, begins_ms)
    other = DecidingLeader(image, profile, lambda: 0, begins_ms)
    now_ms, tags, slots = begins_ms, [], 0
    for late_ms, voice, senses in ticks:
        sent = len(leader.sent)
        leader.tick(now_ms, senses, voice)
        seen = other.tick(now_ms, voice, senses)
        assert (leader.state, leader.counters) == (seen.state, seen.counters)
        assert leader.began == [(index, at_ms & TICKS_MASK) for index, at_ms in other.began]
        if holds_a_tell(image):
            assert leader.decisions[decisions.IS_TELLING] == (seen.told is not None)
            if seen.told is not None:
                slot = leader.memory[brain.SLOT], leader.memory[brain.SLOT_STARTED_MS]
                assert slot == (seen.told, seen.told_ms & TICKS_MASK)
                assert {word for _, word, _ in leader.sent[sent:]} <= {image.followers[seen.told]}
            if seen.slots > slots:
                tags.append(leader.memory[brain.TAG])
                slots = seen.slots
        now_ms += late_ms
    assert all(one != other for one, other in pairwise(tags))


def drives(seconds=1, **fields):
    return STATE.encode(forward=1, motor_enable=1, motor_speed=2, motor_duration=seconds, **fields)


def stands(seconds=1, **fields):
    return STATE.encode(forward=1, motor_enable=1, motor_duration=seconds, **fields)


def jump(target, **fields):
    return FLOW.encode(op=JUMP, target=target, **fields)


def leading(*words, followers=(), level=-1):
    return Leader(Image(words, followers, level, int(bool(followers)), 1))


def test_a_state_ends_in_the_tick_in_which_its_condition_holds_but_lasts_one_tick():
    leader = leading(drives(3, until=OBSTACLE, until_level=1), stands())
    assert leader.tick(0, NEAR).state == 0
    assert leader.wheels == 2
    assert leader.tick(5, OFF).state == 0
    assert leader.tick(10, Senses(200, 0, 0)).state == 0
    assert leader.tick(15, Senses(199, 0, 0)).state == 1
    assert leader.wheels == brain.STILL
    assert leader.began == [(0, 0), (1, 15)]


def test_a_state_that_a_late_tick_passes_over_is_not_asked():
    leader = leading(stands(), drives(1, until=PERSON), stands(3))
    leader.tick(0)
    leader.tick(2500, SOMEBODY)
    assert leader.began == [(0, 0), (1, 1000), (2, 2000)]


def test_a_car_notes_the_words_that_led_to_a_state_and_the_state_that_its_condition_ended():
    asked = jump(4, condition=PERSON)
    leader = leading(jump(3, condition=PERSON), drives(3, until=PERSON), asked, stands(), stands())
    leader.tick(0)
    assert (leader.executed, leader.ended) == ([0], [])
    leader.tick(5).tick(10, SOMEBODY)
    assert (leader.executed, leader.ended) == ([0, 2], [1])
    assert leader.state == 4


def test_a_voice_counts_from_the_beginning_of_a_state():
    leader = leading(stands(1, until=VOICE, until_level=1), jump(3, condition=VOICE, level=0), stands(3), drives(3))
    leader.tick(0, voice=brain.VOICE_GO).tick(5)
    assert leader.state == 0
    leader.tick(10, voice=brain.VOICE_STOP)
    assert leader.state == 0
    # 'stop' came in the state before the jump.
    assert leader.tick(20, voice=brain.VOICE_GO).state == 3


def test_no_image_hangs_a_car():
    for words in [(jump(0),), (jump(1), jump(0)), (FLOW.encode(op=CALL),), (FLOW.encode(op=RETURN),)]:
        leader = leading(*words)
        for now_ms in (0, 5, 100_000):
            assert leader.tick(now_ms).state is None
            assert leader.wheels == brain.STILL
            assert next_wakeup.word_rest_ms(leader.memory, now_ms, leader.levels) > 0


def test_sixteen_flow_words_are_executed_in_a_tick():
    add = FLOW.encode(op=COUNT, level=1, value=1)
    leader = leading(*[add] * 17, drives())
    assert leader.tick(0).counters[0] == 16
    assert (leader.state, leader.wheels) == (None, brain.STILL)
    assert leader.tick(7).counters[0] == 17
    assert leader.began == [(17, 7)]


def test_four_calls_are_remembered_and_more_forget_the_oldest():
    calls = [FLOW.encode(op=CALL, target=target) for target in (2, 4, 6, 8, 10)]
    words = [calls[0], drives(), calls[1], FLOW.encode(op=RETURN), calls[2], FLOW.encode(op=RETURN), calls[3]]
    words += [FLOW.encode(op=RETURN), calls[4], FLOW.encode(op=RETURN), stands()]
    # Five calls deep: from the innermost four returns lead to word 3, and one more to word 0.
    leader = leading(*words, FLOW.encode(op=RETURN))
    leader.tick(0)
    assert leader.state == 10
    assert leader.decisions[decisions.CALLS] == 4
    leader.tick(1000)
    assert leader.began == [(10, 0), (10, 1000)]


def test_counters_stop_at_their_ends_and_keep_their_values_behind_the_last_word():
    counts = [FLOW.encode(op=COUNT, counter=counter, level=1, value=200) for counter in (0, 3)]
    leader = leading(*counts, FLOW.encode(op=COUNT, counter=1, level=2, value=9), drives())
    assert leader.tick(0).counters == (200, 0, 0, 200)
    assert leader.tick(1000).counters == (255, 0, 0, 255)
    leader.begin(1500)
    assert leader.counters == (0, 0, 0, 0)


@pytest.mark.parametrize(("value", "least", "most"), [(0, 0, 0), (64, 180, 320), (255, 980, 1000)])
def test_chance_holds_as_often_as_it_says(value, least, most):
    words = (jump(3, condition=CHANCE, value=value), FLOW.encode(op=COUNT, level=0), drives(), stands())
    leader = leading(*words)
    taken = 0
    for turn in range(1000):
        taken += leader.tick(turn * 2000).began[-1][0] == 3
        leader.memory[brain.RUNNING] = leader.decisions[decisions.NEXT] = 0
    assert least <= taken <= most


def test_random_counts_are_from_0_to_the_value():
    leader = leading(FLOW.encode(op=COUNT, counter=2, level=3, value=3), drives())
    found = {leader.tick(turn * 1000).counters[2] for turn in range(60)}
    assert found == {0, 1, 2, 3}


@pytest.mark.parametrize(
    ("level", "value", "taken"), [(0, 5, 1), (0, 4, 0), (1, 6, 1), (1, 5, 0), (2, 4, 1), (2, 5, 0)]
)
def test_a_counter_is_compared(level, value, taken):
    asked = jump(3, condition=COUNTER, level=level, counter=1, value=value)
    leader = leading(FLOW.encode(op=COUNT, counter=1, value=5), asked, drives(), stands())
    assert leader.tick(0).state == (3 if taken else 2)


FOLLOWERS = (0x80280000, 0x80480000, 0x80680000)


def tell(target, **fields):
    return FLOW.encode(op=TELL, target=target, **fields)


def words_sent(leader):
    """The words that were told, with their tags, each once."""
    return list(dict.fromkeys((FOLLOWERS.index(word), tag) for _, word, tag in leader.sent))


def ticks(leader, begin_ms, end_ms, senses=OFF, every_ms=5):
    for now_ms in range(begin_ms, end_ms, every_ms):
        leader.tick(now_ms, senses)
    return leader


def test_nothing_is_sent_before_the_first_tell_and_a_slot_lasts_until_the_next_one():
    leader = leading(stands(3, until=PERSON), tell(2), stands(3), followers=FOLLOWERS, level=0)
    assert ticks(leader, 0, 2900).sent == []
    ticks(leader, 2900, 5000, SOMEBODY)
    assert leader.sent[0] == (2900, FOLLOWERS[2], 1)
    assert words_sent(leader) == [(2, 1)]


def test_a_tell_that_comes_too_soon_waits_and_of_several_the_last_one_counts():
    idle = STATE.encode(forward=1)
    leader = leading(tell(0), idle, tell(1), idle, tell(2), stands(3), jump(5), followers=FOLLOWERS, level=0)
    ticks(leader, 0, 3000)
    assert words_sent(leader) == [(0, 1), (2, 2)]
    assert next(at_ms for at_ms, _, tag in leader.sent if tag == 2) == 670
    assert decisions.least_slot_ms(leader.levels) == 667


def test_words_are_told_in_turn_by_dwell_from_the_first_one():
    leader = leading(tell(IN_TURN, value=2), stands(3), jump(1), followers=FOLLOWERS, level=1)
    ticks(leader, 0, 5000)
    assert words_sent(leader) == [(0, 1), (1, 2), (0, 3)]
    everything = leading(tell(IN_TURN), stands(3), jump(1), followers=FOLLOWERS, level=0)
    assert words_sent(ticks(everything, 0, 4000)) == [(0, 1), (1, 2), (2, 3), (0, 4)]


def test_a_word_that_is_told_twice_has_two_tags():
    leader = leading(tell(1), stands(1), followers=FOLLOWERS, level=0)
    assert words_sent(ticks(leader, 0, 2500)) == [(1, 1), (1, 2), (1, 3)]


def test_a_leader_that_decides_and_tells_nothing_sends_by_the_clock():
    leader = leading(stands(3, until=PERSON), followers=FOLLOWERS, level=0)
    assert words_sent(ticks(leader, 0, 2500)) == [(0, 1), (1, 2), (2, 3)]
    assert frames.is_tagged(leader.image)


@pytest.mark.parametrize(
    ("word", "looks_mm"),
    [
        (drives(until=OBSTACLE, until_level=2), 300),
        (jump(0, condition=OBSTACLE, level=3), 400),
        (drives(avoid_enable=1, avoid_radius=1), 200),
        (drives(avoid_enable=1, avoid_radius=0, until=OBSTACLE, until_level=1), 200),
        (drives(until=PERSON), 0),
    ],
)
def test_the_ultrasonic_sensor_is_read_in_each_tick_where_a_word_asks_for_it(word, looks_mm):
    leader = leading(stands(3), word)
    assert leader.tick(0).tick(5).looks == [looks_mm, looks_mm]
    assert decisions.watches(leader.memory, leader.decisions) == (looks_mm > 0)


def test_an_image_may_be_surveyed_in_pieces():
    image = image_words(
        Image((drives(avoid_enable=1), jump(0, condition=OBSTACLE, level=2), tell(0)), (1 << 31,), 0, 1, 1)
    )
    for size in (1, 2, 3, 5):
        found = bytearray([9] * decisions.SIZE)
        for begin in range(0, len(image), size):
            decisions.survey(found, image[: begin + size], begin, min(begin + size, len(image)), levels_of(CLASSROOM))
        assert (decisions.looks_mm(found, levels_of(CLASSROOM)), found[decisions.TELLS]) == (300, 1)
