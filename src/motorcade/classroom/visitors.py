"""Pupils and the teacher as visitors of the studio, and as drivers of real cars: each has a shelf and turns."""

import asyncio
from collections.abc import Callable, Coroutine, Iterable, Iterator
from contextlib import AbstractAsyncContextManager, contextmanager
from functools import partial
from typing import Any, Literal

from starlette.requests import HTTPConnection

from motorcade.cameras.broadcast import Camera
from motorcade.classroom.presence import Presence
from motorcade.classroom.running_class import TEACHER, RunningClass
from motorcade.drive.connection import CarError, CarRefusesError
from motorcade.errors import MotorcadeError
from motorcade.server.remote.fleet import Action, Fleet, PageControl
from motorcade.server.remote.messages import ListedCar
from motorcade.server.studio.app import capabilities
from motorcade.server.studio.sessions import IMPORT, REQUEST_S, Visitors
from motorcade.server.studio.uploads import VIRTUAL, VirtualCar, listed_ports
from motorcade.server.studio.workers import CHECK
from motorcade.service.messages import Port
from motorcade.service.requests import Context
from motorcade.service.world_messages import Goals, Play, SetWorld, Step, WorldAnswer, WorldMessage
from motorcade.timing import RateLimit, to_ticks

_OWN_MISSION = "own"
# A whole class imports its projects one after another; the check of the dearest mission takes a quarter of a second.
_MOST_IMPORT_S = 5.0
_RATE_WINDOW_MS = 2000
# What a driver's page may ask of a car that is another's turn.
_ALWAYS = ("stop",)
_AGAIN_S = 0.1


class ClassVisitors(Visitors):
    """The pupils of a class, by their ids, and the teacher."""

    def __init__(self, running: RunningClass) -> None:
        super().__init__(running.settings.library, capabilities(running.settings))
        self.storage = running.folder
        self._running = running
        self._room = running.room
        self._cars: dict[str, VirtualCar] = {}
        self._rates: dict[str, RateLimit] = {}
        self._turns: dict[tuple[str, bool], asyncio.Lock] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def visitor(self, connection: HTTPConnection) -> str:
        return self._running.visitor(connection)

    def context(self, visitor: str) -> Context:
        role: Literal["teacher", "pupil"] = "teacher" if visitor == TEACHER else "pupil"
        able = capabilities(self._running.settings, role)
        return Context(able, self.storage, lambda: self._ports(visitor), visitor)

    def most_s(self, request: str) -> float:
        return _MOST_IMPORT_S if request == IMPORT else REQUEST_S

    def _ports(self, visitor: str) -> list[Port]:
        """The server's ports where it is the visitor's turn at the cable, and the simulated car."""
        if visitor == TEACHER or self._room.cable.first == visitor:
            return listed_ports()
        return [Port(VIRTUAL, "", VIRTUAL)]

    def may_use(self, visitor: str, owner: str) -> bool:
        return visitor == owner

    def check_message(self, visitor: str, message: WorldMessage) -> None:
        if visitor not in self._room.presence:
            return
        # A page that is loaded again gets its world, which stands still.
        if self._room.frozen and isinstance(message, Play | Step):
            raise MotorcadeError("class-frozen")
        if isinstance(message, SetWorld):
            mission = (message.mission.id or _OWN_MISSION) if message.mission else None
            self._room.note(visitor, partial(Presence.open_mission, mission=mission, now_s=self._running.now_s()))
            self._running.show_changes()

    def note_answers(self, visitor: str, answers: Iterable[WorldAnswer | bytes]) -> None:
        for answer in answers:
            if isinstance(answer, Goals):
                met, count = sum(goal.progress == "met" for goal in answer.goals), len(answer.goals)
                self._room.note(visitor, partial(Presence.see_goals, met=met, goals=count, now_s=self._running.now_s()))
                self._running.show_changes()

    def note_answered(self, visitor: str, request: str) -> None:
        if request == CHECK:
            task = asyncio.create_task(self.count_stars([visitor]))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def count_stars(self, owners: Iterable[str]) -> None:
        """Count the stars that pupils have earned."""
        for owner in owners:
            earned = await self._running.with_files(self._running.folder.stars, owner)
            total = sum(map(len, earned.values()))
            self._room.note(owner, partial(Presence.earn, stars=total, now_s=self._running.now_s()))
        self._running.show_changes()

    def check_request(self, visitor: str, now_s: float) -> None:
        a_second = self._running.settings.requests_of_one
        rate = self._rates.setdefault(visitor, RateLimit(2 * a_second, _RATE_WINDOW_MS))
        if visitor != TEACHER and not rate.allows(to_ticks(now_s)):
            raise MotorcadeError("requests-too-fast", most=a_second)

    def in_turn(self, visitor: str, request: str) -> AbstractAsyncContextManager[None]:
        """Answer one request of a visitor at a time, and one check: however many one sends, others wait for one."""
        return self._turns.setdefault((visitor, request == CHECK), asyncio.Lock())

    @contextmanager
    def virtual_car(self, connection: HTTPConnection, port: str) -> Iterator[VirtualCar]:
        visitor = self.visitor(connection)
        if visitor != TEACHER:
            if self._room.frozen:
                raise MotorcadeError("class-frozen")
            if port != VIRTUAL:
                self._room.cable.check(visitor)
        if visitor not in self._cars:
            self._cars[visitor] = VirtualCar(self._running.folder.virtual_car(visitor))
        if port == VIRTUAL:
            yield self._cars[visitor]
            return
        self._room.begin_transfer(visitor, self._running.now_s())
        self._running.show_changes()
        try:
            yield self._cars[visitor]
        finally:
            self._room.end_transfer(visitor)
            self._running.show_changes()


