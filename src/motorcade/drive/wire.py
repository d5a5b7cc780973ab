"""What travels between a driver and a car: commands of four bytes, frames of a length and JSON, and telemetry.

Both ends use it. Pure: axes, bytes, words and frames in and out; no sockets.
"""

import struct
from collections.abc import Iterator
from typing import Annotated, Any, Literal, NamedTuple

import msgspec

from motorcade.car.arbiter import STATES
from motorcade.errors import MotorcadeError
from motorcade.words.formats import DRIVE

# The longest JSON text of a client's request, and of what a car sends.
MOST_REQUEST_BYTES = 1024
MOST_FRAME_BYTES = 1 << 16
# What became of a command: the arbiter's six outcomes, and three of `motorcade.drive.session`.
OUTCOMES = (
    *("applied", "watching", "needs-neutral", "stopped", "program", "discharged"),
    *("over-rate", "stale", "no-hardware"),
)
# What is counted of a session's words, by name: also those that were no DRIVE words, and those that were not looked at,
# because newer ones of their code had come with them.
COUNTS = (*OUTCOMES, "refused", "superseded")
OVER_RATE = 6
STALE = 7
NO_HARDWARE = 8

_FULL_DUTY = 255
_CENTRE_DEG = 90
_CODE_AT = DRIVE.field("code").low
SPEED_MASK = DRIVE.field("speed").raw_mask << DRIVE.field("speed").low
_LENGTH = struct.Struct(">I")
WORDS = {"big": struct.Struct(">I"), "little": struct.Struct("<I")}


class SessionError(MotorcadeError):
    """A car that is driven refuses a session or a request; its codes travel over the network."""


class DriveRequest(msgspec.Struct):
    """What a client asks for.

    Attributes:
        do: what.
        port: of the client's connection for commands, with "join".
        clock, words, stamp: the client's answer to the car's clock, with "sync".
    """

    do: Literal["join", "request", "release", "stop", "clear", "resume", "sync"]
    port: int = 0
    clock: int = 0
    words: int = 0
    stamp: int = 0


_REQUESTS = msgspec.json.Decoder(DriveRequest)
_DOCUMENTS = msgspec.json.Decoder(dict[str, Any])


def take_frames(received: bytearray, most_bytes: int) -> Iterator[bytes]:
    """Take the JSON texts of the whole frames out of what was received, however it is cut.

    Raises SessionError: "too-long", where a text has more than ``most_bytes``.
    """
    while len(received) >= _LENGTH.size:
        (size,) = _LENGTH.unpack_from(received)
        if size > most_bytes:
            raise SessionError("too-long", most=most_bytes)
        end = _LENGTH.size + size
        if len(received) < end:
            return
        text = bytes(received[_LENGTH.size : end])
        del received[:end]
        yield text


def stick_word(throttle: float, steering: float) -> int:
    """The DRIVE word of a stick.

    Args:
        throttle: -1 full speed back, 0 standing still, 1 full speed ahead.
        steering: -1 full left, 0 straight on, 1 full right, as a stick's horizontal axis.

    Raises:
        ValueError: one of them is out of range or no number.
    """
    for name, value in (("throttle", throttle), ("steering", steering)):
        # Written so that nan is refused too.
        if not -1 <= value <= 1:
            raise ValueError(f"{name} is {value!r}; allowed: -1 to 1")
    return DRIVE.encode(
        code=1,
        angle=_CENTRE_DEG - round(steering * _CENTRE_DEG),
        direction=int(throttle >= 0),
        speed=round(abs(throttle) * _FULL_DUTY),
    )


def pack_word(word: int) -> bytes:
    """A DRIVE word as the four bytes of a command, most significant first."""
    return WORDS["big"].pack(word)


def pack_frame(document: dict[str, Any]) -> bytes:
    """A JSON object as a frame."""
    text = msgspec.json.encode(document)
    return _LENGTH.pack(len(text)) + text


def unpack_frame(text: bytes) -> dict[str, Any]:
    """The JSON object in a frame. Raises ValueError."""
    try:
        return _DOCUMENTS.decode(text)
    except (msgspec.DecodeError, RecursionError) as problem:
        raise ValueError(f"a frame that is no object: {problem}") from None


def read_request(text: bytes) -> DriveRequest:
    """The request in a frame. Raises SessionError."""
    try:
        return _REQUESTS.decode(text)
    except (msgspec.DecodeError, RecursionError):
        raise SessionError("not-a-request") from None


def newest_of_each_code(words: list[int]) -> list[int]:
    """Of words that came together, the index of the newest of each code, in the order in which they came."""
    if len(words) < 2:
        return list(range(len(words)))
    newest = {word >> _CODE_AT: index for index, word in enumerate(words)}
    return sorted(newest.values())


def read_telemetry(frame: dict[str, Any]) -> tuple["Telemetry", dict[str, Any]]:
    """The telemetry in a frame, and what it says of the client. Raises ValueError where a car sends something else."""
    values = [frame.get(name) for name in Telemetry._fields]
    try:
        telemetry = msgspec.convert(values, Telemetry)
        you = msgspec.convert(frame.get("you") or {}, dict[str, _Number | bool | str | None])
    except msgspec.ValidationError as problem:
        raise ValueError(f"telemetry of another kind: {problem}") from None
    if telemetry.state not in dict(STATES):
        raise ValueError(f"{telemetry.state[:40]!r} is no state")
    return telemetry, you


# What every reader of JSON holds exactly: a page, too.
_Number = Annotated[int, msgspec.Meta(ge=-(10**15), le=10**15)]
_OnOff = Annotated[int, msgspec.Meta(ge=0, le=1)]


class Telemetry(NamedTuple):
    """What a car does and who drives it.

    Attributes:
        state: name of a state of `motorcade.car.arbiter`, "ready" to "discharged".
        angle_deg, direction, speed: the setpoint that is applied; 90, 1 and 0 are neutral.
        driver: name of the driver, or None.
        wanted_by: name of the one who waits for the wheel, or None.
        age_ms: since the driver's last command; None where nobody drives.
        battery_mv: the battery's voltage; None where nothing measures it.
        watchers: number of sessions beside the driver's.
        refused: number of words that were no DRIVE words.
        failsafes: how often the wheels were stopped because their driver was silent or gone.
        stalls: how often the car's own software was stuck.
        faults: how often its hardware failed; ``last_fault`` is the last reason.
        turned_away: number of connections that got or kept no place, or failed to prove who they are.
        switches: what is switched on beside the wheels (1) or off (0), by name; only what the car has.
        obstacle_mm: the distance of the obstacle ahead that stops the car while its driver drives forward, or None.
    """

    state: str
    angle_deg: _Number
    direction: _Number
    speed: _Number
    driver: str | None
    wanted_by: str | None
    age_ms: _Number | None
    battery_mv: _Number | None
    watchers: _Number
    refused: _Number
    failsafes: _Number
    stalls: _Number
    faults: _Number
    last_fault: str
    turned_away: _Number
    switches: dict[str, _OnOff]
    obstacle_mm: _Number | None = None
