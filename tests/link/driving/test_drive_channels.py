"""The car's ends of its connections, with bytes cut, joined and made up in any way, and clients that don't read."""

import asyncio
import json
import struct
from itertools import accumulate, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.car.drive_board import DriveBoard
from motorcade.link.drive_server import DriveServer
from motorcade.link.driving.command_channel import MOST_WRONG, CommandChannel
from motorcade.link.driving.drive import Drive
from motorcade.link.driving.telemetry_channel import MOST_REQUEST_BYTES, REQUESTS, TelemetryChannel
from motorcade.profile import built_in_profile
from motorcade.words.formats import DRIVE

PROFILE = built_in_profile("classroom")


class Applied(DriveBoard):
    """Notes the angles of commands that are executed."""

    def __init__(self) -> None:
        self.angles: list[int] = []

    def apply(self, angle_deg: int, direction: int, speed: int) -> None:
        self.angles.append(angle_deg)

    def neutral(self) -> None:
        pass


class Line(asyncio.Transport):
    """A connection whose client reads when the test says so."""

    def __init__(self, port: int) -> None:
        super().__init__({"peername": ("192.168.1.7", port)})
        self.sent = bytearray()
        self.waiting = 0
        self.is_open = True
        self.reads = True

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        self.high = high

    def write(self, data: bytes) -> None:
        self.sent += data
        if not self.reads:
            self.waiting += len(data)
            if self.waiting > self.high:
                self.channel.pause_writing()

    def get_write_buffer_size(self) -> int:
        return self.waiting

    def is_closing(self) -> bool:
        return not self.is_open

    def close(self) -> None:
        self.abort()

    def abort(self) -> None:
        if self.is_open:
            self.is_open = False
            self.channel.connection_lost(None)

    def frames(self) -> list[dict]:
        """What was sent since the last call."""
        data, found = bytes(self.sent), []
        while data:
            (size,) = struct.unpack_from(">I", data)
            found.append(json.loads(data[4 : 4 + size]))
            data = data[4 + size :]
        self.sent.clear()
        return found


class Car:
    """A server without sockets."""

    def __init__(self, byte_order: str = "big") -> None:
        self.board = Applied()
        self.now_ms = 0
        self.drive = Drive(self.board, lambda: self.now_ms, PROFILE)
        self.server = DriveServer(self.drive, PROFILE, byte_order)

    def commands(self, port: int = 1000) -> tuple[CommandChannel, Line]:
        return self._connect(self.server.command_channel(lambda guest: None), port)

    def telemetry(self, port: int = 2000) -> tuple[TelemetryChannel, Line]:
        return self._connect(self.server.telemetry_channel(lambda guest: None), port)

    def _connect(self, channel, port):
        line = Line(port)
        line.channel = channel
        channel.connection_made(line)
        return channel, line

    def tell(self, times: int = 1) -> None:
        """Let periods of telemetry pass."""
        for _ in range(times):
            told = self.drive.telemetry()._asdict()
            for channel in list(self.server.channels):
                channel.tell(told)


def receive(channel: CommandChannel, data: bytes) -> None:
    """As a loop does: into the channel's own buffer, as much as it holds at a time."""
    while data and channel.line:
        buffer = channel.get_buffer(-1)
        size = min(len(buffer), len(data))
        buffer[:size] = data[:size]
        channel.buffer_updated(size)
        data = data[size:]


def ask(channel: TelemetryChannel, line: Line, **request) -> dict:
    """The answer to a request."""
    text = json.dumps(request).encode()
    channel.data_received(struct.pack(">I", len(text)) + text)
    return line.frames()[-1]


def command(angle: int, speed: int = 0) -> bytes:
    return struct.pack(">I", DRIVE.encode(angle=angle, direction=1, speed=speed))


@given(st.lists(st.integers(0, 180), min_size=1, max_size=40), st.lists(st.integers(1, 11)))
def test_commands_cut_and_joined_in_any_way_are_executed_newest_first_and_never_misread(angles, cuts) -> None:
    car = Car()
    channel, _ = car.commands()
    data, expected, whole = b"".join(map(command, angles)), [], 0
    ends = [end for end in accumulate(cuts) if end < len(data)]
    for begin, end in pairwise([0, *ends, len(data)]):
        receive(channel, data[begin:end])
        if end // 4 > whole:
            whole = end // 4
            expected.append(angles[whole - 1])
    assert car.board.angles == expected
    assert len(expected) + channel.seat.counts.superseded == len(angles)


