"""What pupils' pages and the teacher's desk are sent while they are connected: the class, whole, when it changes."""

import asyncio

import msgspec
from starlette.websockets import WebSocket

from motorcade.classroom.desk_messages import ClassView
from motorcade.classroom.messages import Goodbye, PupilView
from motorcade.classroom.record import Pupil
from motorcade.classroom.running_class import RunningClass
from motorcade.classroom.shared_mat import SharedMat
from motorcade.classroom.views import class_view, pupil_view
from motorcade.errors import MotorcadeError
from motorcade.server.page_socket import PageSocket, refuse_page
from motorcade.service.messages import Nothing, sentences

# A page is sent the class at most so often; the teacher's at least every few seconds, since it shows ages.
_PUPIL_EVERY_S, _DESK_EVERY_S, _DESK_LATEST_S = 0.1, 0.25, 5.0


class Streams:
    """The WebSockets of a class that show its state."""

    def __init__(self, running: RunningClass, mat: SharedMat) -> None:
        self._running = running
        self._room = running.room
        self._mat = mat

    async def serve_pupil(self, socket: WebSocket) -> None:
        """Serve a pupil's page until it leaves, or the pupil is no longer in the class."""
        await socket.accept()
        pupil = self._running.pupil(socket)
        if pupil is None:
            await refuse_page(socket, self._running.settings, MotorcadeError("class-session-needed"))
            return
        page = PageSocket(socket, self._running.settings, (PupilView,))
        try:
            self._room.connect(pupil.id, self._running.now_s())
        except MotorcadeError as problem:
            await refuse_page(socket, self._running.settings, problem)
            return
        self._running.show_changes()
        try:
            await page.serve(Nothing, _ignore, [lambda: self._show_pupil(socket, page, pupil)])
        finally:
            self._room.disconnect(pupil.id, self._running.now_s())
            self._running.show_changes()

    async def _show_pupil(self, socket: WebSocket, page: PageSocket, pupil: Pupil) -> None:
        ended, shown = self._room.ended, b""
        with self._running.watching() as changed:
            while self._running.pupil(socket) is pupil:
                await changed.wait()
                changed.clear()
                if self._running.pupil(socket) is not pupil:
                    break
                view = pupil_view(self._room, pupil, self._mat.view(), self._running.now_s())
                if (data := msgspec.json.encode(view)) != shown:
                    shown = data
                    page.put(view)
                await asyncio.sleep(_PUPIL_EVERY_S)
        is_in = any(each is pupil for each in self._room.record.pupils)
        page.put(Goodbye("left" if is_in else "ended" if self._room.ended != ended else "removed"))
        page.close()
        await asyncio.Event().wait()

    async def serve_desk(self, socket: WebSocket) -> None:
        """Serve the teacher's desk until it leaves, or the teacher is signed out."""
        await socket.accept()
        page = PageSocket(socket, self._running.settings, (ClassView,))
        await page.serve(Nothing, _ignore, [lambda: self._show_desk(socket, page)])

    async def _show_desk(self, socket: WebSocket, page: PageSocket) -> None:
        with self._running.watching() as changed:
            while self._running.is_teacher(socket):
                problem = self._running.folder.problem
                disk = sentences(problem) if problem else None
                page.put(class_view(self._room, self._mat.view(), self._running.now_s(), disk))
                await asyncio.sleep(_DESK_EVERY_S)
                await wait_for(changed, _DESK_LATEST_S)
        page.put(Goodbye("left"))
        page.close()
        await asyncio.Event().wait()


async def wait_for(changed: asyncio.Event, most_s: float) -> None:
    """Wait until an event is set, but not longer than ``most_s``; then clear it."""
    waiting = asyncio.create_task(changed.wait())
    await asyncio.wait([waiting], timeout=most_s)
    waiting.cancel()
    changed.clear()


async def _ignore(message: Nothing) -> None:
    """Such a page has nothing to say."""
