"""A driver's end with keys: it drives whom it trusts and who trusts it, and says so where nobody does."""

import asyncio

import pytest

from motorcade.drive.connection import CarError, CarRefusesError
from motorcade.drive.tls.keys import server_context
from support.driven_car import PATIENT, STEADY, DrivenCar, until
from support.working_drivers import behind_proxies, client, come_and_drive, wishing


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
        ({"keys": "others/driver-mallory.pem"}, CarError, "doesn't show the certificate"),
        ({"keys": "driver-lin.pem", "car": "bob"}, CarError, "bob"),
        ({}, CarError, "keys"),
    ],
    ids=["of another class", "another car", "none"],
)
def test_without_the_right_keys_nobody_drives_and_the_sentence_speaks_of_keys(locked_car, keys, options, error, says):
    if "keys" in options:
        options = {**options, "keys": keys / options["keys"]}

    with pytest.raises(error, match=says):
        asyncio.run(come_and_drive(client(locked_car, patience_s=3, **options)))
    assert not any(setpoint[2] for _, setpoint in locked_car.board.notes)


def test_a_driver_whose_keys_the_car_refuses_is_told_so(keys, tmp_path):
    # The car believes in another authority than the one that its own certificate is from.
    mixed = tmp_path / "mixed.pem"
    own, other = ((keys / name).read_text(encoding="utf-8") for name in ("car-ada.pem", "others/car-eve.pem"))
    mark = "-----BEGIN CERTIFICATE-----"
    mixed.write_text(own[: own.rindex(mark)] + other[other.rindex(mark) :], encoding="utf-8")

    refused = pytest.raises(CarRefusesError, match="doesn't accept your keys")
    with DrivenCar(server_context(mixed), profile=PATIENT) as car, refused:
        asyncio.run(come_and_drive(client(car, keys=keys / "driver-lin.pem", patience_s=3)))


def test_keys_for_a_car_that_has_none_are_told_to_be_left_away(car, keys):
    with pytest.raises(CarError, match=r"started with --keys\?"):
        asyncio.run(come_and_drive(client(car, keys=keys / "driver-lin.pem")))
