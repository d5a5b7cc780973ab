"""A stick at a car that runs: a real thread, SDL's real code, and a driver on the network."""

import asyncio
import threading
from contextlib import asynccontextmanager, contextmanager, suppress

import pytest

from motorcade.drive.client import DriveClient
from motorcade.drive.input import deadman, local
from motorcade.drive.input.deadman import QUIT, Reading
from motorcade.drive.input.gamepad import Gamepad
from motorcade.drive.input.local import reading_input
from motorcade.errors import MotorcadeError
from support.driven_car import PATIENT, STEADY, DrivenCar
from support.virtual_pad import LEFT_X, LEFT_Y, RIGHT_BUTTON, START, UP, VirtualPad
from support.waiting import until

BY_PAD, BY_NETWORK, STANDING = (180, 1, 255), (0, 0, 128), (90, 1, 0)


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    """The device's thread is a real one, so the long times are made short."""
    monkeypatch.setattr(deadman, "RESTS_MS", 200)
    monkeypatch.setattr(local, "JOIN_S", 0.1)


@pytest.fixture
def car():
    with DrivenCar(profile=PATIENT) as car:
        yield car


@pytest.fixture
def pad():
    try:
        pad = VirtualPad()
    except MotorcadeError as problem:
        pytest.skip(str(problem))
    with pad:
        yield pad


@asynccontextmanager
async def pushed_by_network(car):
    """A driver on the network, who commands full right and half back all the time."""
    async with DriveClient("127.0.0.1", car.port, telemetry_port=car.telemetry_port) as client:

        async def push():
            while True:
                await client.drive(-0.5, 1)
                await client.next_telemetry()

        pushing = asyncio.ensure_future(push())
        yield
        pushing.cancel()
        with suppress(asyncio.CancelledError):
            await pushing


def ignored():
    pass


def test_a_pushed_pad_drives_and_a_released_pad_leaves_the_car_to_the_network(car, pad):
    async def scene():
        reports = []
        async with reading_input(car.control, Gamepad(), reports.append, ignored):
            pad.plug()
            await until(lambda: reports)
            async with pushed_by_network(car):
                await until(lambda: car.board.setpoint == BY_NETWORK)
                pad.push(LEFT_Y, UP)
                pad.push(LEFT_X, UP)
                await until(lambda: car.board.setpoint == BY_PAD)
                assert car.control.telemetry().driver == "Pad of the tests at the car"
                pad.rest()
                await until(lambda: car.board.setpoint == STANDING)
                await until(lambda: car.board.setpoint == BY_NETWORK)
        assert "is connected" in str(reports[0])

    asyncio.run(scene())


def test_a_pad_that_is_pulled_out_while_it_drives_leaves_a_car_that_stands_and_may_come_again(car, pad):
    async def scene():
        reports = []
        async with reading_input(car.control, Gamepad(), reports.append, ignored):
            pad.plug((LEFT_Y, UP))
            await until(lambda: len(reports) == 1)
            pad.rest()
            # So that it has been seen at rest, which nothing else tells.
            pad.hold(RIGHT_BUTTON)
            await until(lambda: car.control.telemetry().state == "stopped")
            pad.hold(START)
            await until(lambda: car.control.telemetry().state != "stopped")
            pad.push(LEFT_Y, UP)
            await until(lambda: car.board.moves)
            pad.unplug()
            await until(lambda: len(reports) == 2)
            assert not car.board.moves
            count = len(car.board.notes)
            pad.plug((LEFT_Y, UP))
            await until(lambda: len(reports) == 3)
            pad.hold(RIGHT_BUTTON)
            await until(lambda: car.control.telemetry().state == "stopped")
        assert not any(setpoint[2] for _, setpoint in car.board.notes[count:])
        assert [str(sentence).split(":")[0] for sentence in reports] == [
            "Pad of the tests is connected",
            "Pad of the tests is gone",
            "Pad of the tests is connected",
        ]

    asyncio.run(scene())


def test_the_emergency_button_stops_who_drives_on_the_network(car, pad):
    async def scene():
        async with reading_input(car.control, Gamepad(), print, ignored), pushed_by_network(car):
            pad.plug()
            await until(lambda: car.board.setpoint == BY_NETWORK)
            pad.hold(RIGHT_BUTTON)
            await until(lambda: car.control.telemetry().state == "stopped")
            assert not car.board.moves

    asyncio.run(scene())


class Source:
    """A device of the test's making; ``reading`` may be an error, or an event to wait for."""

    def __init__(self, reading=None):
        self.reading = reading or Reading("D", (0, 0))

    def read(self):
        if isinstance(self.reading, Exception):
            raise self.reading
        if isinstance(self.reading, threading.Event):
            self.reading.wait()
            return Reading(None)
        return self.reading


@contextmanager
def opened(source):
    if isinstance(source, Exception):
        raise source
    yield source


async def driving(car, source):
    """The source is pushed, and the car drives."""
    await until(lambda: car.control.telemetry().watchers)
    source.reading = Reading("D", (0, 0), ("stop",))
    await until(lambda: car.control.telemetry().state == "stopped")
    source.reading = Reading("D", (0, 0), ("clear",))
    await until(lambda: car.control.telemetry().state != "stopped")
    source.reading = Reading("D", (1, 0))
    await until(lambda: any(setpoint[2] for _, setpoint in car.board.notes))


def test_a_device_that_cannot_be_read_any_more_stops_the_car_and_is_reported(car):
    async def scene():
        reports, source = [], Source()
        async with reading_input(car.control, opened(source), reports.append, ignored):
            await driving(car, source)
            source.reading = OSError("the cable broke")
            await until(lambda: not car.board.moves)
            await until(lambda: len(reports) == 2)
        assert str(reports[1]) == "the stick at the car can't be read any more: the cable broke"
        assert car.control.telemetry().driver is None

    asyncio.run(scene())


def test_a_device_whose_driver_hangs_stops_the_car_and_does_not_keep_it_from_ending():
    async def scene(car):
        source, freed = Source(), threading.Event()
        try:
            async with reading_input(car.control, opened(source), print, ignored):
                await driving(car, source)
                source.reading = freed
                await until(lambda: not car.board.moves)
                assert car.control.telemetry().failsafes == 1
        finally:
            freed.set()

    with DrivenCar(profile=STEADY) as car:
        asyncio.run(scene(car))


def test_a_stick_that_cannot_be_opened_is_an_error_of_the_caller(car):
    async def scene():
        async with reading_input(car.control, opened(MotorcadeError("sdl-fails", reason="R")), print, ignored):
            pytest.fail("there is no stick")

    with pytest.raises(MotorcadeError, match="R"):
        asyncio.run(scene())


def test_quit_calls_leave(car):
    async def scene():
        left = threading.Event()
        async with reading_input(car.control, opened(Source(Reading("D", (0, 0), (QUIT,)))), print, left.set):
            await until(left.is_set)

    asyncio.run(scene())
