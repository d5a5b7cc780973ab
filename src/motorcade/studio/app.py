"""The studio's server: which address answers what."""

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp

from motorcade.program.diagnostics import LANGUAGES, ProgramError
from motorcade.server.guard import Guard
from motorcade.server.http import answer, refusals
from motorcade.server.pages import page_routes
from motorcade.studio import driving, gallery, programs, projects, stages, uploads
from motorcade.studio.compiling import said
from motorcade.studio.settings import Settings

_MOST_SAID = 3


def make_app(settings: Settings) -> ASGIApp:
    """The whole server, as an ASGI application."""
    worlds = stages.Stages(settings)
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
    return Guard(app, settings)


async def _refuse_program(request: Request, problem: Exception) -> Response:
    assert isinstance(problem, ProgramError)
    told = problem.diagnostics[:_MOST_SAID]
    message = {
        language: "\n".join(f"{each.path}: {each.message(language)}".removeprefix(": ") for each in told)
        for language in LANGUAGES
    }
    error = {"code": told[0].code, "message": message, "diagnostics": said(problem.diagnostics)}
    return answer({"error": error}, 400)
