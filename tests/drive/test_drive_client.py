"""A driver's end and a car in one event loop with a mock clock: real sockets, and no waiting."""

import asyncio
from contextlib import AsyncExitStack, closing, suppress

import pytest

from motorcade.drive.client import DriveClient
from motorcade.drive.connection import CarRefusesError
from motorcade.drive.wire import pack_frame
from motorcade.errors import DriveError
from support.driven_car import deaf_port
from support.loop_car import loop_car
from support.mock_board import NEUTRAL
from support.mock_clock import mock_clock, pass_time
from support.rooms import in_loop
from support.waiting import until
from support.working_drivers import HALF, behind_proxies, client, come_and_drive, drive_on, driving

AHEAD = (90, 1, 128)


@mock_clock
async def test_a_command_reaches_the_wheels_and_leaving_stops_them():
    async with loop_car() as car:
        async with client(car) as driver:
            with pytest.raises(ValueError, match=r"throttle is 1\.1; allowed: -1 to 1"):
                await driver.drive(throttle=1.1)
            async with driving(driver, 0.4, -0.2):
                await until(lambda: driver.telemetry and driver.telemetry.state == "moving")
                assert driver.telemetry[1:4] == (108, 1, 102)
                assert driver.you["drives"]
                assert driver.telemetry.driver == driver.you["name"]
        await until(lambda: car.board.setpoint == NEUTRAL)
        # The client stopped the car before it hung up, so the next driver finds a car that is ready.
        assert car.control.telemetry().failsafes == 0


@mock_clock
async def test_driving_for_a_time_ends_by_itself():
    async with loop_car() as car, client(car, fresh_s=1) as driver:
        await driver.drive_for(0.4, -0.5, 1)
        await until(lambda: car.board.was_told((0, 0, 128)) and not car.board.moves)
        first_s = next(at_s for at_s, setpoint in car.board.notes if setpoint[2])
        # A car that was at rest takes a tenth of a second to be ready.
        assert 0.29 < car.board.notes[-1][0] - first_s < 0.41


@mock_clock
async def test_driving_for_a_time_begins_when_the_car_can_move_however_slow_the_network_is():
    async with loop_car() as car, behind_proxies(car) as (driver, proxies):
        for proxy in proxies:
            proxy.delay_s = 0.15
        await driver.drive_for(0.4, 0.5)
        await until(lambda: car.board.has_moved() and not car.board.moves)


@mock_clock
async def test_a_caller_that_hangs_stops_the_car_though_the_connection_works():
    async with loop_car() as car, client(car, fresh_s=0.1) as driver:
        async with driving(driver):
            await until(car.board.has_moved)
        last_s = asyncio.get_running_loop().time()
        await until(lambda: not car.board.moves)
        assert asyncio.get_running_loop().time() - last_s < 0.2
        count = len(car.board.notes)
        for _ in range(6):
            assert (await driver.next_telemetry()).state != "moving"
        assert driver.connected
        assert not car.board.has_moved(count)


@mock_clock
async def test_a_new_driver_drives_within_half_a_second():
    loop = asyncio.get_running_loop()
    for wait_s in (0, 0.07, 5):
        async with loop_car() as car, client(car) as driver:
            await pass_time(wait_s)
            begin_s = loop.time()
            async with driving(driver, 0.5, 0):
                await until(car.board.has_moved)
                assert loop.time() - begin_s < 0.5


@mock_clock
async def test_only_the_newest_command_is_sent_and_no_more_than_the_car_takes():
    async with loop_car() as car, client(car) as driver:
        loop = asyncio.get_running_loop()
        end_s = loop.time() + 0.5
        while loop.time() < end_s:
            await driver.drive(HALF)
            await pass_time(0.001)
        await driver.next_telemetry()
        await driver.next_telemetry()
        assert driver.you["over-rate"] == 0
        assert 5 < driver.you["applied"] <= 50


