"""Leaving, stopping and deleting depend on nothing that can fail: no name, no disk, no other request."""

import io
import tempfile
import threading
import zipfile
from base64 import b64encode
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial

import pytest
from anyio import to_thread

from motorcade.classroom import app, folder, running, shared_mat
from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.running import EmergencyStop
from motorcade.errors import MotorcadeError
from motorcade.missions.document import built_in_mission
from motorcade.program.compiler import compile_program
from motorcade.server.studio import library
from motorcade.server.studio.library import OWNERS
from motorcade.service.library import LONGEST_NAME, allowed_name, checked_name
from support.class_page import NOT_STORED, PASSWORD, PROJECT, class_room, no_room
from support.waiting import DEADLINE_S, wait_until


@pytest.fixture
def full(monkeypatch):
    """A block in which the disk is full."""

    @contextmanager
    def filled():
        with monkeypatch.context() as changed:
            for module in (folder, library):
                changed.setattr(module, "replace_file", no_room)
            yield

    return filled


def owners(tmp_path):
    return sorted(each.name.rpartition("-")[0] for each in (tmp_path / OWNERS).iterdir())


def two(room, name="Parade"):
    mia, ben = room.join("Mia"), room.join("Ben")
    assert mia.ask("class/pair/begin", to=ben.id, name=name, project=PROJECT) == {}
    assert ben.ask("class/pair/join") == {}
    return mia, ben


def pair_of(pupil):
    with pupil.open("class/stream") as page:
        return page.until("pupil")["pair"]


@pytest.mark.parametrize(
    ("name", "copy"), [("a/b", "a_b"), ("..", "_"), ("\u202e\x07", "__"), ("x" * 99, "x" * 60), ("", "_")]
)
def test_a_pair_can_be_left_whatever_its_name(room, tmp_path, name, copy):
    mia, ben = two(room, name)
    for pupil in (mia, ben):
        assert pupil.ask("class/pair/leave") == copy
        assert pair_of(pupil) is None
        assert pupil.names() == [copy]
    assert owners(tmp_path) == [mia.id, ben.id]
    assert checked_name(allowed_name("/" * 2 * LONGEST_NAME)) == "_" * LONGEST_NAME


def test_on_a_full_disk_everybody_can_leave_and_is_out_for_good(tmp_path, full):
    with class_room(tmp_path) as room:
        mia, ben = two(room)
        eve = room.join("Eve")
        eve.save("Robot")
        with full():
            ((name, secret),) = eve.client.cookies.items()
            assert eve.ask("class/leave") == {}
            eve.client.cookies.set(name, secret)
            assert eve.ask("projects/list") == "class-session-needed"
            assert mia.ask("class/pair/leave") == "", "the page has the project"
            assert room.teacher.ask("teacher/remove", pupil=ben.id) == {}
            assert ben.ask("projects/list") == "class-session-needed"
            # A request that fails undoes what it has changed, and nobody comes back by that.
            assert room.teacher.ask("teacher/settings", title="Other") in NOT_STORED
            assert pair_of(mia) is None
            for pupil in (eve, ben):
                assert pupil.ask("projects/list") == "class-session-needed"
            assert not {ben.id, "pair-1"} & {*owners(tmp_path)}
        assert mia.save("Robot") == 1
        room.teacher.ask("teacher/settings", title="Other")
        kept = ClassFolder(tmp_path).load(lambda below: 0)
    assert ([pupil.name for pupil in kept.pupils], kept.pairs, kept.removed) == (["Mia", "Eve"], [], [])
    assert kept.pupils[1].devices == []


def test_on_a_full_disk_the_class_can_end(tmp_path, full):
    with class_room(tmp_path) as room:
        mia, _ = two(room)
        with full():
            assert room.teacher.ask("teacher/end", password=PASSWORD) == {}
            assert mia.ask("projects/list") == "class-session-needed"
            assert owners(tmp_path) == []
            assert room.teacher.ask("teacher/settings", title="Other") in NOT_STORED
            assert mia.ask("projects/list") == "class-session-needed"
        assert room.join("Ann").id == "03", "no number is given out again"
        assert b"Mia" not in (tmp_path / "class.json").read_bytes()


@pytest.mark.parametrize(
    ("order", "why"), [("teacher/remove", "removed"), ("teacher/end", "ended")], ids=["removed", "ended"]
)
def test_a_page_of_who_is_out_is_told_so_while_the_disk_hangs(room, monkeypatch, order, why):
    mia, goes_on, store = room.join("Mia"), threading.Event(), ClassFolder.store
    message = {"pupil": mia.id} if why == "removed" else {"password": PASSWORD}

    def slow(files, data):
        assert goes_on.wait(DEADLINE_S)
        store(files, data)

    monkeypatch.setattr(app, "_PUPIL_EVERY_S", 0.0)
    with mia.open("class/stream") as page, ThreadPoolExecutor(1) as pool:
        page.until("pupil")
        assert mia.ask("class/hand", raised=True) == {}
        # Behind this the page waits for the next change.
        assert page.until("pupil")["hand"]
        monkeypatch.setattr(ClassFolder, "store", slow)
        going = pool.submit(room.teacher.ask, order, **message)
        try:
            assert page.until("goodbye") == {"why": why}
        finally:
            goes_on.set()
        assert going.result() == {}


