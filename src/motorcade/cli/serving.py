"""Serve a car and its page until a signal ends it. A file of its own, because asyncio is slow to import."""

import asyncio
import socket
import ssl
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractAsyncContextManager, AsyncExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from motorcade.cli.ending import Ending
from motorcade.cli.output import plain, print_problem, print_result, sentence_of, translated
from motorcade.drive.channels import Clients
from motorcade.drive.keys import RevokedKeys
from motorcade.drive.server import serving, watched
from motorcade.drive.session import CarControl
from motorcade.errors import MotorcadeError, Phrase

if TYPE_CHECKING:
    from motorcade.cli.car import CarParts
    from motorcade.drive.wire import Telemetry

_PERIOD_S = 0.1
_LAST_LINE_S = 1.0
Note = Phrase | MotorcadeError | str


async def serve(
    clients: Clients,
    sockets: tuple[socket.socket, socket.socket],
    tls: ssl.SSLContext | None,
    page: "Callable[[CarControl], AbstractAsyncContextManager[str]] | None",
    parts: "CarParts | None",
    notes: deque[Note],
    ending: Ending,
) -> None:
    """Serve a car until a signal ends it.

    Args:
        clients: of the car.
        sockets: where it listens for commands, and where it sends telemetry.
        tls: for both; None for none.
        page: serves its page, if it has one, and gives the page's address.
        parts: a real car's equipment; None for a simulated car.
        notes: sentences for the log; other threads append to it.
        ending: tells when a signal comes.
    """
    control = clients.control
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    ending.then(lambda: loop.call_soon_threadsafe(ended.set))
    async with AsyncExitStack() as resources:
        await resources.enter_async_context(watched(control))
        listeners = await resources.enter_async_context(serving(clients, *sockets, tls))
        url = None
        if page:
            url = await resources.enter_async_context(page(control))
        resources.enter_context(_logging(control.telemetry, notes))
        (host, port), (_, telemetry_port) = (listener.address for listener in listeners)
        addresses = {"host": host, "port": port, "telemetry_port": telemetry_port, "tls": tls is not None}
        _print_addresses(addresses | ({"url": url} if url else {}), clients.revoked, parts)
        await ended.wait()


def _print_addresses(data: dict[str, Any], revoked: RevokedKeys | None, parts: "CarParts | None") -> None:
    more = ""
    if parts and parts.address:
        more = translated("serve-uploads", address=parts.address)
    if "url" in data:
        more += translated("serve-page", url=data["url"])
    sentence = translated("serve-begins", **data, more=more)
    problem = None
    if revoked:
        problem = revoked.problem
        data["revoked_problem"] = problem and str(problem)
    if parts:
        data |= {"uploads": parts.address, "store": str(parts.store)}
    print_result(data, sentence)
    print_problem(problem)


@contextmanager
def _logging(telemetry: "Callable[[], Telemetry]", notes: deque[Note]) -> Iterator[None]:
    """Print driver and state whenever they change, and notes, until the block ends."""
    over = threading.Event()
    before = _visible(telemetry())

    def log_changes() -> None:
        is_over = False
        last = before
        while not is_over:
            is_over = over.wait(_PERIOD_S)
            while notes:
                note = notes.popleft()
                _log(note if isinstance(note, str) else sentence_of(note))
            now = telemetry()
            if _visible(now) != last:
                _log(_line(now))
            last = _visible(now)

    thread = threading.Thread(target=log_changes, name="log", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join(_LAST_LINE_S)


def _line(telemetry: "Telemetry") -> str:
    state = Phrase(f"car-state-{telemetry.state}")
    key = "serve-no-driver"
    if telemetry.driver:
        key = "serve-driver"
    line = translated(key, state=state, driver=telemetry.driver)
    if telemetry.last_fault:
        return translated("serve-fault", line=line, fault=telemetry.last_fault)
    return line


def _visible(telemetry: "Telemetry") -> tuple[object, ...]:
    """What is printed when it changes."""
    return telemetry.driver, telemetry.state in ("standing", "moving") or telemetry.state, telemetry.last_fault


def _log(sentence: str) -> None:
    print(f"{time.strftime('%H:%M:%S')} {plain(sentence)}", file=sys.stderr, flush=True)
