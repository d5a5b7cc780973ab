"""The options of a car that runs its image, for its role, line for uploads, store and voice; and what they open."""

import ipaddress
import sys
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from motorcade.cli.language import translated
from motorcade.cli.options import host_and_port, print_note
from motorcade.errors import MotorcadeError

if TYPE_CHECKING:
    from motorcade.boards.computer import Equipment, Observer
    from motorcade.boards.lines import Line, SerialLine
    from motorcade.boards.voice import VoiceSource
    from motorcade.config.profile import Profile

KEYBOARD = "keyboard"
_WRITE_TIMEOUT_S = 0.2


class BoardName(StrEnum):
    """The hardware of a car."""

    SIMULATED = "simulated"
    RASPBERRY_PI = "raspberry-pi"


class Role(StrEnum):
    """What a car does."""

    LEADER = "leader"
    FOLLOWER = "follower"


class CarOptions(NamedTuple):
    """The options that a user gave.

    Attributes:
        role, number: of the car.
        serial: the port that uploads come by; ``tcp``, HOST:PORT, and ``pty``, a new pseudo-terminal, stand for it.
        store: the file that keeps the image, None for the user's own.
        voice, voice_map: KEYBOARD, or a module's port and what it sends; empty for none.
        insecure_lan: whether ``tcp`` may be an address that other computers reach.
    """

    role: Role = Role.LEADER
    number: int = 0
    serial: str = ""
    tcp: str = ""
    store: Path | None = None
    voice: str = ""
    voice_map: Path | None = None
    pty: bool = False
    insecure_lan: bool = False


class CarParts(NamedTuple):
    """A car's equipment, the address of its line for uploads (empty for none), and the file that keeps its image."""

    equipment: "Equipment"
    address: str
    store: Path


def open_parts(resources: ExitStack, options: CarOptions, profile: "Profile", observe: "Observer") -> CarParts:
    """Open a car's line, store and voice; ``resources`` closes them. Raises MotorcadeError."""
    from motorcade.boards.computer import Equipment, ImageStore, StoreError
    from motorcade.config.profile import levels_of

    if options.voice not in ("", KEYBOARD) and options.voice_map is None:
        raise MotorcadeError("voice-map-missing")
    line, address = _open_line(resources, options, profile)
    store = ImageStore(options.store or Path(typer.get_app_dir("motorcade")) / "car.image")
    image = None
    try:
        image = store.load()
    except StoreError as problem:
        # A car that waits for an upload is of more use than one that doesn't start.
        print_note(translated("begins-without-program", problem=problem))
    is_leader, voice = options.role == Role.LEADER, _open_voice(resources, options.voice, options.voice_map)
    equipment = Equipment(is_leader, options.number, levels_of(profile), line, image, store.save, voice, observe)
    return CarParts(equipment, address, store.path)


def _open_line(resources: ExitStack, options: CarOptions, profile: "Profile") -> "tuple[Line, str]":
    from motorcade.boards.lines import Line, PseudoTerminal, TcpPort

    if options.serial:
        return _open_serial(resources, options.serial, profile.serial.baud), options.serial
    if not (options.tcp or options.pty):
        return Line(), ""
    line = TcpPort(*host_and_port(options.tcp)) if options.tcp else PseudoTerminal()
    resources.callback(line.close)
    if options.tcp and not options.insecure_lan:
        host, _ = host_and_port(line.address.removeprefix("socket://"))
        if not ipaddress.ip_address(host.partition("%")[0]).is_loopback:
            raise MotorcadeError("uploads-in-reach", host=host)
    return line, line.address


def _open_serial(resources: ExitStack, port: str, baud: int) -> "SerialLine":
    from time import monotonic

    import serial

    from motorcade.boards.lines import SerialLine
    from motorcade.upload.serial_port import open_error

    def open_port() -> serial.Serial:
        return serial.serial_for_url(port, baudrate=baud, timeout=0, write_timeout=_WRITE_TIMEOUT_S, exclusive=True)

    try:
        line = SerialLine(open_port, monotonic)
    except (serial.SerialException, OSError, ValueError) as problem:
        raise open_error(port, problem) from None
    resources.callback(line.close)
    return line


def _open_voice(resources: ExitStack, voice: str, voice_map: Path | None) -> "VoiceSource":
    from motorcade.boards.voice import SerialVoice, VoiceSource

    if voice == KEYBOARD:
        from motorcade.boards.computer import KeyboardVoice

        return KeyboardVoice(sys.stdin)
    if voice and voice_map:
        from motorcade.config.voice_map import load_voice_map

        module = load_voice_map(voice_map)
        return SerialVoice(_open_serial(resources, voice, module.baud).read, module.patterns)
    return VoiceSource()
