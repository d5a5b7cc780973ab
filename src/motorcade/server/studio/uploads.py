"""Uploads over WebSockets: through the server's ports and its simulated car, or through a port that the page opened."""

import asyncio
import secrets
import time
from collections.abc import Awaitable, Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from typing import Any

from anyio import CapacityLimiter, from_thread, to_thread
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.boards.computer import ImageStore, StoreError
from motorcade.errors import MotorcadeError, TransferError
from motorcade.server.page_socket import PageSocket, next_message
from motorcade.server.request_filter import ServerSettings
from motorcade.service.messages import Port
from motorcade.service.upload_session import (
    VIRTUAL_PORT,
    UploadSession,
    VirtualCarSession,
    check_order,
    failed,
    outcome_of,
    transfer_of,
)
from motorcade.service.world_messages import UploadAnswer, UploadOrder
from motorcade.upload.serial_port import BARE, ports, run

# The simulated car's image.
VIRTUAL_CAR = "virtual-car.image"
_MOST_AT_ONCE = 4


def listed_ports() -> list[Port]:
    """List all ports: the likeliest first; those of the mainboard last, as usually nothing is connected there."""
    ranked = [(port.rank == BARE, Port(port.device, port.title, "serial")) for port in ports()]
    ranked.append((False, VIRTUAL_PORT))
    return [port for _, port in sorted(ranked, key=lambda pair: pair[0])]


def has_cable() -> bool:
    """Return whether something is at a port of this computer: one of the mainboard's alone says nothing of it."""
    return any(port.rank != BARE for port in ports())


class VirtualCarImage(ImageStore):
    """The image of a simulated car.

    Args:
        path: of the file.
        owned: a block in which it is stored; raises MotorcadeError where its owner is out.
    """

    def __init__(self, path: Path, owned: Callable[[], AbstractContextManager[None]] = nullcontext) -> None:
        super().__init__(path)
        self._owned = owned

    def _replace(self, path: Path, data: bytes) -> None:
        with self._owned():
            super()._replace(path, data)


# The image of the simulated car of who asks; raises MotorcadeError where they may not use the port of that name.
Admit = Callable[[WebSocket, str], VirtualCarImage]


class Uploads:
    """The uploads of a server."""

    def __init__(self, settings: ServerSettings, admit: Admit) -> None:
        self._settings = settings
        self._admit = admit
        self._workers = CapacityLimiter(_MOST_AT_ONCE)

    async def serve(self, socket: WebSocket) -> None:
        """Do one transfer through a port of the server; it continues if the page leaves."""

        async def transfer(order: UploadOrder, page: PageSocket) -> None:
            baud = check_order(order).serial.baud

            def put(answer: UploadAnswer) -> None:
                from_thread.run_sync(page.put, answer)

            def work() -> None:
                # Asked when the turn has come: meanwhile another may have got the cable.
                store = from_thread.run_sync(self._admit, socket, order.port)
                if order.port == VIRTUAL_PORT.port:
                    self._reach_virtual_car(order, store, put)
                else:
                    _reach_car(order, baud, put)

            try:
                self._admit(socket, order.port)
                await to_thread.run_sync(work, limiter=self._workers)
            except MotorcadeError as problem:
                page.put(failed(problem, order.port))

        await self._answer(socket, transfer)

    async def serve_page_port(self, socket: WebSocket) -> None:
        """Do one transfer through a port that the page has opened: binary messages are the port's bytes."""

        async def transfer(order: UploadOrder, page: PageSocket) -> None:
            session = UploadSession(order, secrets.randbelow(256))
            came = asyncio.Event()

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

    def _reach_virtual_car(self, order: UploadOrder, store: ImageStore, put: Callable[[Any], None]) -> None:
        session = VirtualCarSession(order, secrets.randbelow(256), store.load, store.save)
        try:
            while not session.is_over:
                for answer in session.advance(self._settings.clock()):
                    put(answer)
                time.sleep(session.wait_s)
        except StoreError:
            raise MotorcadeError("virtual-car", path=store.path) from None


def _reach_car(order: UploadOrder, baud: int, put: Callable[[UploadAnswer], None]) -> None:
    # Some of pyserial's URLs write files, so a page may use listed ports only.
    if order.port not in {port.device for port in ports()}:
        raise TransferError("no-such-port", port=order.port)
    transfer = transfer_of(order, secrets.randbelow(256), put)
    run(transfer, order.port, baud)
    put(outcome_of(order, transfer, order.port))
