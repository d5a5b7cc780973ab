"""The remote at a real socket: slow viewers, HTTPS, and a server beside other tasks."""

import http.client
import json
import re
import socket
import ssl
import threading
from contextlib import ExitStack, closing, suppress
from datetime import UTC, datetime

import psutil
import pytest
from websockets.client import ClientProtocol
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import Frame, Opcode
from websockets.protocol import State
from websockets.sync.client import connect
from websockets.uri import parse_uri

from motorcade.cameras.broadcast import Camera
from motorcade.config.profile import built_in_profile
from motorcade.drive.certificates import CarKeys, make_keys
from motorcade.drive.keys import https_context
from motorcade.drive.session import CarControl
from motorcade.server.fleet import SingleCar
from motorcade.server.remote import make_remote
from motorcade.server.request_filter import ServerSettings
from motorcade.server.running import CONTROLS_A_MINUTE, FRAGMENTS_A_MINUTE
from motorcade.sockets import allow_files
from support.mock_board import MockDriveBoard
from support.served_app import served
from support.soak import SOAK
from support.waiting import DEADLINE_S, wait_until

PICTURE_BYTES = 40_000
STALLED = 60
MUTE = 1000 if SOAK else 200
PINGS = 2000
# A frame with bits that nobody has defined, and a text that is no UTF-8.
RESERVED = b"\xf1\x80\0\0\0\0"
NO_TEXT = Frame(Opcode.TEXT, b"\xff").serialize(mask=True)


class NumberedPage:
    """A camera whose pictures are their numbers, and as large as pictures are."""

    def __init__(self):
        self.taken = 0
        self.enough = threading.Event()

    def jpeg(self):
        self.taken += 1
        if self.taken >= STALLED:
            self.enough.set()
        return b"<%d>" % self.taken + bytes(PICTURE_BYTES)

    def close(self):
        pass


def running(source, tls=None, wheels=None):
    """Serve a car's page in a thread of its own; give its address."""

    def make_app():
        drive = CarControl(wheels or MockDriveBoard(), lambda: 0, built_in_profile("classroom"))
        return make_remote(ServerSettings(), SingleCar(drive, Camera(source, rate_hz=30)))

    return served(make_app, tls)


