"""Requests of a page and their answers, declared once; `motorcade.service.world_messages` has the streams.

`web/src/generated/messages.ts` is written from these types by `scripts/generate.py`.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from inspect import Parameter, signature
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

import msgspec
from msgspec import Meta, Struct, field

from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError
from motorcade.locales import languages
from motorcade.program.parts import MOST_PIECES

T = TypeVar("T")
# A title is the name of the type in TypeScript, where a dictionary has one.
# A text in every language that has a catalogue.
Sentence = Annotated[dict[str, str], Meta(title="Sentence")]
# Blockly's serialization of a workspace.
WorkspaceState = Annotated[dict[str, Any], Meta(title="WorkspaceState")]
# A motorcade-mat/1 document.
MatDocument = Annotated[dict[str, Any], Meta(title="MatDocument")]
# A motorcade-mission/1 document.
MissionDocument = dict[str, Any]

RangeMm = Annotated[int, Meta(ge=1, le=20_000)]
VersionNumber = Annotated[int, Meta(ge=0, lt=1 << 30)]


class StreamMessage(Struct, tag_field="do", tag=str.lower, forbid_unknown_fields=True):
    """What a page sends over a WebSocket; ``do`` says what it is."""


class StreamAnswer(Struct, tag_field="is", tag=str.lower):
    """What a page is sent over a WebSocket; ``is`` says what it is."""


class Nothing(Struct, forbid_unknown_fields=True):
    """A request without arguments, or an answer without content."""


class MissionChoice(Struct):
    """A mission: the id of one that comes with Motorcade, or the document of the user's own."""

    id: str = ""
    document: MissionDocument | None = None


class Capabilities(Struct):
    """What this shell can do beyond what every shell can; the page offers nothing else.

    Attributes:
        serial_ports: the shell has serial ports of its own, lists them, and uploads through them.
        downloads: the events of a run can be downloaded from an address; else the page makes the file.
        driving: the cars of a world can be driven on the page /drive.
        most_cars: the most cars in one world.
        cars: where the page gets the list of cars (/api/cars); "" where the shell finds none.
        classroom: the page is a pupil's or the teacher's in a class; "" where there is none.
    """

    serial_ports: bool
    downloads: bool
    driving: bool
    most_cars: int
    classroom: Literal["", "pupil", "teacher"] = ""
    cars: str = ""


class ErrorAnswer(Struct, omit_defaults=True):
    """Why a request was refused, by `motorcade.errors.MotorcadeError.to_dict`; a program also has diagnostics."""

    code: str
    details: dict[str, Any]
    sentence: Sentence
    diagnostics: "list[Diagnostic]" = []


class Blocks(Struct):
    """The blocks in both editors, and the profile."""

    leader: WorkspaceState
    followers: WorkspaceState | None = None
    profile: str = "classroom"


class Word(Struct, omit_defaults=True):
    """A word, and the block that it was compiled from.

    ``fields_of`` has, by field, the blocks of those fields that other blocks fill.
    """

    hex: str
    part: Literal["header", "leader", "followers"]
    block: str | None
    fields_of: dict[str, str] = {}


class Costliest(Struct):
    """The block that makes the most words."""

    block: str | None
    count: int


class Costs(Struct):
    """The costliest block of each editor; None where an editor makes no words."""

    leader: Costliest | None = None
    followers: Costliest | None = None


class TextPlace(Struct):
    """A part of a text, from its first character to the one behind its last; lines and columns count from 1."""

    line: int
    column: int
    end_line: int
    end_column: int


class Fix(Struct):
    """A value or an edit that would fix what is wrong, and what a button says that does it.

    Attributes:
        field: the field of the block, or of the editor's first block where there is none; "TEXT" where the value
            replaces a text; "DELETE" where the block is to be deleted; "BEHIND" where it is to stand behind the block
            around it.
        block: the block; None for the diagnostic's.
        place: the text that the value replaces; None for the one at the diagnostic's place.
    """

    field: str
    value: int | float | str
    sentence: Sentence
    block: str | None = None
    place: TextPlace | None = None


class Diagnostic(Struct, omit_defaults=True):
    """An error or warning of a program; ``block`` is None where it concerns the whole editor.

    Attributes:
        place: its place in the Python text, for a diagnostic of such a text.
        fixes: values each of which would fix it.
    """

    code: str
    severity: Literal["error", "warning"]
    sentence: Sentence
    path: str
    block: str | None
    editor: Literal["leader", "followers"] | None
    place: TextPlace | None = None
    fixes: list[Fix] = []


class BlocksAndText(Blocks):
    """The blocks in both editors, and the Python text beside them; an empty text where there is none yet."""

    text: str = ""


class BlockPlace(TextPlace):
    """Where a block stands in the Python text."""

    block: str = ""


class PythonText(Struct):
    """The Python text of the blocks.

    Attributes:
        text: the text as it was sent, where it makes the program already, or cannot be read, or the blocks make none.
        places: where each block stands in it; empty where the text cannot be read, or the blocks make no program.
        diagnostics: what is wrong with the text as it was sent.
    """

    text: str
    places: list[BlockPlace] = []
    diagnostics: list[Diagnostic] = []


class PythonBlocks(Struct):
    """The blocks of a Python text; ``leader`` is None where the text can't be read.

    Blocks that are the same as those that were sent, or come from them, have their ids.
    """

    leader: WorkspaceState | None = None
    followers: WorkspaceState | None = None
    profile: str = "classroom"
    diagnostics: list[Diagnostic] = []


