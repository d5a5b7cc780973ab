"""The state of a class: who is in it and who may come in, and what changes it. Without I/O.

Times are seconds of any clock that never goes back. What has to survive the server is in ``record``.
"""

from collections.abc import Callable, Iterable, Sequence
from hmac import compare_digest

from motorcade.classroom.attempts import Attempts
from motorcade.classroom.desk_messages import ClassSettings
from motorcade.classroom.messages import AVATARS, News, Self
from motorcade.classroom.names import (
    RandomBelow,
    check_free,
    likeness,
    new_code,
    new_number,
    typed_code,
    typed_number,
)
from motorcade.classroom.presence import Presence
from motorcade.classroom.queues import Cable, car_turns, leave_all
from motorcade.classroom.record import ClassRecord, Pupil, SignIn, restore_record
from motorcade.errors import MotorcadeError
from motorcade.service.messages import MissionChoice
from motorcade.service.user_names import checked_user_name

MOST_PUPILS = 120
MOST_PAGES_OF_ONE = 8
# In ten minutes. A class behind one router joins at once; two computers leave a third of the places to others.
MOST_OF_AN_ADDRESS = MOST_PUPILS // 3
# In five minutes, of an address: a class behind one router mistypes each code twice.
MOST_WRONG_CODES = 60
_MOST_DEVICES = 8
_MOST_NEWS = 20
_MOST_MISSIONS = 50
_MOST_SIGN_INS = 8
SIGNED_IN_S = 12 * 3600.0


