"""Uploads over WebSockets: to the simulated car, to mock ones, and through a port of the page."""

import base64
import json
import sys
from contextlib import closing, contextmanager, suppress

import pytest
from starlette.websockets import WebSocketDisconnect

from motorcade.boards.computer import ImageStore
from motorcade.errors import MotorcadeError
from motorcade.server.studio import uploads
from motorcade.upload import transfer as talk
from motorcade.upload.serial_port import BARE, BOARD, PortInfo
from motorcade.upload.transfer import holds_phrase
from motorcade.words import upload as protocol
from motorcade.words.request import CHECK_BYTES
from support.impatience import give_up_after
from support.played_car import IMAGE, PlayedCar
from support.upload_ends import NO_PROGRAM, ReceivingCar

SOCKETS = "ws://127.0.0.1:7700/api"
LONG = bytes.fromhex("FF000000" + "64800000" * 255)
POSIX_ONLY = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch) -> None:
    """Shorten all timeouts, as cars answer at once or never here."""
    monkeypatch.setattr(talk, "SETTLE_MS", 0)
    monkeypatch.setattr(talk, "BOOT_MS", 0)
    give_up_after(monkeypatch, 300)


def base64_of(data: bytes) -> str:
    return base64.b64encode(data).decode()


def ask(client, **wanted) -> list[dict]:
    """All answers of the server to one order."""
    if "image" in wanted:
        wanted["image"] = base64_of(wanted["image"])
    received = []
    with client.websocket_connect(f"{SOCKETS}/upload") as socket:
        socket.send_json(wanted)
        with suppress(WebSocketDisconnect):
            while True:
                received.append(socket.receive_json())
    return received


def failure(received: list[dict]) -> tuple[str, str]:
    """The code and the English sentence of the failure."""
    assert received[-1]["outcome"] == "failed"
    error = received[-1]["error"]
    assert set(error["sentence"]) == {"en", "zh"}
    assert error["sentence"]["zh"].endswith(("。", "？"))
    return error["code"], error["sentence"]["en"]


@contextmanager
def played(monkeypatch, answer: bytes):
    """List a port whose car receives images of IMAGE's length and gives a fixed answer to each."""
    with closing(PlayedCar("pty")) as car:
        monkeypatch.setattr(uploads, "ports", lambda: [PortInfo(car.port, "a board", "")])
        car.take(answer)
        yield car.port


def test_the_ports_are_those_of_the_computer_and_a_virtual_one(client, monkeypatch) -> None:
    board = PortInfo("COM3", "USB Serial", "USB", "CH340", BOARD)
    monkeypatch.setattr(uploads, "ports", lambda: [board, PortInfo("/dev/ttyS0", "", "", rank=BARE)])
    # Nothing is mostly at a port of the mainboard, so it comes last.
    assert client.post("/api/ports").json() == [
        {"port": "COM3", "description": "CH340 (USB Serial)", "kind": "serial"},
        {"port": "virtual", "description": "", "kind": "virtual"},
        {"port": "/dev/ttyS0", "description": "", "kind": "serial"},
    ]


def progress(received: list[dict]) -> int:
    """The number of bytes sent, which must have increased."""
    sent = [each["sent"] for each in received]
    assert sent == sorted(set(sent))
    assert {each["of"] for each in received} == {len(LONG)}
    return sent[-1]


def test_an_image_is_uploaded_to_the_virtual_car_and_read_back(client, tmp_path) -> None:
    assert ask(client, port="virtual", readback=True) == [{"outcome": "image", "image": base64_of(NO_PROGRAM)}]
    received = ask(client, port="virtual", image=LONG)
    assert progress(received[:-1]) == len(LONG)
    assert received[-1]["outcome"] == "verified"
    assert received[-1]["answer"].startswith("OK words=256 crc32=")
    assert ask(client, port="virtual", readback=True) == [{"outcome": "image", "image": base64_of(LONG)}]
    assert ImageStore(tmp_path / "virtual-car.image").load() == LONG


def test_a_damaged_file_of_the_virtual_car_is_named(client, tmp_path) -> None:
    (tmp_path / "virtual-car.image").write_bytes(b"broken")
    code, sentence = failure(ask(client, port="virtual", image=IMAGE))
    assert code == "virtual-car"
    assert str(tmp_path / "virtual-car.image") in sentence
    (tmp_path / "virtual-car.image").unlink()
    assert ask(client, port="virtual", image=IMAGE)[-1]["outcome"] == "verified"


