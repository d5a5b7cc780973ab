"""The car's end of its connections: one that brings commands, and one for telemetry and requests.

A car without keys takes bytes from everybody, and a command is any four of them that fit. So a connection is believed
once its first two words are commands, or once the first is followed by 50 ms without a byte; until then nothing moves.
What is no command ends the connection, at its beginning and later: what stands beside it is not a driver's either.
`motorcade.drive.strangers` says on the car's console who it was.
"""

import asyncio
from collections.abc import Callable
from typing import Any

from motorcade.drive.keys import RevokedKeys, peer_name, peer_number
from motorcade.drive.motors import check_commands
from motorcade.drive.session import CarControl, ControlSession
from motorcade.drive.strangers import Refusals, may_begin, who_speaks
from motorcade.drive.wire import (
    MOST_REQUEST_BYTES,
    OUTCOMES,
    WORDS,
    DriveRequest,
    SessionError,
    newest_of_each_code,
    pack_frame,
    read_request,
    take_frames,
)
from motorcade.errors import Phrase
from motorcade.locales import languages
from motorcade.timing import RateLimit
from motorcade.words.field import WordError

PERIOD_S = 0.1
# More than the system keeps of a connection (`motorcade.drive.listener`; Linux: at most 16 KiB), so that no newer
# command lies behind a full buffer.
_BUFFER_BYTES = 1 << 15
# A first command that nothing follows is believed after so long.
BELIEVED_S = 0.05
_BELIEVED_WORDS = 2
# A client is told on the car's console what becomes of its commands, by the outcome; after how many of them. Stamped
# ones are old until the client has answered the car's clock, which takes a second at most.
_TOLD_AT = {"watching": 1, "needs-neutral": 1, "stopped": 1, "discharged": 1, "over-rate": 1, "no-hardware": 1}
_TOLD_AT["stale"] = 50
_MOST_REQUESTS_PER_S = 20
# A client has so many periods to name the connection that its telemetry channel belongs to.
_PERIODS_TO_JOIN = 10
# So that one client's connections don't take all places.
MOST_WATCHERS = 4
# A client that asks and doesn't read is dropped when more bytes wait for it.
_MOST_WAITING_BYTES = 1 << 14


class Clients:
    """The open connections of a car's clients.

    Args:
        control: the car.
        byte_order: of a command, "big" or "little".
        revoked: keys that are refused.

    Attributes:
        commands: the connections for commands, the oldest first.
        channels: those for telemetry.
        has_channels: set while there is one for telemetry, or there was.
        refusals: says on the console which clients are refused.
        later: calls something after so many seconds; what it returns can be cancelled.
    """

    def __init__(self, control: CarControl, byte_order: str = "big", revoked: RevokedKeys | None = None) -> None:
        self.control = control
        self.byte_order = byte_order
        self.revoked = revoked
        self.commands: list[CommandChannel] = []
        self.channels: list[TelemetryChannel] = []
        self.has_channels = asyncio.Event()
        self.refusals = Refusals(control.clock)
        self.later: Callable[[float, Callable[[], None]], asyncio.TimerHandle] = lambda seconds, call: (
            asyncio.get_running_loop().call_later(seconds, call)
        )