def test_of_what_has_gathered_the_newest_alone_is_executed() -> None:
    car = Car()
    channel, _ = car.commands()
    receive(channel, command(90))
    receive(channel, b"".join(command(angle) for angle in range(50)))
    assert car.board.angles == [90, 49]
    assert channel.seat.counts.superseded == 49


def test_of_more_than_the_buffer_holds_the_end_alone_is_executed() -> None:
    car = Car()
    channel, _ = car.commands()
    receive(channel, command(90))
    receive(channel, command(10) * 5000 + command(20))
    assert car.board.angles == [90, 20]
    assert channel.seat.counts.superseded == 5000


@pytest.mark.parametrize(("byte_order", "packed"), [("big", "128CB000"), ("little", "00B08C12")])
def test_the_first_seed_word_arrives_in_either_byte_order(byte_order: str, packed: str) -> None:
    car = Car(byte_order)
    channel, _ = car.commands()
    receive(channel, bytes.fromhex(packed))
    assert car.drive.telemetry()[1:4] == (40, 1, 150)


@given(st.binary(min_size=1, max_size=5000))
def test_made_up_bytes_are_counted_and_move_nothing_that_is_not_their_command(data: bytes) -> None:
    car = Car()
    driver, _ = car.commands(1)
    receive(driver, command(90, 100))
    channel, _ = car.commands(2)
    receive(channel, data)
    assert car.board.angles == [90]
    assert car.drive.telemetry()[:4] == ("moving", 90, 1, 100)


def test_a_client_that_sends_nonsense_only_is_hung_up_on() -> None:
    car = Car()
    channel, line = car.commands()
    receive(channel, command(90))
    for _ in range(MOST_WRONG - 1):
        receive(channel, b"GET ")
    assert line.is_open
    receive(channel, command(91))
    for _ in range(MOST_WRONG):
        receive(channel, b"GET ")
    assert not line.is_open
    told = car.drive.telemetry()
    assert (told.refused, told.turned_away, told.driver) == (2 * MOST_WRONG - 1, 1, None)


def test_who_only_connects_takes_no_seat() -> None:
    car = Car()
    for port in range(30):
        car.commands(port)
    channel, _ = car.commands(99)
    receive(channel, command(90))
    assert car.board.angles == [90]


def test_who_sends_nonsense_only_takes_no_seat() -> None:
    car = Car()
    for port in range(30):
        receive(car.commands(port)[0], b"GET ")
    channel, _ = car.commands(99)
    receive(channel, command(90))
    assert car.board.angles == [90]
    assert car.drive.telemetry().refused == 30


def test_when_all_seats_are_taken_the_longest_silent_gives_up_the_own() -> None:
    car = Car()
    channels = [car.commands(port) for port in range(9)]
    for car.now_ms, (channel, _) in enumerate(channels):
        receive(channel, command(90))
    late, late_line = car.commands(99)
    receive(late, command(91))
    assert not late_line.is_open
    car.now_ms = 5004
    receive(channels[0][0], command(92))
    late, late_line = car.commands(99)
    receive(late, command(93))
    assert late_line.is_open
    assert [line.is_open for _, line in channels] == [True, False] + [True] * 7


def test_a_channel_finds_the_connection_whose_port_it_names() -> None:
    car = Car()
    for port in (1, 2):
        receive(car.commands(port)[0], command(90))
    channel, line = car.telemetry()
    assert ask(channel, line, do="join", port=2) == {"kind": "answer", "do": "join", "ok": True}
    car.tell()
    told = line.frames()[0]
    assert (told["kind"], told["you"]["name"], told["you"]["drives"]) == ("telemetry", "192.168.1.7:2", False)
    assert (told["driver"], told["watchers"]) == ("192.168.1.7:1", 1)


