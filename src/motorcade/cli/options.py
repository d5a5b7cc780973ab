"""Options and arguments that commands share, and what is read and written by them."""

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import typer

from motorcade.cli.output import print_diagnostics, print_note, sentence_of
from motorcade.errors import MotorcadeError, Phrase
from motorcade.outcomes import PROGRAM_ERROR
from motorcade.sockets import DRIVE_PORT, host_and_port

if TYPE_CHECKING:
    from motorcade.config.pins import PinMap
    from motorcade.config.profile import Profile
    from motorcade.fleet.places import Place
    from motorcade.mats import Mat
    from motorcade.service.messages import MeasuredCar

DEFAULT_PROFILE = "classroom"
# A frame has 36 bits; a number with more digits than this is none that anything here takes.
_MOST_OF_A_NUMBER = 80
# How an address of a drive server is printed beside others.
DRIVE_SCHEME = "drive://"
# A list of cars in the folder where a command runs is read without being named.
_USUAL_LIST = Path("cars.toml")
# The least time for which a command listens for announcements of cars.
_LISTEN_S = 1.5

# As pages show an IPv6 address, it has brackets.
Host = Annotated[str, typer.Option(callback=lambda host: host.strip("[]"))]
ExistingFile = Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True)]
SourceArgument = Annotated[Path, typer.Argument(metavar="PROJECT|IMAGE", exists=True, dir_okay=False, readable=True)]
OptionalFile = Annotated[Path | None, typer.Option(exists=True, dir_okay=False)]
Output = Annotated[Path, typer.Option("-o", "--output")]
OptionalOutput = Annotated[Path | None, typer.Option("-o", "--output")]
PortOption = Annotated[str, typer.Option("--port", "-p")]
GpioChip = Annotated[int | None, typer.Option(min=0)]
TcpPortOption = Annotated[int, typer.Option(min=0, max=65535)]
OptionalTcpPort = Annotated[int | None, typer.Option(min=0, max=65535)]
# The profile of an image. A project names its own, so the option has no default.
ImageProfile = Annotated[str | None, typer.Option("--profile")]
NumberOption = Annotated[int, typer.Option(min=0, max=(1 << 32) - 1)]
InsecureLan = Annotated[bool, typer.Option("--insecure-lan")]
CarListOption = Annotated[Path | None, typer.Option("--list", exists=True, dir_okay=False)]
KeysFile = Annotated[Path | None, typer.Option(dir_okay=False)]
LogFile = Annotated[Path | None, typer.Option("--log", dir_okay=False)]
CarsOption = Annotated[list[str] | None, typer.Option("--car", metavar="NAME=HOST[:PORT]")]
Cameras = Annotated[list[str] | None, typer.Option("--camera", metavar="NAME=URL")]
PageKeys = Annotated[Path | None, typer.Option("--https", dir_okay=False)]
NoBrowser = Annotated[bool, typer.Option("--no-browser")]
DryRun = Annotated[bool, typer.Option("--dry-run")]
SecondsOption = Annotated[float, typer.Option(min=0.1, max=3600)]
Jobs = Annotated[int, typer.Option(min=0, max=1024)]
RoleName = Literal["leader", "follower"]


class Lookup(NamedTuple):
    """Where to look for cars.

    Attributes:
        file: a list, whose places alone are asked; None for ports, the network and the usual list.
        keys: a driver's keys.
        seconds: for how long to look.
    """

    file: Path | None
    keys: Path | None
    seconds: float

    @property
    def listen_s(self) -> float:
        """For how long announcements are awaited."""
        if self.file:
            return 0.0
        return min(_LISTEN_S, self.seconds)


def car_address(text: str) -> tuple[str, int]:
    """Return host and port of a car that is driven: ``[drive://]HOST[:PORT]``. Raises MotorcadeError."""
    return host_and_port(text.removeprefix(DRIVE_SCHEME), DRIVE_PORT)


def own_folder() -> Path:
    """Return the folder of this user's settings and files."""
    # By the specification of XDG an empty path, or a relative one, counts as none.
    if not Path(os.environ.get("XDG_CONFIG_HOME", "")).is_absolute():
        os.environ.pop("XDG_CONFIG_HOME", None)
    return Path(typer.get_app_dir("motorcade"))


