"""A driver's end for programs without asyncio, against a running car."""

import threading
from inspect import signature

import pytest

from motorcade.drive.blocking_client import BlockingDriveClient
from motorcade.drive.client import DriveClient
from motorcade.drive.connection import CarRefusesError
from motorcade.errors import DriveError
from support.driven_car import deaf_port
from support.mock_board import NEUTRAL
from support.waiting import wait_until
from support.working_drivers import HALF


def test_a_program_without_asyncio_drives_too(car):
    with BlockingDriveClient("127.0.0.1", car.port, telemetry_port=car.telemetry_port) as driver:
        assert driver.connected
        driver.drive(throttle=HALF)
        wait_until(car.board.has_moved)
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


def test_a_blocking_client_that_finds_no_car_leaves_no_thread_behind():
    before = set(threading.enumerate())
    with deaf_port() as port:
        finds_none = pytest.raises(DriveError)
        with finds_none, BlockingDriveClient("127.0.0.1", port, patience_s=0.2):
            pass
    assert set(threading.enumerate()) <= before


@pytest.mark.parametrize("name", ["drive", "drive_for"])
def test_what_a_program_leaves_out_is_the_same_with_and_without_asyncio(name):
    blocking, plain = (signature(getattr(kind, name)).parameters for kind in (BlockingDriveClient, DriveClient))
    assert {each: blocking[each].default for each in blocking} == {each: plain[each].default for each in plain}
