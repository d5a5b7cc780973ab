"""Commands of a car that is driven and of its drivers: drive serve, drive connect, drive send, drive keys."""

from collections import deque
from contextlib import ExitStack, suppress
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from motorcade.cli import options, pages
from motorcade.cli.car import BoardName, CarOptions, open_parts, revoked_keys
from motorcade.cli.ending import holding_hardware
from motorcade.cli.output import print_lines, print_result, quoted, translated, wants_json
from motorcade.errors import MotorcadeError, Phrase
from motorcade.extras import needs_extra
from motorcade.sockets import port_behind

if TYPE_CHECKING:
    from motorcade.boards.computer import BatteryFile, Observer
    from motorcade.cameras.broadcast import Source
    from motorcade.car.drive_board import DriveBoard
    from motorcade.cli.serving import Note
    from motorcade.config.profile import Profile

_AXES = ("throttle", "steering", "seconds")
_LONGEST_S = 3600.0
# Notes that wait to be printed; more come only while the console's thread hangs.
_MOST_NOTES = 100

app = typer.Typer()
app.add_typer(pages.remote_app)
CarAddress = Annotated[str, typer.Argument(metavar="HOST[:PORT]")]
CarName = Annotated[str | None, typer.Option("--car")]
# Of the four bytes of a command.
ByteOrder = Literal["big", "little"]


@app.command("serve")
def _serve(
    board: BoardName = "simulated",
    host: options.Host = "127.0.0.1",
    port: options.TcpPortOption = 5005,
    telemetry_port: options.OptionalTcpPort = None,
    keys: options.KeysFile = None,
    revoked: Path | None = None,
    log: options.LogFile = None,
    insecure_lan: options.InsecureLan = False,
    byte_order: ByteOrder = "big",
    arming: Annotated[bool, typer.Option("--arming")] = False,
    pins: options.OptionalFile = None,
    gpio_chip: options.GpioChip = None,
    watchdog: Path | None = None,
    battery: options.OptionalFile = None,
    role: options.RoleName = "leader",
    number: options.NumberOption = 0,
    upload_serial: str = "",
    upload_tcp: str = "",
    store: Path | None = None,
    voice: str = "",
    voice_map: options.OptionalFile = None,
    web: options.OptionalTcpPort = None,
    camera: pages.CameraName = "none",
    mat: options.OptionalFile = None,
    program: options.OptionalFile = None,
    profile: options.ImageProfile = None,
) -> None:
    import asyncio

    from motorcade.boards.computer import BatteryFile
    from motorcade.cli.serving import serve
    from motorcade.drive.activity_log import logging_to
    from motorcade.drive.channels import Clients
    from motorcade.drive.keys import https_context, name_in, server_context
    from motorcade.drive.listener import bind
    from motorcade.drive.session import CarControl
    from motorcade.fleet.places import DRIVE, announced
    from motorcade.timing import monotonic_ms

    options.exclude_each_other(keys=keys, insecure_lan=insecure_lan)
    if (pins is None) != (board == "simulated"):
        raise MotorcadeError("pins-and-board")
    if pins and (mat or program):
        raise MotorcadeError("options-of-simulated-cars")
    wanted = CarOptions(role, number, upload_serial, upload_tcp, store, voice, voice_map)
    if not pins and wanted != CarOptions():
        raise MotorcadeError("options-of-real-cars")
    options.exclude_each_other(upload_serial=upload_serial, upload_tcp=upload_tcp)
    if revoked and not keys:
        raise MotorcadeError("revoked-without-keys")
    chosen = options.profile_named(profile or options.DEFAULT_PROFILE)
    measured = None
    if battery:
        measured = BatteryFile(battery)
    tls = page_tls = refused = None
    if keys:
        tls = server_context(keys)
        page_tls = https_context(keys)
        refused = revoked_keys(keys, revoked)
    if telemetry_port is not None:
        second = telemetry_port
    else:
        second = port and port_behind(port)
    notes: deque[Note] = deque(maxlen=_MOST_NOTES)
    with holding_hardware() as ending, ExitStack() as resources:
        commands, telemetry = (resources.enter_context(bind(host, port_wanted)) for port_wanted in (port, second))
        pages.check_reach(commands, keys, insecure_lan, "address-without-keys", "serve-insecure")
        record = resources.enter_context(logging_to(log, notes.append))
        page = None
        if web is not None:
            page = resources.enter_context(bind(host, web))
            pages.load_page()
        wanted = wanted._replace(insecure_lan=insecure_lan, keys=keys, revoked=revoked)
        parts = pictures = None
        if pins:
            parts = open_parts(resources, wanted, chosen, _noting(notes), battery)
            with needs_extra("pins", "pi"):
                from motorcade.boards.linux.programmed_drive import open_drive
            car: DriveBoard = open_drive(parts.equipment, options.pins_at(pins), chosen, gpio_chip, watchdog)
            if page:
                pictures = pages.open_camera(camera)
        else:
            image = bytes(4)
            if program:
                image, chosen = options.image_for(program, profile)
            car, pictures = _open_simulated(resources, chosen, mat, program, image, measured)
        if arming:
            chosen = replace(chosen, drive=replace(chosen.drive, arming=True))
        serve_page = None
        if page:
            serve_page = partial(pages.serving_page, page, host, page_tls, pictures)
        clients = Clients(CarControl(car, monotonic_ms, chosen), byte_order, refused)
        clients.refusals.say = notes.append
        if record:
            clients.control.record = record
        name = ""
        if parts:
            name = parts.equipment.name
        (host, port), (_, telemetry_port) = (listener.getsockname()[:2] for listener in (commands, telemetry))
        with announced(DRIVE, name, (host, port), notes.append, telemetry=telemetry_port, keys=name_in(keys)):
            asyncio.run(serve(clients, (commands, telemetry), tls, serve_page, parts, notes, ending))
        if not wants_json():
            print_lines([translated("serve-ended")])


