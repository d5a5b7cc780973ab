"""What is known of a class: what ``class.json`` holds, and while the server runs who is here."""

import re
from dataclasses import dataclass
from typing import Annotated

import msgspec
from msgspec import Meta, Struct, field

from motorcade.classroom.messages import News, Window
from motorcade.classroom.names import RandomBelow, new_code
from motorcade.errors import MotorcadeError
from motorcade.service.messages import MissionChoice

FORMAT = "motorcade-class/1"
WINDOWS: tuple[Window, Window] = ("leader", "followers")
# What the library of a pair has beside its windows: the mission that the two play.
MISSION = "mission"
# The owner of the teacher's own projects; pupils' ids are numbers.
TEACHER = "teacher"
_PAIR = "pair-"
_OWNER = re.compile(f"({_PAIR})?([0-9]{{1,8}})")
# A pupil's id, or a pair's; a number of four digits; what names of cookies may hold.
_Id = Annotated[str, Meta(pattern=r"^[0-9]{1,8}\Z")]
_Number = Annotated[str, Meta(pattern=r"^[0-9]{4}\Z")]
_Code = Annotated[str, Meta(pattern=r"^[0-9A-Za-z]{1,40}\Z")]


class Pupil(Struct, forbid_unknown_fields=True):
    """A pupil.

    Attributes:
        id: stays, also under another name; the owner of the pupil's library.
        number: for coming back at another device.
        devices: digests of the secrets that the pupil's devices hold, the newest last.
        mission: the number of the mission that was handed out last, counted from 1; None for none.
        news: what the pupil has not seen yet.
        told: the number of the newest news.
    """

    id: _Id
    name: str
    avatar: str
    number: _Number
    devices: list[str] = []
    mission: int | None = None
    news: list[News] = []
    told: int = 0


class Pair(Struct, forbid_unknown_fields=True):
    """Two pupils who program one project: each window, the leader's program or the followers', has one owner.

    Attributes:
        id: stays.
        name: of the project.
        members: the pupils' ids, at most two; who began it comes first.
        joined: those of them who have come; another one was asked and has not answered.
        owners: whose each window is; None while it is free.
        asks: who wants to swap the windows; None for nobody.
    """

    id: _Id
    name: str
    members: list[str]
    joined: list[str]
    owners: dict[Window, str | None]
    asks: str | None = None

    @property
    def library(self) -> str:
        """The owner of its files among those of the class's folder: a project for each window."""
        return f"{_PAIR}{self.id}"


class SignIn(Struct):
    """A browser in which the teacher is signed in: the digest of its secret, and until when (s since 1970)."""

    device: str
    until_s: float


class ClassRecord(Struct, forbid_unknown_fields=True):
    """A class.

    Attributes:
        id: of this class alone, so that its tablets' cookies serve at any port.
        password: how the teacher's password is checked (`motorcade.classroom.names`); None before the first one.
        pupils: in the order in which they joined.
        joined: how many have joined since the beginning; the next pupil's id.
        missions: those that were handed out.
        handed: the number of the mission that newcomers get; None for none.
        removed: the owners of libraries that are still to be deleted: pupils who are out, and pairs that are over.
        pairs: who program one project together.
        paired: how many pairs there were since the beginning; the next one's id.
    """

    code: _Code
    id: Annotated[str, Meta(pattern=r"^[0-9A-Za-z]{0,40}\Z")] = ""
    format: str = FORMAT
    title: str = ""
    is_open: bool = True
    stuck_minutes: int = 5
    password: str | None = None
    sign_ins: list[SignIn] = []
    joined: int = 0
    pupils: list[Pupil] = []
    missions: list[MissionChoice] = field(default_factory=list)
    handed: int | None = None
    removed: list[str] = []
    pairs: list[Pair] = []
    paired: int = 0


def new_record(random_below: RandomBelow) -> ClassRecord:
    """Return a new class, without pupils."""
    return ClassRecord(new_code(random_below), new_code(random_below))


def owners_of(record: ClassRecord) -> set[str]:
    """Return whose libraries a class has: those of its pupils, its pairs and its teacher."""
    owners = {TEACHER}
    owners.update(pupil.id for pupil in record.pupils)
    owners.update(pair.library for pair in record.pairs)
    return owners


def is_owner(name: str) -> bool:
    """Return whether it is the name of the library of a pupil or a pair."""
    return bool(_OWNER.fullmatch(name))


def is_known(record: ClassRecord, owner: str) -> bool:
    """Return whether a pupil or a pair is, or was, one of this class: its number was given out."""
    of_a_pair, number = _OWNER.fullmatch(owner).groups()  # type: ignore[union-attr]
    given = record.joined
    if of_a_pair:
        given = record.paired
    return 0 < int(number) <= given


