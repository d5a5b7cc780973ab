"""Who gets a place at a server: pupils' connections take none of the teacher's, however many there are."""

import asyncio
import socket
import tomllib
from contextlib import ExitStack, suppress
from importlib.metadata import version
from pathlib import Path

import httpx2 as httpx
import pytest
from packaging.requirements import Requirement
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import Route, WebSocketRoute
from starlette.testclient import TestClient
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from motorcade.drive.listener import Places
from motorcade.server import running
from motorcade.server.request_filter import MOST_SOCKETS, RequestFilter, ServerSettings
from motorcade.sockets import network_of
from support.mock_clock import mock_clock
from support.served_app import served
from support.waiting import DEADLINE_S

PROJECT = Path(__file__).parents[2] / "pyproject.toml"


async def echo(page):
    await page.accept()
    with suppress(Exception):
        while True:
            await page.send_text(await page.receive_text())


def holder(connection):
    who = connection.query_params.get("who", "")
    return who, who == "teacher"


def server():
    """A server that knows who asks by the address; its own address."""
    app = RequestFilter(Starlette(routes=[WebSocketRoute("/", echo)]), ServerSettings(), None, holder)
    return served(lambda: app)


def opened(pages, address, who):
    return pages.enter_context(connect(f"ws://{address[0]}:{address[1]}/?who={who}", proxy=None))


def answers(page):
    try:
        page.send("a")
        return page.recv(DEADLINE_S) == "a"
    except (ConnectionClosed, ConnectionError):
        return False


def test_of_a_pupils_sockets_the_newest_are_kept_and_others_notice_nothing():
    with server() as address, ExitStack() as pages:
        mia, teacher = opened(pages, address, "mia"), [opened(pages, address, "teacher") for _ in range(12)]
        hers = [opened(pages, address, "eve") for _ in range(MOST_SOCKETS + 4)]
        assert [answers(page) for page in hers] == [False] * 4 + [True] * MOST_SOCKETS
        assert answers(mia)
        assert all(map(answers, teacher))


def test_where_pupils_have_taken_all_places_the_teacher_gets_one_and_keeps_it(monkeypatch):
    monkeypatch.setattr(running, "_PLACES", Places(12, 4, burst=2, shares=True))
    with server() as address, ExitStack() as pages:
        for who in ("eve", "ben", "mia"):
            for _ in range(4):
                assert answers(opened(pages, address, who))
        teacher = opened(pages, address, "teacher")
        assert answers(teacher)
        for _ in range(20):
            pages.enter_context(socket.create_connection(address, DEADLINE_S))
            with suppress(Exception):
                opened(pages, address, "eve")
        assert answers(teacher)


def test_none_of_the_teachers_connections_gives_way_to_a_pupil(monkeypatch):
    monkeypatch.setattr(running, "_PLACES", Places(12, 4, burst=2, shares=True))
    with server() as address, ExitStack() as pages:
        teacher = [opened(pages, address, "teacher") for _ in range(8)]
        assert all(map(answers, teacher))
        for who in ("eve", "ben", "mia"):
            for _ in range(2):
                assert answers(opened(pages, address, who))
        assert all(map(answers, teacher))


def test_a_header_of_a_proxy_gives_nobody_another_address():
    """Else a flood would come from as many addresses as it names."""

    async def client_host(request):
        return PlainTextResponse(request.client.host)

    app = RequestFilter(Starlette(routes=[Route("/", client_host)]), ServerSettings(), None, holder)
    with served(lambda: app) as (host, port):
        forged = {"X-Forwarded-For": "192.0.2.7", "Forwarded": "for=192.0.2.7", "X-Real-IP": "192.0.2.7"}
        assert httpx.get(f"http://{host}:{port}/", headers=forged, trust_env=False).text == "127.0.0.1"


def test_pupils_behind_one_router_have_a_rate_of_requests_each():
    app = RequestFilter(Starlette(), ServerSettings(requests_a_second=1, clock=lambda: 0.0), None, holder)
    client = TestClient(app, base_url="http://127.0.0.1:7700")
    assert [client.get(f"/?who={who}").status_code for who in ("eve", "eve", "eve", "mia")] == [404, 404, 429, 404]


@pytest.mark.parametrize(
    ("one", "other", "alike"),
    [
        ("10.0.0.1", "10.0.0.2", False),
        ("2001:db8::1", "2001:db8::ffff:1", True),
        ("2001:db8::1", "2001:db8:0:1::1", False),
        ("::ffff:10.0.0.1", "10.0.0.1", True),
        ("fe80::1%eth0", "fe80::2", True),
    ],
)
def test_an_ipv6_network_counts_as_one_address(one, other, alike):
    assert (network_of(one) == network_of(other)) is alike


@pytest.mark.parametrize("name", ["uvicorn", "websockets"])
def test_the_libraries_below_are_of_versions_that_were_tried(name):
    groups = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]["optional-dependencies"].values()
    allowed = {each for group in groups for each in map(Requirement, group) if each.name == name}
    assert allowed
    for each in allowed:
        assert version(name) in each.specifier
        assert {part.operator for part in each.specifier} == {">=", "<"}


class PlaceLine(asyncio.Transport):
    """A connection whose other end takes so many bytes a second of what is written."""

    def __init__(self, bytes_a_second):
        super().__init__({"socket": socket.socket()})
        self._rate, self._loop = bytes_a_second, asyncio.get_running_loop()
        self._begun_s, self._written, self.is_cut = self._loop.time(), 0, False

    def set_write_buffer_limits(self, high=None, low=None):
        pass

    def write(self, data):
        self._written += len(data)

    def get_write_buffer_size(self):
        return max(0, self._written - int((self._loop.time() - self._begun_s) * self._rate))

    def abort(self):
        self.is_cut = True


@mock_clock
async def test_a_reader_who_goes_on_is_not_cut_and_one_who_does_not_is():
    cut = []
    for rate in (100, 0):
        line = PlaceLine(rate)
        connection = running.PageConnection(lambda state: asyncio.Protocol(), lambda: None)
        connection.connection_made(line)

        async def write(data, connection=connection):
            connection.write(data)

        async def export(scope, receive, send):
            await send(bytes(100_000))
            await asyncio.sleep(900)

        await connection.serve(export, {"type": "http"}, None, write)
        cut.append(line.is_cut)
        connection.connection_lost(None)
        line.get_extra_info("socket").close()
    assert cut == [False, True]