class CompiledBlocks(Struct):
    """What the page shows of a program; ``image`` is None where the program can't be compiled.

    ``left_out`` lists the blocks that have errors: ``words`` are those of all others then. ``counters`` are the names
    of the leader's counters by their numbers in the words, "" for one without a name.
    """

    diagnostics: list[Diagnostic]
    image: bytes | None = None
    dwell_ms: int = 0
    tagged: bool = False
    states: int = 0
    follower_words: int = 0
    most: int = MOST_PIECES
    costliest: Costs = field(default_factory=Costs)
    words: list[Word] = []
    left_out: list[str] = []
    counters: list[str] = []


class Text(Struct):
    """The text of a project's file."""

    text: str


Level = Literal["start", "words", "python"]
Figures = Annotated[list[int], Meta(min_length=4, max_length=4)]


class MeasuredCar(Struct):
    """The figures of a car that was measured, as profiles have them: of each level, and of its wheels."""

    speeds_mm_s: Figures
    turn_rates_deg_s: Figures
    drift_mrad_per_m: int
    stopping_ms: int


class Project(Blocks):
    """The page's project.

    Attributes:
        range_mm: the range of infrared; None for that of the profile.
        python: the program's Python text with its comments; None where nobody opened it.
        level: how much the page shows; None for what its user chose last.
        car: the cars drive as this one; None for cars of the profile.
    """

    mat: MatDocument | None = None
    range_mm: RangeMm | None = None
    python: str | None = None
    level: Level | None = None
    car: MeasuredCar | None = None


# What would change what a car does; `motorcade.service.world_messages.Why` tells what each means.
Remedy = Literal[
    "range_mm",
    "leader",
    "forward",
    "listen",
    "move",
    "loss",
    "remove-wall",
    "remove-disc",
    "remove-polygon",
    "remove-car",
]


class StoredProject(Project):
    """A project, its name in the library, and the version that it is."""

    name: str = ""
    version: int = 0


class SavedVersion(Struct):
    """The number of the version that holds what was saved, and whether it stays when the page is closed."""

    version: int
    stays: bool = True


class StorageState(Struct):
    """Where projects are stored: whether they stay when the page is closed, and what is wrong with them."""

    stays: bool = True
    problems: list[ErrorAnswer] = []


class LibraryEntry(Struct):
    """A project of the library: when it was last saved (ISO 8601, UTC), and how many versions there are."""

    name: str
    saved_at: str
    versions: int


class Version(Struct):
    """A version of a project, and when it was saved (ISO 8601, UTC)."""

    version: int
    saved_at: str


Difficulty = Literal[1, 2, 3]
"""Of an example: 1 for the first day, 3 for who knows all blocks."""


class Example(Struct):
    """An example program, and what it shows."""

    id: str
    title: Sentence
    about: Sentence
    difficulty: Difficulty


class Seconds(Struct):
    """The durations that a step can have, in seconds: from ``least`` to ``most``, in steps of ``step``."""

    least: float
    step: float
    most: float


@dataclass(frozen=True, slots=True)
class ProfileFigures(Profile):
    """A profile, what people call such cars, and the durations that its steps can have."""

    title: Sentence
    seconds: Seconds


class Port(Struct):
    """A port to upload through; ``kind`` is serial or virtual."""

    port: str
    description: str
    kind: Literal["serial", "virtual"]


def sentences(phrase: Any) -> Sentence:
    """Return a phrase or an error in every language."""
    return {language: phrase.sentence(language) for language in languages()}


class Endpoint(NamedTuple):
    """A request: the types of its message and its answer, and the function that answers it.

    Attributes:
        given: the function's parameters that aren't in the message: the server or the worker gives them.
        whole: the function's parameter that is the message; "" where its parameters are the message's fields.
    """

    message: Any
    answer: Any
    function: Callable[..., Any]
    given: tuple[str, ...]
    whole: str

    @classmethod
    def of(cls, function: Callable[..., Any], known: Collection[str], **options: Any) -> "Endpoint":
        """Return the request that a function answers: a Struct that is its only parameter is the message.

        Args:
            known: parameters that aren't in the message, where the function has them.
            options: of the message's type.
        """
        found = signature(function)
        given = tuple(name for name in found.parameters if name in known)
        asked = [parameter for name, parameter in found.parameters.items() if name not in known]
        if len(asked) == 1 and isinstance(only := asked[0].annotation, type) and issubclass(only, Struct):
            return cls(only, found.return_annotation, function, given, asked[0].name)
        fields = [
            (
                parameter.name,
                parameter.annotation,
                *([] if parameter.default is Parameter.empty else [parameter.default]),
            )
            for parameter in asked
        ]
        message: type[Struct] = Nothing
        if asked:
            message = msgspec.defstruct(f"_{function.__name__}", fields, **options)
        return cls(message, found.return_annotation or Nothing, function, given, "")

    def arguments(self, data: bytes) -> dict[str, Any]:
        """Return the arguments in a message, which is JSON; no message means none. Raises MotorcadeError."""
        message = decode(data or b"{}", self.message)
        if self.whole:
            return {self.whole: message}
        return msgspec.structs.asdict(message)


def encoded(answer: Any) -> str | bytes:
    """Return an answer as it is sent: the bytes of a picture, or text in JSON."""
    if isinstance(answer, bytes):
        return answer
    return msgspec.json.encode(answer).decode()


def decode(data: bytes | str, kind: type[T]) -> T:
    """Decode JSON to a message of type ``kind``. Raises MotorcadeError where it isn't valid."""
    try:
        return msgspec.json.decode(data, type=kind)
    except RecursionError:
        raise MotorcadeError("message-too-deep") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as problem:
        raise MotorcadeError("bad-message", reason=str(problem).rstrip(".")) from None
