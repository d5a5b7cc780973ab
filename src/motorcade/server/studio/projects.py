"""Routes about the library's projects."""

from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motorcade.program.diagnostics import ProgramError
from motorcade.server.http import answer, decoded, get
from motorcade.server.studio.library import Library
from motorcade.server.studio.settings import Settings
from motorcade.service.documents import Project, opened, project_text
from motorcade.service.errors import StudioError


def routes(settings: Settings) -> list[BaseRoute]:
    """The projects of the settings' library."""
    library = Library(settings.library)

    def entries(request: Request) -> list[dict[str, Any]]:
        return [entry._asdict() for entry in library.entries()]

    def versions(request: Request) -> list[dict[str, Any]]:
        return [save._asdict() for save in library.saves(_name(request))]

    def restored(request: Request) -> Any:
        text = library.text(_name(request), _version(request))
        try:
            return {"name": _name(request), **_fields(opened(text))}
        except ProgramError:
            raise StudioError("damaged-version", 409, name=_name(request)) from None

    async def save(request: Request) -> Response:
        project = decoded(await request.body(), Project)
        version = await run_in_threadpool(lambda: library.save(_name(request), project_text(project)))
        return answer({"version": version})

    async def delete(request: Request) -> Response:
        await run_in_threadpool(library.delete, _name(request))
        return Response(status_code=204)

    return [
        get("/api/projects", entries),
        get("/api/projects/{name}/versions", versions),
        get("/api/projects/{name}", restored),
        Route("/api/projects/{name}", save, methods=["PUT"]),
        Route("/api/projects/{name}", delete, methods=["DELETE"]),
    ]


def _name(request: Request) -> str:
    name: str = request.path_params["name"]
    return name


def _version(request: Request) -> int | None:
    text = request.query_params.get("version")
    if text is None:
        return None
    if not text.isascii() or not text.isdigit() or len(text) > 9:
        raise StudioError("bad-message", reason=f"version is '{text[:20]}', not a whole number")
    return int(text)


def _fields(project: Project) -> dict[str, Any]:
    return {name: getattr(project, name) for name in project.__struct_fields__}
