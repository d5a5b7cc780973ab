"""Commands for the car itself: car run, car neutral, car wiring; and what cars that run an image are told."""

import ipaddress
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import typer

from motorcade import __version__
from motorcade.cli import options
from motorcade.cli.ending import Ending, holding_hardware
from motorcade.cli.output import (
    Rows,
    current_language,
    json_text,
    plain,
    print_note,
    print_problem,
    print_result,
    translated,
    wants_json,
)
from motorcade.errors import MotorcadeError, Phrase
from motorcade.extras import needs_extra
from motorcade.sockets import host_and_port

if TYPE_CHECKING:
    import ssl

    from motorcade.boards.computer import Equipment, Observer
    from motorcade.boards.lines import SerialLine, WaitingLine
    from motorcade.config.profile import Profile
    from motorcade.drive.keys import RevokedKeys

# Dozens a second; the log shows what follows from them.
_UNLOGGED = ("frame", "heard")
_KEYBOARD = "keyboard"
# How an address of uploads is printed.
_SOCKET = "socket://"

app = typer.Typer()
# The hardware of a car.
BoardName = Literal["simulated", "raspberry-pi"]


class CarOptions(NamedTuple):
    """The options that a user gave.

    Attributes:
        role, number: of the car.
        serial: the port that uploads come by; ``tcp``, HOST:PORT, stands for it.
        store: the file that keeps the image, None for the user's own.
        voice, voice_map: "keyboard", or a module's port and what it sends; empty for none.
        insecure_lan: whether ``tcp`` may be an address that other computers reach, without keys.
        keys, revoked: the car's keys for ``tcp``, and the list of drivers' keys that it doesn't take.
    """

    role: options.RoleName = "leader"
    number: int = 0
    serial: str = ""
    tcp: str = ""
    store: Path | None = None
    voice: str = ""
    voice_map: Path | None = None
    insecure_lan: bool = False
    keys: Path | None = None
    revoked: Path | None = None


class CarParts(NamedTuple):
    """A car's equipment, the address of its line for uploads (empty for none), and the file that keeps its image."""

    equipment: "Equipment"
    address: str
    store: Path


@app.command("run")
def _run(
    pins: options.OptionalFile = None,
    role: options.RoleName = "leader",
    number: options.NumberOption = 0,
    board: BoardName = "raspberry-pi",
    port: options.PortOption = "",
    tcp: str = "",
    insecure_lan: options.InsecureLan = False,
    keys: options.OptionalFile = None,
    revoked: Path | None = None,
    battery: options.OptionalFile = None,
    count: Annotated[int | None, typer.Option(min=1, max=2000)] = None,
    car_list: Annotated[Path | None, typer.Option("--list", dir_okay=False)] = None,
    store: Path | None = None,
    voice: str = "",
    voice_map: options.OptionalFile = None,
    watchdog: Path | None = None,
    gpio_chip: options.GpioChip = None,
    profile: str = "classroom",
) -> None:
    from motorcade.boards.computer import ComputerBoard, run

    if board == "raspberry-pi" and pins is None:
        raise MotorcadeError("pins-missing")
    options.exclude_each_other(port=port, tcp=tcp)
    options.exclude_each_other(keys=keys, insecure_lan=insecure_lan)
    chosen = options.profile_named(profile)
    car = CarOptions(role, number, port, tcp, store, voice, voice_map, insecure_lan, keys, revoked)
    if count is not None:
        if board != "simulated" or port:
            raise MotorcadeError("count-of-simulated-cars")
        _run_many(car, count, car_list, chosen)
        return
    with holding_hardware() as ending, ExitStack() as resources:
        parts = open_parts(resources, car, chosen, _observer(chosen), battery)
        if parts.address.startswith(_SOCKET):
            from motorcade.drive.keys import name_in
            from motorcade.fleet.places import CAR, announced

            listener = host_and_port(parts.address.removeprefix(_SOCKET))
            resources.enter_context(announced(CAR, "", listener, print_problem, keys=name_in(keys)))
        stops = _stops(ending, resources, watchdog)
        if board == "simulated" or not pins:
            made = ComputerBoard(parts.equipment)
        else:
            with needs_extra("pins", "pi"):
                from motorcade.boards.linux.raspberry_pi import open_car

            made = open_car(parts.equipment, options.pins_at(pins), chosen, gpio_chip)
        key = "car-takes-no-uploads"
        if parts.address:
            key = "car-takes-uploads"
        sentence = translated(key, role=Phrase(f"role-{role}"), address=parts.address, store=parts.store)
        print_result({"role": role, "port": parts.address, "store": str(parts.store)}, sentence)
        run(made, parts.equipment.line.wait, stops)


