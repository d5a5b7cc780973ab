"""The list of cars on a page, with simulated cars at real ports."""

import asyncio
import base64
import json
import ssl
from unittest.mock import AsyncMock

import pytest
from starlette.websockets import WebSocket

from motorcade.fleet.cars import Cars
from motorcade.fleet.places import place_of
from motorcade.server.studio import cars
from motorcade.server.studio.sessions import CARS, Settings
from motorcade.upload import serial_port
from support.remote_page import PageSocket
from support.rooms import FIRST, SECOND, SECOND_CRC32, in_loop, simulated_cars
from support.waiting import DEADLINE_S, until, wait_until
from support.world_page import server


@pytest.fixture(autouse=True)
def no_ports(monkeypatch):
    """This computer's own ports are left alone."""
    monkeypatch.setattr(serial_port.list_ports, "comports", list)


class CarListPage(PageSocket):
    """A page that shows the list: ``found`` has the cars by their names."""

    found = None

    def shows(self, condition):
        """Wait until ``condition`` is true of the cars; a list comes only when it has changed."""
        while not (self.found and condition(self.found)):
            self.found = {car["name"]: car for car in self.until("cars")["cars"]}


def test_a_page_sees_loads_blinks_and_stops_cars(tmp_path):
    with simulated_cars(2) as cars:
        places = (*(place_of(car.address) for car in cars), place_of("127.0.0.1:1", "gone"))
        image = base64.b64encode(SECOND).decode()
        with (
            server(tmp_path, places=places) as client,
            client.websocket_connect(f"ws://127.0.0.1:7700{CARS}") as socket,
        ):
            page = CarListPage(socket)
            page.shows(lambda found: found.get("car-1", {}).get("away") is False and found["gone"]["problem"])
            page.send("load", where=[cars[1].address, "127.0.0.1:1"], image=image, program="阿<b>\n")
            page.shows(lambda found: found["car-1"]["crc32"] == SECOND_CRC32 and found["gone"]["holds"])
            assert [page.found[name]["holds"] for name in ("car-1", "car-0", "gone")] == ["new", "", "away"]
            assert [page.found[name]["program"] for name in ("car-1", "car-0")] == ["阿<b>", ""]
            assert set(page.found["gone"]["error"]) == {"en", "zh"}
            page.send("stop")
            page.shows(lambda found: [found[name]["state"] for name in ("car-0", "car-1")] == ["stopped"] * 2)
            assert [car.wheels for car in cars] == [(0, 0)] * 2
            page.send("blink", where=["nobody"])
            assert page.until("error")["code"] == "no-such-car"
            page.send("load", where=[cars[0].address], image=base64.b64encode(SECOND[:6]).decode())
            assert page.until("error")["code"] == "image-cut-off"
            assert [car.image for car in cars] == [FIRST, SECOND]


def test_cars_are_asked_at_the_places_and_with_the_keys_of_the_settings(tmp_path, monkeypatch):
    asked = []

    class NotedCars(Cars):
        def __init__(self, *given):
            asked.append(given)
            super().__init__(*given)

    monkeypatch.setattr(cars, "Cars", NotedCars)
    places, keys = (place_of("127.0.0.1:1", "gone"),), ssl.create_default_context()
    with (
        server(tmp_path, places=places, keys=keys) as client,
        client.websocket_connect(f"ws://127.0.0.1:7700{CARS}") as socket,
    ):
        CarListPage(socket).shows(lambda found: "gone" in found)
    assert asked[-1] == (places, keys)


def test_cars_are_looked_for_while_any_page_shows_them(tmp_path, monkeypatch):
    looking = []

    class NotedCars(Cars):
        async def __aenter__(self):
            looking.append("begins")
            return await super().__aenter__()

        async def __aexit__(self, *given):
            looking.append("ends")
            await super().__aexit__(*given)

    monkeypatch.setattr(cars, "Cars", NotedCars)
    with server(tmp_path, places=(place_of("127.0.0.1:1", "gone"),)) as client:
        with client.websocket_connect(f"ws://127.0.0.1:7700{CARS}") as socket:
            CarListPage(socket).shows(lambda found: "gone" in found)
            with client.websocket_connect(f"ws://127.0.0.1:7700{CARS}") as another:
                CarListPage(another).shows(lambda found: "gone" in found)
            assert looking == ["begins"]
        wait_until(lambda: looking == ["begins", "ends"], deadline_s=DEADLINE_S)


@in_loop
async def test_a_page_that_is_loaded_anew_stops_the_cars_while_an_upload_of_before_lasts(tmp_path, monkeypatch):
    ended = asyncio.Event()

    class SlowCars(Cars):
        async def load(self, *given):
            await ended.wait()
            return []

    def open_page(order):
        """A page of the list, which sends an order; its task ends when the page has left."""
        waiting = asyncio.Queue()
        waiting.put_nowait({"type": "websocket.connect"})
        waiting.put_nowait({"type": "websocket.receive", "text": order})
        socket = WebSocket({"type": "websocket"}, waiting.get, AsyncMock())
        return waiting, asyncio.create_task(listed.serve(socket))

    monkeypatch.setattr(cars, "Cars", SlowCars)
    with simulated_cars(1) as (car,):
        listed = cars.CarList(Settings(library=tmp_path, page=tmp_path, places=(place_of(car.address),)))
        image = base64.b64encode(SECOND).decode()
        waiting, first = open_page(json.dumps({"do": "load", "where": [car.address], "image": image, "program": ""}))
        await until(lambda: listed._loads)
        waiting.put_nowait({"type": "websocket.disconnect"})
        await until(lambda: not listed._pages)
        waiting, second = open_page(json.dumps({"do": "stop"}))
        await until(lambda: [row.state for row in listed._shown().cars] == ["stopped"])
        ended.set()
        waiting.put_nowait({"type": "websocket.disconnect"})
        await asyncio.gather(first, second)
        assert not listed._pages
