"""Answer the requests of a class that need its folder, cookies, worlds or cars; `Classroom` answers the others."""

import os
import secrets
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from typing import Annotated, NamedTuple

import msgspec
from anyio import to_thread
from msgspec import Meta, structs
from starlette.requests import HTTPConnection
from starlette.responses import Response

from motorcade.classroom import messages
from motorcade.classroom.messages import Id, Secret, Self, Text40, Window, request
from motorcade.classroom.names import check_password, digest, is_password, to_stored
from motorcade.classroom.network import join_url, qr_svg
from motorcade.classroom.record import MISSION, TEACHER, WINDOWS, Pair, Pupil, mend
from motorcade.classroom.room import SIGNED_IN_S
from motorcade.classroom.running import EmergencyStop, RunningClass
from motorcade.errors import MotorcadeError
from motorcade.server.studio.cars import CarList
from motorcade.server.studio.sessions import PageWorlds
from motorcade.service.documents import open_text, project_text
from motorcade.service.library import allowed_name
from motorcade.service.messages import MissionChoice, Project, StoredProject, decode, sentences
from motorcade.service.missions import Mission, chosen_mission, list_missions, open_mission
from motorcade.timing import Attempts
from motorcade.words.request import GO, STOP

_SALT_BYTES = 16
_SECRET_BYTES = 24
_GIFTS_A_MINUTE = 10


class Asks(NamedTuple):
    """A request, and the response whose cookies the answer may set."""

    connection: HTTPConnection
    response: Response


