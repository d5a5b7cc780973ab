"""The command `drive serve`; the drivers' commands are in `motorcade.cli.driving`.

It imports what it needs when it runs, so that the other commands start at once.
"""

import sys
from collections import deque
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli import driving, remote
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
from motorcade.cli.driving import StickName, open_stick
from motorcade.cli.language import Language, resolve_locale
from motorcade.cli.options import (
    Json,
    ProfileOption,
    compiling_announced,
    host_and_port,
    image_of,
    needs_extra,
    print_text,
    profile_named,
)
from motorcade.cli.remote import CameraName
from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import command_line_text

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
    remote.add_to(group)
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
    camera: Annotated[
        CameraName, typer.Option(help="A real car's camera. A simulated car always has one.")
    ] = CameraName.NONE,
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
    """Serve a car that is driven over a network; it stands still when no commands come.

    A real car also holds an image and runs it; on request the image drives.
    """
    import asyncio

    from motorcade.cli.remote import PageOptions, https, load_page, open_camera
    from motorcade.cli.serving import ServeOptions, serve
    from motorcade.drive.listener import bind

    locale = resolve_locale(language)
    options = CarOptions(role, number, upload_serial, upload_tcp, store, voice, voice_map)
    if keys and insecure_lan:
        raise MotorcadeError("options-exclude-each-other", first="--keys", second="--insecure-lan")
    if (pins is None) != (board == BoardName.SIMULATED):
        raise MotorcadeError("pins-and-board")
    if pins and (mat or program):
        raise MotorcadeError("options-of-simulated-cars")
    _check_options(options, pins is not None, stick)
    chosen, source = profile_named(profile), open_stick(stick) if stick else None
    tls = _tls(keys)
    second = telemetry_port if telemetry_port is not None else port and port + 1
    with ExitStack() as resources:
        commands, telemetry = (resources.enter_context(bind(host, each)) for each in (port, second))
        _check_reach(commands, tls, insecure_lan, locale)
        page = resources.enter_context(bind(host, web)) if web is not None else None
        if page:
            load_page()
        notes: deque[Phrase | str] = deque()
        parts = _open_parts(resources, options, chosen, notes, insecure_lan) if pins else None
        if pins and parts:
            car, pictures = _open_real(parts, pins, chosen, gpio_chip, watchdog), open_camera(camera) if page else None
        else:
            image, chosen = image_of(program, profile, locale) if program else (bytes(4), chosen)
            car, pictures = _open_simulated(resources, chosen, mat, image)
        page_options = PageOptions(page, host, https(keys), pictures) if page else None
        serve_options = ServeOptions(
            commands, telemetry, tls, byte_order, as_json, page_options, source, parts, notes, locale
        )
        asyncio.run(serve(car, chosen, serve_options))
    if not as_json:
        print_text(command_line_text("serve-ended", locale) + "\n")


def _tls(keys: Path | None) -> "ssl.SSLContext | None":
    if keys is None:
        return None
    from motorcade.drive.tls.keys import server_context

    return server_context(keys)


def _check_reach(listener: "socket.socket", tls: "ssl.SSLContext | None", insecure_lan: bool, locale: str) -> None:
    """Refuse an address that other computers reach, unless it is clear who may drive. Raises MotorcadeError."""
    from motorcade.drive.listener import is_loopback

    if is_loopback(listener) or tls:
        return
    host = listener.getsockname()[0]
    if not insecure_lan:
        raise MotorcadeError("address-without-keys", host=host)
    print(command_line_text("serve-insecure", locale, host=host), file=sys.stderr, flush=True)


def _check_options(options: CarOptions, is_real: bool, stick: StickName | None) -> None:
    if not is_real and options != CarOptions():
        raise MotorcadeError("options-of-real-cars")
    if options.serial and options.tcp:
        raise MotorcadeError("options-exclude-each-other", first="--upload-serial", second="--upload-tcp")
    if options.voice == KEYBOARD and stick == StickName.KEYBOARD:
        raise MotorcadeError("options-exclude-each-other", first="--voice keyboard", second="--stick keyboard")


def _open_parts(
    resources: ExitStack, options: CarOptions, profile: "Profile", notes: deque[Phrase | str], insecure_lan: bool
) -> "CarParts":
    """Open a real car's equipment; uploads and faults of its program are noted. Raises MotorcadeError."""
    import ipaddress

    from motorcade.cli.car_options import open_parts

    def observe(kind: str, at_ms: int, word: int, detail: int | str) -> None:
        if kind == "image":
            notes.append(Phrase("serve-image", bytes=word))
        elif kind == "fault":
            notes.append(str(detail))

    parts = open_parts(resources, options, profile, observe)
    if options.tcp and not insecure_lan:
        host, _ = host_and_port(parts.address.removeprefix("socket://"))
        if not ipaddress.ip_address(host.partition("%")[0]).is_loopback:
            raise MotorcadeError("uploads-in-reach", host=host)
    return parts


def _open_real(
    parts: "CarParts", pins: Path, profile: "Profile", gpio_chip: int | None, watchdog: Path | None
) -> "DriveBoard":
    with needs_extra("pins", "pi"):
        from motorcade.boards.linux.opening import open_drive
    from motorcade.config.pins import load_pins

    return open_drive(parts.equipment, load_pins(pins), profile, gpio_chip, watchdog)


def _open_simulated(
    resources: ExitStack, profile: "Profile", mat: Path | None, image: bytes
) -> "tuple[DriveBoard, Source]":
    """Start a simulated world. Returns its first car and that car's pictures; closing ``resources`` ends the world."""
    with needs_extra("simulated-car"):
        from motorcade.boards.simulated_drive import LiveWorld, SimulatedCamera
        from motorcade.engine.world import World
        from motorcade.mats import check_mat, playground, read_mat

    place = read_mat(mat) if mat else playground()
    check_mat(place, profile)
    with compiling_announced():
        live = resources.enter_context(LiveWorld(World(place, [image], profile, threads=1)))
    return live.board(0), SimulatedCamera(live, 0)
