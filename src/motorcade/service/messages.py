"""What a page may say to its world, and what of it is refused."""

from typing import Annotated, Any

from msgspec import Meta, Struct

from motorcade.engine.world import World
from motorcade.errors import MotorcadeError
from motorcade.mats import Mat, check_mat
from motorcade.service.compiling import profile_named
from motorcade.service.errors import StudioError, reason_of
from motorcade.service.mats import mat_from
from motorcade.words.image import ImageError, parse_image_bytes, words_to_bytes

# Such as cost a moment at most, so that no world holds up others.
MOST_FURNITURE = 400
_NO_PROGRAM = words_to_bytes((0,))

Length = Annotated[float, Meta(ge=-2000, le=2000)]
RangeMm = Annotated[int, Meta(ge=1, le=20_000)]
Seed = Annotated[int, Meta(ge=0, lt=1 << 32)]
Car = Annotated[int, Meta(ge=0, lt=1 << 20)]


class _Message(Struct, tag_field="do", tag=str.lower, forbid_unknown_fields=True):
    pass


class Set(_Message):
    """Build a world anew; without an image all stand still."""

    mat: dict[str, Any]
    image: bytes | None = None
    profile: str = "classroom"
    seed: Seed = 0
    range_mm: RangeMm | None = None


class Play(_Message):
    """Let time go on."""

    speed: Annotated[float, Meta(ge=0.25, le=16)] = 1.0


class Pause(_Message):
    """Let time stand still."""


class Step(_Message):
    """Go on by so many ticks."""

    ticks: Annotated[int, Meta(ge=1, le=1000)] = 1


class Reset(_Message):
    """Begin again."""

    seed: Seed = 0


class Say(_Message):
    """Say a word that all cars hear."""

    word: Annotated[str, Meta(pattern="^(stop|go)$")]


class Furnish(_Message):
    """Change what is around the cars."""

    mat: dict[str, Any]
    range_mm: RangeMm | None = None


class Move(_Message):
    """Put a car elsewhere."""

    car: Car
    x_m: Length
    y_m: Length
    heading_deg: Annotated[float, Meta(ge=-360, le=360)] = 0.0


class Watch(_Message):
    """Ask for the details of a car."""

    car: Car | None = None


class Seek(_Message):
    """Show the past or the present."""

    t_ms: Annotated[int, Meta(ge=0, lt=1 << 30)] | None = None


class Resume(_Message):
    """Let a car that was driven by hand go on with its program."""

    car: Car


class Shown(_Message):
    """The newest picture that the page has drawn."""

    frame: Annotated[int, Meta(ge=0, lt=1 << 32)]


Message = Set | Play | Pause | Step | Reset | Say | Furnish | Move | Watch | Seek | Resume | Shown


def world_of(message: Set, most_cars: int) -> World:
    """The world that a page wants. Raises StudioError."""
    mat = mat_from(message.mat, most_cars)
    _check_furniture(mat)
    profile = profile_named(message.profile)
    image = _NO_PROGRAM if message.image is None else message.image
    check_image(image)
    try:
        check_mat(mat, profile)
    except MotorcadeError as problem:
        raise StudioError("bad-mat", reason=reason_of(problem)) from None
    try:
        world = World(mat, [image], profile, seeds=message.seed, events=True, threads=1)
        if message.range_mm is not None:
            world.furnish(mat, message.range_mm)
    except MotorcadeError as problem:
        raise StudioError("bad-world", reason=reason_of(problem)) from None
    return world


def check_image(image: bytes) -> None:
    """Raises StudioError unless these bytes are an image."""
    try:
        parse_image_bytes(image)
    except ImageError as problem:
        raise StudioError(problem.code) from None


def furniture_of(document: dict[str, Any], most_cars: int) -> Mat:
    """What stands, walks and speaks on a page's mat, without its cars. Raises StudioError."""
    mat = mat_from({**document, "car": [], "crowd": []}, most_cars)
    _check_furniture(mat)
    return mat


def _check_furniture(mat: Mat) -> None:
    corners = sum(map(len, mat.polygons))
    steps = sum(len(person.path) for person in mat.people)
    count = len(mat.walls) + len(mat.discs) + corners + steps + len(mat.voices)
    if count > MOST_FURNITURE:
        raise StudioError("too-much-furniture", count=count, most=MOST_FURNITURE)
