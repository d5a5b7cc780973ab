"""Who may reach a server, and how much they may ask of it."""

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerSettings:
    """How a server is reached; the same for all who use it.

    Attributes:
        host, port: where it listens.
        names: the names, beside addresses, under which others reach it.
        token: what a page must know to be served; None on a loopback address, which others can't reach.
        clock: seconds that only grow.
        most_body: the most bytes of a request's body or of a message.
        requests_a_second, messages_a_second: what one address may ask, and one WebSocket may say;
            twice as much for a moment.
    """

    host: str = "127.0.0.1"
    port: int = 7700
    names: frozenset[str] = frozenset()
    token: str | None = None
    clock: Callable[[], float] = time.monotonic
    most_body: int = 1 << 20
    requests_a_second: int = 500
    messages_a_second: int = 250
