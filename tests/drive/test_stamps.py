"""Old commands: what a stalled network delivers late does nothing, and nobody else is held up."""

from hypothesis import given
from hypothesis import strategies as st

from motorcade.drive.stamps import STAMP_MASK, Freshness, stamp_at
from motorcade.words.ticks import TICKS_MASK
from support.socketless_car import SocketlessCar, ask, command, receive

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
    freshness, came_ms = Freshness(STALE_MS), 0
    clock = freshness.clock_to_answer(begin_ms)
    assert clock is not None
    freshness.take_answer(clock, 0, stamp_at(offset_ms), begin_ms)
    for number, delay_ms in enumerate(delays_ms):
        sent_ms = number * PERIOD_MS
        by_sender_ms = sent_ms + sent_ms * drift_ppm // 1_000_000 + offset_ms
        # None overtakes the one before it.
        came_ms = max(came_ms, sent_ms + delay_ms)
        assert freshness.is_fresh(stamp_at(by_sender_ms), begin_ms + came_ms & TICKS_MASK, number + 1)


def now_at(ms: int) -> int:
    return ms & TICKS_MASK


# All lengths of a stall, dense around the rounds of a stamp, where old words look new.
STALLS_MS = st.one_of(
    st.integers(100, 120_000),
    st.builds(lambda rounds, off: max(100, rounds * 8188 + off), st.integers(0, 14), st.integers(-400, 400)),
)


class StampedDriver:
    """A client that sends a word each 50 ms, whatever the network does, and the car's end of its connection.

    One that ``has_answered`` the car's clock at 0 has sent nothing yet.
    """

    def __init__(self, offset_ms: int, begin_ms: int = 0, has_answered: bool = True) -> None:
        self.freshness = Freshness(STALE_MS)
        self.offset_ms, self.begin_ms = offset_ms, begin_ms
        self.number = 0
        if has_answered:
            self.answer(self.clock(0), 0, 0)

    def send(self, sent_ms: int, stands: bool) -> tuple[int, int, bool]:
        self.number += 1
        return stamp_at(self.offset_ms + sent_ms), self.number, stands

    def comes(self, word: tuple[int, int, bool], at_ms: int) -> bool:
        stamp, number, stands = word
        return self.freshness.is_fresh(stamp, now_at(self.begin_ms + at_ms), number, stands)

    def clock(self, at_ms: int) -> int | None:
        return self.freshness.clock_to_answer(now_at(self.begin_ms + at_ms))

    def answer(self, clock: int, sent_ms: int, at_ms: int) -> None:
        stamp = stamp_at(self.offset_ms + sent_ms)
        self.freshness.take_answer(clock, self.number, stamp, now_at(self.begin_ms + at_ms))


