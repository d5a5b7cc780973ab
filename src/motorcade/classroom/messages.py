"""Messages between pupils' pages of a class and its server; `motorcade.classroom.desk_messages` has the teacher's.

Requests are `POST /api/class/<name>`. `PupilView` comes over a WebSocket, whole, whenever something has changed.
`web/src/generated/classroom.ts` is written from these types by `scripts/generate.py`.
"""

from typing import Annotated, Any, Literal, NamedTuple

from msgspec import Meta, Struct

from motorcade.service.messages import (
    Nothing,
    Project,
    Sentence,
)
from motorcade.service.missions import Mission

# Pictures of cars, drawn by the page.
AVATARS = (
    *("bus", "digger", "fire-engine", "lorry", "police-car", "racing-car", "rocket", "snowplough"),
    *("sports-car", "tank-wagon", "taxi", "tractor", "train", "tram", "van", "beetle"),
)
Text40 = Annotated[str, Meta(max_length=160)]
Secret = Annotated[str, Meta(max_length=400)]
Id = Annotated[str, Meta(max_length=8)]


class ClassCode(Struct, forbid_unknown_fields=True):
    """The code of the class, as somebody typed it; spaces, dashes and small letters don't matter."""

    code: Text40


class Joining(Struct, forbid_unknown_fields=True):
    """A newcomer: the code of the class, the nickname, and one of the avatars."""

    code: Text40
    name: Text40
    avatar: Text40


class Returning(Struct, forbid_unknown_fields=True):
    """A pupil who comes back at another device, with the personal number."""

    code: Text40
    name: Text40
    number: Text40


class Self(Struct):
    """The pupil whose page asks; ``number`` is the personal one, of four digits, for coming back."""

    id: str
    name: str
    avatar: str
    number: str


class ClassAbout(Struct):
    """What everybody may know before joining.

    Attributes:
        me: the pupil whose device this is; None for a newcomer.
        teacher: this browser is signed in at the teacher's desk.
        is_open: newcomers may join.
        avatars: the ids of the pictures to choose from.
        title: the name of the class; may be empty.
    """

    me: Self | None
    teacher: bool
    is_open: bool
    avatars: list[str]
    title: str


class Hand(Struct, forbid_unknown_fields=True):
    """Raise the hand, or lower it."""

    raised: bool


class Draft(Struct, forbid_unknown_fields=True):
    """What a pupil works on, under which name: stored beside the projects, without versions."""

    name: Text40
    project: Project


class StoredDraft(Struct):
    """The draft; ``project`` is None where there is none, ``saved_at`` is ISO 8601 in UTC."""

    name: str
    project: Project | None
    saved_at: str


class Classmate(Struct):
    """Another pupil, to whom a copy of a project can be given."""

    id: str
    name: str
    avatar: str


class Gift(Struct, forbid_unknown_fields=True):
    """Give a classmate a copy of an own project."""

    to: Id
    name: Text40


class Copied(Struct):
    """The name of the copy in the other's shelf."""

    name: str


class Seen(Struct, forbid_unknown_fields=True):
    """The pupil has seen the news up to this number."""

    number: int


class HandedMission(Struct, forbid_unknown_fields=True):
    """The number of a mission that was handed out, as in `PupilView.mission`."""

    number: int


class CableWish(Struct, forbid_unknown_fields=True):
    """Stand in the queue for the cable, or leave it."""

    wants: bool


class TurnWish(Struct, forbid_unknown_fields=True):
    """Stand in the queue to drive a real car, or leave it."""

    car: Text40
    wants: bool


class MatEntry(Struct, forbid_unknown_fields=True):
    """The program for the shared mat; None takes the own cars off it."""

    image: bytes | None


# What is sent to a pupil's page.


class News(Struct):
    """Something that came to a pupil: a project in the shelf, or a mission, and whose it was ("" for the teacher's)."""

    number: int
    kind: Literal["project", "mission"]
    name: str
    sender: str


class CarTurn(Struct):
    """The queue for driving one real car: who drives, for how many more seconds, and who waits, in order."""

    car: str
    driver: str | None
    left_s: int
    waiting: list[str]


CableUse = Literal["free", "sends", "ending"]


class MatView(Struct):
    """The shared mat.

    Attributes:
        state: closed; collecting programs; running; over.
        mission: the id of its mission; "own" for a document; None for a parade.
        title: what it is called.
        places: how many programs fit.
        entries: the pupils whose programs are there; the k-th has the k-th leader of the mat.
    """

    state: Literal["closed", "collecting", "running", "over"]
    mission: str | None
    title: Sentence
    places: int
    entries: list[str]


class ClassAnswerBase(Struct, tag_field="is", tag=str.lower):
    """What is sent over a WebSocket; ``is`` says what it is."""


class PupilView(ClassAnswerBase, tag="pupil"):
    """All that concerns a pupil; sent whole when something has changed.

    Attributes:
        frozen: 'eyes up': the page shows nothing to work with, worlds are paused.
        cable: how many are before this pupil in the queue for the cable: 0 when it is the pupil's turn; None: not in
            the queue.
        cable_use: "sends": something is sent through the cable; "ending": then the turn of the first one ends.
        turns: the queues for driving real cars; one for each car of the server.
        stopped: the teacher's emergency stop holds all real cars.
        mission: the number of the mission that was handed out last (`HandedMission`); None for none.
        news: what came and was not seen yet, at most 20.
    """

    me: Self
    hand: bool
    frozen: bool
    cable: int | None
    cable_use: CableUse
    turns: list[CarTurn]
    stopped: bool
    mat: MatView
    mission: int | None
    news: list[News]


class Goodbye(ClassAnswerBase, tag="goodbye"):
    """The pupil is no longer in the class; the connection ends. ``left``: on another page of this device."""

    why: Literal["removed", "ended", "left"]


class ClassRefused(ClassAnswerBase, tag="error"):
    """Why the connection ends."""

    code: str
    details: dict[str, Any]
    sentence: Sentence


ClassAnswer = PupilView | Goodbye | ClassRefused


class Exchange(NamedTuple):
    """The types of a request's message and of its answer; ``is_open``: also for who has no session.

    ``stores``: the answer says that something is stored; where it can't be, the request fails and changes nothing.
    """

    message: Any
    answer: Any
    is_open: bool = False
    stores: bool = False


PUPIL_REQUESTS: dict[str, Exchange] = {
    "about": Exchange(Nothing, ClassAbout, is_open=True),
    "check-code": Exchange(ClassCode, Nothing, is_open=True),
    "join": Exchange(Joining, Self, is_open=True, stores=True),
    "return": Exchange(Returning, Self, is_open=True, stores=True),
    "leave": Exchange(Nothing, Nothing, is_open=True),
    "hand": Exchange(Hand, Nothing),
    "seen": Exchange(Seen, Nothing),
    "draft/read": Exchange(Nothing, StoredDraft),
    "draft/write": Exchange(Draft, Nothing),
    "classmates": Exchange(Nothing, list[Classmate]),
    "give": Exchange(Gift, Copied, stores=True),
    "mission": Exchange(HandedMission, Mission),
    "cable": Exchange(CableWish, Nothing),
    "turn": Exchange(TurnWish, Nothing),
    "mat": Exchange(MatEntry, Nothing),
}
