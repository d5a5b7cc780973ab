"""What the file ``class.json`` holds: the pupils of a class, its code and its settings."""

from typing import TypeVar

import msgspec
from msgspec import Struct, field

from motorcade.classroom.messages import News
from motorcade.classroom.names import RandomBelow, new_code
from motorcade.errors import MotorcadeError
from motorcade.service.messages import MissionChoice

FORMAT = "motorcade-class/1"
_Stored = TypeVar("_Stored", bound=Struct)


class Pupil(Struct):
    """A pupil.

    Attributes:
        id: stays, also under another name; the owner of the pupil's shelf.
        number: for coming back at another device.
        devices: digests of the secrets that the pupil's devices hold, the newest last.
        mission: the number of the mission that was handed out last, counted from 1; None for none.
        news: what the pupil has not seen yet.
        told: the number of the newest news.
    """

    id: str
    name: str
    avatar: str
    number: str
    devices: list[str] = []
    mission: int | None = None
    news: list[News] = []
    told: int = 0


class SignIn(Struct):
    """A browser in which the teacher is signed in: the digest of its secret, and until when (s since 1970)."""

    device: str
    until_s: float


class ClassRecord(Struct):
    """A class.

    Attributes:
        id: of this class alone, so that its tablets' cookies serve at any port.
        password: how the teacher's password is checked (`motorcade.classroom.passwords`); None before the first one.
        pupils: in the order in which they joined.
        joined: how many have joined since the beginning; the next pupil's id.
        missions: those that were handed out.
        handed: the number of the mission that newcomers get; None for none.
        removed: the ids of those who are out, and whose shelves are still to be deleted.
    """

    code: str
    id: str = ""
    format: str = FORMAT
    title: str = ""
    is_open: bool = True
    stuck_minutes: int = 5
    turn_s: int = 60
    password: str | None = None
    sign_ins: list[SignIn] = []
    joined: int = 0
    pupils: list[Pupil] = []
    missions: list[MissionChoice] = field(default_factory=list)
    handed: int | None = None
    removed: list[str] = []


def new_record(random_below: RandomBelow) -> ClassRecord:
    """A new class, without pupils."""
    return ClassRecord(new_code(random_below), new_code(random_below))


def to_bytes(record: ClassRecord) -> bytes:
    """The file of a class, as JSON that people can read."""
    return msgspec.json.format(msgspec.json.encode(record), indent=1) + b"\n"


def from_bytes(data: bytes, file: object) -> ClassRecord:
    """The class in a file, which errors call ``file``. Raises MotorcadeError where it is damaged, or of a later kind.

    Nothing is repaired: a class without its pupils would lose their work.
    """
    try:
        record = msgspec.json.decode(data, type=ClassRecord)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as problem:
        raise MotorcadeError("class-damaged", file=file, reason=str(problem)) from None
    if record.format != FORMAT:
        raise MotorcadeError("class-of-another-kind", file=file, format=record.format[:40], known=FORMAT)
    return record


def restore_record(record: ClassRecord, stored: ClassRecord) -> None:
    """Undo what has changed in a record since ``stored``, except who is signed in as the teacher.

    A pupil stays the same object: pages that show one go on to do so.
    """
    own = {pupil.id: pupil for pupil in record.pupils}
    stored.sign_ins = record.sign_ins
    stored.pupils = [_overwritten(own.get(pupil.id, pupil), pupil) for pupil in stored.pupils]
    _overwritten(record, stored)


def _overwritten(old: _Stored, new: _Stored) -> _Stored:
    for name in new.__struct_fields__:
        setattr(old, name, getattr(new, name))
    return old
