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
    fit_out,
)
from motorcade.cli.failures import UsageError
from motorcade.cli.options import Json, Language, ProfileOption, print_json, profile_named, resolve_locale, wants_json
from motorcade.cli.recordings import needs_extra

if TYPE_CHECKING:
    from motorcade.boards.linux.board import Equipment, LinuxBoard
    from motorcade.config.profile import Profile

# Dozens a second; who wants them has the words behind them.
_TOO_MANY = ("frame", "heard")
_BEGINS = {"state": "state {}", "start": "a word from the air"}

Pins = Annotated[
    Path, typer.Option("--pins", help="Which part is at which pin: a .toml file.", exists=True, dir_okay=False)
]
GpioChip = Annotated[
    int | None, typer.Option("--gpio-chip", min=0, help="N of /dev/gpiochipN; the computer's own, unless given.")
]


class BoardKind(StrEnum):
    """What a car has under it."""

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
    store: StoreOption = None,
    voice: VoiceOption = "",
    voice_map: VoiceMapOption = None,
    watchdog: Annotated[Path | None, typer.Option(help="Feed this hardware watchdog, such as /dev/watchdog.")] = None,
    gpio_chip: GpioChip = None,
    profile: ProfileOption = "classroom",
    as_json: Json = False,
) -> None:
    """Drive this car by the words that it holds, until Ctrl-C; it then stands still."""
    from motorcade.boards.linux.board import run

    if board == BoardKind.RASPBERRY_PI and pins is None:
        raise UsageError(
            "--pins is missing: a .toml file that says which part is at which pin, such as firmware/linux/pins.toml; "
            "or try the car without hardware: --board simulated"
        )
    if port and tcp:
        raise UsageError("--port and --tcp exclude each other")
    chosen, asked = profile_named(profile), CarOptions(role, number, port, tcp, store, voice, voice_map)
    with ExitStack() as held:
        fitted = fit_out(held, asked, chosen, _observer(chosen, as_json))
        stops = _stops(_watchdog(held, watchdog))
        made = _board(fitted.equipment, pins if board == BoardKind.RASPBERRY_PI else None, chosen, gpio_chip)
        _tell_begin(role, fitted, as_json)
        run(made, fitted.equipment.line.wait, stops)


def neutral_command(pins: Pins, gpio_chip: GpioChip = None, as_json: Json = False) -> None:
    """Stop the wheels of a car whose program has died, for the kernel keeps its pins as they were."""
    with needs_extra("a car's pins", "pi"):
        from motorcade.boards.linux.opening import stop_wheels
    from motorcade.config.pins import load_pins

    wiring = load_pins(pins)
    low = stop_wheels(wiring, gpio_chip)
    if as_json:
        print_json({"low": low})
    else:
        print(f"The wheels of {wiring.name} stand still: pins {', '.join(map(str, low))} are low.")


def wiring_command(
    pins: Annotated[Path, typer.Argument(metavar="PINS", exists=True, dir_okay=False, help="A .toml file of pins.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Draw it into this SVG file.")] = None,
    language: Language = "",
    as_json: Json = False,
) -> None:
    """Show which wire of a car goes where: a table, or a drawing. A pin file that can't be is refused."""
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
        print(f"{len(rows)} wires are drawn in {output}")
    else:
        from rich.table import Table

        table = Table("part", "terminal", "pin", title=wiring.name, title_justify="left")
        for row in rows:
            table.add_row(row.part, row.terminal, row.label)
        print_table(table)


def _watchdog(held: ExitStack, path: Path | None) -> Callable[[], None] | None:
    if path is None:
        return None
    from motorcade.boards.linux.hardware_watchdog import HardwareWatchdog

    watchdog = HardwareWatchdog(path)
    held.callback(watchdog.close)
    return watchdog.feed


def _board(equipment: "Equipment", pins: Path | None, profile: "Profile", gpio_chip: int | None) -> "LinuxBoard":
    from motorcade.boards.linux.board import LinuxBoard

    if pins is None:
        return LinuxBoard(equipment)
    with needs_extra("a car's pins", "pi"):
        from motorcade.boards.linux.opening import open_car
    from motorcade.config.pins import load_pins

    return open_car(equipment, load_pins(pins), profile, gpio_chip)


def _stops(feed: Callable[[], None] | None) -> Callable[[], bool]:
    """Says whether the car shall stop, by Ctrl-C or a service manager; asked in each tick, it feeds the watchdog."""
    stopped: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda which, frame: stopped.append(which))

    def stops() -> bool:
        if feed:
            feed()
        return bool(stopped)

    return stops


def _tell_begin(role: Role, fitted: CarParts, as_json: bool) -> None:
    address, store = fitted.address, fitted.store
    if as_json:
        print_json({"role": str(role), "port": address, "store": str(store)})
        return
    where = f"takes uploads at {address}" if address else "takes no uploads (--port or --tcp names where it would)"
    print(f"This {role} {where} and keeps its image in {store}. Ctrl-C stops it.", flush=True)


def _observer(profile: "Profile", as_json: bool) -> Callable[[str, int, int, int | str], None]:
    """Prints what the car does: a line, or a JSON object a line."""
    from motorcade.cli.console import describe_control

    def observe(kind: str, at_ms: int, word: int, detail: int | str) -> None:
        if kind in _TOO_MANY:
            return
        if as_json:
            line = json.dumps({"t_ms": at_ms, "kind": kind, "word": word, "detail": detail})
        elif kind == "image":
            line = f"{at_ms / 1000:9.3f} s  took an image of {word} bytes"
        elif kind == "lost":
            line = f"{at_ms / 1000:9.3f} s  lost a frame: {detail}"
        elif kind == "over":
            line = f"{at_ms / 1000:9.3f} s  over"
        else:
            line = f"{at_ms / 1000:9.3f} s  {_BEGINS[kind].format(detail)}: {describe_control(word, profile)}"
        # A car drives on when nobody reads its log any more.
        with suppress(OSError):
            print(line, flush=True)

    return observe
