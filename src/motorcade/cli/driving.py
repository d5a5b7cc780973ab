"""Commands for drivers: drive connect, drive send, drive keys.

Each command imports what it needs when it runs, so that the others start at once.
"""

from contextlib import AbstractContextManager, ExitStack, suppress
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from motorcade.cli.language import Language, current_language, resolve_locale
from motorcade.cli.options import Json, needs_extra, print_json, wants_json
from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import command_line_text

if TYPE_CHECKING:
    from motorcade.drive.input.deadman import StickSource
    from motorcade.drive.input.gamepad import Gamepad
    from motorcade.drive.tls.certificates import CarKeys
    from motorcade.drive.wire import Telemetry

_PORT = 5005
_AXES = ("throttle", "steering", "seconds")
_LONGEST_S = 3600.0

Car = Annotated[str, typer.Argument(metavar="HOST[:PORT]", help="The car, such as 192.168.1.20 or ada.local:5005.")]
TelemetryPort = Annotated[
    int | None, typer.Option(min=1, max=65535, help="Where the car sends telemetry; PORT + 1, unless given.")
]
Keys = Annotated[
    Path | None,
    typer.Option(help="Your keys file, driver-….pem, made by `motorcade drive keys`, if the car requires one."),
]
CarName = Annotated[str | None, typer.Option("--car", help="The car's name in its keys, where HOST isn't in them.")]


class StickName(StrEnum):
    """What can steer at this computer."""

    KEYBOARD = "keyboard"
    GAMEPAD = "gamepad"


def add_to(app: typer.Typer) -> None:
    """Register the commands in the group `drive`."""
    app.command("connect")(connect_command)
    app.command("send")(send_command)
    app.command("keys")(keys_command)


def connect_command(
    car: Car,
    telemetry_port: TelemetryPort = None,
    keys: Keys = None,
    car_name: CarName = None,
    stick: Annotated[StickName, typer.Option(help="What steers; the other keys stay.")] = StickName.KEYBOARD,
    throttle: Annotated[float, typer.Option(min=0.05, max=1, help="The throttle of a key; + and - change it.")] = 0.4,
    hold_ms: Annotated[
        int,
        typer.Option(
            min=100,
            max=1000,
            help="How long a key counts as held after its last repetition, in terminals that don't report its release. "
            "A time longer than your keyboard's delay before repeating, such as 700, makes starts smooth, stops late.",
        ),
    ] = 250,
    language: Language = "",
) -> None:
    """Drive with the keyboard or a gamepad: hold a key and the car drives, release it and the car stops."""
    with needs_extra("keyboard", "drive"):
        from motorcade.cli.drive_terminal import DriveTerminal, Keyboard, check_terminal
    from motorcade.drive.blocking_client import BlockingDriveClient

    check_terminal()
    chosen = resolve_locale(language)
    options = _options(telemetry_port, keys, car_name)
    with ExitStack() as resources, suppress(KeyboardInterrupt):
        pad = resources.enter_context(_gamepad()) if stick == StickName.GAMEPAD else None
        client = resources.enter_context(BlockingDriveClient(*address_of(car), rearm=False, **options))
        keyboard = resources.enter_context(Keyboard(throttle, hold_ms / 1000))
        DriveTerminal(car, keyboard, chosen, pad).drive(client)


