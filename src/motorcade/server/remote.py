"""The remote, in the studio and alone on a car: its addresses, and each of its pages with its connections to cars."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Coroutine
from contextlib import ExitStack, aclosing, suppress
from typing import Any

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import RedirectResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from motorcade.cameras.broadcast import RATE_HZ, Camera
from motorcade.drive.stamps import Freshness
from motorcade.errors import MotorcadeError
from motorcade.server import remote_messages as messages
from motorcade.server.fleet import MOST_CARS, Action, Fleet, PageControl, named_page
from motorcade.server.http import EXCEPTION_HANDLERS, page_routes
from motorcade.server.page_socket import PageSocket, accepted
from motorcade.server.remote_messages import RemoteMessage
from motorcade.server.request_filter import RequestFilter, ServerSettings
from motorcade.service.library import checked_user_name
from motorcade.timing import to_ticks

_TELEMETRY_EVERY_S = 0.1
# A position of the stick that comes so much later than others is old.
_STALE_MS = 150
_RECORDED: dict[Action, str] = {"clear": "clears", "resume_program": "resumes"}
_ACTIONS: dict[type[RemoteMessage], Action] = {
    messages.RequestDrive: "request",
    messages.Release: "release",
    messages.Clear: "clear",
    messages.Resume: "resume_program",
}
# A stop that a page has sent before it left is tried for so long.
_LAST_STOPS_S = 5.0
# Answers of which only the newest is of use.
NEWEST = (messages.RemoteHello, messages.Telemetry, messages.Received)
_BOUNDARY = "motorcade-picture"
_MOST_HZ = 30.0


class PageSession:
    """Serve one page, at an accepted WebSocket: ``page`` sends its answers."""

    def __init__(self, socket: WebSocket, page: PageSocket, fleet: Fleet, settings: ServerSettings) -> None:
        self._page = page
        self._fleet = fleet
        self._settings = settings
        self._freshness = Freshness(_STALE_MS)
        host, port = socket.client or ("?", 0)
        self._address = self._name = f"{host}:{port}"
        self._user = socket.query_params.get("name", "")
        self._controls: dict[str, PageControl] = {}
        # Requests to cars may take a while; each is a task, so that it delays neither another nor the page.
        self._requests: set[asyncio.Task[None]] = set()
        # Those of them that stop a car, and which.
        self._stops: dict[asyncio.Task[None], str] = {}
        self._stick: messages.Drive | None = None
        self._moved = asyncio.Event()
        self._refused: set[str] = set()
        self._driven: set[str] = set()
        # Cars that this page has steered, as long as it may.
        self._steered: set[str] = set()

    async def serve(self) -> None:
        """Serve until the page leaves; then stop the cars that it drove."""
        try:
            refusal: MotorcadeError | None = None
            try:
                self._name = named_page(checked_user_name(self._user), self._address)
            except MotorcadeError as problem:
                refusal = problem
            try:
                await self._greet()
            except MotorcadeError as problem:
                self._page.refuse(problem)
            # A page forgets older problems when it is greeted.
            if refusal:
                self._page.refuse(refusal)
            await self._page.serve(RemoteMessage, self._handle, (self._steer, self._send_telemetry))
        finally:
            await self._end()

    async def _end(self) -> None:
        """Leave all cars; those that the page has just stopped once they are, or can't be reached for a while."""
        stopped = set(self._stops.values())
        controls = self._controls
        self._controls = {}
        with ExitStack() as ending:
            for car in stopped & controls.keys():
                ending.callback(controls[car].leave)
            with ExitStack() as ending_at_once:
                for request in self._requests - self._stops.keys():
                    ending_at_once.callback(request.cancel)
                for car in list(self._driven):
                    ending_at_once.callback(self._record_driving, car, False)
                # These come first, each whatever becomes of the others.
                for car in controls.keys() - stopped:
                    ending_at_once.callback(controls[car].leave)
            if self._stops:
                _, late = await asyncio.wait(list(self._stops), timeout=_LAST_STOPS_S)
                for stop in late:
                    stop.cancel()

    async def _handle(self, message: RemoteMessage) -> None:
        match message:
            case messages.Drive():
                self._take(message)
            case messages.Stop():
                self._stop(message.cars)
            case messages.Join():
                await self._join(message.car)
            case messages.Leave():
                if message.car in self._controls:
                    self._controls.pop(message.car).leave()
                self._record_driving(message.car, False)
            case messages.RequestDrive() | messages.Release() | messages.Clear() | messages.Resume():
                self._request(self._act(message.car, _ACTIONS[type(message)]))
            case messages.Sync():
                self._freshness.take_answer(message.clock, message.number, message.stamp, self._now())
            case messages.Start():
                await self._fleet.start()
                await self._greet()

    def _take(self, message: messages.Drive) -> None:
        """Take the stick's position, unless it was sent long ago."""
        if self._freshness.is_fresh(message.stamp, self._now(), message.number, stands=message.throttle == 0):
            self._stick = message
            self._moved.set()
        else:
            self._page.put(messages.Received(message.number, stale=True))

    def _now(self) -> int:
        return to_ticks(self._settings.clock())

    async def _greet(self) -> None:
        self._page.put(messages.RemoteHello(await self._fleet.listed(), self._name))

    async def _join(self, name: str) -> None:
        if name in self._controls:
            return
        if len(self._controls) >= MOST_CARS:
            raise MotorcadeError("at-too-many-cars", most=MOST_CARS)
        self._controls[name] = await self._fleet.of(name).connect(name, self._name)

    def _stop(self, names: list[str]) -> None:
        """Stop these cars, also those to which the page is not connected."""
        for name in names:
            if name in self._controls:
                stop = self._request(self._controls[name].act("stop"))
            else:
                stop = self._request(self._fleet.of(name).stop(name, self._name))
            self._stops[stop] = name
            stop.add_done_callback(self._stops.pop)
        for name in names:
            self._record("stops", name)

    async def _act(self, car: str, action: Action) -> None:
        if car not in self._controls:
            raise MotorcadeError("not-at-car", car=car)
        self._check_may_drive(car)
        await self._controls[car].act(action)
        if action in _RECORDED:
            self._record(_RECORDED[action], car)

    def _record(self, did: str, car: str) -> None:
        if self._settings.record:
            self._settings.record(did, self._name, car)

    def _record_driving(self, car: str, drives: bool) -> None:
        if drives and car not in self._driven:
            self._record("drives", car)
            self._driven.add(car)
        if not drives and car in self._driven:
            self._record("ends", car)
            self._driven.discard(car)

    def _request(self, action: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Wait for a car in a task of its own, which is returned; send the page an error where the car refuses."""
        request = asyncio.create_task(self._answer(action))
        self._requests.add(request)
        request.add_done_callback(self._requests.discard)
        return request

    async def _answer(self, action: Coroutine[Any, Any, None]) -> None:
        try:
            await action
        except MotorcadeError as problem:
            self._page.refuse(problem)

    async def _steer(self) -> None:
        """Steer by the newest of the positions that arrive together: `_receive` reads all of them before this runs."""
        while True:
            await self._moved.wait()
            self._moved.clear()
            stick = self._stick
            self._stick = None
            if stick is None:
                continue
            for name in stick.cars:
                if name in self._controls:
                    self._steer_car(name, stick)
            self._page.put(messages.Received(stick.number))

    def _steer_car(self, name: str, stick: messages.Drive) -> None:
        """Steer a car; where it refuses, send the page the error once, not for each position."""
        try:
            self._check_may_drive(name)
            self._steered.add(name)
            self._controls[name].steer(stick.throttle, stick.steering, **stick.switches)
            self._refused.discard(name)
        except MotorcadeError as problem:
            if name not in self._refused:
                self._page.refuse(problem)
            self._refused.add(name)

    def _check_may_drive(self, name: str) -> None:
        if not self._fleet.may_drive(name):
            raise MotorcadeError("not-your-turn", car=name)

    async def _give_back(self, control: PageControl) -> None:
        """Stop driving a car that somebody else has got; one that can't be reached stands still anyway."""
        control.steer(0.0, 0.0)
        with suppress(MotorcadeError):
            await control.act("release")

    async def _send_telemetry(self) -> None:
        """Send the telemetry of the page's cars, ten times a second; give back those that it may drive no more."""
        known = messages.CarTelemetry.__struct_fields__
        while True:
            for name in [name for name in self._steered if not self._fleet.may_drive(name)]:
                self._steered.discard(name)
                if name in self._controls:
                    self._request(self._give_back(self._controls[name]))
            shown = {}
            for name, control in self._controls.items():
                told = {field: value for field, value in control.telemetry().items() if field in known}
                shown[name] = messages.CarTelemetry(**told, paused=self._fleet.of(name).is_paused(name))
                self._record_driving(name, bool(shown[name].you["drives"]))
            self._page.put(messages.Telemetry(shown, self._freshness.clock_to_answer(self._now())))
            await asyncio.sleep(_TELEMETRY_EVERY_S)


def routes(settings: ServerSettings, fleet_of: Callable[[HTTPConnection], Fleet]) -> list[BaseRoute]:
    """Return the routes of the WebSocket and the cameras; ``fleet_of`` gives the cars that a request may use."""

    async def drive(socket: WebSocket) -> None:
        async with accepted(socket, settings, NEWEST) as page:
            await PageSession(socket, page, fleet_of(socket), settings).serve()

    async def camera_of(request: Request) -> Camera:
        car = request.query_params.get("car", "")
        found = await fleet_of(request).of(car).camera(car)
        if found is None:
            raise MotorcadeError("no-camera-here")
        return found

    async def camera(request: Request) -> Response:
        return await _stream(request, await camera_of(request))

    async def snapshot(request: Request) -> Response:
        return Response(await (await camera_of(request)).snapshot(), media_type="image/jpeg")

    return [
        WebSocketRoute("/drive/ws", drive),
        Route("/camera", camera),
        Route("/camera/snapshot.jpg", snapshot),
    ]


def make_remote(settings: ServerSettings, fleet: Fleet) -> ASGIApp:
    """Return the whole server of a remote for these cars."""

    to_the_page = Route("/", lambda request: RedirectResponse("/drive"))
    app = Starlette(
        routes=[*routes(settings, lambda connection: fleet), to_the_page, *page_routes()],
        exception_handlers=EXCEPTION_HANDLERS,
    )
    return RequestFilter(app, settings)


async def _stream(request: Request, camera: Camera) -> Response:
    """Return an answer with pictures one after the other (MJPEG), at most the query's ``rate`` a second.

    Raises MotorcadeError: the camera fails, or the rate isn't allowed.
    """
    pictures = camera.pictures(_rate(request.query_params.get("rate", "")))
    # Waits for the first picture, so that a camera that fails gives an error instead of a broken picture.
    first = await anext(pictures)
    return StreamingResponse(_parts(first, pictures), media_type=f"multipart/x-mixed-replace; boundary={_BOUNDARY}")


async def _parts(first: bytes, pictures: AsyncGenerator[bytes, None]) -> AsyncIterator[bytes]:
    # The headers are sent, so the answer can't become an error.
    async with aclosing(pictures):
        with suppress(MotorcadeError):
            yield _part(first)
            async for picture in pictures:
                yield _part(picture)


def _part(picture: bytes) -> bytes:
    head = f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(picture)}\r\n\r\n"
    return head.encode() + picture + b"\r\n"


def _rate(text: str) -> float:
    try:
        rate_hz = float(text or RATE_HZ)
    except ValueError:
        rate_hz = 0.0
    if not 0.1 <= rate_hz <= _MOST_HZ:
        raise MotorcadeError(
            "bad-request", reason=f"rate is {text[:20]!r}; allowed: 0.1 to {_MOST_HZ:g} pictures a second"
        )
    return rate_hz