@app.command("neutral")
def _neutral(
    pins: Annotated[Path, typer.Option(exists=True, dir_okay=False)],
    gpio_chip: options.GpioChip = None,
) -> None:
    with needs_extra("pins", "pi"):
        from motorcade.boards.linux.raspberry_pi import stop_wheels

    wiring = options.pins_at(pins)
    low = stop_wheels(wiring, gpio_chip)
    sentence = translated("wheels-stopped", car=wiring.name, pins=", ".join(map(str, low)))
    print_result({"low": low}, sentence)


@app.command("wiring")
def _wiring(
    pins: Annotated[Path, typer.Argument(metavar="PINS", exists=True, dir_okay=False)],
    output: options.OptionalOutput = None,
) -> None:
    from motorcade.boards.wiring import wiring_rows, wiring_svg

    wiring = options.pins_at(pins)
    rows = wiring_rows(wiring, current_language())
    cells = [(row.part, row.terminal, row.supply, row.components, row.label) for row in rows]
    shown: str | Rows = Rows(("part", "terminal", "supply", "components", "pin"), cells, title=wiring.name)
    if output:
        options.write_file(output, wiring_svg(wiring, current_language()).encode(), source=pins)
        shown = translated("wires-drawn", count=len(rows), file=output)
    names = ("part", "terminal", "pin", "label", "supply", "components")
    print_result([{name: getattr(row, name) for name in names} for row in rows], shown)


def _stops(ending: Ending, resources: ExitStack, watchdog: Path | None) -> Callable[[], bool]:
    """Return what tells whether a signal asked the car to stop; each call in a tick keeps the watchdog alive."""
    from motorcade.boards.computer import HardwareWatchdog

    armed = None
    if watchdog:
        armed = HardwareWatchdog(watchdog)
        resources.callback(armed.close)

    def stops() -> bool:
        if armed:
            armed.keep_alive()
        return ending.is_due

    return stops


def _observer(profile: "Profile") -> "Observer":
    """Print what the car does: a line, or a line of JSON."""
    from motorcade.cli.console import describe_event

    def observe(kind: str, at_ms: int, word: int, detail: int | str) -> None:
        if kind in _UNLOGGED:
            return
        if wants_json():
            line = json_text({"t_ms": at_ms, "kind": kind, "word": word, "detail": detail})
        else:
            line = f"{at_ms / 1000:9.3f} s  {plain(describe_event(kind, word, detail, profile))}"
        print(line)

    return observe


def _run_many(car: CarOptions, count: int, car_list: Path | None, profile: "Profile") -> None:
    """Run simulated cars at as many ports; without --store they forget their images."""
    import selectors

    from motorcade.boards.computer import ComputerBoard, Equipment, ImageStore, run_many
    from motorcade.boards.lines import TcpPort
    from motorcade.config.profile import levels_of
    from motorcade.fleet.places import list_text
    from motorcade.sockets import allow_files

    host, first_port = host_and_port(car.tcp.removeprefix(_SOCKET) or "127.0.0.1:0")
    allow_files(4 * count + 64)
    selector = selectors.DefaultSelector()
    made: list[tuple[ComputerBoard, TcpPort]] = []
    with holding_hardware() as ending, ExitStack() as resources:
        for number in range(car.number, car.number + count):
            line = TcpPort(host, first_port and first_port + len(made), selector=selector)
            resources.callback(line.close)
            _check_reach(line.address, car)
            image: bytes | None = None
            saved: dict[str, Any] = {"name": f"car-{number}"}
            if car.store:
                store = ImageStore(car.store / f"car-{number}.image")
                image = store.load()
                saved = {"name": store.load_name() or f"car-{number}", "save_name": store.save_name, "save": store.save}
            is_leader = car.role == "leader"
            equipment = Equipment(is_leader, number, levels_of(profile), line, image, version=__version__, **saved)
            made.append((ComputerBoard(equipment), line))
        listed = [(board.name, line.address.removeprefix(_SOCKET)) for board, line in made]
        if car_list:
            options.write_file(car_list, list_text(listed).encode())
        data = {"cars": count, "list": str(car_list) if car_list else None, "first": listed[0][1]}
        print_result(data, translated("cars-run", **data))
        run_many(made, lambda: ending.is_due)


