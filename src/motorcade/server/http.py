"""JSON over HTTP, the bodies of requests, and the files of the pages."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from html import escape
from pathlib import Path
from tempfile import SpooledTemporaryFile
from typing import Any

import msgspec
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import BaseRoute, Match, Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from motorcade.errors import MotorcadeError
from motorcade.locales import languages
from motorcade.service.programs import error_answer

# The build of the pages writes them here.
PAGE = Path(__file__).with_name("page")
_REMOTE = "/drive"
# A body that is longer waits in a file, until few others are in memory: 30 of at most 1 MB, and one that is longer.
_MOST_UNLOADED = 1 << 16
_MOST_SMALL = 1 << 20
_SMALL_AT_ONCE = 30


class Bodies:
    """The bodies of a server's requests: all that are in memory at a time take some 100 MB at most."""

    def __init__(self) -> None:
        self._small = asyncio.Semaphore(_SMALL_AT_ONCE)
        self._large = asyncio.Semaphore(1)

    @asynccontextmanager
    async def loaded(self, request: Request) -> AsyncIterator[bytes]:
        """Receive a request's body, and keep it in memory while the block runs. Raises ClientDisconnect."""
        with SpooledTemporaryFile(_MOST_UNLOADED, prefix="motorcade-") as file:
            async for part in request.stream():
                file.write(part)
            size = file.tell()
            file.seek(0)
            async with self._large if size > _MOST_SMALL else self._small:
                yield file.read()


def json_response(data: Any, status: int = 200) -> Response:
    """Return an answer with ``data`` as JSON."""
    return Response(msgspec.json.encode(data), status, media_type="application/json")


def error_response(problem: Exception) -> Response:
    """Return an answer with an error as JSON; an exception other than MotorcadeError is the error 'internal'."""
    if isinstance(problem, MotorcadeError):
        error = problem
    else:
        error = MotorcadeError("internal")
    return json_response({"error": error_answer(error)}, error.http_status)


async def _answer(request: Request, problem: Exception) -> Response:
    if isinstance(problem, ClientDisconnect):
        # The sender left before the request was whole: nobody reads the answer, and the log stays empty.
        return Response(status_code=400)
    if not isinstance(problem, HTTPException):
        return error_response(problem)
    if problem.status_code == 404:
        return error_response(MotorcadeError("not-found"))
    error = MotorcadeError("bad-request", reason=problem.detail)
    response = json_response({"error": error.to_dict("page")}, problem.status_code)
    response.headers.update(problem.headers or {})
    return response


# How a Starlette application answers a request that raised an exception.
EXCEPTION_HANDLERS = dict.fromkeys((MotorcadeError, HTTPException, ClientDisconnect, Exception), _answer)


def page_routes(folder: Path = PAGE) -> list[BaseRoute]:
    """Return the routes of both pages and their files; to be the last of an app's routes, as they match every path."""
    if not (folder / "index.html").is_file():
        return [Route(path, lambda request: page_file(folder / "index.html")) for path in ("/", _REMOTE)]
    files = GZipMiddleware(StaticFiles(directory=folder, html=True), minimum_size=1024, compresslevel=6)
    return [Route(_REMOTE, lambda request: page_file(folder / "drive.html")), _Files("/", files)]


class _Files(Mount):
    """Files at every address but those of requests: what is asked in another way than by POST is refused as such."""

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Return whether a request is for a file."""
        if scope["path"].startswith("/api/"):
            return (Match.NONE, {})
        return super().matches(scope)


def check_page() -> None:
    """Raise MotorcadeError where Motorcade was installed without its pages."""
    if not (PAGE / "index.html").is_file():
        raise MotorcadeError("page-missing", folder=PAGE)


def page_file(path: Path) -> Response:
    """Return a page's file; where the pages aren't built, a page that says in every language how to get them."""
    if path.is_file():
        return FileResponse(path)
    return refusal_page(MotorcadeError("page-missing", folder=PAGE))


def refusal_page(problem: MotorcadeError) -> HTMLResponse:
    """Return a page with an error's sentence in every language, in place of one that isn't served."""
    texts = [f'<p lang="{language}">{escape(problem.sentence(language))}</p>' for language in languages()]
    head = "<!doctype html><meta charset=utf-8><meta name=viewport content=width=device-width><title>Motorcade</title>"
    return HTMLResponse(head + "".join(texts), problem.http_status)
