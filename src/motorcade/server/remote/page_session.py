"""One page of the remote at its cars: what it says is done, and what they do is told."""

import asyncio
from collections import deque
from collections.abc import Coroutine
from contextlib import suppress
from typing import Any

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.server.errors import ServerError
from motorcade.server.remote import messages as say
from motorcade.server.remote.control import PageControl
from motorcade.server.remote.errors import RemoteError
from motorcade.server.remote.fleet import Fleet
from motorcade.server.settings import ServerSettings
from motorcade.server.sockets import heard, until_one_ends
from motorcade.timing import RateLimit, to_ticks

MOST_CARS = 16
_TELL_EVERY_S = 0.1
_MOST_WAITING = 32
_LEFT = 1008


class PageSession:
    """Serves one WebSocket.

    Args:
        socket: accepted.
        garage: the cars.
        name: what the page is called at them.
        settings: what it may ask.
    """

    def __init__(self, socket: WebSocket, garage: Fleet, name: str, settings: ServerSettings) -> None:
        self._socket = socket
        self._garage = garage
        self._name = name
        self._settings = settings
        self._seats: dict[str, PageControl] = {}
        # What was asked of cars that may take a moment to answer; none of them holds up another, or the page.
        self._asked: set[asyncio.Task[None]] = set()
        self._stick: say.DriveMessage | None = None
        self._moved = asyncio.Event()
        self._newest: dict[str, dict[str, Any]] = {}
        self._others: deque[dict[str, Any]] = deque(maxlen=_MOST_WAITING)
        self._stirred = asyncio.Event()

    async def serve(self) -> None:
        """Be there until the page leaves; its cars then stand still, if it drove them."""
        try:
            await until_one_ends((self._listen, self._steer, self._tell, self._send))
        finally:
            seats, self._seats = self._seats, {}
            for seat in seats.values():
                seat.leave()
            for asked in self._asked:
                asked.cancel()

    async def _listen(self) -> None:
        try:
            await self._greet()
        except ServerError as problem:
            self._refuse(problem)
        rate = RateLimit(2 * self._settings.messages_a_second, 2000)
        while True:
            try:
                message: say.Message = await heard(self._socket, say.Message, self._settings.most_body)  # type: ignore[arg-type]  # a union
                await self._obey(message)
            except ServerError as problem:
                self._refuse(problem)
            if not rate.allows(to_ticks(self._settings.clock())):
                await self._socket.close(_LEFT)
                return

    async def _obey(self, message: say.Message) -> None:
        match message:
            case say.DriveMessage():
                self._stick = message
                self._moved.set()
            case say.Stop():
                self._stop(message.cars)
            case say.Sit():
                await self._sit(message.car)
            case say.Leave():
                if message.car in self._seats:
                    self._seats.pop(message.car).leave()
            case say.Request():
                self._ask(self._seat(message.car).request())
            case say.Release():
                self._ask(self._seat(message.car).release())
            case say.Clear():
                self._ask(self._seat(message.car).clear())
            case say.Resume():
                self._ask(self._seat(message.car).resume_program())
            case say.Start():
                await self._garage.start()
                await self._greet()

    async def _greet(self) -> None:
        cars = [each._asdict() for each in await self._garage.listed()]
        self._put("hello", {"cars": cars, "you": self._name})

    async def _sit(self, name: str) -> None:
        if name in self._seats:
            return
        if len(self._seats) >= MOST_CARS:
            raise RemoteError("too-many-cars", 409, most=MOST_CARS)
        self._seats[name] = await self._garage.enter(name, self._name)

    def _stop(self, names: list[str]) -> None:
        """Stop all at which the page sits, before anything is said of the others."""
        for name in names:
            if name in self._seats:
                self._ask(self._seats[name].stop())
        for name in names:
            self._seat(name)

    def _seat(self, name: str) -> PageControl:
        if name not in self._seats:
            raise RemoteError("no-seat", 409, car=name)
        return self._seats[name]

    def _ask(self, asking: Coroutine[Any, Any, None]) -> None:
        """Ask something of a car, and tell the page when it says no."""
        asked = asyncio.create_task(self._hear(asking))
        self._asked.add(asked)
        asked.add_done_callback(self._asked.discard)

    async def _hear(self, asking: Coroutine[Any, Any, None]) -> None:
        try:
            await asking
        except ServerError as problem:
            self._refuse(problem)

    async def _steer(self) -> None:
        """Execute the last stick of those that come at once after a stall: `_listen` takes all before this wakes."""
        while True:
            await self._moved.wait()
            self._moved.clear()
            stick, self._stick = self._stick, None
            if stick is None:
                continue
            for name in stick.cars:
                if name in self._seats:
                    self._seats[name].steer(stick.throttle, stick.steering)
            self._put("heard", {"number": stick.number})

    async def _tell(self) -> None:
        """Telemetry of the cars at which the page sits, again and again."""
        while True:
            self._put("telemetry", {"cars": {name: seat.told() for name, seat in self._seats.items()}})
            await asyncio.sleep(_TELL_EVERY_S)

    async def _send(self) -> None:
        """Send what waits; of what is told again and again only the newest."""
        while True:
            await self._stirred.wait()
            self._stirred.clear()
            while self._newest or self._others:
                message = self._others.popleft() if self._others else self._newest.pop(next(iter(self._newest)))
                await self._socket.send_text(msgspec.json.encode(message).decode())

    def _put(self, kind: str, values: dict[str, Any]) -> None:
        self._newest[kind] = {"is": kind} | values
        self._stirred.set()

    def _refuse(self, problem: ServerError) -> None:
        self._others.append({"is": "error"} | problem.as_dict())
        self._stirred.set()


async def serve_cockpit(socket: WebSocket, garage: Fleet, settings: ServerSettings) -> None:
    """Let a page drive, which is let in."""
    host, port = socket.client or ("?", 0)
    await PageSession(socket, garage, f"{host}:{port}", settings).serve()


async def refuse_cockpit(socket: WebSocket, problem: ServerError) -> None:
    """Tell a page why it can't drive, and hang up."""
    with suppress(WebSocketDisconnect):
        await socket.send_text(msgspec.json.encode({"is": "error"} | problem.as_dict()).decode())
        await socket.close(_LEFT)
