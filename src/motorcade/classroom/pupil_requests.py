"""What pupils' pages ask for: joining, the hand, the draft, gifts, and places in queues."""

from collections.abc import Awaitable, Callable
from typing import Any

import msgspec
from starlette.requests import HTTPConnection
from starlette.responses import Response

from motorcade.classroom import messages
from motorcade.classroom.folder import DRAFT
from motorcade.classroom.messages import AVATARS, Classmate, Self
from motorcade.classroom.passwords import digest
from motorcade.classroom.record import Pupil
from motorcade.classroom.running_class import RunningClass
from motorcade.classroom.shared_mat import SharedMat
from motorcade.classroom.views import classmates
from motorcade.errors import MotorcadeError
from motorcade.service.messages import Nothing, decode
from motorcade.service.missions import Mission, open_mission
from motorcade.timing import RateLimit, to_ticks

_GIFTS_A_MINUTE = 10


# Answers a request: who asks, the message, and the response whose cookies it may set.
Method = Callable[[HTTPConnection, Any, Response], Awaitable[Any]]


def method_for(requests: object, name: str) -> Method:
    """The method of an object that answers a request: for ``draft/write`` that is ``on_draft_write``."""
    found: Method = getattr(requests, f"on_{name.replace('/', '_').replace('-', '_')}")
    return found


class PupilRequests:
    """Answers `motorcade.classroom.messages.PUPIL_REQUESTS`."""

    def __init__(self, running: RunningClass, mat: SharedMat) -> None:
        self._running = running
        self._room = running.room
        self._mat = mat
        self._gifts: dict[str, RateLimit] = {}

    def _pupil(self, connection: HTTPConnection) -> Pupil:
        pupil = self._running.pupil(connection)
        if pupil is None:
            raise MotorcadeError("class-session-needed")
        return pupil

    # Everybody.

    async def on_about(self, asks: HTTPConnection, message: Nothing, response: Response) -> messages.ClassAbout:
        """What everybody may know."""
        pupil, record = self._running.pupil(asks), self._room.record
        return messages.ClassAbout(
            me=self._room.self_of(pupil) if pupil else None,
            teacher=self._running.is_teacher(asks),
            is_open=record.is_open,
            avatars=list(AVATARS),
            title=record.title,
        )

    async def on_check_code(self, asks: HTTPConnection, message: messages.ClassCode, response: Response) -> Nothing:
        """Check the code before the nickname is asked for."""
        self._check_code(asks, message.code)
        return Nothing()

    async def on_join(self, asks: HTTPConnection, message: messages.Joining, response: Response) -> Self:
        """Let a newcomer in."""
        self._check_code(asks, message.code)
        secret = self._running.new_secret()
        who, now_s = self._running.guesser(asks), self._running.now_s()
        pupil = self._room.join(message.name, message.avatar, digest(secret), now_s, who)
        return self._let_in(asks, pupil, secret, response)

    async def on_return(self, asks: HTTPConnection, message: messages.Returning, response: Response) -> Self:
        """Let a pupil in at another device."""
        self._check_code(asks, message.code)
        secret, who, now_s = self._running.new_secret(), self._running.guesser(asks), self._running.now_s()
        pupil = self._room.come_back(message.name, message.number, digest(secret), who, now_s)
        return self._let_in(asks, pupil, secret, response)

    async def on_leave(self, asks: HTTPConnection, message: Nothing, response: Response) -> Nothing:
        """Sign the device out."""
        self._running.forget(response, asks)
        return Nothing()

    def _check_code(self, asks: HTTPConnection, code: str) -> None:
        self._room.check_code(code, self._running.guesser(asks), self._running.now_s())

    def _let_in(self, asks: HTTPConnection, pupil: Pupil, secret: str, response: Response) -> Self:
        self._running.remember(response, asks, secret)
        return self._room.self_of(pupil)

    # Pupils.

    async def on_hand(self, asks: HTTPConnection, message: messages.Hand, response: Response) -> Nothing:
        """Raise the hand, or lower it."""
        self._room.raise_hand(self._pupil(asks).id, message.raised, self._running.now_s())
        return Nothing()

    async def on_seen(self, asks: HTTPConnection, message: messages.Seen, response: Response) -> Nothing:
        """Forget news."""
        self._room.seen(self._pupil(asks), message.number)
        return Nothing()

    async def on_draft_read(self, asks: HTTPConnection, message: Nothing, response: Response) -> messages.StoredDraft:
        """The draft of who asks, also the teacher's."""
        return await stored_draft(self._running, self._running.visitor(asks))

    async def on_draft_write(self, asks: HTTPConnection, message: messages.Draft, response: Response) -> Nothing:
        """Store the draft."""
        owner, data = self._running.visitor(asks), msgspec.json.encode(message)
        await self._running.with_files(self._running.folder.write_draft, owner, data)
        return Nothing()

    async def on_classmates(self, asks: HTTPConnection, message: Nothing, response: Response) -> list[Classmate]:
        """The other pupils."""
        return classmates(self._room, self._pupil(asks))

    async def on_give(self, asks: HTTPConnection, message: messages.Gift, response: Response) -> messages.Copied:
        """Put a copy of an own project into another's shelf."""
        giver, taker = self._pupil(asks), self._room.pupil(message.to)
        rate = self._gifts.setdefault(giver.id, RateLimit(_GIFTS_A_MINUTE, 60_000))
        if not rate.allows(to_ticks(self._running.now_s())):
            raise MotorcadeError("gives-too-often", most=_GIFTS_A_MINUTE)
        folder = self._running.folder
        data = await self._running.with_files(folder.read, giver.id, message.name)
        name = await self._running.with_files(folder.copy, data, taker.id, message.name, giver.name)
        self._room.tell(taker, "project", name, giver.name)
        return messages.Copied(name)

    async def on_mission(self, asks: HTTPConnection, message: messages.HandedMission, response: Response) -> Mission:
        """A mission that was handed out."""
        owner = self._pupil(asks).id
        choice = self._room.handed_mission(message.number)
        stars = await self._running.with_files(self._running.folder.stars, owner)
        return open_mission(choice, stars)

    async def on_cable(self, asks: HTTPConnection, message: messages.CableWish, response: Response) -> Nothing:
        """Stand in the queue for the cable, or leave it."""
        self._room.wish_cable(self._pupil(asks).id, message.wants)
        return Nothing()

    async def on_turn(self, asks: HTTPConnection, message: messages.TurnWish, response: Response) -> Nothing:
        """Stand in the queue for a car, or leave it."""
        self._room.wish_turn(self._pupil(asks).id, message.car, message.wants, self._running.now_s())
        return Nothing()

    async def on_mat(self, asks: HTTPConnection, message: messages.MatEntry, response: Response) -> Nothing:
        """Send a program to the shared mat, or take it off."""
        self._mat.enter(self._pupil(asks).id, message.image)
        self._room.changes += 1
        return Nothing()


async def stored_draft(running: RunningClass, owner: str) -> messages.StoredDraft:
    """The draft of an owner. Raises MotorcadeError where it is damaged."""
    found = await running.with_files(running.folder.read_draft, owner)
    if found is None:
        return messages.StoredDraft("", None, "")
    data, saved_at = found
    try:
        draft = decode(data, messages.Draft)
    except MotorcadeError:
        raise MotorcadeError("damaged-version", name=DRAFT) from None
    return messages.StoredDraft(draft.name, draft.project, saved_at)
