"""The stream ``trials`` over WebSockets: one thread computes for all pages, a little for each in turn."""

import asyncio
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket

from motorcade.boards.simulated_drive import DrivenCars
from motorcade.errors import MotorcadeError
from motorcade.server.page_socket import PageSocket, refuse_page
from motorcade.server.request_filter import ServerSettings
from motorcade.server.studio.driving import build_world
from motorcade.server.studio.sessions import SessionLimits, Visitors
from motorcade.service.trial_messages import Luck, TrialMessage
from motorcade.service.trials import TrialSession

# The worlds that pages look at come first, where the system can do that for a thread.
_POLITENESS = 10


class Trials:
    """The trials of a server's pages."""

    def __init__(self, settings: ServerSettings, limits: SessionLimits, visitors: Visitors) -> None:
        self._settings, self._limits, self._visitors = settings, limits, visitors
        self._thread = ThreadPoolExecutor(1, "trials", initializer=_be_polite)
        self._pages = 0

    async def serve(self, socket: WebSocket) -> None:
        """Serve a page's connection until it ends."""
        await socket.accept()
        try:
            self._admit(socket)
        except MotorcadeError as problem:
            await refuse_page(socket, self._settings, problem)
            return
        self._pages += 1
        try:
            await self._serve(PageSocket(socket, self._settings, (Luck,)))
        finally:
            self._pages -= 1

    def _admit(self, socket: WebSocket) -> None:
        self._visitors.visitor(socket)
        if self._pages >= self._limits.most:
            raise MotorcadeError("too-many-sessions", most=self._limits.most)

    async def _serve(self, page: PageSocket) -> None:
        most_cars = self._limits.most_cars
        make_world = partial(build_world, driven=DrivenCars(), most_cars=most_cars)
        session = TrialSession(make_world, most_cars)
        asked, lock, loop = asyncio.Event(), asyncio.Lock(), asyncio.get_running_loop()

        async def handle(message: TrialMessage) -> None:
            async with lock:
                answers = await loop.run_in_executor(self._thread, session.receive, message)
            for answer in answers:
                page.put(answer)
            asked.set()

        async def work() -> None:
            while True:
                await asked.wait()
                async with lock:
                    answers = await loop.run_in_executor(self._thread, session.advance)
                for answer in answers:
                    page.put(answer)
                if not session.is_busy:
                    asked.clear()

        await page.serve(TrialMessage, handle, [work])


def _be_polite() -> None:
    """Give this thread less of the processors than others; on Linux a thread has a priority of its own."""
    if hasattr(os, "setpriority") and os.uname().sysname == "Linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _POLITENESS)


def route(settings: ServerSettings, limits: SessionLimits, visitors: Visitors) -> WebSocketRoute:
    """The WebSocket of trials."""
    return WebSocketRoute("/api/trials", Trials(settings, limits, visitors).serve)
