"""The command `drive serve`; the drivers' commands are in `motorcade.cli.driving`."""

from collections import deque
from contextlib import ExitStack
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli import driving, pages
from motorcade.cli.car import BoardName, CarOptions, Role
from motorcade.cli.language import Language, translated
from motorcade.cli.options import (
    DEFAULT_PROFILE,
    CarNumber,
    GpioChip,
    ImageProfile,
    Json,
    OptionalFile,
    TcpPortNumber,
    image_for,
    print_lines,
    profile_named,
)
from motorcade.cli.pages import CameraName, KeysFile, LogFile
from motorcade.errors import MotorcadeError, Phrase
from motorcade.extras import needs_extra

if TYPE_CHECKING:
    from motorcade.boards.computer import BatteryFile
    from motorcade.cameras.broadcast import Source
    from motorcade.car.drive_board import DriveBoard
    from motorcade.cli.car import CarParts
    from motorcade.cli.serving import Note
    from motorcade.config.profile import Profile
    from motorcade.drive.tls.revoked import RevokedKeys

app = typer.Typer()
app.add_typer(driving.app)
app.add_typer(pages.remote_app)
OptionalTcpPort = Annotated[int | None, typer.Option(min=0, max=65535)]


class ByteOrder(StrEnum):
    """Of the four bytes of a command."""

    BIG = "big"
    LITTLE = "little"


@app.command("serve")
def _serve(
    board: BoardName = BoardName.SIMULATED,
    host: str = "127.0.0.1",
    port: TcpPortNumber = 5005,
    telemetry_port: OptionalTcpPort = None,
    keys: KeysFile = None,
    revoked: Path | None = None,
    log: LogFile = None,
    insecure_lan: Annotated[bool, typer.Option("--insecure-lan")] = False,
    byte_order: ByteOrder = ByteOrder.BIG,
    arming: Annotated[bool, typer.Option("--arming")] = False,
    pins: OptionalFile = None,
    gpio_chip: GpioChip = None,
    watchdog: Path | None = None,
    battery: OptionalFile = None,
    role: Role = Role.LEADER,
    number: CarNumber = 0,
    upload_serial: str = "",
    upload_tcp: str = "",
    store: Path | None = None,
    voice: str = "",
    voice_map: OptionalFile = None,
    web: OptionalTcpPort = None,
    camera: CameraName = CameraName.NONE,
    mat: OptionalFile = None,
    program: OptionalFile = None,
    profile: ImageProfile = None,
    language: Language = "",
    as_json: Json = False,
) -> None:
    import asyncio

    from motorcade.cli.serving import ServeOptions, serve
    from motorcade.drive.activity_log import logging_to
    from motorcade.drive.listener import bind
    from motorcade.drive.tls.keys import server_context

    options = CarOptions(role, number, upload_serial, upload_tcp, store, voice, voice_map, insecure_lan=insecure_lan)
    if keys and insecure_lan:
        raise MotorcadeError("options-exclude-each-other", first="--keys", second="--insecure-lan")
    if (pins is None) != (board == BoardName.SIMULATED):
        raise MotorcadeError("pins-and-board")
    if pins and (mat or program):
        raise MotorcadeError("options-of-simulated-cars")
    _check_options(options, pins is not None)
    from motorcade.boards.computer import BatteryFile

    chosen = profile_named(profile or DEFAULT_PROFILE)
    measured = BatteryFile(battery) if battery else None
    tls = server_context(keys) if keys else None
    second = telemetry_port if telemetry_port is not None else port and port + 1
    notes: deque[Note] = deque()
    refused = _open_revoked(keys, revoked)
    with ExitStack() as resources:
        commands, telemetry = (resources.enter_context(bind(host, each)) for each in (port, second))
        pages.check_reach(commands, keys, insecure_lan, "address-without-keys", "serve-insecure")
        written = resources.enter_context(logging_to(log, notes.append))
        page = resources.enter_context(bind(host, web)) if web is not None else None
        if page:
            pages.load_page()
        parts = _open_parts(resources, options, chosen, notes) if pins else None
        if pins and parts:
            car = _open_real(parts, pins, chosen, gpio_chip, watchdog, measured)
            pictures = pages.open_camera(camera) if page else None
        else:
            image, chosen = image_for(program, profile) if program else (bytes(4), chosen)
            car, pictures = _open_simulated(resources, chosen, mat, image, measured)
        if arming:
            chosen = replace(chosen, drive=replace(chosen.drive, arming=True))
        serve_page = partial(pages.serving_page, page, host, pages.https(keys), pictures) if page else None
        serving = ServeOptions(
            commands, telemetry, tls, refused, written, byte_order, as_json, serve_page, parts, notes
        )
        asyncio.run(serve(car, chosen, serving))
    if not as_json:
        print_lines([translated("serve-ended")])


def _open_revoked(keys: Path | None, file: Path | None) -> "RevokedKeys | None":
    """The drivers' keys that the car doesn't take, in ``file`` or beside its own. Raises MotorcadeError."""
    from motorcade.drive.tls.revoked import REVOKED, RevokedKeys

    if keys is None:
        if file:
            raise MotorcadeError("revoked-without-keys")
        return None
    return RevokedKeys(file or keys.with_name(REVOKED), is_expected=file is not None)


def _check_options(options: CarOptions, is_real: bool) -> None:
    if not is_real and options._replace(insecure_lan=False) != CarOptions():
        raise MotorcadeError("options-of-real-cars")
    if options.serial and options.tcp:
        raise MotorcadeError("options-exclude-each-other", first="--upload-serial", second="--upload-tcp")


def _open_parts(resources: ExitStack, options: CarOptions, profile: "Profile", notes: "deque[Note]") -> "CarParts":
    """Open a real car's equipment; uploads and faults of its program are noted. Raises MotorcadeError."""
    from motorcade.cli.car import open_parts

    def observe(kind: str, at_ms: int, word: int, detail: int | str) -> None:
        if kind == "image":
            notes.append(Phrase("serve-image", bytes=word))
        elif kind == "fault":
            notes.append(str(detail))

    return open_parts(resources, options, profile, observe)


def _open_real(
    parts: "CarParts",
    pins: Path,
    profile: "Profile",
    gpio_chip: int | None,
    watchdog: Path | None,
    battery: "BatteryFile | None",
) -> "DriveBoard":
    with needs_extra("pins", "pi"):
        from motorcade.boards.linux.opening import open_drive
    from motorcade.config.pins import load_pins

    return open_drive(parts.equipment, load_pins(pins), profile, gpio_chip, watchdog, battery)


def _open_simulated(
    resources: ExitStack, profile: "Profile", mat: Path | None, image: bytes, battery: "BatteryFile | None"
) -> "tuple[DriveBoard, Source | None]":
    """Start a simulated world. Returns its first car and that car's pictures; closing ``resources`` ends the world."""
    with needs_extra("simulated-car", "world"):
        import motorcade.engine.webassembly  # noqa: F401
        from motorcade.boards.simulated_drive import LiveWorld, SimulatedCamera
        from motorcade.engine.world import World
        from motorcade.mats import check_mat, playground, read_mat

    place = read_mat(mat) if mat else playground()
    check_mat(place, profile)
    live = resources.enter_context(LiveWorld(World(place, [image], profile, threads=1)))
    board = live.board(0)
    board.battery = battery
    return board, SimulatedCamera(live, 0)
