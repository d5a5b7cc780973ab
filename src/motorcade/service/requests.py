"""The requests of a page: one table from a request's name to the function that answers it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import msgspec

from motorcade.errors import MotorcadeError
from motorcade.missions.check import Play
from motorcade.program.diagnostics import ProgramError
from motorcade.service import messages, missions
from motorcade.service.documents import example, examples, open_text, project_text
from motorcade.service.messages import Nothing, decode
from motorcade.service.programs import compile_blocks, decompile_image, profile_figures
from motorcade.service.python_text import blocks_to_python, python_to_blocks


class Quota(NamedTuple):
    """How many bytes an owner's projects use, and how many they may use; None: no limit."""

    used_bytes: int
    most_bytes: int | None = None


class Storage(Protocol):
    """Projects by owner and name; every version of a project is stored.

    Each method is atomic: another caller sees the state before it or after it, never between. Each raises
    MotorcadeError where the name of an owner or a project isn't allowed.
    """

    def read(self, owner: str, name: str, version: int | None = None) -> bytes:
        """The text of a version, by default of the newest. Raises MotorcadeError where there is none."""

    def write_version(self, owner: str, name: str, data: bytes) -> int:
        """Store ``data`` as the newest version, unless it equals the newest one; return the version's number.

        Raises MotorcadeError where the name isn't allowed or the data can't be written.
        """

    def history(self, owner: str, name: str) -> list[messages.Version]:
        """All versions of a project, the newest first. Raises MotorcadeError where there is no such project."""

    def delete(self, owner: str, name: str) -> None:
        """Remove a project with all its versions from the list. Raises MotorcadeError where there is none."""

    def quota(self, owner: str) -> Quota:
        """How many bytes an owner uses, and may use."""

    def stars(self, owner: str) -> dict[str, "list[int]"]:
        """The stars that an owner has earned: of each mission's id a sorted list."""

    def add_stars(self, owner: str, mission: str, stars: "list[int]") -> "list[int]":
        """Add stars of a mission to those that an owner has; return all of them. Raises MotorcadeError."""

    # The last method: after it, in this class, `list` means this method.
    def list(self, owner: str) -> list[messages.LibraryEntry]:
        """All projects of an owner, the one saved last first."""


@dataclass(frozen=True, slots=True)
class Context:
    """What a shell provides for the requests.

    Attributes:
        capabilities: what the shell can do.
        storage: where projects are stored.
        ports: lists the ports to upload through.
        owner: the owner of the projects.
        play: simulates missions; None: the engine of this computer.
    """

    capabilities: messages.Capabilities
    storage: Storage
    ports: Callable[[], list[messages.Port]]
    owner: str = ""
    play: Play | None = None


class Request(NamedTuple):
    """A request: the types of its message and its answer, and the function that answers it."""

    message: Any
    answer: Any
    function: Callable[[Any, Context], Any]


def _save_text(project: messages.Project, context: Context) -> messages.Text:
    return messages.Text(project_text(project))


def _list_projects(message: Nothing, context: Context) -> list[messages.LibraryEntry]:
    return context.storage.list(context.owner)


def _read_project(wanted: messages.ProjectVersion, context: Context) -> messages.StoredProject:
    text = context.storage.read(context.owner, wanted.name, wanted.version)
    try:
        project = open_text(text)
    except ProgramError:
        raise MotorcadeError("damaged-version", name=wanted.name) from None
    return messages.StoredProject(**msgspec.structs.asdict(project), name=wanted.name)


def _write_project(sent: messages.ProjectToSave, context: Context) -> messages.SavedVersion:
    data = project_text(sent.project).encode()
    return messages.SavedVersion(context.storage.write_version(context.owner, sent.name, data))


def _list_versions(named: messages.ProjectName, context: Context) -> list[messages.Version]:
    return context.storage.history(context.owner, named.name)


def _delete_project(named: messages.ProjectName, context: Context) -> Nothing:
    context.storage.delete(context.owner, named.name)
    return Nothing()


def _list_missions(message: Nothing, context: Context) -> list[missions.MissionEntry]:
    return missions.list_missions(context.storage.stars(context.owner))


def _open_mission(choice: messages.MissionChoice, context: Context) -> missions.Mission:
    return missions.open_mission(choice, context.storage.stars(context.owner))


def _check_mission(attempt: missions.MissionAttempt, context: Context) -> missions.MissionResult:
    result = missions.check_attempt(attempt, context.play)
    if attempt.mission.document is None:
        result.earned = context.storage.add_stars(context.owner, attempt.mission.id, result.stars)
    return result


REQUESTS: dict[str, Request] = {
    "capabilities": Request(Nothing, messages.Capabilities, lambda message, context: context.capabilities),
    "profiles": Request(Nothing, list[messages.ProfileFigures], lambda message, context: profile_figures()),
    "compile": Request(messages.Blocks, messages.Compiled, lambda blocks, context: compile_blocks(blocks)),
    "decompile": Request(messages.Image, messages.Project, lambda image, context: decompile_image(image)),
    "blocks-to-python": Request(
        messages.BlocksAndText, messages.PythonText, lambda sent, context: blocks_to_python(sent)
    ),
    "python-to-blocks": Request(
        messages.BlocksAndText, messages.PythonBlocks, lambda sent, context: python_to_blocks(sent)
    ),
    "open": Request(messages.Text, messages.Project, lambda file, context: open_text(file.text)),
    "save-text": Request(messages.Project, messages.Text, _save_text),
    "examples": Request(Nothing, list[messages.Example], lambda message, context: examples()),
    "example": Request(messages.ExampleName, messages.Project, lambda wanted, context: example(wanted.id)),
    "missions": Request(Nothing, list[missions.MissionEntry], _list_missions),
    "mission": Request(messages.MissionChoice, missions.Mission, _open_mission),
    "missions/open": Request(messages.Text, missions.Mission, lambda file, context: missions.open_mission_text(file)),
    "missions/save-text": Request(
        messages.MissionChoice, messages.Text, lambda choice, context: missions.mission_text(choice)
    ),
    "missions/check": Request(missions.MissionAttempt, missions.MissionResult, _check_mission),
    "ports": Request(Nothing, list[messages.Port], lambda message, context: context.ports()),
    "projects/list": Request(Nothing, list[messages.LibraryEntry], _list_projects),
    "projects/read": Request(messages.ProjectVersion, messages.StoredProject, _read_project),
    "projects/write": Request(messages.ProjectToSave, messages.SavedVersion, _write_project),
    "projects/history": Request(messages.ProjectName, list[messages.Version], _list_versions),
    "projects/delete": Request(messages.ProjectName, Nothing, _delete_project),
}


def respond(name: str, data: bytes, context: Context) -> bytes:
    """Answer the request ``name`` of REQUESTS; message and answer are JSON, no message means no arguments.

    Raises MotorcadeError where there is no such request, or it is refused.
    """
    if name not in REQUESTS:
        raise MotorcadeError("not-found")
    request = REQUESTS[name]
    message = Nothing() if request.message is Nothing and not data else decode(data, request.message)
    return msgspec.json.encode(request.function(message, context))