class TurnFleet(Fleet):
    """The real cars, for one visitor: a pupil drives only in turn, everybody may stop."""

    def __init__(self, cars: Fleet, running: RunningClass, visitor: str) -> None:
        self._cars = cars
        self._running = running
        self._visitor = visitor

    async def listed(self) -> list[ListedCar]:
        return await self._cars.listed()

    async def connect(self, car: str, page: str) -> PageControl:
        control = await self._cars.connect(car, page)
        return control if self._visitor == TEACHER else _TurnControl(control, self._running, self._visitor, car)

    async def stop(self, car: str, page: str) -> None:
        await self._cars.stop(car, page)

    async def camera(self, car: str) -> Camera | None:
        return await self._cars.camera(car)


class _TurnControl(PageControl):
    """A pupil's connection to a car; it gives the car back when the turn ends."""

    def __init__(self, control: PageControl, running: RunningClass, visitor: str, car: str) -> None:
        self._control = control
        self._running = running
        self._visitor = visitor
        self._car = car
        self._drove = False
        self._releasing: asyncio.Task[None] | None = None

    def steer(self, throttle: float, steering: float, **switches: int) -> None:
        self._check()
        self._drove = True
        self._control.steer(throttle, steering, **switches)

    async def act(self, action: Action) -> None:
        if action not in _ALWAYS:
            self._check()
        await self._control.act(action)

    def telemetry(self) -> dict[str, Any]:
        if self._drove and not self._may_drive():
            self._drove = False
            self._control.steer(0.0, 0.0)
            self._releasing = asyncio.create_task(self._release())
        return self._control.telemetry()

    def leave(self) -> None:
        self._control.leave()

    def _may_drive(self) -> bool:
        return self._running.room.may_drive(self._visitor, self._car)

    def _check(self) -> None:
        if not self._may_drive():
            raise MotorcadeError("not-your-turn", car=self._car)

    async def _release(self) -> None:
        # A car that can't be reached stands still, and nobody drives it.
        try:
            await self._control.act("release")
        except MotorcadeError:
            return


class EmergencyStop:
    """The teacher's emergency stop of all real cars.

    Args:
        cars: the real cars.
        patience_s: an answer waits so long for cars that can't be reached; they are stopped when they can be again.
    """

    def __init__(self, cars: Fleet, patience_s: float = 1.0) -> None:
        self._cars = cars
        self._patience_s = patience_s
        self._pending: set[asyncio.Task[None]] = set()

    async def stop(self) -> list[str]:
        """Stop all cars at once; return those that could not be reached yet."""
        self._cancel()
        return await self._at_all(lambda car: self._cars.stop(car, TEACHER))

    async def release(self) -> list[str]:
        """Let all cars drive again; return those that could not be reached yet."""
        self._cancel()
        return await self._at_all(self._clear)

    async def _clear(self, car: str) -> None:
        control = await self._cars.connect(car, TEACHER)
        try:
            while True:
                try:
                    await control.act("clear")
                except CarRefusesError:
                    raise
                except CarError:
                    # A new connection to a car takes a moment.
                    await asyncio.sleep(_AGAIN_S)
                else:
                    return
        finally:
            control.leave()

    def _cancel(self) -> None:
        for task in self._pending:
            task.cancel()

    async def _at_all(self, act: Callable[[str], Coroutine[Any, Any, None]]) -> list[str]:
        tasks = {listed.car: asyncio.create_task(act(listed.car)) for listed in await self._cars.listed()}
        if not tasks:
            return []
        for task in tasks.values():
            self._pending.add(task)
            task.add_done_callback(self._end)
        await asyncio.wait(tasks.values(), timeout=self._patience_s)
        return [car for car, task in tasks.items() if not task.done() or task.cancelled() or task.exception()]

    def _end(self, task: "asyncio.Task[None]") -> None:
        self._pending.discard(task)
        if not task.cancelled():
            # A car that refuses was told to the teacher.
            task.exception()
