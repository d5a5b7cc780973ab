"""What is put on a microcontroller: a car for MicroPython, and the library of Arduino cars."""

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from motorcade.cli.car_options import Role
from motorcade.cli.language import Language, translated
from motorcade.cli.options import (
    CarNumber,
    Json,
    OptionalFile,
    Output,
    print_json,
    profile_named,
    wants_json,
)
from motorcade.errors import MotorcadeError, Phrase
from motorcade.extras import needs_extra

if TYPE_CHECKING:
    from motorcade.config.pins import PinMap

_TITLES = {"esp32": "ESP32", "rp2040": "Raspberry Pi Pico"}

app = typer.Typer()


class ChipName(StrEnum):
    """The chips of MicroPython cars."""

    ESP32 = "esp32"
    RP2040 = "rp2040"


@app.command("install-firmware")
def _install_firmware(
    port: Annotated[str, typer.Option("--port", "-p")] = "",
    role: Role = Role.LEADER,
    pins: OptionalFile = None,
    number: Annotated[int | None, typer.Option(min=0, max=(1 << 32) - 1)] = None,
    voice_map: OptionalFile = None,
    chip: ChipName | None = None,
    dry_run: Annotated[bool, typer.Option("--dry-run")] = False,
    profile: str = "classroom",
    language: Language = "",
    as_json: Json = False,
) -> None:
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
        from motorcade.upload.ports import likely_port, ports
    if dry_run:
        if not pins and not chip:
            raise MotorcadeError("chip-missing")
        _print_plan(settings_for(load_pins(pins) if pins else default_pins(str(chip))), as_json)
        return
    port = port or likely_port(ports()).device
    with progress_bar("copied", 100) as advance:
        done = install(port, pins, settings_for, lambda copied, total: advance(copied * 100 // total))
    if wants_json(as_json):
        print_json({"port": port, "role": role.value, **done._asdict()})
        return
    key = "files-copied" if done.copied else "files-there-already"
    details = {**done._asdict(), "chip": _TITLES[done.chip], "port": port, "role": Phrase(f"role-{role}")}
    print(translated(key, **details))


@app.command("arduino-library")
def _arduino_library(
    output: Output,
    pins: OptionalFile = None,
    role: Role = Role.LEADER,
    number: CarNumber = 1,
    voice_map: OptionalFile = None,
    profile: str = "classroom",
    language: Language = "",
    as_json: Json = False,
) -> None:
    from motorcade.config.pins import load_pins
    from motorcade.config.voice_map import load_voice_map
    from motorcade.firmware.arduino_library import OWN_SKETCH, library_files, sketch_files, write_library

    files = library_files()
    if pins:
        voice = load_voice_map(voice_map) if voice_map else None
        files |= sketch_files(load_pins(pins), profile_named(profile), role == Role.LEADER, number, voice)
    try:
        write_library(output, files)
    except OSError as problem:
        raise MotorcadeError("file-not-writable", file=output, reason=problem.strerror) from None
    if wants_json(as_json):
        print_json({"output": str(output), "files": sorted(files), "bytes": sum(map(len, files.values()))})
        return
    sketch = OWN_SKETCH if pins else "Uno / Mega"
    print(translated("library-written", output=output, files=len(files), sketch=sketch))


def _print_plan(settings: dict[str, Any], as_json: bool) -> None:
    from motorcade.firmware.install import car_files

    files = car_files(settings)
    if wants_json(as_json):
        listed = [{"path": path, "bytes": len(data)} for path, data in files.items()]
        print_json({"files": listed, "settings": settings})
        return
    for path, data in files.items():
        print(f"{len(data):7} {path}")
    print(translated("nothing-copied", bytes=sum(map(len, files.values())), files=len(files)))
