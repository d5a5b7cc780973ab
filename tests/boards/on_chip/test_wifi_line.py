"""An ESP32's line by Wi-Fi, with real sockets of this computer; the cable goes on beside it."""

import asyncio
import select
import socket
import threading
from contextlib import contextmanager, suppress

import pytest
from wifi_car import ChipBoard, Clock

from motorcade.boards.on_chip.lines import UsbLine
from motorcade.boards.on_chip.wifi_line import Announcer, WifiLine, join_network
from motorcade.car.loop import Car
from motorcade.config.profile import levels_of
from motorcade.fleet.cars import Cars, Finder
from motorcade.fleet.places import network_place
from motorcade.words.request import STOP
from support.rooms import SECOND
from support.strategies import CLASSROOM
from support.waiting import until, wait_until

pytestmark = pytest.mark.skipif(not hasattr(select, "poll"), reason="Windows has no poll")


class Cable:
    """A cable that a test speaks through."""

    def __init__(self):
        self.came, self.answered = b"", b""

    def read(self):
        came, self.came = self.came, b""
        return came

    def write(self, data):
        self.answered += data

    def close(self):
        pass


class Station:
    """The chip's connection to its network, which is this computer's own here."""

    def isconnected(self):
        return True

    def ifconfig(self):
        return ("127.0.0.1", "255.0.0.0", "", "")


@contextmanager
def running():
    with socket.create_server(("127.0.0.1", 0)) as reserved:
        port = reserved.getsockname()[1]
    cable = Cable()
    announcer = Announcer(Station(), socket, Clock(), "0000002a", port)
    line = WifiLine(cable, socket, select, Clock(), announcer, port)
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
    called = []

    class Joining(Station):
        def active(self, on):
            called.append(on)

        def connect(self, ssid, password):
            called.append((ssid, password))

    class Network:
        STA_IF = 0

        def hostname(self, name):
            called.append(name)

        def WLAN(self, kind):  # noqa: N802 - MicroPython's name
            return Joining()

    join_network(Network(), {"ssid": "Klasse", "password": "geheim"}, "00000af7")
    assert called == ["motorcade-00000af7", True, ("Klasse", "geheim")]
    assert UsbLine.sender == 0
