"""The one cable: who stands first in the queue uploads through the server's port and reads back, nobody else does."""

import base64
import contextlib
import json
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from starlette.websockets import WebSocketDisconnect

from motorcade.boards.computer import ImageStore, simulated_car
from motorcade.boards.lines import TcpPort
from motorcade.server.studio import uploads
from motorcade.upload import transfer
from motorcade.upload.ports import BOARD, PortInfo
from support.class_page import class_room
from support.strategies import CLASSROOM
from support.waiting import DEADLINE_S

HERS, HIS, THE_TEACHERS = (bytes.fromhex(f"01000000 0{digit}800000") for digit in "123")


@pytest.fixture
def port(tmp_path, monkeypatch):
    """A simulated car at a port of the teacher's computer."""
    monkeypatch.setattr(transfer, "SETTLE_MS", 0)
    monkeypatch.setattr(transfer, "BOOT_MS", 0)
    with (
        contextlib.closing(TcpPort("127.0.0.1", 0)) as line,
        simulated_car(line, ImageStore(tmp_path / "car"), CLASSROOM),
    ):
        monkeypatch.setattr(uploads, "ports", lambda: [PortInfo(line.address, "a car", "", rank=BOARD)])
        yield line.address


@pytest.fixture
def room(tmp_path):
    with class_room(tmp_path / "class") as opened:
        yield opened


def outcome(browser, port, image=None):
    """How an upload ends, or with no image a readback: its outcome, and the code or the image."""
    order = {"port": port, "readback": True}
    if image:
        order = {"port": port, "image": base64.b64encode(image).decode()}
    with browser.client.websocket_connect("ws://192.168.1.5:7710/api/upload") as socket:
        socket.send_text(json.dumps(order))
        last = {}
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                last = json.loads(socket.receive_text())
    if last["outcome"] == "image":
        return base64.b64decode(last["image"])
    return last["error"]["code"] if last["outcome"] == "failed" else last["outcome"]


def kinds_of_ports(browser):
    return {each["kind"] for each in browser.ask("ports")}


def test_the_first_in_the_queue_uploads_and_the_teacher_takes_over(room, port):
    mia, ben = room.join("Mia"), room.join("Ben")
    assert outcome(mia, port, HERS) == "cable-of-another", "who doesn't stand in the queue"
    for pupil in (mia, ben):
        pupil.ask("class/cable", wants=True)
    assert (kinds_of_ports(mia), kinds_of_ports(ben)) == ({"serial", "virtual"}, {"virtual"})
    assert outcome(mia, port, HERS) == "verified"
    assert outcome(ben, port, HIS) == "cable-of-another"
    assert outcome(ben, port) == "cable-of-another", "nor does another read her program"
    assert outcome(mia, port) == HERS
    assert outcome(room.teacher, port, THE_TEACHERS) == "verified", "the teacher waits for nobody"
    room.teacher.ask("desk/cable/next")
    assert outcome(mia, port, HERS) == "cable-of-another"
    assert outcome(ben, port) == THE_TEACHERS
    room.teacher.ask("desk/freeze", frozen=True)
    assert outcome(ben, port, HIS) == "class-frozen"


def test_a_turn_waits_for_the_end_of_what_is_sent_and_the_next_one_for_both(room, port, monkeypatch):
    mia, ben = room.join("Mia"), room.join("Ben")
    for pupil in (mia, ben):
        pupil.ask("class/cable", wants=True)
    goes_on, begun = threading.Event(), threading.Event()

    def held(*arguments):
        begun.set()
        assert goes_on.wait(DEADLINE_S)
        return upload(*arguments)

    upload = uploads.upload
    monkeypatch.setattr(uploads, "upload", held)
    with ThreadPoolExecutor(1) as pool, ben.open("class/stream") as page:
        try:
            hers = pool.submit(outcome, mia, port, HERS)
            assert begun.wait(DEADLINE_S)
            room.teacher.ask("desk/cable/next")
            assert page.until("pupil", lambda view: view["cable_use"] == "ending")["cable"] == 1
            assert outcome(ben, port) == "cable-of-another"
            assert outcome(room.teacher, port) == "cable-sends"
        finally:
            goes_on.set()
        assert hers.result() == "verified"
        assert page.until("pupil", lambda view: view["cable"] == 0)["cable_use"] == "free"
        assert outcome(ben, port) == HERS


def test_a_turn_that_ends_before_the_order_is_over(room, port):
    mia = room.join("Mia")
    mia.ask("class/cable", wants=True)
    with mia.client.websocket_connect("ws://192.168.1.5:7710/api/upload") as opened_in_turn:
        mia.ask("class/cable", wants=False)
        opened_in_turn.send_text(json.dumps({"port": port, "image": base64.b64encode(HERS).decode()}))
        assert json.loads(opened_in_turn.receive_text())["error"]["code"] == "cable-of-another"


@pytest.mark.parametrize("name", ["socket://127.0.0.1:22", "spy:///dev/null?file=/tmp/x", "/dev/null", "loop://", ""])
def test_whose_turn_it_is_reaches_the_listed_ports_alone(room, port, name):
    mia = room.join("Mia")
    mia.ask("class/cable", wants=True)
    assert outcome(mia, name, HERS) == "no-such-port"
