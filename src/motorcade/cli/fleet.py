"""What the commands of several cars do. A file of its own, because asyncio and Rich are slow to import."""

import asyncio
import re
import sys
import time
from binascii import crc32
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager, suppress
from itertools import islice
from pathlib import Path

import typer
from rich.live import Live
from rich.table import Table
from rich.text import Text

from motorcade.cli.console import progress_bar
from motorcade.cli.options import DEFAULT_PROFILE, Lookup, listed
from motorcade.cli.output import (
    Rows,
    is_shown_on_terminal,
    make_table,
    print_json,
    print_problem,
    print_result,
    print_table,
    sentence_of,
    translated,
    wants_json,
)
from motorcade.drive.keys import client_context
from motorcade.errors import MotorcadeError, Phrase
from motorcade.fleet.cars import ALL, MOST_CARS, Cars, Finder, NoSuchCarError
from motorcade.fleet.contact import CarAwayError, CarStatus, Contact
from motorcade.fleet.places import place_of
from motorcade.outcomes import NO_ANSWER
from motorcade.sockets import allow_files
from motorcade.words.request import GO, STOP

_DRAW_S = 0.2
# Files that are open besides connections to cars.
_OTHER_FILES = 64
_LOOK_S = 0.02
# What is a port or an address, and no name.
_PORT = re.compile(r".*[:/].*|COM[0-9]+", re.IGNORECASE)
# Files of the current folder whose programs are known by name.
_PROGRAMS = ("*.motorcade.json", "*.image")
_MOST_PROGRAMS = 200
# So many problems are named below a table.
_MOST_PROBLEMS = 20
_COLUMNS = ("name", "number", "role", "board", "where", "program", "state", "battery", "version", "seen")


async def load(image: bytes, names: Sequence[str], search: Lookup, baud: int, resume: bool) -> None:
    """Upload to many cars, and print a verdict for each; end with an exit code unless all have it."""
    checksum = f"{crc32(image):08x}"
    async with _looking(search, names, baud) as (cars, finder):
        await _found(cars, names, search)
        contacts = cars.named(names)
        is_whole = ALL not in names or not cars.problem
        print_problem(finder.problem)
        if not contacts:
            raise MotorcadeError("no-cars-found")
        sent_bytes = Counter[Contact]()
        done = 0
        with progress_bar("sent", len(contacts) * len(image)) as show:

            def advance(contact: Contact, sent: int) -> None:
                nonlocal done
                done += sent - sent_bytes[contact]
                sent_bytes[contact] = sent
                show(done)

            verdicts = await cars.load(image, names, advance, checksum if resume else "")
    data = [verdict._asdict() | {"error": verdict.error and verdict.error.to_dict()} for verdict in verdicts]
    rows = []
    for verdict in verdicts:
        holds = translated(f"load-{verdict.holds}", crc32=checksum)
        why = ""
        if verdict.error and not isinstance(verdict.error, CarAwayError):
            why = sentence_of(verdict.error)
        rows.append((verdict.car, verdict.where, f"{holds}\n{why}".strip()))
    print_result(data, Rows(("name", "where", "verdict"), rows))
    failed = [verdict.error for verdict in verdicts if verdict.error]
    if failed:
        raise typer.Exit(failed[0].exit_code)
    if not is_whole:
        raise typer.Exit(NO_ANSWER)


