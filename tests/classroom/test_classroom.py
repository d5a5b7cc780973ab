"""A class without I/O: pupils, hands, queues and turns, at any time and by any chance."""

from contextlib import suppress
from random import Random

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from motorcade.classroom.classroom import Classroom
from motorcade.classroom.names import likeness
from motorcade.classroom.passwords import is_password, to_stored
from motorcade.classroom.record import from_bytes, to_bytes
from motorcade.classroom.views import class_view, classmates, pupil_view
from motorcade.errors import MotorcadeError
from motorcade.service.messages import MissionChoice
from support.classrooms import BUS, MAT, a_class, refused, row, with_pupils


def test_a_pupil_who_was_removed_is_out_everywhere():
    room = with_pupils("Mia", "Ben", cars=["red"])
    room.wish_cable("01", True)
    room.wish_turn("01", "red", True, 0.0)
    room.remove("01")
    assert room.pupil_at("device 0") is None
    assert class_view(room, MAT, 0.0).cable == []
    assert class_view(room, MAT, 0.0).turns[0].driver is None
    refused("no-such-pupil", room.pupil, "01")
    room.disconnect("01", 1.0)
    assert room.join("Mia", BUS, "d", 0.0).id == "03"


def test_an_ended_class_has_no_names_and_a_new_code():
    room = with_pupils("Mia", "Ben")
    room.set_password(to_stored("secret", bytes(16)))
    room.hand_out_mission(None, MissionChoice("first-drive"), "First drive")
    code = room.record.code
    room.end()
    assert b"Mia" not in to_bytes(room.record)
    assert b"first-drive" not in to_bytes(room.record)
    assert room.record.code != code
    assert is_password("secret", room.record.password)


def test_what_is_stored_comes_back():
    room = with_pupils("Mia", "小明")
    room.hand_out_mission(["01"], MissionChoice("first-drive"), "First drive")
    record = from_bytes(to_bytes(room.record), "class.json")
    again = Classroom(record, Random(2).randrange)
    assert record == room.record
    assert again.pupil_at("device 1").name == "小明"
    assert again.join("Ben", BUS, "d", 0.0).id == "03"


@pytest.mark.parametrize("data", [b"", b"{}", b"[]", b"\xff", b'{"code": 3}', b"[" * 5000])
def test_a_damaged_file_is_refused_in_a_sentence(data):
    assert "class.json" in str(refused("class-damaged", from_bytes, data, "class.json"))


def test_a_file_of_a_later_version_is_refused():
    data = to_bytes(a_class().record).replace(b"motorcade-class/1", b"motorcade-class/9")
    refused("class-of-another-kind", from_bytes, data, "class.json")


def test_a_hand_is_raised_until_somebody_lowers_it():
    room = with_pupils("Mia")
    room.raise_hand("01", True, 10.0)
    room.raise_hand("01", True, 20.0)
    assert row(room, "01", 25.0).hand_s == 15
    assert pupil_view(room, room.pupil("01"), MAT, 25.0).hand
    room.raise_hand("01", False, 30.0)
    assert row(room, "01", 31.0).hand_s is None
    refused("no-such-pupil", room.raise_hand, "02", True, 0.0)


def open_mission(room, now_s=0.0):
    room.note("01", lambda presence: presence.open_mission("first-drive", now_s))


def met(room, count, now_s):
    room.note("01", lambda presence: presence.see_goals(count, 3, now_s))


def stuck_s(room, now_s):
    room.advance(now_s)
    return row(room, "01", now_s).stuck_s


def test_who_makes_no_step_for_minutes_is_stuck():
    room = with_pupils("Mia")
    room.connect("01", 0.0)
    assert stuck_s(room, 1000.0) is None, "without a mission there are no steps"
    open_mission(room, now_s=1000.0)
    assert stuck_s(room, 1299.0) is None
    assert stuck_s(room, 1301.0) == 301
    met(room, 1, 1310.0)
    assert stuck_s(room, 1311.0) is None
    met(room, 0, 1400.0)
    met(room, 1, 1500.0)
    assert stuck_s(room, 1611.0) == 301, "only more goals than ever before are a step"
    room.note("01", lambda presence: presence.earn(1, 1620.0))
    assert stuck_s(room, 1621.0) is None
    met(room, 3, 1630.0)
    assert stuck_s(room, 9999.0) is None, "who has met all goals is not stuck"


def test_who_was_away_is_not_stuck_for_that():
    room = with_pupils("Mia")
    room.connect("01", 0.0)
    open_mission(room)
    room.disconnect("01", 100.0)
    assert stuck_s(room, 700.0) is None
    assert row(room, "01", 700.0).away_s == 600
    room.connect("01", 700.0)
    assert stuck_s(room, 899.0) is None
    assert stuck_s(room, 901.0) == 301


