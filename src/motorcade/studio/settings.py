"""What one studio is started with."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How a studio runs; the same for all who use it.

    Attributes:
        library: the folder that projects are kept in.
        host, port: where it listens.
        names: the names, beside addresses, under which others reach it.
        token: what a page must know to be served; None on a loopback address, which others can't reach.
        page: the folder of the built page.
        clock: seconds that only grow.
        most_body: the most bytes of a request's body or of a message.
        most_sessions: the most worlds at once.
        most_cars: the most cars in one of them.
        requests_a_second, messages_a_second: what one address may ask, and one WebSocket may say;
            twice as much for a moment.
    """

    library: Path
    host: str = "127.0.0.1"
    port: int = 7700
    names: frozenset[str] = frozenset()
    token: str | None = None
    page: Path = Path(__file__).parent / "page"
    clock: Callable[[], float] = time.monotonic
    most_body: int = 1 << 20
    most_sessions: int = 64
    most_cars: int = 2_000
    requests_a_second: int = 500
    messages_a_second: int = 250
