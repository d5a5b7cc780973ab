"""Who is out does nothing any more: also not by a request whose head came before, and whose body comes behind."""

import json
import re
from contextlib import ExitStack, contextmanager, suppress
from http.client import HTTPConnection
from random import Random
from unittest import mock

import pytest
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocketDisconnect

from motorcade.classroom import running
from motorcade.classroom.app import REQUESTS, make_class_app
from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.network import Network
from motorcade.classroom.pairs import Pairs
from motorcade.classroom.record import Pair, from_bytes, owners_of
from motorcade.classroom.running import ClassServerSettings
from motorcade.errors import MotorcadeError
from motorcade.server.studio.library import OWNERS, folder_of
from motorcade.service import requests as studio
from motorcade.service.messages import Nothing
from support.class_page import FIRST_KEY, HERE, PASSWORD, PROJECT, class_room
from support.classrooms import refused, with_pupils
from support.served_app import served
from support.waiting import DEADLINE_S

pytestmark = pytest.mark.server
_MESSAGES = {
    "class/draft/write": {"name": "x", "project": PROJECT},
    "class/give": {"to": "02", "name": "Robot"},
    "class/mission": {"number": 1},
    "class/mat": {"image": None},
    "class/pair/begin": {"to": "02", "name": "Parade", "project": PROJECT},
    "class/pair/read": {"window": "leader"},
    "class/pair/take": {"window": "leader", "wants": True},
    "class/pair/write": {"pair": "1", "window": "leader", "project": PROJECT, "base": 0},
    "class/pair/open": {"pair": "1", "name": "Parade", "project": PROJECT, "mission": {"id": "follow-me"}},
    "class/pair/swap": {"wants": True},
    "class/pair/conduct": {"playing": True, "speed": 1, "seed": 1, "t_ms": 0},
    "class/seen": {"number": 1},
    "class/hand": {"raised": True},
    "class/take": {"name": "", "wants": True},
    "projects/write": {"name": "Late", "project": PROJECT},
    "projects/import": {"text": json.dumps({"format": "motorcade-projects/1", "projects": [], "stars": {"x": [1]}})},
    "missions/write": {"name": "Late", "document": {}},
    "teacher/settings": {"title": "Late"},
    "teacher/rename": {"pupil": "02", "name": "Late"},
    "teacher/remove": {"pupil": "02"},
    "teacher/hand-out": {"name": "Late", "project": PROJECT},
    "teacher/end": {"password": PASSWORD},
    "teacher/report.html": {"mission": "follow-me"},
}
PUPILS = [name for name, (_, exchange) in REQUESTS.items() if name.startswith("class/") and not exchange.is_open]
PUPILS += [name for name, request in studio.REQUESTS.items() if request.message is not Nothing]
TEACHERS = [name for name, (_, exchange) in REQUESTS.items() if name.startswith("teacher/") and not exchange.is_open]
TEACHERS += ["teacher/report.html"]


MANY = 100_000


class Tablet:
    """A browser at the socket of a class's server, which keeps one cookie."""

    def __init__(self, address):
        self._address = address
        self._cookie = ""

    def send(self, path, message=None, **more):
        """Send the head of a request; return what sends its body, and gives the answer."""
        body = json.dumps(message or {}).encode()
        connection = HTTPConnection(*self._address, timeout=DEADLINE_S)
        connection.putrequest("POST", f"/api/{path}")
        heads = {"Cookie": self._cookie, "Content-Length": str(len(body)), **more}
        for name, value in heads.items():
            connection.putheader(name, value)
        connection.endheaders()

        def end():
            connection.send(body)
            answer = connection.getresponse()
            if cookie := answer.getheader("set-cookie"):
                self._cookie = cookie.partition(";")[0]
            data = answer.read()
            connection.close()
            return answer.status, data

        return connection.sock, end

    def ask(self, path, **message):
        """The answer to a whole request; the code of the error where it is refused."""
        status, data = self.send(path, message)[1]()
        return json.loads(data) if status == 200 else json.loads(data)["error"]["code"]

    def begin(self, path):
        """Send the head of a request, wait until the server waits for the body; return what sends that."""
        sock, end = self.send(path, _MESSAGES.get(path), Expect="100-continue")
        seen = b""
        while b"\r\n\r\n" not in seen:
            seen += sock.recv(1)
        assert seen.startswith(b"HTTP/1.1 100 ")
        return end


class Room:
    """A class at a socket."""

    def __init__(self, address, folder):
        self.address, self.folder = address, folder
        self.teacher = Tablet(address)
        assert self.teacher.ask("teacher/first-password", key=FIRST_KEY, password=PASSWORD) == {}

    def join(self, name):
        code = self.teacher.ask("teacher/addresses")["code"]
        tablet = Tablet(self.address)
        tablet.id = tablet.ask("class/join", code=code, name=name, avatar="bus")["id"]
        return tablet

    def stored_for(self, owner):
        """Whatever is stored for an owner."""
        names = [owner, f"{owner}~missions"]
        return [name for name in names if (self.folder / OWNERS / folder_of(name)).exists()]