class Channel(asyncio.BaseProtocol):
    """A connection of a client, as a `motorcade.drive.listener.Listener` accepts it.

    Args:
        clients: of the car.
        closed: called when the connection is lost.

    Attributes:
        line: the transport; None before the connection is made and after it is lost.
        client: the name in the client's certificate, or the address that it comes from.
        port: the port that it comes from.
        own: its own session.
        commands: where this one is for telemetry, the client's connection for commands, once it is found; both then
            share its session.
    """

    holder = ""
    stays = False
    # Whether its session won't drive.
    watches = False
    own: ControlSession
    commands: "CommandChannel | None" = None

    def __init__(self, clients: Clients, closed: Callable[[], None]) -> None:
        self.clients = clients
        self.control = clients.control
        self.line: asyncio.Transport | None = None
        self.client = ""
        self.port = 0
        self._alike: list[Any] = clients.channels if self.watches else clients.commands
        self._keys_number: int | None = None
        self._closed = closed

    @property
    def session(self) -> ControlSession:
        """The client's session."""
        if self.commands:
            return self.commands.own
        return self.own

    def has_session(self) -> bool:
        """Whether the client drives or watches."""
        return self.line is not None and self.session.has_place

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Find out who the client is, and make its session, which has no place yet."""
        self._alike.append(self)
        self.line = transport  # type: ignore[assignment]
        address = transport.get_extra_info("peername") or ("?", 0)
        line = transport.get_extra_info("ssl_object")
        self.client = peer_name(line) or str(address[0])
        self.port = int(address[1])
        self._keys_number = peer_number(line)
        name = f"{self.client}:{self.port}"
        # A watcher that has lost its place to a newcomer goes on watching without one.
        replaced = (lambda: None) if self.watches else self._hang_up
        self.own = ControlSession(self.control, name, self.client, watches=self.watches, replaced=replaced)
        self.check_keys()

    def connection_lost(self, exc: Exception | None) -> None:
        """End the session: the wheels stand still if it moved them."""
        self._alike.remove(self)
        self.line = None
        self.own.leave()
        self._closed()

    def check_keys(self) -> None:
        """Hang up a client whose keys are revoked."""
        if self.clients.revoked and self._keys_number in self.clients.revoked:
            self._hang_up()

    def drop(self) -> None:
        """End the connection at once, if it has begun."""
        if self.line:
            self.line.abort()

    def _hang_up(self, why: Phrase | None = None) -> None:
        """End the connection, and say ``why`` on the console."""
        self.control.turned_away += 1
        if why:
            self._tell(why)
        self.drop()

    def _tell(self, why: Phrase) -> None:
        self.clients.refusals.tell(self.client, self.own.name, why)


class CommandChannel(Channel, asyncio.BufferedProtocol):
    """Take one client's commands; nothing is sent back. Arguments as of `Channel`."""

    def __init__(self, clients: Clients, closed: Callable[[], None]) -> None:
        super().__init__(clients, closed)
        self._word = WORDS[clients.byte_order]
        # What is not obeyed yet: part of a command, or all while the client isn't believed.
        self._rest = b""
        self._buffer = memoryview(bytearray(_BUFFER_BYTES))
        self._received = 0
        self._is_believed = False
        self._believing: asyncio.TimerHandle | None = None

    def connection_lost(self, exc: Exception | None) -> None:
        """End the session."""
        self._wait_no_longer()
        if not self._is_believed and len(self._rest) >= self._word.size:
            self._tell(Phrase("stranger-leaves"))
        super().connection_lost(exc)

    def get_buffer(self, sizehint: int) -> memoryview:
        """Where the next bytes go."""
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Obey what has come, unless the client isn't believed yet."""
        self._wait_no_longer()
        had_command = len(self._rest) >= self._word.size
        self._rest += self._buffer[:nbytes]
        whole = len(self._rest) // self._word.size
        words = [word for (word,) in self._word.iter_unpack(self._rest[: whole * self._word.size])]
        if not self._are_commands(words):
            return
        if self._is_believed or whole >= _BELIEVED_WORDS:
            if had_command:
                # It came before the others, so they don't supersede it: it may have armed the car.
                self._obey(words[:1])
                words = words[1:]
            self._obey(words)
        elif len(self._rest) == self._word.size:
            self._believing = self.clients.later(BELIEVED_S, lambda: self._believe(words))

    def _believe(self, words: list[int]) -> None:
        try:
            self._obey(words)
        except Exception:
            # As the loop does where bytes that have come end in an error.
            self.drop()
            raise

    def _wait_no_longer(self) -> None:
        if self._believing:
            self._believing.cancel()
            self._believing = None

    def _are_commands(self, words: list[int]) -> bool:
        """Whether a driver sends this. Hang up and return False where somebody else does."""
        problem = None
        try:
            check_commands(words)
            if self._is_believed or not words or may_begin(words[:_BELIEVED_WORDS]):
                return True
        except WordError as found:
            problem = found
            self.own.refuse(problem)
        if self._is_believed and problem:
            why = Phrase("client-sends-other", reason=problem)
        else:
            why = who_speaks(self._rest, self.clients.byte_order, problem)
        self._rest = b""
        self._hang_up(why)
        return False

    def _obey(self, words: list[int]) -> None:
        """Obey the newest command of each code."""
        self._is_believed = True
        self._rest = self._rest[len(words) * self._word.size :]
        before = self._received
        self._received = self._received + len(words)
        newest = newest_of_each_code(words)
        self.own.counts["superseded"] += len(words) - len(newest)
        for index in newest:
            try:
                outcome = OUTCOMES[self.own.command(words[index], before + index + 1)]
            except SessionError as problem:
                self._hang_up(Phrase("client-without-place", reason=problem))
                return
            if self.own.counts[outcome] == _TOLD_AT.get(outcome):
                self._tell(Phrase(f"client-{outcome}"))


