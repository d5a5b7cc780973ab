"""An ESP32's car with keys by Wi-Fi: real sockets and real TLS, under CPython and, where it is, MicroPython."""

import asyncio
import json
import os
import select
import shutil
import socket
import subprocess
import sys
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest

from motorcade.boards.on_chip.secure_line import serial_number
from motorcade.config.profile import levels_of
from motorcade.drive.certificates import CarKeys, make_keys, revoke_drivers
from motorcade.drive.keys import REVOKED, chip_keys, client_context, read_revoked
from motorcade.firmware.car_files import board_files
from motorcade.fleet.cars import Cars
from motorcade.fleet.places import network_place
from motorcade.words.request import STOP
from support.rooms import FIRST, SECOND
from support.strategies import CLASSROOM
from support.waiting import until

PORTABLE = Path(__file__).parents[2] / "portable"
pytestmark = pytest.mark.skipif(not hasattr(select, "poll"), reason="Windows has no poll")


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
def running(command, keys):
    """Run a car with ``keys`` (`chip_keys`); yields its port and a function that ends it and returns its output."""
    with socket.create_server(("127.0.0.1", 0)) as reserved:
        port = reserved.getsockname()[1]
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
    with running(command, keys) as (port, end):
        for tls in (None, stranger, eve):
            assert asyncio.run(reach(port, tls, FIRST)).away
        status = asyncio.run(reach(port, lin, SECOND))
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