class Handlers:
    """The methods that answer; who may ask was checked before.

    Args:
        running: the class.
        worlds: the pupils' worlds.
        stop: of the cars that are driven.
        programmed: the cars that run programs.
    """

    def __init__(self, running: RunningClass, worlds: PageWorlds, stop: EmergencyStop, programmed: CarList) -> None:
        self._running = running
        self._worlds = worlds
        self._stop = stop
        self._programmed = programmed
        self._room = running.room
        self._pairs = running.pairs
        self._folder = running.folder
        self._gifts = Attempts(_GIFTS_A_MINUTE, 60.0, "gives-too-often")

    # Everybody who comes in.

    @request("class/about", is_open=True)
    def about(self, asks: Asks) -> messages.ClassAbout:
        """Return what everybody may know."""
        pupil = self._running.pupil(asks.connection)
        record = self._room.record
        me = None
        if pupil:
            me = self._room.self_of(pupil)
        return messages.ClassAbout(me, record.is_open, list(messages.AVATARS), record.title)

    @request("class/join", is_open=True, stores=True)
    def join(self, asks: Asks, client: str, code: Text40, name: Text40, avatar: Text40, now_s: float) -> Self:
        """Let a newcomer in, with a nickname and one of the avatars."""
        self._room.check_code(code, client, now_s)
        return self._let_in(asks, lambda device: self._room.join(name, avatar, device, client, now_s))

    @request("class/return", is_open=True, stores=True)
    def come_back(self, asks: Asks, client: str, code: Text40, name: Text40, number: Text40, now_s: float) -> Self:
        """Let a pupil in at another device, with the personal number."""
        self._room.check_code(code, client, now_s)
        return self._let_in(asks, lambda device: self._room.come_back(name, number, device, client, now_s))

    def _let_in(self, asks: Asks, enter: Callable[[str], Pupil]) -> Self:
        secret = secrets.token_urlsafe(_SECRET_BYTES)
        pupil = enter(digest(secret))
        self._running.remember(asks.response, asks.connection, secret)
        return self._room.self_of(pupil)

    # Who leaves is out at once: that is stored as soon as it can be.

    @request("class/leave", is_open=True)
    def leave(self, asks: Asks) -> None:
        """Sign the pupil's device out."""
        self._running.forget(asks.response, asks.connection)

    @request("teacher/about", is_open=True)
    def about_teacher(self, asks: Asks) -> messages.TeacherAbout:
        """Return whether there is a password, and whether this browser is signed in."""
        return messages.TeacherAbout(self._room.record.password is not None, self._running.is_teacher(asks.connection))

    @request("teacher/first-password", is_open=True, stores=True)
    async def set_first_password(self, asks: Asks, client: str, key: Secret, password: Secret, now_s: float) -> None:
        """Set the password, and sign in; ``key`` stands behind ``/teacher#`` in the address that the command prints."""
        running = self._running
        # One after the other: another request may have the same key.
        async with running.hashing:
            self._room.of_an_address.check(client, now_s)
            first_key = running.first_key
            if first_key is None or not secrets.compare_digest(key.encode(), first_key.encode()):
                raise self._room.refuse(client, now_s, MotorcadeError("wrong-first-key"))
            check_password(password)
            stored = await to_thread.run_sync(to_stored, password, os.urandom(_SALT_BYTES))
            self._room.set_password(stored)
            await running.settle()
            # It works once.
            running.first_key = None
            self._sign_in(asks)

    @request("teacher/sign-in", is_open=True)
    async def sign_in(self, asks: Asks, client: str, password: Secret, now_s: float) -> None:
        """Sign the teacher in."""
        await self._check_password(client, password, now_s)
        self._sign_in(asks)

    def _sign_in(self, asks: Asks) -> None:
        secret = secrets.token_urlsafe(_SECRET_BYTES)
        self._room.sign_in(digest(secret), self._running.unix_s() + SIGNED_IN_S)
        self._running.remember(asks.response, asks.connection, secret, teacher=True)

    async def _check_password(self, client: str, password: str, now_s: float) -> None:
        """Raise MotorcadeError unless it is the password; one after the other, as each takes memory and time."""
        async with self._running.hashing:
            self._room.of_an_address.check(client, now_s)
            stored = self._room.record.password or ""
            is_right = await to_thread.run_sync(is_password, password, stored)
            # A password that was replaced meanwhile opens nothing any more.
            if not is_right or stored != self._room.record.password:
                raise self._room.refuse(client, now_s, MotorcadeError("wrong-password"))

    # Pupils.

    @request("class/draft/read")
    async def read_draft(self, who: str) -> messages.StoredDraft:
        """Return the draft of who asks, also the teacher's. Raises MotorcadeError where it is damaged."""
        return await to_thread.run_sync(self._folder.read_draft, who) or messages.StoredDraft("", None, "", "")

    @request("class/draft/write")
    async def write_draft(
        self, who: str, name: Text40, project: Project, place: Text40 = "", mission: MissionChoice | None = None
    ) -> None:
        """Store the draft of who asks, with the mission that it is for."""
        data = msgspec.json.encode(messages.Draft(name, project, place, mission))
        await to_thread.run_sync(self._folder.write_draft, who, data)

    @request("class/give", stores=True)
    async def give(self, who: str, to: Id, name: Text40, now_s: float) -> str:
        """Put a copy of an own project into a classmate's library; return its name there."""
        self._room.pupil(to)
        self._gifts.count(who, now_s)
        data = await to_thread.run_sync(self._folder.read, who, name)
        giver = self._room.pupil(who)
        taker = self._room.pupil(to)
        copied = await to_thread.run_sync(self._folder.copy, data, taker.id, name, giver.name)
        self._room.tell(taker, "project", copied, giver.name)
        return copied

    @request("class/mission")
    async def open_handed(self, who: str, number: int) -> Mission:
        """Return a mission that was handed out; ``number`` as in `PupilView.mission`."""
        stars = await to_thread.run_sync(self._folder.stars, who)
        return open_mission(self._room.handed_mission(number), stars)

    @request("class/mat")
    def enter_mat(self, who: str, image: bytes | None) -> None:
        """Send a program to the shared mat; None takes the own cars off it."""
        self._running.mat.enter(self._room.pupil(who).id, image)

    # Two who program one project.

    @request("class/pair/begin", stores=True)
    async def begin_pair(
        self,
        who: str,
        to: Id,
        name: Text40,
        project: Project,
        now_s: float,
        mission: MissionChoice | None = None,
    ) -> None:
        """Begin a pair with the open project, or ask another one into it, where the project of before stays.

        Args:
            who: begins it.
            to: is asked.
            name: of the project.
            project: the leader's window gets its mat and the leader's program, the other one the followers' program.
            now_s: the time.
            mission: what the project is played for; each page reads it for itself. None for none.
        """
        self._gifts.count(who, now_s)
        if pair := self._pairs.to_ask(who, to):
            self._pairs.begin(who, to, pair)
        else:
            async with self._stored(name, project, mission) as new:
                self._pairs.begin(who, to, new)

    @request("class/pair/open", stores=True)
    async def open_in_pair(self, who: str, pair: Id, name: Text40, project: Project, mission: MissionChoice) -> None:
        """Go on with another mission together, in place of what a pair has open; windows stay whose they are.

        Raises MotorcadeError where the other one has gone on meanwhile.
        """
        self._pairs.joined(who, pair)
        async with self._stored(name, project, mission) as new:
            self._pairs.go_on(who, pair, new)
        with suppress(MotorcadeError):
            await self._delete_libraries()

    @asynccontextmanager
    async def _stored(self, name: str, project: Project, mission: MissionChoice | None) -> AsyncIterator[Pair]:
        """Store what a pair opens; yield the pair, in which nobody is yet. Without anybody behind the block it ends."""
        pair = self._pairs.add(name)
        number = pair.id
        try:
            # Files are stored for those alone whom the class's file knows.
            await self._running.settle()
            if mission:
                data = msgspec.json.encode(mission)
                await to_thread.run_sync(self._folder.write_version, pair.library, MISSION, data)
            data = project_text(project).encode()
            for window in WINDOWS:
                self._pairs.versions[pair.id, window] = await to_thread.run_sync(
                    self._folder.write_version, pair.library, window, data
                )
            yield pair
        finally:
            self._room.part(lambda record: mend(record, number))

    @request("class/pair/read")
    async def read_window(self, who: str, window: Window) -> messages.PairProject:
        """Return what a window holds: the leader's blocks with mat, profile and mission, or the followers' blocks."""
        pair = self._pairs.joined(who)
        history = await to_thread.run_sync(self._folder.history, pair.library, window)
        data = await to_thread.run_sync(self._folder.read, pair.library, window, history[0].version)
        held = messages.PairProject(open_text(data), history[0].version)
        if window == "leader":
            held.mission = await to_thread.run_sync(self._mission_of, pair)
        return held

    def _mission_of(self, pair: Pair) -> MissionChoice | None:
        if MISSION not in {entry.name for entry in self._folder.list(pair.library)}:
            return None
        return decode(self._folder.read(pair.library, MISSION), MissionChoice)

    @request("class/pair/write", stores=True)
    async def write_window(self, who: str, pair: Id, window: Window, project: Project, base: int) -> int:
        """Store a window of one's own; return its version.

        Raises MotorcadeError where it is another's, was stored since version ``base``, or the pair has gone on.
        """
        data = project_text(project).encode()

        def store() -> int:
            # Asked when the thread's turn has come: meanwhile the window may be another's.
            library = self._pairs.owned(who, pair, window).library
            return self._folder.write_version(library, window, data, base)

        version = await to_thread.run_sync(store)
        self._pairs.versions[pair, window] = version
        self._room.changes += 1
        return version

    @request("class/pair/leave")
    async def leave_pair(self, who: str) -> str:
        """Leave the pair; return the name of the copy of the whole project in the own library.

        It is "" for none: who was only asked gets none, and where it can't be stored the page has the project.
        """
        pair = self._pairs.of(who)
        copied = ""
        try:
            if pair and who in pair.joined:
                copied = await to_thread.run_sync(self._copy_of_pair, pair, who)
        except MotorcadeError:
            pass
        finally:
            if pair:
                self._pairs.leave(who, pair.id)
        with suppress(MotorcadeError):
            await self._delete_libraries()
        return copied

    def _copy_of_pair(self, pair: Pair, who: str) -> str:
        leader, followers = (open_text(self._folder.read(pair.library, window)) for window in WINDOWS)
        whole = project_text(structs.replace(leader, followers=followers.followers))
        return self._folder.copy(whole.encode(), who, allowed_name(pair.name))

    # The teacher.

    @request("teacher/sign-out")
    def sign_out(self, asks: Asks) -> None:
        """Sign this browser out."""
        self._running.forget(asks.response, asks.connection, teacher=True)

    @request("teacher/addresses")
    def addresses(self) -> messages.ClassAddresses:
        """Return how pupils find the class."""
        network = self._running.settings.network
        code = self._room.record.code
        why = None
        if network.why_no_name:
            why = sentences(network.why_no_name)
        picture = qr_svg(join_url(network.addresses[0], code))
        return messages.ClassAddresses(code, list(network.addresses), network.local_name, why, picture)

    @request("teacher/choose-address")
    def choose_address(self, address: Annotated[str, Meta(max_length=80)]) -> messages.ClassAddresses:
        """Have the QR code lead to another of the addresses: tablets reach it."""
        self._running.settings.network.choose(address)
        return self.addresses()

    @request("teacher/new-code", stores=True)
    def new_code(self) -> messages.ClassAddresses:
        """Make a new code."""
        self._room.change_code()
        return self.addresses()

    @request("teacher/freeze")
    async def freeze(self, frozen: bool) -> None:
        """Freeze all pupils' pages and pause their worlds, or thaw the pages."""
        self._room.freeze(frozen)
        if frozen:
            self._running.show_changes()
            await self._worlds.pause_all(lambda visitor: visitor != TEACHER)

    @request("teacher/remove")
    async def remove(self, pupil: Id) -> None:
        """Remove a pupil, and the library."""
        self._room.remove(pupil)
        await self._delete_libraries()

    async def _delete_libraries(self) -> None:
        """Delete the libraries of all who are out. They are out also where that isn't possible."""
        running = self._running
        # A slow disk may take longer than the pages of who is out stay open.
        running.show_changes()
        for owner in self._room.record.removed:
            running.mat.leave(owner)
            self._worlds.end(owner, MotorcadeError("class-session-needed"))
        with suppress(MotorcadeError):
            await running.settle()
        # Where the disk is full, this makes room.
        await running.delete_libraries()

    @request("teacher/hand-out", stores=True)
    async def hand_out(
        self,
        to: list[Id] | None = None,
        name: Text40 = "",
        project: Project | None = None,
        mission: MissionChoice | None = None,
    ) -> messages.HandedOut:
        """Give pupils a mission, or a project: one of the teacher's library, or one that comes with the message.

        Args:
            to: the pupils; None for all, also those who join later (of the latter only a mission).
            name: the name of the project.
            project: None for the one of that name in the teacher's library.
            mission: instead of a project.
        """
        if mission:
            title = chosen_mission(mission).name.texts
            return messages.HandedOut(self._room.hand_out_mission(to, mission, title))
        pupils = self._room.chosen(to)
        if project:
            data = project_text(project).encode()
        else:
            data = await to_thread.run_sync(self._folder.read, TEACHER, name)
        missed = []
        for pupil in pupils:
            try:
                copied = await to_thread.run_sync(self._folder.copy, data, pupil.id, name)
                self._room.tell(pupil, "project", copied, "")
            except MotorcadeError:
                missed.append(pupil.id)
                if len(missed) == len(pupils):
                    raise
        return messages.HandedOut(len(pupils) - len(missed), missed)

    @request("teacher/library")
    async def library(self, pupil: Id) -> messages.PupilLibrary:
        """Return a pupil's projects."""
        found = self._room.pupil(pupil)
        projects = await to_thread.run_sync(self._folder.list, pupil)
        return messages.PupilLibrary(found.name, projects, await to_thread.run_sync(self._folder.draft_at, pupil))

    @request("teacher/project")
    async def project(self, pupil: Id, name: Text40) -> StoredProject:
        """Return a project of a pupil; an empty name is that of the draft."""
        owner = self._room.pupil(pupil).id
        if name:
            found: Project | None = open_text(await to_thread.run_sync(self._folder.read, owner, name))
        else:
            draft = await self.read_draft(owner)
            name = draft.name
            found = draft.project
        if found is None:
            raise MotorcadeError("no-draft")
        return StoredProject(**structs.asdict(found) | {"name": name})

    @request("teacher/progress")
    async def progress(self) -> messages.ClassProgress:
        """Return the missions, and what each pupil has earned."""
        found = [messages.MissionStars(mission.id, mission.name, mission.stars) for mission in list_missions({})]
        stars = {}
        for pupil in list(self._room.record.pupils):
            stars[pupil.id] = await to_thread.run_sync(self._folder.stars, pupil.id)
        return messages.ClassProgress(found, stars)

    @request("teacher/stop-all")
    async def stop_all(self) -> list[str]:
        """Stop all real cars; no pupil drives until they are released.

        Return the driven ones that could not be reached; the list of the others shows which have stopped.
        """
        self._room.stop_cars(True)
        self._running.show_changes()
        try:
            self._programmed.order(STOP)
        finally:
            missed = await self._stop.stop()
        return missed

    @request("teacher/release-all")
    async def release_all(self) -> None:
        """Let pupils drive again, and programs begin anew."""
        # Before anything is waited for: a stop that comes meanwhile holds.
        self._room.stop_cars(False)
        self._programmed.order(GO)
        await self._stop.release()

    @request("teacher/end")
    async def end(self, client: str, password: Secret, now_s: float) -> None:
        """End the class: pupils, their names and their work are deleted."""
        await self._check_password(client, password, now_s)
        self._room.end()
        self._running.mat.close()
        await self._delete_libraries()