@POSIX_ONLY
@pytest.mark.parametrize(
    ("answer", "code", "says"),
    [
        (b"ERR battery low\n", "refused", "refused: battery low"),
        (b"hello\n", "no-answer", "upload without checking"),
    ],
)
def test_a_failed_upload_is_explained_in_every_language(client, monkeypatch, answer, code, says) -> None:
    with played(monkeypatch, answer) as port:
        answers = ask(client, port=port, image=IMAGE)
    received = failure(answers)
    assert received[0] == code
    assert says in received[1]
    assert port in received[1]
    assert "keeps the image that it had" in received[1]
    retries = [each["retry"] for each in answers if "retry" in each]
    assert [(each["number"], each["of"]) for each in retries] == [(2, 3), (3, 3)]
    assert retries[0]["sentence"]["zh"].endswith("。")
    assert "again, 2 of 3" in retries[0]["sentence"]["en"]


@pytest.mark.parametrize("port", ["/dev/there-is-none", "", "spy:///dev/null?file=/tmp/written"])
def test_only_listed_ports_are_opened(client, port) -> None:
    code, sentence = failure(ask(client, port=port, image=IMAGE))
    assert code == "no-such-port"
    assert "motorcade ports" not in sentence


@pytest.mark.parametrize(
    ("wanted", "code"),
    [
        ({"port": "virtual"}, "bad-message"),
        ({"port": "virtual", "image": IMAGE, "readback": True}, "bad-message"),
        ({"port": "virtual", "image": b"x"}, "image-cut-off"),
        ({"port": "virtual", "image": IMAGE, "profile": "lorry"}, "no-such-profile"),
    ],
)
def test_an_invalid_order_is_refused(client, wanted, code) -> None:
    assert failure(ask(client, **wanted))[0] == code


@pytest.mark.parametrize("code", ["no-such-port", "mismatch", "went-away"])
def test_every_failure_has_the_pages_name_of_the_port(client, monkeypatch, code) -> None:
    def fail(*arguments, **options):
        raise MotorcadeError(code, port="/dev/pts/9", detail="DETAIL", holds=holds_phrase("old"))

    monkeypatch.setattr(uploads, "run", fail)
    monkeypatch.setattr(uploads, "ports", lambda: [PortInfo("COM3", "a board", "")])
    received = ask(client, port="COM3", image=IMAGE)[-1]["error"]
    assert received["code"] == code
    assert "/dev/pts/9" not in str(received)
    assert ("keeps the image that it had" in received["sentence"]["en"]) == (code != "no-such-port")


def carry(client, wanted: dict, car: ReceivingCar | None, now_ms: int = 0) -> tuple[list[dict], bytes]:
    """Carry bytes to a car and back as the page does; give the server's answers and the bytes that reached the car.

    An answer comes in two pieces. Without a car the port is silent.
    """
    received, reached = [], b""
    with client.websocket_connect(f"{SOCKETS}/serial") as socket:
        socket.send_json(wanted)
        while True:
            message = socket.receive()
            if message["type"] == "websocket.close":
                return received, reached
            if message.get("bytes"):
                reached += message["bytes"]
                answer = car.take(message["bytes"], now_ms)[1] if car else b""
                for piece in filter(None, (answer[:5], answer[5:])):
                    socket.send_bytes(piece)
            else:
                received.append(json.loads(message["text"]))


def test_an_image_goes_through_a_port_of_the_page_and_back(client) -> None:
    car = ReceivingCar()
    received, reached = carry(client, {"image": base64_of(LONG)}, car)
    assert car.stored == LONG
    assert reached[CHECK_BYTES:] == LONG
    assert progress(received[:-1]) == len(LONG)
    assert received[-1]["outcome"] == "verified"
    read, _ = carry(client, {"readback": True}, car, protocol.SILENCE_MS)
    assert read == [{"outcome": "image", "image": base64_of(LONG)}]


def test_a_silent_car_at_a_port_of_the_page_is_reported(client) -> None:
    assert failure(carry(client, {"image": base64_of(IMAGE)}, None)[0])[0] == "no-answer"
    assert failure(carry(client, {"readback": True}, None)[0])[0] == "nothing-to-read"
    assert carry(client, {"image": base64_of(IMAGE), "verify": False}, None)[0][-1] == {"outcome": "not-verified"}


def test_a_page_that_leaves_during_a_transfer_disturbs_no_other(client) -> None:
    with client.websocket_connect(f"{SOCKETS}/serial") as socket:
        socket.send_json({"readback": True})
    with client.websocket_connect(f"{SOCKETS}/upload") as socket:
        socket.send_json({"port": "virtual", "image": base64_of(LONG)})
    client.portal.call(lambda: None)
    assert carry(client, {"image": base64_of(IMAGE)}, ReceivingCar())[0][-1]["outcome"] == "verified"
