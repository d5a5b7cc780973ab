"""Joining a class over HTTP: codes, cookies, coming back, and what strangers reach."""

import shutil

import pytest
from starlette.requests import HTTPConnection

from motorcade.classroom import running
from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.room import MOST_OF_AN_ADDRESS
from motorcade.errors import MotorcadeError
from support.class_page import FIRST_KEY, PASSWORD, class_room
from support.waiting import wait_until


def test_three_steps_let_a_pupil_in(room):
    tablet = room.browser()
    assert tablet.client.get("/").headers["location"] == "/join"
    # Only a class by HTTPS has one.
    assert tablet.client.get("/authority.crt").json()["error"]["code"] == "not-found"
    about = tablet.ask("class/about")
    assert (about["me"], about["is_open"]) == (None, True)
    assert tablet.ask("class/check-code", code=room.code.lower()) == {}
    me = tablet.ask("class/join", code=room.code, name="Mia", avatar=about["avatars"][0])
    assert (me["id"], me["name"], len(me["number"])) == ("01", "Mia", 4)
    assert tablet.ask("class/about")["me"] == me
    assert tablet.client.get("/").status_code == 503, "the studio's page, which isn't built here"
    for browser, who, cars in ((tablet, "pupil", ""), (room.teacher, "teacher", "/api/teacher/cars")):
        able = browser.ask("capabilities")
        assert (able["classroom"], able["cars"]) == (who, cars)
        assert all(able[what] is True for what in ("serial_ports", "downloads", "driving"))


def test_a_pupil_comes_back_at_another_device(room, now):
    mia = room.join("Mia")
    assert mia.save("Robot") == 1
    tablet = room.browser()
    wrong = "0000" if mia.number != "0000" else "0001"
    assert tablet.ask("class/return", code=room.code, name="Mia", number=wrong) == "wrong-number"
    assert tablet.ask("class/return", code="AAAAAA", name="Mia", number=mia.number) == "wrong-class-code"
    assert tablet.ask("class/return", code=room.code, name="mia", number=mia.number)["id"] == mia.id
    assert tablet.names() == mia.names() == ["Robot"]
    assert tablet.ask("class/leave") == {}
    assert tablet.ask("projects/list") == "class-session-needed"
    assert mia.names() == ["Robot"]


def test_a_copy_of_a_running_classs_folder_continues_it_at_another_port_and_tablets_stay_signed_in(tmp_path):
    with class_room(tmp_path / "class") as room:
        mia, code = room.join("Mia"), room.code
        mia.save("Robot")
        shutil.unpack_archive(shutil.make_archive(tmp_path / "class", "zip", tmp_path / "class"), tmp_path / "copy")
        kept = dict(mia.client.cookies)
    with class_room(tmp_path / "copy", port=7711, first_key=None) as room:
        tablet, other = room.browser(), room.browser()
        tablet.client.cookies.update(kept)
        assert tablet.ask("class/about")["me"]["id"] == mia.id
        assert other.ask("class/return", code=code, name="Mia", number=mia.number)["id"] == mia.id
        assert tablet.names() == other.names() == ["Robot"]


def test_a_draft_keeps_its_mission_and_nobody_else_reads_it(room):
    mia, ben = room.join("Mia"), room.join("Ben")
    played = {"id": "the-square", "document": None}
    mia.ask("class/draft/write", name="Robot", project={"leader": {"a": 1}}, place="a tab", mission=played)
    draft = mia.ask("class/draft/read")
    assert (draft["place"], draft["mission"]) == ("a tab", played)
    assert ben.ask("class/draft/read") == {"name": "", "project": None, "saved_at": "", "place": "", "mission": None}
    assert room.teacher.ask("teacher/library", pupil=mia.id)["draft_at"]
    assert room.teacher.ask("teacher/project", pupil=mia.id, name="")["leader"] == {"a": 1}
    assert room.teacher.ask("teacher/project", pupil=ben.id, name="") == "no-draft"


