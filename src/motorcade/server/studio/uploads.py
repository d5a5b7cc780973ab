"""Uploads over WebSockets: through the server's ports and its simulated car, or through a port that the page opened."""

import asyncio
import secrets
import sys
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import Literal

from anyio import CapacityLimiter, from_thread, to_thread
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.boards.computer import ImageStore, StoreError, simulated_car
from motorcade.boards.lines import LineError, PseudoTerminal, TcpPort
from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError
from motorcade.server.page_socket import PageSocket, next_message
from motorcade.server.request_filter import ServerSettings
from motorcade.service.messages import Port
from motorcade.service.upload_session import UploadSession, check_order, failed, retry_notice, uploaded
from motorcade.service.world_messages import ImageRead, Outcome, Progress, UploadOrder
from motorcade.upload.serial_port import BARE, PortInfo, ports, readback, upload

VIRTUAL: Literal["virtual"] = "virtual"
_MOST_AT_ONCE = 4


def listed_ports() -> list[Port]:
    """List all ports: the likeliest first; those of the mainboard last, as usually nothing is connected there."""
    found = ports()
    likely = [_listed(port) for port in found if port.rank != BARE]
    bare = [_listed(port) for port in found if port.rank == BARE]
    return [*likely, Port(VIRTUAL, "", VIRTUAL), *bare]


def _listed(port: PortInfo) -> Port:
    return Port(port.device, port.title, "serial")


class VirtualCar:
    """A simulated leader that stores its image in a file and runs only during a transfer."""

    def __init__(self, store: Path) -> None:
        self._store = store
        self._lock = threading.Lock()

    @contextmanager
    def at_a_port(self, profile: Profile) -> Iterator[str]:
        """Run the car at a port of its own during the context. Raises MotorcadeError."""
        if not self._lock.acquire(blocking=False):
            raise MotorcadeError("car-busy", port=VIRTUAL, holds="")
        try:
            # Only this user can open a pseudo-terminal, while every user of this computer can reach a TCP port.
            line = TcpPort("127.0.0.1", 0) if sys.platform == "win32" else PseudoTerminal()
            try:
                with simulated_car(line, ImageStore(self._store), profile):
                    yield line.address
            finally:
                line.close()
        except (StoreError, LineError):
            raise MotorcadeError("virtual-car", path=self._store) from None
        finally:
            self._lock.release()


# Gives the simulated car of who asks while the transfer runs; raises MotorcadeError where they may not use the port of
# that name.
Admit = Callable[[WebSocket, str], AbstractContextManager[VirtualCar]]


class Uploads:
    """The uploads of a server."""

    def __init__(self, settings: ServerSettings, admit: Admit) -> None:
        self._settings = settings
        self._admit = admit
        self._workers = CapacityLimiter(_MOST_AT_ONCE)

    async def serve(self, socket: WebSocket) -> None:
        """Do one transfer through a port of the server; it continues if the page leaves."""

        async def transfer(order: UploadOrder, page: PageSocket) -> None:
            profile = check_order(order)
            try:
                with self._admit(socket, order.port) as car:
                    work = partial(self._transfer, order, profile, page, car)
                    page.put(await to_thread.run_sync(work, limiter=self._workers))
            except MotorcadeError as problem:
                page.put(failed(problem, order.port))

        await self._answer(socket, transfer)

    async def serve_page_port(self, socket: WebSocket) -> None:
        """Do one transfer through a port that the page has opened: binary messages are the port's bytes."""

        async def transfer(order: UploadOrder, page: PageSocket) -> None:
            session, came = UploadSession(order, secrets.randbelow(256)), asyncio.Event()

            async def receive() -> None:
                data: bytes | None = b""
                while data is not None:
                    # Anything other than bytes ends the transfer: the page has left, or is faulty.
                    data = (await socket.receive()).get("bytes") or None
                    session.receive(data)
                    came.set()

            receiving = asyncio.create_task(receive())
            try:
                while True:
                    for answer in session.advance(self._settings.clock()):
                        page.put(answer)
                    if session.is_over:
                        return
                    with suppress(TimeoutError):
                        await asyncio.wait_for(came.wait(), session.wait_s)
                    came.clear()
            finally:
                receiving.cancel()
                with suppress(asyncio.CancelledError):
                    await receiving

        await self._answer(socket, transfer)

    async def _answer(self, socket: WebSocket, transfer: Callable[[UploadOrder, PageSocket], Awaitable[None]]) -> None:
        await socket.accept()
        page = PageSocket(socket, self._settings)
        sending = asyncio.create_task(page.send_all())
        with suppress(WebSocketDisconnect):
            try:
                await transfer(await next_message(socket, UploadOrder, self._settings.most_body), page)
            except MotorcadeError as problem:
                page.put(failed(problem))
        page.close()
        with suppress(WebSocketDisconnect):
            await sending

    def _transfer(self, order: UploadOrder, profile: Profile, page: PageSocket, car: VirtualCar) -> Outcome:
        with _port(order.port, profile, car) as port:
            if order.image is None:
                return ImageRead(readback(port, profile.serial.baud))
            size = len(order.image)
            answer = upload(
                port,
                order.image,
                profile.serial.baud,
                order.verify,
                lambda sent: from_thread.run_sync(page.put, Progress(sent, size)),
                lambda retry: from_thread.run_sync(page.put, retry_notice(retry, size)),
            )
            return uploaded(order, answer)


def _port(port: str, profile: Profile, car: VirtualCar) -> AbstractContextManager[str]:
    if port == VIRTUAL:
        return car.at_a_port(profile)
    # Some of pyserial's URLs write files, so a page may use listed ports only.
    if port not in {each.device for each in ports()}:
        raise MotorcadeError("no-such-port", port=port)
    return nullcontext(port)
