"""JSON over HTTP: a message in, an answer out."""

from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from motorcade.server.errors import ServerError

T = TypeVar("T")


def answer(data: Any, status: int = 200) -> Response:
    """``data`` as JSON."""
    return Response(msgspec.json.encode(data), status, media_type="application/json")


def refusal(problem: ServerError) -> Response:
    """``problem`` as JSON."""
    return answer({"error": problem.as_dict()}, problem.status)


def decoded(data: bytes, kind: type[T]) -> T:
    """The message of ``kind`` in ``data``. Raises ServerError."""
    try:
        return msgspec.json.decode(data, type=kind)
    except RecursionError:
        raise ServerError("too-deep") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as problem:
        raise ServerError("bad-message", reason=str(problem).rstrip(".")) from None


def refusals() -> dict[type[Exception], Callable[[Request, Exception], Awaitable[Response]]]:
    """How a Starlette application says what is wrong, whatever it is."""
    return {ServerError: _refuse, HTTPException: _refuse_request, Exception: _refuse_ourselves}


def get(path: str, work: Callable[[Request], Any]) -> Route:
    """A route that answers what ``work``, which may take a moment, makes of the request."""

    async def endpoint(request: Request) -> Response:
        return answer(await run_in_threadpool(work, request))

    return Route(path, endpoint, methods=["GET"])


def post(path: str, kind: type[T], work: Callable[[T], Any]) -> Route:
    """A route that answers what ``work``, which may take a moment, makes of a message of ``kind``."""

    async def endpoint(request: Request) -> Response:
        message = decoded(await request.body(), kind)
        return answer(await run_in_threadpool(work, message))

    return Route(path, endpoint, methods=["POST"])


async def _refuse(request: Request, problem: Exception) -> Response:
    assert isinstance(problem, ServerError)
    return refusal(problem)


async def _refuse_request(request: Request, problem: Exception) -> Response:
    assert isinstance(problem, HTTPException)
    if problem.status_code == 404:
        return refusal(ServerError("not-found", 404))
    response = refusal(ServerError("bad-request", problem.status_code, reason=problem.detail))
    response.headers.update(problem.headers or {})
    return response


async def _refuse_ourselves(request: Request, problem: Exception) -> Response:
    return refusal(ServerError("internal", 500))
