"""A driver's end behind bad networks: what its car alone would not make good; `tests/faults` tries the rest."""

from dataclasses import replace

from support.loop_car import loop_car
from support.mock_board import CLASSROOM
from support.mock_clock import mock_clock, pass_time
from support.waiting import until
from support.working_drivers import behind_proxies, driving


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
async def test_nothing_moves_or_sounds_before_the_client_has_answered_the_cars_clock():
    async with loop_car() as car, behind_proxies(car) as (driver, proxies):
        proxies[1].hold(True)
        for _ in range(20):
            driver.steer(0.0, 0.0, horn=1)
            await pass_time(0.05)
        assert car.board.switched == []
        async with driving(driver):
            await pass_time(1.0)
            assert not car.board.has_moved()
            proxies[1].hold(False)
            await until(lambda: car.board.moves)
