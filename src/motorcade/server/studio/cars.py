"""The list of cars on pages: the cars that this computer finds, live; a page blinks, loads, stops and starts them."""

import asyncio
from binascii import crc32
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial

from starlette.websockets import WebSocket

from motorcade.errors import MotorcadeError
from motorcade.fleet.cars import Cars, Finder
from motorcade.fleet.contact import CarStatus, Contact, Verdict
from motorcade.fleet.places import safe_name
from motorcade.server.page_socket import PageSocket, accepted
from motorcade.server.studio.sessions import Settings
from motorcade.service.messages import Sentence
from motorcade.service.world_messages import CarRow, CarsOrder, CarsShown
from motorcade.words.image import parse_image_bytes
from motorcade.words.request import BLINK, GO, STOP

_EVERY_S = 0.25
_MOST_PROGRAMS = 256


class CarList:
    """The cars of a server; they are looked for while a page shows them, so that ports are free otherwise.

    Args:
        settings: of the server.
        may_stay: whether a page may still see and order cars.
    """

    def __init__(self, settings: Settings, may_stay: Callable[[WebSocket], bool] = lambda socket: True) -> None:
        self._settings = settings
        self._may_stay = may_stay
        self._pages = 0
        self._is_looking = False
        self._lock = asyncio.Lock()
        self._resources = AsyncExitStack()
        self._cars = Cars()
        self._finder = Finder(self._cars)
        self._sent: dict[str, int] = {}
        self._verdicts: dict[str, Verdict] = {}
        self._loads: set[asyncio.Task[None]] = set()
        # The last order.
        self._ordered = ""
        # Names of the programs that were loaded, the newest last, by the CRC-32 of their images.
        self._programs: dict[str, str] = {}

    async def serve(self, socket: WebSocket) -> None:
        """Show the cars to a page, and do what it orders, until it leaves."""

        async def show(page: PageSocket) -> None:
            shown: CarsShown | None = None
            while self._may_stay(socket):
                now = self._shown()
                if now != shown:
                    page.put(now)
                shown = now
                await asyncio.sleep(_EVERY_S)
            page.close()
            await asyncio.Event().wait()

        async with accepted(socket, self._settings, (CarsShown,)) as page, self._looking():
            await page.serve(CarsOrder, self._obey, [partial(show, page)])

    def order(self, kind: str) -> None:
        """STOP all cars, or let them GO; those that are found later get the order, too."""
        self._ordered = kind
        self._cars.order(kind)

    async def _obey(self, order: CarsOrder) -> None:
        if order.do in ("stop", "go"):
            self.order(STOP if order.do == "stop" else GO)
        elif order.do == "blink":
            await self._cars.ask(order.where, BLINK)
        elif order.image is not None:
            parse_image_bytes(order.image)
            self._cars.named(order.where)
            checksum = f"{crc32(order.image):08x}"
            self._programs.pop(checksum, None)
            self._programs[checksum] = safe_name(order.program)
            if len(self._programs) > _MOST_PROGRAMS:
                del self._programs[next(iter(self._programs))]
            task = asyncio.create_task(self._load(order.image, order.where))
            self._loads.add(task)
            task.add_done_callback(self._loads.discard)

    async def _load(self, image: bytes, where: list[str]) -> None:
        for address in where:
            self._sent[address] = 0
            self._verdicts.pop(address, None)

        def advance(contact: Contact, sent: int) -> None:
            self._sent[contact.place.address] = sent

        try:
            for verdict in await self._cars.load(image, where, advance):
                self._verdicts[verdict.where] = verdict
        finally:
            for address in where:
                self._sent.pop(address, None)

    @asynccontextmanager
    async def _looking(self) -> AsyncIterator[None]:
        """Look for cars while any page shows them."""
        async with self._lock:
            self._pages += 1
            if not self._is_looking:
                self._cars = Cars(self._settings.places, self._settings.keys)
                if self._ordered == STOP:
                    self._cars.order(STOP)
                self._finder = Finder(self._cars)
                await self._resources.enter_async_context(self._cars)
                await self._resources.enter_async_context(self._finder.looking())
                self._is_looking = True
        try:
            yield
        finally:
            self._pages -= 1
            while not self._pages and self._loads:
                # A page that is loaded anew finds its uploads at their end; until then it sees the cars and stops them.
                await asyncio.wait(self._loads)
            async with self._lock:
                if not self._pages and self._is_looking:
                    self._is_looking = False
                    await self._resources.aclose()

    def _shown(self) -> CarsShown:
        return CarsShown(
            [self._row(status) for status in self._cars.statuses()],
            [f"{place.name} ({place.address})" for place in self._finder.others.values()],
            _sentence(self._finder.problem),
        )

    def _row(self, status: CarStatus) -> CarRow:
        row = status._asdict() | {
            "silent_s": None,
            "program": self._programs.get(status.crc32 or "", ""),
            "problem": _sentence(status.problem),
            "sent": self._sent.get(status.where),
            "holds": "",
            "error": None,
        }
        # The seconds of a car that answers would make each picture of the list a new one.
        if status.away and status.silent_s is not None:
            row["silent_s"] = round(status.silent_s)
        if verdict := self._verdicts.get(status.where):
            row["holds"] = verdict.holds
            row["error"] = _sentence(verdict.error)
        return CarRow(**row)


def _sentence(problem: MotorcadeError | None) -> Sentence | None:
    return problem.to_dict("page")["sentence"] if problem else None
