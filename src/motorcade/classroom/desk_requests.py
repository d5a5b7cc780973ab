"""What the teacher's desk asks for."""

import os
import secrets

from anyio import to_thread
from msgspec import structs
from starlette.requests import HTTPConnection
from starlette.responses import Response

from motorcade.classroom import desk_messages as messages
from motorcade.classroom.classroom import SIGNED_IN_S
from motorcade.classroom.messages import Self, TurnWish
from motorcade.classroom.network import join_url, qr_svg
from motorcade.classroom.passwords import check_password, digest, is_password, to_stored
from motorcade.classroom.pupil_requests import stored_draft
from motorcade.classroom.running_class import TEACHER, RunningClass
from motorcade.classroom.shared_mat import SharedMat
from motorcade.classroom.visitors import EmergencyStop
from motorcade.errors import MotorcadeError
from motorcade.server.remote.fleet import Fleet
from motorcade.server.studio.sessions import PageWorlds
from motorcade.service.documents import open_text, project_text
from motorcade.service.messages import Nothing, Project, StoredProject, sentences
from motorcade.service.missions import chosen_mission, list_missions

_SALT_BYTES = 16
_SEED_BELOW = 1 << 32


class DeskRequests:
    """Answers `motorcade.classroom.desk_messages.DESK_REQUESTS`; who may ask was checked before.

    Args:
        running: the class.
        worlds: the pupils' worlds.
        mat: the shared mat.
        cars: the real cars; None where there are none.
    """

    def __init__(self, running: RunningClass, worlds: PageWorlds, mat: SharedMat, cars: Fleet | None) -> None:
        self._running = running
        self._room = running.room
        self._folder = running.folder
        self._worlds = worlds
        self._mat = mat
        self._stop = EmergencyStop(cars) if cars else None

    # Everybody.

    async def on_about(self, asks: HTTPConnection, message: Nothing, response: Response) -> messages.DeskAbout:
        """Whether there is a password, and whether this browser is signed in."""
        return messages.DeskAbout(self._room.record.password is not None, self._running.is_teacher(asks))

    async def on_first_password(
        self, asks: HTTPConnection, message: messages.FirstPassword, response: Response
    ) -> Nothing:
        """Set the password with the key that the command has printed, and sign in."""
        who, now_s = self._running.guesser(asks), self._running.now_s()
        self._room.check_password_attempts(who, now_s)
        key = self._running.first_key
        if key is None or not secrets.compare_digest(message.key.encode(), key.encode()):
            raise self._room.refuse_password(who, now_s, "wrong-first-key")
        check_password(message.password)
        salt = os.urandom(_SALT_BYTES)
        self._room.set_password(await to_thread.run_sync(to_stored, message.password, salt))
        await self._running.settle()
        # It works once.
        self._running.first_key = None
        self._sign_in(asks, response)
        return Nothing()

    async def on_sign_in(self, asks: HTTPConnection, message: messages.Password, response: Response) -> Nothing:
        """Sign in."""
        await self._check_password(asks, message.password)
        self._sign_in(asks, response)
        return Nothing()

    def _sign_in(self, asks: HTTPConnection, response: Response) -> None:
        secret = self._running.new_secret()
        self._room.sign_in(digest(secret), self._running.settings.unix_s() + SIGNED_IN_S)
        self._running.remember(response, asks, secret, teacher=True)

    async def _check_password(self, asks: HTTPConnection, password: str) -> None:
        """Raise MotorcadeError unless it is the password; one after the other, as each takes memory and time."""
        who, now_s = self._running.guesser(asks), self._running.now_s()
        self._room.check_password_attempts(who, now_s)
        async with self._running.hashing:
            self._room.check_password_attempts(who, now_s)
            stored = self._room.record.password or ""
            if not await to_thread.run_sync(is_password, password, stored):
                raise self._room.refuse_password(who, now_s)

    # The teacher.

    async def on_sign_out(self, asks: HTTPConnection, message: Nothing, response: Response) -> Nothing:
        """Sign this browser out."""
        self._running.forget(response, asks, teacher=True)
        return Nothing()

    async def on_addresses(self, asks: HTTPConnection, message: Nothing, response: Response) -> messages.ClassAddresses:
        """How pupils find the class."""
        network, code = self._running.settings.network, self._room.record.code
        why = sentences(network.why_no_name) if network.why_no_name else None
        picture = qr_svg(join_url(network.addresses[0], code))
        return messages.ClassAddresses(code, list(network.addresses), network.local_name, why, picture)

    async def on_choose_address(
        self, asks: HTTPConnection, message: messages.ChosenAddress, response: Response
    ) -> messages.ClassAddresses:
        """Show another of the addresses first."""
        self._running.settings.network.choose(message.address)
        return await self.on_addresses(asks, Nothing(), response)

    async def on_new_code(self, asks: HTTPConnection, message: Nothing, response: Response) -> messages.ClassAddresses:
        """Make a new code."""
        self._room.change_code()
        return await self.on_addresses(asks, message, response)

    async def on_settings(self, asks: HTTPConnection, message: messages.ClassSettings, response: Response) -> Nothing:
        """Change settings."""
        self._room.set(message)
        return Nothing()

    async def on_freeze(self, asks: HTTPConnection, message: messages.Frozen, response: Response) -> Nothing:
        """Freeze all pupils' pages, or thaw them."""
        self._room.freeze(message.frozen)
        if message.frozen:
            self._running.show_changes()
            await self._worlds.pause_all(lambda visitor: visitor != TEACHER)
        return Nothing()

    async def on_lower_hand(self, asks: HTTPConnection, message: messages.PupilId, response: Response) -> Nothing:
        """Lower a pupil's hand."""
        self._room.raise_hand(message.pupil, False, self._running.now_s())
        return Nothing()

    async def on_rename(self, asks: HTTPConnection, message: messages.Renaming, response: Response) -> Nothing:
        """Give a pupil another name."""
        self._room.rename(message.pupil, message.name)
        return Nothing()

    async def on_reset_number(self, asks: HTTPConnection, message: messages.PupilId, response: Response) -> Self:
        """Give a pupil another number."""
        return self._room.self_of(self._room.reset_number(message.pupil))

    async def on_remove(self, asks: HTTPConnection, message: messages.PupilId, response: Response) -> Nothing:
        """Remove a pupil, and the shelf."""
        self._room.remove(message.pupil)
        await self._delete_shelves()
        return Nothing()

    async def _delete_shelves(self) -> None:
        """Delete the shelves of all who are out. They are out also where that isn't possible."""
        await self._running.settle()
        for owner in list(self._room.record.removed):
            self._mat.leave(owner)
            self._worlds.end(owner, MotorcadeError("class-session-needed"))
        await self._running.delete_shelves()

    async def on_hand_out(
        self, asks: HTTPConnection, message: messages.HandOut, response: Response
    ) -> messages.HandedOut:
        """Give pupils a project or a mission."""
        if message.mission:
            title = chosen_mission(message.mission).name.sentence("en")
            return messages.HandedOut(self._room.hand_out_mission(message.to, message.mission, title))
        pupils = self._room.chosen(message.to)
        if message.project:
            data = project_text(message.project).encode()
        else:
            data = await self._running.with_files(self._folder.read, TEACHER, message.name)
        missed, why = [], None
        for pupil in pupils:
            try:
                name = await self._running.with_files(self._folder.copy, data, pupil.id, message.name)
            except MotorcadeError as problem:
                missed.append(pupil.id)
                why = problem
            else:
                self._room.tell(pupil, "project", name, "")
        if why and len(missed) == len(pupils):
            raise why
        return messages.HandedOut(len(pupils) - len(missed), missed)

    async def on_shelf(
        self, asks: HTTPConnection, message: messages.PupilId, response: Response
    ) -> messages.PupilShelf:
        """A pupil's projects."""
        pupil = self._room.pupil(message.pupil)
        projects = await self._running.with_files(self._folder.list, pupil.id)
        return messages.PupilShelf(
            pupil.name, projects, await self._running.with_files(self._folder.draft_at, pupil.id)
        )

    async def on_project(
        self, asks: HTTPConnection, message: messages.PupilProject, response: Response
    ) -> StoredProject:
        """A project of a pupil, or the draft."""
        owner = self._room.pupil(message.pupil).id
        if not message.name:
            draft = await stored_draft(self._running, owner)
            if draft.project is None:
                raise MotorcadeError("no-project", name="")
            return to_stored_project(draft.project, draft.name)
        text = await self._running.with_files(self._folder.read, owner, message.name)
        return to_stored_project(open_text(text), message.name)

    async def on_progress(self, asks: HTTPConnection, message: Nothing, response: Response) -> messages.ClassProgress:
        """The missions, and what each pupil has earned."""
        found = [messages.MissionStars(each.id, each.name, each.stars) for each in list_missions({})]
        pupils = [
            messages.PupilStars(pupil.id, await self._running.with_files(self._folder.stars, pupil.id))
            for pupil in list(self._room.record.pupils)
        ]
        return messages.ClassProgress(found, pupils)

    async def on_cable_next(self, asks: HTTPConnection, message: Nothing, response: Response) -> Nothing:
        """The next one gets the cable."""
        self._room.next_at_cable()
        return Nothing()

    async def on_turn_next(self, asks: HTTPConnection, message: TurnWish, response: Response) -> Nothing:
        """End a turn at a car."""
        self._room.next_turn(message.car, self._running.now_s())
        return Nothing()

    async def on_stop_all(self, asks: HTTPConnection, message: Nothing, response: Response) -> messages.StoppedAll:
        """Stop all real cars; no pupil drives until they are released."""
        self._room.stop_cars(True)
        self._running.show_changes()
        return messages.StoppedAll(await self._stop.stop() if self._stop else [])

    async def on_release_all(self, asks: HTTPConnection, message: Nothing, response: Response) -> Nothing:
        """Let pupils drive again."""
        if self._stop:
            await self._stop.release()
        self._room.stop_cars(False)
        return Nothing()

    async def on_mat_open(self, asks: HTTPConnection, message: messages.OpenMat, response: Response) -> Nothing:
        """Collect programs for the shared mat."""
        self._mat.open(message)
        self._room.changes += 1
        return Nothing()

    async def on_mat_start(self, asks: HTTPConnection, message: Nothing, response: Response) -> Nothing:
        """Start all programs on the shared mat."""
        await self._mat.start(secrets.randbelow(_SEED_BELOW))
        self._room.changes += 1
        return Nothing()

    async def on_mat_close(self, asks: HTTPConnection, message: Nothing, response: Response) -> Nothing:
        """Clear the shared mat."""
        self._mat.close()
        self._room.changes += 1
        return Nothing()

    async def on_end(self, asks: HTTPConnection, message: messages.Password, response: Response) -> Nothing:
        """End the class: pupils, their names and their work are deleted."""
        await self._check_password(asks, message.password)
        self._room.end()
        self._mat.close()
        await self._delete_shelves()
        return Nothing()


def to_stored_project(project: Project, name: str) -> StoredProject:
    """A project with its name."""
    return StoredProject(**{**structs.asdict(project), "name": name})
