"""A car that is served: whatever happens to its clients or its own loop, the wheels stop in time."""

import asyncio
import contextlib
import itertools
import json
import socket
import struct
import threading
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from typing import BinaryIO

import pytest

from motorcade.drive.certificates import CarKeys, make_keys
from motorcade.drive.keys import server_context
from motorcade.drive.listener import DRIVE_PLACES
from motorcade.drive.wire import pack_frame
from motorcade.words.formats import DRIVE
from support.driven_car import NEUTRAL, PATIENT, DrivenCar
from support.loop_car import LoopCar, loop_car
from support.mock_clock import mock_clock, pass_time
from support.soak import SOAK
from support.waiting import DEADLINE_S, until, wait_until

MOVE = struct.pack(">I", DRIVE.encode(angle=40, direction=1, speed=150))
STILL = struct.pack(">I", DRIVE.encode(angle=40, direction=1, speed=0))
PERIOD_S = 0.04
FLOOD = 300


def connect(car: DrivenCar) -> socket.socket:
    return socket.create_connection(("127.0.0.1", car.port), DEADLINE_S)


@contextlib.contextmanager
def telemetry(car: DrivenCar) -> Iterator["Telemetry"]:
    address = "127.0.0.1", car.telemetry_port
    with socket.create_connection(address, DEADLINE_S) as line, line.makefile("rb") as frames:
        yield Telemetry(line, frames)


class Telemetry:
    """The telemetry of a car, frame by frame."""

    def __init__(self, line: socket.socket, frames: BinaryIO) -> None:
        self._line = line
        self._file = frames

    def next(self, kind: str = "telemetry") -> dict:
        for _ in range(100):
            (size,) = struct.unpack(">I", self._file.read(4))
            frame = json.loads(self._file.read(size))
            if frame["kind"] == kind:
                return frame
        raise AssertionError(f"the car sent no {kind}")

    def ask(self, **request) -> dict:
        text = json.dumps(request).encode()
        self._line.sendall(struct.pack(">I", len(text)) + text)
        return self.next("answer")


@contextlib.contextmanager
def steady(line: socket.socket, word: bytes = MOVE) -> Iterator[threading.Event]:
    """Send one command again and again in a thread, until the block ends or the event is set."""
    ended = threading.Event()

    def send() -> None:
        with contextlib.suppress(OSError):
            while not ended.wait(PERIOD_S):
                line.sendall(word)

    sender = threading.Thread(target=send)
    sender.start()
    try:
        yield ended
    finally:
        ended.set()
        sender.join(DEADLINE_S)


def drive_on(car: DrivenCar, line: socket.socket) -> None:
    """Drive until the wheels turn. A car on a busy machine may have to be armed again."""
    port = line.getsockname()[1]
    channel = wait_until(lambda: next((each for each in car.server.commands if each.port == port), None))
    for word in itertools.cycle((STILL, MOVE)):
        received = sum(channel.session.counts.values())
        line.sendall(word)
        wait_until(lambda received=received: sum(channel.session.counts.values()) > received)
        if car.board.moves:
            return


