"""The distance that a MicroPython car measures: exact, read without waiting, and dropped when it is old."""

import pytest
from driven_car import Bench

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from support.chip_benches import bench, board_of


def distances(a_bench: Bench, asked_for_ms: int) -> list[int]:
    board, found = board_of(a_bench), []
    for _ in range(0, asked_for_ms, 5):
        found.append(board.obstacle_mm())
        a_bench.clock.sleep_ms(5)
    return found


@pytest.mark.parametrize("distance_mm", [30, 150, 399, 1200, 1999])
def test_the_distance_is_exact_and_reading_it_does_not_wait(distance_mm):
    a_bench = bench()
    a_bench.show_obstacle(0, distance_mm)
    board = board_of(a_bench)
    a_bench.clock.sleep_ms(1)
    begin_us = a_bench.chip.now_us
    assert board.obstacle_mm() == NOTHING_IN_SIGHT_MM
    assert a_bench.chip.now_us - begin_us == 10
    a_bench.clock.sleep_ms(30)
    assert abs(board.obstacle_mm() - distance_mm) <= 1


@pytest.mark.parametrize("distance_mm", [None, 2100])
def test_a_distance_beyond_the_range_counts_as_nothing(distance_mm):
    a_bench = bench()
    a_bench.show_obstacle(0, distance_mm)
    assert set(distances(a_bench, 300)) == {NOTHING_IN_SIGHT_MM}
    assert a_bench.sonar.pings >= 4


def test_a_distance_is_dropped_when_it_is_old():
    a_bench = bench()
    a_bench.show_obstacle(0, 150)
    a_bench.clock.sleep_ms(1)
    a_bench.show_obstacle(400_000, None)
    found = distances(a_bench, 700)
    assert found[100:] == [NOTHING_IN_SIGHT_MM] * 40
    board = board_of(bench())
    assert board.obstacle_mm() == NOTHING_IN_SIGHT_MM


def test_a_distance_from_before_a_pause_is_dropped():
    a_bench = bench()
    a_bench.show_obstacle(0, 150)
    board = board_of(a_bench)
    a_bench.clock.sleep_ms(1)
    board.obstacle_mm()
    a_bench.clock.sleep_ms(30)
    assert board.obstacle_mm() < 160
    a_bench.show_obstacle(a_bench.chip.now_us, None)
    a_bench.clock.sleep_ms(500)
    assert board.obstacle_mm() == NOTHING_IN_SIGHT_MM
