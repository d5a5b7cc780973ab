"""A car that is served: whatever happens to its clients or its own loop, the wheels stop in time."""

import asyncio
import contextlib
import json
import socket
import struct
import threading
from collections.abc import AsyncIterator
from dataclasses import replace
from types import SimpleNamespace

import pytest

from motorcade.drive.keys import server_context
from motorcade.drive.listener import DRIVE_PLACES
from motorcade.drive.server import Watchdog
from motorcade.drive.session import CarControl
from motorcade.drive.wire import pack_frame
from motorcade.words.formats import DRIVE
from support.driven_car import PATIENT, DrivenCar
from support.loop_car import LoopCar, loop_car
from support.mock_board import CLASSROOM, NEUTRAL, MockDriveBoard
from support.mock_clock import mock_clock, pass_time
from support.soak import SOAK
from support.waiting import DEADLINE_S, until, wait_until

MOVE = struct.pack(">I", DRIVE.encode(angle=40, direction=1, speed=150))
STILL = struct.pack(">I", DRIVE.encode(angle=40, direction=1, speed=0))
PERIOD_S = 0.04
FLOOD = 300


def connect(car: DrivenCar) -> socket.socket:
    return socket.create_connection(("127.0.0.1", car.port), DEADLINE_S)


def answer(car: DrivenCar, **request) -> dict:
    """What the car answers to a newcomer's request."""
    address = "127.0.0.1", car.telemetry_port
    with socket.create_connection(address, DEADLINE_S) as line, line.makefile("rb") as frames:
        line.sendall(pack_frame(request))
        while True:
            (size,) = struct.unpack(">I", frames.read(4))
            if (frame := json.loads(frames.read(size)))["kind"] == "answer":
                return frame


def drive_on(car: DrivenCar, line: socket.socket) -> None:
    """Drive until the wheels turn."""
    wait_until(lambda: line.sendall(MOVE) or car.board.moves)


@contextlib.asynccontextmanager
async def driver_of(car: LoopCar) -> AsyncIterator[asyncio.StreamWriter]:
    """A client of the bare four bytes, in the car's own loop, whose command turns the wheels."""
    _, writer = await asyncio.open_connection("127.0.0.1", car.port)
    for word in (STILL, MOVE):
        writer.write(word)
        await pass_time(PERIOD_S)
    await until(lambda: car.board.moves)
    try:
        yield writer
    finally:
        writer.transport.abort()


def reset(writer: asyncio.StreamWriter) -> None:
    line = writer.get_extra_info("socket")
    line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    writer.transport.abort()


@pytest.mark.parametrize("end", [asyncio.StreamWriter.close, reset, asyncio.StreamWriter.write_eof])
@mock_clock
async def test_a_client_that_is_gone_stops_the_wheels_at_once(end) -> None:
    async with loop_car() as car, driver_of(car) as driver:
        gone_s = asyncio.get_running_loop().time()
        end(driver)
        await until(lambda: car.board.setpoint == NEUTRAL)
        assert car.board.notes[-1][0] - gone_s < 0.05


def test_who_has_hung_up_before_the_car_accepts_leaves_no_traceback(caplog) -> None:
    with DrivenCar(profile=PATIENT) as car:
        with car.stuck():
            for port in (car.port, car.telemetry_port):
                with socket.create_connection(("127.0.0.1", port)) as line:
                    line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        with connect(car) as line:
            drive_on(car, line)
    assert caplog.records == []


def test_a_server_that_is_stuck_stops_the_wheels_and_drops_what_came_meanwhile() -> None:
    # No failsafe helps here.
    watched = replace(PATIENT, drive=replace(PATIENT.drive, watchdog_ms=200))
    with DrivenCar(profile=watched) as car, connect(car) as line:
        drive_on(car, line)
        stalls, counts = car.control.telemetry().stalls, car.server.commands[0].session.counts
        with car.stuck():
            wait_until(lambda: line.sendall(MOVE) or car.board.setpoint == NEUTRAL)
            notes, refused = len(car.board.notes), counts["needs-neutral"]
        wait_until(lambda: line.sendall(MOVE) or counts["needs-neutral"] > refused + 2)
        assert len(car.board.notes) == notes
        assert car.control.telemetry().stalls > stalls


def test_the_board_is_closed_when_nobody_watches_over_it_any_more() -> None:
    """Else the hardware would be written to that another program may have by then."""
    control = CarControl(MockDriveBoard(lambda: 0.0), lambda: 0, CLASSROOM)
    done: list[str] = []
    watches, is_closed = threading.Event(), threading.Event()

    def watch() -> int:
        watches.set()
        # The car ends while this is under way; it would not wait for ever.
        is_closed.wait(0.05)
        done.append("watched")
        return 0

    def close() -> None:
        done.append("closed")
        is_closed.set()

    control.watch, control.close = watch, close
    with Watchdog(control, SimpleNamespace(call_soon_threadsafe=lambda call: None)):
        assert watches.wait(DEADLINE_S)
    for thread in threading.enumerate():
        if thread.name == "drive watchdog":
            thread.join(DEADLINE_S)
    assert done[-1] == "closed"


def test_the_wheels_stand_still_before_the_first_command_and_after_the_last() -> None:
    with contextlib.ExitStack() as held:
        with DrivenCar(profile=PATIENT) as car:
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


@mock_clock
async def test_clients_that_have_left_take_no_slot() -> None:
    async with loop_car() as car:
        for _ in range(2 * DRIVE_PLACES.most_of_one_address):
            async with driver_of(car):
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
        with connect(car) as other:
            other.sendall(STILL)
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
        assert answer(car, do="stop")["ok"]
        assert car.control.telemetry().state == "stopped"
        assert car.board.setpoint == NEUTRAL


@mock_clock
async def test_a_handshake_that_never_ends_is_hung_up_after_two_seconds(keys) -> None:
    async with loop_car(server_context(keys / "car-ada.pem")) as car:
        begin_s = asyncio.get_running_loop().time()
        reader, writer = await asyncio.open_connection("127.0.0.1", car.port)
        writer.write(b"\x16\x03\x01")
        assert await reader.read(1) == b""
        assert asyncio.get_running_loop().time() - begin_s == pytest.approx(2.0, abs=0.1)
        await until(lambda: car.control.telemetry().turned_away == 1)
        writer.close()
