"""Old commands: what a stalled network delivers late does nothing, and nobody else is held up."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.drive.stamps import STAMP_MASK, Freshness, stamp_at
from motorcade.words.ticks import TICKS_MASK
from support.socketless_car import Car, command, receive

PERIOD_MS = 50
STALE_MS = 150


def stamped(angle: int, sent_ms: int, speed: int = 100) -> bytes:
    word = int.from_bytes(command(angle, speed), "big") | stamp_at(sent_ms)
    return word.to_bytes(4, "big")


@given(
    begin_ms=st.integers(0, TICKS_MASK),
    offset_ms=st.integers(0, 1 << 40),
    delays_ms=st.lists(st.integers(0, STALE_MS - 8), min_size=1, max_size=200),
    drift_ppm=st.integers(-100, 100),
)
def test_a_client_whose_commands_come_in_time_is_never_old(begin_ms, offset_ms, delays_ms, drift_ppm):
    freshness = Freshness(STALE_MS)
    for number, delay_ms in enumerate(delays_ms):
        sent_ms = number * PERIOD_MS
        by_sender_ms = sent_ms + sent_ms * drift_ppm // 1_000_000 + offset_ms
        assert freshness.is_fresh(stamp_at(by_sender_ms), begin_ms + sent_ms + delay_ms & TICKS_MASK)


@given(offset_ms=st.integers(0, 1 << 40), stall_ms=st.integers(200, 6000), before=st.integers(1, 100))
def test_all_that_a_stall_held_back_is_old_and_what_is_sent_after_it_is_fresh(offset_ms, stall_ms, before):
    freshness = Freshness(STALE_MS)
    for number in range(before):
        assert freshness.is_fresh(stamp_at(offset_ms + number * PERIOD_MS), number * PERIOD_MS)
    last_ms = before * PERIOD_MS
    held = range(last_ms, last_ms + stall_ms - STALE_MS - 4, PERIOD_MS)
    # They trickle: each comes some ms after the one before it.
    arrivals = [last_ms + stall_ms + number for number in range(len(held))]
    ends = [freshness.is_fresh(stamp_at(offset_ms + sent), now) for sent, now in zip(held, arrivals, strict=True)]
    assert not any(ends)
    assert freshness.is_fresh(stamp_at(offset_ms + arrivals[-1] + 5), arrivals[-1] + 10) if arrivals else True


@pytest.mark.parametrize("pause_ms", [61_000, 3_600_000])
def test_clocks_that_drift_apart_in_a_long_pause_make_nothing_old(pause_ms):
    freshness = Freshness(STALE_MS)
    assert freshness.is_fresh(stamp_at(1000), 500)
    assert freshness.is_fresh(stamp_at(1000 + pause_ms), 500 + pause_ms + 1000)


def test_a_client_that_has_stamped_must_go_on_and_one_without_stamps_is_obeyed():
    freshness = Freshness(STALE_MS)
    assert freshness.is_fresh(0, 0)
    assert freshness.is_fresh(stamp_at(7), 10)
    assert not freshness.is_fresh(0, 20)


@given(st.integers(0, 1 << 50))
def test_a_stamp_fits_the_reserved_bits_and_is_never_0(now_ms):
    assert 1 <= stamp_at(now_ms) <= STAMP_MASK == 2047


def test_old_commands_neither_move_nor_arm_a_car_and_its_client_is_told():
    car = Car()
    channel, _ = car.commands()
    receive(channel, stamped(90, 0, speed=0))
    for car.now_ms in range(50, 500, 50):
        receive(channel, stamped(100, car.now_ms))
    moved = len(car.board.angles)
    # The network stalls, and the car stops by itself.
    car.now_ms = 2000
    car.control.tick()
    assert car.control.telemetry().state == "failsafe"
    for sent_ms in range(500, 1500, 20):
        car.now_ms += 1
        receive(channel, stamped(120, sent_ms, speed=0 if sent_ms % 100 == 0 else 100))
    assert car.control.telemetry().state == "failsafe"
    assert len(car.board.angles) == moved
    assert channel.counts.as_dict()["stale"] == 50
    receive(channel, stamped(90, car.now_ms, speed=0))
    receive(channel, stamped(130, car.now_ms))
    assert car.board.angles[-1] == 130
