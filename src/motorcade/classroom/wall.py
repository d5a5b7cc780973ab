"""The live wall: small pictures of all worlds for the projector; and one pupil's world, to look on.

Nothing is simulated or packed for it: it takes the moments that pupils' worlds store, and what their pages are sent.
"""

import asyncio
import struct
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import NamedTuple

from starlette.websockets import WebSocket

from motorcade.classroom.messages import ClassWall, DrawnWall, Goodbye
from motorcade.classroom.running import RunningClass
from motorcade.classroom.shared_mat import described
from motorcade.engine.moment import first_cars, moment_bytes
from motorcade.server.page_socket import PageSocket, accepted
from motorcade.server.studio.driving import PageWorld
from motorcade.server.studio.sessions import PageWorlds
from motorcade.service.history import HEADER_BYTES, header_of, renumbered
from motorcade.service.messages import MatDocument
from motorcade.service.studio_world import StudioWorld
from motorcade.service.world_messages import Goals, Shown, State, WorldAnswer, WorldHello

PICTURE_EVERY_S = 1 / 16
LIST_EVERY_S = 1.0
WATCH_EVERY_S = 0.1
# The shared mat goes on in such steps while only the wall shows it.
UNSHOWN_EVERY_S = 0.2
MOST_CARS_SHOWN = 60
_MOST_UNDER_WAY = 2
_NUMBER = struct.Struct("<I")
_PLACE = struct.Struct("<HHI")


class ShownWorld(NamedTuple):
    """A world on the wall, and whose; with another world or mat it is another one."""

    pupil: str
    session: PageWorld
    world: StudioWorld
    mat: MatDocument

    def moment(self) -> tuple[int, bytes]:
        """Return time and bytes of what the pupil sees: a paused world may show its past, or a car that was moved."""
        picture = self.session.sent.get(bytes)
        if self.session.playing or not isinstance(picture, bytes):
            return self.session.newest()
        header = header_of(picture)
        return header.t_ms, picture[HEADER_BYTES:][: moment_bytes(header.cars)]


class WallPictures:
    """What one page of the wall is sent.

    Args:
        now_shown: the worlds that there are now.

    Attributes:
        under_way: how many pictures the page has not drawn yet.
    """

    def __init__(self, now_shown: Callable[[], Iterable[ShownWorld]]) -> None:
        self.under_way = 0
        # The places in the list whose tiles the page's screen shows; None: all.
        self._seen: frozenset[int] | None = None
        self._now_shown = now_shown
        self._number = 0
        self._shown: list[ShownWorld] = []
        self._listed_s = float("-inf")
        self._last: dict[int, bytes] = {}

    def answers(self, now_s: float) -> list[ClassWall | bytes]:
        """Return what is to be sent: the list where it is new, and a picture where the page has drawn those before."""
        answers: list[ClassWall | bytes] = []
        found = list(self._now_shown())
        if not self._number or (found != self._shown and now_s - self._listed_s >= LIST_EVERY_S):
            self._number += 1
            self._seen = None
            self._shown = found
            self._listed_s = now_s
            self._last = {}
            answers.append(ClassWall(self._number, [described(shown.pupil, shown.world, shown.mat) for shown in found]))
        if self.under_way < _MOST_UNDER_WAY and (picture := self._picture(found)):
            self.under_way += 1
            answers.append(picture)
        return answers

    def receive(self, message: DrawnWall) -> None:
        """Take what a page says; places of an earlier list mean nothing any more."""
        if message.drawn:
            self.under_way = max(self.under_way - 1, 0)
        if message.number == self._number and message.seen is not None:
            self._seen = frozenset(message.seen)

    def _picture(self, found: list[ShownWorld]) -> bytes:
        """Return a picture of the worlds that are seen and have changed; empty where none has."""
        parts = []
        now = {world.pupil: world for world in found}
        for place, world in enumerate(self._shown):
            if (self._seen is not None and place not in self._seen) or now.get(world.pupil) != world:
                continue
            t_ms, moment = world.moment()
            if self._last.get(place) == moment:
                continue
            self._last[place] = moment
            cars = world.world.cars
            shown = cars
            if world.pupil:
                shown = min(cars, MOST_CARS_SHOWN)
            parts.append(_PLACE.pack(place, shown, t_ms) + first_cars(moment, cars, shown))
        if parts:
            return _NUMBER.pack(self._number) + b"".join(parts)
        return b""