def exclude_each_other(**given: Any) -> None:
    """Raise MotorcadeError where more than one of the options is given; each has a name of Python's."""
    names = [f"--{name.replace('_', '-')}" for name, value in given.items() if value]
    if len(names) > 1:
        raise MotorcadeError("options-exclude-each-other", first=names[0], second=names[1])


def listed(file: Path | None) -> "list[Place]":
    """Return the places in a list of cars, or in the usual one where none is named. Raises MotorcadeError."""
    from motorcade.fleet.places import read_list

    file = file or (_USUAL_LIST if _USUAL_LIST.is_file() else None)
    if file:
        return read_list(file)
    return []


def profile_named(name: str) -> "Profile":
    """Return a built-in profile, or the one in a .toml file."""
    from motorcade.config.profile import load_profile

    return load_profile(name, Path())


def pins_at(path: Path) -> "PinMap":
    """Load a pin file, and print what its pins do at power-on or carry that matters to the parts there."""
    from motorcade.config.pins import load_pins

    pins = load_pins(path)
    for warning in pins.warnings:
        print_note(f"{path.name}: {sentence_of(warning)}")
    return pins


def image_for(source: Path, profile_name: str | None) -> "tuple[bytes, Profile]":
    """Return the image in a file, or compile the project in it, and the profile, as `image_of`.

    ``profile_name`` is the option --profile. Raises MotorcadeError where a project names another profile.
    """
    image, profile = image_of(source, profile_name or DEFAULT_PROFILE)
    if profile_name and replace(profile_named(profile_name), name=profile.name) != profile:
        raise MotorcadeError("profile-is-the-projects", file=source, profile=profile.name, other=profile_name)
    return image, profile


class OwnWorld(NamedTuple):
    """What a project keeps of the world in which its author saw it; None for what it doesn't."""

    mat: "Mat | None" = None
    range_mm: int | None = None
    car: "MeasuredCar | None" = None


def own_world(source: Path) -> OwnWorld:
    """Return what the project in a file keeps of its world; nothing for an image or Python text.

    Raises MotorcadeError where its mat is not valid. The project is.
    """
    from motorcade.config.files import read_bytes
    from motorcade.mats.document import mat_of
    from motorcade.program.files import PYTHON, is_project
    from motorcade.program.model import read_program
    from motorcade.service.documents import setting

    data = read_bytes(source)
    if source.suffix == PYTHON or not is_project(data, source):
        return OwnWorld()
    beside = read_program(data).beside
    mat = None
    if "mat" in beside:
        mat = mat_of(beside["mat"], Phrase("mat-named", name=source.name))
    view = beside.get("view")
    return OwnWorld(mat, setting(view, "range_mm"), setting(view, "car"))


def image_of(source: Path, profile_name: str, place: str = "") -> "tuple[bytes, Profile]":
    """Return the image in a file, or compile the project in it, and the profile.

    Diagnostics are printed on standard error; errors among them end the command. Raises MotorcadeError for a file that
    is neither; the sentence names ``place``, or else the file.
    ``profile_name`` is the profile of an image; a project names its own.
    """
    from motorcade.program.diagnostics import ProgramError
    from motorcade.program.files import image_in

    try:
        image, profile, diagnostics = image_in(source, profile_name, place)
    except ProgramError as problem:
        print_diagnostics(problem.diagnostics)
        raise typer.Exit(PROGRAM_ERROR) from None
    print_diagnostics(diagnostics)
    return image, profile


def whole_number(text: str, name: str | Phrase) -> int:
    """Return ``text`` as an integer: decimal, 0x hexadecimal or 0b binary. Raises MotorcadeError."""
    for base in (0, 10) if len(text) <= _MOST_OF_A_NUMBER else ():
        try:
            return int(text, base)
        except ValueError:
            continue
    raise MotorcadeError("not-a-whole-number", name=name, text=text[:40])


def write_file(path: Path, data: bytes, source: Path | None = None) -> None:
    """Write ``data`` whole or not at all. Raises MotorcadeError where ``path`` is the file ``source``."""
    from motorcade.config.files import raised_as, replace_file

    if source and path.exists() and path.samefile(source):
        raise MotorcadeError("output-is-input", file=path)
    with raised_as("file-not-writable", OSError, file=path):
        replace_file(path, data)
