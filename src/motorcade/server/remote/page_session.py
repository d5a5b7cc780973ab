"""One page of the remote: the messages that it sends, and its connections to cars."""

import asyncio
from collections import deque
from collections.abc import Coroutine
from contextlib import suppress
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.errors import MotorcadeError
from motorcade.server.http import next_message, until_one_ends
from motorcade.server.remote.fleet import MOST_CARS, Action, Fleet, PageControl
from motorcade.server.request_filter import ServerSettings
from motorcade.timing import to_ticks

_TELEMETRY_EVERY_S = 0.1
_MOST_WAITING = 32
_POLICY_VIOLATION = 1008

Name = Annotated[str, Meta(max_length=40)]
Axis = Annotated[float, Meta(ge=-1, le=1)]


class _Message(Struct, tag_field="do", tag=str.lower, forbid_unknown_fields=True):
    pass


class Join(_Message):
    """Connect to a car, to watch or to drive."""

    car: Name


class Leave(_Message):
    """End the connection to a car."""

    car: Name


class DriveMessage(_Message, tag="drive"):
    """Where the stick is now, for all of these cars.

    Attributes:
        throttle: -1 full speed back to 1 full speed ahead.
        steering: -1 full left to 1 full right.
        number: the page's own count; the answer ``heard`` has it.
    """

    cars: Annotated[list[Name], Meta(max_length=16)]
    throttle: Axis
    steering: Axis
    number: Annotated[int, Meta(ge=0, lt=1 << 53)] = 0


class Request(_Message):
    """Ask to drive."""

    car: Name


class Release(_Message):
    """Stop driving, or stop waiting to drive."""

    car: Name


class Stop(_Message):
    """Emergency stop of all of these cars."""

    cars: Annotated[list[Name], Meta(max_length=16)]


class Clear(_Message):
    """Lift the emergency stop."""

    car: Name


class Resume(_Message):
    """Give the car back to its own program."""

    car: Name


class Start(_Message):
    """Have the cars' world go on where it stands still."""


_ACTIONS: dict[type[_Message], Action] = {
    Request: "request",
    Release: "release",
    Clear: "clear",
    Resume: "resume_program",
}
Message = Join | Leave | DriveMessage | Request | Release | Stop | Clear | Resume | Start


class PageSession:
    """Serve one WebSocket.

    Args:
        socket: accepted.
        fleet: the cars.
        name: the page's name at them.
        settings: how fast it may send.
    """

    def __init__(self, socket: WebSocket, fleet: Fleet, name: str, settings: ServerSettings) -> None:
        self._socket = socket
        self._fleet = fleet
        self._name = name
        self._settings = settings
        self._controls: dict[str, PageControl] = {}
        # Questions to cars, which may take a moment to answer; none holds up another, or the page.
        self._questions: set[asyncio.Task[None]] = set()
        self._stick: DriveMessage | None = None
        self._moved = asyncio.Event()
        self._newest: dict[str, dict[str, Any]] = {}
        self._others: deque[dict[str, Any]] = deque(maxlen=_MOST_WAITING)
        self._changed = asyncio.Event()

    async def serve(self) -> None:
        """Serve until the page leaves; the cars that it drove stand still then."""
        try:
            await until_one_ends((self._listen, self._steer, self._send_telemetry, self._send))
        finally:
            controls, self._controls = self._controls, {}
            for control in controls.values():
                control.leave()
            for question in self._questions:
                question.cancel()

    async def _listen(self) -> None:
        try:
            await self._greet()
        except MotorcadeError as problem:
            self._refuse(problem)
        rate = self._settings.message_rate()
        while True:
            try:
                message: Message = await next_message(self._socket, Message, self._settings.most_body)  # type: ignore[arg-type]  # a union
                await self._obey(message)
            except MotorcadeError as problem:
                self._refuse(problem)
            if not rate.allows(to_ticks(self._settings.clock())):
                await self._socket.close(_POLICY_VIOLATION)
                return

    async def _obey(self, message: Message) -> None:
        match message:
            case DriveMessage():
                self._stick = message
                self._moved.set()
            case Stop():
                self._stop(message.cars)
            case Join():
                await self._join(message.car)
            case Leave():
                if message.car in self._controls:
                    self._controls.pop(message.car).leave()
            case Request() | Release() | Clear() | Resume():
                self._ask(self._control(message.car).act(_ACTIONS[type(message)]))
            case Start():
                await self._fleet.start()
                await self._greet()

    async def _greet(self) -> None:
        cars = [each._asdict() for each in await self._fleet.listed()]
        self._put("hello", {"cars": cars, "you": self._name})

    async def _join(self, name: str) -> None:
        if name in self._controls:
            return
        if len(self._controls) >= MOST_CARS:
            raise MotorcadeError("at-too-many-cars", most=MOST_CARS)
        self._controls[name] = await self._fleet.connect(name, self._name)

    def _stop(self, names: list[str]) -> None:
        """Stop all cars to which the page is connected; only then refuse the others."""
        for name in names:
            if name in self._controls:
                self._ask(self._controls[name].act("stop"))
        for name in names:
            self._control(name)

    def _control(self, name: str) -> PageControl:
        if name not in self._controls:
            raise MotorcadeError("not-at-car", car=name)
        return self._controls[name]

    def _ask(self, answering: Coroutine[Any, Any, None]) -> None:
        """Ask a car in a task of its own; send the page an error where the car refuses."""
        question = asyncio.create_task(self._answer(answering))
        self._questions.add(question)
        question.add_done_callback(self._questions.discard)

    async def _answer(self, answering: Coroutine[Any, Any, None]) -> None:
        try:
            await answering
        except MotorcadeError as problem:
            self._refuse(problem)

    async def _steer(self) -> None:
        """Steer by the newest of the sticks that arrive together: `_listen` takes all of them before this wakes."""
        while True:
            await self._moved.wait()
            self._moved.clear()
            stick, self._stick = self._stick, None
            if stick is None:
                continue
            for name in stick.cars:
                if name in self._controls:
                    self._controls[name].steer(stick.throttle, stick.steering)
            self._put("heard", {"number": stick.number})

    async def _send_telemetry(self) -> None:
        """Send the telemetry of the page's cars, ten times a second."""
        while True:
            self._put("telemetry", {"cars": {name: control.telemetry() for name, control in self._controls.items()}})
            await asyncio.sleep(_TELEMETRY_EVERY_S)

    async def _send(self) -> None:
        """Send what waits; of each kind that repeats only the newest."""
        while True:
            await self._changed.wait()
            self._changed.clear()
            while self._newest or self._others:
                message = self._others.popleft() if self._others else self._newest.pop(next(iter(self._newest)))
                await self._socket.send_text(msgspec.json.encode(message).decode())

    def _put(self, kind: str, values: dict[str, Any]) -> None:
        self._newest[kind] = {"is": kind} | values
        self._changed.set()

    def _refuse(self, problem: MotorcadeError) -> None:
        self._others.append({"is": "error"} | problem.to_dict("page"))
        self._changed.set()


async def serve_page(socket: WebSocket, fleet: Fleet, settings: ServerSettings) -> None:
    """Serve a page's connection until it ends."""
    host, port = socket.client or ("?", 0)
    await PageSession(socket, fleet, f"{host}:{port}", settings).serve()


async def refuse_page(socket: WebSocket, problem: MotorcadeError) -> None:
    """Send a page the reason why it can't drive, and close the connection."""
    with suppress(WebSocketDisconnect):
        await socket.send_text(msgspec.json.encode({"is": "error"} | problem.to_dict("page")).decode())
        await socket.close(_POLICY_VIOLATION)
