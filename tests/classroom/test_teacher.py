"""The teacher's page: the list, freezing, handing out, collecting, and the end of the class."""

import io
import json
import re
import stat
import sys
import zipfile
from base64 import b64encode
from contextlib import suppress
from random import Random

from motorcade.classroom import folder
from motorcade.classroom.folder import MOST_FILES, ClassFolder
from motorcade.classroom.record import to_bytes
from motorcade.classroom.room import Classroom
from motorcade.missions.document import built_in_mission
from motorcade.program.blocks import blocks_of
from motorcade.program.compiler import compile_program
from motorcade.server.studio import library, workers
from motorcade.server.studio.library import OWNERS
from motorcade.service.requests import respond
from support.class_page import NOT_STORED, PASSWORD, PROJECT, class_room, no_room
from support.classrooms import refused
from support.world_page import KEY


def row(view, pupil):
    return next(each for each in view["pupils"] if each["id"] == pupil.id)


def test_the_teacher_sees_who_is_here_and_who_needs_help(room):
    mia, ben = room.join("Mia"), room.join("Ben")
    with room.teacher.open("teacher/stream") as shown:
        assert [each["online"] for each in shown.until("class")["pupils"]] == [False, False]
        with mia.open("class/stream") as page:
            assert page.until("pupil")["me"]["name"] == "Mia"
            assert row(shown.until("class", lambda view: row(view, mia)["online"]), ben)["online"] is False
            mia.ask("class/hand", raised=True)
            assert page.until("pupil", lambda view: view["hand"])
            assert row(shown.until("class", lambda view: row(view, mia)["hand_s"] is not None), mia)["hand_s"] == 0
            room.teacher.ask("teacher/lower-hand", pupil=mia.id)
            assert not page.until("pupil", lambda view: not view["hand"])["hand"]
        assert not row(shown.until("class", lambda view: not row(view, mia)["online"]), mia)["online"]


def test_frozen_pages_play_nothing_and_lose_nothing(room):
    mia = room.join("Mia")
    with mia.open("class/stream") as page, mia.open(f"world?session={KEY}") as world:
        world.set()
        world.send("play")
        world.until("state", lambda state: state["playing"])
        room.teacher.ask("teacher/freeze", frozen=True)
        assert page.until("pupil", lambda view: view["frozen"])
        assert not world.until("state", lambda state: not state["playing"])["playing"]
        for time in ("play", "step"):
            world.send(time)
            assert world.until("error")["code"] == "class-frozen"
        world.send("set", mat={"format": "motorcade-mat/1", "name": "x", "crowd": [{"cars": 501}]})
        assert world.until("error")["code"] == "too-many-cars"
        assert world.set()["cars"] == 3, "a page that is loaded again shows its world"
        assert mia.save("Robot") == 1
        room.teacher.ask("teacher/freeze", frozen=False)
        assert page.until("pupil", lambda view: not view["frozen"])
        world.send("play")
        assert world.until("state", lambda state: state["playing"])


def test_projects_are_handed_out_as_copies_and_a_pupils_own_is_given_back_as_another(room):
    mia, ben = room.join("Mia"), room.join("Ben")
    room.teacher.save("Starter")
    ben.save("Starter", leader={"own": True})
    assert room.teacher.ask("teacher/hand-out", name="Starter") == {"pupils": 2, "missed": []}
    assert (mia.names(), ben.names()) == (["Starter"], ["Starter", "Starter 2"])
    assert room.teacher.ask("teacher/hand-out", name="Nothing") == "no-project"
    assert room.teacher.ask("teacher/hand-out", name="Starter", to=["99"]) == "no-such-pupil"
    library = room.teacher.ask("teacher/library", pupil=ben.id)
    assert (library["pupil"], {each["name"] for each in library["projects"]}) == ("Ben", {"Starter", "Starter 2"})
    opened = room.teacher.ask("teacher/project", pupil=ben.id, name="Starter")
    assert (opened["name"], opened["leader"]) == ("Starter", {"own": True})
    hint = PROJECT | {"leader": {"hint": True}}
    handed = room.teacher.ask("teacher/hand-out", to=[ben.id], name="Starter", project=hint)
    assert handed == {"pupils": 1, "missed": []}
    assert ben.ask("projects/read", name="Starter")["leader"] == {"own": True}, "his stays as it is"
    assert ben.ask("projects/read", name="Starter 3")["leader"] == {"hint": True}
    assert (mia.names(), room.teacher.names()) == (["Starter"], ["Starter"])
    with ben.open("class/stream") as page:
        assert [each["name"] for each in page.until("pupil")["news"]] == ["Starter 2", "Starter 3"]


