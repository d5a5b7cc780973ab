"""The requests of a page: one table from a request's name to the function that answers it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgspec

from motorcade.errors import MotorcadeError
from motorcade.missions.check import open_worlds_here
from motorcade.missions.odds import OpenWorlds
from motorcade.program.diagnostics import ProgramError
from motorcade.service import library, messages, missions, why
from motorcade.service.documents import example, examples, open_file, open_text, opening, project_text
from motorcade.service.history import event_table
from motorcade.service.library import Storage, mission_library
from motorcade.service.messages import Nothing, decode
from motorcade.service.programs import (
    blocks_to_python,
    compile_blocks,
    decompile_image,
    profile_figures,
    python_to_blocks,
)


@dataclass(frozen=True, slots=True)
class Context:
    """What a shell provides for the requests.

    Attributes:
        capabilities: what the shell can do.
        storage: where projects are stored.
        ports: lists the ports to upload through.
        owner: the owner of the projects.
        open_worlds: opens the worlds of missions.
    """

    capabilities: messages.Capabilities
    storage: Storage
    ports: Callable[[], list[messages.Port]]
    owner: str = ""
    open_worlds: OpenWorlds = open_worlds_here


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
    version = wanted.version
    if version is None:
        version = context.storage.history(context.owner, wanted.name)[0].version
    text = context.storage.read(context.owner, wanted.name, version)
    try:
        project = open_text(text)
    except ProgramError:
        raise MotorcadeError("damaged-version", name=wanted.name) from None
    return messages.StoredProject(**msgspec.structs.asdict(project), name=wanted.name, version=version)


def _write_project(sent: messages.ProjectToSave, context: Context) -> messages.SavedVersion:
    data = project_text(sent.project).encode()
    version = context.storage.write_version(context.owner, sent.name, data, sent.base)
    return messages.SavedVersion(version, context.storage.place(context.owner).stays)


def _list_versions(named: messages.ProjectName, context: Context) -> list[messages.Version]:
    return context.storage.history(context.owner, named.name)


def _delete_project(named: messages.ProjectName, context: Context) -> Nothing:
    context.storage.delete(context.owner, named.name)
    return Nothing()


def _list_missions(message: Nothing, context: Context) -> list[missions.MissionEntry]:
    return missions.list_missions(context.storage.stars(context.owner))


def _open_mission(choice: messages.MissionChoice, context: Context) -> missions.Mission:
    return missions.open_mission(choice, context.storage.stars(context.owner))


def _list_own_missions(message: Nothing, context: Context) -> list[messages.LibraryEntry]:
    return context.storage.list(mission_library(context.owner))


@contextmanager
def _of_mission() -> Iterator[None]:
    """Say of a mission what the storage says of a project that isn't there."""
    try:
        yield
    except MotorcadeError as problem:
        raise MotorcadeError("no-own-mission", **problem.details) if problem.code == "no-project" else problem from None


def _read_own_mission(wanted: messages.ProjectName, context: Context) -> missions.Mission:
    with _of_mission():
        text = context.storage.read(mission_library(context.owner), wanted.name)
    return missions.open_mission_text(messages.Text(text.decode(errors="replace")))


def _write_own_mission(sent: missions.MissionToSave, context: Context) -> messages.SavedVersion:
    data = missions.mission_text(messages.MissionChoice(document=sent.document)).text.encode()
    version = context.storage.write_version(mission_library(context.owner), sent.name, data)
    return messages.SavedVersion(version, context.storage.place(context.owner).stays)


def _delete_own_mission(named: messages.ProjectName, context: Context) -> Nothing:
    with _of_mission():
        context.storage.delete(mission_library(context.owner), named.name)
    return Nothing()


def _check_mission(attempt: missions.MissionAttempt, context: Context) -> missions.MissionResult:
    result = missions.check_attempt(attempt, context.open_worlds)
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
    "remedy": Request(why.RemedyOrder, why.RemedyChanges, lambda order, context: why.carry_out(order)),
    "open": Request(messages.Text, messages.Project, lambda file, context: open_file(file.text)),
    "save-text": Request(messages.Project, messages.Text, _save_text),
    "opening": Request(Nothing, messages.Project, lambda message, context: opening()),
    "examples": Request(Nothing, list[messages.Example], lambda message, context: examples()),
    "example": Request(messages.ExampleName, messages.Project, lambda wanted, context: example(wanted.id)),
    "missions": Request(Nothing, list[missions.MissionEntry], _list_missions),
    "mission": Request(messages.MissionChoice, missions.Mission, _open_mission),
    "missions/notes": Request(
        messages.MissionChoice, missions.MissionNotes, lambda choice, context: missions.mission_notes(choice)
    ),
    "missions/open": Request(messages.Text, missions.Mission, lambda file, context: missions.open_mission_text(file)),
    "missions/save-text": Request(
        messages.MissionChoice, messages.Text, lambda choice, context: missions.mission_text(choice)
    ),
    "missions/check": Request(missions.MissionAttempt, missions.MissionResult, _check_mission),
    "missions/own": Request(Nothing, list[messages.LibraryEntry], _list_own_missions),
    "missions/read": Request(messages.ProjectName, missions.Mission, _read_own_mission),
    "missions/write": Request(missions.MissionToSave, messages.SavedVersion, _write_own_mission),
    "missions/delete": Request(messages.ProjectName, Nothing, _delete_own_mission),
    "event-table": Request(messages.EventRows, messages.Text, lambda sent, context: event_table(sent)),
    "ports": Request(Nothing, list[messages.Port], lambda message, context: context.ports()),
    "projects/list": Request(Nothing, list[messages.LibraryEntry], _list_projects),
    "projects/read": Request(messages.ProjectVersion, messages.StoredProject, _read_project),
    "projects/write": Request(messages.ProjectToSave, messages.SavedVersion, _write_project),
    "projects/history": Request(messages.ProjectName, list[messages.Version], _list_versions),
    "projects/delete": Request(messages.ProjectName, Nothing, _delete_project),
    "projects/place": Request(
        Nothing, messages.StorageState, lambda message, context: context.storage.place(context.owner)
    ),
    "projects/export": Request(
        Nothing, library.Exported, lambda message, context: library.export_all(context.storage, context.owner)
    ),
    "projects/import": Request(
        messages.Text,
        library.Imported,
        lambda file, context: library.import_all(context.storage, context.owner, file.text),
    ),
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
