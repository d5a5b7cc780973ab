"""The command of a car that is driven: drive serve; the drivers' commands are in `motorcade.cli.driving`.

It imports what it needs when it runs, so that the other commands start at once.
"""

import asyncio
import signal
import socket
import ssl
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from motorcade.cli import driving
from motorcade.cli.failures import UsageError
from motorcade.cli.options import Json, ProfileOption, print_json, print_text, profile_named
from motorcade.cli.recordings import needs_extra

if TYPE_CHECKING:
    from motorcade.car.drive_board import DriveBoard
    from motorcade.link.telemetry import Telemetry
    from motorcade.profile import Profile

_PORT = 5005
_ENDS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")


class BoardName(StrEnum):
    """The cars that can be served."""

    SIMULATED = "simulated"
    RASPBERRY_PI = "raspberry-pi"


class ByteOrder(StrEnum):
    """Of the four bytes of a command."""

    BIG = "big"
    LITTLE = "little"


class _Offer(NamedTuple):
    """How a car is served."""

    commands: socket.socket
    telemetry: socket.socket
    tls: ssl.SSLContext | None
    byte_order: str
    as_json: bool


def add_to(app: typer.Typer) -> None:
    """Register the group and its commands."""
    group = typer.Typer(help="Drive a car over a network, and be one that is driven.")
    group.command("serve")(serve_command)
    driving.add_to(group)
    app.add_typer(group, name="drive")


def serve_command(
    board: Annotated[BoardName, typer.Option(help="The car; simulated needs no hardware.")] = BoardName.SIMULATED,
    host: Annotated[str, typer.Option(help="The address that it listens at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="For commands; 0 takes a free one.")] = _PORT,
    telemetry_port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="For telemetry and requests; the one behind --port.")
    ] = None,
    keys: Annotated[
        Path | None,
        typer.Option(dir_okay=False, help="The car's keys file, car-….pem: only drivers of the same authority get in."),
    ] = None,
    insecure_lan: Annotated[
        bool, typer.Option("--insecure-lan", help="Let everybody drive who reaches the address, without keys.")
    ] = False,
    byte_order: Annotated[ByteOrder, typer.Option(help="Of a command's four bytes.")] = ByteOrder.BIG,
    pins: Annotated[
        Path | None, typer.Option(exists=True, dir_okay=False, help="A real car's pin file: which part is where.")
    ] = None,
    gpio_chip: Annotated[
        int | None, typer.Option(min=0, help="N of /dev/gpiochipN; the computer's own, unless given.")
    ] = None,
    watchdog: Annotated[Path | None, typer.Option(help="Feed this hardware watchdog, such as /dev/watchdog.")] = None,
    profile: ProfileOption = "classroom",
    as_json: Json = False,
) -> None:
    """Be a car that is driven: take commands, and stand still when they stop."""
    from motorcade.link.addresses import bind

    if keys and insecure_lan:
        raise UsageError("--keys and --insecure-lan exclude each other: with keys nobody else gets in")
    if (pins is None) != (board == BoardName.SIMULATED):
        raise UsageError("a real car needs its pin file, --pins, and a simulated one has none")
    chosen = profile_named(profile)
    tls = _tls(keys)
    second = telemetry_port if telemetry_port is not None else port and port + 1
    with ExitStack() as held:
        commands, telemetry = (held.enter_context(bind(host, each)) for each in (port, second))
        _check_reach(commands, tls, insecure_lan)
        car = _real(pins, chosen, gpio_chip, watchdog) if pins else _simulated(held, chosen)
        asyncio.run(_serve(car, chosen, _Offer(commands, telemetry, tls, byte_order, as_json)))
    if not as_json:
        print_text("The car stands still.\n")


def _tls(keys: Path | None) -> ssl.SSLContext | None:
    if keys is None:
        return None
    from motorcade.link.keys import server_context

    return server_context(keys)


def _check_reach(listener: socket.socket, tls: ssl.SSLContext | None, insecure_lan: bool) -> None:
    """Refuse an address that others reach, unless it is clear who of them may drive."""
    from motorcade.link.addresses import is_loopback

    if is_loopback(listener) or tls:
        return
    host = listener.getsockname()[0]
    if not insecure_lan:
        raise UsageError(
            f"at {host} others can reach this car: give it keys, --keys car-….pem (`motorcade drive keys` makes them), "
            "or let everybody drive it with --insecure-lan"
        )
    _log(f"Everybody who reaches {host} may drive this car, and nothing that is sent is secret: --insecure-lan")


def _real(pins: Path, profile: "Profile", gpio_chip: int | None, watchdog: Path | None) -> "DriveBoard":
    with needs_extra("a car's pins", "pi"):
        from motorcade.boards.opening import open_drive
    from motorcade.boards.pins import load_pins

    return open_drive(load_pins(pins), profile, gpio_chip, watchdog)


def _simulated(held: ExitStack, profile: "Profile") -> "DriveBoard":
    """The only car of a world of its own, which goes on until ``held`` is closed."""
    with needs_extra("a simulated car"):
        from motorcade.sim.drive_board import LiveWorld
        from motorcade.sim.mat import formation, open_table
        from motorcade.sim.world import World

    world = World(open_table(formation(1)), [bytes(4)], profile=profile, threads=1)
    return held.enter_context(LiveWorld(world)).board(0)


async def _serve(board: "DriveBoard", profile: "Profile", offer: _Offer) -> None:
    """Serve until a signal ends it."""
    from motorcade.link.clock import monotonic_ms
    from motorcade.link.drive_server import DriveServer, served
    from motorcade.link.driving import Drive
    from motorcade.link.watchdog import kept

    drive = Drive(board, monotonic_ms, profile)
    server = DriveServer(drive, profile, offer.byte_order)
    ended = asyncio.Event()
    _on_signals(ended)
    async with kept(drive), served(server, offer.commands, offer.telemetry, offer.tls) as doors:
        (host, port), (_, telemetry_port) = (door.address for door in doors)
        if offer.as_json:
            print_json({"host": host, "port": port, "telemetry_port": telemetry_port, "tls": offer.tls is not None})
        else:
            print_text(
                f"The car takes commands at {host} port {port}, telemetry is at {telemetry_port}. Ctrl-C ends.\n"
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
