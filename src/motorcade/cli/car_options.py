"""What a car that runs its image is given by options: its role, its line for uploads, its store and its voice.

It imports what it needs when it is called, so that the commands start at once.
"""

import sys
from collections.abc import Callable
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from motorcade.cli.addresses import host_and_port
from motorcade.cli.failures import UsageError

if TYPE_CHECKING:
    from motorcade.boards.linux.board import Equipment, Line
    from motorcade.boards.linux.serial_line import SerialLine
    from motorcade.boards.voice import VoiceSource
    from motorcade.config.profile import Profile

    Observe = Callable[[str, int, int, int | str], None]

KEYBOARD = "keyboard"
_WRITE_TIMEOUT_S = 0.2


class Role(StrEnum):
    """What a car does."""

    LEADER = "leader"
    FOLLOWER = "follower"


RoleOption = Annotated[Role, typer.Option("--role", help="Whether the car leads or follows.")]
NumberOption = Annotated[
    int, typer.Option("--number", min=0, max=(1 << 32) - 1, help="The car's own; its dice go by it.")
]
StoreOption = Annotated[Path | None, typer.Option("--store", help="The file that the car keeps its image in.")]
VoiceOption = Annotated[str, typer.Option("--voice", help="'keyboard', or the serial port of a voice module.")]
VoiceMapOption = Annotated[
    Path | None,
    typer.Option("--voice-map", help="What the voice module sends: a .toml file.", exists=True, dir_okay=False),
]


class CarOptions(NamedTuple):
    """What was asked for.

    Attributes:
        role, number: of the car.
        serial: the port that uploads come by, or ``tcp``, HOST:PORT; both empty for none.
        store: the file that keeps the image, None for the user's own.
        voice, voice_map: KEYBOARD, or a module's port and what it sends; empty for none.
    """

    role: Role = Role.LEADER
    number: int = 0
    serial: str = ""
    tcp: str = ""
    store: Path | None = None
    voice: str = ""
    voice_map: Path | None = None


class CarParts(NamedTuple):
    """A car's equipment, what its line for uploads is called (empty for none), and the file that keeps its image."""

    equipment: "Equipment"
    address: str
    store: Path


def fit_out(held: ExitStack, asked: CarOptions, profile: "Profile", observe: "Observe") -> CarParts:
    """What a car is given by ``asked``; ``held`` closes it. Raises UsageError, and what its ports and files do."""
    from motorcade.boards.linux.board import Equipment
    from motorcade.boards.simulated import ImageStore, StoreError
    from motorcade.config.profile import levels_of

    if asked.voice not in ("", KEYBOARD) and asked.voice_map is None:
        raise UsageError("--voice-map is missing: a .toml file that says what the module at --voice sends")
    line, address = _line(held, asked.serial, asked.tcp, profile)
    store = ImageStore(asked.store or Path(typer.get_app_dir("motorcade")) / "car.image")
    image = None
    try:
        image = store.load()
    except StoreError as problem:
        # A car that waits for an upload is of more use than one that doesn't start.
        print(f"motorcade: {problem}. The car begins without a program and waits for an upload.", file=sys.stderr)
    is_leader, voice = asked.role == Role.LEADER, _voice(held, asked.voice, asked.voice_map)
    equipment = Equipment(is_leader, asked.number, levels_of(profile), line, image, store.save, voice, observe)
    return CarParts(equipment, address, store.path)


def _line(held: ExitStack, port: str, tcp: str, profile: "Profile") -> "tuple[Line, str]":
    if tcp:
        from motorcade.boards.simulated import TcpPort

        listening = TcpPort(*host_and_port(tcp))
        held.callback(listening.close)
        return listening, listening.address
    if port:
        return _serial_line(held, port, profile.serial.baud), port
    from motorcade.boards.linux.board import NoLine

    return NoLine(), ""


def _serial_line(held: ExitStack, port: str, baud: int) -> "SerialLine":
    from time import monotonic

    import serial

    from motorcade.boards.linux.serial_line import SerialLine
    from motorcade.upload.serial_port import not_opened

    def open_port() -> serial.Serial:
        return serial.serial_for_url(port, baudrate=baud, timeout=0, write_timeout=_WRITE_TIMEOUT_S, exclusive=True)

    try:
        line = SerialLine(open_port, monotonic)
    except (serial.SerialException, OSError, ValueError) as problem:
        raise not_opened(port, problem) from None
    held.callback(line.close)
    return line


def _voice(held: ExitStack, voice: str, voice_map: Path | None) -> "VoiceSource":
    from motorcade.boards.voice import SerialVoice, VoiceSource

    if voice == KEYBOARD:
        from motorcade.boards.keyboard import KeyboardVoice

        return KeyboardVoice(sys.stdin)
    if voice and voice_map:
        from motorcade.config.voice_map import load_voice_map

        known = load_voice_map(voice_map)
        return SerialVoice(_serial_line(held, voice, known.baud).read, known.patterns)
    return VoiceSource()
