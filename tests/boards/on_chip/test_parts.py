"""Parts of a MicroPython car: motors have no power while they turn round, distances are exact, images stay whole."""

from dataclasses import replace

import pytest
from driven_car import Bench
from simulated.flash import Flash, PowerCut

from motorcade.boards.on_chip.parts import ImageFile, Motor
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.config.pins import parse_pins
from motorcade.config.profile import MeasuredWheels
from motorcade.firmware.car_files import settings_of
from support.chip_benches import RP2040, SMALL, bench, board_of
from support.strategies import CLASSROOM

LARGE = bytes.fromhex("FFFF0100" + "64800000" * 255 + "C0280000" * 255)
MIDDLE = bytes.fromhex("20080200" + "64800000" * 32 + "C0280000" * 8)
EMPTY = bytes(4)

# Motors


def power_of(chip, forward, backward) -> int:
    return chip.duties.get(forward, 0) - chip.duties.get(backward, 0)


def test_a_driver_without_enable_has_the_pwm_on_its_direction_pins():
    a_bench = bench()
    motor = Motor(a_bench.machine, {"forward": 2, "backward": 5})
    for duty in (255, 100, 0, -100, -255):
        motor.drive(duty)
        assert power_of(a_bench.chip, 2, 5) == (abs(duty) * 65535 // 255) * (1 if duty >= 0 else -1)


def test_a_motor_changes_its_direction_without_power():
    a_bench = bench()
    board = board_of(a_bench)
    happened = []
    a_bench.chip.listeners.append(lambda *what: happened.append(what))
    board.set_wheels(1, 3)
    board.set_wheels(2, 3)
    left = a_bench.pins["left_motor"]
    levels, power, powers_at_changes = {}, 0, []
    for what, pin, value in happened:
        if what == "level" and pin in left.values():
            levels[pin] = value
            powers_at_changes.append(power)
        if (what, pin) == ("duty", left["enable"]):
            power = value
        assert not levels.get(left["forward"]) or not levels.get(left["backward"])
    assert set(powers_at_changes) == {0}
    assert power == 65535


def test_the_faster_wheel_gets_less_power_where_its_profile_says_so():
    profile = replace(CLASSROOM, wheels=MeasuredWheels(left_duty_percent=60))
    a_bench = Bench(settings_of(parse_pins(RP2040, "rp2040"), profile, False, number=1), "rp2")
    board = board_of(a_bench)
    for direction, level, duties in ((0, 3, (153, 255)), (0, 1, (69, 115)), (2, 3, (153, -255)), (0, 0, (0, 0))):
        board.set_wheels(direction, level)
        a_bench.observed.look()
        assert a_bench.observed.seen[-1][2] == tuple(duty * 65535 // 255 for duty in duties)


# The ultrasonic sensor: its distance is read without waiting, and dropped when it is old


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
    a_bench.clock.sleep_ms(160)
    assert board.obstacle_mm() == NOTHING_IN_SIGHT_MM


# The image: the new one or the old one, whole, after any cut of power and in a full flash


def cuts(flash: Flash, old: bytes | None, new: bytes):
    """Return what is found after each cut of power while ``new`` replaces ``old``."""
    for steps in range(len(new) + 100):
        flash.files.clear()
        flash.cut_after = None
        store = ImageFile("car.image", flash, flash.open)
        if old is not None:
            store.save(old)
        flash.cut_after = steps
        try:
            store.save(new)
        except PowerCut:
            flash.cut_after = None
            yield store.load()
        else:
            flash.cut_after = None
            assert store.load() == new
            return
    raise AssertionError("the power was never enough")


PAIRS = [(SMALL, MIDDLE), (MIDDLE, SMALL), (EMPTY, SMALL), (None, SMALL), (MIDDLE, MIDDLE[:-4] + EMPTY), (SMALL, LARGE)]


@pytest.mark.parametrize("atomic_rename", [True, False], ids=["littlefs", "FAT"])
@pytest.mark.parametrize(("old", "new"), PAIRS, ids=lambda image: f"{len(image or b'')} bytes")
def test_a_cut_of_power_at_any_byte_leaves_the_old_image_or_the_new_one(atomic_rename, old, new):
    found = list(cuts(Flash(atomic_rename), old, new))
    assert len(found) > len(new)
    assert set(found) <= {old, new}
    assert found[0] == old


class CachedFlash(Flash):
    """A flash whose cache keeps all changes until a sync: a cut loses what changed since the last one.

    Not in the simulated flash itself, where it would change how long a metered car's turns are.
    """

    def __init__(self):
        super().__init__()
        self._synced = {}

    def sync(self):
        super().sync()
        self._synced = dict(self.files)

    def lose(self):
        super().lose()
        self.files = dict(self._synced)


def test_a_cut_of_power_after_an_image_was_stored_changes_nothing():
    flash = CachedFlash()
    store = ImageFile("car.image", flash, flash.open)
    store.save(SMALL)
    store.save(MIDDLE)
    flash.lose()
    assert store.load() == MIDDLE


def test_after_a_cut_the_next_image_is_stored():
    flash = Flash()
    for _ in cuts(flash, SMALL, LARGE):
        ImageFile("car.image", flash, flash.open).save(LARGE)
        assert ImageFile("car.image", flash, flash.open).load() == LARGE
        break


def test_a_full_flash_keeps_the_old_image_and_room_for_a_smaller_one():
    flash = Flash(room=100)
    store = ImageFile("car.image", flash, flash.open)
    store.save(SMALL)
    with pytest.raises(OSError, match="28"):
        store.save(LARGE)
    assert store.load() == SMALL
    assert list(flash.files) == ["car.image"]
    store.save(EMPTY)
    assert store.load() == EMPTY