def test_a_stalled_viewer_gets_few_old_pictures_and_then_the_newest():
    source = NumberedPage()
    with running(source) as address, socket.create_connection(address) as viewer:
        viewer.settimeout(DEADLINE_S)
        viewer.sendall(b"GET /camera?rate=30 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        data = viewer.recv(1000)
        assert source.enough.wait(DEADLINE_S)
        # All that a player does who was frozen for a while: read.
        while not (numbers := [int(number) for number in re.findall(rb"<(\d+)>", data)]) or numbers[-1] < STALLED:
            data += viewer.recv(1 << 20)
    old = [number for number in numbers if number < STALLED]
    assert old == sorted(set(old))
    # What the two ends' kernels and the server hold back; without bounds it would be nearly all.
    assert len(old) < STALLED / 3


def test_of_a_burst_after_a_stall_few_sticks_are_executed_and_the_last_one_is():
    wheels = MockDriveBoard()
    with running(NumberedPage(), wheels=wheels) as (host, port), connect(f"ws://{host}:{port}/drive/ws") as line:
        joined(line)
        stick = {"do": "drive", "cars": ["1"], "steering": 0.0}
        # As one write, as a network delivers what it held back.
        burst = [
            json.dumps(stick | {"throttle": 0.0 if number == 99 else 1.0, "number": number}) for number in range(100)
        ]
        frames = b"".join(Frame(Opcode.TEXT, text.encode()).serialize(mask=True) for text in burst)
        line.socket.sendall(frames)
        while json.loads(line.recv(DEADLINE_S)).get("number") != 99:
            pass
    assert not wheels.moves
    assert len(wheels.notes) < 20


@pytest.fixture
def trust(tmp_path):
    """Make a car's keys; give the context of who trusts them."""
    make_keys(tmp_path, [CarKeys("ada")], ["lin"], datetime.now(UTC))
    return ssl.create_default_context(cafile=str(tmp_path / "authority.crt"))


def test_the_page_and_its_socket_are_served_by_https(tmp_path, trust):
    with running(NumberedPage(), https_context(tmp_path / "car-ada.pem")) as (host, port):
        with closing(http.client.HTTPSConnection(host, port, timeout=DEADLINE_S, context=trust)) as page:
            page.request("GET", "/camera/snapshot.jpg")
            assert page.getresponse().status == 200
        with connect(f"wss://127.0.0.1:{port}/drive/ws", ssl=trust, open_timeout=DEADLINE_S) as line:
            assert json.loads(line.recv(DEADLINE_S))["is"] in ("hello", "telemetry")


def test_connections_that_have_ended_take_no_places():
    with (
        running(NumberedPage()) as address,
        closing(http.client.HTTPConnection(*address, timeout=DEADLINE_S)) as kept,
    ):
        kept.connect()
        line = kept.sock
        for _ in range(150):
            with closing(http.client.HTTPConnection(*address, timeout=DEADLINE_S)) as visitor:
                for page in (visitor, kept):
                    page.request("GET", "/drive")
                    page.getresponse().read()
        assert kept.sock is line, "it was closed, and opened again"


def test_many_mute_connections_shut_nobody_out_and_disturb_no_page():
    allow_files(4 * MUTE)
    with (
        running(NumberedPage()) as address,
        ExitStack() as mute,
        connect(f"ws://{address[0]}:{address[1]}/drive/ws") as page,
    ):
        open_files = psutil.Process().num_fds()
        for number in range(MUTE):
            line = mute.enter_context(socket.create_connection(address, DEADLINE_S))
            with suppress(OSError):
                line.sendall(b"GET / HT"[: number % 9])
        with closing(http.client.HTTPConnection(*address, timeout=DEADLINE_S)) as visitor:
            visitor.request("GET", "/camera/snapshot.jpg")
            assert visitor.getresponse().status == 200
        joined(page)
        # MUTE of them are the ends of this test.
        assert psutil.Process().num_fds() - open_files - MUTE < 160


def joined(page):
    """Join the car, and wait for its telemetry."""
    page.send(json.dumps({"do": "join", "car": "1"}))
    while "1" not in json.loads(page.recv(DEADLINE_S)).get("cars", ()):
        pass


def test_a_request_that_does_not_come_whole_in_time_is_hung_up(monkeypatch):
    monkeypatch.setattr("motorcade.server.running.REQUEST_S", 0.05)
    beginnings = (b"", b"GET / HTTP/1.1\r\nHost: 127", b"POST /api/x HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\n{")
    with running(NumberedPage()) as address:
        for beginning in beginnings:
            with socket.create_connection(address, DEADLINE_S) as line:
                line.sendall(beginning)
                with suppress(ConnectionError):
                    while line.recv(1 << 16):
                        pass


def test_a_flood_of_nonsense_is_logged_in_few_lines(capsys):
    with running(NumberedPage()) as address:
        for _ in range(MUTE):
            with socket.create_connection(address, DEADLINE_S) as line, suppress(ConnectionError):
                line.sendall(b"\0\0 nonsense\r\n\r\n")
                while line.recv(1 << 16):
                    pass
    assert 0 < capsys.readouterr().err.count("Invalid") <= 10


def refused_socket(address):
    """A WebSocket that a page of another site asks for."""
    with pytest.raises(InvalidStatus) as refused:
        connect(f"ws://{address[0]}:{address[1]}/drive/ws", origin="http://elsewhere.example", proxy=None)
    assert refused.value.response.status_code == 403


def damage(address, frame):
    """Send a damaged frame, and read until the server hangs up."""
    with connect(f"ws://{address[0]}:{address[1]}/drive/ws", proxy=None) as line, suppress(ConnectionClosed):
        # A page that is sent something at the same moment.
        line.recv(DEADLINE_S)
        line.socket.sendall(frame)
        while True:
            line.recv(DEADLINE_S)


def test_foreign_websockets_are_not_logged_and_damaged_ones_in_few_lines(capsys):
    with running(NumberedPage()) as address:
        for _ in range(20):
            refused_socket(address)
            damage(address, RESERVED)
        assert capsys.readouterr().err == ""
        for _ in range(20):
            damage(address, NO_TEXT)
    assert 0 < len(capsys.readouterr().err.splitlines()) <= 10


def flood(line, frame, frames):
    for _ in range(frames):
        line.socket.sendall(frame)
        line.recv(DEADLINE_S)


@pytest.mark.parametrize(
    ("opcode", "most"),
    [(Opcode.PING, CONTROLS_A_MINUTE), (Opcode.PONG, CONTROLS_A_MINUTE), (Opcode.CONT, FRAGMENTS_A_MINUTE)],
    ids=["pings", "pongs", "fragments"],
)
def test_a_page_that_floods_with_frames_that_are_no_messages_is_dropped_and_others_are_not(opcode, most):
    frame = Frame(opcode, b"", fin=opcode is not Opcode.CONT).serialize(mask=True)
    begun = Frame(Opcode.TEXT, b"{", fin=False).serialize(mask=True) if opcode is Opcode.CONT else b""
    with running(NumberedPage()) as (host, port), connect(f"ws://{host}:{port}/drive/ws", proxy=None) as other:
        with connect(f"ws://{host}:{port}/drive/ws", proxy=None) as line:
            line.socket.sendall(begun + (most - 1) * frame)
            # It is served on: telemetry comes ten times a second.
            for _ in range(3):
                line.recv(DEADLINE_S)
            with pytest.raises((ConnectionClosed, OSError)):
                flood(line, frame, 10)
        joined(other)


def opened(line, address):
    """Open a WebSocket at a connection."""
    page = ClientProtocol(parse_uri(f"ws://{address[0]}:{address[1]}/drive/ws"))
    page.send_request(page.connect())
    line.sendall(b"".join(page.data_to_send()))
    while page.state is not State.OPEN:
        page.receive_data(line.recv(1000))
    return page


def test_a_page_that_reads_nothing_and_answers_no_ping_loses_its_place(monkeypatch):
    monkeypatch.setattr("motorcade.server.running.PING_S", 0.2)
    monkeypatch.setattr("motorcade.server.running.CONTROLS_A_MINUTE", PINGS)
    with running(NumberedPage()) as address, socket.socket() as line:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 11)
        line.connect(address)
        opened(line, address)
        # The answers are more than the kernels hold.
        with suppress(ConnectionError):
            line.sendall(Frame(Opcode.PING, bytes(125)).serialize(mask=True) * PINGS)
        wait_until(
            lambda: address not in [each.laddr for each in psutil.Process().net_connections() if each.raddr],
            deadline_s=DEADLINE_S,
        )


def close_when_no_more_connections_are_accepted(line, address):
    with suppress(ConnectionError):
        while True:
            socket.create_connection(address, DEADLINE_S).close()
    line.close()


def test_a_server_ends_without_an_error_while_a_page_is_leaving(tmp_path, trust):
    with running(NumberedPage(), https_context(tmp_path / "car-ada.pem")) as (host, port):
        plain = socket.create_connection((host, port), DEADLINE_S)
        line = trust.wrap_socket(plain, server_hostname=host)
        page = opened(line, (host, port))
        page.send_close()
        line.sendall(b"".join(page.data_to_send()))
        # The goodbye is answered, but the end of the encryption isn't: to the server somebody is still there.
        while page.close_rcvd is None:
            page.receive_data(line.recv(1000))
        leaving = threading.Thread(target=close_when_no_more_connections_are_accepted, args=(line, (host, port)))
        leaving.start()
    leaving.join(DEADLINE_S)
    assert not leaving.is_alive()
