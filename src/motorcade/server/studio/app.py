"""The studio's server: which address answers what."""

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp

from motorcade.program.diagnostics import LANGUAGES, ProgramError
from motorcade.server.http import answer, refusals
from motorcade.server.pages import page_routes
from motorcade.server.request_filter import RequestFilter
from motorcade.server.studio import driving, projects
from motorcade.server.studio import sessions as stages
from motorcade.server.studio.settings import Settings
from motorcade.service import gallery, programs, uploads
from motorcade.service.compiling import said

_MOST_SAID = 3


def make_app(settings: Settings) -> ASGIApp:
    """The whole server, as an ASGI application."""
    worlds = stages.PlaybackSessions(settings)
    rooms = (programs, projects, gallery, uploads)
    app = Starlette(
        routes=[
            *(route for room in rooms for route in room.routes(settings)),
            *stages.routes(worlds),
            *driving.routes(settings, worlds),
            *page_routes(settings.page),
        ],
        exception_handlers={**refusals(), ProgramError: _refuse_program},
    )
    return RequestFilter(app, settings)


async def _refuse_program(request: Request, problem: Exception) -> Response:
    assert isinstance(problem, ProgramError)
    told = problem.diagnostics[:_MOST_SAID]
    message = {
        language: "\n".join(f"{each.path}: {each.message(language)}".removeprefix(": ") for each in told)
        for language in LANGUAGES
    }
    error = {"code": told[0].code, "message": message, "diagnostics": said(problem.diagnostics)}
    return answer({"error": error}, 400)
