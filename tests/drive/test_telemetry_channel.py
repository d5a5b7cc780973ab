"""The end that tells and is asked: whom it belongs to, what it answers to anything, and clients that do not read."""

import struct
from typing import get_args, get_type_hints

import pytest

from motorcade.drive.motors import NEUTRAL_SETPOINT
from motorcade.drive.wire import MOST_REQUEST_BYTES, DriveRequest
from support.socketless_car import SocketlessCar, ask, command, receive


def test_a_channel_finds_the_connection_whose_port_it_names() -> None:
    car = SocketlessCar()
    for port in (1, 2):
        receive(car.commands(port)[0], command(90) * 2)
    channel, line = car.telemetry()
    assert ask(channel, line, do="join", port=2) == {"kind": "answer", "do": "join", "ok": True}
    car.tell()
    told = line.frames()[0]
    assert (told["kind"], told["you"]["name"], told["you"]["drives"]) == ("telemetry", "192.168.1.7:2", False)
    assert (told["driver"], told["watchers"]) == ("192.168.1.7:1", 1)


def test_a_channel_does_not_find_a_connection_that_is_gone() -> None:
    car = SocketlessCar()
    _, gone = car.commands(5)
    gone.abort()
    channel, line = car.telemetry()
    assert ask(channel, line, do="request")["ok"]
    car.tell(11)
    assert line.frames()[-1]["you"]["name"] == "192.168.1.7:2000"


def test_a_channel_may_come_before_the_connection_that_it_names() -> None:
    car = SocketlessCar()
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", 26) + b'{"do": "join", "port": 77}')
    car.tell()
    assert [frame["kind"] for frame in line.frames()] == ["telemetry"]
    car.commands(77)
    car.tell()
    assert [frame.get("ok") for frame in line.frames()] == [True, None]


def test_a_full_car_is_stopped_by_a_newcomer() -> None:
    car = SocketlessCar()
    for port in range(9):
        receive(car.commands(port)[0], command(90, 100) * 2)
    channel, line = car.telemetry(address="192.168.1.8")
    assert ask(channel, line, do="stop") == {"kind": "answer", "do": "stop", "ok": True}
    assert car.control.telemetry().state == "stopped"
    receive(car.server.commands[0], command(90, 100) * 2)
    assert car.control.telemetry()[:4] == ("stopped", *NEUTRAL_SETPOINT)


def test_a_channel_behind_a_proxy_finds_the_only_connection_there_is() -> None:
    car = SocketlessCar()
    car.commands(5)
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", 26) + b'{"do": "join", "port": 77}')
    car.tell(10)
    answers = [frame for frame in line.frames() if frame["kind"] == "answer"]
    assert answers == [{"kind": "answer", "do": "join", "ok": True}]


def test_a_channel_that_finds_no_connection_gets_an_answer_and_watches() -> None:
    car = SocketlessCar()
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", 26) + b'{"do": "join", "port": 77}')
    car.tell(11)
    *_, answer, _, told = line.frames()
    assert (answer["ok"], answer["code"]) == (False, "no-such-connection")
    assert "port 77" in answer["en"]
    assert told["you"]["drives"] is False
    assert told["watchers"] == 1


def test_a_channel_never_finds_the_connection_of_somebody_else() -> None:
    car = SocketlessCar()
    driver, _ = car.commands(5, "192.168.1.9")
    receive(driver, command(90, 100) * 2)
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", 25) + b'{"do": "join", "port": 5}')
    car.tell(11)
    answers = [frame for frame in line.frames() if frame["kind"] == "answer"]
    assert [answer["code"] for answer in answers] == ["no-such-connection"]
    assert ask(channel, line, do="release")["ok"]
    assert car.control.telemetry().driver == "192.168.1.9:5"


def test_a_channel_that_watched_ends_its_own_session_when_its_connection_comes() -> None:
    car = SocketlessCar()
    channel, line = car.telemetry()
    assert ask(channel, line, do="release")["ok"]
    assert car.control.telemetry().watchers == 1
    receive(car.commands(7)[0], command(90) * 2)
    ask(channel, line, do="join", port=7)
    assert car.control.telemetry().watchers == 0


def test_a_channel_whose_connection_is_gone_finds_the_next_one() -> None:
    car = SocketlessCar()
    _, first = car.commands(7)
    channel, line = car.telemetry()
    ask(channel, line, do="join", port=7)
    first.abort()
    receive(car.commands(8)[0], command(90, 100) * 2)
    car.tell(10)
    assert line.frames()[-1]["you"]["drives"]