def open_parts(
    resources: ExitStack, car: CarOptions, profile: "Profile", observe: "Observer", battery: Path | None = None
) -> CarParts:
    """Open a car's line, store, voice and battery; ``resources`` closes them. Raises MotorcadeError."""
    from motorcade.boards.computer import BatteryFile, Equipment, ImageStore, StoreError
    from motorcade.config.profile import levels_of

    if car.voice not in ("", _KEYBOARD) and car.voice_map is None:
        raise MotorcadeError("voice-map-missing")
    line, address = _open_line(resources, car, profile)
    store = ImageStore(car.store or options.own_folder() / "car.image")
    image = None
    try:
        image = store.load()
    except StoreError as problem:
        # A car that waits for an upload is of more use than one that doesn't start.
        print_note(translated("begins-without-program", problem=problem))
    voice = _open_voice(resources, car)
    named: dict[str, Any] = {"version": __version__, "name": store.load_name(), "save_name": store.save_name}
    if battery:
        named["battery_mv"] = BatteryFile(battery).read_mv
    is_leader = car.role == "leader"
    equipment = Equipment(is_leader, car.number, levels_of(profile), line, image, store.save, voice, observe, **named)
    return CarParts(equipment, address, store.path)


def _open_line(resources: ExitStack, car: CarOptions, profile: "Profile") -> "tuple[WaitingLine, str]":
    from motorcade.boards.lines import TcpPort, WaitingLine

    if car.serial:
        return _open_serial(resources, car.serial, profile.serial.baud), car.serial
    if not car.tcp:
        return WaitingLine(), ""
    line = TcpPort(*host_and_port(car.tcp.removeprefix(_SOCKET)), **_tls(car))
    resources.callback(line.close)
    _check_reach(line.address, car)
    return line, line.address


def _check_reach(address: str, car: CarOptions) -> None:
    """Refuse an address that others reach, unless there are keys or the user allows it. Raises MotorcadeError."""
    host, _ = host_and_port(address.removeprefix(_SOCKET))
    is_loopback = ipaddress.ip_address(host.partition("%")[0]).is_loopback
    if not (is_loopback or car.keys or car.insecure_lan):
        raise MotorcadeError("uploads-in-reach", host=host)


def _tls(car: CarOptions) -> dict[str, Any]:
    """The TLS of a TCP port, and what refuses revoked keys; nothing without keys. Raises MotorcadeError."""
    if car.keys is None:
        return {}
    from motorcade.drive.keys import peer_number, server_context

    refused = revoked_keys(car.keys, car.revoked)

    def refuses(connection: "ssl.SSLSocket") -> bool:
        refused.reload()
        return peer_number(connection) in refused

    return {"tls": server_context(car.keys), "refuses": refuses}


def revoked_keys(keys: Path, file: Path | None) -> "RevokedKeys":
    """Read which drivers' keys a car doesn't take: the list in ``file``, or the one beside its own ``keys``, if any."""
    from motorcade.drive.keys import REVOKED, RevokedKeys

    return RevokedKeys(file or keys.with_name(REVOKED), is_expected=file is not None)


def _open_serial(resources: ExitStack, port: str, baud: int) -> "SerialLine":
    from time import monotonic

    import serial

    from motorcade.boards.lines import SerialLine
    from motorcade.upload.serial_port import open_error, serial_line

    def open_port() -> serial.Serial:
        # No call may wait: the wheels would turn on meanwhile.
        return serial_line(port, baudrate=baud, timeout=0, write_timeout=0)

    try:
        line = SerialLine(open_port, monotonic)
    except (serial.SerialException, OSError, ValueError) as problem:
        raise open_error(port, problem) from None
    resources.callback(line.close)
    return line


def _open_voice(resources: ExitStack, car: CarOptions) -> Callable[[], int]:
    from motorcade.boards.on_chip.parts import SerialVoice
    from motorcade.car.brain import NO_VOICE

    if car.voice == _KEYBOARD:
        from motorcade.boards.computer import keyboard_voice

        return keyboard_voice(sys.stdin).heard_voice
    if car.voice and car.voice_map:
        from motorcade.config.pins import load_voice_map

        module = load_voice_map(car.voice_map)
        return SerialVoice(_open_serial(resources, car.voice, module.baud).read, module.patterns).heard_voice
    return lambda: NO_VOICE
