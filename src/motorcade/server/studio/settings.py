"""What one studio is started with."""

import ssl
from dataclasses import dataclass
from pathlib import Path

from motorcade.server.pages import PAGE
from motorcade.server.remote.remote_cars import RemoteCar
from motorcade.server.settings import ServerSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(ServerSettings):
    """How a studio runs; the same for all who use it.

    Attributes:
        library: the folder that projects are kept in.
        page: the folder of the built page.
        most_sessions: the most worlds at once.
        most_cars: the most cars in one of them.
        cars, keys, trust: real cars, as `motorcade.server.remote.remote_cars.RemoteCars` has them.
    """

    library: Path
    page: Path = PAGE
    most_sessions: int = 64
    most_cars: int = 2_000
    cars: tuple[RemoteCar, ...] = ()
    keys: ssl.SSLContext | None = None
    trust: ssl.SSLContext | None = None