def test_turns_at_a_car_change_after_a_minute_when_somebody_waits():
    room = with_pupils("Mia", "Ben", "Lin", cars=["red", "blue"])
    room.wish_turn("01", "red", True, 0.0)
    room.advance(300.0)
    assert room.may_drive("01", "red"), "nobody waits"
    room.wish_turn("02", "red", True, 300.0)
    assert room.may_drive("02", "red"), "the minute was over"
    room.wish_turn("01", "red", True, 301.0)
    room.wish_turn("03", "red", True, 302.0)
    room.advance(359.0)
    turn = class_view(room, MAT, 359.0).turns[0]
    assert (turn.driver, turn.left_s, turn.waiting) == ("02", 1, ["01", "03"])
    room.advance(360.0)
    assert room.may_drive("01", "red")
    assert not room.may_drive("02", "red")
    room.next_turn("red", 365.0)
    assert room.may_drive("03", "red")
    assert class_view(room, MAT, 365.0).turns[0].left_s == 60
    room.wish_turn("03", "red", False, 366.0)
    assert class_view(room, MAT, 366.0).turns[0].driver is None
    refused("car-not-listed", room.wish_turn, "01", "green", True, 0.0)
    refused("car-not-listed", room.next_turn, "green", 0.0)


@pytest.mark.parametrize("hold", ["stop_cars", "freeze"])
def test_nobody_drives_while_the_cars_are_stopped_or_the_class_is_frozen(hold):
    room = with_pupils("Mia", cars=["red"])
    room.wish_turn("01", "red", True, 0.0)
    getattr(room, hold)(True)
    assert not room.may_drive("01", "red")
    getattr(room, hold)(False)
    assert room.may_drive("01", "red")


def test_the_cable_goes_from_one_to_the_next():
    room = with_pupils("Mia", "Ben")
    for pupil in ("01", "02", "01"):
        room.wish_cable(pupil, True)
    assert [pupil_view(room, room.pupil(each), MAT, 0.0).cable for each in ("01", "02")] == [0, 1]
    refused("cable-of-another", room.cable.check, "02")
    room.next_at_cable()
    room.cable.check("02")
    room.wish_cable("02", False)
    room.next_at_cable()
    refused("cable-of-another", room.cable.check, "02")


def at_cable(room):
    """What is left of the queue, and what the desk and the first pupil's page say of the cable."""
    view = class_view(room, MAT, 0.0)
    assert all(pupil_view(room, room.pupil(each), MAT, 0.0).cable_use == view.cable_use for each in view.cable)
    return view.cable, view.cable_use


@pytest.mark.parametrize("ends", [lambda room: room.next_at_cable(), lambda room: room.wish_cable("01", False)])
def test_a_turn_at_the_cable_ends_when_what_is_sent_is_there(ends):
    room = with_pupils("Mia", "Ben")
    for pupil in ("01", "02"):
        room.wish_cable(pupil, True)
    room.begin_transfer("01", 0.0)
    assert at_cable(room) == (["01", "02"], "sends")
    for _ in range(2):
        ends(room)
        room.wish_cable("01", True)
    assert at_cable(room) == (["01", "02"], "ending")
    refused("cable-of-another", room.cable.check, "02")
    refused("cable-sends", room.begin_transfer, "teacher", 1.0)
    room.end_transfer("01")
    assert at_cable(room) == (["02"], "free")
    room.cable.check("02")


def test_a_transfer_that_does_not_end_holds_the_cable_for_a_minute_at_most():
    room = with_pupils("Mia", "Ben")
    for pupil in ("01", "02"):
        room.wish_cable(pupil, True)
    room.begin_transfer("01", 0.0)
    room.next_at_cable()
    room.advance(59.0)
    assert at_cable(room) == (["01", "02"], "ending")
    room.advance(60.0)
    assert at_cable(room) == (["02"], "free")
    room.begin_transfer("02", 61.0)
    room.end_transfer("01")
    assert at_cable(room) == (["02"], "sends"), "the end of the late one is not the end of hers"


def test_the_teachers_own_transfer_ends_nobodys_turn_and_who_is_removed_leaves_at_once():
    room = with_pupils("Mia", "Ben", "Lin")
    for pupil in ("01", "02", "03"):
        room.wish_cable(pupil, True)
    room.begin_transfer("teacher", 0.0)
    refused("cable-sends", room.begin_transfer, "01", 0.0)
    room.next_at_cable()
    assert at_cable(room) == (["02", "03"], "sends")
    room.end_transfer("teacher")
    room.begin_transfer("02", 1.0)
    room.next_at_cable()
    room.remove("02")
    assert at_cable(room) == (["03"], "sends"), "hers is not broken off"
    room.end_transfer("02")
    assert at_cable(room) == (["03"], "free")


