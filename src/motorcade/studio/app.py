"""The studio's server: which address answers what."""

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp

from motorcade.program.diagnostics import LANGUAGES, ProgramError
from motorcade.server.errors import ServerError
from motorcade.server.guard import Guard
from motorcade.server.http import answer, refusal
from motorcade.studio import gallery, pages, programs, projects, stages, uploads
from motorcade.studio.compiling import said
from motorcade.studio.settings import Settings

_MOST_SAID = 3


def make_app(settings: Settings) -> ASGIApp:
    """The whole server, as an ASGI application."""
    rooms = (programs, projects, gallery, stages, uploads, pages)
    app = Starlette(
        routes=[route for room in rooms for route in room.routes(settings)],
        exception_handlers={
            ServerError: _refuse,
            ProgramError: _refuse_program,
            HTTPException: _refuse_request,
            Exception: _refuse_ourselves,
        },
    )
    return Guard(app, settings)


async def _refuse(request: Request, problem: Exception) -> Response:
    assert isinstance(problem, ServerError)
    return refusal(problem)


async def _refuse_program(request: Request, problem: Exception) -> Response:
    assert isinstance(problem, ProgramError)
    told = problem.diagnostics[:_MOST_SAID]
    message = {
        language: "\n".join(f"{each.path}: {each.message(language)}".removeprefix(": ") for each in told)
        for language in LANGUAGES
    }
    error = {"code": told[0].code, "message": message, "diagnostics": said(problem.diagnostics)}
    return answer({"error": error}, 400)


async def _refuse_request(request: Request, problem: Exception) -> Response:
    assert isinstance(problem, HTTPException)
    if problem.status_code == 404:
        return refusal(ServerError("not-found", 404))
    response = refusal(ServerError("bad-request", problem.status_code, reason=problem.detail))
    response.headers.update(problem.headers or {})
    return response


async def _refuse_ourselves(request: Request, problem: Exception) -> Response:
    return refusal(ServerError("internal", 500))
