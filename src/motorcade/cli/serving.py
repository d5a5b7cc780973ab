"""A car that is served: its doors and its page, until a signal ends it. Apart, since asyncio is slow to import."""

import asyncio
import signal
import socket
import ssl
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, AsyncExitStack, contextmanager
from typing import TYPE_CHECKING, NamedTuple

from motorcade.cli.driving_texts import SERVED, STATES
from motorcade.cli.options import print_json, print_text
from motorcade.cli.remote import Web, page_served
from motorcade.drive.input.local import reading_input
from motorcade.drive.safety.watchdog import watched
from motorcade.drive.server import DriveServer, serving
from motorcade.drive.session import CarControl
from motorcade.errors import MotorcadeError, Phrase
from motorcade.timing import monotonic_ms

if TYPE_CHECKING:
    from motorcade.car.drive_board import DriveBoard
    from motorcade.cli.car_options import CarParts
    from motorcade.config.profile import Profile
    from motorcade.drive.input.deadman import StickSource
    from motorcade.drive.wire import Telemetry

_LOOK_S, _LAST_WORD_S = 0.1, 1.0
_ENDS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")


class ServeOptions(NamedTuple):
    """How a car is served.

    Attributes:
        commands, telemetry: where it listens.
        tls: for both; None for none.
        byte_order: of commands.
        as_json: whether to print JSON.
        web: its page's door, if it has one.
        stick: what drives at the car itself, if anything does.
        fitted: what a real car's program was given; None for a simulated car.
        notes: sentences for the log, which others add to.
        language: en or zh.
    """

    commands: socket.socket
    telemetry: socket.socket
    tls: ssl.SSLContext | None
    byte_order: str
    as_json: bool
    web: Web | None
    stick: "AbstractContextManager[StickSource] | None"
    fitted: "CarParts | None"
    notes: deque[str]
    language: str


async def serve(board: "DriveBoard", profile: "Profile", offer: ServeOptions) -> None:
    """Serve until a signal ends it."""
    drive = CarControl(board, monotonic_ms, profile)
    server = DriveServer(drive, offer.byte_order)
    ended, loop = asyncio.Event(), asyncio.get_running_loop()

    def end() -> None:
        loop.call_soon_threadsafe(ended.set)

    def report(sentence: Phrase | MotorcadeError) -> None:
        _log(sentence.sentence(offer.language))

    _on_signals(end)
    async with AsyncExitStack() as held:
        await held.enter_async_context(watched(drive))
        doors = await held.enter_async_context(serving(server, offer.commands, offer.telemetry, offer.tls))
        if offer.stick:
            await held.enter_async_context(reading_input(drive, offer.stick, report, end))
        url = await held.enter_async_context(page_served(drive, offer.web)) if offer.web else None
        held.enter_context(_logged(drive.telemetry, offer.notes, offer.language))
        (host, port), (_, telemetry_port) = (door.address for door in doors)
        _tell_begin(host, port, telemetry_port, url, offer)
        await ended.wait()


def _tell_begin(host: str, port: int, telemetry_port: int, url: str | None, offer: ServeOptions) -> None:
    fitted = offer.fitted
    if offer.as_json:
        told = {"host": host, "port": port, "telemetry_port": telemetry_port, "tls": offer.tls is not None}
        kept = {"uploads": fitted.address, "store": str(fitted.store)} if fitted else {}
        print_json(told | ({"url": url} if url else {}) | kept)
        return
    texts = SERVED[offer.language]
    uploads = texts["uploads"].format(address=fitted.address) if fitted and fitted.address else ""
    more = uploads + (texts["page"].format(url=url) if url else "")
    print_text(texts["serves"].format(host=host, port=port, telemetry_port=telemetry_port, more=more) + "\n")


def _on_signals(end: Callable[[], None]) -> None:
    for name in _ENDS:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), lambda number, frame: end())


@contextmanager
def _logged(telemetry: "Callable[[], Telemetry]", notes: deque[str], language: str) -> Iterator[None]:
    """Say who drives and what state the car is in, whenever that changes: a terminal that hangs doesn't stop a car."""
    over = threading.Event()
    told = (telemetry, _shown(telemetry()), notes, language, over)
    thread = threading.Thread(target=_log_changes, args=told, name="log", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join(_LAST_WORD_S)


def _log_changes(
    telemetry: "Callable[[], Telemetry]",
    last: tuple[object, ...],
    notes: deque[str],
    language: str,
    over: threading.Event,
) -> None:
    is_over = False
    while not is_over:
        is_over = over.wait(_LOOK_S)
        while notes:
            _log(notes.popleft())
        told = telemetry()
        if _shown(told) != last:
            _log(_line(told, language))
        last = _shown(told)


def _line(told: "Telemetry", language: str) -> str:
    texts, state = SERVED[language], STATES[language][told.state]
    line = texts["drives" if told.driver else "nobody"].format(state=state, driver=told.driver)
    return texts["fault"].format(told=line, fault=told.last_fault) if told.last_fault else line


def _shown(told: "Telemetry") -> tuple[object, ...]:
    """What is worth a line when it changes."""
    return told.driver, told.state in ("standing", "moving") or told.state, told.last_fault


def _log(sentence: str) -> None:
    print(f"{time.strftime('%H:%M:%S')} {sentence}", file=sys.stderr, flush=True)
