"""The remote's addresses: in the studio, and alone on a car."""

from collections.abc import Callable

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from motorcade.server.errors import ServerError
from motorcade.server.http import refusals
from motorcade.server.pages import page_routes
from motorcade.server.remote import pictures
from motorcade.server.remote.fleet import Fleet
from motorcade.server.remote.page_session import refuse_cockpit, serve_cockpit
from motorcade.server.request_filter import RequestFilter
from motorcade.server.settings import ServerSettings

# The cars that a request may see, by what its address says of them.
Cars = Callable[[HTTPConnection], Fleet]


def routes(settings: ServerSettings, cars: Cars) -> list[BaseRoute]:
    """The WebSocket, the cameras and nothing else."""

    async def drive(socket: WebSocket) -> None:
        await socket.accept()
        try:
            garage = cars(socket)
        except ServerError as problem:
            # A browser tells its page nothing of a connection that was refused before it began.
            await refuse_cockpit(socket, problem)
        else:
            await serve_cockpit(socket, garage, settings)

    async def camera(request: Request) -> Response:
        return await pictures.stream(request, await cars(request).camera(request.query_params.get("car", "")))

    async def snapshot(request: Request) -> Response:
        return await pictures.snapshot(await cars(request).camera(request.query_params.get("car", "")))

    return [
        WebSocketRoute("/drive/ws", drive),
        Route("/camera", camera),
        Route("/camera/snapshot.jpg", snapshot),
    ]


def make_remote(settings: ServerSettings, garage: Fleet) -> ASGIApp:
    """The whole server of a car's own page."""

    async def to_the_page(request: Request) -> Response:
        return RedirectResponse("/drive")

    app = Starlette(
        routes=[*routes(settings, lambda asked: garage), Route("/", to_the_page), *page_routes()],
        exception_handlers=refusals(),
    )
    return RequestFilter(app, settings)
