"""A driver's end, against a running car: directly, by TLS, and through bad networks."""

import asyncio
import socket
import threading
import time
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import replace
from datetime import UTC, datetime

import pytest

from link.driven_car import NEUTRAL, PATIENT, STEADY, DrivenCar, until, wait_until
from link.fault_proxy import FaultProxy
from motorcade.link.blocking_drive_client import BlockingDriveClient
from motorcade.link.car_failures import CarAwayError, CarError, CarNotFoundError, CarNotTrustedError, CarRefusesError
from motorcade.link.certificates import CarKeys, make_keys
from motorcade.link.drive_client import DriveClient
from motorcade.link.keys import server_context

AHEAD = (90, 1, 128)
HALF = 0.5


@pytest.fixture
def car():
    with DrivenCar(profile=STEADY) as car:
        yield car


@pytest.fixture
def patient_car():
    with DrivenCar(profile=PATIENT) as car:
        yield car


def client(served, **options):
    return DriveClient("127.0.0.1", served.port, telemetry_port=served.telemetry_port, **options)


async def keep(driver, throttle=HALF, steering=0.0):
    """Wish the same for ever, as a program does that works; whatever happens to the connection."""
    while True:
        with suppress(CarError):
            await driver.drive(throttle, steering)
        await asyncio.sleep(0.05)


async def drive_on(driver):
    """Wish the same until that is an error."""
    while True:
        await driver.drive(HALF)
        await asyncio.sleep(0.05)


async def come_and_drive(driver):
    async with driver:
        await drive_on(driver)


@asynccontextmanager
async def wishing(driver, *wish):
    task = asyncio.create_task(keep(driver, *wish))
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@asynccontextmanager
async def behind_proxies(car, **options):
    """A client, and the two proxies that it drives through."""
    async with AsyncExitStack() as stack:
        proxies = [await stack.enter_async_context(FaultProxy(port)) for port in (car.port, car.telemetry_port)]
        ports = [proxy.port for proxy in proxies]
        driver = DriveClient("127.0.0.1", ports[0], telemetry_port=ports[1], **options)
        yield await stack.enter_async_context(driver), proxies


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
    assert patient_car.drive.telemetry().failsafes == 0


def test_driving_for_a_time_ends_by_itself(patient_car):
    async def drive():
        async with client(patient_car) as driver:
            await driver.drive_for(0.4, -0.5, 1)
            await until(lambda: not patient_car.board.moves)

    asyncio.run(drive())
    moving = [at_s for at_s, setpoint in patient_car.board.notes if setpoint == (0, 0, 128)]
    assert moving[-1] - moving[0] >= 0.25


def test_a_caller_who_hangs_lets_the_car_stop_though_the_connection_is_fine(car):
    async def drive():
        async with client(car, fresh_s=0.1) as driver:
            await driver.drive(HALF)
            await until(lambda: car.board.moves)
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
        async with client(car) as driver:
            await driver.drive(HALF)
            await until(lambda: car.board.moves)
            # The loop is stuck: the car itself has to notice.
            end_s = time.monotonic() + 20
            while car.board.moves:
                assert time.monotonic() < end_s
                time.sleep(0.01)

    asyncio.run(drive())
    assert car.drive.telemetry().failsafes == 1


def test_only_the_newest_wish_is_sent_and_more_than_the_car_takes_is_not(patient_car):
    async def drive():
        async with client(patient_car) as driver:
            begin_s = time.monotonic()
            while time.monotonic() - begin_s < 0.5:
                await driver.drive(HALF)
                await asyncio.sleep(0)
            await driver.next_telemetry()
            await driver.next_telemetry()
            assert driver.you["over-rate"] == 0
            assert driver.you["applied"] > 5

    asyncio.run(drive())


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


def test_a_stick_that_is_held_across_a_break_does_not_make_the_car_jump(car):
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


def test_a_stick_that_is_held_while_the_car_starts_anew_does_not_make_it_jump(car):
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
            assert car.drive.telemetry().failsafes == 1

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
            assert car.drive.telemetry().refused == 0

    asyncio.run(drive())
    wait_until(lambda: not car.board.moves)


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
            assert "程序" in refused.value.message("zh")
        async with DriveClient("127.0.0.1", car.port, bare=True) as bare:
            with pytest.raises(CarAwayError, match="telemetry port"):
                await bare.stop()

    asyncio.run(drive())


def test_a_car_that_tells_nothing_is_driven_too(car):
    async def drive():
        async with DriveClient("127.0.0.1", car.port, bare=True) as driver, wishing(driver):
            await until(lambda: car.board.setpoint == AHEAD)

    asyncio.run(drive())


def test_a_full_car_is_told_from_an_absent_one(car):
    async def drive():
        async with AsyncExitStack() as stack:
            for _ in range(9):
                watcher = await stack.enter_async_context(client(car))
                await watcher.request()
            with pytest.raises(CarError) as full:
                await come_and_drive(client(car, patience_s=0.5))
            assert "9" in str(full.value)
            assert "满" in full.value.message("zh")

    asyncio.run(drive())