def test_only_the_printed_key_sets_the_password_and_only_once(tmp_path):
    with class_room(tmp_path, signs_in=False) as room:
        assert room.teacher.ask("teacher/about")["has_password"] is False
        assert room.teacher.ask("teacher/first-password", key=FIRST_KEY, password="short") == "bad-password"
        assert room.teacher.ask("teacher/sign-in", password="") == "wrong-password"
        room.sign_in()
        assert room.browser().ask("teacher/first-password", key=FIRST_KEY, password="another one") == "wrong-first-key"
        assert room.browser().ask("teacher/about") == {"has_password": True, "signed_in": False}
        assert room.teacher.ask("teacher/about") == {"has_password": True, "signed_in": True}
    with class_room(tmp_path, first_key=None) as room:
        assert room.teacher.ask("teacher/first-password", key="", password="another one") == "wrong-first-key"
        assert room.teacher.ask("teacher/sign-in", password="wrong") == "wrong-password"
        assert room.teacher.ask("teacher/sign-in", password=PASSWORD) == {}
        assert room.teacher.ask("teacher/settings") == {}


def test_passwords_are_rate_limited(room, now):
    guesser = room.browser()
    for _ in range(MOST_OF_AN_ADDRESS - 1):
        assert guesser.ask("class/check-code", code="AAAAAA") == "wrong-class-code"
        now[0] += 0.1
    assert guesser.ask("teacher/sign-in", password="wrong") == "wrong-password"
    assert guesser.ask("teacher/sign-in", password=PASSWORD) == "too-many-attempts"
    assert room.browser().ask("teacher/sign-in", password=PASSWORD) == {}


def test_no_clock_that_is_set_signs_the_teacher_out_or_keeps_the_teacher_in(tmp_path, monkeypatch):
    monkeypatch.setattr(running, "_TICK_S", 0.01)
    now, set_s = [100.0], [1_800_000_000.0]
    clocks = {"clock": lambda: now[0], "unix_s": lambda: now[0] + set_s[0]}

    def is_in(browser):
        return browser.ask("teacher/about")["signed_in"]

    with class_room(tmp_path, **clocks) as room:
        for jump_s in (-1e9, 2e9, 3600.0, 0.0):
            set_s[0] += jump_s
            assert is_in(room.teacher)
        now[0] += 12 * 3600 - 1
        assert is_in(room.teacher)
        now[0] += 1
        assert not is_in(room.teacher)
        # The browser, whose clock may be set as well, has no say in it.
        signs = room.teacher.client.post("/api/teacher/sign-in", content=f'{{"password": "{PASSWORD}"}}')
        assert "max-age=31536000" in signs.headers["set-cookie"].lower()
        cookies = dict(room.teacher.client.cookies)
        # The file follows the clock, so a server that starts again knows it as well.
        set_s[0] += 1e8
        kept = lambda: ClassFolder(tmp_path).load(lambda below: 0).sign_ins[-1].until_s  # noqa: E731
        wait_until(lambda: kept() == now[0] + set_s[0] + 12 * 3600)
    # While nothing runs, only the clock of the computer tells how much time passes.
    for passed_s, stays in ((3600.0, True), (-1e8, True), (1e8 + 12 * 3600, False)):
        set_s[0] += passed_s
        with class_room(tmp_path, first_key=None, files=ClassFolder(tmp_path), **clocks) as room:
            again = room.browser()
            again.client.cookies.update(cookies)
            assert is_in(again) is stays
            now[0] += 60.0


def test_who_has_no_session_is_nobody_to_the_studio_of_a_class(tmp_path):
    """Each request is refused before it is asked whose it is; so this is what is left where one isn't."""
    files = ClassFolder(tmp_path)
    with files.opened():
        begun = running.RunningClass(running.ClassServerSettings(library=tmp_path, port=7710), files)
        with pytest.raises(MotorcadeError) as refused:
            begun.visitor(HTTPConnection({"type": "http", "headers": []}))
    assert refused.value.code == "class-session-needed"
