"""The state of a class: who is in it and who may come in, and what changes it. Without I/O.

Times are seconds of any clock that never goes back. What has to survive the server is in ``record``. Requests that need
nothing else are answered here.
"""

from collections.abc import Callable, Iterable, Sequence
from hmac import compare_digest
from typing import Annotated, TypeVar

from msgspec import Meta

from motorcade.classroom.messages import AVATARS, Classmate, Id, News, Self, Shared, Text40, request
from motorcade.classroom.names import RandomBelow, check_free, likeness, new_code, new_number, typed_code, typed_number
from motorcade.classroom.record import (
    ClassRecord,
    Presence,
    Pupil,
    SignIn,
    copied,
    from_bytes,
    mend,
    take_out,
    to_bytes,
)
from motorcade.errors import MotorcadeError
from motorcade.service.library import checked_user_name
from motorcade.service.messages import MissionChoice, Sentence
from motorcade.timing import Attempts

MOST_PUPILS = 120
# In ten minutes, of an address: who joins, and wrong codes, numbers and passwords. Twice a class behind one router.
MOST_OF_AN_ADDRESS = 60
# In five minutes, of a name: wrong numbers, from whatever addresses.
MOST_OF_A_NAME = 10
# The name of the cable among what pupils share; the others are those of real cars.
CABLE = ""
_MOST_DEVICES = 8
_MOST_NEWS = 20
_MOST_MISSIONS = 50
_MOST_SIGN_INS = 8
SIGNED_IN_S = 12 * 3600.0
_T = TypeVar("_T")


def for_all(records: Iterable[_T], act: Callable[[_T], None]) -> None:
    """Do something with each record; where that fails with some, do it with the others all the same.

    Raises ExceptionGroup, whose exceptions name their records.
    """
    problems: list[Exception] = []
    for record in list(records):
        try:
            act(record)
        except Exception as problem:  # noqa: BLE001  # one bad record keeps up no other
            problem.add_note(repr(record))
            problems.append(problem)
    if problems:
        raise ExceptionGroup("records of the class", problems)


