"""A world that a page plays, wherever its kernels run."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

from msgspec import structs

from motorcade.car.brain import HOLDS, RUNNING, WORD
from motorcade.config.files import raised_as
from motorcade.config.profile import built_in_profile
from motorcade.engine.events import FRAME as SENT
from motorcade.engine.events import HEARD, LOSS_REASONS, LOST, START, STATE
from motorcade.engine.moment import NO_INDEX, RUNS, Event, unpack_moment
from motorcade.engine.pictures import CarTally, Pictures
from motorcade.engine.simulation import Simulation
from motorcade.errors import MotorcadeError, Phrase
from motorcade.mats import Mat, Pose, check_mat
from motorcade.mats.document import mat_of
from motorcade.missions.check import open_worlds_here
from motorcade.missions.model import Mission
from motorcade.missions.odds import OpenWorlds
from motorcade.service.calibration import driven_as
from motorcade.service.deciding import Deciding
from motorcade.service.messages import MatDocument, MissionChoice
from motorcade.service.missions import Referee, chosen_mission
from motorcade.service.why import why
from motorcade.service.world_messages import CarDetails, ReceivedFrame, SetWorld, Why, WorldHello
from motorcade.words.formats import CONTROL, FRAME
from motorcade.words.image import parse_image_bytes
from motorcade.words.infrared import word_of
from motorcade.words.packing import bytes_to_words
from motorcade.words.upload import NO_PROGRAM

# With more a moment takes so long to compute that one world delays the others.
MOST_FURNITURE = 400


class Steering(Protocol):
    """Steers those cars of a world that somebody drives."""

    def steer(self, world: Simulation) -> None:
        """Pass the setpoints to the cars."""

    def driven(self, cars: int) -> list[int]:
        """Return, in order, which of the first ``cars`` somebody drives."""


class StudioWorld:
    """A world that a page plays.

    Args:
        world: one world that keeps events. The words that pages show are those of its first image.
        referee: watches the goals of its mission.
        steering: of those of its cars that somebody drives; None where nobody can.
        counters: the names of the counters of its first image.

    Attributes:
        simulation: the world itself.
        deciding: what its leaders that decide have decided.
        pictures: what its cars show, as bytes.
        cars: how many there are.
        tick_ms: the length of a tick.
        radius_m: of the body of each car.
        words: those of the first image, the header first.
        referee: watches the goals of the world's mission; None where it has none.
    """

    def __init__(
        self,
        world: Simulation,
        referee: Referee | None = None,
        steering: Steering | None = None,
        counters: Sequence[str] = (),
    ) -> None:
        self.referee = referee
        self.cars = world.cars
        self.tick_ms = world.tick_ms
        self.radius_m = world.profile.body.diameter_mm / 2000
        self.simulation = world
        self._steering = steering
        self.words = bytes_to_words(world.images[0])
        self.pictures = Pictures(world)
        self._counters = counters
        self.deciding = Deciding(world, counters)

    @property
    def now_ms(self) -> int:
        """Simulated time."""
        return self.simulation.now_ms

    def run(self, duration_ms: int) -> bytes:
        """Simulate ``duration_ms``, a multiple of ``tick_ms``; return the rows of what happened, by time."""
        if self._steering:
            self._steering.steer(self.simulation)
        self.simulation.run(duration_ms)
        rows = self.pictures.take_events()
        self.deciding.see(rows)
        return rows

    def reset(self, seed: int) -> None:
        """Begin again; walls, obstacles, people, voices and physics stay as they are."""
        self.simulation.reset(seed)
        self.pictures = Pictures(self.simulation)
        self.deciding = Deciding(self.simulation, self._counters)

    def set_environment(self, mat: MatDocument, range_mm: int | None) -> None:
        """Change walls, obstacles, people, voices, physics and infrared range. Raises MotorcadeError."""
        if self.referee:
            # The page says which floor it shows by this message too.
            _check_fixed(self.referee.mission, mat_from(mat, self.cars), range_mm)
            return
        furniture = mat_from({**mat, "car": [], "crowd": []}, 0)
        with raised_as("bad-world"):
            self.simulation.set_environment(furniture, range_mm)

    def move(self, car: int, x_m: float, y_m: float, heading_deg: float) -> None:
        """Put a car elsewhere. Raises MotorcadeError."""
        if self.referee:
            raise _fixed("mat")
        with raised_as("bad-world"):
            self.simulation.move(car, Pose(x_m, y_m, math.radians(heading_deg)))

    def check_car(self, car: int) -> None:
        """Raise MotorcadeError where there is no such car."""
        if not 0 <= car < self.cars:
            raise MotorcadeError(
                "bad-world", reason=MotorcadeError("no-such-car-in-world", car=car, last=self.cars - 1)
            )

    def details(self, car: int) -> CarDetails:
        """Return the details of a car."""
        world = self.simulation
        word, runs, held = world.memory_of(car, (WORD, RUNNING, HOLDS))
        leads = bool(world.mat.starts.leads[car])
        holds = bool(held)
        if leads:
            holds = bool(runs)
        counted = self.pictures.counted(car)
        return CarDetails(
            car=car,
            leads=leads,
            **_shown_word(word, holds),
            index=self.pictures.index_of(car),
            runs=bool(runs),
            frames=counted.frames,
            heard=counted.heard,
            lost=counted.lost,
            last_frame=_last_frame(counted),
            why=self.why(car),
        )

    def why(self, car: int) -> Why:
        """Return why a car does what it does."""
        counted = self.pictures.counted(car)
        driven = car in self.driven()
        last = _last_frame(counted)
        return why(
            self.simulation, self.pictures, self.deciding, car, driven=driven, lost=counted.lost, last_frame=last
        )

    def details_then(self, car: int, t_ms: int, moment: bytes, events: Sequence[Event]) -> CarDetails:
        """Return the details of a car at a stored moment; ``why`` is of the present.

        ``events`` are all that are stored of the car, also later ones.
        """
        now = self.details(car)
        before = [event for event in events if event.t_ms < t_ms]
        after = Counter((event.kind, event.why) for event in events if event.t_ms >= t_ms)
        begun = next((event for event in reversed(before) if event.kind in (STATE, START)), None)
        heard = next((event for event in reversed(before) if event.kind == HEARD), None)
        columns = unpack_moment(moment, self.cars)
        index = columns["index"][car]
        runs = bool(columns["flags"][car] & RUNS)
        word = None
        if begun:
            word = begun.word
        # With several images the index may be of another one than the first.
        if index != NO_INDEX and len(self.simulation.images) == 1:
            word = self.words[index]
        return structs.replace(
            now,
            **_shown_word(word, runs or not now.leads),
            index=index,
            runs=runs,
            frames=now.frames - after[SENT, 0],
            heard=now.heard - after[HEARD, 0],
            lost={why: now.lost[why] - after[LOST, k] for k, why in enumerate(LOSS_REASONS) if why},
            last_frame=_received(heard.word, heard.other, heard.t_ms) if heard else None,
        )

    def driven(self) -> list[int]:
        """Return the cars that don't run their own program because somebody drives or drove them."""
        if self._steering:
            return self._steering.driven(self.cars)
        return []

    def leads(self) -> list[int]:
        """The cars that lead."""
        return self.simulation.mat.starts.leaders

    def hello(self, session: str, resumed: bool) -> WorldHello:
        """Return the cars, and what doesn't change from picture to picture."""
        range_m = self.simulation.profile.infrared.range_mm / 1000
        return WorldHello(session, resumed, self.cars, self.leads(), self.tick_ms, self.radius_m, range_m)


