"""JSON over HTTP and WebSockets, and the files of the pages."""

from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from anyio import create_task_group
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.errors import MotorcadeError
from motorcade.service.messages import decode
from motorcade.service.programs import error_answer

T = TypeVar("T")
# The build of the pages writes them here.
PAGE = Path(__file__).with_name("page")
_REMOTE = "/drive"
_NOT_BUILT = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Motorcade</title>
<h1>The server runs, but its page isn't built</h1>
<p>In the folder <code>web</code> run <code>npm ci</code> and <code>npm run build</code>, start the server again, and
reload.</p>
<h1 lang="zh">服务器已启动，但页面尚未构建</h1>
<p lang="zh">请在 <code>web</code> 文件夹中运行 <code>npm ci</code> 和
<code>npm run build</code>，重新启动服务器，然后刷新。</p>
</html>
"""


def json_response(data: Any, status: int = 200) -> Response:
    """Return an answer with ``data`` as JSON."""
    return Response(msgspec.json.encode(data), status, media_type="application/json")


def error_response(problem: Exception) -> Response:
    """Return an answer with an error as JSON; an exception other than MotorcadeError is the error 'internal'."""
    error = problem if isinstance(problem, MotorcadeError) else MotorcadeError("internal")
    return json_response({"error": error_answer(error)}, error.http_status)


def exception_handlers() -> dict[type[Exception], Callable[[Request, Exception], Awaitable[Response]]]:
    """Return the functions of a Starlette application that answer a request which raised an exception."""
    return {MotorcadeError: _answer_error, HTTPException: _answer_http, Exception: _answer_error}


async def _answer_error(request: Request, problem: Exception) -> Response:
    return error_response(problem)


async def _answer_http(request: Request, problem: Exception) -> Response:
    assert isinstance(problem, HTTPException)
    if problem.status_code == 404:
        return error_response(MotorcadeError("not-found"))
    error = MotorcadeError("bad-request", reason=problem.detail)
    response = json_response({"error": error.to_dict("page")}, problem.status_code)
    response.headers.update(problem.headers or {})
    return response


async def next_message(socket: WebSocket, kind: type[T], most_characters: int) -> T:
    """Receive the next message of a page, in JSON.

    Raises:
        MotorcadeError: it isn't a message of ``kind``, or is longer than ``most_characters``.
        WebSocketDisconnect: the page has left.
    """
    received = await socket.receive()
    if received["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(received.get("code", 1006))
    text = received.get("text")
    if text is None:
        raise MotorcadeError("bad-message", reason="it is no text")
    if len(text) > most_characters:
        raise MotorcadeError("message-too-long", most=most_characters)
    return decode(text.encode(), kind)


async def until_one_ends(jobs: Iterable[Callable[[], Awaitable[None]]]) -> None:
    """Run all jobs at once; when one ends or the page leaves, cancel the others."""
    async with create_task_group() as group:

        async def end_all_with(job: Callable[[], Awaitable[None]]) -> None:
            with suppress(WebSocketDisconnect):
                await job()
            group.cancel_scope.cancel()

        for job in jobs:
            group.start_soon(end_all_with, job)


def page_routes(folder: Path = PAGE) -> list[BaseRoute]:
    """Return the routes of both pages and their files; to be the last of an app's routes, as they match every path."""
    if not (folder / "index.html").is_file():
        return [Route(path, _not_built) for path in ("/", _REMOTE)]
    files = StaticFiles(directory=folder, html=True)

    def remote(request: Request) -> Response:
        page = folder / "drive.html"
        return FileResponse(page) if page.is_file() else _not_built(request)

    return [Route(_REMOTE, remote), Mount("/", GZipMiddleware(files, minimum_size=1024, compresslevel=6))]


def _not_built(request: Request) -> HTMLResponse:
    return HTMLResponse(_NOT_BUILT, 503)