@asynccontextmanager
async def _looking(search: Lookup, names: Sequence[str] = (), baud: int = 115200) -> AsyncIterator[tuple[Cars, Finder]]:
    """Look for cars while the block runs; ``names`` may be ports and addresses."""
    places = [*listed(search.file), *(place_of(name) for name in names if _PORT.fullmatch(name))]
    tls = None
    if search.keys:
        tls = client_context(search.keys, takes_chips=True)
    most = allow_files(2 * MOST_CARS + _OTHER_FILES) - _OTHER_FILES
    async with Cars(places, tls, baud) as cars:
        # A drive server takes two connections.
        cars.most_at_once = min(MOST_CARS, max(1, most // 2))
        finder = Finder(cars)
        if search.file:
            yield cars, finder
        else:
            async with finder.looking():
                yield cars, finder


async def act(search: Lookup, names: Sequence[str], kind: str, new: str = "") -> None:
    """Look for these cars, and ask as soon as all are found: `motorcade.fleet.cars.Cars.ask`. Raises MotorcadeError."""
    async with _looking(search, names) as (cars, _):
        await _found(cars, names, search)
        await cars.ask(names, kind, new)


async def _found(cars: Cars, names: Sequence[str], search: Lookup) -> None:
    """Wait until cars of these names are found and answer. Raises MotorcadeError where they aren't in time."""
    end_s = time.monotonic() + search.seconds
    listened_s = time.monotonic() + search.listen_s
    while time.monotonic() < end_s:
        try:
            known = all(contact.is_known.is_set() for contact in cars.named(names))
            if known and ("all" not in names or time.monotonic() >= listened_s):
                return
        except NoSuchCarError:
            # It may be found in a moment.
            pass
        await asyncio.sleep(_LOOK_S)
    cars.named(names)


async def order(kind: str, search: Lookup) -> None:
    """Stop all cars that are found, or let them go; then tell which haven't confirmed it."""
    async with _looking(search) as (cars, finder):
        begin_s = time.monotonic()
        cars.order({"stop": STOP, "go": GO}[kind])
        # Those that are found meanwhile get it too.
        await asyncio.sleep(search.listen_s)
        missing = await cars.confirmed(search.seconds - (time.monotonic() - begin_s))
        count = len(cars.statuses())
        is_whole = not cars.problem
        print_problem(finder.problem)
    if not count:
        raise MotorcadeError("no-cars-found")
    names = [car.name for car in missing]
    lines = [translated(f"cars-{kind}", count=count - len(missing))]
    if missing:
        lines[0] += " " + translated("cars-missing", names=", ".join(names[:_MOST_PROBLEMS]), count=len(missing))
        problems = [(car.name, sentence_of(car.problem)) for car in missing if car.problem]
        lines += [f"{name}: {problem}" for name, problem in problems[:_MOST_PROBLEMS]]
    print_result({"cars": count, "missing": names}, "\n".join(lines))
    if missing or not is_whole:
        raise typer.Exit(NO_ANSWER)


def _program_names() -> dict[str, str]:
    """Return the names of the programs in the current folder, by the CRC-32 of their images (hexadecimal)."""
    names = {}
    found = (file for pattern in _PROGRAMS for file in sorted(Path().glob(pattern)))
    for file in islice(found, _MOST_PROGRAMS):
        from motorcade.program.files import image_in

        with suppress(MotorcadeError, OSError):
            names[f"{crc32(image_in(file, DEFAULT_PROFILE)[0]):08x}"] = file.name.partition(".")[0]
    return names


async def print_cars(search: Lookup) -> None:
    """Print once what is known of all cars."""
    programs = _program_names()
    async with _looking(search) as (cars, finder):
        await asyncio.sleep(search.listen_s)
        await cars.known(search.seconds - search.listen_s)
        statuses = cars.statuses()
    if not wants_json():
        print_table(_table(statuses, finder, programs))
        return
    print_problem(finder.problem)
    rows = [status._asdict() for status in statuses]
    for row in rows:
        row["program"] = programs.get(row["crc32"], "")
        row["problem"] = row["problem"] and row["problem"].to_dict()
    print_json(rows)


async def show_cars(search: Lookup) -> None:
    """Draw the live table until Ctrl-C or q; s stops all cars, g lets them go."""
    loop = asyncio.get_running_loop()
    programs = _program_names()
    async with _looking(search) as (cars, finder):
        ended = asyncio.Event()
        actions = {"s": lambda: cars.order(STOP), "g": lambda: cars.order(GO), "q": ended.set}
        live = Live(_table(cars.statuses(), finder, programs), auto_refresh=False, screen=False)
        with _reading_keys(lambda key: loop.call_soon_threadsafe(actions.get(key, lambda: None))), live:
            while not ended.is_set():
                await asyncio.sleep(_DRAW_S)
                live.update(_table(cars.statuses(), finder, programs), refresh=True)


@contextmanager
def _reading_keys(pressed: Callable[[str], object]) -> Iterator[None]:
    """Call ``pressed`` with each key, in a thread; without the library for keys, Ctrl-C alone ends the table."""
    import threading

    over = threading.Event()

    def read() -> None:
        # Without styles it doesn't ask the terminal what it is, nor swallow keys for seconds where that doesn't answer.
        terminal = KeyTerminal(force_styling=None)
        with terminal.cbreak():
            while not over.is_set():
                if key := terminal.inkey(timeout=_DRAW_S):
                    pressed(str(key).lower())

    thread = threading.Thread(target=read, daemon=True)
    with suppress(ModuleNotFoundError):
        from motorcade.cli.drive_terminal import KeyTerminal

        if sys.stdin and sys.stdin.isatty():
            thread.start()
    try:
        yield
    finally:
        over.set()
        if thread.is_alive():
            # It gives the terminal its echo back.
            thread.join(_DRAW_S * 5)


def _table(rows: Sequence[CarStatus], finder: Finder, programs: dict[str, str]) -> Table:
    away = sum(row.away for row in rows)
    counted = translated("cars-counted", count=len(rows) - away, away=away)
    others = [f"{place.name} ({place.address})" for place in finder.others.values()]
    lines = [counted]
    if is_shown_on_terminal():
        lines.append(translated("cars-keys"))
    if others:
        lines.append(translated("cars-others", list=", ".join(others)))
    problems = [f"{row.name}: {sentence_of(row.problem)}" for row in rows if row.problem]
    lines += problems[:_MOST_PROBLEMS]
    if finder.problem:
        lines.append(sentence_of(finder.problem))
    cells = (_cells(row, programs.get(row.crc32 or "", "")) for row in rows)
    return make_table(_COLUMNS, cells, caption="\n".join(lines))


def _cells(row: CarStatus, program: str) -> list[Text]:
    """Return a row's cells. ``program`` is the name of the car's, if it is known."""
    number = role = image = battery = style = ""
    if row.number is not None:
        number = str(row.number)
    if row.role in ("leader", "follower"):
        role = sentence_of(Phrase(f"role-{row.role}"))
    if row.crc32 is not None:
        image = translated("cars-program", words=row.words or 0, crc32=row.crc32)
    if row.battery_mv is not None:
        battery = f"{row.battery_mv / 1000:.2f} V"
    seen = translated("cars-here")
    if row.away:
        style = "dim"
        if row.silent_s is None:
            seen = translated("cars-silent", seconds=0)
        else:
            seen = translated("cars-away", seconds=round(row.silent_s))
    shown = f"{program}\n{image}".strip()
    cells = [row.name, number, role, row.board or row.kind, row.where, shown, row.state, battery, row.version, seen]
    return [Text(cell, style=style) for cell in cells]