def test_where_no_car_is_the_sentence_names_the_address_and_the_reason():
    async def drive():
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        with pytest.raises(CarNotFoundError, match=f"No car answers at 127.0.0.1:{port} .*refused.*drive serve"):
            async with DriveClient("127.0.0.1", port, patience_s=0.2):
                pass
        begin_s = time.monotonic()
        with pytest.raises(CarNotFoundError, match=r"no address 'there-is-none\.invalid'"):
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
            with pytest.raises(CarAwayError, match=r"has been away for \d+ s"):
                await drive_on(driver)
            with pytest.raises(CarAwayError):
                await driver.stop()
            with pytest.raises(CarAwayError):
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


# Keys


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    make_keys(folder, [CarKeys("ada")], ["lin"], datetime.now(UTC))
    make_keys(folder / "others", [CarKeys("eve")], ["mallory"], datetime.now(UTC))
    return folder


@pytest.fixture
def locked_car(keys):
    with DrivenCar(server_context(keys / "car-ada.pem"), profile=STEADY) as car:
        yield car


def test_with_keys_a_driver_drives_under_the_name_in_them(locked_car, keys):
    async def drive():
        async with client(locked_car, keys=keys / "driver-lin.pem") as driver, wishing(driver):
            await until(lambda: driver.telemetry and driver.telemetry.driver)
            assert driver.telemetry.driver.startswith("lin")
            await until(lambda: locked_car.board.moves)
            await driver.stop()
            await until(lambda: not locked_car.board.moves)

    asyncio.run(drive())


def test_a_car_with_keys_goes_on_telling(locked_car, keys):
    async def drive():
        async with client(locked_car, keys=keys / "driver-lin.pem") as driver, wishing(driver):
            await until(lambda: driver.you.get("drives"))
            names = set()
            for _ in range(8):
                await driver.next_telemetry()
                names.add(driver.you.get("name"))
            assert len(names) == 1

    asyncio.run(drive())


def test_a_cut_connection_by_tls_comes_back(locked_car, keys):
    async def drive():
        async with behind_proxies(locked_car, keys=keys / "driver-lin.pem") as (driver, proxies), wishing(driver):
            await until(lambda: locked_car.board.moves)
            for proxy in proxies:
                proxy.cut()
            await until(lambda: not locked_car.board.moves)
            await until(lambda: locked_car.board.moves)

    asyncio.run(drive())


@pytest.mark.parametrize(
    ("options", "error", "says"),
    [
        ({"keys": "others/driver-mallory.pem"}, CarNotTrustedError, "doesn't show the certificate"),
        ({"keys": "driver-lin.pem", "car": "bob"}, CarNotTrustedError, "bob"),
        ({}, CarError, "keys"),
    ],
    ids=["of another class", "another car", "none"],
)
def test_without_the_right_keys_nobody_drives_and_the_sentence_speaks_of_keys(locked_car, keys, options, error, says):
    if "keys" in options:
        options = {**options, "keys": keys / options["keys"]}

    with pytest.raises(error, match=says):
        asyncio.run(come_and_drive(client(locked_car, patience_s=0.5, **options)))
    assert not any(setpoint[2] for _, setpoint in locked_car.board.notes)


def test_a_driver_whose_keys_the_car_refuses_is_told_so(keys, tmp_path):
    # The car believes in another authority than the one that its own certificate is from.
    mixed = tmp_path / "mixed.pem"
    own, other = ((keys / name).read_text(encoding="utf-8") for name in ("car-ada.pem", "others/car-eve.pem"))
    mark = "-----BEGIN CERTIFICATE-----"
    mixed.write_text(own[: own.rindex(mark)] + other[other.rindex(mark) :], encoding="utf-8")

    refused = pytest.raises(CarRefusesError, match="doesn't accept your keys")
    with DrivenCar(server_context(mixed), profile=PATIENT) as car, refused:
        asyncio.run(come_and_drive(client(car, keys=keys / "driver-lin.pem", patience_s=0.5)))


def test_keys_for_a_car_that_has_none_are_told_to_be_left_away(car, keys):
    with pytest.raises(CarError, match=r"started with --keys\?"):
        asyncio.run(come_and_drive(client(car, keys=keys / "driver-lin.pem", patience_s=3)))


# The blocking face


def test_a_program_without_asyncio_drives_too(car):
    with BlockingDriveClient("127.0.0.1", car.port, telemetry_port=car.telemetry_port) as driver:
        assert driver.connected
        driver.drive(throttle=HALF)
        wait_until(lambda: car.board.moves)
        driver.drive_for(0.3, HALF, 1)
        assert driver.next_telemetry()
        assert driver.request() is True
        driver.stop()
        wait_until(lambda: driver.telemetry.state == "stopped")
        driver.clear()
        driver.release()
        with pytest.raises(CarRefusesError):
            driver.resume_program()
    wait_until(lambda: car.board.setpoint == NEUTRAL)


def test_a_blocking_program_that_hangs_lets_the_car_stop(car):
    with BlockingDriveClient("127.0.0.1", car.port, telemetry_port=car.telemetry_port, fresh_s=0.1) as driver:
        driver.drive(HALF)
        wait_until(lambda: car.board.moves)
        wait_until(lambda: not car.board.moves)
        for _ in range(3):
            driver.next_telemetry()
        assert not car.board.moves


def test_a_blocking_client_that_finds_no_car_leaves_no_thread_behind():
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    before = threading.active_count()
    with pytest.raises(CarNotFoundError), BlockingDriveClient("127.0.0.1", port, patience_s=0.1):
        pass
    assert threading.active_count() == before
