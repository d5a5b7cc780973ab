"""A car that is served: its doors and its page, until a signal ends it. Apart, since asyncio is slow to import."""

import asyncio
import signal
import socket
import ssl
import sys
import time
from collections.abc import Callable
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, NamedTuple

from motorcade.cli.options import print_json, print_text
from motorcade.cli.remote import Web, page_served
from motorcade.link.clock import monotonic_ms
from motorcade.link.drive_server import DriveServer, served
from motorcade.link.driving.drive import Drive
from motorcade.link.driving.watchdog import kept

if TYPE_CHECKING:
    from motorcade.car.drive_board import DriveBoard
    from motorcade.link.driving.telemetry import Telemetry
    from motorcade.profile import Profile

_ENDS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")


class Offer(NamedTuple):
    """How a car is served; ``web`` is its page's door, if it has one."""

    commands: socket.socket
    telemetry: socket.socket
    tls: ssl.SSLContext | None
    byte_order: str
    as_json: bool
    web: Web | None


async def serve(board: "DriveBoard", profile: "Profile", offer: Offer) -> None:
    """Serve until a signal ends it."""
    drive = Drive(board, monotonic_ms, profile)
    server = DriveServer(drive, profile, offer.byte_order)
    ended = asyncio.Event()
    _on_signals(ended)
    async with AsyncExitStack() as held:
        await held.enter_async_context(kept(drive))
        doors = await held.enter_async_context(served(server, offer.commands, offer.telemetry, offer.tls))
        url = await held.enter_async_context(page_served(drive, offer.web)) if offer.web else None
        (host, port), (_, telemetry_port) = (door.address for door in doors)
        if offer.as_json:
            told = {"host": host, "port": port, "telemetry_port": telemetry_port, "tls": offer.tls is not None}
            print_json(told | ({"url": url} if url else {}))
        else:
            page = f" Its page is {url}" if url else ""
            print_text(
                f"The car takes commands at {host} port {port}, telemetry is at {telemetry_port}.{page} Ctrl-C ends.\n"
            )
        telling = asyncio.ensure_future(_tell(drive.telemetry))
        await ended.wait()
        telling.cancel()


def _on_signals(ended: asyncio.Event) -> None:
    loop = asyncio.get_running_loop()
    for name in _ENDS:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), lambda number, frame: loop.call_soon_threadsafe(ended.set))


async def _tell(telemetry: "Callable[[], Telemetry]") -> None:
    """Say who drives and what state the car is in, whenever that changes."""
    last: object = None
    while True:
        told = telemetry()
        now = (told.driver, told.state in ("standing", "moving") or told.state, told.last_fault)
        if now != last and last is not None:
            _log(
                f"{told.state}; {told.driver or 'nobody'} drives" + (f"; {told.last_fault}" if told.last_fault else "")
            )
        last = now
        await asyncio.sleep(0.1)


def _log(sentence: str) -> None:
    print(f"{time.strftime('%H:%M:%S')} {sentence}", file=sys.stderr, flush=True)