@contextmanager
def begun(folder):
    """A class at a socket, in a folder."""
    files = ClassFolder(folder)
    here = Network(["127.0.0.1"], 7710)
    settings = ClassServerSettings(
        library=folder, page=folder, first_key=FIRST_KEY, network=here, requests_a_second=MANY
    )
    # Tests ask as fast as the computer can.
    unlimited = mock.patch.object(running, "_REQUESTS_A_SECOND", MANY)
    with unlimited, files.opened(), served(lambda: make_class_app(settings, files)) as address:
        yield Room(address, folder)


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    with begun(tmp_path_factory.mktemp("class")) as opened:
        opened.ben = opened.join("Ben")
        yield opened


@pytest.mark.parametrize("path", PUPILS)
def test_a_pupil_who_was_removed_before_the_body_came_has_done_nothing(room, path):
    mia = room.join("Mia")
    assert mia.ask("projects/write", name="Robot", project=PROJECT)["version"] == 1
    _MESSAGES["class/give"]["to"] = _MESSAGES["class/pair/begin"]["to"] = room.ben.id
    end = mia.begin(path)
    assert room.teacher.ask("teacher/remove", pupil=mia.id) == {}
    status, data = end()
    assert (status, json.loads(data)["error"]["code"]) == (401, "class-session-needed")
    assert room.stored_for(mia.id) == []
    assert [each["name"] for each in room.ben.ask("projects/list")] == []
    assert room.ben.ask("class/pair/leave") == "", "nobody has begun a pair with him"
    assert not list((room.folder / OWNERS).glob("pair-*"))


@pytest.mark.parametrize("path", TEACHERS)
def test_a_teacher_who_was_signed_out_before_the_body_came_has_done_nothing(room, path):
    other = Tablet(room.address)
    assert other.ask("teacher/sign-in", password=PASSWORD) == {}
    end = other.begin(path)
    signed_out = Tablet(room.address)
    signed_out._cookie = other._cookie
    assert signed_out.ask("teacher/sign-out") == {}
    status, data = end()
    assert (status, json.loads(data)["error"]["code"]) == (401, "teacher-session-needed")
    assert room.ben.ask("class/about")["me"]["name"] == "Ben"
    assert room.ben.ask("projects/list") == []


def test_after_the_end_of_the_class_nothing_of_a_late_draft_stays(tmp_path):
    with begun(tmp_path) as room:
        mia = room.join("Mia")
        ends = [mia.begin(path) for path in ("class/draft/write", "class/pair/begin", "projects/import")]
        assert room.teacher.ask("teacher/end", password=PASSWORD) == {}
        assert {end()[0] for end in ends} == {401}
        assert not list((tmp_path / OWNERS).glob("*"))


@pytest.mark.parametrize("path", ["api/trials", "drive/ws", "api/class/stream"])
def test_a_socket_of_somebody_who_is_out_ends_and_a_message_on_its_way_does_nothing(tmp_path, path):
    now = [100.0]
    with class_room(tmp_path, clock=lambda: now[0]) as room:
        mia = room.join("Mia")
        for says_something in (True, False):
            with mia.client.websocket_connect(f"ws{HERE.removeprefix('http')}/{path}") as socket:
                room.teacher.ask("teacher/remove", pupil=mia.id)
                if says_something:
                    socket.send_text('{"do": "start"}')
                now[0] += 2.0
                received = []
                # Trials say nothing by themselves.
                with suppress(WebSocketDisconnect):
                    while says_something or path != "api/trials":
                        received.append(socket.receive_json())
            mia = room.join("Mia")


@pytest.mark.parametrize(("who", "goes_out"), [("pupil", "class/leave"), ("teacher", "teacher/sign-out")])
def test_each_socket_of_somebody_who_is_out_ends_also_where_nothing_is_said(tmp_path, who, goes_out):
    queries = {"/api/world": f"?session={'1' * 32}", "/api/teacher/watch": "?pupil=01"}
    with class_room(tmp_path) as room, ExitStack() as pages:
        mia, teacher = room.join("Mia"), room.browser()
        assert teacher.ask("teacher/sign-in", password=PASSWORD) == {}
        routes = [route.path for route in mia.client.app._app.routes if isinstance(route, WebSocketRoute)]
        paths = {
            "pupil": [path for path in routes if not path.startswith("/api/teacher/")],
            "teacher": [path for path in routes if path != "/api/class/stream"],
        }[who]
        browser = {"pupil": mia, "teacher": teacher}[who].client
        sockets = [
            pages.enter_context(
                browser.websocket_connect(f"ws{HERE.removeprefix('http')}{path}{queries.get(path, '')}")
            )
            for path in paths
        ]
        # Another tab of the browser: a page that leaves closes what it has.
        tab = room.browser()
        tab.client.cookies.update(browser.cookies)
        assert tab.ask(goes_out) == {}
        for socket in sockets:
            while socket.receive()["type"] != "websocket.close":
                pass


