"""Infrared frames: parity, duration, and a receiver that finds them among noise."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.words.infrared import (
    ACTION_BITS,
    FrameReceiver,
    air_us,
    check_is_good,
    check_of,
    frame_durations_us,
    is_remote_control,
    next_tag,
    ones,
    parity_is_even,
    slot_tags,
    tag_is_newer,
    tag_of,
    tagged_frame,
    to_frame,
)

UNIT_US = 560
GAP_US = 5_000
WORDS = st.integers(0, 0xFFFFFFFF)
UNITS_US = st.sampled_from([300, UNIT_US, 1_000])
# What else is on the air: durations about as long as a frame's parts, and frames that break off.
DURATIONS_US = st.integers(0, 20_000) | st.sampled_from([560, 1_680, 4_480, 8_960]) | st.integers(200, 2_000)
PARTS_US = st.builds(lambda frame, count: frame_durations_us(frame)[:count], WORDS, st.integers(1, 67))
NOISE = st.lists(DURATIONS_US.map(lambda duration_us: [duration_us]) | PARTS_US, max_size=20).map(
    lambda pieces: [duration_us for piece in pieces for duration_us in piece]
)


def hear(receiver, durations_us):
    """The frames that ``receiver`` finds in durations: mark, space, mark, ..."""
    frames = []
    for position, duration_us in enumerate(durations_us):
        if position % 2:
            receiver.receive_space(duration_us)
        else:
            receiver.receive_mark(duration_us)
        while (frame := receiver.next_frame()) is not None:
            frames.append(frame)
    return frames


def before_a_mark(durations_us):
    """The durations, and where they end with a mark the pause before the next one."""
    return [*durations_us, GAP_US] if len(durations_us) % 2 else durations_us


@given(word=WORDS)
def test_parity_makes_the_ones_even_and_leaves_the_other_bits(word):
    frame = to_frame(word)
    assert frame.bit_count() % 2 == 0
    assert frame | 1 == word | 1
    assert parity_is_even(frame) == 1


@given(word=WORDS)
def test_all_32_bits_are_counted(word):
    assert ones(word) == word.bit_count()
    assert parity_is_even(word) == (word.bit_count() % 2 == 0)


@pytest.mark.parametrize(
    ("frame", "expected_us"), [(0, 49_840), (0xFFFFFFFF, 85_680), (0x80000001, 52_080), (0x0000FFFF, 67_760)]
)
def test_air_time_of_a_frame(frame, expected_us):
    assert air_us(frame, UNIT_US) == expected_us


@given(frame=WORDS, unit_us=UNITS_US)
def test_the_marks_and_spaces_of_a_frame_fill_its_air_time(frame, unit_us):
    durations_us = frame_durations_us(frame, unit_us)
    assert len(durations_us) == 67
    assert sum(durations_us) == air_us(frame, unit_us)


def test_only_the_last_mark_of_a_frame_says_that_it_ends_one():
    receiver, ends = FrameReceiver(), []
    for position, duration_us in enumerate([*frame_durations_us(0xA0000001), GAP_US, 9_000, 560, 560]):
        if position % 2:
            receiver.receive_space(duration_us)
        elif receiver.receive_mark(duration_us):
            ends.append(position)
    assert ends == [66]


def test_a_frame_is_a_header_then_its_bits_from_the_first():
    durations_us = frame_durations_us(0xA0000001)
    assert durations_us[:2] == [8_960, 4_480]
    assert durations_us[2:10] == [560, 1_680, 560, 560, 560, 1_680, 560, 560]  # 1 0 1 0
    assert durations_us[-5:] == [560, 560, 560, 1_680, 560]  # 0 1 and the last mark


@given(frames=st.lists(WORDS, max_size=4), unit_us=UNITS_US)
def test_frames_one_behind_the_other_are_found(frames, unit_us):
    on_air_us = [us for frame in frames for us in [*frame_durations_us(frame, unit_us), GAP_US]]
    assert hear(FrameReceiver(unit_us), on_air_us) == frames


@pytest.mark.parametrize("before_us", [[560], [*frame_durations_us(0xA0000001)]])
def test_a_header_needs_its_mark(before_us):
    """Whatever was before: noise, or a whole frame."""
    receiver = FrameReceiver()
    found = hear(receiver, before_us)
    for duration_us in frame_durations_us(0xFFFFFFFF)[1:]:
        receiver.receive_space(duration_us) if duration_us in (4_480, 1_680) else receiver.receive_mark(duration_us)
    assert receiver.next_frame() is None
    assert len(found) == len(before_us) // 67


def test_a_unit_may_be_odd():
    durations_us = frame_durations_us(0, 561)
    durations_us[2] = 281
    assert hear(FrameReceiver(561), durations_us) == [0]


@given(frame=WORDS, off_percent=st.lists(st.integers(-25, 25), min_size=67, max_size=67))
def test_a_frame_is_found_though_each_duration_is_off(frame, off_percent):
    nominal_us = frame_durations_us(frame)
    jittered_us = [us + int(us * percent / 100) for us, percent in zip(nominal_us, off_percent, strict=True)]
    assert hear(FrameReceiver(), jittered_us) == [frame]


# Longest and shortest durations: of marks and spaces half a unit around what they can be, of a header a quarter.
@pytest.mark.parametrize(
    ("position", "least_us", "most_us", "bit"),
    [
        (0, 6_720, 11_200, 0),
        (1, 3_360, 5_600, 0),
        (2, 281, 1_119, 0),
        (66, 281, 1_119, 0),
        (3, 281, 1_120, 0),
        (3, 1_121, 2_799, 1),
    ],
)
def test_a_duration_counts_as_what_it_is_nearest_to(position, least_us, most_us, bit):
    frame = bit << 31
    for duration_us in (least_us, most_us):
        durations_us = frame_durations_us(frame)
        durations_us[position] = duration_us
        assert hear(FrameReceiver(), durations_us) == [frame]
    for duration_us in (least_us - 1, most_us + 1):
        durations_us = frame_durations_us(frame)
        durations_us[position] = duration_us
        assert hear(FrameReceiver(), durations_us) != [frame]


@pytest.mark.parametrize("frame", [0, 0x65800000, 0xFFFFFFFF])
@pytest.mark.parametrize("lengthened_us", [-200, 200])
def test_a_frame_is_found_by_a_sensor_that_stretches_marks_or_spaces(frame, lengthened_us):
    nominal_us = frame_durations_us(frame)
    stretched_us = [us + (-lengthened_us if position % 2 else lengthened_us) for position, us in enumerate(nominal_us)]
    assert hear(FrameReceiver(), stretched_us) == [frame]


@given(noise=NOISE, frame=WORDS)
def test_a_frame_is_found_whatever_came_before(noise, frame):
    heard = hear(FrameReceiver(), before_a_mark(noise) + frame_durations_us(frame))
    assert heard[-1:] == [frame]


@given(frame=WORDS, spikes_us=st.lists(st.integers(0, 6_000), max_size=40))
def test_a_frame_is_found_once_whatever_spikes_come_behind(frame, spikes_us):
    assert hear(FrameReceiver(), [*frame_durations_us(frame), GAP_US, *spikes_us]) == [frame]


@given(lost=WORDS, frame=WORDS, marks=st.integers(1, 33))
def test_a_frame_that_is_cut_off_is_lost_alone(lost, frame, marks):
    until_cut_off_us = frame_durations_us(lost)[: 2 * marks - 1]
    assert hear(FrameReceiver(), [*until_cut_off_us, GAP_US, *frame_durations_us(frame)]) == [frame]


@given(events=st.lists(st.tuples(st.booleans(), DURATIONS_US | st.integers(-5, 1 << 40)), max_size=200))
def test_marks_and_spaces_need_not_take_turns(events):
    receiver = FrameReceiver()
    for is_mark, duration_us in events:
        (receiver.receive_mark if is_mark else receiver.receive_space)(duration_us)
    assert hear(receiver, before_a_mark([1]) + frame_durations_us(0x65800001))[-1:] == [0x65800001]


# The numbers of bits 31 to 6: the integers from 3 to 31 that are no powers of two.
NUMBERS = [number for number in range(3, 32) if number & (number - 1)]
TAGGED = st.builds(tagged_frame, WORDS, st.integers(1, 31))


@given(WORDS)
def test_the_check_is_the_exclusive_or_of_the_numbers_of_the_bits_that_are_1(word):
    expected = 0
    for bit, number in zip(range(31, 5, -1), NUMBERS, strict=True):
        expected ^= number * (word >> bit & 1)
    assert check_of(word) == expected


@given(WORDS, st.integers(1, 31))
def test_a_tagged_frame_holds_word_and_tag_and_is_good(word, tag):
    frame = tagged_frame(word, tag)
    assert (frame >> 11, tag_of(frame)) == (word >> 11, tag)
    assert parity_is_even(frame)
    assert check_is_good(frame)


@given(TAGGED, st.lists(st.integers(0, 31), min_size=1, max_size=3, unique=True))
def test_parity_or_check_finds_one_to_three_flipped_bits(frame, bits):
    received = frame ^ sum(1 << bit for bit in bits)
    assert not (parity_is_even(received) and check_is_good(received))


@pytest.mark.parametrize(("tag", "following"), [(1, 2), (30, 31), (31, 1)])
def test_tags_count_from_1_to_31_and_begin_again(tag, following):
    assert next_tag(tag, 0) == following


def nec(address: int, command: int) -> int:
    """The frame of a remote control: each byte is sent with its least significant bit first."""
    sent = bytes([address & 255, address >> 8, command, 255 - command])
    return int("".join(f"{byte:08b}"[::-1] for byte in sent), 2)


@given(st.integers(0, 0xFFFF), st.integers(0, 255))
def test_a_key_of_a_remote_control_is_told_by_its_command(address, command):
    assert is_remote_control(nec(address, command))
    assert is_remote_control(nec(address & 255 | (255 - (address & 255)) << 8, command))


@given(WORDS)
def test_no_bare_frame_looks_like_a_remote_control(word):
    assert not is_remote_control(to_frame(word & ACTION_BITS))


def test_no_frame_of_any_word_in_any_slot_looks_like_a_remote_control():
    # Bits 31 to 16 matter by their part of check and parity alone, since both are sums: 64 words stand for all.
    upper = np.arange(1 << 16, dtype=np.uint32) << 16
    parts = check_of(upper) << 1 | (ones(upper) & 1)
    assert set(parts.tolist()) == set(range(64))
    words = [upper[parts == part][0] | lower << 11 for part in range(64) for lower in range(32)]
    passed_over = []
    for word in map(int, words):
        alike = {tag for tag in range(1, 32) if is_remote_control(tagged_frame(word, tag))}
        assert all(next_tag(tag, word) not in alike for tag in range(1, 32))
        passed_over.append(len(alike))
    # For one word in 16 two tags are passed over, or one.
    assert [passed_over.count(tags) for tags in range(3)] == [1920, 8, 120]


@given(st.lists(WORDS, min_size=1, max_size=5), st.integers(1, 100))
def test_the_tags_of_slots_are_those_that_no_frame_is_lost_by(words, slots):
    tags = slot_tags(words, slots)
    assert not any(is_remote_control(tagged_frame(words[slot % len(words)], tag)) for slot, tag in enumerate(tags))
    steps = [(tag - before) % 31 for before, tag in pairwise([0, *tags])]
    assert set(steps) <= {1, 2}


@given(st.integers(1, 31), st.integers(0, 30))
def test_a_tag_is_newer_for_15_slots(tag, slots):
    later = (tag - 1 + slots) % 31 + 1
    assert tag_is_newer(later, tag) == (1 <= slots <= 15)
