"""What a page's worker calls: requests and streams, without JavaScript, timers and storage of its own.

`web/src/site/worker.ts` owns time and messages. It calls `Shell.answer` for a request. For a stream it calls
`Shell.open`, `Shell.receive` for each message, and `Shell.advance` whenever `Shell.wait_s` is over; each returns what
is to be sent to the page, in order: texts are JSON, bytes are pictures or for a serial port.
"""

import os
import time
import traceback
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec

from motorcade.browser.kernels import OpenInstance, View, open_worlds
from motorcade.browser.storage import BrowserStorage
from motorcade.errors import MotorcadeError, TransferError
from motorcade.missions.check import open_worlds_here
from motorcade.missions.odds import OpenWorlds
from motorcade.service.messages import Capabilities, decode
from motorcade.service.programs import error_answer
from motorcade.service.requests import Context, respond
from motorcade.service.studio_world import open_world
from motorcade.service.trials import TrialMessage, TrialSession
from motorcade.service.upload_session import VIRTUAL_PORT, UploadSession, VirtualCarSession, failed
from motorcade.service.world_messages import UploadOrder, WorldMessage
from motorcade.service.world_session import WorldSession, refused

CAPABILITIES = Capabilities(
    serial_ports=False,
    downloads=False,
    driving=False,
    most_cars=2_000,
)
Sent = list[str | bytes]


class UploadStream:
    """One transfer: the order first, then the bytes of a port that the page has opened.

    Args:
        clock: seconds since any moment.
        storage: what the virtual car holds, where the transfer is with that car; None for a port of the page.
    """

    def __init__(self, clock: Callable[[], float], storage: BrowserStorage | None) -> None:
        self._clock = clock
        self._storage = storage
        self._session: UploadSession | None = None

    def receive(self, data: str | bytes) -> list[Any]:
        """Take the order, or bytes of the port; return what is to be sent. Raises MotorcadeError."""
        if self._session is None:
            self._session = self._begun(decode(data, UploadOrder))
        else:
            # A text isn't for the port: the page is faulty.
            self._session.receive(data if isinstance(data, bytes) else None)
        return self.advance()

    def _begun(self, order: UploadOrder) -> UploadSession:
        number, storage = os.urandom(1)[0], self._storage
        if storage is None:
            return UploadSession(order, number)
        if order.port != VIRTUAL_PORT.port:
            raise TransferError("no-such-port", port=order.port)
        return VirtualCarSession(order, number, storage.car_image, storage.store_car_image)

    def advance(self) -> list[Any]:
        """Do what is due; return what is to be sent."""
        if self._session:
            return self._session.advance(self._clock())
        return []

    def wait_s(self) -> float | None:
        """After how many seconds `advance` is to be called; None: not before the next message."""
        if self._session and not self._session.is_over:
            return self._session.wait_s
        return None


class _SessionStream:
    """A world in play, or trials of the page's program."""

    def __init__(self, session: WorldSession | TrialSession, clock: Callable[[], float]) -> None:
        self._session = session
        self._clock = clock

    def receive(self, data: str | bytes) -> list[Any]:
        kind: Any = WorldMessage if isinstance(self._session, WorldSession) else TrialMessage
        return list(self._session.receive(decode(data, kind)))

    def advance(self) -> list[Any]:
        if isinstance(self._session, TrialSession):
            return list(self._session.advance())
        now_s = self._clock()
        answers = self._session.advance(now_s)
        self._session.adapt_to(self._clock() - now_s)
        return list(answers)

    def wait_s(self) -> float | None:
        if isinstance(self._session, TrialSession):
            if self._session.is_busy:
                return 0.0
            return None
        return self._session.wait_s(self._clock())


Stream = UploadStream | _SessionStream


def start(open_instance: OpenInstance) -> "Shell":
    """Return the shell of this worker, in which each world has an instance of engine.wasm of its own."""
    return Shell(BrowserStorage(), time.perf_counter, open_worlds(open_instance))


class Shell:
    """Answer one page.

    Args:
        storage: where projects are stored, and what the virtual car holds.
        clock: seconds since any moment.
        open_worlds: opens all worlds.
    """

    def __init__(
        self, storage: BrowserStorage, clock: Callable[[], float], open_worlds: OpenWorlds = open_worlds_here
    ) -> None:
        self.storage = storage
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
            return _error(_known(problem))

    def refuse(self, why: str) -> str:
        """Return the answer to a request whose changes the browser's store refuses: full, newer or damaged says why."""
        return _error(MotorcadeError(f"browser-store-{why}"))

    def open(self, number: int, name: str, session: str) -> Sent:
        """Open the stream ``name``, world, trials, upload or serial; the page calls it ``number``."""
        if name == "trials":
            trials = TrialSession(CAPABILITIES.most_cars, self._open_worlds)
            self._streams[number] = _SessionStream(trials, self._clock)
            return []
        if name != "world":
            car = None
            if name == "upload":
                car = self.storage
            self._streams[number] = UploadStream(self._clock, car)
            return []
        make_world = partial(open_world, most_cars=CAPABILITIES.most_cars, open_worlds=self._open_worlds)
        world = self._worlds.get(session) or WorldSession(session, make_world)
        self._worlds[session] = world
        self._streams[number] = _SessionStream(world, self._clock)
        return _packed(world.connect())

    def receive(self, number: int, data: str | bytes | View) -> Sent:
        """Take a message of the page."""
        if isinstance(data, str | bytes):
            message = data
        else:
            message = data.to_bytes()
        return self._do(number, lambda stream: stream.receive(message))

    def advance(self, number: int) -> Sent:
        """Do what is due."""
        return self._do(number, lambda stream: stream.advance())

    def wait_s(self, number: int) -> float:
        """After how many seconds `advance` is to be called; negative: not before the next message."""
        stream = self._streams.get(number)
        wait_s = None
        if stream:
            wait_s = stream.wait_s()
        if wait_s is None:
            return -1
        return wait_s

    def close(self, number: int) -> None:
        """Forget a stream that the page has closed; a world stays for the page's next one."""
        self._streams.pop(number, None)

    def _do(self, number: int, work: Callable[[Stream], list[Any]]) -> Sent:
        stream = self._streams.get(number)
        if stream is None:
            return []
        try:
            return _packed(work(stream))
        except Exception as problem:  # noqa: BLE001 - the page is told, whatever it is
            if isinstance(stream, UploadStream):
                # It ends a transfer.
                self.close(number)
                return _packed([failed(_known(problem))])
            return _packed([refused(_known(problem))])


def _error(problem: MotorcadeError) -> str:
    return f'{{"error":{msgspec.json.encode(error_answer(problem)).decode()}}}'


def _known(problem: Exception) -> MotorcadeError:
    """The error that the page is told; the console tells of one that isn't a MotorcadeError."""
    if isinstance(problem, MotorcadeError):
        return problem
    traceback.print_exception(problem)
    return MotorcadeError("browser-fault")


def _packed(answers: list[Any]) -> Sent:
    return [answer if isinstance(answer, bytes) else msgspec.json.encode(answer).decode() for answer in answers]
