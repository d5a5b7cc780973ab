"""Commands that reach cars: ports, upload, readback, install-firmware, arduino-library, and those for many cars."""

import sys
from binascii import crc32
from collections.abc import Callable
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from motorcade import __version__
from motorcade.cli import options
from motorcade.cli.output import (
    Rows,
    is_shown_on_terminal,
    plain,
    print_lines,
    print_note,
    print_problem,
    print_result,
    sentence_of,
    translated,
    wants_json,
)
from motorcade.config.files import raised_as
from motorcade.errors import InputError, MotorcadeError, Phrase
from motorcade.extras import needs_extra

if TYPE_CHECKING:
    from motorcade.config.calibration import Calibration, CalibrationMove
    from motorcade.config.pins import PinMap

# The names in MICROPYTHON of `motorcade.config.chips`, which a command line's start doesn't wait for.
ChipName = Literal["esp32", "rp2040", "rp2350"]


def _shop_name(text: str) -> str:
    # While options are read: a wrong car is told before a missing option.
    from motorcade.firmware.shop import shop_name

    return text and shop_name(text)


ShopCar = Annotated[str, typer.Option("--car", metavar="CAR", callback=_shop_name)]

app = typer.Typer()
cars_app = typer.Typer()


@app.command("ports")
def _ports() -> None:
    from motorcade.upload.serial_port import BARE, ports

    found = ports()
    names = ("device", "description", "hardware", "board")
    lines = []
    if all(port.rank == BARE for port in found):
        lines = [translated("no-car-plugged-in")]
    lines += [f"{port.device}  {port.title or translated('port-unknown')}" for port in found]
    rows = [{name: getattr(port, name) for name in names} for port in found]
    print_result(rows, "\n".join(lines))