def _noting(notes: "deque[Note]") -> "Observer":
    """Return what notes the uploads to a real car, and faults of its program."""

    def observe(kind: str, at_ms: int, word: int, detail: int | str) -> None:
        if kind == "image":
            notes.append(Phrase("serve-image", bytes=word))
        elif kind == "fault":
            notes.append(str(detail))

    return observe


def _open_simulated(
    resources: ExitStack,
    profile: "Profile",
    mat: Path | None,
    program: Path | None,
    image: bytes,
    battery: "BatteryFile | None",
) -> "tuple[DriveBoard, Source | None]":
    """Start a simulated world: on the mat, or the program's own, or else a playground.

    Returns its first car and that car's pictures; closing ``resources`` ends the world.
    """
    with needs_extra("simulated-car", "world"):
        import motorcade.engine.webassembly  # noqa: F401
        from motorcade.engine.simulated_drive import LiveWorld, SimulatedCamera
        from motorcade.engine.world import World
        from motorcade.mats import playground, read_mat

    own = None
    if program:
        own = options.own_world(program).mat
    if mat:
        place = read_mat(mat)
    else:
        place = own or playground()
    live = resources.enter_context(LiveWorld(World(place, [image], profile, threads=1)))
    board = live.board(0)
    board.read_battery_mv = battery.read_mv if battery else None
    return board, SimulatedCamera(partial(live.jpeg, 0))


@app.command("connect")
def _connect(
    car: CarAddress,
    telemetry_port: options.OptionalTcpPort = None,
    keys: Path | None = None,
    car_name: CarName = None,
    throttle: Annotated[float, typer.Option(min=0.05, max=1)] = 0.4,
    hold_ms: Annotated[int, typer.Option(min=100, max=1000)] = 250,
) -> None:
    with needs_extra("keyboard", "drive"):
        from motorcade.cli.drive_terminal import DriveTerminal, check_terminal
    from motorcade.drive.blocking_client import BlockingDriveClient

    check_terminal()
    named = _options(telemetry_port, keys, car_name)
    with (
        BlockingDriveClient(*options.car_address(car), rearm=False, **named) as client,
        suppress(KeyboardInterrupt),
    ):
        DriveTerminal(car, throttle, hold_ms / 1000).drive(client)


