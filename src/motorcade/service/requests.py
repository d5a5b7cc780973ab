"""The requests of a page: one table from a request's name to the function that answers it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec
from msgspec import structs

from motorcade.errors import MotorcadeError
from motorcade.missions.check import open_worlds_here
from motorcade.missions.odds import OpenWorlds
from motorcade.program.diagnostics import ProgramError
from motorcade.service import calibration, library, messages, missions
from motorcade.service.documents import example, examples, open_file, open_mat, open_text, opening, project_text
from motorcade.service.history import event_table
from motorcade.service.library import Storage, mission_library
from motorcade.service.messages import Endpoint, Nothing
from motorcade.service.programs import (
    blocks_to_python,
    compile_blocks,
    decompile_image,
    profile_figures,
    python_to_blocks,
)
from motorcade.service.why import carry_out


@dataclass(frozen=True, slots=True)
class Context:
    """What a shell provides for the requests. Its methods answer those that need it.

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

    @property
    def stars(self) -> missions.Stars:
        """The stars that the owner has earned."""
        return self.storage.stars(self.owner)

    def list_capabilities(self) -> messages.Capabilities:
        return self.capabilities

    def list_ports(self) -> list[messages.Port]:
        return self.ports()

    def list_projects(self) -> list[messages.LibraryEntry]:
        return self.storage.list(self.owner)

    def read_project(self, name: str, version: messages.VersionNumber | None = None) -> messages.StoredProject:
        """Return a version of a project; None for the newest."""
        if version is None:
            version = self.storage.history(self.owner, name)[0].version
        text = self.storage.read(self.owner, name, version)
        try:
            project = open_text(text)
        except ProgramError:
            raise MotorcadeError("damaged-version", name=name) from None
        return messages.StoredProject(**structs.asdict(project), name=name, version=version)

    def write_project(
        self, name: str, project: messages.Project, base: messages.VersionNumber | None = None
    ) -> messages.SavedVersion:
        """Store a project; ``base`` as `Storage.write_version` takes it."""
        return self._write(self.owner, name, project_text(project), base)

    def list_versions(self, name: str) -> list[messages.Version]:
        return self.storage.history(self.owner, name)

    def delete_project(self, name: str) -> None:
        self.storage.delete(self.owner, name)

    def find_place(self) -> messages.StorageState:
        return self.storage.place()

    def list_own_missions(self) -> list[messages.LibraryEntry]:
        return self.storage.list(mission_library(self.owner))

    def read_own_mission(self, name: str) -> missions.Mission:
        text = self.storage.read(mission_library(self.owner), name)
        return missions.open_mission_text(text.decode(errors="replace"))

    def write_own_mission(self, name: str, document: messages.MissionDocument) -> messages.SavedVersion:
        text = missions.mission_text(messages.MissionChoice(document=document)).text
        return self._write(mission_library(self.owner), name, text)

    def delete_own_mission(self, name: str) -> None:
        self.storage.delete(mission_library(self.owner), name)

    def check_mission(self, attempt: missions.MissionAttempt) -> missions.MissionResult:
        result = missions.check_attempt(attempt, self.open_worlds)
        if attempt.mission.document is None:
            result.earned = self.storage.add_stars(self.owner, attempt.mission.id, result.stars)
        return result

    def _write(self, owner: str, name: str, text: str, base: int | None = None) -> messages.SavedVersion:
        version = self.storage.write_version(owner, name, text.encode(), base)
        return messages.SavedVersion(version, self.storage.place().stays)


def _save_text(project: messages.Project) -> messages.Text:
    return messages.Text(project_text(project))


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "capabilities": Context.list_capabilities,
    "profiles": profile_figures,
    "calibration/moves": calibration.list_moves,
    "calibration/fit": calibration.fit_readings,
    "compile": compile_blocks,
    "decompile": decompile_image,
    "blocks-to-python": blocks_to_python,
    "python-to-blocks": python_to_blocks,
    "remedy": carry_out,
    "open": open_file,
    "save-text": _save_text,
    "mats/open": open_mat,
    "opening": opening,
    "examples": examples,
    "example": example,
    "missions": missions.list_missions,
    "mission": missions.open_mission,
    "missions/notes": missions.mission_notes,
    "missions/open": missions.open_mission_text,
    "missions/save-text": missions.mission_text,
    "missions/check": Context.check_mission,
    "missions/own": Context.list_own_missions,
    "missions/read": Context.read_own_mission,
    "missions/write": Context.write_own_mission,
    "missions/delete": Context.delete_own_mission,
    "event-table": event_table,
    "ports": Context.list_ports,
    "projects/list": Context.list_projects,
    "projects/read": Context.read_project,
    "projects/write": Context.write_project,
    "projects/history": Context.list_versions,
    "projects/delete": Context.delete_project,
    "projects/place": Context.find_place,
    "projects/export": library.export_all,
    "projects/import": library.import_all,
}
# What a function is given of the context; a method of `Context` is given all of it.
_GIVEN = ("self", "storage", "owner", "stars")
REQUESTS = {name: Endpoint.of(function, _GIVEN) for name, function in _FUNCTIONS.items()}


def respond(name: str, data: bytes, context: Context) -> bytes:
    """Answer the request ``name`` of REQUESTS; message and answer are JSON, no message means no arguments.

    Raises MotorcadeError where there is no such request, or it is refused.
    """
    if name not in REQUESTS:
        raise MotorcadeError("not-found")
    request = REQUESTS[name]
    arguments = request.arguments(data)
    given = {name: context if name == "self" else getattr(context, name) for name in request.given}
    answer = request.function(**given, **arguments)
    return msgspec.json.encode(Nothing() if answer is None else answer)
