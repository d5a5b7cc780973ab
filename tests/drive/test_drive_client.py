"""A driver's end, against a running car."""

import asyncio
import time
from contextlib import AsyncExitStack

import pytest

from motorcade.drive.client import DriveClient
from motorcade.drive.connection import CarError, CarRefusesError
from support.driven_car import DEADLINE_S, NEUTRAL, DrivenCar, deaf_port, until, wait_until
from support.working_drivers import HALF, client, come_and_drive, drive_on, wishing

AHEAD = (90, 1, 128)


def test_a_wish_reaches_the_wheels_and_leaving_stops_them(patient_car):
    async def drive():
        async with client(patient_car) as driver:
            await driver.drive(throttle=0.4, steering=-0.2)
            await until(lambda: patient_car.board.setpoint == (108, 1, 102))
            async with wishing(driver, 0.4, -0.2):
                await until(lambda: driver.telemetry and driver.telemetry.state == "moving")
                assert driver.telemetry[1:4] == (108, 1, 102)
                assert driver.you["drives"]
                assert driver.telemetry.driver == driver.you["name"]

    asyncio.run(drive())
    wait_until(lambda: patient_car.board.setpoint == NEUTRAL)
    # Leaving isn't breaking off: the next driver finds a car that is ready.
    assert patient_car.control.telemetry().failsafes == 0


def test_driving_for_a_time_ends_by_itself(patient_car):
    async def drive():
        async with client(patient_car, fresh_s=1) as driver:
            begin_s = time.perf_counter()
            await driver.drive_for(0.4, -0.5, 1)
            await until(lambda: patient_car.board.was_told((0, 0, 128)) and patient_car.board.setpoint == NEUTRAL)
            assert patient_car.board.notes[-1][0] - begin_s >= 0.4

    asyncio.run(drive())


def test_a_caller_who_hangs_lets_the_car_stop_though_the_connection_is_fine(patient_car):
    car = patient_car

    async def drive():
        async with client(car, fresh_s=0.1) as driver:
            async with wishing(driver):
                await until(car.board.has_moved)
            await until(lambda: not car.board.moves)
            count = len(car.board.notes)
            told = await driver.next_telemetry()
            assert told.state != "moving"
            for _ in range(5):
                await driver.next_telemetry()
            assert driver.connected
            assert len(car.board.notes) <= count + 1

    asyncio.run(drive())


def test_a_program_that_freezes_whole_lets_the_car_stop(car):
    async def drive():
        async with client(car) as driver, wishing(driver):
            await until(lambda: car.board.moves)
            failsafes = car.control.telemetry().failsafes
            # The loop is stuck: the car itself has to notice.
            end_s = time.monotonic() + DEADLINE_S
            while car.board.moves or car.control.telemetry().failsafes == failsafes:
                assert time.monotonic() < end_s
                time.sleep(0.01)

    asyncio.run(drive())


def test_only_the_newest_wish_is_sent_and_more_than_the_car_takes_is_not(patient_car):
    async def drive():
        async with client(patient_car) as driver:
            begin_s = time.monotonic()
            while time.monotonic() - begin_s < 0.5 or driver.you.get("applied", 0) <= 5:
                assert time.monotonic() - begin_s < DEADLINE_S
                await driver.drive(HALF)
                await asyncio.sleep(0)
            await driver.next_telemetry()
            await driver.next_telemetry()
            assert driver.you["over-rate"] == 0

    asyncio.run(drive())


def test_two_drivers_hand_the_wheel_over_and_anyone_stops_the_car(patient_car):
    async def drive():
        async with client(patient_car, fresh_s=1) as first, client(patient_car) as second:
            async with wishing(first):
                await until(lambda: first.you.get("drives") and patient_car.board.moves)
                assert await second.request() is False
                await until(lambda: second.you and first.telemetry.wanted_by == second.you["name"])
                await second.stop()
                await until(lambda: not patient_car.board.moves and first.telemetry.state == "stopped")
                await second.clear()
            async with wishing(second):
                await until(lambda: second.you["drives"] and patient_car.board.moves)
            await second.release()
            async with wishing(first):
                await until(lambda: first.you["drives"] and patient_car.board.moves)

    asyncio.run(drive())


def test_a_car_that_says_no_says_why(car):
    async def drive():
        async with client(car) as driver:
            with pytest.raises(CarRefusesError, match="no program") as refused:
                await driver.resume_program()
            assert "程序" in refused.value.sentence("zh")
        async with DriveClient("127.0.0.1", car.port, telemetry_port=0) as bare:
            with pytest.raises(CarError, match="telemetry port"):
                await bare.stop()

    asyncio.run(drive())


def test_a_car_that_tells_nothing_is_driven_too(patient_car):
    async def drive():
        async with DriveClient("127.0.0.1", patient_car.port, telemetry_port=0) as driver, wishing(driver):
            await until(lambda: patient_car.board.setpoint == AHEAD)

    asyncio.run(drive())


def test_a_full_car_is_told_from_an_absent_one(car):
    async def drive():
        async with AsyncExitStack() as stack:
            for _ in range(9):
                watcher = await stack.enter_async_context(client(car))
                await watcher.request()
            with pytest.raises(CarError) as full:
                await come_and_drive(client(car, patience_s=2))
            assert "9" in str(full.value)
            assert "满" in full.value.sentence("zh")

    asyncio.run(drive())


def test_where_no_car_is_the_sentence_names_the_address_and_the_reason():
    async def drive():
        with deaf_port() as port:
            says = pytest.raises(CarError, match=f"No car answers at 127.0.0.1:{port} .*refused.*drive serve")
            with says:
                async with DriveClient("127.0.0.1", port, patience_s=2):
                    pass
        begin_s = time.monotonic()
        with pytest.raises(CarError, match=r"no address 'there-is-none\.invalid'"):
            async with DriveClient("there-is-none.invalid", patience_s=600):
                pass
        assert time.monotonic() - begin_s < 300

    asyncio.run(drive())


def test_a_car_that_stays_away_is_an_error_of_the_next_wish():
    async def drive():
        async with AsyncExitStack() as stack:
            with DrivenCar() as car:
                driver = await stack.enter_async_context(client(car, patience_s=0.2))
                await driver.next_telemetry()
            with pytest.raises(CarError, match=r"has been away for \d+ s"):
                await drive_on(driver)
            with pytest.raises(CarError):
                await driver.stop()
            with pytest.raises(CarError):
                await driver.next_telemetry()

    asyncio.run(drive())


@pytest.mark.parametrize("wrong", [{"throttle": 1.1}, {"steering": float("nan")}])
def test_a_wish_that_can_not_be_is_refused_and_not_sent(car, wrong):
    async def drive():
        async with client(car) as driver:
            with pytest.raises(ValueError, match="allowed: -1 to 1"):
                await driver.drive(**wrong)
            await driver.next_telemetry()

    asyncio.run(drive())
    assert not any(setpoint[2] for _, setpoint in car.board.notes)


def test_a_freshness_that_would_outlast_the_failsafe_by_far_is_refused():
    for fresh_s in (0.01, 1.5, float("nan")):
        with pytest.raises(ValueError, match="fresh_s is"):
            DriveClient("127.0.0.1", fresh_s=fresh_s)