@given(
    offset_ms=st.integers(0, 1 << 40),
    begin_ms=st.integers(0, TICKS_MASK),
    before=st.integers(1, 60),
    stall_ms=STALLS_MS,
    apart_ms=st.sampled_from([0, 1, 3, 20, 45]),
    rests=st.lists(st.booleans(), min_size=1, max_size=9),
    delay_ms=st.integers(0, 60),
    shuffled=st.randoms(use_true_random=False) | st.none(),
)
def test_after_any_stall_nothing_old_is_obeyed_and_the_live_driver_is_soon(
    offset_ms, begin_ms, before, stall_ms, apart_ms, rests, delay_ms, shuffled
):
    """Old words come in a burst (``apart_ms`` 0) or trickle; some have speed 0; a page's may be out of order."""
    driver = StampedDriver(offset_ms, begin_ms)
    for number in range(before):
        assert driver.comes(driver.send(number * PERIOD_MS, number == 0), number * PERIOD_MS + delay_ms)
    begun_ms = before * PERIOD_MS
    ended_ms = begun_ms + stall_ms
    held = [
        (sent_ms, driver.send(sent_ms, rests[sent_ms // PERIOD_MS % len(rests)]))
        for sent_ms in range(begun_ms, ended_ms, PERIOD_MS)
    ]
    if shuffled:
        shuffled.shuffle(held)
    now_ms = ended_ms
    for sent_ms, word in held:
        if now_ms - sent_ms > STALE_MS + 60:
            assert not driver.comes(word, now_ms)
        else:
            driver.comes(word, now_ms)
        now_ms += apart_ms
    # From here on the connection is as good as before; telemetry comes ten times a second, and the driver answers it.
    obeyed_ms = None
    for at_ms in range(now_ms, now_ms + 500, 50):
        clock = driver.clock(at_ms) if (at_ms - now_ms) % 100 == 0 else None
        stands = clock is not None
        if clock is not None:
            driver.answer(clock, at_ms + delay_ms, at_ms + 2 * delay_ms)
        # What answers a clock goes first, and has speed 0.
        word = driver.send(at_ms + delay_ms, stands)
        if driver.comes(word, at_ms + 2 * delay_ms) and not stands:
            obeyed_ms = at_ms
            break
    assert obeyed_ms is not None


@given(
    offset_ms=st.integers(0, 1 << 40),
    begin_ms=st.integers(0, TICKS_MASK),
    before=st.integers(0, 3),
    stall_ms=st.integers(1100, 120_000),
    apart_ms=st.sampled_from([0, 1, 3, 20, 45]),
    delay_ms=st.integers(0, 60),
    asks=st.booleans(),
)
def test_a_stall_before_the_first_word_with_a_speed_lets_nothing_old_through(
    offset_ms, begin_ms, before, stall_ms, apart_ms, delay_ms, asks
):
    """The car's first clock is held too, or it asks only when the telemetry channel has joined."""
    driver = StampedDriver(offset_ms, begin_ms, has_answered=False)
    held = [driver.send(number * PERIOD_MS, stands=number < before) for number in range(stall_ms // PERIOD_MS)]
    if asks:
        first_clock = driver.clock(0)
        driver.answer(first_clock, delay_ms, stall_ms)
    else:
        for word in held[:before]:
            driver.comes(word, stall_ms)
        assert driver.clock(stall_ms) is not None
    now_ms = stall_ms
    for sent, word in enumerate(held[before:], before):
        now_ms += apart_ms
        assert not driver.comes(word, now_ms) or now_ms - sent * PERIOD_MS <= STALE_MS + 60
    clock = driver.clock(now_ms)
    if clock is not None:
        driver.answer(clock, now_ms + delay_ms, now_ms + 2 * delay_ms)
    word = driver.send(now_ms + 2 * delay_ms, stands=False)
    assert driver.comes(word, now_ms + 3 * delay_ms)


@given(stall_ms=STALLS_MS, answered_late_ms=st.integers(1004, 20_000))
def test_an_answer_that_itself_was_late_lets_nothing_through(stall_ms, answered_late_ms):
    driver = StampedDriver(77)
    assert driver.comes(driver.send(0, True), 0)
    now_ms = 4004 + stall_ms
    clock = driver.clock(now_ms)
    driver.answer(clock, now_ms, now_ms + answered_late_ms)
    assert not driver.comes(driver.send(now_ms + answered_late_ms, True), now_ms + answered_late_ms)
    assert driver.clock(now_ms + answered_late_ms) is not None


@given(trip_ms=st.integers(0, 900))
def test_a_driver_in_a_slow_network_drives_on_after_a_rest(trip_ms):
    driver = StampedDriver(77, has_answered=False)
    driver.answer(driver.clock(0), trip_ms // 2, trip_ms)
    assert driver.comes(driver.send(trip_ms, True), trip_ms + trip_ms // 2)
    driver.answer(driver.clock(9000), 9000 + trip_ms // 2, 9000 + trip_ms)
    for sent_ms, stands in ((9000 + trip_ms, True), (9050 + trip_ms, False)):
        assert driver.comes(driver.send(sent_ms, stands), sent_ms + trip_ms // 2 + 4)


@given(held_ms=st.integers(STALE_MS + 4, 40_000))
def test_what_was_sent_behind_an_answer_and_came_late_is_old(held_ms):
    driver = StampedDriver(77)
    assert driver.comes(driver.send(0, True), 0)
    driver.answer(driver.clock(5000), 5000, 5000)
    assert not driver.comes(driver.send(5000, True), 5000 + held_ms)


def test_who_answered_and_then_sent_nothing_for_a_second_is_asked_again_and_drives():
    driver = StampedDriver(70)
    assert driver.clock(900) is None
    clock = driver.clock(1000)
    driver.answer(clock, 1000, 1000)
    assert driver.clock(1000) is None
    assert driver.comes(driver.send(1000, stands=False), 1000)


def test_after_a_rest_a_word_with_a_speed_waits_for_one_with_speed_0():
    driver = StampedDriver(77)
    assert driver.comes(driver.send(0, False), 0)
    assert driver.clock(4000) is None
    driver.answer(driver.clock(4001), 4001, 4001)
    assert driver.clock(4001) is None
    assert not driver.comes(driver.send(4100, False), 4100)
    driver.answer(driver.clock(4100), 4100, 4100)
    assert driver.comes(driver.send(4150, True), 4150)
    assert driver.comes(driver.send(4200, False), 4200)


def test_a_client_that_has_stamped_must_go_on_and_one_without_stamps_is_obeyed():
    freshness = Freshness(STALE_MS)
    assert freshness.is_fresh(0, 0)
    assert not freshness.is_fresh(stamp_at(7), 10)
    assert not freshness.is_fresh(0, 20)


@given(st.integers(0, 1 << 50))
def test_a_stamp_fits_the_reserved_bits_and_is_never_0(now_ms):
    assert 1 <= stamp_at(now_ms) <= STAMP_MASK == 2047


def test_a_driver_who_rests_for_long_drives_on_after_an_answer_by_the_telemetry_channel():
    car = SocketlessCar()
    channel, _ = car.commands(port=1000)
    telemetry, line = car.telemetry()
    ask(telemetry, line, do="join", port=1000)
    receive(channel, stamped(90, 0, speed=0) * 2)
    car.tell()
    clock = line.frames()[-1]["you"]["clock"]
    assert ask(telemetry, line, do="sync", clock=clock, words=2, stamp=stamp_at(0))["ok"]
    receive(channel, stamped(90, 0, speed=0))
    car.now_ms = 9000
    receive(channel, stamped(120, car.now_ms - 8188, speed=50))
    assert channel.session.counts["stale"] == 2
    car.tell()
    clock = line.frames()[-1]["you"]["clock"]
    assert clock == 9000 // 4
    assert ask(telemetry, line, do="sync", clock=clock, words=4, stamp=stamp_at(9000))["ok"]
    receive(channel, stamped(90, car.now_ms, speed=0))
    receive(channel, stamped(130, car.now_ms))
    assert car.board.angles == [90, 90, 130]
    car.tell()
    assert line.frames()[-1]["you"]["clock"] is None
