"""Messages between the pages of a class and its server.

A request is `POST /api/class/<name>` of a pupil's page, or `POST /api/teacher/<name>`: a method that `request`
declares, whose parameters are the message. `PupilView` and `ClassView` come over WebSockets, whole, whenever something
has changed. `web/src/generated/classroom.ts` is written from these types by `scripts/generate.py`.
"""

from collections.abc import Callable
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

from msgspec import Meta, Struct

from motorcade.service.messages import (
    Endpoint,
    LibraryEntry,
    MatDocument,
    MissionChoice,
    Project,
    Sentence,
    StreamAnswer,
)
from motorcade.service.missions import MissionGoal, MissionZone

# Pictures of cars, drawn by the page.
AVATARS = (
    *("bus", "digger", "fire-engine", "lorry", "police-car", "racing-car", "rocket", "snowplough"),
    *("sports-car", "tank-wagon", "taxi", "tractor", "train", "tram", "van", "beetle"),
)
Text40 = Annotated[str, Meta(max_length=160)]
Secret = Annotated[str, Meta(max_length=400)]
Id = Annotated[str, Meta(max_length=8)]
# What a method gets beside the message: its object, the request, the address that it came from, who sent it (a pupil's
# id, or the teacher), and the time.
GIVEN = ("self", "asks", "client", "who", "now_s")
# A window of a pair: the leader's program, with the mat, or the followers' program.
Window = Literal["leader", "followers"]
_Method = TypeVar("_Method", bound=Callable[..., Any])


class Exchange(NamedTuple):
    """A request, and who may send it.

    Attributes:
        name: of the request, after ``/api/``.
        request: answered by a method of `Classroom`, `SharedMat`, `Pairs` or `Handlers`.
        is_open: also for who has no session.
        stores: the answer says that something is stored; where it can't be, the request fails and changes nothing.
    """

    name: str
    request: Endpoint
    is_open: bool
    stores: bool


def request(name: str, *, is_open: bool = False, stores: bool = False) -> Callable[[_Method], _Method]:
    """Declare that a method answers a request, as `Exchange` says.

    Its parameters are the fields of the message, except that a Struct alone is the message itself.
    """

    def declare(method: _Method) -> _Method:
        found = Endpoint.of(method, GIVEN, forbid_unknown_fields=True)
        method.exchange = Exchange(name, found, is_open, stores)  # type: ignore[attr-defined]
        return method

    return declare


def exchanges_of(kind: type) -> list[Exchange]:
    """The requests that the methods of a class answer."""
    return [method.exchange for method in vars(kind).values() if hasattr(method, "exchange")]


class Classmate(Struct):
    """Another pupil, to whom a copy of a project can be given."""

    id: str
    name: str
    avatar: str


class Self(Classmate):
    """The pupil whose page asks; ``number`` is the personal one, of four digits, for coming back."""

    number: str


class ClassAbout(Struct):
    """What everybody may know before joining.

    Attributes:
        me: the pupil whose device this is; None for a newcomer.
        is_open: newcomers may join.
        avatars: the ids of the pictures to choose from.
        title: the name of the class; may be empty.
    """

    me: Self | None
    is_open: bool
    avatars: list[str]
    title: str


class Draft(Struct, forbid_unknown_fields=True):
    """What a pupil works on, under which name: stored beside the projects, without versions.

    Attributes:
        place: the tab whose work it is; a pupil may have several.
        mission: what the project is played for; None for none.
    """

    name: Text40
    project: Project
    place: Text40 = ""
    mission: MissionChoice | None = None


class StoredDraft(Struct):
    """The draft; ``project`` is None where there is none, ``saved_at`` is ISO 8601 in UTC; the others as in `Draft`."""

    name: str
    project: Project | None
    saved_at: str
    place: str
    mission: MissionChoice | None = None


class TeacherAbout(Struct):
    """Whether a password has been set, and whether this browser is signed in."""

    has_password: bool
    signed_in: bool


class HandedOut(Struct):
    """To how many pupils it was given; ``missed`` has the ids of those whose library takes nothing more."""

    pupils: int
    missed: list[str] = []


class PupilLibrary(Struct):
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


class ClassProgress(Struct):
    """The missions, path by path and in order, and by pupil the stars that were earned, of each mission's id."""

    missions: list[MissionStars]
    stars: dict[str, dict[str, list[int]]]


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


# What is sent to pages.


class News(Struct):
    """What came to a pupil: a project, or a mission in each language, and whose it was ("" for the teacher's)."""

    number: int
    kind: Literal["project", "mission"]
    name: str | Sentence
    sender: str