def test_a_named_connection_belongs_to_the_channel_that_names_it() -> None:
    car = SocketlessCar()
    receive(car.commands(7)[0], command(90, 100) * 2)
    (finder, finds), (owner, owns) = car.telemetry(1), car.telemetry(2)
    assert ask(finder, finds, do="request")["has_wheel"]
    ask(owner, owns, do="join", port=7)
    assert ask(finder, finds, do="request")["has_wheel"] is False
    assert ask(owner, owns, do="request")["has_wheel"] is True


def test_a_channel_that_names_nobody_belongs_to_nobody_where_two_could_be_meant() -> None:
    car = SocketlessCar()
    for port in (7, 8):
        receive(car.commands(port)[0], command(90, 100) * 2)
    channel, line = car.telemetry()
    assert ask(channel, line, do="request")["has_wheel"] is False
    assert car.control.telemetry().wanted_by == "192.168.1.7:2000"


def test_one_client_has_four_watchers_at_most() -> None:
    car = SocketlessCar()
    lines = [car.telemetry(port)[1] for port in range(6)]
    car.tell(10)
    assert [line.is_open for line in lines] == [True] * 4 + [False] * 2
    assert lines[-1].frames()[-1]["code"] == "enough-of-you"


def test_an_emergency_stop_from_a_watcher_latches() -> None:
    car = SocketlessCar()
    driver, _ = car.commands(1)
    car.commands(2)
    receive(driver, command(90, 100) * 2)
    channel, line = car.telemetry()
    assert ask(channel, line, do="stop")["ok"]
    receive(driver, command(90, 100))
    assert car.control.telemetry().state == "stopped"
    assert ask(channel, line, do="clear")["ok"]
    receive(driver, command(90, 100))
    assert car.control.telemetry().state == "failsafe"
    receive(driver, command(90))
    receive(driver, command(90, 100))
    assert car.control.telemetry().state == "moving"


@pytest.mark.parametrize(
    "text",
    [
        *(b"", b"null", b"[]", b"{}", b'{"do": 1}', b'{"do": "fly"}', b'{"do": "join", "port": "x"}', b"\xff"),
        b'{"do": "stop", "x": ' + b"[" * 999,
    ],
)
def test_a_frame_that_is_no_request_is_answered(text: bytes) -> None:
    car = SocketlessCar()
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", len(text)) + text)
    (answer,) = line.frames()
    assert (answer["do"], answer["code"], line.is_open) == (None, "not-a-request", True)


def test_a_frame_that_is_too_long_is_answered_and_ends_the_connection() -> None:
    car = SocketlessCar()
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", MOST_REQUEST_BYTES + 1))
    assert line.frames()[0]["code"] == "too-long"
    assert not line.is_open


@pytest.mark.parametrize("size", [1, 30, 1000])
def test_requests_are_cut_and_joined_in_any_way(size: int) -> None:
    car = SocketlessCar()
    channel, line = car.telemetry()
    data = b"".join(struct.pack(">I", len(text)) + text for text in (b'{"do": "stop"}', b'{"do": "clear"}'))
    for at in range(0, len(data), size):
        channel.data_received(data[at : at + size])
    assert [answer["do"] for answer in line.frames()] == ["stop", "clear"]


def test_more_than_twenty_requests_a_second_are_refused_but_a_stop() -> None:
    car = SocketlessCar()
    channel, line = car.telemetry()
    answers = [ask(channel, line, do="release") for _ in range(30)]
    assert [answer["ok"] for answer in answers] == [True] * 20 + [False] * 10
    assert answers[-1]["code"] == "too-many-requests"
    assert ask(channel, line, do="stop")["ok"]
    car.now_ms += 1000
    assert ask(channel, line, do="release")["ok"]


def test_a_client_that_does_not_read_gets_one_frame_and_later_the_newest() -> None:
    car = SocketlessCar()
    channel, line = car.telemetry()
    car.tell()
    line.reads = False
    line.sent.clear()
    car.tell(1000)
    assert len(line.frames()) == 1
    line.waiting, line.reads = 0, True
    channel.resume_writing()
    car.now_ms = 77_000
    car.tell()
    assert len(line.frames()) == 1


def test_a_client_that_asks_and_does_not_read_is_hung_up_on() -> None:
    car = SocketlessCar()
    channel, line = car.telemetry()
    line.reads = False
    text = b'{"do": "stop"}'
    for _ in range(10_000):
        if line.is_open:
            channel.data_received(struct.pack(">I", len(text)) + text)
    assert not line.is_open
    assert len(line.sent) < 1 << 15


def test_every_request_there_is_has_an_answer() -> None:
    for what in get_args(get_type_hints(DriveRequest)["do"]):
        car = SocketlessCar()
        car.commands(5)
        channel, line = car.telemetry()
        assert ask(channel, line, do=what, port=5)["do"] == what