def test_a_channel_does_not_find_a_connection_that_is_gone() -> None:
    car = Car()
    _, gone = car.commands(5)
    gone.abort()
    channel, line = car.telemetry()
    assert ask(channel, line, do="request")["ok"]
    car.tell(11)
    assert line.frames()[-1]["you"]["name"] == "192.168.1.7:2000"


def test_a_channel_may_come_before_the_connection_that_it_names() -> None:
    car = Car()
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", 26) + b'{"do": "join", "port": 77}')
    car.tell()
    assert [frame["kind"] for frame in line.frames()] == ["telemetry"]
    car.commands(77)
    car.tell()
    assert [frame.get("ok") for frame in line.frames()] == [True, None]


def test_a_channel_behind_a_proxy_finds_the_only_connection_there_is() -> None:
    car = Car()
    car.commands(5)
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", 26) + b'{"do": "join", "port": 77}')
    car.tell(10)
    answers = [frame for frame in line.frames() if frame["kind"] == "answer"]
    assert answers == [{"kind": "answer", "do": "join", "ok": True}]


def test_a_channel_that_finds_nobody_is_told_so_and_watches() -> None:
    car = Car()
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", 26) + b'{"do": "join", "port": 77}')
    car.tell(11)
    *_, answer, _, told = line.frames()
    assert (answer["ok"], answer["code"]) == (False, "no-such-connection")
    assert "port 77" in answer["en"]
    assert told["you"]["drives"] is False
    assert told["watchers"] == 1


def test_a_channel_that_watched_gives_its_own_seat_back_when_its_connection_comes() -> None:
    car = Car()
    channel, line = car.telemetry()
    assert ask(channel, line, do="release")["ok"]
    assert car.drive.telemetry().watchers == 1
    receive(car.commands(7)[0], command(90))
    ask(channel, line, do="join", port=7)
    assert car.drive.telemetry().watchers == 0


def test_a_channel_finds_the_connection_that_its_client_makes_anew() -> None:
    car = Car()
    _, first = car.commands(7)
    channel, line = car.telemetry()
    ask(channel, line, do="join", port=7)
    first.abort()
    receive(car.commands(8)[0], command(90, 100))
    assert ask(channel, line, do="join", port=8)["ok"]
    car.tell()
    assert line.frames()[-1]["you"]["drives"]


def test_a_channel_whose_connection_is_gone_finds_the_next_one() -> None:
    car = Car()
    _, first = car.commands(7)
    channel, line = car.telemetry()
    ask(channel, line, do="join", port=7)
    first.abort()
    receive(car.commands(8)[0], command(90, 100))
    car.tell(10)
    assert line.frames()[-1]["you"]["drives"]


def test_who_is_named_is_not_kept_by_who_only_found_it() -> None:
    car = Car()
    receive(car.commands(7)[0], command(90, 100))
    (finder, finds), (owner, owns) = car.telemetry(1), car.telemetry(2)
    assert ask(finder, finds, do="request")["has_wheel"]
    ask(owner, owns, do="join", port=7)
    assert ask(finder, finds, do="request")["has_wheel"] is False
    assert ask(owner, owns, do="request")["has_wheel"] is True


def test_a_channel_that_names_nobody_belongs_to_nobody_where_two_could_be_meant() -> None:
    car = Car()
    for port in (7, 8):
        receive(car.commands(port)[0], command(90, 100))
    channel, line = car.telemetry()
    assert ask(channel, line, do="request")["has_wheel"] is False
    assert car.drive.telemetry().wanted_by == "192.168.1.7:2000"


def test_one_client_has_four_watchers_at_most() -> None:
    car = Car()
    lines = [car.telemetry(port)[1] for port in range(6)]
    car.tell(10)
    assert [line.is_open for line in lines] == [True] * 4 + [False] * 2
    assert lines[-1].frames()[-1]["code"] == "enough-of-you"


def test_an_emergency_stop_from_a_watcher_latches() -> None:
    car = Car()
    driver, _ = car.commands(1)
    car.commands(2)
    receive(driver, command(90, 100))
    channel, line = car.telemetry()
    assert ask(channel, line, do="stop")["ok"]
    receive(driver, command(90, 100))
    assert car.drive.telemetry().state == "stopped"
    assert ask(channel, line, do="clear")["ok"]
    receive(driver, command(90, 100))
    assert car.drive.telemetry().state == "failsafe"
    receive(driver, command(90))
    receive(driver, command(90, 100))
    assert car.drive.telemetry().state == "moving"