def test_a_start_deletes_what_belongs_to_nobody_and_takes_who_is_out_from_pairs(tmp_path, caplog):
    with class_room(tmp_path) as room:
        eve, mia, ben = room.join("Eve"), room.join("Mia"), room.join("Ben")
        assert mia.ask("class/pair/begin", to=ben.id, name="Parade", project=PROJECT) == {}
        assert ben.ask("class/pair/join") == {}
        room.teacher.ask("teacher/remove", pupil=eve.id)
        cookies = dict(mia.client.cookies)
    file = tmp_path / "class.json"
    record = json.loads(file.read_text(encoding="utf-8"))
    # As a late request of somebody who is out, or of the teacher, once left it.
    pair = record["pairs"][0]
    pair["members"][1] = pair["joined"][1] = pair["owners"]["followers"] = "01"
    record["pairs"].append(pair | {"id": "2", "members": ["teacher"], "joined": ["teacher"], "owners": {}})
    record["paired"] = 2
    file.write_text(json.dumps(record), encoding="utf-8")
    for owner in ("01", "01~missions", "pair-2"):
        made = tmp_path / OWNERS / folder_of(owner)
        made.mkdir(parents=True)
        (made / "draft.json").write_bytes(b"{}")
    with class_room(tmp_path, first_key=None, files=ClassFolder(tmp_path)) as room:
        again = room.browser()
        again.client.cookies.update(cookies)
        with again.open("class/stream") as page:
            view = page.until("pupil")["pair"]
        assert (view["partner"], view["owners"]) == (None, {"leader": mia.id, "followers": None})
        assert {re.sub("-[0-9a-f]{8}$", "", each.name) for each in (tmp_path / OWNERS).iterdir()} == {"pair-1"}
        assert again.ask("class/pair/leave") == "Parade"
    assert caplog.records == []


@pytest.mark.parametrize("changes", [{"joined": 0, "pupils": []}, None])
def test_a_class_whose_file_is_missing_or_older_than_the_work_is_refused_in_a_sentence(tmp_path, changes):
    with class_room(tmp_path) as room:
        room.join("Mia").save("Robot")
    file = tmp_path / "class.json"
    if changes:
        file.write_text(json.dumps(json.loads(file.read_text(encoding="utf-8")) | changes), encoding="utf-8")
    else:
        file.unlink()
    files = ClassFolder(tmp_path)
    with files.opened():
        assert "class.json" in str(refused("class-without-record", files.load, Random(1).randrange))
    assert len(list((tmp_path / OWNERS).iterdir())) == 1


def test_a_file_with_one_wrong_bit_has_nobodys_work_deleted(tmp_path):
    """A start deletes the libraries of whom the file doesn't have."""
    with class_room(tmp_path) as room:
        mia, ben = room.join("Mia"), room.join("Ben")
        mia.save("Robot")
        ben.save("Robot")
        assert mia.ask("class/pair/begin", to=ben.id, name="Parade", project=PROJECT) == {}
    good, files = (tmp_path / "class.json").read_bytes(), ClassFolder(tmp_path)
    stored = files.owners()
    assert len(stored) == 3
    for place in range(len(good)):
        bad = bytearray(good)
        bad[place] ^= 1 << place % 7
        with suppress(MotorcadeError):
            assert stored <= owners_of(from_bytes(bytes(bad), "class.json")), good[place - 9 : place + 9]


def test_one_bad_record_stops_neither_the_clock_of_the_class_nor_what_is_known_of_others(caplog):
    room = with_pupils("Mia", "Ben")
    pairs = Pairs(room)
    for pupil in ("01", "02"):
        room.connect(pupil, 0.0)
        room.note(pupil, lambda presence: presence.open_mission("first-drive", 0.0))
    room.presence["01"].step_s = None
    with pytest.raises(ExceptionGroup) as told:
        room.advance(1000.0)
    assert "Presence" in told.value.exceptions[0].__notes__[0]
    assert room.presence["02"].stuck
    room.record.pairs += [Pair("1", "Parade", ["09"], ["09"], {}), Pair("2", "Parade", ["02"], ["02"], {})]
    pairs.advance(1000.0)
    assert pairs.view("02", 1000.0).name == "Parade"
