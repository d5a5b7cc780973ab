"""An ESP32's line by Wi-Fi, with real sockets and real TLS of this computer; the cable goes on beside it."""

import asyncio
import json
import os
import select
import shutil
import socket
import subprocess
import sys
import threading
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from unittest.mock import Mock

import pytest
from scripts.studio_process import free_port
from wifi_car import ChipBoard, ChipCable, ChipClock, ChipStation

from motorcade.boards.on_chip.secure_line import serial_number
from motorcade.boards.on_chip.wifi_line import Announcer, WifiLine, join_network
from motorcade.car.loop import Car
from motorcade.config.profile import levels_of
from motorcade.drive.certificates import CarKeys, make_keys, revoke_drivers
from motorcade.drive.keys import REVOKED, chip_keys, client_context, read_revoked
from motorcade.firmware.car_files import board_files
from motorcade.fleet.cars import Cars, Finder
from motorcade.fleet.places import network_place
from motorcade.words.request import STOP
from support.rooms import FIRST, SECOND
from support.strategies import CLASSROOM
from support.waiting import until, wait_until

pytestmark = pytest.mark.skipif(not hasattr(select, "poll"), reason="Windows has no poll")


@contextmanager
def running():
    cable, port = ChipCable(), free_port()
    announcer = Announcer(ChipStation(("127.0.0.1", "255.0.0.0", "", "")), socket, ChipClock(), "0000002a", port)
    line = WifiLine(cable, socket, select, ChipClock(), announcer, port)
    board, ended = ChipBoard(line, levels_of(CLASSROOM)), threading.Event()
    car = Car(board)

    def run():
        while not ended.wait(0.001):
            car.tick()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield board, cable, port
    finally:
        ended.set()
        thread.join()
        line.close()


def test_a_chip_is_found_loaded_and_stopped_over_the_air_and_by_its_cable():
    async def load(port):
        async with Cars([network_place("127.0.0.1", port)]) as cars:
            await cars.known(30)
            assert cars.statuses()[0].name == "ada"
            assert [each.error for each in await cars.load(SECOND, ["ada"])] == [None]
            cars.order(STOP)
            assert await cars.confirmed(30) == []

    with running() as (board, cable, port):
        # An upload that breaks off leaves nothing to the next.
        with socket.create_connection(("127.0.0.1", port)) as broken:
            broken.sendall(SECOND[:6])
        asyncio.run(load(port))
        assert board.image == SECOND
        cable.came = b"\0\0\0\xff"
        wait_until(lambda: cable.answered == SECOND)


def test_a_chip_that_announces_itself_is_found_by_multicast_dns():
    async def find(port):
        async with Cars() as cars, Finder(cars).looking(["127.0.0.1"]):
            await until(lambda: [each for each in cars.statuses() if not each.away])
            return [(each.name, each.where) for each in cars.statuses()]

    with running() as (_, _, port):
        assert asyncio.run(find(port)) == [("ada", f"127.0.0.1:{port}")]


def has_left(connection):
    with suppress(BlockingIOError):
        return connection.recv(1, socket.MSG_DONTWAIT) == b""


def test_more_clients_than_the_chip_has_room_for_get_their_turn():
    with running() as (_, _, port):
        idle = [socket.create_connection(("127.0.0.1", port)) for _ in range(8)]
        try:

            async def ask():
                async with Cars([network_place("127.0.0.1", port)]) as cars:
                    await cars.known(30)
                    assert not cars.statuses()[0].away
                    # Those that were silent for the longest time gave way, down to four with this one.
                    await until(lambda: sum(map(bool, map(has_left, idle))) == len(idle) + 1 - WifiLine.most_clients)

            asyncio.run(ask())
        finally:
            for each in idle:
                each.close()


def test_the_chip_joins_its_network_by_a_name_of_its_own():
    network = Mock()
    station = join_network(network, {"ssid": "Klasse", "password": "geheim"}, "00000af7")
    network.hostname.assert_called_once_with("motorcade-00000af7")
    station.active.assert_called_once_with(True)
    station.connect.assert_called_once_with("Klasse", "geheim")


