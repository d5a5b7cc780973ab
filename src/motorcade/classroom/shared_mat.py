"""The shared mat: one world in which each pupil's leader runs the pupil's own program, and its followers hear it."""

import secrets
from functools import partial
from typing import Annotated, Any, Literal

from anyio import CapacityLimiter
from msgspec import Meta

from motorcade.classroom.messages import ClassWall, MatView, WallWorld, request
from motorcade.errors import MotorcadeError, Phrase
from motorcade.missions.document import OWN
from motorcade.server.studio.driving import PageWorld
from motorcade.service.messages import MatDocument, MissionChoice, Sentence, sentences
from motorcade.service.missions import chosen_mission, mission_goals, mission_zones
from motorcade.service.studio_world import StudioWorld, open_world
from motorcade.service.world_messages import Pause, Play, Reset, SetWorld, Shown, Watch
from motorcade.words.image import parse_image_bytes
from motorcade.words.upload import NO_PROGRAM

_MOST_CARS = 700
_KEY = "mat"
# So far apart, followers of one leader hear no other; followers stand behind theirs.
_BETWEEN_LEADERS_M = 2.5
_BETWEEN_FOLLOWERS_M = 0.3
_IN_A_ROW = 6
_PARADE_S = 60
MOST_PLACES = 60


