"""Commands for the car itself: car run, car neutral and car wiring.

Each command imports what it needs when it runs, so that the others start at once.
"""

import json
import signal
from collections.abc import Callable
from contextlib import ExitStack, suppress
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motorcade.cli.car_options import (
    CarOptions,
    CarParts,
    NumberOption,
    Role,
    RoleOption,
    StoreOption,
    VoiceMapOption,
    VoiceOption,
    open_parts,
)
from motorcade.cli.language import Language, current_language, resolve_locale
from motorcade.cli.options import Json, ProfileOption, needs_extra, print_json, profile_named, wants_json
from motorcade.errors import MotorcadeError, Phrase
from motorcade.locales import command_line_text

if TYPE_CHECKING:
    from motorcade.boards.computer import ComputerBoard, Equipment, Observer
    from motorcade.config.profile import Profile

# Dozens a second; the log shows what follows from them.
_UNLOGGED = ("frame", "heard")

Pins = Annotated[
    Path, typer.Option("--pins", help="Which part is at which pin: a .toml file.", exists=True, dir_okay=False)
]
GpioChip = Annotated[
    int | None, typer.Option("--gpio-chip", min=0, help="N of /dev/gpiochipN; the computer's own, unless given.")
]


class BoardKind(StrEnum):
    """The hardware of a car."""

    RASPBERRY_PI = "raspberry-pi"
    SIMULATED = "simulated"


def add_to(app: typer.Typer) -> None:
    """Register the group."""
    group = typer.Typer(help="Be a car: on a Raspberry Pi, or on any computer that simulates one.")
    group.command("run")(run_command)
    group.command("neutral")(neutral_command)
    group.command("wiring")(wiring_command)
    app.add_typer(group, name="car")


def run_command(
    pins: Annotated[
        Path | None, typer.Option(help="Which part is at which pin: a .toml file.", exists=True, dir_okay=False)
    ] = None,
    role: RoleOption = Role.LEADER,
    number: NumberOption = 0,
    board: Annotated[BoardKind, typer.Option(help="simulated needs no pins and no hardware.")] = BoardKind.RASPBERRY_PI,
    port: Annotated[str, typer.Option("--port", "-p", help="The serial port that uploads come by.")] = "",
    tcp: Annotated[str, typer.Option(help="Take uploads at HOST:PORT instead; port 0 takes a free one.")] = "",
    use_pty: Annotated[bool, typer.Option("--pty", help="Take uploads at a new pseudo-terminal instead.")] = False,
    store: StoreOption = None,
    voice: VoiceOption = "",
    voice_map: VoiceMapOption = None,
    watchdog: Annotated[Path | None, typer.Option(help="Feed this hardware watchdog, such as /dev/watchdog.")] = None,
    gpio_chip: GpioChip = None,
    profile: ProfileOption = "classroom",
    as_json: Json = False,
) -> None:
    """Drive this car by the words that it holds, until Ctrl-C; it then stands still."""
    from motorcade.boards.computer import run

    if board == BoardKind.RASPBERRY_PI and pins is None:
        raise MotorcadeError("pins-missing")
    lines = {"--port": port, "--tcp": tcp, "--pty": use_pty}
    given = [name for name, value in lines.items() if value]
    if len(given) > 1:
        raise MotorcadeError("options-exclude-each-other", first=given[0], second=given[1])
    chosen = profile_named(profile)
    options = CarOptions(role, number, port, tcp, store, voice, voice_map, use_pty)
    with ExitStack() as resources:
        parts = open_parts(resources, options, chosen, _observer(chosen, as_json))
        stops = _stops(_watchdog(resources, watchdog))
        made = _board(parts.equipment, pins if board == BoardKind.RASPBERRY_PI else None, chosen, gpio_chip)
        _print_start(role, parts, as_json)
        run(made, parts.equipment.line.wait, stops)


