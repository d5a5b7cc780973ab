"""The one cable: who has it uploads through the server's port and reads back, nobody else does."""

import base64
import contextlib
import json

import pytest
from starlette.websockets import WebSocketDisconnect

from motorcade.boards.computer import ImageStore, simulated_car
from motorcade.boards.lines import TcpPort
from motorcade.server.studio import uploads
from motorcade.upload import transfer
from motorcade.upload.serial_port import BARE, BOARD, PortInfo
from support.strategies import CLASSROOM

HERS, HIS, THE_TEACHERS = (bytes.fromhex(f"01000000 0{digit}800000") for digit in "123")


@pytest.fixture
def port(tmp_path_factory, monkeypatch):
    """A simulated car at a port of the teacher's computer."""
    monkeypatch.setattr(transfer, "SETTLE_MS", 0)
    monkeypatch.setattr(transfer, "BOOT_MS", 0)
    with (
        contextlib.closing(TcpPort("127.0.0.1", 0)) as line,
        simulated_car(line, ImageStore(tmp_path_factory.mktemp("car") / "car"), CLASSROOM),
    ):
        monkeypatch.setattr(uploads, "ports", lambda: [PortInfo(line.address, "a car", "", rank=BOARD)])
        yield line.address


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


def test_who_has_the_cable_uploads_and_the_teacher_passes_it_on(room, port):
    mia, ben = room.join("Mia"), room.join("Ben")
    assert outcome(mia, port, HERS) == "cable-of-another", "who has not taken it"
    assert mia.ask("class/take", name="", wants=True) == {}
    assert ben.ask("class/take", name="", wants=True) == "held-by-another"
    assert (kinds_of_ports(mia), kinds_of_ports(ben)) == ({"serial", "virtual"}, {"virtual"})
    assert outcome(mia, port, HERS) == "verified"
    assert outcome(ben, port, HIS) == "cable-of-another"
    assert outcome(ben, port) == "cable-of-another", "nor does another read her program"
    assert outcome(mia, port) == HERS
    assert outcome(room.teacher, port, THE_TEACHERS) == "verified", "the teacher waits for nobody"
    with mia.client.websocket_connect("ws://192.168.1.5:7710/api/upload") as opened_before:
        assert room.teacher.ask("teacher/pass-on", name="", pupil=ben.id) == {}
        opened_before.send_text(json.dumps({"port": port, "image": base64.b64encode(HERS).decode()}))
        assert json.loads(opened_before.receive_text())["error"]["code"] == "cable-of-another"
    assert outcome(ben, port) == THE_TEACHERS
    room.teacher.ask("teacher/freeze", frozen=True)
    assert outcome(ben, port, HIS) == "class-frozen"


def test_pupils_are_shown_whether_something_is_at_a_port(room, port, monkeypatch):
    with room.join("Mia").open("class/stream") as page:
        page.until("pupil", lambda shown: shown["cabled"])
        monkeypatch.setattr(uploads, "ports", lambda: [PortInfo("/dev/ttyS0", "", "", rank=BARE)])
        page.until("pupil", lambda shown: not shown["cabled"])


@pytest.mark.parametrize("name", ["socket://127.0.0.1:22", "spy:///dev/null?file=/tmp/x", "/dev/null", "loop://", ""])
def test_whose_turn_it_is_reaches_the_listed_ports_alone(room, port, name):
    mia = room.join("Mia")
    mia.ask("class/take", name="", wants=True)
    assert outcome(mia, name, HERS) == "no-such-port"
