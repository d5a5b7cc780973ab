"""The users of the remote's pages: their names, and what the log says of them."""

import json
from contextlib import ExitStack, contextmanager
from urllib.parse import urlencode

import pytest
from starlette.testclient import TestClient

from motorcade.config.profile import built_in_profile
from motorcade.drive.session import CarControl, ControlSession
from motorcade.server.fleet import SingleCar
from motorcade.server.remote import make_remote
from motorcade.server.request_filter import ServerSettings
from support.mock_board import MockDriveBoard
from support.remote_page import RemotePage

HERE = "127.0.0.1:7700"
LIN = "小林 O'Neil-2"


class Server:
    """A server of one car, and what it records; give it names of users to open their pages."""

    def __init__(self):
        self.told = []
        self.car = CarControl(MockDriveBoard(), lambda: 0, built_in_profile("classroom"))
        settings = ServerSettings(record=lambda *each: self.told.append(each))
        self.client = TestClient(make_remote(settings, SingleCar(self.car)), base_url=f"http://{HERE}")

    def connect(self, name):
        return self.client.websocket_connect(f"ws://{HERE}/drive/ws?{urlencode({'name': name})}")

    @contextmanager
    def page(self, name=""):
        with self.connect(name) as socket:
            page = RemotePage(socket)
            page.send("join", car="1")
            yield page


@pytest.fixture
def server():
    server = Server()
    with server.client:
        yield server


def test_what_the_user_of_a_page_does_is_recorded(server):
    with server.page() as page:
        page.drive("1", throttle=0.0)
        page.car("1", lambda car: car["you"]["drives"])
        page.send("stop", cars=["1"])
        page.car("1", lambda car: car["state"] == "stopped")
        page.send("clear", car="1")
        page.car("1", lambda car: car["state"] != "stopped")
    done = [(did, car) for did, _, car in server.told]
    assert done == [("drives", "1"), ("stops", "1"), ("clears", "1"), ("ends", "1")]
    assert {who for _, who, _ in server.told} == {"testclient:50000"}


def test_the_name_of_a_page_s_user_is_shown_to_others_and_recorded(server):
    with server.page(LIN) as page, server.page() as watcher:
        assert page.until("hello")["you"] == f"{LIN} · testclient:50000"
        page.drive("1", throttle=0.0)
        page.car("1", lambda car: car["you"]["drives"])
        assert watcher.car("1", lambda car: car["driver"])["driver"] == f"{LIN} · testclient:50000"
    assert ("drives", f"{LIN} · testclient:50000", "1") in server.told


@pytest.mark.parametrize(
    "name",
    ["<b>lin</b>", "a" * 25, "li\nn", "lin\u202emei", "lin · 10.0.0.1:5", "a:b", "x" * 5_000],
)
def test_a_name_with_markup_or_too_many_characters_is_refused_and_the_address_stays(server, name):
    with server.connect(name) as socket:
        messages = [json.loads(socket.receive_text()) for _ in range(2)]
    assert [each["is"] for each in messages] == ["hello", "error"]
    assert messages[0]["you"] == "testclient:50000"
    assert messages[1]["code"] == "bad-user-name"


def test_one_client_is_one_whatever_its_users_call_themselves(server):
    with ExitStack() as pages:
        for number in range(12):
            pages.enter_context(server.page(f"user {number}")).drive("1", throttle=0.0)
        # Somebody else finds a place, since the client that has the most gives one up.
        ControlSession(server.car, "mei", "192.168.1.9").take_place()
