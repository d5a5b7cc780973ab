"""Uploads and readbacks: through the server's ports and its virtual car, or through a port that the page opened."""

import asyncio
import base64
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AbstractContextManager, asynccontextmanager, nullcontext, suppress
from typing import Any

import msgspec
from anyio import CapacityLimiter, from_thread, to_thread
from starlette.requests import Request
from starlette.routing import BaseRoute, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from motorcade.config.profile import Profile
from motorcade.errors import MotorcadeError
from motorcade.program.diagnostics import LANGUAGES
from motorcade.server.errors import ServerError
from motorcade.server.http import get
from motorcade.server.sockets import heard
from motorcade.server.studio.settings import Settings
from motorcade.service.compiling import profile_named
from motorcade.service.errors import StudioError
from motorcade.service.messages import check_image
from motorcade.service.virtual import VIRTUAL, VirtualCar
from motorcade.service.web_serial import WEB_SERIAL, WebSerialTransfer, retry_told
from motorcade.upload.ports import BARE, PortInfo, ports
from motorcade.upload.serial_port import readback, upload
from motorcade.upload.transfer import Retry

_MOST_AT_ONCE = 4


class Wanted(msgspec.Struct, forbid_unknown_fields=True):
    """What a page asks of a car: to take an image, or to give back its own."""

    port: str = ""
    image: bytes | None = None
    verify: bool = True
    readback: bool = False
    profile: str = "classroom"


Told = dict[str, Any]
Transfer = Callable[[Wanted, Profile], Awaitable[Told]]


class Uploads:
    """The uploads of a server."""

    def __init__(self, settings: Settings):
        self._settings = settings
        self._virtual_car = VirtualCar(settings.library / "virtual-car.image")
        self._workers = CapacityLimiter(_MOST_AT_ONCE)

    def ports(self, _: Request) -> list[Told]:
        """The ports that there are: the likeliest first, the mainboard's, at which is mostly nothing, last."""
        found = ports()
        likely = [_listed(port) for port in found if port.rank != BARE]
        bare = [_listed(port) for port in found if port.rank == BARE]
        return [*likely, {"port": VIRTUAL, "description": "", "kind": VIRTUAL}, *bare]

    async def serve(self, socket: WebSocket) -> None:
        """One upload or readback through a port of the server; it goes on where the page leaves meanwhile."""

        async def talk(wanted: Wanted, profile: Profile) -> Told:
            async with _telling(socket) as tell:
                return await to_thread.run_sync(self._talk, wanted, profile, tell, limiter=self._workers)

        await self._answer(socket, talk)

    async def carry(self, socket: WebSocket) -> None:
        """One upload or readback through a port that the page has opened: it only carries the bytes."""

        async def talk(wanted: Wanted, profile: Profile) -> Told:
            async with WebSerialTransfer(socket, profile.serial.baud, self._settings.clock) as carrier:
                if wanted.image is None:
                    return _image(await carrier.readback())
                async with _telling(socket) as tell:
                    return _sent(wanted, await carrier.upload(wanted.image, wanted.verify, tell))

        await self._answer(socket, talk)

    async def _answer(self, socket: WebSocket, talk: Transfer) -> None:
        await socket.accept()
        wanted = Wanted()
        try:
            wanted = await heard(socket, Wanted, self._settings.most_body)
            result = await talk(wanted, _checked(wanted))
        except ServerError as problem:
            result = _failed(problem)
        except MotorcadeError as problem:
            result = _failed(problem, wanted.port or WEB_SERIAL)
        except WebSocketDisconnect:
            return
        with suppress(WebSocketDisconnect):
            await socket.send_json(result)
            await socket.close()

    def _talk(self, wanted: Wanted, profile: Profile, tell: Callable[[Told], None]) -> Told:
        with self._port(wanted.port, profile) as port:
            if wanted.image is None:
                return _image(readback(port, profile.serial.baud))
            size = len(wanted.image)

            def progress(sent: int) -> None:
                from_thread.run_sync(tell, {"sent": sent, "of": size})

            def retrying(retry: Retry) -> None:
                from_thread.run_sync(tell, retry_told(retry, size))

            baud = profile.serial.baud
            return _sent(wanted, upload(port, wanted.image, baud, wanted.verify, progress, retrying))

    def _port(self, port: str, profile: Profile) -> AbstractContextManager[str]:
        if port == VIRTUAL:
            return self._virtual_car.at_a_port(profile)
        # Of pyserial's URLs some write files, so a page may name only what is listed.
        if port not in {each.device for each in ports()}:
            raise MotorcadeError("no-such-port", port=port)
        return nullcontext(port)


@asynccontextmanager
async def _telling(socket: WebSocket) -> AsyncIterator[Callable[[Told], None]]:
    """Something to call with what the page is to hear; the page has heard all when the context is left."""
    told: asyncio.Queue[Told | None] = asyncio.Queue()

    async def tell() -> None:
        with suppress(WebSocketDisconnect):
            while message := await told.get():
                await socket.send_json(message)

    telling = asyncio.create_task(tell())
    try:
        yield told.put_nowait
    finally:
        told.put_nowait(None)
        await telling


def _listed(port: PortInfo) -> Told:
    return {"port": port.device, "description": port.title, "kind": "serial"}


def _checked(wanted: Wanted) -> Profile:
    """The profile of what is wanted, which makes sense. Raises StudioError."""
    if (wanted.image is None) != wanted.readback:
        raise StudioError("bad-message", reason="give either an image or readback")
    if wanted.image is not None:
        check_image(wanted.image)
    return profile_named(wanted.profile)


def _sent(wanted: Wanted, answer: str) -> Told:
    return {"outcome": "verified", "answer": answer} if wanted.verify else {"outcome": "not-verified"}


def _image(image: bytes) -> Told:
    return {"outcome": "image", "image": base64.b64encode(image).decode()}


def _failed(problem: ServerError | MotorcadeError, port: str = "") -> Told:
    """The problem in the page's words where the command line's would lead astray, and by the port's name there."""
    if isinstance(problem, ServerError):
        return {"outcome": "failed", "error": problem.as_dict()}
    problem.details["port"] = port
    sentences = {language: problem.sentence(language, "page") for language in LANGUAGES}
    return {"outcome": "failed", "error": {"code": problem.code, "message": sentences}}


def routes(settings: Settings) -> list[BaseRoute]:
    """Ports, and the WebSockets of uploads."""
    uploads = Uploads(settings)
    return [
        get("/api/ports", uploads.ports),
        WebSocketRoute("/api/upload", uploads.serve),
        WebSocketRoute("/api/serial", uploads.carry),
    ]
