"""The command install-firmware, which makes a car of a board with MicroPython.

It imports what it needs when it runs, so that the other commands start at once.
"""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from motorcade.cli.car_options import Role
from motorcade.cli.language import Language, resolve_locale
from motorcade.cli.options import Json, ProfileOption, needs_extra, print_json, profile_named, wants_json
from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import command_line_text

if TYPE_CHECKING:
    from motorcade.config.pins import PinMap

_TITLES = {"esp32": "ESP32", "rp2040": "Raspberry Pi Pico"}


class ChipName(StrEnum):
    """The chips of MicroPython cars."""

    ESP32 = "esp32"
    RP2040 = "rp2040"


def add_to(app: typer.Typer) -> None:
    """Register the command."""
    app.command("install-firmware")(install_firmware_command)


def install_firmware_command(
    port: Annotated[str, typer.Option("--port", "-p", help="Such as /dev/ttyUSB0 or COM3. Found, unless given.")] = "",
    role: Annotated[Role, typer.Option(help="Whether the car leads or follows.")] = Role.LEADER,
    pins: Annotated[
        Path | None,
        typer.Option(
            help="Which part is at which pin: a .toml file. Else the chip's usual ones.", exists=True, dir_okay=False
        ),
    ] = None,
    number: Annotated[
        int | None, typer.Option(min=0, max=(1 << 32) - 1, help="The car's own; its chip's, unless given.")
    ] = None,
    voice_map: Annotated[
        Path | None, typer.Option(help="What the voice module sends: a .toml file.", exists=True, dir_okay=False)
    ] = None,
    chip: Annotated[
        ChipName | None, typer.Option(help="For --dry-run without --pins; else the board says what it is.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="List what would be copied; open nothing.")] = False,
    profile: ProfileOption = "classroom",
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Make a car of an ESP32 or a Raspberry Pi Pico that runs MicroPython."""
    spoken = resolve_locale(language)
    chosen = profile_named(profile)

    def settings_for(pin_map: "PinMap") -> dict[str, Any]:
        from motorcade.config.voice_map import load_voice_map
        from motorcade.firmware.car_files import settings_of

        voice = load_voice_map(voice_map) if voice_map else None
        return settings_of(pin_map, chosen, role == Role.LEADER, number, voice)

    with needs_extra("firmware", "firmware"):
        from motorcade.cli.console import progress_bar
        from motorcade.config.pins import load_pins
        from motorcade.firmware.install import default_pins, install
    if dry_run:
        if not pins and not chip:
            raise MotorcadeError("chip-missing")
        _print_plan(settings_for(load_pins(pins) if pins else default_pins(str(chip))), as_json, spoken)
        return
    port = port or _likely_port()
    with progress_bar("copied", 100) as advance:
        done = install(port, pins, settings_for, lambda copied, total: advance(copied * 100 // total))
    if wants_json(as_json):
        print_json({"port": port, "role": role.value, **done._asdict()})
        return
    key = "files-copied" if done.copied else "files-there-already"
    details = {**done._asdict(), "chip": _TITLES[done.chip], "port": port, "role": Phrase(f"role-{role}")}
    print(command_line_text(key, spoken, **details))


def _likely_port() -> str:
    from motorcade.upload.ports import likely_port, ports

    return likely_port(ports()).device


def _print_plan(settings: dict[str, Any], as_json: bool, language: str) -> None:
    from motorcade.firmware.car_files import board_files

    files = board_files(settings)
    if wants_json(as_json):
        print_json(
            {"files": [{"path": path, "bytes": len(data)} for path, data in files.items()], "settings": settings}
        )
        return
    for path, data in files.items():
        print(f"{len(data):7} {path}")
    total = sum(map(len, files.values()))
    print(command_line_text("nothing-copied", language, bytes=total, files=len(files)))
