"""Frames that a MicroPython car receives: with jitter, noise and late interrupts, and never its own."""

import pytest
from driven_car import Bench
from hypothesis import given
from hypothesis import strategies as st

from motorcade.words.infrared import frame_durations_us
from support.chip_benches import ESP32, FRAME, RP2040, bench, board_of


def heard(board, a_bench: Bench, durations_us, tick_ms: int = 5) -> list[int]:
    """Return the frames that the board receives from marks and spaces that begin now."""
    frames = []
    a_bench.hear(a_bench.chip.now_us, durations_us)
    until_us = a_bench.chip.now_us + sum(durations_us) + 20_000
    while a_bench.chip.now_us < until_us:
        frames += board.received_frames()
        a_bench.clock.sleep_ms(tick_ms)
    return frames + list(board.received_frames())


def jittered(frame: int, percents: list[int]) -> list[int]:
    return [us * percent // 100 for us, percent in zip(frame_durations_us(frame), percents, strict=True)]


@given(st.integers(0, 0xFFFFFFFF), st.lists(st.integers(78, 122), min_size=67, max_size=67), st.integers(1, 40))
def test_a_frame_with_jitter_is_received(frame, percents, tick_ms):
    a_bench = bench()
    assert heard(board_of(a_bench), a_bench, jittered(frame, percents), tick_ms) == [frame]


@given(st.lists(st.integers(50, 12_000), min_size=1, max_size=99).filter(lambda noise: len(noise) % 2 == 1))
def test_noise_is_dropped_and_the_frame_after_it_received(noise_us):
    a_bench = bench()
    board = board_of(a_bench)
    assert heard(board, a_bench, noise_us) == []
    assert heard(board, a_bench, frame_durations_us(FRAME)) == [FRAME]


def test_a_loop_that_was_late_loses_old_frames_and_receives_the_next_one():
    a_bench = bench()
    board = board_of(a_bench)
    whole = frame_durations_us(FRAME)
    for number in range(5):
        a_bench.hear(a_bench.chip.now_us + number * 100_000, whole)
    a_bench.clock.sleep_ms(600)
    late = board.received_frames()
    assert late == [FRAME] * 3
    assert heard(board, a_bench, whole) == [FRAME]


def test_a_frame_with_a_pulse_too_short_for_its_interrupts_is_dropped_not_guessed():
    a_bench = bench()
    board = board_of(a_bench)
    a_bench.chip.late_us = 200
    durations_us = frame_durations_us(FRAME)
    one = 3
    assert durations_us[one] == 3 * 560
    glitch = [600, 50, durations_us[one] - 650]
    assert heard(board, a_bench, durations_us[:one] + glitch + durations_us[one + 1 :]) == []
    assert heard(board, a_bench, durations_us) == [FRAME]


def test_a_car_that_sent_once_receives_again_for_good():
    a_bench = bench()
    board = board_of(a_bench)
    board.send_frame(FRAME)
    for _ in range(3):
        a_bench.clock.sleep_ms(300_000)
        assert not board.received_frames()
    assert heard(board, a_bench, frame_durations_us(FRAME)) == [FRAME]


def test_the_air_is_busy_from_a_frames_first_mark_to_its_last():
    a_bench = bench()
    board = board_of(a_bench)
    durations_us = frame_durations_us(FRAME)
    a_bench.hear(a_bench.chip.now_us + 10_000, durations_us)
    senses = {}
    while a_bench.chip.now_us < 120_000:
        board.received_frames()
        senses[a_bench.chip.now_us] = board.senses_carrier()
        a_bench.clock.sleep_us(500)
    end_us = 10_000 + sum(durations_us)
    assert senses == {at_us: 10_000 <= at_us < end_us for at_us in senses}


def test_noise_makes_the_air_busy_for_at_most_a_frames_longest_space():
    a_bench = bench()
    board = board_of(a_bench)
    a_bench.hear(0, [300])
    a_bench.clock.sleep_ms(4)
    board.received_frames()
    assert board.senses_carrier()
    a_bench.clock.sleep_ms(2)
    board.received_frames()
    assert not board.senses_carrier()


@pytest.mark.parametrize(("text", "platform"), [(ESP32, "esp32"), (RP2040, "rp2")])
def test_a_car_ignores_its_own_frame_and_receives_again_after_it(text, platform):
    a_bench = bench(text=text, platform=platform)
    board = board_of(a_bench)
    begin_us = a_bench.chip.now_us
    board.send_frame(FRAME)
    frames = []
    while board.is_sending():
        frames += board.received_frames()
        a_bench.clock.sleep_ms(3)
    lasted_ms = (a_bench.chip.now_us - begin_us) / 1000
    assert 0 <= lasted_ms - sum(frame_durations_us(FRAME)) / 1000 <= 3
    a_bench.clock.sleep_ms(2)
    assert not frames
    assert not board.received_frames()
    assert not board.senses_carrier()
    assert heard(board, a_bench, frame_durations_us(FRAME)) == [FRAME]