class Driver:
    """A client of the bare four bytes, in the car's own loop."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer
        self.sent_s = 0.0

    async def send(self, word: bytes) -> None:
        """Send a command, and wait for a period."""
        self.sent_s = asyncio.get_running_loop().time()
        self.writer.write(word)
        await pass_time(PERIOD_S)


@contextlib.asynccontextmanager
async def driver_at(port: int, car: LoopCar) -> AsyncIterator[Driver]:
    """A client whose command turns the wheels."""
    driver = Driver(*await asyncio.open_connection("127.0.0.1", port))
    for word in (STILL, MOVE):
        await driver.send(word)
    await until(lambda: car.board.moves)
    try:
        yield driver
    finally:
        driver.writer.transport.abort()


def close(driver: Driver) -> None:
    driver.writer.close()


def reset(driver: Driver) -> None:
    line = driver.writer.get_extra_info("socket")
    line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    driver.writer.transport.abort()


def send_end(driver: Driver) -> None:
    driver.writer.write_eof()


@pytest.mark.parametrize("end", [close, reset, send_end])
@mock_clock
async def test_a_client_that_is_gone_stops_the_wheels_at_once(end) -> None:
    async with loop_car() as car, driver_at(car.port, car) as driver:
        gone_s = asyncio.get_running_loop().time()
        end(driver)
        await until(lambda: car.board.setpoint == NEUTRAL)
        assert car.board.notes[-1][0] - gone_s < 0.05


@mock_clock
async def test_a_client_that_freezes_with_its_connection_open_stops_the_wheels_after_300_ms() -> None:
    async with loop_car() as car, driver_at(car.port, car) as driver:
        await until(lambda: car.board.setpoint == NEUTRAL)
        assert 0.3 <= car.board.notes[-1][0] - driver.sent_s < 0.32
        assert car.control.telemetry().state == "failsafe"
        refused, count = car.server.commands[0].session.counts["needs-neutral"], len(car.board.notes)
        await driver.send(MOVE)
        await driver.send(MOVE)
        assert car.server.commands[0].session.counts["needs-neutral"] == refused + 2
        assert not car.board.has_moved(count)
        await driver.send(STILL)
        assert car.board.was_told((40, 1, 0), count)
        await driver.send(MOVE)
        assert car.board.has_moved(count)


def test_a_server_that_is_stuck_stops_the_wheels_and_drops_what_came_meanwhile() -> None:
    # No failsafe helps here.
    watched = replace(PATIENT, drive=replace(PATIENT.drive, watchdog_ms=200))
    with DrivenCar(profile=watched) as car, connect(car) as line:
        drive_on(car, line)
        stalls, counts = car.control.telemetry().stalls, car.server.commands[0].session.counts
        with steady(line):
            with car.stuck():
                wait_until(lambda: car.board.setpoint == NEUTRAL)
                notes, refused = len(car.board.notes), counts["needs-neutral"]
            wait_until(lambda: counts["needs-neutral"] > refused + 2)
            assert len(car.board.notes) == notes
            assert car.control.telemetry().stalls > stalls


def test_the_wheels_stand_still_before_the_first_command_and_after_the_last() -> None:
    with contextlib.ExitStack() as held:
        with DrivenCar() as car:
            assert car.board.notes[0][1] == NEUTRAL
            drive_on(car, held.enter_context(connect(car)))
        assert car.board.setpoint == NEUTRAL


def test_a_board_with_a_programming_error_stands_still(patient_car: DrivenCar) -> None:
    car = patient_car
    apply = car.board.apply

    def fail(angle_deg: int, direction: int, speed: int) -> None:
        apply(angle_deg, direction, speed)
        if angle_deg == 41:
            raise ZeroDivisionError

    car.board.apply = fail
    with connect(car) as line:
        drive_on(car, line)
        line.sendall(struct.pack(">I", DRIVE.encode(angle=41, direction=1, speed=150)))
        assert line.recv(1) == b""
    wait_until(lambda: not car.board.moves)


def test_the_first_to_send_drives_and_others_watch_until_it_leaves(patient_car: DrivenCar) -> None:
    car = patient_car
    with connect(car) as first, connect(car) as second:
        drive_on(car, first)
        second.sendall(STILL)
        wait_until(lambda: [each for each in car.server.commands if each.session.counts["watching"]])
        told = car.control.telemetry()
        assert (told.driver, told.watchers, told.state) == (f"127.0.0.1:{first.getsockname()[1]}", 1, "moving")
        first.close()
        with steady(second, STILL):
            wait_until(lambda: car.board.setpoint == (40, 1, 0))


@mock_clock
async def test_clients_that_have_left_take_no_slot() -> None:
    async with loop_car() as car:
        for _ in range(2 * DRIVE_PLACES.most_of_one_address):
            async with driver_at(car.port, car):
                pass
            await until(lambda: not car.server.commands)
        assert car.control.telemetry().turned_away == 0


def test_a_flood_of_connections_leaves_the_driver_undisturbed_and_room_for_others(patient_car: DrivenCar) -> None:
    car = patient_car
    with contextlib.ExitStack() as flood, connect(car) as line:
        drive_on(car, line)
        notes = len(car.board.notes)
        for number in range(FLOOD):
            each = flood.enter_context(
                socket.create_connection(("127.0.0.1", (car.port, car.telemetry_port)[number % 2]))
            )
            with contextlib.suppress(OSError):
                # One byte of four, and never the rest.
                each.send(b"\x10")
            line.sendall(MOVE)
        wait_until(lambda: car.control.telemetry().turned_away > 0.9 * FLOOD)
        assert len(car.server.commands) <= DRIVE_PLACES.most_of_one_address
        assert len(car.server.channels) <= DRIVE_PLACES.most_of_one_address
        with connect(car) as other, telemetry(car) as frames:
            other.sendall(STILL)
            assert frames.next()["state"] == "moving"
            wait_until(lambda: len([each for each in car.server.commands if each.has_session()]) == 2)
        assert {setpoint for _, setpoint in car.board.notes[notes:]} == {(40, 1, 150)}


def test_a_newcomer_stops_the_car_while_many_others_ask(patient_car: DrivenCar) -> None:
    car = patient_car
    asking = pack_frame({"do": "request"})
    with connect(car) as line, contextlib.ExitStack() as held:
        drive_on(car, line)
        for number in range(1000 if SOAK else 100):
            each = socket.create_connection(("127.0.0.1", car.telemetry_port), DEADLINE_S)
            with contextlib.suppress(OSError):
                each.sendall(asking)
            # Not all stay open: the test's process may have 1,024 files.
            if number % 5:
                each.close()
            else:
                held.enter_context(each)
        with telemetry(car) as frames:
            assert frames.ask(do="stop")["ok"]
        assert car.control.telemetry().state == "stopped"
        assert car.board.setpoint == NEUTRAL


def test_the_sender_of_a_wrong_command_gets_the_reason(car: DrivenCar) -> None:
    with connect(car) as line, telemetry(car) as frames:
        assert frames.ask(do="join", port=line.getsockname()[1])["ok"]
        line.sendall(struct.pack(">I", 1 << 28 | 181 << 20))
        received = (frames.next() for _ in range(100))
        you = next(frame["you"] for frame in received if frame["you"]["refused"])
        assert you["last_refusal"] == "angle is 181; allowed: 0 to 180"


def test_an_emergency_stop_of_a_watcher_stops_a_driver_who_goes_on(patient_car: DrivenCar) -> None:
    car = patient_car
    # A second connection, or the watcher would be taken for the driver's own channel.
    with connect(car) as line, connect(car), telemetry(car) as frames:
        drive_on(car, line)
        with steady(line):
            assert frames.ask(do="stop")["ok"]
            assert not car.board.moves
            halted = next(iter(car.server.commands)).session.counts
            wait_until(lambda: halted["stopped"] > 2)
            assert not car.board.moves


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    now = datetime.now(UTC)
    make_keys(folder / "ours", [CarKeys("ada", ("127.0.0.1",))], ["grace"], now)
    make_keys(folder / "theirs", [CarKeys("ada", ("127.0.0.1",))], ["mallory"], now)
    return folder


@mock_clock
async def test_a_handshake_that_never_ends_is_hung_up_after_two_seconds(keys) -> None:
    async with loop_car(server_context(keys / "ours" / "car-ada.pem")) as car:
        begin_s = asyncio.get_running_loop().time()
        reader, writer = await asyncio.open_connection("127.0.0.1", car.port)
        writer.write(b"\x16\x03\x01")
        assert await reader.read(1) == b""
        assert asyncio.get_running_loop().time() - begin_s == pytest.approx(2.0, abs=0.1)
        await until(lambda: car.control.telemetry().turned_away == 1)
        writer.close()
