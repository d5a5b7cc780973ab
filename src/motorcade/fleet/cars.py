"""Many cars: all are asked, loaded, stopped and let go side by side; nobody waits for those that are away."""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from typing import Self

from motorcade.errors import MotorcadeError
from motorcade.fleet.contact import CarStatus, Contact, ContactOptions, DriveContact, Verdict
from motorcade.fleet.places import DRIVE, Place, check_name, safe_name
from motorcade.upload.transfer import NEW
from motorcade.words.request import BLINK, GO, NAME, STOP

# How many places are kept; announcements of a hostile host fill no more.
MOST_CARS = 2048
# So many cars are loaded at once; more doesn't pay (`benchmarks/room.py`).
_AT_ONCE = 64
_LOOK_S = 0.02
ALL = "all"


class Cars:
    """The cars at many places, connected while the block runs: ``async with Cars(places) as cars: ...``.

    Args:
        places: where cars are known to be; `add` takes more.
        options: how they are reached.
    """

    def __init__(self, places: Iterable[Place] = (), options: ContactOptions = ContactOptions()) -> None:  # noqa: B008 - it never changes
        self._options = options
        self._places = list(places)
        self._contacts: dict[str, Contact] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    async def __aenter__(self) -> Self:
        for place in self._places:
            self.add(place)
        return self

    async def __aexit__(self, *_: object) -> None:
        for task in self._tasks.values():
            task.cancel()
        await asyncio.gather(*self._tasks.values(), return_exceptions=True)

    def add(self, place: Place) -> None:
        """Ask also at ``place``; at most `MOST_CARS` places are kept."""
        if place.address not in self._contacts and len(self._contacts) < MOST_CARS:
            contact = (DriveContact if place.kind == DRIVE else Contact)(place, self._options)
            self._contacts[place.address] = contact
            self._tasks[place.address] = asyncio.create_task(contact.run())

    def remove(self, address: str) -> None:
        """Forget a place, such as a serial port that was unplugged."""
        if self._contacts.pop(address, None):
            self._tasks.pop(address).cancel()

    def statuses(self) -> list[CarStatus]:
        """Return what is known of each car, by name; ports at which there is no car are left out."""
        found = [each.status() for each in self._contacts.values()]
        kept = [each for each in found if not (each.problem and each.problem.code == "no-car-at-port")]
        return sorted(kept, key=lambda each: (each.name, each.where))

    async def known(self, within_s: float) -> None:
        """Wait until each car has answered or failed once, at most ``within_s``."""
        await self._until(lambda: all(each.is_known.is_set() for each in self._contacts.values()), within_s)

    async def confirmed(self, within_s: float) -> list[str]:
        """Wait until each car has confirmed the last stop or go, at most ``within_s``; return those that haven't."""
        await self._until(lambda: not any(each.wanted for each in self._contacts.values()), within_s)
        return sorted(each.name for each in self._contacts.values() if each.wanted)

    def named(self, names: Sequence[str]) -> list[Contact]:
        """Return the cars of these names or addresses; ``all`` is every car that takes programs.

        Raises MotorcadeError: nobody has a name, or two cars have it.
        """
        if ALL in names:
            return [each for each in self._contacts.values() if each.place.kind != DRIVE]
        return [self._named(name) for name in dict.fromkeys(names)]

    def _named(self, name: str) -> Contact:
        # What somebody wrote counts before what a car, maybe a stranger's, says.
        contacts = self._contacts.values()
        found = [each for each in contacts if name in (each.place.address, each.place.name)]
        found = found or [each for each in contacts if name == each.name]
        if not found:
            raise MotorcadeError("no-such-car", car=safe_name(name))
        if len(found) > 1:
            where = ", ".join(sorted(each.place.address for each in found))
            raise MotorcadeError("name-of-two-cars", car=safe_name(name), list=where)
        return found[0]

    def stop(self, only_new: bool = False) -> None:
        """Stop all cars at once; those that are away get it first when they are back.

        ``only_new`` stops those alone that were found since.
        """
        self._order(STOP, only_new)

    def go(self, only_new: bool = False) -> None:
        """Let all cars go: each begins its program; arguments as of `stop`."""
        self._order(GO, only_new)

    def _order(self, kind: str, only_new: bool) -> None:
        for contact in self._contacts.values():
            if not only_new or contact.ordered != kind:
                contact.order(kind)

    async def blink(self, names: Sequence[str]) -> None:
        """Make cars blink for 5 s. Raises MotorcadeError for the first that doesn't."""
        asked = [each.ask(BLINK) for each in self.named(names)]
        for result in await asyncio.gather(*asked, return_exceptions=True):
            if isinstance(result, BaseException):
                raise result

    async def rename(self, name: str, new: str) -> None:
        """Give a car a new name, which it keeps. Raises MotorcadeError."""
        check_name(new)
        await self._named(name).ask(NAME, new)

    async def load(
        self,
        image: bytes,
        names: Sequence[str],
        progress: Callable[[Contact, int], None] = lambda contact, sent: None,
        skips: str = "",
    ) -> list[Verdict]:
        """Upload an image to cars side by side. Returns a verdict for each.

        Args:
            image: its bytes.
            names: of cars, or ``all``.
            progress: called with a car and the number of bytes sent to it so far.
            skips: cars that hold an image with this CRC-32 have it already.
        """
        free = asyncio.Semaphore(_AT_ONCE)

        async def load(contact: Contact) -> Verdict:
            status = contact.status()
            if status.away:
                return await contact.load(image, progress)
            if skips and status.crc32 == skips:
                return Verdict(status.name, status.where, NEW, None)
            async with free:
                return await contact.load(image, progress)

        return list(await asyncio.gather(*map(load, self.named(names))))

    async def _until(self, condition: Callable[[], bool], within_s: float) -> None:
        end_s = self._options.now_s() + within_s
        while not condition() and self._options.now_s() < end_s:
            await asyncio.sleep(_LOOK_S)