def leave_pair(record: ClassRecord, pupil_id: str) -> None:
    """Take somebody out of the pair; the windows are free again. Without anybody who has joined the pair is over."""
    for pair in [pair for pair in record.pairs if pupil_id in pair.members]:
        pair.members = [member for member in pair.members if member != pupil_id]
        pair.asks = None
        _mend(record, pair)


def _mend(record: ClassRecord, pair: Pair) -> None:
    """Keep of a pair what belongs to its members; its library is to be deleted where nobody is in it."""
    pair.joined = [member for member in pair.joined if member in pair.members]
    if pair.asks not in pair.joined:
        pair.asks = None
    owners = pair.owners
    pair.owners = dict.fromkeys(WINDOWS)
    for window in WINDOWS:
        if owners.get(window) in pair.joined:
            pair.owners[window] = owners[window]
    if not pair.joined:
        record.pairs.remove(pair)
        record.removed.append(pair.library)


def take_out(record: ClassRecord, pupil_id: str) -> None:
    """Take a pupil out of a class, if there is such a pupil; the library is to be deleted."""
    leave_pair(record, pupil_id)
    staying = [pupil for pupil in record.pupils if pupil.id != pupil_id]
    if len(staying) < len(record.pupils):
        record.removed.append(pupil_id)
    record.pupils = staying


def mend(record: ClassRecord, only: str | None = None) -> None:
    """Take out of all pairs, or of the ``only`` one, whoever is no pupil of the class; nobody's pair is over."""
    pupils = {pupil.id for pupil in record.pupils}
    for pair in [pair for pair in record.pairs if only in (None, pair.id)]:
        pair.members = [member for member in pair.members if member in pupils]
        _mend(record, pair)


def to_bytes(record: ClassRecord) -> bytes:
    """Return the file of a class, as JSON that people can read."""
    return msgspec.json.format(msgspec.json.encode(record), indent=1) + b"\n"


def copied(record: ClassRecord) -> ClassRecord:
    """Return an equal class that shares nothing with this one."""
    return msgspec.json.decode(msgspec.json.encode(record), type=ClassRecord)


def from_bytes(data: bytes, file: object) -> ClassRecord:
    """Return the class in a file, which errors call ``file``. Raises MotorcadeError: it is damaged, or of a later kind.

    Nothing is repaired: a class without its pupils would lose their work.
    """
    try:
        record = msgspec.json.decode(data, type=ClassRecord)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as problem:
        raise MotorcadeError("class-damaged", file=file, reason=str(problem)) from None
    if record.format != FORMAT:
        raise MotorcadeError("class-of-another-kind", file=file, format=record.format[:40], known=FORMAT)
    owners = owners_of(record) - {TEACHER}
    is_whole = len(owners) == len(record.pupils) + len(record.pairs)
    # A start deletes the libraries of those whom the file doesn't have: one wrong digit would be enough.
    if not is_whole or not all(is_known(record, owner) for owner in owners):
        raise MotorcadeError("class-damaged", file=file, reason="pupils, pairs: id")
    return record


@dataclass(slots=True)
class Presence:
    """A pupil who is here, or was. Times are seconds of the server's clock.

    Attributes:
        pages: how many pages are connected.
        left_s: when the last one left.
        hand_s: when the hand was raised; None where it isn't.
        mission: the mission that the pupil works on; None for none.
        met, goals: how many goals are met in the world in play, of how many.
        most_met: the most that have been met since the mission was opened.
        stars: all that the pupil has earned.
        step_s: when the last step in the mission was.
        stuck: there was no step for long.
    """

    pages: int = 0
    left_s: float = 0.0
    hand_s: float | None = None
    mission: str | None = None
    met: int = 0
    goals: int = 0
    most_met: int = 0
    stars: int = 0
    step_s: float = 0.0
    stuck: bool = False

    def open_mission(self, mission: str | None, now_s: float) -> None:
        """Begin a mission, or none; opening it again is no step."""
        if mission != self.mission:
            self.mission = mission
            self.goals = 0
            self.met = 0
            self.most_met = 0
            self._step(now_s)

    def see_goals(self, met: int, goals: int, now_s: float) -> None:
        """Note how many goals are met in the pupil's world: more than ever before is a step."""
        self.met = met
        self.goals = goals
        if met > self.most_met:
            self.most_met = met
            self._step(now_s)

    def earn(self, stars: int, now_s: float) -> None:
        """Note how many stars the pupil has now; a new one is a step."""
        if stars != self.stars:
            self.stars = stars
            self._step(now_s)

    def advance(self, now_s: float, stuck_s: float) -> bool:
        """Let time pass; return whether the pupil is stuck now and wasn't, or the reverse."""
        works = self.pages > 0 and self.mission is not None and not 0 < self.goals <= self.most_met
        stuck = works and now_s - self.step_s >= stuck_s
        changed = stuck != self.stuck
        self.stuck = stuck
        return changed

    def _step(self, now_s: float) -> None:
        self.step_s = now_s
        self.stuck = False
