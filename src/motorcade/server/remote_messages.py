"""What the remote's page and the server send to each other.

`web/src/generated/remote.ts` is written from these types by `scripts/generate.py`.
"""

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

from motorcade.service.messages import Sentence, StreamAnswer, StreamMessage
from motorcade.service.world_messages import Refused

Name = Annotated[str, Meta(max_length=40)]
Names = Annotated[list[Name], Meta(max_length=16)]
Axis = Annotated[float, Meta(ge=-1, le=1)]
Bit = Annotated[int, Meta(ge=0, le=1)]
Stamp = Annotated[int, Meta(ge=0, le=2047)]
Number = Annotated[int, Meta(ge=0, lt=1 << 53)]


class _ToOneCar(StreamMessage):
    car: Name


class Join(_ToOneCar):
    """Connect to a car, to watch or to drive."""


class Leave(_ToOneCar):
    """End the connection to a car."""


class Drive(StreamMessage):
    """The stick's position, for all of these cars.

    Attributes:
        throttle: -1 full speed back to 1 full speed ahead.
        steering: -1 full left to 1 full right.
        switches: what is switched beside the wheels, 0 or 1 by name.
        number: the page's own count; the answer `Received` has it.
        stamp: when it was sent, as `motorcade.drive.stamps.stamp_at` has it; 0: not said.
    """

    cars: Names
    throttle: Axis
    steering: Axis
    switches: dict[Name, Bit] = field(default_factory=dict)
    number: Number = 0
    stamp: Stamp = 0


class RequestDrive(_ToOneCar, tag="request"):
    """Ask to drive."""


class Release(_ToOneCar):
    """Stop driving, or stop waiting to drive."""


class Stop(StreamMessage):
    """Emergency stop of all of these cars."""

    cars: Names


class Clear(_ToOneCar):
    """Lift the emergency stop."""


class Resume(_ToOneCar):
    """Give the car back to its own program."""


class Sync(StreamMessage):
    """The answer to the clock in `Telemetry`, so that the page's stamps are believed again.

    Attributes:
        clock: as it came.
        number: of the page's last `Drive`.
        stamp: of this message, as `Drive` has it.
    """

    clock: Number
    number: Number
    stamp: Stamp


class Start(StreamMessage):
    """Run the cars' world where it is paused."""


RemoteMessage = Join | Leave | Drive | RequestDrive | Release | Stop | Clear | Resume | Sync | Start


class ListedCar(Struct):
    """A car in a page's list.

    Attributes:
        car: its name in messages.
        leads: whether it leads others; None where that means nothing.
        sees: whether it has a camera.
        name: the name that its owner gave it, where there is one.
    """

    car: str
    leads: bool | None
    sees: bool
    name: str | None = None


# The states of `motorcade.car.arbiter`, and that of a car that can't be reached.
CarState = Literal["ready", "standing", "moving", "failsafe", "stopped", "program", "disarmed", "discharged", "away"]


# It also has the counts of the page's commands.
You = Annotated[dict[str, Any], Meta(title="{ drives: boolean; waits: boolean }")]


class CarTelemetry(Struct, kw_only=True):
    """What a page shows of a car's `motorcade.drive.wire.Telemetry`, and what concerns this page.

    By default, of a car that sent none.

    Attributes:
        state: also ``away``: the car can't be reached.
        paused: the car's world is paused.
        silent_ms: the time since the server received telemetry.
        why: the reason of the state ``away``, where it is known.
        you: whether this page ``drives`` and ``waits``, and the counts of its commands.
    """

    state: CarState = "away"
    speed: int = 0
    driver: str | None = None
    wanted_by: str | None = None
    battery_mv: int | None = None
    last_fault: str = ""
    switches: dict[str, int] = {}
    obstacle_mm: int | None = None
    paused: bool = False
    silent_ms: int = 0
    why: Sentence | None = None
    you: You = field(default_factory=lambda: {"drives": False, "waits": False})


class RemoteHello(StreamAnswer, tag="hello"):
    """The cars, and the page's name at them; the first answer, and the answer to Start."""

    cars: list[ListedCar]
    you: str


class Telemetry(StreamAnswer):
    """The telemetry of each car that the page has joined.

    ``clock`` is the server's clock, where the page has sent no fresh `Drive` for long and has to answer by `Sync`.
    """

    cars: dict[str, CarTelemetry]
    clock: int | None = None


class Received(StreamAnswer):
    """The number of the newest Drive that the server received; ``stale``: it was sent too long ago and did nothing."""

    number: int
    stale: bool = False


RemoteAnswer = RemoteHello | Telemetry | Received | Refused