def test_who_is_away_finds_what_came_and_the_frozen_class_also_after_a_restart(tmp_path):
    with class_room(tmp_path) as room:
        mia = room.join("Mia")
        room.teacher.save("Starter")
        room.teacher.ask("teacher/hand-out", name="Starter")
        assert room.teacher.ask("teacher/hand-out", mission={"id": "no-such"}) == "no-mission"
        handed = room.teacher.ask("teacher/hand-out", mission={"id": "follow-me"})
        assert handed == {"pupils": 1, "missed": []}
        ClassFolder(tmp_path).add_stars(mia.id, "follow-me", [1, 2])
        cookies = dict(mia.client.cookies)
    with class_room(tmp_path, first_key=None) as room:
        mia = room.browser()
        mia.client.cookies.update(cookies)
        room.teacher.ask("teacher/sign-in", password=PASSWORD)
        room.teacher.ask("teacher/freeze", frozen=True)
        with mia.open("class/stream") as page:
            view = page.until("pupil")
        assert [(each["kind"], each["sender"]) for each in view["news"]] == [("project", ""), ("mission", "")]
        assert view["news"][1]["name"]["zh"] == built_in_mission("follow-me").name.texts["zh"]
        assert (view["mission"], view["frozen"], mia.names()) == (1, True, ["Starter"])
        for pupil in (mia, room.join("Ben")):
            assert pupil.ask("class/mission", number=1)["id"] == "follow-me"
        assert room.teacher.ask("teacher/progress")["stars"] == {"01": {"follow-me": [1, 2]}, "02": {}}
        with room.teacher.open("teacher/stream") as shown:
            assert shown.until("class")["pupils"][0]["stars"] == 2
        mia.ask("class/seen", number=view["news"][-1]["number"])
        with mia.open("class/stream") as page:
            assert page.until("pupil")["news"] == []


def test_stars_of_a_check_are_seen_at_once_and_an_import_may_take_longer(tmp_path, monkeypatch):
    allowed = {}

    def answered(name, data, context, most_s, given_up):
        allowed[name] = most_s
        return respond(name, data, context)

    monkeypatch.setattr(workers, "answer_in_process", answered)
    mission = built_in_mission("follow-me")
    leader, followers = blocks_of(mission.solution)
    with class_room(tmp_path) as room:
        mia = room.join("Mia")
        assert mia.ask("projects/import", text="") == "no-projects-file"
        earned = mia.ask("missions/check", mission={"id": mission.id}, leader=leader, followers=followers)["earned"]
        with room.teacher.open("teacher/stream") as shown:
            assert shown.until("class")["pupils"][0]["stars"] == len(earned) > 0
        for pupil, stars in ((mia, earned), (room.join("Ben"), [])):
            assert {each["id"]: each["earned"] for each in pupil.ask("missions")}[mission.id] == stars
    assert allowed == {"projects/import": 5.0, "missions/check": 1.0}


def test_the_teacher_is_told_of_a_full_disk_until_there_is_room(room, now, monkeypatch):
    mia = room.join("Mia")
    mia.ask("class/draft/write", name="x", project=PROJECT | {"leader": {"is": "kept"}})
    with room.teacher.open("teacher/stream") as shown:
        assert shown.until("class")["disk"] is None
        with monkeypatch.context() as full:
            for module in (folder, library):
                full.setattr(module, "replace_file", no_room)
            assert mia.ask("class/draft/write", name="x", project=PROJECT) == "cant-save"
            assert mia.ask("projects/write", name="Robot", project=PROJECT) == "cant-save"
            mia.ask("class/hand", raised=True)
            assert "磁盘满了" in shown.until("class", lambda view: view["disk"])["disk"]["zh"]
            assert room.teacher.ask("teacher/rename", pupil=mia.id, name="Mila") in NOT_STORED
            newcomer = room.browser()
            asked = {"code": room.code, "name": "Ben", "avatar": "bus"}
            assert newcomer.ask("class/join", **asked) in NOT_STORED
            assert newcomer.ask("class/about")["me"] is None
            assert room.browser().ask("teacher/sign-in", password=PASSWORD) == {}
            assert room.teacher.ask("teacher/stop-all") == []
            assert (
                room.teacher.ask("teacher/freeze", frozen=True)
                == room.teacher.ask("teacher/freeze", frozen=False)
                == {}
            )
            assert mia.ask("class/draft/read")["project"]["leader"] == {"is": "kept"}
        assert mia.ask("class/draft/read")["project"]["leader"] == {"is": "kept"}
        assert mia.save("Robot") == 1
        mia.ask("class/hand", raised=False)
        pupils = shown.until("class", lambda view: not view["disk"])["pupils"]
        assert [pupil["name"] for pupil in pupils] == ["Mia"], "what failed had no effect"
        assert newcomer.ask("class/join", **asked)["name"] == "Ben"