PORTABLE = Path(__file__).parents[2] / "portable"
# 200 states of a leader.
LARGE = bytes.fromhex("C8000000" + "64800000" * 200)


@pytest.fixture(params=["cpython", "micropython"])
def command(request, tmp_path):
    """How to run the car: the interpreter, and its environment."""
    if request.param == "cpython":
        # What it prints comes at once.
        return [sys.executable, "-u"], dict(os.environ)
    # Debian has no package of it: `make -C ports/unix` of its sources builds it, with mbedtls.
    if not (found := shutil.which("micropython")):
        pytest.skip("no micropython: MicroPython's Unix build, with mbedtls, in PATH")
    for path, data in board_files({}).items():
        (tmp_path / "board" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "board" / path).write_bytes(data)
    return [found], os.environ | {"MICROPYPATH": f"{tmp_path}/board/lib:{PORTABLE}:.frozen"}


@contextmanager
def secured(command, keys):
    """Run a car with ``keys`` (`chip_keys`); yields its port and a function that ends it and returns its output."""
    port = free_port()
    program, environment = command
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "encoding": "utf-8"}
    with subprocess.Popen([*program, PORTABLE / "wifi_car.py"], env=environment, **pipes) as process:
        try:
            process.stdin.write(json.dumps([port, keys, levels_of(CLASSROOM)]) + "\n")
            process.stdin.flush()
            assert process.stdout.readline().startswith("ready")
            yield port, lambda: process.communicate()[0]
        finally:
            process.stdin.close()


async def reach(port, tls, image):
    """Load a car; return what is known of it."""
    async with Cars([network_place("localhost", port, "ada")], tls) as cars:
        await cars.known(30)
        (status,) = cars.statuses()
        if not status.away:
            assert [each.error for each in await cars.load(image, ["ada"])] == [None]
            await until(lambda: cars.statuses()[0].crc32 != status.crc32)
            cars.order(STOP)
            assert await cars.confirmed(30) == []
        return cars.statuses()[0]


def test_a_chip_takes_uploads_of_drivers_of_its_authority_and_of_nobody_else(command, tmp_path):
    """Strangers, those without keys and a driver whose keys were revoked change nothing, and don't hold others up."""
    now = datetime.now(UTC)
    make_keys(tmp_path / "room", [CarKeys("ada")], ["lin", "eve"], now)
    make_keys(tmp_path / "other", [], ["lin"], now)
    lin, stranger = [client_context(tmp_path / each / "driver-lin.pem", True) for each in ("room", "other")]
    eve = client_context(tmp_path / "room" / "driver-eve.pem", True)
    revoke_drivers(tmp_path / "room", ["eve"])
    keys = chip_keys(tmp_path / "room" / "car-ada.pem", read_revoked(tmp_path / "room" / REVOKED))
    with secured(command, keys) as (port, end):
        for tls in (None, stranger, eve):
            assert asyncio.run(reach(port, tls, FIRST)).away
        # A record of TLS holds more than the car takes at a time.
        status = asyncio.run(reach(port, lin, LARGE))
        assert (status.name, status.board, status.state) == ("ada", "esp32", "stopped")
        stops = [line.split() for line in end().splitlines()]
    # It drives, but stood at each piece of a handshake.
    assert {stop[2] for stop in stops} == {"0"}
    assert max(stop[3] for stop in stops) > "0"


def test_the_serial_number_is_read_from_any_certificate():
    # A version or none, lengths in one byte or in several, a sign byte.
    for certificate, number in (("300830060201 7f", 0x7F), ("3082000a 308106 0202 00ff", 0xFF)):
        assert serial_number(bytes.fromhex(certificate)) == number
    assert serial_number(bytes.fromhex("300d300b a003020102 0201 05 0000")) == 5