@app.command("upload")
def _upload(
    source: options.SourceArgument,
    port: options.PortOption = "",
    to: Annotated[list[str] | None, typer.Option("--to", metavar="all|NAME")] = None,
    resume: Annotated[bool, typer.Option("--resume")] = False,
    car_list: options.CarListOption = None,
    keys: options.OptionalFile = None,
    seconds: options.SecondsOption = 4.0,
    no_verify: Annotated[bool, typer.Option("--no-verify")] = False,
    dry_run: options.DryRun = False,
    profile: options.ImageProfile = None,
) -> None:
    image, chosen = options.image_for(source, profile)
    if to:
        options.exclude_each_other(to=to, port=port, no_verify=no_verify, dry_run=dry_run)
        import asyncio

        from motorcade.cli.fleet import load

        search = options.Lookup(car_list, keys, seconds)
        asyncio.run(load(image, to, search, chosen.serial.baud, resume))
        return
    if resume or car_list or keys:
        raise MotorcadeError("options-need-to")
    baud = chosen.serial.baud
    port = port or _only_port()
    if dry_run:
        size = len(image)
        checksum = f"{crc32(image):08x}"
        plan = {"port": port, "bytes": size, "words": size // 4, "crc32": checksum, "baud": baud}
        print_result({**plan, "sent": False}, translated("upload-planned", **plan))
        return
    answer = _send(port, image, baud, verify=not no_verify)
    key = "upload-verified"
    if no_verify:
        key = "upload-not-verified"
    done = {"port": port, "bytes": len(image), "verified": not no_verify, "answer": answer}
    print_result(done, translated(key, count=len(image), port=port, answer=answer))


@app.command("calibrate")
def _calibrate(
    output: options.Output,
    port: options.PortOption = "",
    no_upload: Annotated[bool, typer.Option("--no-upload")] = False,
    equal: Annotated[bool, typer.Option("--equal")] = False,
    profile: str = "classroom",
) -> None:
    from motorcade.config.calibration import CalibrationMove, measured_profile, profile_text, told
    from motorcade.service.calibration import move_image

    options.exclude_each_other(port=port, no_upload=no_upload)
    if output.suffix != ".toml":
        raise MotorcadeError("profile-needs-toml", file=output)
    with raised_as("file-not-writable", OSError, file=output):
        # Before anybody measures for it.
        output.parent.stat()
    base = options.profile_named(profile)
    if not no_upload:
        port = port or _only_port()

    def send(move: CalibrationMove) -> None:
        if not no_upload:
            _send(port, move_image(move, base), base.serial.baud)

    found = _measured(send)
    options.write_file(output, profile_text(measured_profile(found, base, output.name, equal)).encode())
    written = "profile-written"
    if equal:
        written = "equal-profile-written"
    lines = [*map(sentence_of, told(found)), translated(written, file=output)]
    print_result({"file": str(output), **asdict(found)}, "\n".join(lines))


# What a person types to measure the move before once more.
_BACK = "-"


def _measured(send: "Callable[[CalibrationMove], None]") -> "Calibration":
    """Ask what a ruler shows after each of MOVES, which ``send`` brings to the car; return what that says of the car.

    An answer that can't be is refused in a sentence, and asked for again. Raises MotorcadeError where none comes.
    """
    from motorcade.config.calibration import MOVES, check_readings, fit, readings_of

    print_note(translated("calibrate-begins"))
    readings: dict[str, Any] = {}
    sent = ""
    while True:
        move = MOVES[len(readings)]
        if move.key != sent:
            send(move)
            sent = move.key
            print_note(translated("calibrate-move", number=len(readings) + 1, count=len(MOVES), move=move.title))
        question = translated("calibrate-angle" if move.turns else "calibrate-way")
        try:
            answer = str(typer.prompt(question, err=True))
        except typer.Abort as ended:
            if sys.stdin.isatty() or isinstance(ended.__context__, KeyboardInterrupt):
                raise
            raise InputError("reading-missing", move=move.title) from None
        if answer.strip() == _BACK and readings:
            readings.popitem()
            continue
        try:
            found = {**readings, move.key: readings_of(move, answer)}
            check_readings(found)
            if len(found) == len(MOVES):
                return fit(found)
        except MotorcadeError as problem:
            print_problem(problem)
        else:
            readings = found


@app.command("readback")
def _readback(output: options.Output, port: options.PortOption = "", profile: str = "classroom") -> None:
    from motorcade.upload.serial_port import readback

    baud = options.profile_named(profile).serial.baud
    port = port or _only_port()
    image = readback(port, baud, _print_retry)
    options.write_file(output, image)
    done = {"port": port, "bytes": len(image), "file": str(output)}
    print_result(done, translated("image-read-back", count=len(image), port=port, file=output))


@app.command("install-firmware")
def _install_firmware(
    port: options.PortOption = "",
    role: options.RoleName | None = None,
    car: ShopCar = "",
    pins: options.OptionalFile = None,
    number: Annotated[int | None, typer.Option(min=0, max=(1 << 32) - 1)] = None,
    voice_map: options.OptionalFile = None,
    chip: ChipName | None = None,
    wifi: str = "",
    insecure_lan: options.InsecureLan = False,
    keys: options.OptionalFile = None,
    revoked: options.OptionalFile = None,
    check: Annotated[bool, typer.Option("--check")] = False,
    dry_run: options.DryRun = False,
    profile: str = "",
) -> None:
    options.exclude_each_other(car=car, chip=chip)
    wired = _wired(car, pins)
    chosen_role = _role(role, wired)
    chosen = options.profile_named(profile or car or "classroom")
    if (keys or insecure_lan) and not wifi:
        raise MotorcadeError("keys-without-wifi")
    wanted: dict[str, Any] = {"version": __version__}
    if wifi:
        wanted |= _wifi_settings(wifi, insecure_lan, keys, revoked, dry_run)
    if check:
        wanted["check"] = True

    def settings_for(pin_map: "PinMap") -> dict[str, Any]:
        from motorcade.config.pins import load_voice_map
        from motorcade.firmware.car_files import settings_of

        voice = None
        if voice_map:
            voice = load_voice_map(voice_map)
        settings = settings_of(pin_map, chosen, chosen_role == "leader", number, voice)
        if wifi and not pin_map.chip.has_wifi:
            raise MotorcadeError("wifi-needs-esp32", chip=pin_map.chip.title)
        return settings | wanted

    with needs_extra("firmware", "firmware"):
        from motorcade.cli.console import progress_bar
        from motorcade.config.chips import MICROPYTHON
        from motorcade.firmware.install import car_files, default_pins, install
        from motorcade.upload.serial_port import likely_port, ports
    if dry_run:
        if not wired and not chip:
            raise MotorcadeError("chip-missing")
        settings = settings_for(wired or default_pins(chip or ""))
        sizes = {path: len(data) for path, data in car_files(settings).items()}
        lines = [f"{size:7} {path}" for path, size in sizes.items()]
        lines.append(translated("nothing-copied", bytes=sum(sizes.values()), files=len(sizes)))
        listed = [{"path": path, "bytes": size} for path, size in sizes.items()]
        print_result({"files": listed, "settings": settings}, "\n".join(lines))
        return
    port = port or likely_port(ports()).device
    with progress_bar("copied", 100) as advance:
        done = install(port, wired, settings_for, lambda copied, total: advance(copied * 100 // total))
    data = {"port": port, "role": chosen_role, **done._asdict()}
    key = "files-there-already"
    if done.copied:
        key = "files-copied"
    firmware, _ = MICROPYTHON[done.chip]
    sentence = translated(key, **data | {"chip": firmware.title, "role": Phrase(f"role-{chosen_role}")})
    print_result(data, sentence)


@app.command("arduino-library")
def _arduino_library(
    output: options.Output,
    car: ShopCar = "",
    pins: options.OptionalFile = None,
    role: options.RoleName | None = None,
    number: options.NumberOption = 1,
    voice_map: options.OptionalFile = None,
    profile: str = "",
) -> None:
    from motorcade.config.pins import load_voice_map
    from motorcade.firmware.arduino_library import OWN_SKETCH, library_files, sketch_files, write_library

    files = library_files()
    wired = _wired(car, pins)
    if wired:
        voice = None
        if voice_map:
            voice = load_voice_map(voice_map)
        chosen = options.profile_named(profile or car or "classroom")
        files |= sketch_files(wired, chosen, _role(role, wired) == "leader", number, voice)
        if not wired.chip.is_whole_arduino and wired.pin("infrared", "sender") is not None:
            print_note(translated("arduino-sends-no-infrared", car=wired.name, chip=wired.chip.title))
    with raised_as("file-not-writable", OSError, file=output):
        write_library(output, files)
    data = {"output": str(output), "files": sorted(files), "bytes": sum(map(len, files.values()))}
    sketch = "Uno / Mega / mBot"
    if wired:
        sketch = OWN_SKETCH
    print_result(data, translated("library-written", output=output, files=len(files), sketch=sketch))


def _wired(car: str, pins: Path | None) -> "PinMap | None":
    """Return the pins of a car from a shop, or those in a file; None where neither is named."""
    from motorcade.firmware.shop import shop_car

    options.exclude_each_other(car=car, pins=pins)
    if car:
        return shop_car(car)
    if pins:
        return options.pins_at(pins)
    return None


def _role(given: options.RoleName | None, wired: "PinMap | None") -> options.RoleName:
    """Return the given role, else a follower's where the car can only receive; say so where a leader can't send."""
    from motorcade.firmware.shop import abilities

    can = abilities(wired) if wired else ["leads"]
    only_follows = "follows" in can and "leads" not in can
    if given is None and only_follows:
        return "follower"
    if wired and given == "leader" and only_follows:
        print_note(translated("leader-sends-nothing", car=wired.name))
    return given or "leader"


@cars_app.callback(invoke_without_command=True)
def _cars(
    context: typer.Context,
    car_list: options.CarListOption = None,
    keys: options.OptionalFile = None,
    seconds: options.SecondsOption = 4.0,
) -> None:
    if context.invoked_subcommand is None:
        import asyncio

        from motorcade.cli.fleet import print_cars, show_cars

        search = options.Lookup(car_list, keys, seconds)
        if is_shown_on_terminal() and not wants_json():
            asyncio.run(show_cars(search))
        else:
            asyncio.run(print_cars(search))


@cars_app.command("blink")
def _blink(
    names: Annotated[list[str], typer.Argument(metavar="NAME…")],
    car_list: options.CarListOption = None,
    keys: options.OptionalFile = None,
    seconds: options.SecondsOption = 4.0,
) -> None:
    import asyncio

    from motorcade.cli.fleet import act
    from motorcade.words.request import BLINK

    asyncio.run(act(options.Lookup(car_list, keys, seconds), names, BLINK))
    print_lines([translated("cars-blink", names=", ".join(names))])


@cars_app.command("name")
def _name(
    port: Annotated[str, typer.Argument(metavar="PORT")],
    name: Annotated[str, typer.Argument(metavar="NAME")],
    car_list: options.CarListOption = None,
    keys: options.OptionalFile = None,
    seconds: options.SecondsOption = 4.0,
) -> None:
    import asyncio

    from motorcade.cli.fleet import act
    from motorcade.fleet.places import check_name
    from motorcade.words.request import NAME

    check_name(name)
    asyncio.run(act(options.Lookup(car_list, keys, seconds), [port], NAME, name))
    print_lines([translated("car-named", port=port, name=name)])


@cars_app.command("shop")
def _shop() -> None:
    from motorcade.firmware.shop import described, shop_cars

    cars = [described(name) for name in shop_cars()]
    rows = []
    for car in cars:
        can = ", ".join(translated(f"shop-car-{ability}") for ability in car["can"])
        rows.append((car["name"], car["title"], car["chip"], can))
    print_result(cars, Rows(("name", "car", "board", "can"), rows))
    for car in cars:
        if car["unconfirmed"]:
            print_note(translated("shop-car-unconfirmed", car=car["title"], parts=", ".join(car["unconfirmed"])))


def _ordering(kind: str) -> Callable[..., None]:
    def order_all(
        context: typer.Context,
        car_list: options.CarListOption = None,
        keys: options.OptionalFile = None,
        seconds: options.SecondsOption = 4.0,
    ) -> None:
        import asyncio

        from motorcade.cli.fleet import order

        if context.args:
            raise MotorcadeError("order-is-for-all", kind=kind, names=" ".join(context.args))
        asyncio.run(order(kind, options.Lookup(car_list, keys, seconds)))

    return order_all


for _kind in ("stop", "go"):
    cars_app.command(_kind, context_settings={"allow_extra_args": True})(_ordering(_kind))


def _wifi_settings(
    name: str, insecure_lan: bool, keys: Path | None, revoked: Path | None, dry_run: bool
) -> dict[str, Any]:
    """Return what an ESP32 needs for the Wi-Fi ``name``, with the car's keys; nothing secret for a dry run."""
    options.exclude_each_other(keys=keys, insecure_lan=insecure_lan)
    if not (keys or insecure_lan):
        raise MotorcadeError("wifi-without-keys")
    settings: dict[str, Any] = {}
    if keys:
        from motorcade.drive.keys import REVOKED, chip_keys, read_revoked

        beside = keys.with_name(REVOKED)
        if revoked or beside.exists():
            numbers = read_revoked(revoked or beside)
        else:
            numbers = frozenset()
        today = datetime.now(UTC)
        date = [today.year, today.month, today.day, today.weekday(), 0, 0, 0, 0]
        secrets = chip_keys(keys, numbers) | {"date": date}
        if dry_run:
            secrets["key"] = ""
        settings["keys"] = secrets
    prompt = translated("wifi-password", name=name)
    if dry_run:
        password = ""
    else:
        with raised_as("password-no-text", UnicodeDecodeError):
            password = typer.prompt(prompt, hide_input=True, err=True)
    return settings | {"wifi": {"ssid": name, "password": password}}


def _send(port: str, image: bytes, baud: int, *, verify: bool = True) -> str | None:
    """Upload an image, with a progress bar; return what `motorcade.upload.serial_port.upload` returns."""
    from motorcade.cli.console import progress_bar
    from motorcade.upload.serial_port import upload

    with progress_bar("sent", len(image)) as advance:
        return upload(port, image, baud, verify=verify, progress=advance, retrying=_print_retry)


def _only_port() -> str:
    """Return the port of the car; where there are several, a user at a terminal chooses. Raises MotorcadeError."""
    from motorcade.upload.serial_port import SeveralPortsError, likely_port, ports

    try:
        return likely_port(ports()).device
    except SeveralPortsError as problem:
        if not (sys.stdin and sys.stdin.isatty() and sys.stderr.isatty()):
            raise
        return _chosen(problem.ports)


def _chosen(ports: list[tuple[str, str]]) -> str:
    def chosen(answer: str) -> str:
        if not answer.isdecimal() or not 1 <= int(answer) <= len(ports):
            raise typer.BadParameter(f"1 … {len(ports)}")
        return ports[int(answer) - 1][0]

    for number, (device, title) in enumerate(ports, start=1):
        print(f"{number:3}  {plain(device)}  {plain(title)}", file=sys.stderr)
    return str(typer.prompt(translated("which-port"), default="1", value_proc=chosen, err=True))


def _print_retry(retry: Phrase) -> None:
    # Like the progress bar, only for a user at a terminal.
    if sys.stderr.isatty():
        print(plain(sentence_of(retry)), file=sys.stderr)