class Classroom:
    """A class while its server runs.

    Args:
        record: what is stored of it; changed in place.
        random_below: for codes and numbers.
        cars: the real cars that can be driven.
        now_s: the time.

    Attributes:
        revision: grows with each change that the file has to hold.
        changes: grows with each change that pages show.
        presence: of each pupil, by id, what needn't survive the server.
        frozen: pupils' pages show nothing to work with.
        stopped: the teacher's emergency stop holds all real cars.
        ended: how many times the class was ended.
    """

    def __init__(
        self, record: ClassRecord, random_below: RandomBelow, cars: Iterable[str] = (), now_s: float = 0.0
    ) -> None:
        self.record = record
        self.revision = self.changes = self.ended = 0
        self.frozen = self.stopped = False
        self.cable = Cable()
        self.turns = car_turns(cars)
        self.presence = {pupil.id: Presence(left_s=now_s, step_s=now_s) for pupil in record.pupils}
        self._random_below = random_below
        self._by_device = {device: pupil.id for pupil in record.pupils for device in pupil.devices}
        self._wrong_codes = Attempts(MOST_WRONG_CODES, 300.0)
        self._joined = Attempts(MOST_OF_AN_ADDRESS, 600.0, "too-many-joined")
        self._numbers_of_an_address = Attempts(20, 300.0)
        self._numbers_for_a_name = Attempts(10, 300.0)
        self._passwords = Attempts(5, 60.0)

    def restore(self, stored: ClassRecord) -> None:
        """Undo what has changed since ``stored``, except who is signed in as the teacher."""
        restore_record(self.record, stored)
        self.presence = {each.id: self.presence.get(each.id) or Presence() for each in stored.pupils}
        self._by_device = {device: pupil.id for pupil in stored.pupils for device in pupil.devices}
        self._save()

    # Coming in.

    def check_code(self, typed: str, who: str, now_s: float) -> None:
        """Raise MotorcadeError where it isn't the code, or the address ``who`` has typed too many wrong ones."""
        self._wrong_codes.check(who, now_s)
        if compare_digest(typed_code(typed).encode(), self.record.code.encode()):
            return
        self._wrong_codes.add(who, now_s)
        raise MotorcadeError("wrong-class-code", characters=len(self.record.code))

    def join(self, typed_name: str, avatar: str, device: str, now_s: float, who: str | None = None) -> Pupil:
        """Let a newcomer in, who knows the code. Raises MotorcadeError.

        Args:
            typed_name: the nickname.
            avatar: the picture.
            device: the digest of a new secret.
            now_s: the time.
            who: the address from which so many may join; None for no limit.
        """
        if not self.record.is_open:
            raise MotorcadeError("class-closed")
        if who is not None:
            self._joined.check(who, now_s)
        if len(self.record.pupils) >= MOST_PUPILS:
            raise MotorcadeError("class-full", most=MOST_PUPILS)
        if avatar not in AVATARS:
            raise MotorcadeError("no-such-avatar")
        name = checked_user_name(typed_name)
        check_free(name, [each.name for each in self.record.pupils])
        self.record.joined += 1
        number = new_number(self._random_below, [each.number for each in self.record.pupils])
        pupil = Pupil(f"{self.record.joined:02}", name, avatar, number, mission=self.record.handed)
        self.record.pupils.append(pupil)
        self.presence[pupil.id] = Presence(left_s=now_s, step_s=now_s)
        self._add_device(pupil, device)
        if who is not None:
            self._joined.add(who, now_s)
        return pupil

    def come_back(self, typed_name: str, typed: str, device: str, who: str, now_s: float) -> Pupil:
        """Let a pupil in at another device, by name and number. Raises MotorcadeError.

        After ten wrong numbers for a name, or twenty of an address, it has to wait for some minutes. A name that nobody
        has is refused with the same error.
        """
        alike = likeness(typed_name[:200])
        pupil = next((each for each in self.record.pupils if likeness(each.name) == alike), None)
        self._numbers_for_a_name.check(alike, now_s)
        self._numbers_of_an_address.check(who, now_s)
        if pupil is None or not compare_digest(typed_number(typed).encode(), pupil.number.encode()):
            self._numbers_for_a_name.add(alike, now_s)
            self._numbers_of_an_address.add(who, now_s)
            if pupil:
                self.presence[pupil.id].wrong_numbers += 1
                self.changes += 1
            raise MotorcadeError("wrong-number")
        self._add_device(pupil, device)
        return pupil

    def _add_device(self, pupil: Pupil, device: str) -> None:
        for forgotten in pupil.devices[: -_MOST_DEVICES + 1 or None]:
            self._by_device.pop(forgotten, None)
        pupil.devices = [*pupil.devices[-_MOST_DEVICES + 1 :], device]
        self._by_device[device] = pupil.id
        self._save()

    def leave(self, device: str) -> None:
        """A pupil's device is somebody else's from now on."""
        if pupil := self.pupil_at(device):
            pupil.devices.remove(device)
            del self._by_device[device]
            self._save()

    def pupil_at(self, device: str) -> Pupil | None:
        """The pupil of a device, by the digest of its secret."""
        found = self._by_device.get(device)
        return self.pupil(found) if found else None

    def pupil(self, pupil_id: str) -> Pupil:
        """The pupil with an id. Raises MotorcadeError."""
        for pupil in self.record.pupils:
            if pupil.id == pupil_id:
                return pupil
        raise MotorcadeError("no-such-pupil")

    # The teacher comes in.

    def check_password_attempts(self, who: str, now_s: float) -> None:
        """Raise MotorcadeError where ``who`` has tried too often."""
        self._passwords.check(who, now_s)

    def refuse_password(self, who: str, now_s: float, code: str = "wrong-password") -> MotorcadeError:
        """Count a wrong password, or a wrong first key; return the error with that code."""
        self._passwords.add(who, now_s)
        return MotorcadeError(code)

    def set_password(self, stored: str) -> None:
        """Store a new password (`motorcade.classroom.passwords.to_stored`); all other browsers are signed out."""
        self.record.password = stored
        self.record.sign_ins = []
        self._save()

    def sign_in(self, device: str, until_s: float) -> None:
        """The teacher is signed in at a browser until a time (s since 1970)."""
        self.record.sign_ins = [*self.record.sign_ins[-_MOST_SIGN_INS + 1 :], SignIn(device, until_s)]
        self._save()

    def sign_out(self, device: str) -> None:
        """The teacher is no longer signed in at a browser."""
        self.record.sign_ins = [each for each in self.record.sign_ins if each.device != device]
        self._save()

    def is_teacher(self, device: str, now_s: float) -> bool:
        """Whether the teacher is signed in at a browser, at a time in s since 1970."""
        return any(each.device == device and now_s < each.until_s for each in self.record.sign_ins)

    # What the teacher does.

    def set(self, settings: ClassSettings) -> None:
        """Change settings. Raises MotorcadeError."""
        if settings.title is not None:
            self.record.title = checked_user_name(settings.title)
        for name in ("is_open", "stuck_minutes", "turn_s"):
            if (value := getattr(settings, name)) is not None:
                setattr(self.record, name, value)
        self._save()

    def change_code(self) -> None:
        """Make a new code; who is in stays in."""
        self.record.code = new_code(self._random_below)
        self._save()

    def freeze(self, frozen: bool) -> None:
        """Freeze all pupils' pages, or thaw them."""
        self.frozen = frozen
        self.changes += 1

    def rename(self, pupil_id: str, typed_name: str) -> None:
        """Give a pupil another name. Raises MotorcadeError."""
        pupil, name = self.pupil(pupil_id), checked_user_name(typed_name)
        check_free(name, [each.name for each in self.record.pupils if each is not pupil])
        pupil.name = name
        self._save()

    def reset_number(self, pupil_id: str) -> Pupil:
        """Give a pupil another number; the devices stay signed in. Raises MotorcadeError."""
        pupil = self.pupil(pupil_id)
        pupil.number = new_number(self._random_below, [each.number for each in self.record.pupils])
        self.presence[pupil_id].wrong_numbers = 0
        self._save()
        return pupil

    def remove(self, pupil_id: str) -> None:
        """Remove a pupil, whose devices are signed out; the shelf is to be deleted. Raises MotorcadeError."""
        pupil = self.pupil(pupil_id)
        self.record.pupils.remove(pupil)
        self.record.removed.append(pupil_id)
        del self.presence[pupil_id]
        self._by_device = {device: owner for device, owner in self._by_device.items() if owner != pupil_id}
        leave_all([self.cable, *self.turns.values()], pupil_id)
        self._save()

    def end(self) -> None:
        """End the class: nobody is in it any more, all names are gone. The password stays; no id comes again."""
        for pupil in list(self.record.pupils):
            self.remove(pupil.id)
        self.record.missions, self.record.handed = [], None
        self.record.title = ""
        self.frozen = False
        self.ended += 1
        self.change_code()

    def shelf_deleted(self, pupil_id: str) -> None:
        """The shelf of a pupil who is out has been deleted."""
        self.record.removed.remove(pupil_id)
        self._save()

    def chosen(self, to: Sequence[str] | None) -> list[Pupil]:
        """The pupils that are meant: all for None. Raises MotorcadeError where there is no such pupil."""
        return list(self.record.pupils) if to is None else [self.pupil(each) for each in dict.fromkeys(to)]

    def hand_out_mission(self, to: Sequence[str] | None, mission: MissionChoice, title: str) -> int:
        """Give pupils a mission; for None also those who join later. Return to how many. Raises MotorcadeError."""
        pupils = self.chosen(to)
        if mission not in self.record.missions:
            if len(self.record.missions) >= _MOST_MISSIONS:
                raise MotorcadeError("too-many-handed-out", most=_MOST_MISSIONS)
            self.record.missions.append(mission)
        number = self.record.missions.index(mission) + 1
        if to is None:
            self.record.handed = number
        for pupil in pupils:
            pupil.mission = number
            self.tell(pupil, "mission", title, "")
        return len(pupils)

    def handed_mission(self, number: int) -> MissionChoice:
        """A mission that was handed out. Raises MotorcadeError."""
        if not 1 <= number <= len(self.record.missions):
            raise MotorcadeError("not-found")
        return self.record.missions[number - 1]

    def tell(self, pupil: Pupil, kind: str, name: str, sender: str) -> None:
        """Let a pupil know of a project or a mission that came."""
        pupil.told += 1
        pupil.news = [*pupil.news, News(pupil.told, kind, name, sender)][-_MOST_NEWS:]  # type: ignore[arg-type]
        self._save()

    # What pupils do.

    def seen(self, pupil: Pupil, number: int) -> None:
        """A pupil has seen the news up to a number."""
        pupil.news = [each for each in pupil.news if each.number > number]
        self._save()

    def raise_hand(self, pupil_id: str, raised: bool, now_s: float) -> None:
        """Raise a pupil's hand, or lower it. Raises MotorcadeError."""
        presence = self._present(pupil_id)
        if raised != (presence.hand_s is not None):
            presence.hand_s = now_s if raised else None
            self.changes += 1

    def connect(self, pupil_id: str, now_s: float) -> None:
        """A page of a pupil connects; the time without one is no time without a step.

        Raises MotorcadeError where the pupil has too many.
        """
        presence = self._present(pupil_id)
        if presence.pages >= MOST_PAGES_OF_ONE:
            raise MotorcadeError("too-many-sessions-of-one", most=MOST_PAGES_OF_ONE)
        if not presence.pages:
            presence.step_s += now_s - presence.left_s
        presence.pages += 1
        self.changes += 1

    def disconnect(self, pupil_id: str, now_s: float) -> None:
        """A page of a pupil leaves; the pupil may be gone."""
        presence = self.presence.get(pupil_id)
        if presence:
            presence.pages -= 1
            presence.left_s = now_s
            self.changes += 1

    def note(self, pupil_id: str, change: Callable[[Presence], bool]) -> None:
        """Change what is known of a pupil's progress; ``change`` returns whether pages show it."""
        presence = self.presence.get(pupil_id)
        if presence and change(presence):
            self.changes += 1

    def wish_cable(self, pupil_id: str, wants: bool) -> None:
        """Stand in the queue for the cable, or leave it."""
        self.cable.wish(pupil_id, wants)
        self.changes += 1

    def next_at_cable(self) -> None:
        """The next one gets the cable."""
        self.cable.next()
        self.changes += 1

    def begin_transfer(self, who: str, now_s: float) -> None:
        """Send through the cable from now on. Raises MotorcadeError where something is sent already."""
        if self.cable.is_sending:
            raise MotorcadeError("cable-sends")
        self.cable.begin(who, now_s)
        self.changes += 1

    def end_transfer(self, who: str) -> None:
        """What ``who`` sent has arrived, or not; a turn that waited for it ends."""
        self.cable.end(who)
        self.changes += 1

    def wish_turn(self, pupil_id: str, car: str, wants: bool, now_s: float) -> None:
        """Stand in the queue to drive a car, or leave it. Raises MotorcadeError where there is no such car."""
        if car not in self.turns:
            raise MotorcadeError("car-not-listed", car=car[:40])
        self.turns[car].wish(pupil_id, wants)
        self.changes += 1
        self.advance(now_s)

    def next_turn(self, car: str, now_s: float) -> None:
        """End a turn. Raises MotorcadeError where there is no such car."""
        if car not in self.turns:
            raise MotorcadeError("car-not-listed", car=car[:40])
        self.turns[car].next()
        self.changes += 1
        self.advance(now_s)

    def may_drive(self, pupil_id: str, car: str) -> bool:
        """Whether it is a pupil's turn to drive a car."""
        return not self.stopped and not self.frozen and car in self.turns and self.turns[car].first == pupil_id

    def stop_cars(self, stopped: bool) -> None:
        """Hold all real cars, or let pupils drive again."""
        self.stopped = stopped
        self.changes += 1

    def advance(self, now_s: float) -> None:
        """Let time pass: turns end, and who makes no step becomes stuck."""
        self.changes += self.cable.advance(now_s)
        for turns in self.turns.values():
            self.changes += turns.advance(now_s, self.record.turn_s)
        stuck_s = self.record.stuck_minutes * 60
        for presence in self.presence.values():
            self.changes += presence.advance(now_s, stuck_s)

    def self_of(self, pupil: Pupil) -> Self:
        """What a pupil's own page knows of the pupil."""
        return Self(pupil.id, pupil.name, pupil.avatar, pupil.number)

    def _present(self, pupil_id: str) -> Presence:
        if pupil_id not in self.presence:
            raise MotorcadeError("no-such-pupil")
        return self.presence[pupil_id]

    def _save(self) -> None:
        self.revision += 1
        self.changes += 1