def parade(leaders: int, followers: int) -> dict[str, Any]:
    """Return a motorcade-mission/1 document: so many leaders without obstacles, each with its followers behind it.

    All cars have to move, without touching each other, and then far.
    """
    rows = -(-leaders // _IN_A_ROW)
    columns = min(leaders, _IN_A_ROW)
    # The row of followers ends before the next leader.
    apart_m = max(_BETWEEN_LEADERS_M, _BETWEEN_FOLLOWERS_M * (followers + 1))
    # The first row of followers begins on the mat, too.
    first_m = max(0.75 * apart_m, _BETWEEN_FOLLOWERS_M * (followers + 0.5))
    cars: list[dict[str, Any]] = []
    for place in range(leaders):
        row, column = divmod(place, _IN_A_ROW)
        x_m = column * apart_m + first_m
        y_m = (rows - row - 0.5) * _BETWEEN_LEADERS_M
        cars.append({"at_m": [x_m, y_m], "role": "leader"})
        cars += [{"at_m": [round(x_m - _BETWEEN_FOLLOWERS_M * (k + 1), 3), y_m]} for k in range(followers)]
    size_m = [(columns + 0.5) * apart_m, rows * _BETWEEN_LEADERS_M]
    return {
        "format": "motorcade-mission/1",
        "name": sentences(Phrase("parade")),
        "seconds": _PARADE_S,
        "seeds": [0],
        "mat": {"tick_ms": 5, "size_m": size_m, "car": cars},
        "goal": [
            {"kind": "travelled", "least_m": 0.3},
            {"kind": "no-touch", "star": 2},
            {"kind": "travelled", "least_m": 2.0, "star": 3},
        ],
    }


def described(pupil: str, world: StudioWorld, mat: MatDocument) -> WallWorld:
    """Return what a page of the teacher has to know of a world before its pictures; ``pupil`` is its owner's id."""
    mission = None
    if world.referee:
        mission = world.referee.mission
    if mission:
        zones = mission_zones(mission)
        goals = mission_goals(mission)
    else:
        zones = []
        goals = []
    return WallWorld(pupil, mat, world.leads(), world.radius_m, world.cars, zones, goals)


class SharedMat:
    """The shared mat of a class.

    Attributes:
        session: its world; a page of the teacher shows it.
        changes: grows with each change that pages show.
    """

    def __init__(self) -> None:
        self.session = PageWorld(_KEY, _KEY, _MOST_CARS, CapacityLimiter(1), allowed=(Shown, Play, Pause, Reset, Watch))
        self.changes = 0
        self._images: dict[str, bytes] = {}
        # Whose leaders drive, in their order, also of pupils who have left since.
        self._started: list[str] = []
        self._mission: MissionChoice | None = None
        self._title: Sentence = {}
        self._places = self._followers = 0
        self._state: Literal["closed", "collecting", "running"] = "closed"

    def view(self) -> MatView:
        """Return what pages show of it."""
        referee = None
        if self._state == "running":
            referee = self.session.world.referee
        state: Literal["closed", "collecting", "running", "over"] = self._state
        if referee and referee.is_over:
            state = "over"
        mission = None
        if self._mission:
            mission = self._mission.id or OWN
        return MatView(state, mission, self._title, self._places, self._started or list(self._images))

    def wall(self) -> ClassWall:
        """Return the mat as a page has to know it before pictures of the world; without one while nothing runs."""
        session = self.session
        if self._state != "running" or session.mat is None:
            return ClassWall(1, [])
        return ClassWall(1, [described("", session.world, session.mat)])

    @request("teacher/mat/open")
    def open(
        self,
        mission: MissionChoice | None = None,
        followers: Annotated[int, Meta(ge=0, le=10)] = 2,
        places: Annotated[int, Meta(ge=1, le=MOST_PLACES)] = 30,
    ) -> None:
        """Collect programs from now on; earlier ones are gone. Raises MotorcadeError.

        Args:
            mission: one with many leaders; None for a parade with a leader for each program.
            followers: in a parade, the followers of each leader.
            places: in a parade, the most leaders.
        """
        title = sentences(Phrase("parade"))
        if mission:
            chosen = chosen_mission(mission)
            title = chosen.name.texts
            places = len(chosen.mat.starts.leaders)
            if not 0 < places <= MOST_PLACES or len(chosen.mat.starts) > _MOST_CARS:
                raise MotorcadeError("mission-not-for-a-class", most=MOST_PLACES)
        self.close()
        self._mission = mission
        self._followers = followers
        self._title = title
        self._places = places
        self._state = "collecting"

    def enter(self, pupil: str, image: bytes | None) -> None:
        """Take a pupil's program, in place of an earlier one; None takes it off.

        Raises MotorcadeError where nothing is collected, all places are taken, or the image is damaged.
        """
        if self._state != "collecting":
            raise MotorcadeError("mat-is-closed")
        self.changes += 1
        if image is None:
            self._images.pop(pupil, None)
            return
        if pupil not in self._images and len(self._images) >= self._places:
            raise MotorcadeError("mat-is-full", most=self._places)
        parse_image_bytes(image)
        self._images[pupil] = image

    def leave(self, pupil: str) -> None:
        """Take the program of a pupil who is no longer in the class off the mat."""
        self._images.pop(pupil, None)
        self.changes += 1

    @request("teacher/mat/start")
    async def start(self) -> None:
        """Start all programs together, from the beginning; a parade has a leader for each.

        Raises MotorcadeError where there is none.
        """
        if not self._images:
            raise MotorcadeError("mat-is-empty")
        images = [*self._images.values()]
        choice = self._mission or MissionChoice(document=parade(len(images), self._followers))
        mission = chosen_mission(choice)
        entered = list(self._images)
        programs = self._images
        images += [NO_PROGRAM] * (len(mission.mat.starts.leaders) - len(images))
        document = mission.mat_document
        seed = secrets.randbits(32)
        message = SetWorld(document, images[0], mission.document["profile"], seed, None, choice)
        session = self.session
        async with session.lock:
            world = await session.in_thread(
                partial(open_world, message, _MOST_CARS, images=images, steering=session.fleet.boards)
            )
            if self._images is not programs:
                # It was cleared, or the class ended, while the world was built.
                raise MotorcadeError("mat-is-closed")
            session.mat = document
            self._started = entered
            self._state = "running"
            answers = session.begin(world)
            session.play()
            if session.page:
                session.page.put(self.wall())
            for answer in [*answers, session.state()]:
                session.sent[type(answer)] = answer
                if session.page:
                    session.page.put(answer)
        session.changed.set()
        self.changes += 1

    @request("teacher/mat/close")
    def close(self) -> None:
        """Clear the mat: programs and world are gone."""
        self.changes += 1
        self._images = {}
        self._started = []
        self._places = 0
        self._title = {}
        self._mission = None
        self._state = "closed"
        if self.session.has_world:
            self.session.pause()
