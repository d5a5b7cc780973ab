"""Commands that reach a car through a port: ports, upload, readback.

Each command imports what it needs when it runs, so that the others start quickly.
"""

import sys
from binascii import crc32
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.language import Language, current_language, resolve_locale, translated
from motorcade.cli.options import (
    Json,
    ProfileOption,
    Source,
    image_of,
    print_json,
    profile_named,
    wants_json,
    write_file,
)

if TYPE_CHECKING:
    from motorcade.upload.ports import PortInfo
    from motorcade.upload.transfer import Retry

Port = Annotated[
    str,
    typer.Option("--port", "-p", help="Such as /dev/ttyUSB0, COM3 or socket://127.0.0.1:7000. Found, unless given."),
]


def add_to(app: typer.Typer) -> None:
    """Register the commands."""
    app.command("ports")(ports_command)
    app.command("upload")(upload_command)
    app.command("readback")(readback_command)


def ports_command(as_json: Json = False) -> None:
    """List this computer's serial ports, those first at which a car is likely."""
    from motorcade.upload.ports import BARE, ports

    found = ports()
    if wants_json(as_json):
        print_json([_as_dict(port) for port in found])
        return
    if all(port.rank == BARE for port in found):
        print(translated("no-car-plugged-in"))
    for port in found:
        print(f"{port.device}  {port.title or translated('port-unknown')}")


def _as_dict(port: "PortInfo") -> dict[str, str | bool]:
    return {
        "device": port.device,
        "description": port.description,
        "hardware": port.hardware,
        "board": port.board,
    }


def upload_command(
    source: Source,
    port: Port = "",
    no_verify: Annotated[bool, typer.Option("--no-verify", help="For a board that never answers.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would be sent and where; open nothing.")] = False,
    profile: ProfileOption = "classroom",
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Send a program to the leader and check that it arrived."""
    from motorcade.cli.console import progress_bar
    from motorcade.upload.serial_port import upload

    image, chosen = image_of(source, profile, resolve_locale(language))
    baud = chosen.serial.baud
    port = port or _only_port()
    if dry_run:
        _print_plan(port, image, baud, as_json)
        return
    with progress_bar("sent", len(image)) as advance:
        answer = upload(port, image, baud, verify=not no_verify, progress=advance, retrying=_print_retry)
    if as_json:
        print_json({"port": port, "bytes": len(image), "verified": not no_verify, "answer": answer})
    elif no_verify:
        print(translated("upload-not-verified", count=len(image), port=port))
    else:
        print(translated("upload-verified", count=len(image), port=port, answer=answer))


def _print_plan(port: str, image: bytes, baud: int, as_json: bool) -> None:
    plan = {"port": port, "bytes": len(image), "words": len(image) // 4, "crc32": f"{crc32(image):08x}", "baud": baud}
    if as_json:
        print_json({**plan, "sent": False})
    else:
        print(translated("upload-planned", **plan))


def readback_command(
    output: Annotated[Path, typer.Option("-o", "--output", help="Write the image's bytes here.")],
    port: Port = "",
    profile: ProfileOption = "classroom",
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Fetch the image that a car holds."""
    from motorcade.upload.serial_port import readback

    baud = profile_named(profile).serial.baud
    port = port or _only_port()
    image = readback(port, baud, _print_retry)
    write_file(output, image)
    if as_json:
        print_json({"port": port, "bytes": len(image), "file": str(output)})
    else:
        print(translated("image-read-back", count=len(image), port=port, file=output))


def _only_port() -> str:
    """Return the port of the car; where there are several, a user at a terminal chooses. Raises MotorcadeError."""
    from motorcade.upload.ports import SeveralPortsError, likely_port, ports

    try:
        port = likely_port(ports())
    except SeveralPortsError as problem:
        if not (sys.stdin and sys.stdin.isatty() and sys.stderr.isatty()):
            raise
        return _chosen(problem.ports)
    return port.device


def _chosen(ports: list[tuple[str, str]]) -> str:
    def chosen(answer: str) -> int:
        if not answer.isdecimal() or not 1 <= int(answer) <= len(ports):
            raise typer.BadParameter(f"1 … {len(ports)}")
        return int(answer)

    for number, (device, title) in enumerate(ports, start=1):
        print(f"{number:3}  {device}  {title}", file=sys.stderr)
    choice: int = typer.prompt(translated("which-port"), default="1", value_proc=chosen, err=True)
    return ports[choice - 1][0]


def _print_retry(retry: "Retry") -> None:
    # Like the progress bar, only for a user at a terminal.
    if sys.stderr.isatty():
        print(retry.sentence(current_language()), file=sys.stderr)
