"""JSON over HTTP, and the files of the pages."""

from collections.abc import Awaitable, Callable
from html import escape
from pathlib import Path
from typing import Any

import msgspec
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles

from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import languages
from motorcade.service.programs import error_answer

# The build of the pages writes them here.
PAGE = Path(__file__).with_name("page")
_REMOTE = "/drive"


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


def page_routes(folder: Path = PAGE) -> list[BaseRoute]:
    """Return the routes of both pages and their files; to be the last of an app's routes, as they match every path."""
    if not (folder / "index.html").is_file():
        return [Route(path, lambda request: page_not_built()) for path in ("/", _REMOTE)]
    files = StaticFiles(directory=folder, html=True)

    def remote(request: Request) -> Response:
        page = folder / "drive.html"
        return FileResponse(page) if page.is_file() else page_not_built()

    return [Route(_REMOTE, remote), Mount("/", GZipMiddleware(files, minimum_size=1024, compresslevel=6))]


def page_not_built() -> HTMLResponse:
    """Return a page that says how to build the pages, in every language."""
    texts = [
        f'<h1 lang="{language}">{Phrase("page-not-built").sentence(language)}</h1>'
        f'<p lang="{language}">{Phrase("how-to-build-page").sentence(language)}</p>'
        for language in languages()
    ]
    return _plain_page(texts, 503)


def refusal_page(problem: MotorcadeError) -> HTMLResponse:
    """Return a page with an error's sentence in every language, in place of one that isn't served."""
    texts = [f'<p lang="{language}">{escape(problem.sentence(language))}</p>' for language in languages()]
    return _plain_page(texts, problem.http_status)


def _plain_page(texts: list[str], status: int) -> HTMLResponse:
    head = "<!doctype html><meta charset=utf-8><meta name=viewport content=width=device-width><title>Motorcade</title>"
    return HTMLResponse(head + "".join(texts), status)