def send_command(
    car: Car,
    commands: Annotated[
        list[str],
        typer.Argument(
            metavar="COMMAND…",
            help="One after the other, such as throttle=0.4,steering=-0.2,seconds=2; what isn't named is 0, "
            "seconds 1. Steering -1 is full left.",
        ),
    ],
    telemetry_port: TelemetryPort = None,
    keys: Keys = None,
    car_name: CarName = None,
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Drive for a time, then stand still."""
    from motorcade.drive.blocking_client import BlockingDriveClient

    locale = resolve_locale(language)
    parsed = [_parse(command) for command in commands]
    with BlockingDriveClient(*address_of(car), **_options(telemetry_port, keys, car_name)) as client:
        for each in parsed:
            client.drive_for(**each)
        telemetry = client.next_telemetry()
        if not client.you.get("applied"):
            raise _executed_none(car, telemetry)
    if wants_json(as_json):
        print_json(telemetry._asdict())
    else:
        seconds, state = sum(each["seconds"] for each in parsed), Phrase(f"car-state-{telemetry.state}")
        print(command_line_text("drive-sent", locale, seconds=seconds, car=car, state=state))


def keys_command(
    folder: Annotated[Path, typer.Argument(file_okay=False, help="The folder of one authority: a class, a household.")],
    car: Annotated[
        list[str] | None,
        typer.Option(help="A car's name, and its addresses if it has others than NAME.local: ada@192.168.1.20,…"),
    ] = None,
    driver: Annotated[list[str] | None, typer.Option(help="A driver's name.")] = None,
    as_json: Json = False,
) -> None:
    """Make the keys by which cars and drivers prove to each other who they are."""
    with needs_extra("making-keys", "drive"):
        from motorcade.drive.tls.certificates import make_keys
    if not car and not driver:
        raise MotorcadeError("nobody-named")
    made = make_keys(folder, [_car_keys(each) for each in car or ()], driver or [], datetime.now(UTC))
    if wants_json(as_json):
        print_json([str(file) for file in made])
        return
    for file in made:
        print(file)
    files = {"car": folder / "car-….pem", "driver": folder / "driver-….pem"}
    print(command_line_text("keys-made", current_language(), **files))


def address_of(text: str) -> tuple[str, int]:
    """The host and port in HOST or HOST:PORT. Raises MotorcadeError."""
    host, colon, port = text.rpartition(":")
    # An IPv6 address has colons of its own; with a port it stands in brackets.
    is_bare = not colon or text.endswith("]") or (":" in host and not host.endswith("]"))
    if is_bare:
        host, port = text, str(_PORT)
    if not host.strip("[]") or not port.isascii() or not port.isdigit() or not 0 < int(port) < 65536:
        raise MotorcadeError("not-a-car", text=text)
    return host.strip("[]"), int(port)


def open_stick(name: StickName) -> "AbstractContextManager[StickSource]":
    """A stick at this computer, to be opened. Raises MotorcadeError where there is none."""
    if name == StickName.GAMEPAD:
        return _gamepad()
    with needs_extra("keyboard", "drive"):
        from motorcade.cli.drive_terminal import Keyboard, check_terminal

    check_terminal()
    return Keyboard()


def _gamepad() -> "Gamepad":
    with needs_extra("gamepad", "gamepad"):
        from motorcade.drive.input.gamepad import Gamepad

        return Gamepad()


def _options(telemetry_port: int | None, keys: Path | None, name: str | None) -> dict[str, Any]:
    if name and not keys:
        raise MotorcadeError("car-name-without-keys")
    return {"telemetry_port": telemetry_port, "keys": keys, "car": name}


def _parse(command: str) -> dict[str, float]:
    parsed = {"throttle": 0.0, "steering": 0.0, "seconds": 1.0}
    for part in command.split(","):
        name, _, text = part.partition("=")
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if name not in _AXES or not (0 < value <= _LONGEST_S if name == "seconds" else -1 <= value <= 1):
            raise MotorcadeError("not-part-of-a-command", part=part, most=_LONGEST_S)
        parsed[name] = value
    return parsed


def _executed_none(car: str, telemetry: "Telemetry") -> MotorcadeError:
    if telemetry.state == "stopped":
        return MotorcadeError("is-stopped", car=car)
    return MotorcadeError("another-drives", car=car, driver=telemetry.driver or "?")


def _car_keys(text: str) -> "CarKeys":
    from motorcade.drive.tls.certificates import CarKeys

    name, _, hosts = text.partition("@")
    return CarKeys(name, tuple(host for host in hosts.split(",") if host))
