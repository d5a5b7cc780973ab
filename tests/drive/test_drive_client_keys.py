"""A driver's end with keys: it drives a car that it trusts and that trusts it; else the sentence speaks of keys."""

import pytest

from motorcade.drive.client import DriveClient
from motorcade.drive.connection import CarRefusesError
from motorcade.drive.keys import server_context
from motorcade.errors import DriveError, MotorcadeError
from support.loop_car import loop_car
from support.mock_clock import mock_clock
from support.waiting import until
from support.working_drivers import client, come_and_drive, driving


@pytest.fixture
def tls(keys):
    return server_context(keys / "car-ada.pem")


@mock_clock
async def test_with_keys_a_driver_drives_under_the_name_in_them_and_goes_on_hearing(tls, keys):
    async with loop_car(tls) as car, client(car, keys=keys / "driver-lin.pem") as driver, driving(driver):
        await until(lambda: driver.telemetry and driver.telemetry.driver)
        assert driver.telemetry.driver.startswith("lin")
        await until(lambda: car.board.moves)
        names = set()
        for _ in range(8):
            await driver.next_telemetry()
            names.add(driver.you.get("name"))
        assert len(names) == 1
        await driver.stop()
        await until(lambda: not car.board.moves)


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        ({"keys": "others/driver-mallory.pem"}, "not-trusted", "doesn't show the certificate"),
        ({"keys": "driver-lin.pem", "car": "bob"}, "not-trusted", "bob"),
        ({}, "says-nothing", "keys"),
    ],
    ids=["of another class", "another car", "none"],
)
@mock_clock
async def test_without_the_right_keys_nobody_drives_and_the_sentence_speaks_of_keys(tls, keys, options, code, says):
    if "keys" in options:
        options = {**options, "keys": keys / options["keys"]}
    async with loop_car(tls) as car:
        with pytest.raises(DriveError, match=says) as raised:
            await come_and_drive(client(car, patience_s=3, **options))
        assert raised.value.code == code
        assert not car.board.has_moved()


@mock_clock
async def test_the_error_of_a_driver_whose_keys_the_car_refuses_speaks_of_keys(keys, tmp_path):
    # The car trusts another authority than the one that its own certificate is from.
    mixed = tmp_path / "mixed.pem"
    own, other = ((keys / name).read_text(encoding="utf-8") for name in ("car-ada.pem", "others/car-eve.pem"))
    mark = "-----BEGIN CERTIFICATE-----"
    mixed.write_text(own[: own.rindex(mark)] + other[other.rindex(mark) :], encoding="utf-8")
    async with loop_car(server_context(mixed)) as car:
        with pytest.raises(CarRefusesError, match="doesn't accept your keys"):
            await come_and_drive(client(car, keys=keys / "driver-lin.pem", patience_s=3))


@mock_clock
async def test_the_error_of_keys_for_a_car_without_keys_is_to_leave_them_out(keys):
    async with loop_car() as car:
        with pytest.raises(DriveError, match=r"started with --keys\?"):
            await come_and_drive(client(car, keys=keys / "driver-lin.pem"))


@mock_clock
async def test_a_client_sends_nothing_to_a_car_that_takes_something_else(keys, tls):
    """Neither keys to a car without them, nor commands to one that wants them."""
    async with loop_car() as car:
        with pytest.raises(DriveError, match="sends telemetry without TLS"):
            await come_and_drive(client(car, keys=keys / "driver-lin.pem", patience_s=2))
        assert (car.control.telemetry().refused, car.control.telemetry().turned_away) == (0, 0)
    async with loop_car(tls) as car:
        said = []
        car.server.refusals.say = said.append
        with pytest.raises(DriveError, match="--keys"):
            await come_and_drive(client(car, patience_s=3))
        assert not car.server.commands
        assert not car.board.has_moved()
        assert said == []


def test_keys_need_telemetry(keys):
    with pytest.raises(MotorcadeError, match="exclude each other"):
        DriveClient("127.0.0.1", telemetry_port=0, keys=keys / "driver-lin.pem")
