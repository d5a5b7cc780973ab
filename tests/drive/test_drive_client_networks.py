"""A driver's end behind bad networks: it comes back, the car stands meanwhile, and nothing old moves it."""

import asyncio
from dataclasses import replace

import pytest

from support.driven_car import PATIENT, STEADY, DrivenCar, until, wait_until
from support.working_drivers import HALF, behind_proxies, wishing


@pytest.mark.parametrize("reset", [True, False], ids=["reset", "ended"])
def test_a_connection_that_is_cut_comes_back_and_the_car_stands_meanwhile(car, reset):
    async def drive():
        async with behind_proxies(car) as (driver, proxies), wishing(driver):
            await until(lambda: car.board.moves)
            for proxy in proxies:
                proxy.cut(reset)
            await until(lambda: not car.board.moves)
            await until(lambda: car.board.moves)
            assert driver.connected

    asyncio.run(drive())


def test_a_stick_that_is_held_across_a_break_does_not_make_the_car_jump(patient_car):
    car = patient_car

    async def drive():
        async with behind_proxies(car, rearm=False) as (driver, proxies):
            async with wishing(driver):
                await until(lambda: car.board.moves)
                for proxy in proxies:
                    proxy.cut()
                await until(lambda: not driver.connected)
                await until(lambda: driver.connected and driver.telemetry)
                count = len(car.board.notes)
                for _ in range(5):
                    await driver.next_telemetry()
                assert driver.waits_for_release
                assert not any(setpoint[2] for _, setpoint in car.board.notes[count:])
            async with wishing(driver, 0.0):
                await until(lambda: not driver.waits_for_release)
            async with wishing(driver):
                await until(lambda: car.board.moves)

    asyncio.run(drive())


def test_a_stick_that_is_held_while_the_car_starts_anew_does_not_make_it_jump(patient_car):
    car = patient_car

    async def drive():
        async with behind_proxies(car, rearm=False) as (driver, proxies), wishing(driver):
            await until(lambda: car.board.moves)
            with DrivenCar(profile=PATIENT) as other:
                for proxy, port in zip(proxies, (other.port, other.telemetry_port), strict=True):
                    proxy.target = proxy.target[0], port
                    proxy.cut()
                await until(lambda: other.server.channels and driver.telemetry)
                for _ in range(5):
                    await driver.next_telemetry()
                assert driver.waits_for_release
                assert not any(setpoint[2] for _, setpoint in other.board.notes)

    asyncio.run(drive())


def test_a_pulled_cable_is_noticed_and_the_wheel_is_taken_again():
    async def drive(car):
        async with behind_proxies(car) as (driver, proxies), wishing(driver):
            await until(lambda: car.board.moves)
            await until(lambda: driver.you.get("drives"))
            for proxy in proxies:
                proxy.half_open()
            await until(lambda: not car.board.moves)
            # The car still believes in its old driver, who is this client.
            await until(lambda: car.board.moves)
            assert car.control.telemetry().failsafes >= 1

    never = replace(STEADY, drive=replace(STEADY.drive, hand_over_ms=600_000))
    with DrivenCar(profile=never) as car:
        asyncio.run(drive(car))


def test_a_frozen_network_brings_no_old_commands_when_it_thaws(car):
    async def drive():
        async with behind_proxies(car) as (driver, proxies), wishing(driver):
            await until(lambda: driver.you.get("drives") and car.board.moves)
            for proxy in proxies:
                proxy.set_both(held=True)
            await until(lambda: not car.board.moves)
            # Longer than the client believes in a car that tells nothing, and shorter than until it starts anew.
            await asyncio.sleep(1.0)
            waiting = proxies[0].up_waiting
            for proxy in proxies:
                proxy.set_both(held=False)
            await until(lambda: car.board.moves)
            assert 0 < waiting <= 15

    asyncio.run(drive())


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
def test_a_bad_network_is_driven_through(car, faults):
    async def drive():
        async with behind_proxies(car) as (driver, proxies), wishing(driver, HALF, -1.0):
            proxies[0].set_both(**faults)
            await until(lambda: sum(setpoint == (180, 1, 128) for _, setpoint in car.board.notes) >= 20)
            assert car.control.telemetry().refused == 0

    asyncio.run(drive())
    wait_until(lambda: not car.board.moves)