@app.command("send")
def _send(
    car: CarAddress,
    commands: Annotated[list[str], typer.Argument(metavar="COMMAND…")],
    telemetry_port: options.OptionalTcpPort = None,
    keys: Path | None = None,
    car_name: CarName = None,
) -> None:
    from motorcade.drive.blocking_client import BlockingDriveClient

    parsed = [_parse(command) for command in commands]
    with BlockingDriveClient(*options.car_address(car), **_options(telemetry_port, keys, car_name)) as client:
        for seconds, command in parsed:
            client.drive_for(seconds, **command)
        seconds = sum(seconds for seconds, _ in parsed)
        if telemetry_port == 0:
            # Such a car doesn't say what became of the commands.
            print_result({"seconds": seconds}, translated("drive-sent-unseen", seconds=seconds, car=car))
            return
        telemetry = client.next_telemetry()
        if not client.you.get("applied"):
            if telemetry.state == "stopped":
                raise MotorcadeError("is-stopped", car=car)
            if telemetry.state == "discharged" and telemetry.battery_mv is None:
                raise MotorcadeError("battery-not-read", car=car, reason=telemetry.last_fault)
            if telemetry.state == "discharged":
                raise MotorcadeError("is-discharged", car=car, battery_mv=telemetry.battery_mv)
            raise MotorcadeError("another-drives", car=car, driver=telemetry.driver or "?")
    state = Phrase(f"car-state-{telemetry.state}")
    print_result(telemetry._asdict(), translated("drive-sent", seconds=seconds, car=car, state=state))


@app.command("keys")
def _keys(
    folder: Annotated[Path, typer.Argument(file_okay=False)],
    car: list[str] | None = None,
    driver: list[str] | None = None,
    revoke: Annotated[list[str] | None, typer.Option(metavar="NAME_OR_SERIAL")] = None,
    list_all: Annotated[bool, typer.Option("--list")] = False,
) -> None:
    with needs_extra("making-keys", "drive"):
        from motorcade.drive.certificates import CarKeys, make_keys, revoke_drivers
    from motorcade.drive.keys import REVOKED, write_revoked

    for named in ({"car": car}, {"driver": driver}):
        options.exclude_each_other(revoke=revoke, list=list_all, **named)
    if list_all:
        _list_keys(folder)
        return
    if revoke:
        file = revoke_drivers(folder, revoke)
        sentence = translated("keys-revoked", names=", ".join(revoke), file=file)
        print_result({"revoked": revoke, "file": str(file)}, sentence)
        return
    if not car and not driver:
        raise MotorcadeError("nobody-named")
    cars = []
    for text in car or ():
        name, _, hosts = text.partition("@")
        cars.append(CarKeys(name, tuple(filter(None, hosts.split(",")))))
    made = [str(file) for file in make_keys(folder, cars, driver or [], datetime.now(UTC))]
    if not (folder / REVOKED).exists():
        write_revoked(folder / REVOKED, {})
    sentence = translated("keys-made", car=quoted(folder / "car-….pem"), driver=quoted(folder / "driver-….pem"))
    print_result(made, "\n".join([*made, sentence]))


def _list_keys(folder: Path) -> None:
    from motorcade.drive.certificates import list_keys

    rows = []
    lines = []
    for made in list_keys(folder):
        number = f"{made.number:x}"
        until = f"{made.valid_until:%Y-%m-%d}"
        row = {"role": made.role, "name": made.name, "number": number, "until": until, "revoked": made.is_revoked}
        key = "keys-listed"
        if made.is_revoked:
            key = "keys-listed-revoked"
        rows.append(row)
        lines.append(translated(key, **row | {"role": Phrase(f"role-{made.role}")}))
    if rows or wants_json():
        print_result(rows, "\n".join(lines))


def _options(telemetry_port: int | None, keys: Path | None, name: str | None) -> dict[str, Any]:
    if name and not keys:
        raise MotorcadeError("car-name-without-keys")
    return {"telemetry_port": telemetry_port, "keys": keys, "car": name}


def _parse(command: str) -> tuple[float, dict[str, Any]]:
    """Return for how many seconds a command drives, and the axes and switches that `DriveClient.drive_for` takes."""
    from motorcade.words.formats import SWITCHES

    switches = tuple(switch.name for switch in SWITCHES)
    parsed: dict[str, Any] = {"throttle": 0.0, "steering": 0.0, "seconds": 1.0}
    for part in command.split(","):
        name, _, text = part.partition("=")
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if name in switches and value in (0, 1):
            parsed[name] = int(value)
        elif name in _AXES and (0 < value <= _LONGEST_S if name == "seconds" else -1 <= value <= 1):
            parsed[name] = value
        else:
            known = ", ".join(f"{name}=0/1" for name in switches)
            raise MotorcadeError("not-part-of-a-command", part=part, most=_LONGEST_S, switches=known)
    return parsed.pop("seconds"), parsed
