"""A car whose channels have no sockets, and clients that send and read as a test says."""

import asyncio
import json
import struct

from motorcade.drive.channels import Clients, CommandChannel, TelemetryChannel
from motorcade.words.formats import DRIVE
from support.mock_board import MockCar, MockDriveBoard

ADDRESS = "192.168.1.7"


class SocketlessLine(asyncio.Transport):
    """A connection whose client reads when the test says so."""

    channel: CommandChannel | TelemetryChannel
    high: int | None

    def __init__(self, port: int, address: str) -> None:
        super().__init__({"peername": (address, port)})
        self.sent = bytearray()
        self.waiting = 0
        self.is_open = True
        self.reads = True

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        self.high = high

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.sent += data
        if not self.reads:
            self.waiting += len(data)
            assert self.high is not None
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


class Timer:
    """A timer of the car, which ends when the test lets time pass."""

    def __init__(self, due_ms: float, call) -> None:
        self.due_ms, self.call = due_ms, call

    def cancel(self) -> None:
        self.due_ms = float("inf")


class SocketlessCar(MockCar):
    """A server without sockets. ``said`` is what its console shows."""

    board: MockDriveBoard

    def __init__(self, byte_order: str = "big") -> None:
        super().__init__(board=MockDriveBoard(switches=()))
        self.server = Clients(self.control, byte_order)
        self.server.later = self._later  # type: ignore[assignment]
        self.said: list[str] = []
        self.server.refusals.say = lambda phrase: self.said.append(phrase.sentence())
        self._timers: list[Timer] = []

    def commands(self, port: int = 1000, address: str = ADDRESS) -> tuple[CommandChannel, SocketlessLine]:
        return self._connect(CommandChannel(self.server, lambda: None), port, address)

    def telemetry(self, port: int = 2000, address: str = ADDRESS) -> tuple[TelemetryChannel, SocketlessLine]:
        channel, line = self._connect(TelemetryChannel(self.server, lambda: None), port, address)
        (greeting,) = line.frames()
        assert greeting["you"] is None
        return channel, line

    def _connect(self, channel, port, address):
        line = SocketlessLine(port, address)
        line.channel = channel
        channel.connection_made(line)
        return channel, line

    def _later(self, seconds: float, call) -> Timer:
        self._timers.append(Timer(self.now_ms + seconds * 1000, call))
        return self._timers[-1]

    def wait(self, ms: int) -> None:
        """Let time pass, and the timers end that are due then."""
        self.now_ms += ms
        due = [timer for timer in self._timers if timer.due_ms <= self.now_ms]
        self._timers = [timer for timer in self._timers if timer.due_ms > self.now_ms]
        for timer in due:
            timer.call()

    def tell(self, times: int = 1) -> None:
        """Let periods of telemetry pass."""
        for _ in range(times):
            told = self.control.telemetry()._asdict()
            for channel in list(self.server.channels):
                channel.end_period(told)


def receive(channel: CommandChannel, data: bytes) -> None:
    """As a loop does: into the channel's own buffer, as much as it holds at a time."""
    while data and channel.line:
        buffer = channel.get_buffer(-1)
        size = min(len(buffer), len(data))
        buffer[:size] = data[:size]
        channel.buffer_updated(size)
        data = data[size:]


def begin(car: SocketlessCar, channel: CommandChannel, data: bytes) -> None:
    """Send the first commands of a connection, and wait until it is believed."""
    receive(channel, data)
    car.wait(50)


def ask(channel: TelemetryChannel, line: SocketlessLine, **request) -> dict:
    """The answer to a request."""
    text = json.dumps(request).encode()
    channel.data_received(struct.pack(">I", len(text)) + text)
    return line.frames()[-1]


def command(angle: int, speed: int = 0) -> bytes:
    return struct.pack(">I", DRIVE.encode(angle=angle, direction=1, speed=speed))
