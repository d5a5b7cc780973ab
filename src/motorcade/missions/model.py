"""What a mission is: its texts, zones, goals and notes, and where its cars drive."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

from motorcade.config.profile import Profile
from motorcade.errors import Phrase
from motorcade.locales import FIRST, languages, page_text
from motorcade.mats.model import Corners, Disc, Mat
from motorcade.mats.schema import FORMAT as MAT_FORMAT
from motorcade.program.model import Program
from motorcade.program.steps import KINDS

# What the page shows.
LEVELS = ("start", "words", "python")
# A text by language; every language has one.
Sentence = dict[str, str]


@dataclass(frozen=True, slots=True)
class Wording:
    """A text of a mission as a detail of a sentence."""

    texts: Sentence

    @classmethod
    def of_page(cls, *path: str) -> Self:
        """A text of the page, by its keys."""
        return cls({language: page_text(path, language) for language in languages()})

    def sentence(self, language: str = FIRST) -> str:
        """The text in ``language``, or in English."""
        return self.texts.get(language) or self.texts[FIRST]

    def __str__(self) -> str:
        return self.sentence()

    def __hash__(self) -> int:
        return hash(tuple(self.texts.items()))


@dataclass(frozen=True, slots=True)
class Zone:
    """An area of the floor: a polygon, or a disc where ``corners`` is empty. Lengths are metres."""

    name: str
    title: Wording
    corners: Corners = ()
    disc: Disc = (0.0, 0.0, 0.0)

    def box(self) -> tuple[float, float, float, float]:
        """Left, bottom, right and top."""
        x, y, radius = self.disc
        across, up = [[corner[axis] for corner in self.corners] or [middle] for axis, middle in enumerate((x, y))]
        return min(across) - radius, min(up) - radius, max(across) + radius, max(up) + radius


@dataclass(frozen=True, slots=True)
class Goal:
    """One goal.

    Attributes:
        kind: a key of `motorcade.missions.schema.GOALS`.
        star: the star that it is for, 1 to 3.
        values: its other keys, with defaults.
        cars: the numbers of the cars that ``who`` names; empty where the kind has no ``who``.
        text: what the page says in place of its description; None for the description.
    """

    kind: str
    star: int
    values: dict[str, Any]
    cars: tuple[int, ...] = ()
    text: Wording | None = None


@dataclass(frozen=True, slots=True)
class Notes:
    """What a teacher reads: how many minutes a class needs, what pupils learn, what to say first, and how to go on.

    Attributes:
        mistakes: usual ones, each with the number of the hint that helps, from 1; None where none does.
    """

    minutes: int
    aim: Wording
    say: Wording
    mistakes: tuple[tuple[Wording, int | None], ...]
    further: Wording


@dataclass(frozen=True)
class Mission:
    """A mission; see docs/missions.md for what its keys mean.

    Attributes:
        document: what the file holds, with defaults.
        id: the name of its file, without the ending.
        mat: where the cars drive.
    """

    id: str
    document: dict[str, Any]
    name: Wording
    story: Wording
    learned: Wording
    hints: tuple[Wording, ...]
    mat: Mat
    profile: Profile
    zones: tuple[Zone, ...]
    goals: tuple[Goal, ...]
    start: Program | None
    solution: Program | None
    near_miss: Program | None
    notes: Notes | None

    @property
    def duration_ms(self) -> int:
        """How long a run lasts."""
        seconds: float = self.document["seconds"]
        return round(seconds * 1000)

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds on which every goal must be met."""
        return tuple(self.document["seeds"])

    @property
    def palette(self) -> list[str]:
        """The kinds of steps whose blocks the page offers: those of ``steps``, or else of its level."""
        in_level = [kind for kind, step in KINDS.items() if step.in_start or self.document["level"] != LEVELS[0]]
        return self.document.get("steps") or in_level

    @property
    def stars(self) -> int:
        """How many stars there are."""
        return len({goal.star for goal in self.goals})

    @cached_property
    def mat_document(self) -> dict[str, Any]:
        """The mat as the document of a mat file, with its cars."""
        return {"format": MAT_FORMAT, "name": self.name.sentence(), **self.document["mat"]}

    def zone(self, name: str) -> Zone:
        """The zone with a name."""
        return next(zone for zone in self.zones if zone.name == name)

    def beside_mat(self) -> list[Phrase]:
        """The zones and cars that lie beside the mat; nothing where it has no end. A mission may have such."""
        if self.mat.size_m is None:
            return []
        width, height = self.mat.size_m
        starts = zip(self.mat.starts.x_m, self.mat.starts.y_m, strict=True)
        outside = [(zone, zone.box()) for zone in self.zones]
        zones = [
            Phrase("mission-zone-beside", name=zone.title)
            for zone, (left, bottom, right, top) in outside
            if left >= width or bottom >= height or right <= 0 or top <= 0
        ]
        cars = [
            Phrase("mission-car-beside", car=number)
            for number, (x, y) in enumerate(starts)
            if not (0 <= x <= width and 0 <= y <= height)
        ]
        return zones + cars
