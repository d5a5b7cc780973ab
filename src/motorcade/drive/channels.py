"""The car's end of its connections: one that brings commands, and one for telemetry and requests."""

import asyncio
import json
from collections.abc import Callable
from typing import Any

from motorcade.drive.listener import ClientProtocol
from motorcade.drive.session import CarControl, ControlSession, DriveError, Who
from motorcade.drive.wire import (
    MOST_REQUEST_BYTES,
    REQUESTS,
    Counts,
    FrameReader,
    FrameTooLongError,
    WordReader,
    newest_of_each_code,
    pack_frame,
)
from motorcade.locales import languages
from motorcade.timing import RateLimit
from motorcade.words.field import WordError

PERIOD_S = 0.1
# A thousand commands; nobody sends so many between two reads but by mistake.
_BUFFER_BYTES = 4096
MOST_WRONG = 16
_MOST_REQUESTS_PER_S = 20
# A client has so many periods to name the connection that its telemetry channel belongs to.
_PERIODS_TO_JOIN = 10
# So that one client's connections don't take all places.
MOST_WATCHERS = 4
# A client that asks and doesn't read is dropped when more bytes wait for it.
_MOST_WAITING_BYTES = 1 << 14


class CommandChannel(ClientProtocol, asyncio.BufferedProtocol):
    """Take one client's commands; nothing is sent back.

    Args:
        control: the car.
        byte_order: of a command, "big" or "little".
        opened, closed: see `ClientProtocol`.

    Attributes:
        session: None until the client has sent a command.
        counts: what became of its words.
    """

    def __init__(
        self,
        control: CarControl,
        byte_order: str,
        opened: Callable[[], None],
        closed: Callable[[], None],
    ) -> None:
        super().__init__(opened, closed)
        self.session: ControlSession | None = None
        self.counts = Counts()
        self._control = control
        self._reader = WordReader(byte_order)
        self._buffer = memoryview(bytearray(_BUFFER_BYTES))
        self._wrong = 0
        self._received = 0

    def has_session(self) -> bool:
        """Whether the client drives or watches."""
        return self.session is not None

    def connection_lost(self, exc: Exception | None) -> None:
        """End the session: the wheels stand still if it moved them."""
        if self.session:
            self.session.leave()
        super().connection_lost(exc)

    def get_buffer(self, sizehint: int) -> memoryview:
        """Where the next bytes go."""
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Obey the newest command of each code among those that have come."""
        words = self._reader.receive_data(self._buffer[:nbytes])
        before, self._received = self._received, self._received + len(words)
        if nbytes == _BUFFER_BYTES:
            # Newer commands lie behind a full buffer.
            self.counts.superseded += len(words)
            if words:
                self._take(words[-1], self._received, is_newest=False)
            return
        newest = newest_of_each_code(words)
        self.counts.superseded += len(words) - len(newest)
        for index in newest:
            self._take(words[index], before + index + 1)

    def open_session(self) -> ControlSession:
        """The session, which is opened if there is none yet. Raises DriveError."""
        if self.session is None:
            self.session = self._control.join(self.name, Who(self.client, replaced=self._hang_up), counts=self.counts)
        return self.session

    def _take(self, word: int, number: int, is_newest: bool = True) -> None:
        try:
            if self.session is None or not is_newest:
                self._control.check(word, self.counts)
            if is_newest:
                (self.session or self.open_session()).command(word, number)
            self._wrong = 0
        except WordError:
            self._wrong += 1
            if self._wrong >= MOST_WRONG:
                self._hang_up()
        except DriveError:
            self._hang_up()

    def _hang_up(self) -> None:
        self._control.turn_away()
        self.drop()


class TelemetryChannel(ClientProtocol, asyncio.Protocol):
    """Send telemetry to one client, and answer its requests.

    Args:
        control: the car.
        find: gives the connection for commands of this channel's client: the one at ``port_named``, or with
            ``by_port`` False the only one that has no telemetry channel; None where there is no such.
        count_watchers: gives the number of sessions that the client's telemetry channels have of their own.
        opened, closed: see `ClientProtocol`.

    Attributes:
        port_named: the port of the client's connection for commands, as the client names it.
        commands: that connection, once it is found.
    """

    def __init__(
        self,
        control: CarControl,
        find: "Callable[[TelemetryChannel, bool], CommandChannel | None]",
        count_watchers: Callable[[str], int],
        opened: Callable[[], None],
        closed: Callable[[], None],
    ) -> None:
        super().__init__(opened, closed)
        self.port_named = 0
        self.commands: CommandChannel | None = None
        self._control = control
        self._find = find
        self._count_watchers = count_watchers
        self._session: ControlSession | None = None
        self._reader = FrameReader(MOST_REQUEST_BYTES)
        self._rate = RateLimit(_MOST_REQUESTS_PER_S, 1000)
        self._is_slow = self._is_joining = False
        self._periods = 0

    @property
    def watches_alone(self) -> bool:
        """Whether it has a session that no connection for commands shares."""
        return self._session is not None

    def has_session(self) -> bool:
        """Whether the client drives or watches."""
        return self._shared_session() is not None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to send telemetry."""
        assert isinstance(transport, asyncio.Transport)
        # At most one frame waits here for a slow reader. With a limit of 0 TLS would never report an empty buffer.
        transport.set_write_buffer_limits(1)
        super().connection_made(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """End the channel's own session."""
        if self._session:
            self._session.leave()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """The client reads slowly: send no telemetry."""
        self._is_slow = True

    def resume_writing(self) -> None:
        """The client has read all: send telemetry again."""
        self._is_slow = False

    def data_received(self, data: bytes) -> None:
        """Answer the requests that are whole."""
        self._reader.receive_data(data)
        try:
            while self.line and (text := self._reader.next_frame()) is not None:
                self._answer(text)
        except FrameTooLongError:
            self._refuse(None, DriveError("too-long", most=MOST_REQUEST_BYTES))
            self._hang_up()

    def end_period(self, telemetry: dict[str, Any]) -> None:
        """Send ``telemetry`` at the end of a period, unless the last frame still waits."""
        self._periods += 1
        try:
            self._settle()
        except DriveError as problem:
            self._refuse(None, problem)
            self._hang_up()
            return
        if not self._is_slow:
            self._send({"kind": "telemetry"} | telemetry | {"you": self._you()})

    def _settle(self) -> None:
        """Find the client's connection for commands, or open a session of its own in time. Raises DriveError."""
        if self._has_partner() or self._found(by_port=True) or self._periods < _PERIODS_TO_JOIN:
            return
        if self._found(by_port=False):
            return
        if self._is_joining:
            self._is_joining = False
            self._refuse("join", DriveError("no-such-connection", port=self.port_named))
        self._open_session()

    def _has_partner(self) -> bool:
        if self.commands and self.commands.line is None:
            self.commands = None
        return self.commands is not None

    def _found(self, by_port: bool) -> bool:
        """Look for the client's connection for commands, and share its session where it is found."""
        self.commands = self._find(self, by_port)
        if self.commands and self._session:
            self._session.leave()
            self._session = None
        if self.commands and self._is_joining:
            self._is_joining = False
            self._send({"kind": "answer", "do": "join", "ok": True})
        return self.commands is not None

    def _shared_session(self) -> ControlSession | None:
        return self.commands.session if self.commands else self._session

    def _open_session(self) -> ControlSession:
        """The session by which the client asks. Raises DriveError."""
        if self._has_partner() or self._found(by_port=False):
            assert self.commands
            return self.commands.open_session()
        if self._session is None:
            if self._count_watchers(self.client) >= MOST_WATCHERS:
                raise DriveError("enough-of-you", most=MOST_WATCHERS)
            who = Who(self.client, replaced=self._forget_session)
            self._session = self._control.join(self.name, who, watches=True)
        return self._session

    def _forget_session(self) -> None:
        self._session = None

    def _you(self) -> dict[str, Any] | None:
        session = self._shared_session()
        drives = session is not None and session.drives
        if self.commands:
            clock = session.clock_to_answer() if session else None
            return {"name": self.commands.name, "drives": drives, "clock": clock} | self.commands.counts.as_dict()
        return {"name": session.name, "drives": drives} | session.counts.as_dict() if session else None

    def _answer(self, text: bytes) -> None:
        what: str | None = None
        is_in_rate = self._rate.allows(self._control.now_ms())
        try:
            request = _read_request(text)
            what = str(request["do"])
            # A request that stops is never over the rate.
            if not is_in_rate and what != "stop":
                self._refuse(what, DriveError("too-many-requests", most=_MOST_REQUESTS_PER_S))
                return
            result = self._do(what, request)
        except DriveError as problem:
            self._refuse(what, problem)
            return
        if result is not None:
            self._send({"kind": "answer", "do": what, "ok": True} | result)

    def _do(self, what: str, request: dict[str, Any]) -> dict[str, Any] | None:
        """Do a request. Returns what the answer has beside "ok"; None where it comes later. Raises DriveError."""
        if what == "join":
            self.port_named = request.get("port", 0)
            self.commands = None
            self._periods, self._is_joining = 0, True
            self._found(by_port=True)
            return None
        if what == "stop":
            # It needs no place, so that nobody can keep the others from stopping the car.
            self._control.stop((self.commands or self).name)
            return {}
        session = self._open_session()
        if what == "sync":
            session.answer_clock(*(request.get(name, 0) for name in ("clock", "words", "stamp")))
            return {}
        if what == "request":
            return {"has_wheel": session.request()}
        actions = {
            "release": session.release,
            "clear": session.clear,
            "resume": session.resume_program,
        }
        actions[what]()
        return {}

    def _refuse(self, what: str | None, problem: DriveError) -> None:
        sentences = {language: problem.sentence(language) for language in languages()}
        self._send({"kind": "answer", "do": what, "ok": False, "code": problem.code} | sentences)

    def _send(self, frame: dict[str, Any]) -> None:
        if self.line is None or self.line.is_closing():
            return
        self.line.write(pack_frame(frame))
        if self.line.get_write_buffer_size() > _MOST_WAITING_BYTES:
            self.drop()

    def _hang_up(self) -> None:
        self._control.turn_away()
        if self.line:
            self.line.close()


def _read_request(text: bytes) -> dict[str, Any]:
    """The request in a frame. Raises DriveError."""
    try:
        request = json.loads(text)
    except (ValueError, RecursionError):
        raise DriveError("not-a-request") from None
    if not isinstance(request, dict) or request.get("do") not in REQUESTS:
        raise DriveError("not-a-request")
    if not all(isinstance(request.get(name, 0), int) for name in ("port", "clock", "words", "stamp")):
        raise DriveError("not-a-request")
    return request
