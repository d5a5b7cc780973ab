"""Commands for those who drive: drive connect, drive send, drive keys.

Each command imports what it needs when it runs, so that the others start at once.
"""

from contextlib import ExitStack, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from motorcade.cli.failures import UsageError
from motorcade.cli.language import Language, resolve_locale
from motorcade.cli.options import Json, print_json, wants_json
from motorcade.cli.recordings import needs_extra
from motorcade.cli.stick import StickName, gamepad
from motorcade.errors import MotorcadeError

if TYPE_CHECKING:
    from motorcade.drive.tls.certificates import CarKeys
    from motorcade.drive.wire import Telemetry

_PORT = 5005
_AXES = ("throttle", "steering", "seconds")
_LONGEST_S = 3600.0

Car = Annotated[str, typer.Argument(metavar="HOST[:PORT]", help="The car, such as 192.168.1.20 or ada.local:5005.")]
TelemetryPort = Annotated[
    int | None, typer.Option(min=1, max=65535, help="Where the car tells what it does; the port behind PORT.")
]
Keys = Annotated[
    Path | None, typer.Option(help="Your keys file, driver-….pem, of `motorcade drive keys`, where the car wants one.")
]
CarName = Annotated[str | None, typer.Option("--car", help="The car's name in its keys, where HOST isn't in them.")]


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
    stick: Annotated[StickName, typer.Option(help="What drives; the other keys stay.")] = StickName.KEYBOARD,
    throttle: Annotated[float, typer.Option(min=0.05, max=1, help="What a key gives; + and - change it.")] = 0.4,
    hold_ms: Annotated[
        int,
        typer.Option(
            min=100,
            max=1000,
            help="A key counts as held for so long after it was last heard of, in terminals that don't tell when it is "
            "released. Longer than your keyboard's delay before it repeats, such as 700, makes starts smooth, and the "
            "car stop later.",
        ),
    ] = 250,
    language: Language = "",
) -> None:
    """Drive with the keyboard or a gamepad: hold a key and the car drives, let go and it stops."""
    with needs_extra("driving with the keyboard", "drive"):
        from motorcade.cli.drive_terminal import DriveTerminal
        from motorcade.cli.keyboard import Keyboard, check_terminal
    from motorcade.drive.blocking_client import BlockingDriveClient

    check_terminal()
    chosen = resolve_locale(language)
    options = _options(telemetry_port, keys, car_name)
    with ExitStack() as held, suppress(KeyboardInterrupt):
        pad = held.enter_context(gamepad()) if stick == StickName.GAMEPAD else None
        client = held.enter_context(BlockingDriveClient(*address_of(car), rearm=False, **options))
        keyboard = held.enter_context(Keyboard(throttle, hold_ms / 1000))
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

    resolve_locale(language)
    wishes = [_wish(command) for command in commands]
    with BlockingDriveClient(*address_of(car), **_options(telemetry_port, keys, car_name)) as client:
        for wish in wishes:
            client.drive_for(**wish)
        told = client.next_telemetry()
        if not client.you.get("applied"):
            raise _executed_none(car, told)
    if wants_json(as_json):
        print_json(told._asdict())
    else:
        print(f"{sum(wish['seconds'] for wish in wishes):g} s sent to {car}; it is {told.state}")


def keys_command(
    folder: Annotated[Path, typer.Argument(file_okay=False, help="Of one authority: a class, a household.")],
    car: Annotated[
        list[str] | None,
        typer.Option(help="A car's name, and its addresses if it has others than NAME.local: ada@192.168.1.20,…"),
    ] = None,
    driver: Annotated[list[str] | None, typer.Option(help="A driver's name.")] = None,
    as_json: Json = False,
) -> None:
    """Make the keys with which cars and drivers know each other."""
    with needs_extra("making keys", "drive"):
        from motorcade.drive.tls.certificates import make_keys
    if not car and not driver:
        raise UsageError("nobody is named: --car NAME@ADDRESS and --driver NAME, each as often as needed")
    made = make_keys(folder, [_car_keys(each) for each in car or ()], driver or [], datetime.now(UTC))
    if wants_json(as_json):
        print_json([str(file) for file in made])
        return
    for file in made:
        print(file)
    print(
        f"A car starts with its file: motorcade drive serve --keys {folder / 'car-….pem'}; a driver shows theirs: "
        f"motorcade drive connect HOST --keys {folder / 'driver-….pem'}. Whoever has authority.pem can make more "
        "keys: keep it to yourself."
    )


def address_of(text: str) -> tuple[str, int]:
    """HOST or HOST:PORT as both. Raises UsageError."""
    host, colon, port = text.rpartition(":")
    # An IPv6 address has colons of its own; with a port it stands in brackets.
    is_bare = not colon or text.endswith("]") or (":" in host and not host.endswith("]"))
    if is_bare:
        host, port = text, str(_PORT)
    if not host.strip("[]") or not port.isascii() or not port.isdigit() or not 0 < int(port) < 65536:
        raise UsageError(f"'{text[:60]}' is not HOST or HOST:PORT, such as 192.168.1.20 or 192.168.1.20:5005")
    return host.strip("[]"), int(port)


def _options(telemetry_port: int | None, keys: Path | None, name: str | None) -> dict[str, Any]:
    if name and not keys:
        raise UsageError("--car is for a car that wants keys: --keys")
    return {"telemetry_port": telemetry_port, "keys": keys, "car": name}


def _wish(command: str) -> dict[str, float]:
    wish = {"throttle": 0.0, "steering": 0.0, "seconds": 1.0}
    for part in command.split(","):
        name, _, text = part.partition("=")
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if name not in _AXES or not (0 < value <= _LONGEST_S if name == "seconds" else -1 <= value <= 1):
            raise UsageError(
                f"'{part[:40]}' is no part of a command; allowed: throttle=-1 to 1, steering=-1 to 1, "
                f"seconds=0 to {_LONGEST_S:g}"
            )
        wish[name] = value
    return wish


def _executed_none(car: str, telemetry: "Telemetry") -> MotorcadeError:
    if telemetry.state == "stopped":
        return MotorcadeError("is-stopped", car=car)
    return MotorcadeError("another-drives", car=car, driver=telemetry.driver or "?")


def _car_keys(text: str) -> "CarKeys":
    from motorcade.drive.tls.certificates import CarKeys

    name, _, hosts = text.partition("@")
    return CarKeys(name, tuple(host for host in hosts.split(",") if host))