def test_a_class_begins_on_a_full_disk_and_says_so(tmp_path, monkeypatch):
    with class_room(tmp_path) as room:
        mia = room.join("Mia")
    monkeypatch.setattr(folder, "replace_file", no_room)
    with class_room(tmp_path, first_key=None) as room:
        teacher = room.browser()
        assert teacher.ask("teacher/sign-in", password=PASSWORD) == {}
        with teacher.open("teacher/stream") as shown:
            view = shown.until("class", lambda view: view["disk"])
        assert [pupil["id"] for pupil in view["pupils"]] == [mia.id]


def test_a_full_library_keeps_the_hand_out_from_nobody_else(tmp_path):
    files = folder.ClassFolder(tmp_path, folder.LIMITS._replace(projects=2))
    with class_room(tmp_path, files=files) as room:
        mia, ben = room.join("Mia"), room.join("Ben")
        for name in ("a", "b"):
            mia.save(name)
        for to, answer in ((None, {"pupils": 1, "missed": [mia.id]}), ([mia.id], "too-many-projects")):
            assert room.teacher.ask("teacher/hand-out", name="Starter", project=PROJECT, to=to) == answer
        assert (mia.names(), ben.names()) == (["a", "b"], ["Starter"])


def test_progress_in_a_mission_is_seen_live(room):
    mia = room.join("Mia")
    mission = mia.ask("mission", id="forward-and-stop")
    with (
        room.teacher.open("teacher/stream") as shown,
        mia.open("class/stream"),
        mia.open(f"world?session={KEY}") as world,
    ):
        world.set(mat=mission["mat"], mission={"id": "forward-and-stop"}, profile=mission["profile"])
        found = row(shown.until("class", lambda view: row(view, mia)["goals"]), mia)
        assert (found["mission"], found["goals"]) == ("forward-and-stop", len(mission["goals"]))
    progress = room.teacher.ask("teacher/progress")
    assert progress["stars"] == {"01": {}}
    assert "forward-and-stop" in {each["id"] for each in progress["missions"]}


def test_a_renamed_pupil_comes_back_by_the_new_name_and_number(room):
    ben, tablet = room.join("Ben"), room.browser()
    assert room.teacher.ask("teacher/rename", pupil=ben.id, name="Benjamin") == {}
    known = {"code": room.code, "number": room.teacher.ask("teacher/reset-number", pupil=ben.id)["number"]}
    assert tablet.ask("class/return", name="Ben", **known) == "wrong-number"
    me = tablet.ask("class/return", name="benjamin", **known)
    assert (me["id"], me["name"]) == (ben.id, "Benjamin")


def test_all_work_is_collected_with_an_overview(room):
    mia, ben = room.join("Mia"), room.join("小明")
    for name in ("Robot <3", "robot _3", "con", "draft"):
        mia.save(name)
    mia.ask("class/draft/write", name="x", project={"leader": {}})
    ben.save("舞蹈")
    answer = room.teacher.client.get("/api/teacher/work.zip?language=zh")
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        names = archive.namelist()
        page = archive.read("overview.html").decode()
        projects = [name for name in names if name.endswith(".motorcade.json")]
        assert all(json.loads(archive.read(name))["format"] for name in projects)
    files = {"robot _3", "Robot _3 2", "_con", "draft 2", "draft"}
    assert {name.removesuffix(".motorcade.json") for name in projects} == {
        *(f"01 Mia/{name}" for name in files),
        "02 小明/舞蹈",
    }
    assert "Robot &lt;3" in page
    assert "Robot <3" not in page
    assert "舞蹈" in page
    assert 'lang="zh"' in page


def test_a_removed_pupil_is_out_at_once_with_library_and_own_missions_are_gone(room, tmp_path):
    mia, ben = room.join("Mia"), room.join("Ben")
    for pupil in (mia, ben):
        pupil.save("Robot")
        document = pupil.ask("mission", id="forward-and-stop")["document"]
        assert pupil.ask("missions/write", name="Mine", document=document)["version"] == 1
    owners = tmp_path / OWNERS
    assert len(list(owners.iterdir())) == 4
    with mia.open("class/stream") as page, mia.open(f"world?session={KEY}") as world:
        page.until("pupil")
        world.set()
        assert room.teacher.ask("teacher/remove", pupil=mia.id) == {}
        assert page.until("goodbye") == {"why": "removed"}
        assert world.until("error")["code"] == "class-session-needed"
    assert mia.ask("projects/list") == "class-session-needed"
    assert {each.name[:2] for each in owners.iterdir()} == {ben.id}
    assert [each["name"] for each in ben.ask("missions/own")] == ["Mine"]
    assert room.teacher.ask("teacher/remove", pupil=mia.id) == "no-such-pupil"


