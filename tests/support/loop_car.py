"""A car that is served in the event loop of the test, with the clock of that loop."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from typing import Any

from motorcade.config.profile import Profile
from motorcade.drive.channels import Clients
from motorcade.drive.listener import bind
from motorcade.drive.server import serving
from motorcade.drive.session import CarControl
from motorcade.timing import to_ticks
from support.mock_board import CLASSROOM, MockDriveBoard
from support.mock_clock import pass_time

_BEAT_S = 0.01


class LoopCar:
    """Its ``port`` and ``telemetry_port``, its ``board``, ``control`` and ``server``."""

    def __init__(self, tls: Any, profile: Profile) -> None:
        loop = asyncio.get_running_loop()
        self.board = MockDriveBoard(loop.time)
        self.control = CarControl(self.board, lambda: to_ticks(loop.time()), profile)
        self.server = Clients(self.control)
        self.sockets = [bind("127.0.0.1", 0) for _ in range(2)]
        self.port, self.telemetry_port = (each.getsockname()[1] for each in self.sockets)
        self.tls = tls

    async def beat(self) -> None:
        """Do what is due, again and again."""
        while True:
            self.control.beat()
            await pass_time(_BEAT_S)


@contextlib.asynccontextmanager
async def loop_car(tls: Any = None, profile: Profile = CLASSROOM) -> AsyncIterator[LoopCar]:
    """Serve a car while the block runs."""
    car = LoopCar(tls, profile)
    beating = asyncio.ensure_future(car.beat())
    try:
        async with serving(car.server, car.sockets[0], car.sockets[1], tls):
            yield car
    finally:
        beating.cancel()
        await asyncio.gather(beating, return_exceptions=True)
        car.control.close()