def _shown_word(word: int | None, is_held: bool) -> dict[str, Any]:
    """A word as a page shows it, and by fields; nothing of it where the car holds none."""
    if word is None or not is_held:
        return {"word": None, "values": None}
    return {"word": f"{word:08x}", "values": CONTROL.decode(word)._asdict()}


def _last_frame(counted: CarTally) -> ReceivedFrame | None:
    """The last frame that a car received; None where it received none."""
    if counted.heard:
        return _received(counted.last_word, counted.last_sender, counted.last_ms)
    return None


def _received(bits: int, sender: int, t_ms: int) -> ReceivedFrame:
    on_air = FRAME.decode(bits)
    return ReceivedFrame(f"{word_of(bits):08x}", on_air.tag, on_air.check, sender, t_ms)


def open_world(
    message: SetWorld,
    most_cars: int,
    open_worlds: OpenWorlds = open_worlds_here,
    images: Sequence[bytes] | None = None,
    steering: Steering | None = None,
) -> StudioWorld:
    """Build the world of a page's message. Raises MotorcadeError.

    With ``images`` the k-th leader has the k-th of them; goals about words are those of the message's image.
    """
    mat = mat_from(message.mat, most_cars)
    if message.mission:
        check_mission_size(message.mission, most_cars)
    profile = driven_as(built_in_profile(message.profile), message.car)
    image = NO_PROGRAM
    if message.image is not None:
        image = message.image
    parse_image_bytes(image)
    with raised_as("bad-mat"):
        check_mat(mat, profile)
    referee = None
    if message.mission:
        referee = Referee(chosen_mission(message.mission), image)
    if referee:
        _check_fixed(referee.mission, mat, message.range_mm)
        if message.car:
            raise _fixed("car")
    with raised_as("bad-world"):
        world = open_worlds(mat, images or [image], profile, [message.seed], True)
        if message.range_mm is not None:
            world.set_environment(mat, message.range_mm)
    return StudioWorld(world, referee, steering, message.counters)


