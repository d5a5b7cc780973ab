"""What a MicroPython car survives: a babbling line, 2^30 edges, a loop that hangs, an old MicroPython."""

import pytest
from simulated.microcontroller import Implementation, Reset

from motorcade.boards.on_chip import power_on
from motorcade.boards.on_chip.infrared import InfraredReceiver
from motorcade.words.infrared import frame_durations_us
from support.chip_benches import FRAME, RP2040, bench, board_of

WITH_UART = RP2040 + "[serial]\ntransmit = 8\nreceive = 9\n"
EDGES = 1 << 30


def test_a_line_that_never_falls_silent_does_not_hold_the_car():
    a_bench = bench(text=WITH_UART, platform="rp2")
    board = board_of(a_bench)
    a_bench.upload(0, bytes(range(256)) * 5)
    a_bench.clock.sleep_ms(100)
    begin_us = a_bench.chip.now_us
    assert len(board.read_serial()) > 40
    assert a_bench.chip.now_us - begin_us < 1000


def test_a_follower_hears_after_any_number_of_edges():
    clock_us = [0]
    receiver = InfraredReceiver(lambda: clock_us[0], 560)

    def hear() -> list[int]:
        level, found = 0, []
        for duration_us in [*frame_durations_us(FRAME), 5000]:
            receiver.take_edge(clock_us[0], level)
            clock_us[0] = (clock_us[0] + duration_us) & EDGES - 1
            level = 1 - level
        found += receiver.received_frames()
        return found

    assert hear() == [FRAME]
    largest = 0
    for _ in range(50):
        assert hear() == [FRAME]
        counters = {name: value for name, value in vars(receiver).items() if type(value) is int and "us" not in name}
        largest = max(largest, *counters.values())
    # An integer that grows with the edges would leave MicroPython's small integers one day.
    assert largest <= 1024


def test_a_loop_that_hangs_is_reset():
    a_bench = bench(is_leader=True)
    board = board_of(a_bench)
    loop = power_on.Loop(board, a_bench.modules)
    for _ in range(3000):
        loop.turn()
    with pytest.raises(Reset):
        a_bench.clock.sleep_ms(2001)


@pytest.mark.parametrize(("text", "platform"), [(None, "esp32"), (RP2040, "rp2")])
def test_the_watchdog_lets_somebody_work_at_the_prompt(text, platform):
    a_bench = bench(is_leader=True, platform=platform, **({"text": text} if text else {}))
    a_bench.chip.at(100_000, a_bench.usb.arrive, b"\x03\x03\x03")
    power_on.start(a_bench.modules, lambda: False)
    a_bench.clock.sleep_ms(3_600_000)


@pytest.mark.parametrize(
    ("version", "is_refused"), [((1, 20, 0, ""), True), ((1, 21, 0, ""), False), ((2, 0, 0), False)]
)
def test_a_micropython_without_what_the_car_needs_is_refused_by_name(version, is_refused, capsys):
    a_bench = bench(is_leader=True)
    modules = a_bench.modules._replace(implementation=Implementation(a_bench.chip, version))
    power_on.start(modules, lambda: True)
    said = capsys.readouterr().out
    assert [each in said for each in ("1.20.0", "1.21.0")] == [is_refused] * 2


def test_an_older_rmt_gets_the_divider_and_a_newer_one_the_resolution():
    from simulated.esp32 import Esp32

    for knows_resolution in (True, False):
        a_bench = bench()
        chip = Esp32(a_bench.chip, knows_resolution)
        modules = a_bench.modules._replace(chip=chip)
        board = power_on.open_board(a_bench.settings, modules)
        board.send_frame(FRAME)
        assert a_bench.observed.seen[-1][2] == tuple(frame_durations_us(FRAME))


@pytest.mark.parametrize("begins_every_us", [70_000, 600_000])
def test_garbage_is_collected_where_it_costs_no_frame_and_not_during_an_upload(begins_every_us):
    a_bench = bench()
    loop = power_on.Loop(board_of(a_bench), a_bench.modules)
    at_us = []
    collect = a_bench.collector.collect
    a_bench.collector.collect = lambda: (at_us.append(a_bench.chip.now_us), collect())
    for number in range(20_000_000 // begins_every_us):
        a_bench.hear(number * begins_every_us, frame_durations_us(FRAME))
    a_bench.upload(12_500_000, bytes.fromhex("FFFF0100") + bytes(4 * 399), 2000)
    while a_bench.chip.now_us < 20_000_000:
        loop.turn()
    assert 4 <= len(at_us) <= 8
    assert not any(12_500_000 < each < 16_200_000 for each in at_us)
    # Each time right after the edge that begins a header's mark of 9 ms.
    assert all(each % begins_every_us <= 1200 for each in at_us)


def test_a_car_that_hears_nothing_collects_garbage_all_the_same():
    a_bench = bench()
    loop = power_on.Loop(board_of(a_bench), a_bench.modules)
    while a_bench.chip.now_us < 20_000_000:
        loop.turn()
    assert a_bench.collector.collections == 20_000 // power_on.COLLECT_AT_LEAST_MS