def test_the_wheel_is_asked_for_and_given_back() -> None:
    car = Car()
    channels = {port: car.commands(port)[0] for port in (1, 2)}
    lines = {port: car.telemetry(port + 10) for port in (1, 2)}
    for port, (channel, line) in lines.items():
        ask(channel, line, do="join", port=port)
    receive(channels[1], command(90, 100))
    assert ask(*lines[2], do="request") == {"kind": "answer", "do": "request", "ok": True, "has_wheel": False}
    assert ask(*lines[1], do="release")["ok"]
    assert car.drive.telemetry().driver == "192.168.1.7:2"
    assert ask(*lines[2], do="resume")["code"] == "no-program"


@pytest.mark.parametrize(
    "text",
    [b"", b"null", b"[]", b"{}", b'{"do": 1}', b'{"do": "fly"}', b'{"do": "join", "port": "x"}', b"\xff", b"[" * 999],
)
def test_what_is_no_request_is_answered_so(text: bytes) -> None:
    car = Car()
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", len(text)) + text)
    (answer,) = line.frames()
    assert (answer["do"], answer["code"], line.is_open) == (None, "not-a-request", True)


def test_a_frame_that_is_too_long_is_answered_and_ends_the_connection() -> None:
    car = Car()
    channel, line = car.telemetry()
    channel.data_received(struct.pack(">I", MOST_REQUEST_BYTES + 1))
    assert line.frames()[0]["code"] == "too-long"
    assert not line.is_open


@given(st.lists(st.binary(max_size=600), max_size=20))
def test_made_up_requests_never_break_a_channel_nor_the_drive(chunks: list[bytes]) -> None:
    car = Car()
    driver, _ = car.commands(1)
    receive(driver, command(90, 100))
    channel, line = car.telemetry()
    for chunk in chunks:
        if line.is_open:
            channel.data_received(chunk)
    assert car.drive.telemetry().state == "moving"


@pytest.mark.parametrize("size", [1, 3, 30, 1000])
def test_requests_are_cut_and_joined_in_any_way(size: int) -> None:
    car = Car()
    channel, line = car.telemetry()
    data = b"".join(struct.pack(">I", len(text)) + text for text in [b'{"do": "stop"}', b'{"do": "clear"}'] * 3)
    for at in range(0, len(data), size):
        channel.data_received(data[at : at + size])
    assert [answer["do"] for answer in line.frames()] == ["stop", "clear"] * 3


def test_more_than_twenty_requests_a_second_are_refused_but_a_stop() -> None:
    car = Car()
    channel, line = car.telemetry()
    answers = [ask(channel, line, do="release") for _ in range(30)]
    assert [answer["ok"] for answer in answers] == [True] * 20 + [False] * 10
    assert answers[-1]["code"] == "too-many-requests"
    assert ask(channel, line, do="stop")["ok"]
    car.tell(10)
    assert ask(channel, line, do="release")["ok"]


def test_a_client_that_does_not_read_is_sent_one_frame_and_later_the_newest() -> None:
    car = Car()
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
    car = Car()
    channel, line = car.telemetry()
    line.reads = False
    text = b'{"do": "stop"}'
    for _ in range(10_000):
        if line.is_open:
            channel.data_received(struct.pack(">I", len(text)) + text)
    assert not line.is_open
    assert len(line.sent) < 1 << 15


def test_every_request_there_is_has_an_answer() -> None:
    for what in REQUESTS:
        car = Car()
        car.commands(5)
        channel, line = car.telemetry()
        assert ask(channel, line, do=what, port=5)["do"] == what


def test_who_leaves_gives_the_seat_back() -> None:
    car = Car()
    channel, line = car.telemetry()
    ask(channel, line, do="release")
    commands, commands_line = car.commands(1)
    receive(commands, command(90, 100))
    line.abort()
    commands_line.abort()
    told = car.drive.telemetry()
    assert (told.watchers, told.driver, told.state) == (0, None, "failsafe")