class _Onlooker:
    """One page that looks on at a pupil's world: what it is sent. Pictures are numbered anew.

    Attributes:
        drawn: the number of the newest picture that the page has drawn.
    """

    def __init__(self) -> None:
        self.drawn = 0
        self._numbered = self._lists = 0
        self._world: ShownWorld | None = None
        self._sent: dict[type, WorldAnswer | bytes] = {}

    def answers(self, world: ShownWorld | None) -> list[ClassWall | WorldAnswer | bytes]:
        """Return what is to be sent now."""
        answers: list[ClassWall | WorldAnswer | bytes] = []
        if not self._lists or world != self._world:
            self._lists += 1
            self._world = world
            self._sent = {}
            shown = []
            if world:
                shown = [described(world.pupil, world.world, world.mat)]
            answers.append(ClassWall(self._lists, shown))
        if world is None:
            return answers
        for kind in (WorldHello, State, Goals, bytes):
            answer = world.session.sent.get(kind)
            waits = kind is bytes and self._numbered - self.drawn >= _MOST_UNDER_WAY
            if answer is None or answer is self._sent.get(kind) or waits:
                continue
            self._sent[kind] = answer
            if isinstance(answer, bytes):
                self._numbered += 1
                answer = renumbered(answer, self._numbered)
            answers.append(answer)
        return answers


class Walls:
    """The WebSockets of the wall, and of those who look on at one world."""

    def __init__(self, running: RunningClass, worlds: PageWorlds) -> None:
        self._running = running
        self._worlds = worlds
        self._mat = running.mat

    async def serve(self, socket: WebSocket) -> None:
        """Serve a page that shows the wall."""
        wall = WallPictures(self._now_shown)

        async def drawn(message: DrawnWall) -> None:
            wall.receive(message)

        def now() -> list[ClassWall | bytes]:
            return wall.answers(self._running.settings.clock())

        async with accepted(socket, self._running.settings, (ClassWall,)) as page:
            show = partial(self._show, socket, page, now, PICTURE_EVERY_S)
            # The parade goes on although nobody has opened its own page.
            go_on = partial(self._worlds.run_unshown, self._mat.session, UNSHOWN_EVERY_S)
            await page.serve(DrawnWall, drawn, [show, go_on])

    async def watch(self, socket: WebSocket) -> None:
        """Serve a page that looks on at one pupil's world; it follows the pupil from world to world."""
        onlooker = _Onlooker()
        pupil_id = socket.query_params.get("pupil", "")

        async def drawn(message: Shown) -> None:
            onlooker.drawn = max(onlooker.drawn, message.frame)

        def now() -> list[ClassWall | WorldAnswer | bytes]:
            return onlooker.answers(next((shown for shown in self._now_shown() if shown.pupil == pupil_id), None))

        async with accepted(socket, self._running.settings, (ClassWall, State, Goals)) as page:
            self._running.room.pupil(pupil_id)
            await page.serve(Shown, drawn, [partial(self._show, socket, page, now, WATCH_EVERY_S)])

    async def _show(
        self, socket: WebSocket, page: PageSocket, answers: Callable[[], Iterable[object]], every_s: float
    ) -> None:
        """Send what there is, until the teacher is signed out."""
        now_s = asyncio.get_running_loop().time
        due_s = now_s()
        while self._running.is_teacher(socket):
            for answer in answers():
                page.put(answer)
            # The work is part of the time between two pictures; those that came late are not made up for.
            due_s = max(due_s + every_s, now_s())
            await asyncio.sleep(due_s - now_s())
        await page.say_last(Goodbye("left"))

    def _now_shown(self) -> Iterator[ShownWorld]:
        """Yield the worlds of pupils whose pages are connected, and the shared mat."""
        shown = self._worlds.newest()
        if self._mat.view().state in ("running", "over"):
            shown[""] = self._mat.session
        for owner in (*(pupil.id for pupil in self._running.room.record.pupils), ""):
            if (session := shown.get(owner)) and session.has_world and session.mat is not None:
                yield ShownWorld(owner, session, session.world, session.mat)