def test_missions_are_handed_out_to_some_to_all_and_to_who_comes_later():
    room = with_pupils("Mia", "Ben")
    own = MissionChoice(document={"format": "motorcade-mission/1"})
    assert room.hand_out_mission(["02"], own, "My own") == 1
    assert [each.mission for each in room.record.pupils] == [None, 1]
    assert room.hand_out_mission(None, MissionChoice("first-drive"), "First drive") == 2
    assert [each.mission for each in room.record.pupils] == [2, 2]
    late = room.join("Lin", BUS, "d", 0.0)
    assert room.handed_mission(late.mission) == MissionChoice("first-drive")
    assert [(each.kind, each.name) for each in room.pupil("02").news] == [
        ("mission", "My own"),
        ("mission", "First drive"),
    ]
    room.seen(room.pupil("02"), 1)
    assert [each.number for each in room.pupil("02").news] == [2]
    refused("no-such-pupil", room.hand_out_mission, ["01", "99"], own, "x")
    refused("not-found", room.handed_mission, 0)
    refused("not-found", room.handed_mission, 3)
    for number in range(48):
        room.hand_out_mission([], MissionChoice(f"m{number}"), "x")
    refused("too-many-handed-out", room.hand_out_mission, [], MissionChoice("x"), "x")


def test_the_teacher_is_signed_in_until_the_evening_and_no_longer_with_a_new_password():
    room = a_class()
    room.sign_in("browser", 100.0)
    room.sign_in("other", 100.0)
    assert room.is_teacher("browser", 99.0)
    assert not room.is_teacher("browser", 100.0)
    assert not room.is_teacher("", 0.0)
    room.sign_out("browser")
    assert not room.is_teacher("browser", 0.0)
    room.set_password("scrypt:...")
    assert not room.is_teacher("other", 0.0)


def test_a_password_is_stored_so_that_nobody_reads_it():
    stored = to_stored("correct horse", bytes(range(16)))
    assert "horse" not in stored
    assert is_password("correct horse", stored)
    assert not is_password("correct horsf", stored)
    assert not is_password("\ud800", stored)
    for broken in ("", "scrypt:1", "plain:16384:00:00", "scrypt:x:00:00", "scrypt:3:00:00"):
        assert not is_password("", broken)


def test_classmates_see_of_each_other_the_name_alone():
    room = with_pupils("Mia", "Ben")
    assert [(each.id, each.name) for each in classmates(room, room.pupil("01"))] == [("02", "Ben")]


class AnyClass(RuleBasedStateMachine):
    """Whatever happens, in any order: two pupils never have one name, number or device, and queues hold pupils only."""

    def __init__(self):
        super().__init__()
        self.room = a_class(["red"])
        self.now_s = 0.0
        self.devices = 0

    @rule(name=st.sampled_from(["Mia", "mia", "Ben", "Lin", "小明"]))
    def join(self, name):
        self.devices += 1
        self.attempt(lambda: self.room.join(name, BUS, f"d{self.devices}", self.now_s))

    @rule(
        pupil=st.sampled_from(["01", "02", "03", "09"]), device=st.integers(1, 9), name=st.sampled_from(["Mia", "Ben"])
    )
    def act(self, pupil, device, name):
        room, now_s = self.room, self.now_s
        for act in (
            lambda: room.connect(pupil, now_s),
            lambda: room.raise_hand(pupil, True, now_s),
            lambda: room.pupil(pupil) and room.wish_turn(pupil, "red", True, now_s),
            lambda: room.pupil(pupil) and room.wish_cable(pupil, True),
            lambda: room.cable.check(pupil) or room.begin_transfer(pupil, now_s),
            lambda: room.end_transfer(f"0{device}"),
            lambda: room.rename(pupil, name),
            lambda: room.leave(f"d{device}"),
        ):
            self.attempt(act)

    @rule(pupil=st.sampled_from(["01", "02", "03"]))
    def remove(self, pupil):
        self.attempt(lambda: self.room.remove(pupil))

    @rule()
    def end(self):
        self.room.end()

    @rule(seconds=st.floats(0, 100))
    def wait(self, seconds):
        self.now_s += seconds
        self.room.advance(self.now_s)

    def attempt(self, act):
        with suppress(MotorcadeError):
            act()

    @invariant()
    def all_is_well(self):
        pupils = self.room.record.pupils
        for values in ([likeness(each.name) for each in pupils], [each.id for each in pupils]):
            assert len(set(values)) == len(values)
        devices = [device for each in pupils for device in each.devices]
        assert len(set(devices)) == len(devices)
        assert all(self.room.pupil_at(device) for device in devices)
        view = class_view(self.room, MAT, self.now_s)
        present = {each.id for each in pupils}
        assert set(view.cable) | set(view.turns[0].waiting) | {view.turns[0].driver} <= present | {None}
        assert from_bytes(to_bytes(self.room.record), "class.json") == self.room.record


TestAnyClass = AnyClass.TestCase