def neutral_command(pins: Pins, gpio_chip: GpioChip = None, as_json: Json = False) -> None:
    """Stop the wheels of a car whose program has died, for the kernel keeps its pins as they were."""
    with needs_extra("pins", "pi"):
        from motorcade.boards.linux.opening import stop_wheels
    from motorcade.config.pins import load_pins

    wiring = load_pins(pins)
    low = stop_wheels(wiring, gpio_chip)
    if as_json:
        print_json({"low": low})
    else:
        print(command_line_text("wheels-stopped", current_language(), car=wiring.name, pins=", ".join(map(str, low))))


def wiring_command(
    pins: Annotated[Path, typer.Argument(metavar="PINS", exists=True, dir_okay=False, help="A .toml file of pins.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Draw it into this SVG file.")] = None,
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Show which wire of a car goes where: a table, or a drawing. A pin file with a mistake is refused."""
    from motorcade.boards.wiring import wiring_rows, wiring_svg
    from motorcade.cli.options import print_table, write_file
    from motorcade.config.pins import load_pins

    chosen, wiring = resolve_locale(language), load_pins(pins)
    rows = wiring_rows(wiring, chosen)
    if output:
        write_file(output, wiring_svg(wiring, chosen).encode(), source=pins)
    if wants_json(as_json):
        print_json([row._asdict() for row in rows])
    elif output:
        print(command_line_text("wires-drawn", chosen, count=len(rows), file=output))
    else:
        from rich.table import Table

        headings = [command_line_text(f"wiring-{key}", chosen) for key in ("part", "terminal", "pin")]
        table = Table(*headings, title=wiring.name, title_justify="left")
        for row in rows:
            table.add_row(row.part, row.terminal, row.label)
        print_table(table)


def _watchdog(resources: ExitStack, path: Path | None) -> Callable[[], None] | None:
    if path is None:
        return None
    from motorcade.boards.computer import HardwareWatchdog

    watchdog = HardwareWatchdog(path)
    resources.callback(watchdog.close)
    return watchdog.keep_alive


def _board(equipment: "Equipment", pins: Path | None, profile: "Profile", gpio_chip: int | None) -> "ComputerBoard":
    from motorcade.boards.computer import ComputerBoard

    if pins is None:
        return ComputerBoard(equipment)
    with needs_extra("pins", "pi"):
        from motorcade.boards.linux.opening import open_car
    from motorcade.config.pins import load_pins

    return open_car(equipment, load_pins(pins), profile, gpio_chip)


def _stops(keep_alive: Callable[[], None] | None) -> Callable[[], bool]:
    """Return what says whether a signal asked the car to stop; each call in a tick keeps the watchdog alive."""
    signals: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda which, frame: signals.append(which))

    def stops() -> bool:
        if keep_alive:
            keep_alive()
        return bool(signals)

    return stops


def _print_start(role: Role, parts: CarParts, as_json: bool) -> None:
    if as_json:
        print_json({"role": str(role), "port": parts.address, "store": str(parts.store)})
        return
    key = "car-takes-uploads" if parts.address else "car-takes-no-uploads"
    details = {"role": Phrase(f"role-{role}"), "address": parts.address, "store": parts.store}
    print(command_line_text(key, current_language(), **details), flush=True)


def _observer(profile: "Profile", as_json: bool) -> "Observer":
    """Print what the car does: a line, or a line of JSON."""
    from motorcade.cli.console import describe_control

    language = current_language()

    def observe(kind: str, at_ms: int, word: int, detail: int | str) -> None:
        if kind in _UNLOGGED:
            return
        if as_json:
            line = json.dumps({"t_ms": at_ms, "kind": kind, "word": word, "detail": detail})
        else:
            does = describe_control(word, profile) if kind in ("state", "start") else ""
            event = command_line_text(f"car-{kind}", language, count=word, detail=detail, does=does)
            line = f"{at_ms / 1000:9.3f} s  {event}"
        # The car drives on when nobody reads its log any more.
        with suppress(OSError):
            print(line, flush=True)

    return observe