def test_two_pupils_who_are_removed_at_once_are_both_gone(room, tmp_path, monkeypatch):
    pupils = [room.join("Mia"), room.join("Ben")]
    for pupil in pupils:
        pupil.save("Robot")
    meet, remove = threading.Barrier(2, timeout=DEADLINE_S), ClassFolder.remove_owner

    def slow(files, owner):
        remove(files, owner)
        if owner == "01":
            meet.wait()

    monkeypatch.setattr(ClassFolder, "remove_owner", slow)
    with ThreadPoolExecutor(2) as pool:
        removing = [pool.submit(room.teacher.ask, "teacher/remove", pupil=pupil.id) for pupil in pupils]
        assert [each.result() for each in removing] == [{}, {}]
    assert owners(tmp_path) == []


def test_a_library_that_cant_be_deleted_keeps_no_other_and_is_tried_again(room, tmp_path, monkeypatch):
    mia, ben = room.join("Mia"), room.join("Ben")
    for pupil in (mia, ben):
        pupil.save("Robot")
    monkeypatch.setattr(running, "_TICK_S", 0.01)
    is_open, remove = [True], ClassFolder.remove_owner

    def held(files, owner):
        if is_open[0] and owner == mia.id:
            raise MotorcadeError("cant-delete", reason="another program has a file open")
        remove(files, owner)

    monkeypatch.setattr(ClassFolder, "remove_owner", held)
    assert room.teacher.ask("teacher/end", password=PASSWORD) == "cant-delete", "it is said that work is left"
    assert mia.ask("projects/list") == "class-session-needed"
    assert owners(tmp_path) == [mia.id]
    is_open.clear()
    is_open.append(False)
    wait_until(lambda: owners(tmp_path) == [])


def test_a_stop_that_comes_while_cars_are_released_holds(room, monkeypatch):
    mia, begun, goes_on = room.join("Mia"), threading.Event(), threading.Event()

    async def slow(stop):
        begun.set()
        await to_thread.run_sync(goes_on.wait, DEADLINE_S)

    monkeypatch.setattr(EmergencyStop, "release", slow)
    with ThreadPoolExecutor(1) as pool:
        releasing = pool.submit(room.teacher.ask, "teacher/release-all")
        assert begun.wait(DEADLINE_S)
        assert room.teacher.ask("teacher/stop-all") == []
        goes_on.set()
        assert releasing.result() == {}
    with mia.open("class/stream") as page:
        assert page.until("pupil")["stopped"]


def test_a_shared_mat_that_is_cleared_while_it_starts_stays_cleared(room, monkeypatch):
    mia, begun, goes_on = room.join("Mia"), threading.Event(), threading.Event()
    assert room.teacher.ask("teacher/mat/open") == {}
    image = b64encode(compile_program(built_in_mission("follow-me").solution).image).decode()
    open_world = shared_mat.open_world

    def slow(*arguments, **named):
        begun.set()
        assert goes_on.wait(DEADLINE_S)
        return open_world(*arguments, **named)

    monkeypatch.setattr(shared_mat, "open_world", slow)
    assert mia.ask("class/mat", image=image) == {}
    with ThreadPoolExecutor(1) as pool:
        starting = pool.submit(partial(room.teacher.ask, "teacher/mat/start"))
        assert begun.wait(DEADLINE_S)
        assert room.teacher.ask("teacher/end", password=PASSWORD) == {}
        goes_on.set()
        assert starting.result() == "mat-is-closed"
    with room.teacher.open("teacher/stream") as page:
        assert page.until("class")["mat"]["state"] == "closed"


def test_where_no_temporary_file_can_be_written_the_teacher_is_told_and_none_is_left(room, tmp_path, monkeypatch):
    """What pupils made is nowhere but in the folder of the class."""
    room.join("Mia").save("Robot")
    work = partial(room.teacher.client.get, "/api/teacher/work.zip")
    kept = tmp_path / "temporary"
    monkeypatch.setattr(tempfile, "tempdir", str(kept))
    report = partial(room.teacher.client.post, "/api/teacher/report.html", json={"mission": "forward-and-stop"})
    for ask in (work, report):
        answer = ask()
        assert (answer.status_code, answer.json()["error"]["code"]) == (500, "work-not-collected")
    kept.mkdir()
    with monkeypatch.context() as changed:
        changed.setattr(zipfile.ZipFile, "writestr", lambda archive, path, data: no_room(path, data))
        assert work().json()["error"]["code"] == "work-not-collected"
    with room.teacher.client.stream("GET", "/api/teacher/work.zip") as answer:
        assert answer.status_code == 200
        assert list(kept.iterdir()) == []
        assert zipfile.is_zipfile(io.BytesIO(answer.read()))
