"""Commands for drivers: drive connect, drive send, drive keys."""

from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from motorcade.cli.language import Language, translated
from motorcade.cli.options import Json, print_json, print_lines, print_result, quoted, wants_json
from motorcade.errors import MotorcadeError, Phrase
from motorcade.extras import needs_extra

_PORT = 5005
_AXES = ("throttle", "steering", "seconds")
_LONGEST_S = 3600.0

app = typer.Typer()
Car = Annotated[str, typer.Argument(metavar="HOST[:PORT]")]
TelemetryPort = Annotated[int | None, typer.Option(min=1, max=65535)]
CarName = Annotated[str | None, typer.Option("--car")]


@app.command("connect")
def _connect(
    car: Car,
    telemetry_port: TelemetryPort = None,
    keys: Path | None = None,
    car_name: CarName = None,
    throttle: Annotated[float, typer.Option(min=0.05, max=1)] = 0.4,
    hold_ms: Annotated[int, typer.Option(min=100, max=1000)] = 250,
    language: Language = "",
) -> None:
    with needs_extra("keyboard", "drive"):
        from motorcade.cli.drive_terminal import DriveTerminal, check_terminal
    from motorcade.drive.blocking_client import BlockingDriveClient

    check_terminal()
    options = _options(telemetry_port, keys, car_name)
    with suppress(KeyboardInterrupt), BlockingDriveClient(*address_of(car), rearm=False, **options) as client:
        DriveTerminal(car, throttle, hold_ms / 1000).drive(client)


@app.command("send")
def _send(
    car: Car,
    commands: Annotated[list[str], typer.Argument(metavar="COMMAND…")],
    telemetry_port: TelemetryPort = None,
    keys: Path | None = None,
    car_name: CarName = None,
    language: Language = "",
    as_json: Json = False,
) -> None:
    from motorcade.drive.blocking_client import BlockingDriveClient

    parsed = [_parse(command) for command in commands]
    with BlockingDriveClient(*address_of(car), **_options(telemetry_port, keys, car_name)) as client:
        for each in parsed:
            client.drive_for(**each)
        telemetry = client.next_telemetry()
        if not client.you.get("applied"):
            if telemetry.state == "stopped":
                raise MotorcadeError("is-stopped", car=car)
            if telemetry.state == "discharged" and telemetry.battery_mv is None:
                raise MotorcadeError("battery-not-read", car=car, reason=telemetry.last_fault)
            if telemetry.state == "discharged":
                raise MotorcadeError("is-discharged", car=car, battery_mv=telemetry.battery_mv)
            raise MotorcadeError("another-drives", car=car, driver=telemetry.driver or "?")
    if wants_json(as_json):
        print_json(telemetry._asdict())
    else:
        seconds, state = sum(each["seconds"] for each in parsed), Phrase(f"car-state-{telemetry.state}")
        print(translated("drive-sent", seconds=seconds, car=car, state=state))


@app.command("keys")
def _keys(
    folder: Annotated[Path, typer.Argument(file_okay=False)],
    car: list[str] | None = None,
    driver: list[str] | None = None,
    revoke: Annotated[list[str] | None, typer.Option(metavar="NAME_OR_SERIAL")] = None,
    list_all: Annotated[bool, typer.Option("--list")] = False,
    as_json: Json = False,
) -> None:
    with needs_extra("making-keys", "drive"):
        from motorcade.drive.tls.certificates import CarKeys, make_keys, revoke_drivers
    if sum(map(bool, (car or driver, revoke, list_all))) > 1:
        raise MotorcadeError("options-exclude-each-other", first="--revoke", second="--list / --car / --driver")
    if list_all:
        _list_keys(folder, as_json)
        return
    if revoke:
        file = revoke_drivers(folder, revoke)
        sentence = translated("keys-revoked", names=", ".join(revoke), file=file)
        print_result({"revoked": revoke, "file": str(file)}, sentence, wants_json(as_json))
        return
    if not car and not driver:
        raise MotorcadeError("nobody-named")
    named = (each.partition("@") for each in car or ())
    cars = [CarKeys(name, tuple(filter(None, hosts.split(",")))) for name, _, hosts in named]
    made = make_keys(folder, cars, driver or [], datetime.now(UTC))
    if wants_json(as_json):
        print_json([str(file) for file in made])
        return
    for file in made:
        print(file)
    print(translated("keys-made", car=quoted(folder / "car-….pem"), driver=quoted(folder / "driver-….pem")))


def _list_keys(folder: Path, as_json: bool) -> None:
    from motorcade.drive.tls.certificates import list_keys

    rows = [
        {
            "role": each.role,
            "name": each.name,
            "number": f"{each.number:x}",
            "until": f"{each.valid_until:%Y-%m-%d}",
            "revoked": each.is_revoked,
        }
        for each in list_keys(folder)
    ]
    if wants_json(as_json):
        print_json(rows)
        return
    for row in rows:
        key = "keys-listed-revoked" if row["revoked"] else "keys-listed"
        role = Phrase(f"role-{row['role']}")
        print_lines([translated(key, role=role, name=row["name"], until=row["until"], number=row["number"])])


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
