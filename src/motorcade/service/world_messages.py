"""The messages of the two streams: between a page and its world, and of an upload."""

from typing import Annotated, Any, Literal

from msgspec import UNSET, Meta, Struct, UnsetType, field

from motorcade.service.messages import (
    ErrorAnswer,
    MatDocument,
    MeasuredCar,
    MissionChoice,
    RangeMm,
    Remedy,
    Sentence,
    StreamAnswer,
    StreamMessage,
)

Length = Annotated[float, Meta(ge=-2000, le=2000)]
Seed = Annotated[int, Meta(ge=0, lt=1 << 32)]
CarNumber = Annotated[int, Meta(ge=0, lt=1 << 20)]
# Simulated time.
Milliseconds = Annotated[int, Meta(ge=0, lt=1 << 30)]
# How many simulated seconds pass in a real one.
Speed = Annotated[float, Meta(ge=0.25, le=16)]


class SetWorld(StreamMessage, tag="set"):
    """Build a world; without an image no car has a program.

    With a mission its goals are watched (`Goals`), and the world stops at the mission's end. The mat is the mission's.
    ``counters`` are the names of the leader's counters, as the compiler gives them. With ``car`` the cars drive as one
    that was measured; a mission's never do.
    """

    mat: MatDocument
    image: bytes | None = None
    profile: str = "classroom"
    seed: Seed = 0
    range_mm: RangeMm | None = None
    mission: MissionChoice | None = None
    counters: Annotated[list[Annotated[str, Meta(max_length=80)]], Meta(max_length=4)] = field(default_factory=list)
    car: MeasuredCar | None = None


class Play(StreamMessage):
    """Go on, ``speed`` simulated seconds in a real one."""

    speed: Speed = 1.0


class Pause(StreamMessage):
    """Pause the world."""


class StepWorld(StreamMessage, tag="step"):
    """Go on by so many ticks."""

    ticks: Annotated[int, Meta(ge=1, le=100)] = 1


class Reset(StreamMessage):
    """Begin again; with ``until_ms`` the run is simulated until then at once."""

    seed: Seed = 0
    until_ms: Annotated[int, Meta(ge=0, le=600_000)] = 0


class StopCondition(Struct, forbid_unknown_fields=True):
    """Something that may happen to a car.

    Attributes:
        car: which one; None: any.
        thing, number: what it touches; "" and None: anything.
        corners_m, disc: the zone that it enters: a polygon, or x, y and radius. Sentences call it ``name``.
        words: as indices into the image, the words of the block that it begins, or that ask the condition.
    """

    kind: Literal["touch", "lost", "zone", "block", "stuck", "condition"]
    car: CarNumber | None = None
    thing: Literal["", "wall", "disc", "polygon", "edge", "car"] = ""
    number: int | None = None
    corners_m: Annotated[list[Annotated[list[Length], Meta(min_length=2, max_length=2)]], Meta(max_length=100)] = []
    disc: Annotated[list[Length], Meta(max_length=3)] = []
    name: Annotated[str, Meta(max_length=80)] = ""
    words: Annotated[list[int], Meta(max_length=512)] = []


class StopWhen(StreamMessage, tag="stop-when"):
    """Stop as soon as one of these happens; they replace those before, and end with the world."""

    conditions: Annotated[list[StopCondition], Meta(max_length=20)]


class Speak(StreamMessage, tag="say"):
    """Speak a word that all cars hear."""

    word: Literal["stop", "go"]


class SetEnvironment(StreamMessage, tag="set_environment"):
    """Change what is around the cars."""

    mat: MatDocument
    range_mm: RangeMm | None = None


class Move(StreamMessage):
    """Put a car elsewhere."""

    car: CarNumber
    x_m: Length
    y_m: Length
    heading_deg: Annotated[float, Meta(ge=-360, le=360)] = 0.0


class Watch(StreamMessage):
    """Send the details of a car, or of none."""

    car: CarNumber | None = None


