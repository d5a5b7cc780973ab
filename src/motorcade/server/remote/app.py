"""The remote's addresses, in the studio and alone on a car: a WebSocket to drive, and pictures of cameras."""

from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import aclosing

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import RedirectResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from motorcade.cameras.broadcast import RATE_HZ, Camera
from motorcade.errors import MotorcadeError
from motorcade.server.http import exception_handlers, page_routes
from motorcade.server.page_socket import refuse_page
from motorcade.server.remote.fleet import Fleet
from motorcade.server.remote.page_session import PageSession
from motorcade.server.request_filter import RequestFilter, ServerSettings

_BOUNDARY = "motorcade-picture"
_MOST_HZ = 30.0


def routes(settings: ServerSettings, fleet_of: Callable[[HTTPConnection], Fleet]) -> list[BaseRoute]:
    """Return the routes of the WebSocket and the cameras; ``fleet_of`` gives the cars that a request may use."""

    async def drive(socket: WebSocket) -> None:
        await socket.accept()
        try:
            fleet = fleet_of(socket)
        except MotorcadeError as problem:
            # A browser gives its page no reason where a connection is refused before it is accepted.
            await refuse_page(socket, settings, problem)
        else:
            await PageSession(socket, fleet, settings).serve()

    async def camera(request: Request) -> Response:
        return await stream(request, await fleet_of(request).camera(request.query_params.get("car", "")))

    async def snapshot(request: Request) -> Response:
        return await snapshot_response(await fleet_of(request).camera(request.query_params.get("car", "")))

    return [
        WebSocketRoute("/drive/ws", drive),
        Route("/camera", camera),
        Route("/camera/snapshot.jpg", snapshot),
    ]


def make_remote(settings: ServerSettings, fleet: Fleet) -> ASGIApp:
    """Return the whole server of a remote for these cars."""

    async def to_the_page(request: Request) -> Response:
        return RedirectResponse("/drive")

    app = Starlette(
        routes=[*routes(settings, lambda connection: fleet), Route("/", to_the_page), *page_routes()],
        exception_handlers=exception_handlers(),
    )
    return RequestFilter(app, settings)


async def snapshot_response(camera: Camera | None) -> Response:
    """Return an answer with one new picture. Raises MotorcadeError where there is no camera, or it fails."""
    return Response(await _checked(camera).snapshot(), media_type="image/jpeg")


async def stream(request: Request, camera: Camera | None) -> Response:
    """Return an answer with pictures one after the other (MJPEG), at most the query's ``rate`` a second.

    Raises:
        MotorcadeError: there is no camera, it fails, or the rate isn't allowed.
    """
    pictures = _checked(camera).pictures(_rate(request.query_params.get("rate", "")))
    # Waits for the first picture, so that a camera that fails gives an error instead of a broken picture.
    first = await anext(pictures)
    return StreamingResponse(_parts(first, pictures), media_type=f"multipart/x-mixed-replace; boundary={_BOUNDARY}")


async def _parts(first: bytes, pictures: AsyncGenerator[bytes, None]) -> AsyncIterator[bytes]:
    async with aclosing(pictures):
        yield _part(first)
        try:
            async for picture in pictures:
                yield _part(picture)
        except MotorcadeError:
            # The headers are sent, so the answer can't become an error.
            return


def _part(picture: bytes) -> bytes:
    head = f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(picture)}\r\n\r\n"
    return head.encode() + picture + b"\r\n"


def _checked(camera: Camera | None) -> Camera:
    if camera is None:
        raise MotorcadeError("no-camera-here")
    return camera


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
