"""What a page's worker calls: requests and streams, without JavaScript, timers and storage of its own.

`web/src/site/worker.ts` owns time and messages. It calls `Shell.answer` for a request. For a stream it calls
`Shell.open`, `Shell.receive` for each message, and `Shell.advance` whenever `Shell.wait_s` is over; each returns what
is to be sent to the page, in order: texts are JSON, bytes are pictures or for a serial port.
"""

import time
import traceback
from collections.abc import Callable
from typing import Any, Protocol

import msgspec

from motorcade.browser.kernels import OpenInstance, make_world, open_worlds
from motorcade.browser.storage import BrowserStorage
from motorcade.browser.uploads import VIRTUAL_PORT, UploadStream
from motorcade.errors import MotorcadeError
from motorcade.missions.check import open_worlds_here
from motorcade.missions.odds import OpenWorlds
from motorcade.service.messages import Capabilities, decode
from motorcade.service.programs import error_answer
from motorcade.service.requests import Context, respond
from motorcade.service.studio_world import StudioWorld
from motorcade.service.trial_messages import TrialMessage
from motorcade.service.trials import TrialSession
from motorcade.service.world_messages import SetWorld, WorldMessage
from motorcade.service.world_session import WorldSession, refused

CAPABILITIES = Capabilities(
    serial_ports=False,
    downloads=False,
    driving=False,
    real_cars=False,
    most_cars=2_000,
)

Sent = list[str | bytes]


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


def start(open_instance: OpenInstance) -> "Shell":
    """Return the shell of this worker, in which each world has an instance of engine.wasm of its own."""

    def make(message: SetWorld) -> StudioWorld:
        return make_world(message, open_instance, CAPABILITIES.most_cars)

    return Shell(BrowserStorage(), make, time.perf_counter, open_worlds(open_instance))


class Shell:
    """Answer one page.

    Args:
        storage: where projects are stored, and what the virtual car holds.
        make_world: builds a page's world. Raises MotorcadeError.
        clock: seconds since any moment.
        open_worlds: opens the worlds of missions.
    """

    def __init__(
        self,
        storage: BrowserStorage,
        make_world: Callable[[SetWorld], StudioWorld],
        clock: Callable[[], float],
        open_worlds: OpenWorlds = open_worlds_here,
    ) -> None:
        self.storage = storage
        self._make_world = make_world
        self._clock = clock
        self._open_worlds = open_worlds
        self._context = Context(CAPABILITIES, storage, lambda: [VIRTUAL_PORT], open_worlds=open_worlds)
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
        """Open the stream ``name``, world, trials, upload or serial; the page calls it ``number``."""
        if name == "trials":
            self._streams[number] = _TrialStream(
                TrialSession(self._make_world, CAPABILITIES.most_cars, self._open_worlds)
            )
            return []
        if name != "world":
            car = self.storage if name == "upload" else None
            self._streams[number] = UploadStream(self._clock, car)
            return []
        world = self._worlds.get(session) or WorldSession(session, self._make_world)
        self._worlds[session] = world
        self._streams[number] = _WorldStream(world, self._clock)
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


class _TrialStream:
    """Trials of the page's program."""

    def __init__(self, session: TrialSession) -> None:
        self._session = session

    def receive(self, data: str | bytes) -> list[Any]:
        kind: Any = TrialMessage
        return list(self._session.receive(decode(data, kind)))

    def advance(self) -> list[Any]:
        return list(self._session.advance())

    def wait_s(self) -> float | None:
        return 0.0 if self._session.is_busy else None

    def refuse(self, problem: MotorcadeError) -> Any:
        return refused(problem)


class _WorldStream:
    """A world in play."""

    def __init__(self, session: WorldSession, clock: Callable[[], float]) -> None:
        self._session = session
        self._clock = clock

    def receive(self, data: str | bytes) -> list[Any]:
        kind: Any = WorldMessage
        return list(self._session.receive(decode(data, kind)))

    def advance(self) -> list[Any]:
        now_s = self._clock()
        answers = self._session.advance(now_s)
        self._session.adapt_to(self._clock() - now_s)
        return list(answers)

    def wait_s(self) -> float | None:
        return self._session.wait_s(self._clock())

    def refuse(self, problem: MotorcadeError) -> Any:
        return refused(problem)


def _known(problem: Exception) -> MotorcadeError:
    """The error that the page is told; the console tells of one that isn't a MotorcadeError."""
    if isinstance(problem, MotorcadeError):
        return problem
    traceback.print_exception(problem)
    return MotorcadeError("browser-fault")


def _packed(answers: list[Any]) -> Sent:
    return [each if isinstance(each, bytes) else msgspec.json.encode(each).decode() for each in answers]