class Seek(StreamMessage):
    """Show a moment of the past, or the present."""

    t_ms: Milliseconds | None = None


class Resume(StreamMessage):
    """Give a car that somebody drove back to its program."""

    car: CarNumber


class Shown(StreamMessage):
    """The newest picture that the page has drawn."""

    frame: Annotated[int, Meta(ge=0, lt=1 << 32)]


WorldMessage = (
    SetWorld
    | Play
    | Pause
    | StepWorld
    | Reset
    | StopWhen
    | Speak
    | SetEnvironment
    | Move
    | Watch
    | Seek
    | Resume
    | Shown
)


class WorldHello(StreamAnswer, tag="hello"):
    """The first answer of a connection, and after each SetWorld; without a world it has three fields only."""

    session: str
    resumed: bool
    cars: int
    leads: list[int] | UnsetType = UNSET
    tick_ms: int | UnsetType = UNSET
    radius_m: float | UnsetType = UNSET
    range_m: float | UnsetType = UNSET


class State(StreamAnswer):
    """How time passes.

    Attributes:
        speed: simulated seconds in a real one, as the page chose.
        shown_ms: the stored moment that is shown; None for the present.
        earliest_ms: the oldest moment that is stored.
        counts: what has happened since the beginning, by name (`motorcade.engine.world.World.counts`).
        rate: simulated seconds in a real one at present; less than ``speed`` on a slow computer.
        driven: the cars that do not run their own program because somebody drives or drove them.
    """

    playing: bool
    speed: float
    t_ms: int
    shown_ms: int | None
    earliest_ms: int
    seed: int
    counts: dict[str, int]
    rate: float
    driven: list[int]


class ReceivedFrame(Struct):
    """A frame: its control word, its tag and check (0: bare), the car that sent it, and when it was received."""

    word: str
    tag: int
    check: int
    car: int
    t_ms: int


class Why(Struct):
    """Why a car does what it does, and what would change it.

    Attributes:
        code: the key of the sentence.
        car: the other car that it speaks of.
        remedy: what would change it: a range in mm, ``followers`` (they need blocks), ``leader`` (one is needed),
            ``forward`` (the cars between pass words on), ``listen`` (to infrared, while words are executed), ``move``
            (this car in front of the one that sends), ``loss`` (no bits flip on the way), ``remove-wall`` and so on
            (what it drives against); "" where nothing is wrong, or no single change is sure to help.
        value: of the remedy: a range, the number of a car, or the index of a wall, a round obstacle or a box.
    """

    code: str
    sentence: Sentence
    car: int | None
    remedy: Remedy | Literal["", "followers"]
    value: int


class CarDetails(StreamAnswer, tag="car"):
    """The details of the watched car: the word that it executes or holds, and its counts since the beginning.

    All are of the shown time, but ``why``: it says why the car does what it does at present.
    """

    car: int
    leads: bool
    word: str | None
    values: dict[str, int] | None
    index: int
    runs: bool
    frames: int
    heard: int
    lost: dict[str, int]
    last_frame: ReceivedFrame | None
    why: Why


Thought = Literal[
    "blockedByCar",
    "blocked",
    "noLine",
    "hidden",
    "outsideBeam",
    "notPassedOn",
    "tooFar",
    "deaf",
    "collisions",
    "damaged",
    "noProgram",
    "nothing",
    "waiting",
]


class CarThought(Struct):
    """What a car thinks: the short form of its answer to 'Why?'."""

    car: int
    thought: Thought


class Thoughts(StreamAnswer):
    """What cars think at the shown time, the most telling thoughts first; the others think nothing."""

    thoughts: list[CarThought]


class Decided(Struct):
    """What a leader that decides has come to.

    Attributes:
        counters: what its counters are.
        holds: the words whose condition is met now, whether or not it has to be, as indices into the image; none of
            chance.
        path: the flow words on the way to its present state, and the word of that state.
    """

    car: int
    counters: list[int]
    holds: list[int]
    path: list[int]