@mock_clock
async def test_two_drivers_hand_the_wheel_over_and_anyone_stops_the_car():
    async with loop_car() as car, client(car, fresh_s=1) as first, client(car) as second:
        async with driving(first):
            await until(lambda: first.you.get("drives") and car.board.moves)
            assert await second.request() is False
            await until(lambda: second.you and first.telemetry.wanted_by == second.you["name"])
            await second.stop()
            await until(lambda: not car.board.moves and first.telemetry.state == "stopped")
            await second.clear()
        async with driving(second):
            await until(lambda: second.you["drives"] and car.board.moves)
        await second.release()
        async with driving(first):
            await until(lambda: first.you["drives"] and car.board.moves)


@mock_clock
async def test_a_car_that_refuses_gives_its_reason_and_one_without_telemetry_is_driven_too():
    async with loop_car() as car:
        async with client(car) as driver:
            with pytest.raises(CarRefusesError, match="no program") as refused:
                await driver.resume_program()
            assert "程序" in refused.value.sentence("zh")
        async with DriveClient("127.0.0.1", car.port, telemetry_port=0) as bare, driving(bare):
            await until(lambda: car.board.setpoint == AHEAD)
            with pytest.raises(DriveError, match="telemetry port"):
                await bare.stop()


@mock_clock
async def test_a_full_car_is_distinguished_from_an_absent_one():
    async with loop_car() as car, AsyncExitStack() as stack:
        for _ in range(9):
            watcher = await stack.enter_async_context(client(car))
            await watcher.request()
        with pytest.raises(DriveError) as full:
            await come_and_drive(client(car, patience_s=2))
        assert "9" in str(full.value)
        assert "满" in full.value.sentence("zh")


@mock_clock
async def test_where_no_car_is_the_sentence_names_the_address_and_the_reason():
    with deaf_port() as port, pytest.raises(DriveError, match=f":{port} .*no program listens there.*drive serve"):
        async with DriveClient("127.0.0.1", port, patience_s=2):
            pass
    begin_s = asyncio.get_running_loop().time()
    with pytest.raises(DriveError, match=r"no address 'there-is-none\.invalid'"):
        async with DriveClient("there-is-none.invalid", patience_s=600):
            pass
    assert asyncio.get_running_loop().time() - begin_s < 300


@mock_clock
async def test_a_car_that_stays_away_is_an_error_of_the_next_command():
    async with AsyncExitStack() as stack:
        async with loop_car() as car:
            driver = await stack.enter_async_context(client(car, patience_s=0.2))
            await driver.next_telemetry()
        with pytest.raises(DriveError, match=r"has been away for \d+ s"):
            await drive_on(driver)
        with pytest.raises(DriveError, match="away"):
            await driver.stop()
        with pytest.raises(DriveError, match="away"):
            await driver.next_telemetry()


@pytest.mark.parametrize("floods", ["commands", "telemetry"])
@in_loop
async def test_a_car_that_floods_is_hung_up(floods):
    """Ten frames a second are a car's; what a peer may cost has a bound."""
    frame = pack_frame({"kind": "telemetry", "state": "ready"}) * 1000
    sent_bytes = 0

    async def flood(reader, writer):
        nonlocal sent_bytes
        with closing(writer), suppress(OSError):
            while sent_bytes < 1 << 26:
                writer.write(frame)
                sent_bytes += len(frame)
                await writer.drain()

    async def wait(reader, writer):
        with closing(writer), suppress(OSError):
            await reader.read()

    places = {}
    async with AsyncExitStack() as servers:
        for name in ("commands", "telemetry"):
            listener = await asyncio.start_server(flood if name == floods else wait, "127.0.0.1", 0)
            places[name] = listener.sockets[0].getsockname()[1]
            await servers.enter_async_context(listener)
        driver = DriveClient("127.0.0.1", places["commands"], telemetry_port=places["telemetry"])
        driver.begin()
        await until(lambda: driver.problem)
        await driver.end()
    # The buffers of the system are filled, and little more is read.
    assert sent_bytes < 1 << 25


def test_a_freshness_far_beyond_the_failsafe_is_refused():
    for fresh_s in (0.01, 1.5, float("nan")):
        with pytest.raises(ValueError, match="fresh_s is"):
            DriveClient("127.0.0.1", fresh_s=fresh_s)
