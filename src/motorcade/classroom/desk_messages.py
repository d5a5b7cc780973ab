"""Messages between the teacher's pages of a class and its server: requests are `POST /api/desk/<name>`."""

from typing import Annotated

from msgspec import Meta, Struct

from motorcade.classroom.messages import (
    CableUse,
    CarTurn,
    ClassAnswerBase,
    ClassRefused,
    Exchange,
    Goodbye,
    Id,
    MatView,
    Secret,
    Self,
    Text40,
    TurnWish,
)
from motorcade.service.messages import (
    LibraryEntry,
    MatDocument,
    MissionChoice,
    Nothing,
    Project,
    Sentence,
    StoredProject,
)
from motorcade.service.missions import MissionGoal, MissionZone


class DeskAbout(Struct):
    """Whether a password has been set, and whether this browser is signed in."""

    has_password: bool
    signed_in: bool


class FirstPassword(Struct, forbid_unknown_fields=True):
    """Set the password; ``key`` stands behind ``/desk#`` in the address that the command prints."""

    key: Secret
    password: Secret


class Password(Struct, forbid_unknown_fields=True):
    """The teacher's password."""

    password: Secret


class PupilId(Struct, forbid_unknown_fields=True):
    """A pupil."""

    pupil: Id


class Renaming(Struct, forbid_unknown_fields=True):
    """Give a pupil another nickname."""

    pupil: Id
    name: Text40


class Frozen(Struct, forbid_unknown_fields=True):
    """Freeze all pupils' pages, or thaw them."""

    frozen: bool


class ClassSettings(Struct, forbid_unknown_fields=True):
    """Settings of the class; None leaves one as it is.

    Attributes:
        title: the name of the class.
        is_open: newcomers may join.
        stuck_minutes: a pupil is stuck after so many minutes without a step in the mission.
        turn_s: how long a turn at a car lasts.
    """

    title: Text40 | None = None
    is_open: bool | None = None
    stuck_minutes: Annotated[int, Meta(ge=1, le=60)] | None = None
    turn_s: Annotated[int, Meta(ge=10, le=600)] | None = None


class HandOut(Struct, forbid_unknown_fields=True):
    """Give pupils a project, or a mission. The project is one of the teacher's own shelf, or comes with the message.

    Attributes:
        to: the pupils; None for all, also those who join later (of the latter only a mission).
        name: the name of the project.
        project: None for the one of that name in the teacher's shelf.
        mission: instead of a project.
    """

    to: list[Id] | None = None
    name: Text40 = ""
    project: Project | None = None
    mission: MissionChoice | None = None


class HandedOut(Struct):
    """To how many pupils it was given; ``missed`` has the ids of those whose shelf takes nothing more."""

    pupils: int
    missed: list[str] = []


class PupilProject(Struct, forbid_unknown_fields=True):
    """A project in a pupil's shelf; an empty name for the draft."""

    pupil: Id
    name: Text40


class PupilShelf(Struct):
    """A pupil's projects.

    Attributes:
        pupil: the nickname.
        projects: the one saved last first.
        draft_at: when the draft was saved; None where there is none.
    """

    pupil: str
    projects: list[LibraryEntry]
    draft_at: str | None


class MissionStars(Struct):
    """A mission, and the stars that it has."""

    id: str
    name: Sentence
    stars: list[int]


class PupilStars(Struct):
    """The stars that a pupil has earned, of each mission's id."""

    pupil: str
    stars: dict[str, list[int]]


class ClassProgress(Struct):
    """The missions, path by path and in order, and what each pupil has earned."""

    missions: list[MissionStars]
    pupils: list[PupilStars]


class ClassAddresses(Struct):
    """How pupils find the class.

    Attributes:
        code: the code of the class.
        addresses: of the page, without the code; first the one that was chosen, then the likeliest.
        local_name: the address with motorcade.local; None where it isn't announced.
        why_no_name: why not.
        qr_code: an SVG that leads to the first address, with the code.
    """

    code: str
    addresses: list[str]
    local_name: str | None
    why_no_name: Sentence | None
    qr_code: str


class ChosenAddress(Struct, forbid_unknown_fields=True):
    """The address that tablets reach: the QR code is to lead there."""

    address: Annotated[str, Meta(max_length=80)]


class OpenMat(Struct, forbid_unknown_fields=True):
    """Open the shared mat: of a mission with many leaders, or None for a parade with one for each program.

    Attributes:
        followers: in a parade, the followers of each leader.
        places: in a parade, the most leaders.
    """

    mission: MissionChoice | None = None
    followers: Annotated[int, Meta(ge=0, le=10)] = 2
    places: Annotated[int, Meta(ge=1, le=60)] = 30