def test_the_end_of_the_class_deletes_all_names_and_work(room, tmp_path):
    mia = room.join("Mia")
    mia.save("Robot")
    code = room.code
    room.teacher.ask("teacher/hand-out", mission={"id": "follow-me"})
    with mia.open("class/stream") as page:
        page.until("pupil")
        assert room.teacher.ask("teacher/end", password="wrong") == "wrong-password"
        assert mia.ask("capabilities")["classroom"] == "pupil"
        assert room.teacher.ask("teacher/end", password=PASSWORD) == {}
        assert page.until("goodbye") == {"why": "ended"}
    assert mia.ask("capabilities") == "class-session-needed"
    assert room.code != code
    left = b"".join(file.read_bytes() for file in tmp_path.rglob("*") if file.is_file())
    assert b"Mia" not in left
    assert b"follow-me" not in left
    assert list((tmp_path / OWNERS).iterdir()) == []
    assert room.browser().ask("teacher/sign-in", password=PASSWORD) == {}
    assert room.join("Mia").id == "02"


def test_libraries_that_could_not_be_deleted_are_deleted_at_the_next_start(tmp_path):
    with class_room(tmp_path) as room:
        room.join("Mia").save("Robot")
    files = ClassFolder(tmp_path)
    state = Classroom(files.load(Random(1).randrange), Random(1).randrange)
    state.remove("01")
    files.store(to_bytes(state.record))
    tmp_path.chmod(0o755)
    with class_room(tmp_path, first_key=None):
        refused("class-is-running", ClassFolder(tmp_path).opened().__enter__)
        with suppress(PermissionError):
            # Windows deletes no open file.
            (tmp_path / ".running").unlink()
        refused("class-is-running", ClassFolder(tmp_path).opened().__enter__)
        if sys.platform != "win32":
            assert stat.S_IMODE(tmp_path.stat().st_mode) == 0o700, "others on this computer read nothing"
        assert list((tmp_path / OWNERS).iterdir()) == []
    assert files.load(Random(1).randrange).removed == []


def rows(answer):
    """The files in a report, and what each has earned."""
    return dict(re.findall(r"<th scope=row>(.*?)</th><td[^>]*>(.*?)</td>", answer.text))


def test_the_teacher_gets_a_report_of_all_work_or_of_chosen_files_against_a_mission(room):
    mia, ben = room.join("Mia"), room.join("小明")
    mission = built_in_mission("forward-and-stop")
    for pupil, program in ((mia, mission.solution), (ben, mission.near_miss)):
        opened = mia.ask("open", text=program.as_json())
        project = {key: opened[key] for key in ("leader", "followers", "profile")}
        pupil.ask("projects/write", name="Mine", project=project)
    path, order = "/api/teacher/report.html", {"mission": "forward-and-stop"}
    answer = room.teacher.client.post(f"{path}?language=zh", json=order)
    assert rows(answer) == {"01 Mia/Mine.motorcade.json": "★★★", "02 小明/Mine.motorcade.json": "–"}
    assert room.teacher.client.post(path, json={"mission": "none"}).status_code == 404
    assert mia.client.post(path, json=order).status_code == 401
    many = [{"name": str(number), "data": ""} for number in range(MOST_FILES + 1)]
    assert room.teacher.client.post(path, json={**order, "files": many}).status_code == 400
    assert room.teacher.client.post(path, json={"text": "{}"}).json()["error"]["code"] == "not-a-mission"
    # Files from elsewhere are checked in place of the class's work; no name leads out of their folder.
    solution = mission.solution.as_json().encode()
    chosen = {
        "Kai.motorcade.json": solution,
        "../../Kai.motorcade.json": solution,
        "Anna/Mine.json": solution,
        "Anna/Mine.py": b"1 +",
        "Anna": solution,
        "anna/MINE.json": solution[:40],
        "Bo/words.image": compile_program(mission.solution).image,
        "Bo/photo.png": b"\x89PNG" + bytes(1_500_000),
        "a" * 300 + ".json": b"\xff",
    }
    files = [{"name": name, "data": b64encode(data).decode()} for name, data in chosen.items()]
    # A mission of the teacher's own comes as a file: here with one goal.
    own = json.dumps(mission.document | {"name": "Mine", "goal": mission.document["goal"][:1]})
    answer = room.teacher.client.post(f"{path}?language=en", json={"text": own, "files": files})
    assert "Mine" in answer.text
    found = rows(answer)
    assert len(found) == len(chosen)
    won = {name for name, stars in found.items() if stars == "★"}
    assert won == {"Kai.motorcade.json", "_/Kai.motorcade.json", "Anna/Mine.json", "Anna 2", "Bo/words.image"}
    assert {"Anna/Mine.py", "anna 3/MINE.json", "Bo/photo.png"} <= found.keys()
