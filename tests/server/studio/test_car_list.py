"""The list of cars on a page, with simulated cars at real ports."""

import base64

import pytest
from starlette.testclient import TestClient

from motorcade.fleet.places import place_of
from motorcade.server.studio.app import CARS, Settings, make_app
from motorcade.upload import serial_port
from support.rooms import FIRST, SECOND, SECOND_CRC32, simulated_cars

HERE = "http://127.0.0.1:7700"


@pytest.fixture(autouse=True)
def no_ports(monkeypatch):
    """This computer's own ports are left alone."""
    monkeypatch.setattr(serial_port.list_ports, "comports", list)


class Page:
    """A page that shows the list: ``found`` has the cars by their names."""

    def __init__(self, socket):
        self.socket = socket
        self.found = {}

    def until(self, condition):
        """Wait until ``condition`` is true of the cars; a list comes only when it has changed."""
        while not (self.found and condition(self.found)):
            self.next()

    def next(self):
        answer = self.socket.receive_json()
        if answer["is"] == "cars":
            self.found = {car["name"]: car for car in answer["cars"]}
        return answer

    def refusal(self):
        while (answer := self.next())["is"] != "error":
            pass
        return answer["code"]


def test_a_page_sees_loads_blinks_and_stops_cars(tmp_path):
    with simulated_cars(2) as cars:
        places = (*(place_of(car.address) for car in cars), place_of("127.0.0.1:1", "gone"))
        settings = Settings(library=tmp_path, page=tmp_path, places=places)
        image = base64.b64encode(SECOND).decode()
        with (
            TestClient(make_app(settings), base_url=HERE) as client,
            client.websocket_connect(f"{HERE.replace('http', 'ws')}{CARS}") as socket,
        ):
            page = Page(socket)
            page.until(lambda found: found.get("car-1", {}).get("away") is False and found["gone"]["problem"])
            socket.send_json(
                {"do": "load", "where": [cars[1].address, "127.0.0.1:1"], "image": image, "program": "阿<b>\n"}
            )
            page.until(lambda found: found["car-1"]["crc32"] == SECOND_CRC32 and found["gone"]["holds"])
            assert [page.found[name]["holds"] for name in ("car-1", "car-0", "gone")] == ["new", "", "away"]
            assert [page.found[name]["program"] for name in ("car-1", "car-0")] == ["阿<b>", ""]
            assert set(page.found["gone"]["error"]) == {"en", "zh"}
            socket.send_json({"do": "stop"})
            page.until(lambda found: [found[name]["state"] for name in ("car-0", "car-1")] == ["stopped"] * 2)
            assert [car.wheels for car in cars] == [(0, 0)] * 2
            socket.send_json({"do": "blink", "where": ["nobody"]})
            assert page.refusal() == "no-such-car"
            socket.send_json({"do": "load", "where": [cars[0].address], "image": base64.b64encode(SECOND[:6]).decode()})
            assert page.refusal() == "image-cut-off"
            assert [car.image for car in cars] == [FIRST, SECOND]