def check_mission_size(choice: MissionChoice, most_cars: int) -> None:
    """Check how much a mission of the page's own holds, before any work. Raises MotorcadeError."""
    if choice.document:
        _check_size(choice.document)
        _check_size(choice.document.get("mat"), most_cars)


def _check_fixed(mission: Mission, mat: Mat, range_mm: int | None) -> None:
    """Check that a page changes nothing that its mission fixes: stars are earned on the mission's own mat."""
    if replace(mat, name=mission.mat.name) != mission.mat:
        raise _fixed("mat")
    if range_mm not in (None, mission.profile.infrared.range_mm):
        raise _fixed("range")


def _fixed(what: str) -> MotorcadeError:
    return MotorcadeError("mission-fixes", what=Phrase(f"fixed-{what}"))


def mat_from(document: Any, most_cars: int) -> Mat:
    """Return the mat in a page's ``document``. Raises MotorcadeError."""
    _check_size(document, most_cars)
    with raised_as("bad-mat"):
        return mat_of(document, Phrase("mat-of-page"))


def _check_size(document: Any, most_cars: float = math.inf) -> None:
    """Count cars and furniture of a mat, or furniture and zones of a mission, before any work. Raises MotorcadeError.

    A crowd is one line, yet it may have millions of cars. What isn't valid counts as nothing: another check refuses it.
    """
    cars = len(_tables(document, "car")) + sum(
        crowd["cars"] for crowd in _tables(document, "crowd") if isinstance(crowd.get("cars"), int | float)
    )
    if cars > most_cars:
        raise MotorcadeError("too-many-cars", count=cars, most=most_cars)
    single = sum(len(_tables(document, name)) for name in ("wall", "disc", "voice"))
    listed = (("polygon", "corners_m"), ("zone", "corners_m"), ("person", "path"))
    lists = [table.get(key) for name, key in listed for table in _tables(document, name)]
    count = single + sum(len(listed_things) for listed_things in lists if isinstance(listed_things, list))
    if count > MOST_FURNITURE:
        raise MotorcadeError("too-much-furniture", count=count, most=MOST_FURNITURE)


def _tables(document: Any, name: str) -> list[dict[str, Any]]:
    """The tables of a list of a document that may be no valid one."""
    found = None
    if isinstance(document, dict):
        found = document.get(name)
    if isinstance(found, list):
        return [table for table in found if isinstance(table, dict)]
    return []
