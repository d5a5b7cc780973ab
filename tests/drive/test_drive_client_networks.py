"""A driver's end behind bad networks: it connects again, the car stands still meanwhile, nothing old moves it."""

from dataclasses import replace

import pytest

from support.driven_car import CLASSROOM
from support.loop_car import loop_car
from support.mock_clock import mock_clock, pass_time
from support.waiting import until
from support.working_drivers import HALF, behind_proxies, driving


@pytest.mark.parametrize("reset", [True, False], ids=["reset", "ended"])
@mock_clock
async def test_a_connection_that_is_cut_comes_back_and_the_car_stands_still_meanwhile(reset):
    async with loop_car() as car, behind_proxies(car) as (driver, proxies), driving(driver):
        await until(lambda: car.board.moves)
        for proxy in proxies:
            proxy.cut(reset)
        await until(lambda: not car.board.moves)
        await until(lambda: car.board.moves)
        assert driver.connected


@mock_clock
async def test_a_stick_that_is_held_while_the_connection_breaks_does_not_move_the_car_again():
    async with loop_car() as car, behind_proxies(car, rearm=False) as (driver, proxies):
        async with driving(driver):
            await until(lambda: car.board.moves)
            for proxy in proxies:
                proxy.cut()
            await until(lambda: not driver.connected)
            await until(lambda: driver.connected and driver.telemetry)
            count = len(car.board.notes)
            for _ in range(5):
                await driver.next_telemetry()
            assert driver.waits_for_release
            assert not car.board.has_moved(count)
        async with driving(driver, 0.0):
            await until(lambda: not driver.waits_for_release)
        async with driving(driver):
            await until(lambda: car.board.moves)


@mock_clock
async def test_a_stick_that_is_held_while_the_car_starts_again_does_not_move_it():
    async with (
        loop_car() as car,
        behind_proxies(car, rearm=False) as (driver, proxies),
        driving(driver),
        loop_car() as other,
    ):
        await until(lambda: car.board.moves)
        for proxy, port in zip(proxies, (other.port, other.telemetry_port), strict=True):
            proxy.target = proxy.target[0], port
            proxy.cut()
        await until(lambda: other.server.channels and driver.telemetry)
        for _ in range(5):
            await driver.next_telemetry()
        assert driver.waits_for_release
        assert not other.board.has_moved()


@mock_clock
async def test_a_pulled_cable_is_noticed_and_the_client_gets_its_wheel_again():
    never = replace(CLASSROOM, drive=replace(CLASSROOM.drive, hand_over_ms=600_000))
    async with loop_car(profile=never) as car, behind_proxies(car) as (driver, proxies), driving(driver):
        await until(lambda: car.board.moves and driver.you.get("drives"))
        for proxy in proxies:
            proxy.half_open()
        await until(lambda: not car.board.moves)
        # To the car its former driver still drives, who is this client.
        await until(lambda: car.board.moves)
        assert car.control.telemetry().failsafes >= 1


@mock_clock
async def test_a_frozen_network_brings_no_old_commands_when_it_goes_on():
    async with loop_car() as car, behind_proxies(car) as (driver, proxies), driving(driver):
        await until(lambda: driver.you.get("drives") and car.board.moves)
        for proxy in proxies:
            proxy.set_both(held=True)
        await until(lambda: not car.board.moves)
        # Longer than a client sends to a car without telemetry, and shorter than until it connects again.
        await pass_time(1.0)
        waiting = proxies[0].up_waiting
        for proxy in proxies:
            proxy.set_both(held=False)
        await until(lambda: car.board.moves)
        assert 0 < waiting <= 15


@mock_clock
async def test_nothing_moves_or_sounds_before_the_client_has_answered_the_cars_clock():
    async with loop_car() as car, behind_proxies(car) as (driver, proxies):
        proxies[1].set_both(held=True)
        for _ in range(20):
            driver.steer(0.0, 0.0, horn=1)
            await pass_time(0.05)
        assert car.board.switched == []
        async with driving(driver):
            await pass_time(1.0)
            assert not car.board.has_moved()
            proxies[1].set_both(held=False)
            await until(lambda: car.board.moves)


@pytest.mark.parametrize(
    "faults",
    [
        {"delay_s": 0.08, "jitter_s": 0.04},
        {"loss": 0.1, "retransmit_s": 0.1},
        {"split": 1},
        {"reorder": 0.3},
    ],
    ids=["late", "lossy", "in pieces", "reordered"],
)
@mock_clock
async def test_a_bad_network_is_driven_through(faults):
    async with loop_car() as car:
        async with behind_proxies(car) as (driver, proxies), driving(driver, HALF, -1.0):
            proxies[0].set_both(**faults)
            await until(lambda: sum(setpoint == (180, 1, 128) for _, setpoint in car.board.notes) >= 20)
            assert car.control.telemetry().refused == 0
        await until(lambda: not car.board.moves)
