"""The car's end of a connection that tells and is asked: frames of a length and JSON, both ways."""

import asyncio
import json
import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from motorcade.drive.command_channel import CommandChannel, client_of
from motorcade.drive.drive_failures import DriveError
from motorcade.drive.listener import ClientProtocol

if TYPE_CHECKING:
    from motorcade.drive.server import DriveServer
    from motorcade.drive.session import ControlSession

PERIOD_S = 0.1
MOST_REQUEST_BYTES = 1024
_MOST_A_SECOND = 20
# A client has so long to say to which connection its channel belongs.
_PERIODS_TO_JOIN = 10
# So that one client's connections don't take all seats.
MOST_ALIKE = 4
# What waits for one who asks and doesn't read.
_MOST_WAITING_BYTES = 1 << 14
REQUESTS = ("join", "request", "release", "stop", "clear", "resume")
_SIZE = struct.Struct(">I")


class TelemetryChannel(ClientProtocol, asyncio.Protocol):
    """One client's telemetry and requests.

    Attributes:
        client: as of `motorcade.drive.command_channel.CommandChannel`.
        port_named: the port of its connection for commands, as it says.
        commands: that connection, once it is found.
    """

    def __init__(self, left: Callable[[ClientProtocol], None], server: "DriveServer") -> None:
        super().__init__(left)
        self.client = ""
        self.port_named = 0
        self.commands: CommandChannel | None = None
        self._name = ""
        self._server = server
        self._seat: ControlSession | None = None
        self._received = bytearray()
        self._is_slow = self._is_joining = False
        self._periods = self._requests = 0

    @property
    def watches_alone(self) -> bool:
        """Whether it has a seat that no connection for commands shares."""
        return self._seat is not None

    def is_seated(self) -> bool:
        """Whether it drives or watches."""
        return self._own_seat() is not None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Note who comes."""
        super().connection_made(transport)
        assert self.line
        # One frame at most waits here for a slow reader. With a limit of 0 TLS would never say that it has been read.
        self.line.set_write_buffer_limits(1)
        address = transport.get_extra_info("peername") or ("?", 0)
        self.client = client_of(transport)
        self._name = f"{self.client}:{address[1]}"
        self._server.hear(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the watcher's seat back."""
        if self in self._server.channels:
            self._server.channels.remove(self)
        if self._seat:
            self._seat.leave()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """The client reads slowly."""
        self._is_slow = True

    def resume_writing(self) -> None:
        """It has read all."""
        self._is_slow = False

    def data_received(self, data: bytes) -> None:
        """Answer the requests that are whole."""
        self._received += data
        while self.line and len(self._received) >= _SIZE.size:
            (size,) = _SIZE.unpack_from(self._received)
            if size > MOST_REQUEST_BYTES:
                self._refuse(None, DriveError("too-long", most=MOST_REQUEST_BYTES))
                self._hang_up()
                return
            end = _SIZE.size + size
            if len(self._received) < end:
                return
            text = bytes(self._received[_SIZE.size : end])
            del self._received[:end]
            self._answer(text)

    def tell(self, told: dict[str, Any]) -> None:
        """One period is over: send telemetry, unless the last frame is still on its way."""
        self._requests = max(0, self._requests - int(_MOST_A_SECOND * PERIOD_S))
        self._periods += 1
        try:
            self._settle()
        except DriveError as problem:
            self._refuse(None, problem)
            self._hang_up()
            return
        if not self._is_slow:
            self._send({"kind": "telemetry"} | told | {"you": self._you()})

    def _settle(self) -> None:
        """Find out to whom this channel belongs, or take a seat of its own. Raises DriveError."""
        if self._has_partner():
            return
        if self._find_partner(self._server.named_by(self)) or self._periods < _PERIODS_TO_JOIN:
            return
        if self._find_partner(self._server.alone_like(self)):
            return
        if self._is_joining:
            self._is_joining = False
            self._refuse("join", DriveError("no-such-connection", port=self.port_named))
        self._sit()

    def _has_partner(self) -> bool:
        if self.commands and self.commands.line is None:
            self.commands = None
        return self.commands is not None

    def _find_partner(self, found: CommandChannel | None) -> bool:
        self.commands = found
        if found and self._seat:
            self._seat.leave()
            self._seat = None
        if found and self._is_joining:
            self._is_joining = False
            self._send({"kind": "answer", "do": "join", "ok": True})
        return found is not None

    def _own_seat(self) -> "ControlSession | None":
        return self.commands.seat if self.commands else self._seat

    def _sit(self) -> "ControlSession":
        """The seat that asks. Raises DriveError."""
        if self._has_partner() or self._find_partner(self._server.alone_like(self)):
            assert self.commands
            return self.commands.sit()
        if self._seat is None:
            if sum(each.watches_alone and each.client == self.client for each in self._server.channels) >= MOST_ALIKE:
                raise DriveError("enough-of-you", most=MOST_ALIKE)
            self._seat = self._server.drive.join(self._name, watches=True)
        return self._seat

    def _you(self) -> dict[str, Any] | None:
        seat = self._own_seat()
        drives = seat is not None and self._server.drive.drives(seat)
        if self.commands:
            return {"name": self.commands.name, "drives": drives} | self.commands.counts.as_dict()
        return {"name": seat.name, "drives": drives} | seat.counts.as_dict() if seat else None

    def _answer(self, text: bytes) -> None:
        self._requests += 1
        what: str | None = None
        try:
            request = _read(text)
            what = str(request["do"])
            more = self._do(what, request)
        except DriveError as problem:
            self._refuse(what, problem)
            return
        if more is not None:
            self._send({"kind": "answer", "do": what, "ok": True} | more)

    def _do(self, what: str, request: dict[str, Any]) -> dict[str, Any] | None:
        """What to say beside 'ok'; None where the answer comes later. Raises DriveError."""
        # One that stops is never one too many.
        if self._requests > _MOST_A_SECOND and what != "stop":
            raise DriveError("too-many-requests", most=_MOST_A_SECOND)
        if what == "join":
            self.port_named = request.get("port", 0)
            self.commands = None
            self._periods, self._is_joining = 0, True
            self._find_partner(self._server.named_by(self))
            return None
        seat = self._sit()
        if what == "request":
            return {"has_wheel": seat.request()}
        actions = {"release": seat.release, "stop": seat.stop, "clear": seat.clear, "resume": seat.resume_program}
        actions[what]()
        return {}

    def _refuse(self, what: str | None, problem: DriveError) -> None:
        sentences = {language: problem.message(language) for language in ("en", "zh")}
        self._send({"kind": "answer", "do": what, "ok": False, "code": problem.code} | sentences)

    def _send(self, frame: dict[str, Any]) -> None:
        if self.line is None or self.line.is_closing():
            return
        text = json.dumps(frame, ensure_ascii=False).encode()
        self.line.write(_SIZE.pack(len(text)) + text)
        if self.line.get_write_buffer_size() > _MOST_WAITING_BYTES:
            self.drop()

    def _hang_up(self) -> None:
        self._server.drive.turn_away()
        if self.line:
            self.line.close()


def _read(text: bytes) -> dict[str, Any]:
    """The request in ``text``. Raises DriveError."""
    try:
        request = json.loads(text)
    except (ValueError, RecursionError):
        raise DriveError("not-a-request") from None
    if not isinstance(request, dict) or request.get("do") not in REQUESTS:
        raise DriveError("not-a-request")
    if not isinstance(request.get("port", 0), int):
        raise DriveError("not-a-request")
    return request