class Classroom:
    """A class while its server runs.

    Args:
        record: what is stored of it.
        random_below: for codes and numbers.
        cars: the real cars that can be driven.
        now_s: the time.

    Attributes:
        kept: what the file holds, and so what a request that fails falls back to; who is out is out of it, too.
        revision: grows with each change that the file has to hold.
        changes: grows with each change that pages show.
        holders: who has the cable, and each real car; None while it is free.
        of_an_address, of_a_name: who has tried too often.
        presence: of each pupil, by id, what needn't survive the server.
        frozen: pupils' pages show nothing to work with.
        stopped: the teacher's emergency stop holds all real cars.
        cabled: something is at a port of this computer.
        ended: how many times the class was ended.
    """

    def __init__(
        self, record: ClassRecord, random_below: RandomBelow, cars: Iterable[str] = (), now_s: float = 0.0
    ) -> None:
        mend(record)
        self.record = record
        self.kept = copied(record)
        self.revision = self.changes = self.ended = 0
        self.frozen = self.stopped = self.cabled = False
        self.holders: dict[str, str | None] = dict.fromkeys((CABLE, *cars))
        self.presence = {pupil.id: Presence(left_s=now_s, step_s=now_s) for pupil in record.pupils}
        self._random_below = random_below
        # Who or what has gone since the last attempt to store the class.
        self._parted: list[Callable[[ClassRecord], None]] = []
        # The pupil of each device, as it was at a revision: each message of a page asks for it.
        self._by_device: dict[str, Pupil] = {}
        self._found_at = -1
        self.of_an_address = Attempts(MOST_OF_AN_ADDRESS, 600.0)
        self.of_a_name = Attempts(MOST_OF_A_NAME, 300.0)

    def restore(self) -> None:
        """Undo what has changed since the class was stored, except who is out, and who is signed in as the teacher.

        No number is given out again: what was begun under it may have left files.
        """
        stored = copied(self.kept)
        stored.sign_ins = self.record.sign_ins
        stored.joined = self.record.joined
        stored.paired = self.record.paired
        self.record = stored
        self.presence = {pupil.id: self.presence.get(pupil.id) or Presence() for pupil in stored.pupils}
        self._free_from(lambda holder: holder not in self.presence)
        self.save()

    def _free_from(self, is_out: Callable[[str | None], bool]) -> None:
        """Free what is shared from the holders who are out."""
        for name, holder in self.holders.items():
            if is_out(holder):
                self.holders[name] = None

    def part(self, change: Callable[[ClassRecord], None]) -> None:
        """Let somebody or something go, by ``change``: that stays so also where it can't be stored at present."""
        for record in (self.record, self.kept):
            change(record)
        self._parted.append(change)
        self.save()

    def to_store(self) -> bytes:
        """Return what the file has to hold now; `note_stored` follows when it does."""
        self._parted.clear()
        return to_bytes(self.record)

    def note_stored(self, data: bytes) -> None:
        """Note that the file holds this; who has gone since it was made is out of it all the same."""
        self.kept = from_bytes(data, "")
        for change in self._parted:
            change(self.kept)

    # Coming in.

    @request("class/check-code", is_open=True)
    def check_code(self, code: Text40, client: str, now_s: float) -> None:
        """Check the code as somebody typed it: spaces, dashes and small letters don't matter.

        Raises MotorcadeError where it isn't that of the class, or the address has tried too often.
        """
        self.of_an_address.check(client, now_s)
        if not compare_digest(typed_code(code).encode(), self.record.code.encode()):
            raise self.refuse(client, now_s, MotorcadeError("wrong-class-code", characters=len(self.record.code)))

    def refuse(self, address: str, now_s: float, problem: MotorcadeError) -> MotorcadeError:
        """Count what was wrong: a code, a number, a password or a first key. Return ``problem``."""
        self.of_an_address.add(address, now_s)
        return problem

    def join(self, typed_name: str, avatar: str, device: str, address: str, now_s: float) -> Pupil:
        """Let a newcomer in, who knows the code; it counts as an attempt of the address. Raises MotorcadeError.

        Args:
            typed_name: the nickname.
            avatar: the picture.
            device: the digest of a new secret.
            address: whose attempts are counted.
            now_s: the time.
        """
        if not self.record.is_open:
            raise MotorcadeError("class-closed")
        self.of_an_address.check(address, now_s)
        if len(self.record.pupils) >= MOST_PUPILS:
            raise MotorcadeError("class-full", most=MOST_PUPILS)
        if avatar not in AVATARS:
            raise MotorcadeError("no-such-avatar")
        name = checked_user_name(typed_name)
        check_free(name, [pupil.name for pupil in self.record.pupils])
        self.record.joined += 1
        number = new_number(self._random_below, [pupil.number for pupil in self.record.pupils])
        pupil = Pupil(f"{self.record.joined:02}", name, avatar, number, mission=self.record.handed)
        self.record.pupils.append(pupil)
        self.presence[pupil.id] = Presence(left_s=now_s, step_s=now_s)
        self._add_device(pupil, device)
        self.of_an_address.add(address, now_s)
        return pupil

    def come_back(self, typed_name: str, typed: str, device: str, address: str, now_s: float) -> Pupil:
        """Let a pupil in at another device, by name and number. Raises MotorcadeError.

        After ten wrong numbers for a name, or too many attempts of an address, it has to wait for some minutes. A name
        that nobody has is refused with the same error.
        """
        alike = likeness(typed_name[:200])
        pupil = next((pupil for pupil in self.record.pupils if likeness(pupil.name) == alike), None)
        self.of_a_name.check(alike, now_s)
        self.of_an_address.check(address, now_s)
        if pupil is None or not compare_digest(typed_number(typed).encode(), pupil.number.encode()):
            self.of_a_name.add(alike, now_s)
            raise self.refuse(address, now_s, MotorcadeError("wrong-number"))
        self._add_device(pupil, device)
        return pupil

    def _add_device(self, pupil: Pupil, device: str) -> None:
        pupil.devices = [*pupil.devices[-_MOST_DEVICES + 1 :], device]
        self.save()

    def leave(self, device: str) -> None:
        """Sign a pupil's device out."""

        def sign_out(record: ClassRecord) -> None:
            for pupil in record.pupils:
                pupil.devices = [known for known in pupil.devices if known != device]

        if self.pupil_at(device):
            self.part(sign_out)

    def pupil_at(self, device: str) -> Pupil | None:
        """Return the pupil of a device, by the digest of its secret."""
        if self._found_at != self.revision:
            self._found_at = self.revision
            self._by_device = {known: pupil for pupil in self.record.pupils for known in pupil.devices}
        return self._by_device.get(device)

    def pupil(self, pupil_id: str) -> Pupil:
        """Return the pupil with an id. Raises MotorcadeError."""
        for pupil in self.record.pupils:
            if pupil.id == pupil_id:
                return pupil
        raise MotorcadeError("no-such-pupil")

    # The teacher comes in.

    def set_password(self, stored: str) -> None:
        """Store a new password (`motorcade.classroom.names.to_stored`); all other browsers are signed out."""
        self.record.password = stored
        self.record.sign_ins = []
        self.save()

    def sign_in(self, device: str, until_s: float) -> None:
        """Sign the teacher in at a browser until a time (s since 1970)."""
        self.record.sign_ins = [*self.record.sign_ins[-_MOST_SIGN_INS + 1 :], SignIn(device, until_s)]
        self.save()

    def sign_out(self, device: str) -> None:
        """Sign the teacher out at a browser."""
        self.record.sign_ins = [sign_in for sign_in in self.record.sign_ins if sign_in.device != device]
        self.save()

    def is_teacher(self, device: str, now_s: float) -> bool:
        """Return whether the teacher is signed in at a browser, at a time in s since 1970."""
        return any(sign_in.device == device and now_s < sign_in.until_s for sign_in in self.record.sign_ins)

    # What the teacher does.

    @request("teacher/settings", stores=True)
    def set(
        self,
        title: Text40 | None = None,
        is_open: bool | None = None,
        stuck_minutes: Annotated[int, Meta(ge=1, le=60)] | None = None,
    ) -> None:
        """Change settings; None leaves one as it is. Raises MotorcadeError.

        Args:
            title: the name of the class.
            is_open: newcomers may join.
            stuck_minutes: a pupil is stuck after so many minutes without a step in the mission.
        """
        record = self.record
        if title is not None:
            record.title = checked_user_name(title)
        if is_open is not None:
            record.is_open = is_open
        record.stuck_minutes = stuck_minutes or record.stuck_minutes
        self.save()

    def change_code(self) -> None:
        """Make a new code; who is in stays in."""
        self.record.code = new_code(self._random_below)
        self.save()

    def freeze(self, frozen: bool) -> None:
        """Freeze all pupils' pages, or thaw them."""
        self.frozen = frozen
        self.changes += 1

    @request("teacher/rename", stores=True)
    def rename(self, pupil: Id, name: Text40) -> None:
        """Give a pupil another name. Raises MotorcadeError."""
        renamed = self.pupil(pupil)
        checked = checked_user_name(name)
        check_free(checked, [pupil.name for pupil in self.record.pupils if pupil is not renamed])
        renamed.name = checked
        self.save()

    @request("teacher/reset-number", stores=True)
    def reset_number(self, pupil: Id) -> Self:
        """Give a pupil another number; the devices stay signed in. Raises MotorcadeError."""
        found = self.pupil(pupil)
        found.number = new_number(self._random_below, [pupil.number for pupil in self.record.pupils])
        self.save()
        return self.self_of(found)

    def remove(self, pupil_id: str) -> None:
        """Remove a pupil, whose devices are signed out; the library is to be deleted. Raises MotorcadeError."""
        self.pupil(pupil_id)
        self.part(lambda record: take_out(record, pupil_id))
        self.presence.pop(pupil_id, None)
        self._free_from(lambda holder: holder == pupil_id)

    def end(self) -> None:
        """End the class: nobody is in it any more, all names are gone. The password stays; no id comes again."""
        code = new_code(self._random_below)

        def forget(record: ClassRecord) -> None:
            record.missions = []
            record.handed = None
            record.title = ""
            record.code = code

        for pupil in list(self.record.pupils):
            self.remove(pupil.id)
        self.part(forget)
        self.frozen = False
        self.ended += 1

    def chosen(self, to: Sequence[str] | None) -> list[Pupil]:
        """Return the pupils that are meant: all for None. Raises MotorcadeError where there is no such pupil."""
        if to is None:
            return list(self.record.pupils)
        return [self.pupil(pupil_id) for pupil_id in dict.fromkeys(to)]

    def hand_out_mission(self, to: Sequence[str] | None, mission: MissionChoice, title: Sentence) -> int:
        """Give pupils a mission; for None also those who join later. Return to how many. Raises MotorcadeError."""
        pupils = self.chosen(to)
        if mission not in self.record.missions:
            if len(self.record.missions) >= _MOST_MISSIONS:
                raise MotorcadeError("too-many-handed-out", most=_MOST_MISSIONS)
            self.record.missions.append(mission)
            self.save()
        number = self.record.missions.index(mission) + 1
        if to is None:
            self.record.handed = number
        for pupil in pupils:
            pupil.mission = number
            self.tell(pupil, "mission", title, "")
        self.save()
        return len(pupils)

    def handed_mission(self, number: int) -> MissionChoice:
        """Return a mission that was handed out. Raises MotorcadeError."""
        if not 1 <= number <= len(self.record.missions):
            raise MotorcadeError("not-found")
        return self.record.missions[number - 1]

    def tell(self, pupil: Pupil, kind: str, name: str | Sentence, sender: str) -> None:
        """Let a pupil know of a project or a mission that came."""
        pupil.told += 1
        pupil.news = [*pupil.news, News(pupil.told, kind, name, sender)][-_MOST_NEWS:]  # type: ignore[arg-type]
        self.save()

    # What pupils do.

    @request("class/seen")
    def seen(self, who: str, number: int) -> None:
        """Forget a pupil's news up to a number: the pupil has seen them. Raises MotorcadeError."""
        pupil = self.pupil(who)
        pupil.news = [news for news in pupil.news if news.number > number]
        self.save()

    @request("class/classmates")
    def classmates(self, who: str) -> list[Classmate]:
        """Return the other pupils."""
        return [Classmate(pupil.id, pupil.name, pupil.avatar) for pupil in self.record.pupils if pupil.id != who]

    @request("class/hand")
    def raise_hand(self, who: str, raised: bool, now_s: float) -> None:
        """Raise a pupil's hand, or lower it. Raises MotorcadeError."""
        self.pupil(who)
        presence = self.presence[who]
        if raised != (presence.hand_s is not None):
            if raised:
                presence.hand_s = now_s
            else:
                presence.hand_s = None
            self.changes += 1

    @request("teacher/lower-hand")
    def lower_hand(self, pupil: Id, now_s: float) -> None:
        """Lower a pupil's hand. Raises MotorcadeError."""
        self.raise_hand(pupil, False, now_s)

    def connect(self, pupil_id: str, now_s: float) -> None:
        """Count a page of a pupil that connects; the time without one is no time without a step.

        Raises MotorcadeError where there is no such pupil.
        """
        self.pupil(pupil_id)
        presence = self.presence[pupil_id]
        if not presence.pages:
            presence.step_s += now_s - presence.left_s
        presence.pages += 1
        self.changes += 1

    def disconnect(self, pupil_id: str, now_s: float) -> None:
        """Count a page of a pupil that leaves; the pupil may be gone."""
        if presence := self.presence.get(pupil_id):
            presence.pages -= 1
            presence.left_s = now_s
            self.changes += 1

    def note(self, pupil_id: str, change: Callable[[Presence], None]) -> None:
        """Change what is known of a pupil's progress; the pupil may be gone."""
        if presence := self.presence.get(pupil_id):
            change(presence)
            self.changes += 1

    @request("class/take")
    def take(self, who: str, name: Text40, wants: bool) -> None:
        """Take the cable or a real car while it is free, or give it back. Raises MotorcadeError."""
        self.pupil(who)
        if self._holder(name) not in (None, who):
            raise MotorcadeError("held-by-another")
        self.pass_on(name, who if wants else None)

    @request("teacher/pass-on")
    def pass_on(self, name: Text40, pupil: Id | None) -> None:
        """Give the cable or a real car to a pupil, or to nobody, whoever has it. Raises MotorcadeError."""
        self._holder(name)
        if pupil:
            self.holders[name] = self.pupil(pupil).id
        else:
            self.holders[name] = None
        self.changes += 1

    def _holder(self, name: str) -> str | None:
        if name not in self.holders:
            raise MotorcadeError("car-not-listed", car=name[:40])
        return self.holders[name]

    def may_drive(self, pupil_id: str, car: str) -> bool:
        """Return whether a pupil has a car, and may drive it now."""
        return not self.stopped and not self.frozen and self.holders.get(car) == pupil_id

    def check_cable(self, pupil_id: str) -> None:
        """Raise MotorcadeError where a pupil hasn't the cable."""
        if self.holders[CABLE] != pupil_id:
            raise MotorcadeError("cable-of-another")

    def shared(self) -> list[Shared]:
        """Return the cable and the real cars, and who has them."""
        return [Shared(name, holder) for name, holder in self.holders.items()]

    def stop_cars(self, stopped: bool) -> None:
        """Hold all real cars, or let pupils drive again."""
        self.stopped = stopped
        self.changes += 1

    def see_cable(self, cabled: bool) -> None:
        """Note whether something is at a port of this computer."""
        self.changes += cabled != self.cabled
        self.cabled = cabled

    def advance(self, now_s: float) -> None:
        """Let time pass: who makes no step becomes stuck."""
        stuck_s = self.record.stuck_minutes * 60

        def advance(entry: tuple[str, Presence]) -> None:
            self.changes += entry[1].advance(now_s, stuck_s)

        for_all(self.presence.items(), advance)

    def self_of(self, pupil: Pupil) -> Self:
        """Return what a pupil's own page knows of the pupil."""
        return Self(pupil.id, pupil.name, pupil.avatar, pupil.number)

    def save(self) -> None:
        """Note a change that the file has to hold."""
        self.revision += 1
        self.changes += 1
