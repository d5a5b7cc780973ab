"""Strangers at a car that wants keys, while its driver drives: wrong certificates, garbage, unfinished handshakes."""

import asyncio
import random
import socket
import ssl
import struct
import threading
from contextlib import ExitStack, contextmanager, suppress
from itertools import product

import pytest

from motorcade.drive.blocking_client import BlockingDriveClient
from motorcade.drive.keys import client_context, server_context
from motorcade.words.formats import DRIVE
from support.driven_car import PATIENT, DrivenCar
from support.waiting import DEADLINE_S, wait_until

MOVE = struct.pack(">I", DRIVE.encode(angle=41, direction=1, speed=99))
HALF = (90, 1, 128)
TRIES = 10
GARBAGE_BYTES = 10_000_000


@pytest.fixture(scope="module")
def driven(keys):
    """A car that wants keys, and its driver, who goes straight ahead all the time."""
    with (
        DrivenCar(server_context(keys / "car-ada.pem"), profile=PATIENT) as car,
        BlockingDriveClient(
            "127.0.0.1", car.port, telemetry_port=car.telemetry_port, keys=keys / "driver-lin.pem", fresh_s=1
        ) as driver,
        going(driver),
    ):
        wait_until(lambda: car.board.setpoint == HALF and driver.you.get("drives"))
        yield car, driver


@contextmanager
def going(driver):
    ended = threading.Event()

    def go():
        while not ended.wait(0.1):
            driver.drive(0.5)

    thread = threading.Thread(target=go)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join(DEADLINE_S)


@pytest.fixture(autouse=True)
def undisturbed(driven):
    """Whatever a test does: the same driver drives on as before."""
    car, driver = driven
    begin, name = len(car.board.notes), driver.you["name"]
    yield
    wait_until(lambda: len(car.board.notes) > begin + 3)
    told = car.control.telemetry()
    assert (told.driver, told.failsafes, driver.you["name"]) == (name, 0, name)
    # A busy machine may let a wish lapse, which is neutral; nobody else's command is among them.
    assert {setpoint[2] for _, setpoint in car.board.notes[begin:]} <= {0, 128}


def trusting(keys=None, highest=ssl.TLSVersion.TLSv1_3):
    """One who takes any car for the right one."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    context.maximum_version = highest
    if keys:
        context.load_cert_chain(keys)
    return context


def test_a_client_with_the_wrong_certificate_sends_nothing_to_the_wheels(driven, keys):
    car, _ = driven
    strangers = [
        trusting(keys / "others" / "driver-mallory.pem"),
        trusting(keys / "car-ada.pem"),
        trusting(),
        trusting(keys / "driver-lin.pem", ssl.TLSVersion.TLSv1_2),
    ]
    turned_away = car.control.telemetry().turned_away
    for context, port in product(strangers, (car.port, car.telemetry_port) * TRIES):
        with suppress(OSError), context.wrap_socket(socket.create_connection(("127.0.0.1", port), DEADLINE_S)) as line:
            line.sendall(MOVE)
            assert not line.recv(1), "it was let in"
    wait_until(lambda: car.control.telemetry().turned_away >= turned_away + len(strangers) * 2 * TRIES)


def test_ten_million_bytes_that_are_no_tls_are_hung_up(driven):
    car, _ = driven
    dice, left = random.Random(3), GARBAGE_BYTES
    while left > 0:
        with suppress(OSError), socket.create_connection(("127.0.0.1", car.port), DEADLINE_S) as line:
            while left > 0:
                left -= line.send(dice.randbytes(1 << 16))


def test_unfinished_handshakes_make_room_for_others(driven, keys):
    car, _ = driven

    async def dawdle():
        lines = []
        for number in range(100):
            _, writer = await asyncio.open_connection("127.0.0.1", (car.port, car.telemetry_port)[number % 2])
            lines.append(writer)
            # The beginning of a handshake, and never all.
            writer.write(b"\x16\x03\x01")
        async with asyncio.timeout(DEADLINE_S):
            reader, writer = await asyncio.open_connection(
                "127.0.0.1", car.telemetry_port, ssl=client_context(keys / "driver-lin.pem"), server_hostname="ada"
            )
            assert await reader.readexactly(4)
        for each in (*lines, writer):
            each.transport.abort()

    asyncio.run(dawdle())


def test_a_newcomer_who_listens_first_keeps_the_place_while_others_of_the_address_begin_handshakes(driven, keys):
    """Clients of Motorcade say nothing until they know that the car takes keys."""
    car, _ = driven
    tls = client_context(keys / "driver-lin.pem")
    hello = ssl.MemoryBIO()
    with suppress(ssl.SSLWantReadError):
        tls.wrap_bio(ssl.MemoryBIO(), hello, server_hostname="ada").do_handshake()
    said, address = hello.read(), ("127.0.0.1", car.telemetry_port)
    with ExitStack() as lines:
        plain = lines.enter_context(socket.create_connection(address, DEADLINE_S))
        others = [lines.enter_context(socket.create_connection(address, DEADLINE_S)) for _ in range(80)]
        for send in (lambda line: line.sendall(said), lambda line: line.recv(1)):
            # Each is answered, or has to give up its place.
            for line in others:
                with suppress(OSError):
                    send(line)
        with tls.wrap_socket(plain, server_hostname="ada") as secured:
            assert len(secured.recv(4)) == 4
