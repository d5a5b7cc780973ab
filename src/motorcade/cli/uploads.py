"""Commands that reach a car through a port: ports, upload, readback."""

import sys
from binascii import crc32
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.language import Language, current_language, translated
from motorcade.cli.options import (
    ImageProfile,
    Json,
    Output,
    Source,
    image_for,
    print_json,
    print_result,
    profile_named,
    wants_json,
    write_file,
)

if TYPE_CHECKING:
    from motorcade.upload.transfer import Retry

app = typer.Typer()
Port = Annotated[str, typer.Option("--port", "-p")]


@app.command("ports")
def _ports(as_json: Json = False) -> None:
    from motorcade.upload.ports import BARE, ports

    found = ports()
    if wants_json(as_json):
        names = ("device", "description", "hardware", "board")
        print_json([{name: getattr(port, name) for name in names} for port in found])
        return
    if all(port.rank == BARE for port in found):
        print(translated("no-car-plugged-in"))
    for port in found:
        print(f"{port.device}  {port.title or translated('port-unknown')}")


@app.command("upload")
def _upload(
    source: Source,
    port: Port = "",
    no_verify: Annotated[bool, typer.Option("--no-verify")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run")] = False,
    profile: ImageProfile = None,
    language: Language = "",
    as_json: Json = False,
) -> None:
    from motorcade.cli.console import progress_bar
    from motorcade.upload.serial_port import upload

    image, chosen = image_for(source, profile)
    baud, port = chosen.serial.baud, port or _only_port()
    if dry_run:
        plan = {"words": len(image) // 4, "crc32": f"{crc32(image):08x}", "baud": baud}
        plan = {"port": port, "bytes": len(image), **plan}
        print_result({**plan, "sent": False}, translated("upload-planned", **plan), as_json)
        return
    with progress_bar("sent", len(image)) as advance:
        answer = upload(port, image, baud, verify=not no_verify, progress=advance, retrying=_print_retry)
    key = "upload-not-verified" if no_verify else "upload-verified"
    done = {"port": port, "bytes": len(image), "verified": not no_verify, "answer": answer}
    print_result(done, translated(key, count=len(image), port=port, answer=answer), as_json)


@app.command("readback")
def _readback(
    output: Output, port: Port = "", profile: str = "classroom", language: Language = "", as_json: Json = False
) -> None:
    from motorcade.upload.serial_port import readback

    baud = profile_named(profile).serial.baud
    port = port or _only_port()
    image = readback(port, baud, _print_retry)
    write_file(output, image)
    done = {"port": port, "bytes": len(image), "file": str(output)}
    print_result(done, translated("image-read-back", count=len(image), port=port, file=output), as_json)


def _only_port() -> str:
    """Return the port of the car; where there are several, a user at a terminal chooses. Raises MotorcadeError."""
    from motorcade.upload.ports import SeveralPortsError, likely_port, ports

    try:
        return likely_port(ports()).device
    except SeveralPortsError as problem:
        if not (sys.stdin and sys.stdin.isatty() and sys.stderr.isatty()):
            raise
        return _chosen(problem.ports)


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
