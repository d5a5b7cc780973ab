"""A class without I/O: pupils, hands, and what they share, at any time and by any chance."""

from random import Random

import pytest

from motorcade.classroom.app import class_view, pupil_view
from motorcade.classroom.messages import Shared
from motorcade.classroom.names import is_password, to_stored
from motorcade.classroom.record import from_bytes, to_bytes
from motorcade.classroom.room import Classroom
from motorcade.service.messages import MissionChoice
from support.classrooms import BUS, MAT, a_class, refused, row, with_pupils


def test_a_pupil_who_was_removed_is_out_everywhere():
    room = with_pupils("Mia", "Ben", cars=["red"])
    for name in ("", "red"):
        room.take("01", name, True)
    room.remove("01")
    assert room.pupil_at("device 0") is None
    assert class_view(room, MAT, 0.0).shared == [Shared("", None), Shared("red", None)]
    refused("no-such-pupil", room.pupil, "01")
    room.disconnect("01", 1.0)
    assert room.join("Mia", BUS, "d", "a", 0.0).id == "03"


def test_a_password_is_stored_so_that_nobody_reads_it():
    stored = to_stored("correct horse", bytes(range(16)))
    assert "horse" not in stored
    # Each guess takes 16 MiB and some 50 ms.
    assert stored.startswith(f"scrypt:{1 << 14}:")
    assert [is_password(each, stored) for each in ("correct horse", "correct horsf", "\ud800")] == [True, False, False]
    for broken in ("", "scrypt:1", "plain:16384:00:00", "scrypt:x:00:00", "scrypt:3:00:00"):
        assert not is_password("", broken)


def test_what_is_stored_comes_back():
    room = with_pupils("Mia", "小明")
    room.hand_out_mission(["01"], MissionChoice("first-drive"), "First drive")
    record = from_bytes(to_bytes(room.record), "class.json")
    again = Classroom(record, Random(2).randrange)
    assert record == room.record
    assert again.pupil_at("device 1").name == "小明"
    assert again.join("Ben", BUS, "d", "a", 0.0).id == "03"


@pytest.mark.parametrize("data", [b"", b"{}", b"[]", b"\xff", b'{"code": 3}', b"[" * 5000])
def test_a_file_that_is_damaged_or_of_a_later_version_is_refused_in_a_sentence(data):
    assert "class.json" in str(refused("class-damaged", from_bytes, data, "class.json"))
    later = to_bytes(a_class().record).replace(b"motorcade-class/1", b"motorcade-class/9")
    refused("class-of-another-kind", from_bytes, later, "class.json")


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
    room.note("01", lambda presence: presence.earn(1, 1625.0))
    room.disconnect("01", 1630.0)
    assert stuck_s(room, 9000.0) is None, "who is away is not stuck"
    assert row(room, "01", 9000.0).away_s == 7370
    room.connect("01", 9000.0)
    assert stuck_s(room, 9289.0) is None
    assert stuck_s(room, 9290.0) == 300, "a check without a new star is no step"
    met(room, 3, 9300.0)
    assert stuck_s(room, 19999.0) is None, "who has met all goals is not stuck"


def test_who_has_met_the_only_goal_is_not_stuck():
    room = with_pupils("Mia")
    room.connect("01", 0.0)
    open_mission(room, now_s=0.0)
    room.note("01", lambda presence: presence.see_goals(0, 1, 1.0))
    assert stuck_s(room, 1000.0) is not None
    room.note("01", lambda presence: presence.see_goals(1, 1, 1001.0))
    assert stuck_s(room, 9000.0) is None


def test_one_pupil_at_a_time_has_the_cable_and_each_car_until_it_is_given_back_or_passed_on():
    room = with_pupils("Mia", "Ben", cars=["red", "blue"])
    refused("cable-of-another", room.check_cable, "01")
    for name in ("", "red"):
        room.take("01", name, True)
        refused("held-by-another", room.take, "02", name, True)
        refused("held-by-another", room.take, "02", name, False)
    room.check_cable("01")
    refused("cable-of-another", room.check_cable, "02")
    assert [room.may_drive(*each) for each in (("01", "red"), ("02", "red"), ("01", "blue"))] == [True, False, False]
    shared = pupil_view(room, room.pupil("02"), MAT).shared
    assert shared == [Shared("", "01"), Shared("red", "01"), Shared("blue", None)]
    for hold in (room.stop_cars, room.freeze):
        hold(True)
        assert not room.may_drive("01", "red")
        hold(False)
        assert room.may_drive("01", "red")
    room.take("01", "red", False)
    room.take("02", "red", True)
    room.pass_on("", "02")
    assert room.may_drive("02", "red")
    room.check_cable("02")
    room.pass_on("", None)
    assert class_view(room, MAT, 0.0).shared[0] == Shared("", None)
    refused("car-not-listed", room.take, "01", "green", True)
    refused("car-not-listed", room.pass_on, "green", None)
    refused("no-such-pupil", room.pass_on, "red", "09")
    refused("no-such-pupil", room.take, "teacher", "blue", True)


def test_missions_are_handed_out_to_some_to_all_and_to_who_comes_later():
    room = with_pupils("Mia", "Ben")
    own = MissionChoice(document={"format": "motorcade-mission/1"})
    assert room.hand_out_mission(["02"], own, "My own") == 1
    assert [each.mission for each in room.record.pupils] == [None, 1]
    assert room.hand_out_mission(None, MissionChoice("first-drive"), "First drive") == 2
    assert [each.mission for each in room.record.pupils] == [2, 2]
    late = room.join("Lin", BUS, "d", "a", 0.0)
    assert room.handed_mission(late.mission) == MissionChoice("first-drive")
    assert [each.name for each in room.pupil("02").news] == ["My own", "First drive"]
    assert [(each.id, each.name) for each in room.classmates("01")] == [("02", "Ben"), ("03", "Lin")]
    room.seen("02", 1)
    assert [each.number for each in room.pupil("02").news] == [2]
    refused("no-such-pupil", room.hand_out_mission, ["01", "99"], own, "x")
    refused("not-found", room.handed_mission, 0)
    refused("not-found", room.handed_mission, 3)
    for number in range(48):
        room.hand_out_mission([], MissionChoice(f"m{number}"), "x")
    refused("too-many-handed-out", room.hand_out_mission, [], MissionChoice("x"), "x")


def test_a_mission_that_is_handed_out_before_anybody_comes_has_to_be_stored():
    room = a_class()
    before = room.revision
    assert room.hand_out_mission(None, MissionChoice("first-drive"), "First drive") == 0
    assert room.revision > before
    again = Classroom(from_bytes(room.to_store(), "a file"), Random(1).randrange)
    assert again.handed_mission(again.join("Mia", BUS, "d", "a", 0.0).mission) == MissionChoice("first-drive")


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
