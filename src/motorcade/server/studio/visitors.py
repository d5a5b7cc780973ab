"""Who visits a studio, and what each visitor may do."""

from collections.abc import Iterable
from contextlib import AbstractAsyncContextManager, AbstractContextManager, nullcontext
from pathlib import Path

from starlette.requests import HTTPConnection

from motorcade.server.studio.library import FolderStorage
from motorcade.server.studio.uploads import VirtualCar, listed_ports
from motorcade.service.library import Storage
from motorcade.service.messages import Capabilities
from motorcade.service.requests import Context
from motorcade.service.world_messages import WorldAnswer, WorldMessage


class Visitors:
    """The visitors of a studio of one user: whoever is let in may do everything, and all share one library.

    A class has others (`motorcade.server.classroom.visitors`).

    Args:
        library: the folder of the projects.
        capabilities: what the server can do.
    """

    def __init__(self, library: Path, capabilities: Capabilities) -> None:
        self.storage: Storage = FolderStorage(library)
        self.capabilities = capabilities
        self._car = VirtualCar(library / "virtual-car.image")

    def visitor(self, connection: HTTPConnection) -> str:
        """Whom a connection counts for: its address. Raises MotorcadeError where nobody of that kind is let in."""
        return connection.client.host if connection.client else ""

    def context(self, visitor: str) -> Context:
        """What requests of a visitor work with."""
        return Context(self.capabilities, self.storage, listed_ports)

    def may_use(self, visitor: str, owner: str) -> bool:
        """Whether a visitor may use a world that another one began: a computer's address may change."""
        return True

    def check_message(self, visitor: str, message: WorldMessage) -> None:
        """Raise MotorcadeError where the visitor's world may not do that at present."""

    def note_answers(self, visitor: str, answers: Iterable[WorldAnswer | bytes]) -> None:
        """See what a visitor's world sends to its page."""

    def note_answered(self, visitor: str, request: str) -> None:
        """A request of a visitor was answered."""

    def check_request(self, visitor: str, now_s: float) -> None:
        """Raise MotorcadeError where the visitor may not send one more request now."""

    def in_turn(self, visitor: str, request: str) -> AbstractAsyncContextManager[None]:
        """Keep a request back while others of the same visitor are to be answered before; here none is."""
        return nullcontext()

    def virtual_car(self, connection: HTTPConnection, port: str) -> AbstractContextManager[VirtualCar]:
        """Give the simulated car of a visitor while a transfer through ``port`` runs.

        Raises MotorcadeError where the visitor may not use that port.
        """
        return nullcontext(self._car)