class Decisions(StreamAnswer):
    """What the leaders that decide have come to at the shown time."""

    leaders: list[Decided]


class GoalNow(Struct):
    """How it stands with a goal of the mission, and why, with numbers.

    ``progress`` is open (not met yet), holds (met at present, not for good), met or lost; ``t_ms`` says since when, or
    for a lost one which moment shows it; ``cars`` are those that ``why`` is about.
    """

    progress: Literal["open", "holds", "met", "lost"]
    t_ms: int | None
    why: Sentence
    cars: list[int]


class Goals(StreamAnswer):
    """The goals of the mission at the shown time, in its order; ``is_over``: the run has ended."""

    is_over: bool
    goals: list[GoalNow]


class Stopped(StreamAnswer):
    """The world has stopped: ``condition``, an index into those of StopWhen, began to hold for a car.

    ``others`` are the cars that it has to do with, too.
    """

    t_ms: int
    condition: int
    car: int
    others: list[int]
    why: Sentence


class Refused(StreamAnswer, tag="error"):
    """The error of a message that was refused."""

    code: str
    details: dict[str, Any]
    sentence: Sentence


WorldAnswer = WorldHello | State | CarDetails | Thoughts | Decisions | Goals | Stopped | Refused


# An upload, or the readback of a car's program.


class UploadOrder(Struct, forbid_unknown_fields=True):
    """Send an image to the car at a port, or (``readback``) read the image that it holds."""

    port: str = ""
    image: bytes | None = None
    verify: bool = True
    readback: bool = False
    profile: str = "classroom"


class RetryNotice(Struct):
    """Another try, the ``number``-th of ``of``, and why."""

    number: int
    of: int
    sentence: Sentence


class Progress(Struct, omit_defaults=True):
    """How many bytes of how many were sent."""

    sent: int
    of: int
    retry: RetryNotice | None = None


class _Outcome(Struct, tag_field="outcome"):
    pass


class Verified(_Outcome, tag="verified"):
    """The car holds the image; ``answer`` is what it answered."""

    answer: str


class NotVerified(_Outcome, tag="not-verified"):
    """All bytes were sent; whether they arrived was not checked."""


class ImageRead(_Outcome, tag="image"):
    """The car's image."""

    image: bytes


class Failed(_Outcome, tag="failed"):
    """The transfer failed."""

    error: ErrorAnswer


Outcome = Verified | NotVerified | ImageRead | Failed
UploadAnswer = Progress | Outcome


# The list of cars.


class CarsOrder(Struct, forbid_unknown_fields=True):
    """Blink or load the cars at some ports and addresses, or stop all cars, or let all go.

    ``program`` is the name of the project whose ``image`` is loaded.
    """

    do: Literal["blink", "load", "stop", "go"]
    where: list[str] = []
    image: bytes | None = None
    program: str = ""


class CarRow(Struct):
    """What is known of a car, as `motorcade.fleet.contact.CarStatus` has it.

    Attributes:
        program: the name of the project that it holds, where this server loaded it; else empty.
        sent: bytes of an upload that were sent so far; None where none is under way.
        holds: what the car holds since the last upload, empty where there was none; ``error``: why it isn't the new
            program.
    """

    name: str
    where: str
    kind: str
    number: int | None
    role: str
    board: str
    version: str
    state: str
    words: int | None
    crc32: str | None
    battery_mv: int | None
    away: bool
    silent_s: int | None
    program: str
    problem: Sentence | None
    sent: int | None
    holds: str
    error: Sentence | None


class CarsShown(StreamAnswer, tag="cars"):
    """All cars that are found; ``others``: classes and studios; ``problem``: why the network isn't searched."""

    cars: list[CarRow]
    others: list[str]
    problem: Sentence | None


CarsAnswer = CarsShown | Refused
