"""What a page's worker calls: requests and streams, without JavaScript, timers and storage of its own.

`web/src/site/worker.ts` owns time and messages. It calls `Shell.answer` for a request. For a stream it calls
`Shell.open`, `Shell.receive` for each message, and `Shell.advance` whenever `Shell.wait_s` is over; each returns what
is to be sent to the page, in order: texts are JSON, bytes are pictures or for a serial port.
"""

import os
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import msgspec

from motorcade.browser.storage import BrowserStorage
from motorcade.browser.virtual_car import VIRTUAL_PORT, VirtualUpload
from motorcade.errors import MotorcadeError
from motorcade.missions.check import Play
from motorcade.service.messages import Capabilities, Port, decode
from motorcade.service.programs import error_answer
from motorcade.service.requests import Context, respond
from motorcade.service.studio_world import StudioWorld
from motorcade.service.upload_session import UploadSession, failed
from motorcade.service.world_messages import SetWorld, UploadOrder, WorldMessage
from motorcade.service.world_session import WorldSession, refused

CAPABILITIES = Capabilities(
    serial_ports=False,
    downloads=False,
    films=False,
    driving=False,
    real_cars=False,
    most_cars=2_000,
)

Sent = list[str | bytes]


@dataclass(frozen=True, slots=True)
class Parts:
    """What a shell is made of.

    Attributes:
        storage: where projects are stored, and what the virtual car holds.
        make_world: builds a page's world. Raises MotorcadeError.
        play: simulates missions.
        clock: seconds since any moment.
    """

    storage: BrowserStorage
    make_world: Callable[[SetWorld], StudioWorld]
    clock: Callable[[], float]
    play: Play | None = None


class JavaScriptBytes(Protocol):
    """An array of bytes of JavaScript's, as Pyodide passes it."""

    def to_bytes(self) -> bytes:
        """Return its bytes."""


class Stream(Protocol):
    """One stream of the page."""

    def receive(self, data: str | bytes) -> list[Any]:
        """Take a message; return what is to be sent. Raises MotorcadeError."""

    def advance(self) -> list[Any]:
        """Do what is due; return what is to be sent."""

    def wait_s(self) -> float | None:
        """After how many seconds `advance` is to be called; None: not before the next message."""

    def refuse(self, problem: MotorcadeError) -> Any:
        """The message that tells the page an error."""


class Shell:
    """Answers one page."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self.storage = parts.storage
        self._context = Context(CAPABILITIES, parts.storage, _ports, play=parts.play)
        self._streams: dict[int, Stream] = {}
        self._worlds: dict[str, WorldSession] = {}

    def answer(self, name: str, message: str) -> str:
        """Answer a request: JSON with ``answer``, or with ``error`` where it is refused."""
        try:
            return f'{{"answer":{respond(name, message.encode(), self._context).decode()}}}'
        except Exception as problem:  # noqa: BLE001 - the page is told, whatever it is
            error = error_answer(_known(problem))
            return f'{{"error":{msgspec.json.encode(error).decode()}}}'

    def open(self, number: int, name: str, session: str) -> Sent:
        """Open the stream ``name``, world, upload or serial; the page calls it ``number``."""
        if name != "world":
            car = self.storage if name == "upload" else None
            self._streams[number] = _UploadStream(self._parts.clock, car)
            return []
        world = self._worlds.get(session) or WorldSession(session, self._parts.make_world)
        self._worlds[session] = world
        self._streams[number] = _WorldStream(world, self._parts.clock)
        return _packed(world.connect())

    def receive(self, number: int, data: "str | bytes | JavaScriptBytes") -> Sent:
        """Take a message of the page."""
        message = data if isinstance(data, str | bytes) else data.to_bytes()
        return self._do(number, lambda stream: stream.receive(message))

    def advance(self, number: int) -> Sent:
        """Do what is due."""
        return self._do(number, lambda stream: stream.advance())

    def wait_s(self, number: int) -> float:
        """After how many seconds `advance` is to be called; negative: not before the next message."""
        stream = self._streams.get(number)
        wait_s = stream.wait_s() if stream else None
        return -1 if wait_s is None else wait_s

    def close(self, number: int) -> None:
        """The page has closed a stream; a world stays for the page's next one."""
        self._streams.pop(number, None)

    def _do(self, number: int, work: Callable[[Stream], list[Any]]) -> Sent:
        stream = self._streams.get(number)
        if stream is None:
            return []
        try:
            return _packed(work(stream))
        except Exception as problem:  # noqa: BLE001 - the page is told, whatever it is
            return _packed([stream.refuse(_known(problem))])


class _WorldStream:
    """A world in play."""

    def __init__(self, session: WorldSession, clock: Callable[[], float]) -> None:
        self._session = session
        self._clock = clock

    def receive(self, data: str | bytes) -> list[Any]:
        return list(self._session.receive(_decoded(data, WorldMessage)))

    def advance(self) -> list[Any]:
        now_s = self._clock()
        answers = self._session.advance(now_s)
        self._session.adapt_to(self._clock() - now_s)
        return list(answers)

    def wait_s(self) -> float | None:
        return self._session.wait_s(self._clock())

    def refuse(self, problem: MotorcadeError) -> Any:
        return refused(problem)


class _UploadStream:
    """A transfer: the order first, then the bytes of a port that the page has opened.

    Args:
        clock: seconds since any moment.
        car: what the virtual car holds, where the transfer is with it; None for a port of the page.
    """

    def __init__(self, clock: Callable[[], float], car: BrowserStorage | None) -> None:
        self._clock = clock
        self._car = car
        self._session: UploadSession | VirtualUpload | None = None
        self._is_over = False

    def receive(self, data: str | bytes) -> list[Any]:
        if self._is_over:
            return []
        if self._session is None:
            self._session = self._begun(_decoded(data, UploadOrder))
        else:
            # A text isn't for the port: the page is faulty.
            self._session.receive(data if isinstance(data, bytes) else None)
        return self.advance()

    def _begun(self, order: UploadOrder) -> UploadSession | VirtualUpload:
        number = os.urandom(1)[0]
        if self._car is None:
            return UploadSession(order, number)
        if order.port != VIRTUAL_PORT.port:
            raise MotorcadeError("no-such-port", port=order.port)
        return VirtualUpload(order, number, self._car)

    def advance(self) -> list[Any]:
        if self._session is None:
            return []
        answers = self._session.advance(self._clock())
        self._is_over = self._session.is_over
        return list(answers)

    def wait_s(self) -> float | None:
        return None if self._session is None or self._is_over else self._session.wait_s

    def refuse(self, problem: MotorcadeError) -> Any:
        self._is_over = True
        return failed(problem)


def _ports() -> list[Port]:
    return [VIRTUAL_PORT]


def _known(problem: Exception) -> MotorcadeError:
    """The error that the page is told; the console tells of one that isn't a MotorcadeError."""
    if isinstance(problem, MotorcadeError):
        return problem
    traceback.print_exception(problem)
    return MotorcadeError("browser-fault")


def _decoded(data: str | bytes, kind: Any) -> Any:
    if not isinstance(data, str):
        raise MotorcadeError("bad-message", reason="it is no text")
    return decode(data, kind)


def _packed(answers: list[Any]) -> Sent:
    return [each if isinstance(each, bytes) else msgspec.json.encode(each).decode() for each in answers]