class Shared(Struct):
    """What one pupil at a time may use: the cable, whose name is "", or a real car; ``holder`` None: nobody does."""

    name: str
    holder: str | None


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


class PairProject(Struct, forbid_unknown_fields=True):
    """What a window holds, and its version: 0 while nothing was stored.

    Attributes:
        mission: what the leader's window is played for; None for none.
    """

    project: Project
    version: int
    mission: MissionChoice | None = None


class Conducted(Struct):
    """How the worlds of a pair's pages are played: what one of them did last.

    Attributes:
        number: grows with each.
        by: the pupil.
        playing: the worlds play; else they stand at ``t_ms``.
        speed: simulated seconds in a real one.
        seed: of the run.
        t_ms: the simulated time.
        age_ms: how long ago that was, in real time.
    """

    number: int
    by: str
    playing: bool
    speed: float
    seed: int
    t_ms: int
    age_ms: int = 0


class PairView(Struct):
    """A pair, for one of its pupils.

    Attributes:
        id: another one with each mission that the two open.
        name: of the project.
        partner: the other one; None where nobody else is in it.
        joined: this pupil has come; else the partner asks.
        partner_joined, partner_away: the partner has come; no page of the partner is connected.
        owners: whose each window is; None while it is free.
        versions: of each window.
        asks: who wants to swap the windows.
    """

    id: str
    name: str
    partner: Classmate | None
    joined: bool
    partner_joined: bool
    partner_away: bool
    owners: dict[Window, str | None]
    versions: dict[Window, int]
    asks: str | None
    conducted: Conducted | None


class _ClassState(StreamAnswer):
    """What everybody in a class is shown.

    Attributes:
        frozen: 'eyes up': pupils' pages show nothing to work with, their worlds are paused.
        shared: the cable and the real cars.
        stopped: the teacher's emergency stop holds all real cars.
        cabled: something is at a port of the class's computer, so that the cable is of use.
    """

    frozen: bool
    shared: list[Shared]
    stopped: bool
    cabled: bool
    mat: MatView


class PupilView(_ClassState, tag="pupil", kw_only=True):
    """All that concerns a pupil; sent whole when something has changed.

    Attributes:
        mission: the number of the mission that was handed out last; None for none.
        news: what came and was not seen yet, at most 20.
        pair: with whom the pupil programs one project; None for nobody.
    """

    me: Self
    hand: bool
    mission: int | None
    news: list[News]
    pair: PairView | None = None


class PupilRow(Self):
    """A pupil, as the teacher sees it; all times in seconds until now.

    Attributes:
        online: a page of the pupil is connected.
        away_s: since when it isn't; 0 where it is.
        hand_s: since when the hand is raised; None where it isn't.
        stuck_s: since when there was no step in the mission, where that is longer than `ClassView.stuck_minutes`.
        mission: the id of the mission that the pupil works on; "own" for a document; None for none.
        goals_met, goals: of the mission, in the world in play.
        stars: all that the pupil has earned.
    """

    online: bool
    away_s: int
    hand_s: int | None
    stuck_s: int | None
    mission: str | None
    goals_met: int
    goals: int
    stars: int


class ClassView(_ClassState, tag="class", kw_only=True):
    """The whole class, for the teacher; sent whole when something has changed.

    Attributes:
        pupils: in the order in which they joined.
        disk: why the server can't store work at present; None where it can.
    """

    title: str
    code: str
    is_open: bool
    stuck_minutes: int
    pupils: list[PupilRow]
    disk: Sentence | None


class Goodbye(StreamAnswer, tag="goodbye"):
    """The pupil is no longer in the class; the connection ends. ``left``: on another page of this device."""

    why: Literal["removed", "ended", "left"]


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


class ClassWall(StreamAnswer, tag="wall"):
    """The worlds on the wall; sent whole when one is new or changed. Pictures refer to their places in this list.

    A picture is binary: 4 bytes number of the list (the ``number`` of the last ClassWall), then for each world whose
    moment has changed: place (uint16), cars shown (uint16), time in ms (uint32), then the columns of these cars as in a
    picture of a world (`motorcade.service.history`): x_m, y_m, heading (float32), index of the word (uint16), wheels,
    LED, flags (uint8), filled up to a multiple of four.
    """

    number: int
    worlds: list[WallWorld]


class DrawnWall(Struct, forbid_unknown_fields=True):
    """The page has drawn a picture of the wall (``drawn``), and its screen shows the places ``seen`` of a list."""

    drawn: bool = True
    number: int = 0
    seen: Annotated[list[int], Meta(max_length=200)] | None = None