class TelemetryChannel(Channel, asyncio.Protocol):
    """Send telemetry to one client, and answer its requests. Arguments as of `Channel`."""

    watches = True

    def __init__(self, clients: Clients, closed: Callable[[], None]) -> None:
        super().__init__(clients, closed)
        # Of the client's connection for commands, as the client names it.
        self._port_named = 0
        self._received = bytearray()
        self._rate = RateLimit(_MOST_REQUESTS_PER_S, 1000)
        self._is_slow = self._is_joining = False
        # Requests that wait until the connection is found; the rate bounds their number.
        self._held: list[DriveRequest] = []
        self._periods = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to send telemetry."""
        assert isinstance(transport, asyncio.Transport)
        # At most one frame waits here for a slow reader. With a limit of 0 TLS would never report an empty buffer.
        transport.set_write_buffer_limits(1)
        self.clients.has_channels.set()
        super().connection_made(transport)
        # A client sends nothing before it knows by this that the car takes no keys.
        self._send_telemetry(self.control.telemetry()._asdict())

    def pause_writing(self) -> None:
        """Send no telemetry: the client reads slowly."""
        self._is_slow = True

    def resume_writing(self) -> None:
        """Send telemetry again: the client has read all."""
        self._is_slow = False

    def data_received(self, data: bytes) -> None:
        """Answer the requests that are whole."""
        self._received += data
        try:
            for text in take_frames(self._received, MOST_REQUEST_BYTES):
                self._take(text)
                if self.line is None:
                    return
        except SessionError as problem:
            self._tell(who_speaks(bytes(self._received), self.clients.byte_order, problem))
            self._close(problem)

    def end_period(self, telemetry: dict[str, Any]) -> None:
        """Send ``telemetry`` at the end of a period, unless the last frame still waits."""
        self._periods += 1
        try:
            self._settle()
        except SessionError as problem:
            self._close(problem)
            return
        self._send_telemetry(telemetry)

    def _send_telemetry(self, telemetry: dict[str, Any]) -> None:
        if not self._is_slow:
            self._send({"kind": "telemetry"} | telemetry | {"you": self._you()})

    def _settle(self) -> None:
        """Find the client's connection for commands, or take a place of its own in time. Raises SessionError."""
        if self._has_partner() or self._found(by_port=True) or self._periods < _PERIODS_TO_JOIN:
            return
        if self._found(by_port=False):
            return
        if self._is_joining:
            self._end_join(_refusal(SessionError("no-such-connection", port=self._port_named)))
        self._take_place()

    def _has_partner(self) -> bool:
        if self.commands and self.commands.line is None:
            self.commands = None
        return self.commands is not None

    def _found(self, by_port: bool) -> bool:
        """Look for the client's connection for commands, and share its session where it is found.

        It is the one at the port that the client names, or the only one that has no telemetry channel.
        """
        channels = self.clients.channels
        found = [commands for commands in self.clients.commands if commands.client == self.client]
        if by_port:
            found = [commands for commands in found if commands.port == self._port_named][:1]
        else:
            taken = [channel.commands for channel in channels]
            found = [commands for commands in found if commands not in taken]
        if len(found) != 1:
            self.commands = None
            return False
        for other in channels:
            if other.commands is found[0]:
                other.commands = None
        self.commands = found[0]
        self.control.end(self.own)
        if self._is_joining:
            self._end_join({"ok": True})
        return True

    def _end_join(self, answer: dict[str, Any]) -> None:
        """Answer that the connection was found, or not in time, and then the requests that have waited for it."""
        self._is_joining = False
        self._send({"kind": "answer", "do": "join"} | answer)
        held = self._held
        self._held = []
        for request in held:
            self._answer(request)

    def _take_place(self) -> None:
        """Take a place for the session by which the client asks, unless it has one. Raises SessionError."""
        if not (self._has_partner() or self._found(by_port=False) or self.own.has_place):
            watching = [
                channel for channel in self.clients.channels if channel.own.has_place and channel.client == self.client
            ]
            if len(watching) >= MOST_WATCHERS:
                raise SessionError("enough-of-you", most=MOST_WATCHERS)
        self.session.take_place()

    def _you(self) -> dict[str, Any] | None:
        if self.commands:
            return self.session.you() | {"clock": self.session.clock_to_answer()}
        if self.own.has_place:
            return self.own.you()
        return None

    def _take(self, text: bytes) -> None:
        """Answer a request, or let it wait for the client's connection for commands."""
        is_in_rate = self._rate.allows(self.control.clock())
        try:
            request = read_request(text)
        except SessionError as problem:
            self._refuse(None, problem)
            return
        # A stop needs no place and is never over the rate, so that nobody can keep the others from stopping the car.
        if request.do != "stop" and not is_in_rate:
            self._refuse(request.do, SessionError("too-many-requests", most=_MOST_REQUESTS_PER_S))
        elif self._is_joining and request.do not in ("join", "stop"):
            self._held.append(request)
        else:
            self._answer(request)

    def _answer(self, request: DriveRequest) -> None:
        try:
            result = self._do(request)
        except SessionError as problem:
            self._refuse(request.do, problem)
            return
        if result is not None:
            self._send({"kind": "answer", "do": request.do, "ok": True} | result)

    def _do(self, request: DriveRequest) -> dict[str, Any] | None:
        """Do a request. Returns what the answer has beside "ok"; None where it comes later. Raises SessionError."""
        if request.do == "stop":
            self.session.stop()
            return {}
        if request.do == "join":
            self._port_named = request.port
            self._periods = 0
            self._is_joining = True
            self._found(by_port=True)
            return None
        self._take_place()
        session = self.session
        if request.do == "request":
            return {"has_wheel": session.request()}
        if request.do == "sync":
            session.answer_clock(request.clock, request.words, request.stamp)
        else:
            {"release": session.release, "clear": session.clear, "resume": session.resume_program}[request.do]()
        return {}

    def _refuse(self, what: str | None, problem: SessionError) -> None:
        self._send({"kind": "answer", "do": what} | _refusal(problem))

    def _send(self, frame: dict[str, Any]) -> None:
        if self.line is None or self.line.is_closing():
            return
        self.line.write(pack_frame(frame))
        if self.line.get_write_buffer_size() > _MOST_WAITING_BYTES:
            self.drop()

    def _close(self, problem: SessionError) -> None:
        """Say why, and hang up when that has left."""
        self._refuse(None, problem)
        self.control.turned_away += 1
        if self.line:
            self.line.close()


def _refusal(problem: SessionError) -> dict[str, Any]:
    sentences = {language: problem.sentence(language) for language in languages()}
    return {"ok": False, "code": problem.code} | sentences