class StoppedAll(Struct):
    """The real cars that could not be reached; those stop by themselves when their driver is silent."""

    missed: list[str]


class PupilRow(Struct):
    """A pupil, as the teacher sees it; all times in seconds until now.

    Attributes:
        number: the personal number.
        online: a page of the pupil is connected.
        away_s: since when it isn't; 0 where it is.
        hand_s: since when the hand is raised; None where it isn't.
        stuck_s: since when there was no step in the mission, where that is longer than `ClassView.stuck_minutes`.
        mission: the id of the mission that the pupil works on; "own" for a document; None for none.
        goals_met, goals: of the mission, in the world in play.
        stars: all that the pupil has earned.
        wrong_numbers: how often somebody tried to come in as this pupil with a wrong number.
    """

    id: str
    name: str
    avatar: str
    number: str
    online: bool
    away_s: int
    hand_s: int | None
    stuck_s: int | None
    mission: str | None
    goals_met: int
    goals: int
    stars: int
    wrong_numbers: int


class ClassView(ClassAnswerBase, tag="class"):
    """The whole class, for the teacher's desk; sent whole when something has changed.

    Attributes:
        pupils: in the order in which they joined.
        cable: the pupils in the queue for the cable; the first has it.
        cable_use: "sends": something is sent through the cable; "ending": then the turn of the first one ends.
        turns: the queues for driving real cars.
        stopped: the emergency stop holds all real cars.
        disk: why the server can't store work at present; None where it can.
    """

    title: str
    code: str
    is_open: bool
    frozen: bool
    stuck_minutes: int
    turn_s: int
    pupils: list[PupilRow]
    cable: list[str]
    cable_use: CableUse
    turns: list[CarTurn]
    stopped: bool
    mat: MatView
    disk: Sentence | None


class WallWorld(Struct):
    """A world on the wall: its mat, its leaders, and the radius of its cars; ``pupil`` is "" for the shared mat.

    ``zones`` and ``goals`` are those of its mission.
    """

    pupil: str
    mat: MatDocument
    leads: list[int]
    radius_m: float
    cars: int
    zones: list[MissionZone]
    goals: list[MissionGoal]


class Wall(ClassAnswerBase, tag="wall"):
    """The worlds on the wall; sent whole when one is new or furnished. Pictures refer to their places in this list.

    A picture is binary: 4 bytes number of the list (the ``number`` of the last Wall), then for each world whose moment
    has changed: place (uint16), cars shown (uint16), time in ms (uint32), then the columns of these cars as in a
    picture of a world (`motorcade.service.history`): x_m, y_m, heading (float32), index of the word (uint16), wheels,
    LED, flags (uint8), filled up to a multiple of four.
    """

    number: int
    worlds: list[WallWorld]


class DrawnWall(Struct, forbid_unknown_fields=True):
    """The page has drawn the last picture of the wall, and wants the next."""


DeskAnswer = ClassView | Goodbye | ClassRefused
WallAnswer = Wall | ClassRefused

DESK_REQUESTS: dict[str, Exchange] = {
    "about": Exchange(Nothing, DeskAbout, is_open=True),
    "first-password": Exchange(FirstPassword, Nothing, is_open=True, stores=True),
    "sign-in": Exchange(Password, Nothing, is_open=True),
    "sign-out": Exchange(Nothing, Nothing),
    "addresses": Exchange(Nothing, ClassAddresses),
    "choose-address": Exchange(ChosenAddress, ClassAddresses),
    "new-code": Exchange(Nothing, ClassAddresses, stores=True),
    "settings": Exchange(ClassSettings, Nothing, stores=True),
    "freeze": Exchange(Frozen, Nothing),
    "lower-hand": Exchange(PupilId, Nothing),
    "rename": Exchange(Renaming, Nothing, stores=True),
    "reset-number": Exchange(PupilId, Self, stores=True),
    "remove": Exchange(PupilId, Nothing, stores=True),
    "hand-out": Exchange(HandOut, HandedOut, stores=True),
    "shelf": Exchange(PupilId, PupilShelf),
    "project": Exchange(PupilProject, StoredProject),
    "progress": Exchange(Nothing, ClassProgress),
    "cable/next": Exchange(Nothing, Nothing),
    "turn/next": Exchange(TurnWish, Nothing),
    "stop-all": Exchange(Nothing, StoppedAll),
    "release-all": Exchange(Nothing, Nothing),
    "mat/open": Exchange(OpenMat, Nothing),
    "mat/start": Exchange(Nothing, Nothing),
    "mat/close": Exchange(Nothing, Nothing),
    "end": Exchange(Password, Nothing, stores=True),
}
