"""The real cars of a class: each pupil drives the one that the pupil has, and the teacher stops all."""

import asyncio
from collections.abc import Callable, Coroutine
from contextlib import suppress
from typing import Any

from motorcade.cameras.broadcast import Camera
from motorcade.drive.connection import CarError, CarRefusesError
from motorcade.errors import MotorcadeError
from motorcade.server.remote.fleet import Action, Fleet, PageControl
from motorcade.server.remote.messages import ListedCar

_AGAIN_S = 0.1
# An answer waits so long for cars that can't be reached; they are stopped when they can be again.
_PATIENCE_S = 1.0


class PupilFleet(Fleet):
    """The real cars, for a pupil: everybody may stop one, and drive only the one that ``may_drive`` allows."""

    def __init__(self, cars: Fleet, may_drive: Callable[[str], bool]) -> None:
        self._cars = cars
        self._may_drive = may_drive

    async def listed(self) -> list[ListedCar]:
        return await self._cars.listed()

    async def connect(self, car: str, page: str) -> PageControl:
        return _PupilControl(await self._cars.connect(car, page), car, self._may_drive)

    async def stop(self, car: str, page: str) -> None:
        await self._cars.stop(car, page)

    async def camera(self, car: str) -> Camera | None:
        return await self._cars.camera(car)


class _PupilControl(PageControl):
    """A pupil's connection to a car; it gives the car back when somebody else gets it."""

    def __init__(self, control: PageControl, car: str, may_drive: Callable[[str], bool]) -> None:
        self._control = control
        self._car = car
        self._may_drive = may_drive
        self._drove = False
        self._releasing: asyncio.Task[None] | None = None

    def steer(self, throttle: float, steering: float, **switches: int) -> None:
        self._check()
        self._drove = True
        self._control.steer(throttle, steering, **switches)

    async def act(self, action: Action) -> None:
        if action != "stop":
            self._check()
        await self._control.act(action)

    def telemetry(self) -> dict[str, Any]:
        if self._drove and not self._may_drive(self._car):
            self._drove = False
            self._control.steer(0.0, 0.0)
            self._releasing = asyncio.create_task(self._release())
        return self._control.telemetry()

    def leave(self) -> None:
        self._control.leave()

    def _check(self) -> None:
        if not self._may_drive(self._car):
            raise MotorcadeError("not-your-turn", car=self._car)

    async def _release(self) -> None:
        # A car that can't be reached stands still, and nobody drives it.
        with suppress(MotorcadeError):
            await self._control.act("release")


class EmergencyStop:
    """The teacher's emergency stop of all real cars.

    Args:
        cars: the real cars.
        page: the name of who stops them.
    """

    def __init__(self, cars: Fleet, page: str) -> None:
        self._cars = cars
        self._page = page
        self._pending: set[asyncio.Task[None]] = set()

    async def stop(self) -> list[str]:
        """Stop all cars at once; return those that could not be reached yet."""
        self._cancel()
        return await self._at_all(lambda car: self._cars.stop(car, self._page))

    async def release(self) -> list[str]:
        """Let all cars drive again; return those that could not be reached yet."""
        self._cancel()
        return await self._at_all(self._clear)

    async def _clear(self, car: str) -> None:
        control = await self._cars.connect(car, self._page)
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
        await asyncio.wait(tasks.values(), timeout=_PATIENCE_S)
        return [car for car, task in tasks.items() if not task.done() or task.cancelled() or task.exception()]

    def _end(self, task: "asyncio.Task[None]") -> None:
        self._pending.discard(task)
        if not task.cancelled():
            # A car that refuses was told to the teacher.
            task.exception()
