"""The command of a car that is driven: drive serve; the drivers' commands are in `motorcade.cli.driving`.

It imports what it needs when it runs, so that the other commands start at once.
"""

import sys
from collections import deque
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli import driving, far_cars
from motorcade.cli.car_options import (
    KEYBOARD,
    CarOptions,
    NumberOption,
    Role,
    RoleOption,
    StoreOption,
    VoiceMapOption,
    VoiceOption,
)
from motorcade.cli.driving_texts import SERVED
from motorcade.cli.failures import UsageError
from motorcade.cli.language import Language, resolve_locale
from motorcade.cli.options import Json, ProfileOption, compiling_announced, image_of, print_text, profile_named
from motorcade.cli.recordings import needs_extra
from motorcade.cli.remote import Looks
from motorcade.cli.stick import StickName, stick_at_the_car

if TYPE_CHECKING:
    import socket
    import ssl

    from motorcade.cameras.broadcast import Source
    from motorcade.car.drive_board import DriveBoard
    from motorcade.cli.car_options import CarParts
    from motorcade.config.profile import Profile

_PORT = 5005


class BoardName(StrEnum):
    """The cars that can be served."""

    SIMULATED = "simulated"
    RASPBERRY_PI = "raspberry-pi"


class ByteOrder(StrEnum):
    """Of the four bytes of a command."""

    BIG = "big"
    LITTLE = "little"


