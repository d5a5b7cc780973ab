"""Where projects are stored, by owner: what a shell implements, with a folder on disk or a browser's database."""

from typing import NamedTuple, Protocol

from motorcade.service.messages import LibraryEntry, Version


class Quota(NamedTuple):
    """How many bytes an owner's projects use, and how many they may use; None: as many as there is room for."""

    used_bytes: int
    most_bytes: int | None = None


class Storage(Protocol):
    """Projects by owner and name; every version of a project is stored.

    Each method is atomic: another caller sees everything before it or everything after it. Each raises MotorcadeError
    where an owner or a project has a name that can't be.
    """

    def read(self, owner: str, name: str, version: int | None = None) -> bytes:
        """The text of a version, by default of the newest. Raises MotorcadeError where there is none."""

    def write_version(self, owner: str, name: str, data: bytes) -> int:
        """Store ``data`` as the newest version, unless it equals the newest one.

        Returns:
            The number of the version that holds it.

        Raises:
            MotorcadeError: it can't be stored.
        """

    def history(self, owner: str, name: str) -> list[Version]:
        """All versions of a project, the newest first. Raises MotorcadeError where there is no such project."""

    def delete(self, owner: str, name: str) -> None:
        """Remove a project with all its versions from the list. Raises MotorcadeError where there is none."""

    def quota(self, owner: str) -> Quota:
        """How much room an owner has."""

    # The last method: below it `list` would be this one.
    def list(self, owner: str) -> list[LibraryEntry]:
        """All projects of an owner, the one saved last first."""
