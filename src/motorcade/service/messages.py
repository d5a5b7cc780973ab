"""Requests of a page and their answers, declared once; `motorcade.service.world_messages` has the streams.

`web/src/generated/messages.ts` is written from these types by `scripts/generate.py`.
"""

from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta, Struct, field

from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError
from motorcade.locales import languages
from motorcade.program.parts import MOST_PIECES

T = TypeVar("T")
# A text in every language that has a catalogue.
Sentence = dict[str, str]
# Blockly's serialization of a workspace.
WorkspaceState = dict[str, Any]
# A motorcade-mat/1 document.
MatDocument = dict[str, Any]

RangeMm = Annotated[int, Meta(ge=1, le=20_000)]


class Nothing(Struct):
    """A request without arguments, or an answer without content."""


class Capabilities(Struct):
    """What this shell can do beside what every shell can; the page shows only what is there.

    Attributes:
        serial_ports: the shell lists serial ports of its own, and uploads through them.
        films: runs can be downloaded as films.
        real_cars: the remote drives real cars beside the simulated ones.
        most_cars: the most cars in one world.
    """

    serial_ports: bool
    films: bool
    real_cars: bool
    most_cars: int


class ErrorAnswer(Struct, omit_defaults=True):
    """Why a request was refused, by `motorcade.errors.MotorcadeError.to_dict`; a program also has diagnostics."""

    code: str
    details: dict[str, Any]
    sentence: Sentence
    diagnostics: "list[Diagnostic]" = []


class Blocks(Struct):
    """What both editors hold."""

    leader: WorkspaceState
    followers: WorkspaceState | None = None
    profile: str = "classroom"


class Word(Struct, omit_defaults=True):
    """A word, its fields by name, and the block that it comes from.

    ``fields_of`` names the blocks of those fields that come from other blocks.
    """

    hex: str
    part: str
    values: dict[str, int]
    block: str | None
    fields_of: dict[str, str] = {}


class Span(Struct):
    """When a word runs, counted from the beginning of its round."""

    word: int
    begin_ms: int
    end_ms: int


class Costliest(Struct):
    """The block that makes the most words."""

    block: str | None
    count: int


class Costs(Struct):
    """The costliest block of each editor; None where an editor makes no words."""

    leader: Costliest | None = None
    followers: Costliest | None = None


class Timeline(Struct):
    """When each word of the leader's and the followers' rounds runs."""

    leader: list[Span] = []
    followers: list[Span] = []


class Diagnostic(Struct):
    """A diagnostic of a program; without a block it is about the whole editor."""

    code: str
    severity: str
    sentence: Sentence
    path: str
    block: str | None
    editor: str | None


class Compiled(Struct):
    """What the page shows of a program; ``image`` is None where the program can't be compiled."""

    diagnostics: list[Diagnostic]
    image: bytes | None = None
    dwell_ms: int = 0
    states: int = 0
    follower_words: int = 0
    most: int = MOST_PIECES
    costliest: Costs = field(default_factory=Costs)
    words: list[Word] = []
    timeline: Timeline = field(default_factory=Timeline)


class Text(Struct):
    """The text of a project's file."""

    text: str


class Image(Struct):
    """An image's bytes, as base64."""

    image: bytes


class Project(Struct):
    """What the page works on; ``range_mm`` is how far infrared reaches, None for as far as the profile says."""

    leader: WorkspaceState
    followers: WorkspaceState | None = None
    profile: str = "classroom"
    mat: MatDocument | None = None
    range_mm: RangeMm | None = None


class StoredProject(Project):
    """A project of the library, by its name there."""

    name: str = ""


class ProjectName(Struct):
    """A project of the library."""

    name: str


class ProjectVersion(Struct):
    """A version of a project; the newest where none is named."""

    name: str
    version: Annotated[int, Meta(ge=0, lt=1 << 30)] | None = None


class ProjectToSave(Struct):
    """A project, and its name in the library."""

    name: str
    project: Project


class SavedVersion(Struct):
    """The number of the version that holds what was saved."""

    version: int


class LibraryEntry(Struct):
    """A project of the library: when it was last saved (ISO 8601, UTC), and how many versions there are."""

    name: str
    saved_at: str
    versions: int


class Version(Struct):
    """A version of a project, and when it was saved (ISO 8601, UTC)."""

    version: int
    saved_at: str


class ExampleName(Struct):
    """An example program."""

    id: str


class Example(Struct):
    """An example program, and what it shows."""

    id: str
    title: Sentence
    about: Sentence


class WordField(Struct):
    """A field of a word: its bits, and its title."""

    name: str
    high: int
    low: int
    title: Sentence


class Formats(Struct):
    """The fields of the two kinds of words."""

    header: list[WordField]
    control: list[WordField]


class StepField(Struct, omit_defaults=True):
    """A field of a step's block.

    Attributes:
        input: ``choice`` of ``options``, ``level`` of ``levels``, ``number`` from ``minimum`` on, or ``seconds``.
        name: its name in the block's serialization.
        menu: what the levels are, such as ``speed``.
        first: the value in a new block.
    """

    input: str
    name: str
    options: list[str] = []
    menu: str = ""
    levels: list[int] = []
    minimum: int | None = None
    first: int | None = None


class StepKind(Struct, omit_defaults=True):
    """A kind of step; see `motorcade.program.steps.Step`.

    Attributes:
        holds: whether its block holds other steps.
        group: the bits of the control word that it fills, if any; ``hue`` is their colour in degrees.
    """

    kind: str
    category: str
    accompanies: bool
    holds: bool
    fields: list[StepField]
    group: str = ""
    hue: int = 0


class Seconds(Struct):
    """The durations that a step can have."""

    least: float
    step: float
    most: float


@dataclass(frozen=True, slots=True)
class ProfileFigures(Profile):
    """A profile, and the durations that its steps can have."""

    seconds: Seconds


class MatToCheck(Struct):
    """A mat."""

    mat: MatDocument


class MatCars(Struct):
    """How many cars a mat has, and which of them lead."""

    cars: int
    leads: list[int]


class Port(Struct):
    """A port to upload through; ``kind`` is serial or virtual."""

    port: str
    description: str
    kind: str


def sentences(phrase: Any) -> Sentence:
    """A phrase or an error in every language."""
    return {language: phrase.sentence(language) for language in languages()}


def decode(data: bytes | str, kind: type[T]) -> T:
    """The message of ``kind`` in ``data``, which is JSON. Raises MotorcadeError."""
    try:
        return msgspec.json.decode(data, type=kind)
    except RecursionError:
        raise MotorcadeError("message-too-deep") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as problem:
        raise MotorcadeError("bad-message", reason=str(problem).rstrip(".")) from None