def add_to(app: typer.Typer) -> None:
    """Register the group and its commands."""
    group = typer.Typer(help="Drive a car over a network, and be one that is driven.")
    group.command("serve")(serve_command)
    driving.add_to(group)
    far_cars.add_to(group)
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
    role: RoleOption = Role.LEADER,
    number: NumberOption = 0,
    upload_serial: Annotated[str, typer.Option(help="The serial port that a real car's uploads come by.")] = "",
    upload_tcp: Annotated[str, typer.Option(help="Take uploads at HOST:PORT instead; port 0 takes a free one.")] = "",
    store: StoreOption = None,
    voice: VoiceOption = "",
    voice_map: VoiceMapOption = None,
    web: Annotated[
        int | None, typer.Option(min=0, max=65535, help="For the car's own page, to drive it in a browser; 0: any.")
    ] = None,
    camera: Annotated[Looks, typer.Option(help="What a real car sees by. A simulated one sees anyway.")] = Looks.NONE,
    mat: Annotated[
        Path | None, typer.Option(exists=True, dir_okay=False, help="Where a simulated car drives; car 0 is it.")
    ] = None,
    program: Annotated[
        Path | None,
        typer.Option(exists=True, dir_okay=False, help="What simulated leaders run: project or image."),
    ] = None,
    stick: Annotated[
        StickName | None,
        typer.Option(help="What drives at the car itself, before everybody else; keys as in `drive connect`."),
    ] = None,
    profile: ProfileOption = "classroom",
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Be a car that is driven: take commands, and stand still when they stop.

    A real car also holds an image and runs it, by which it drives where it is left to it.
    """
    import asyncio

    from motorcade.cli.remote import Web, eye, https, load_page
    from motorcade.cli.serving import ServeOptions, serve
    from motorcade.drive.listener import bind

    spoken = resolve_locale(language)
    texts = SERVED[spoken]
    if keys and insecure_lan:
        raise UsageError(texts["keys-and-lan"])
    if (pins is None) != (board == BoardName.SIMULATED):
        raise UsageError(texts["pins"])
    if pins and (mat or program):
        raise UsageError(texts["simulated-only"])
    asked = CarOptions(role, number, upload_serial, upload_tcp, store, voice, voice_map)
    _check_asked(asked, pins is not None, stick, texts)
    chosen, at_the_car = profile_named(profile), stick_at_the_car(stick) if stick else None
    tls = _tls(keys)
    second = telemetry_port if telemetry_port is not None else port and port + 1
    with ExitStack() as held:
        commands, telemetry = (held.enter_context(bind(host, each)) for each in (port, second))
        _check_reach(commands, tls, insecure_lan, texts)
        page = held.enter_context(bind(host, web)) if web is not None else None
        if page:
            load_page()
        notes: deque[str] = deque()
        fitted = _fitted(held, asked, chosen, notes, insecure_lan, texts) if pins else None
        if pins and fitted:
            car, sees = _real(fitted, pins, chosen, gpio_chip, watchdog), eye(camera) if page else None
        else:
            image, chosen = image_of(program, profile, spoken) if program else (bytes(4), chosen)
            car, sees = _simulated(held, chosen, mat, image)
        door = Web(page, host, https(keys), sees) if page else None
        offer = ServeOptions(commands, telemetry, tls, byte_order, as_json, door, at_the_car, fitted, notes, spoken)
        asyncio.run(serve(car, chosen, offer))
    if not as_json:
        print_text(texts["stands"] + "\n")


def _tls(keys: Path | None) -> "ssl.SSLContext | None":
    if keys is None:
        return None
    from motorcade.drive.tls.keys import server_context

    return server_context(keys)


def _check_reach(
    listener: "socket.socket", tls: "ssl.SSLContext | None", insecure_lan: bool, texts: dict[str, str]
) -> None:
    """Refuse an address that others reach, unless it is clear who of them may drive."""
    from motorcade.drive.listener import is_loopback

    if is_loopback(listener) or tls:
        return
    host = listener.getsockname()[0]
    if not insecure_lan:
        raise UsageError(texts["no-keys"].format(host=host))
    print(texts["open"].format(host=host), file=sys.stderr, flush=True)


def _check_asked(asked: CarOptions, is_real: bool, stick: StickName | None, texts: dict[str, str]) -> None:
    if not is_real and asked != CarOptions():
        raise UsageError(texts["real-only"])
    if asked.serial and asked.tcp:
        raise UsageError(texts["two-lines"])
    if asked.voice == KEYBOARD and stick == StickName.KEYBOARD:
        raise UsageError(texts["one-keyboard"])


def _fitted(
    held: ExitStack, asked: CarOptions, profile: "Profile", notes: deque[str], insecure_lan: bool, texts: dict[str, str]
) -> "CarParts":
    """A real car's equipment; uploads and faults of its program are noted."""
    import ipaddress

    from motorcade.cli.car_options import open_parts
    from motorcade.cli.options import host_and_port

    def observe(kind: str, at_ms: int, word: int, detail: int | str) -> None:
        if kind == "image":
            notes.append(texts["image"].format(bytes=word))
        elif kind == "fault":
            notes.append(str(detail))

    fitted = open_parts(held, asked, profile, observe)
    if asked.tcp and not insecure_lan:
        host, _ = host_and_port(fitted.address.removeprefix("socket://"))
        if not ipaddress.ip_address(host.partition("%")[0]).is_loopback:
            raise UsageError(texts["open-uploads"].format(host=host))
    return fitted


def _real(
    fitted: "CarParts", pins: Path, profile: "Profile", gpio_chip: int | None, watchdog: Path | None
) -> "DriveBoard":
    with needs_extra("a car's pins", "pi"):
        from motorcade.boards.linux.opening import open_drive
    from motorcade.config.pins import load_pins

    return open_drive(fitted.equipment, load_pins(pins), profile, gpio_chip, watchdog)


def _simulated(held: ExitStack, profile: "Profile", mat: Path | None, image: bytes) -> "tuple[DriveBoard, Source]":
    """The first car of a world of its own, which goes on until ``held`` is closed, and what it sees."""
    with needs_extra("a simulated car"):
        from motorcade.boards.simulated_drive import LiveWorld, SimulatedCamera
        from motorcade.engine.world import World
        from motorcade.mats import check_mat, playground, read_mat

    place = read_mat(mat) if mat else playground()
    check_mat(place, profile)
    with compiling_announced():
        live = held.enter_context(LiveWorld(World(place, [image], profile, threads=1)))
    return live.board(0), SimulatedCamera(live, 0)
