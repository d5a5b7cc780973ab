"""What pupils and strangers try: the teacher's addresses, other libraries, floods. Nobody else notices."""

import json
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from unittest import mock

import pytest
from starlette.routing import WebSocketRoute
from starlette.testclient import WebSocketDenialResponse

from motorcade.classroom.app import REQUESTS, make_class_app
from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.running import SESSIONS, ClassServerSettings, RunningClass
from motorcade.server.studio import workers
from motorcade.service.requests import respond
from support.class_page import FIRST_KEY, PASSWORD, class_room
from support.waiting import DEADLINE_S
from support.world_page import KEY

GUARDED = [
    *("projects/list", "nothing", "class/nothing", "teacher/nothing"),
    *(name for name, (_, exchange) in REQUESTS.items() if not exchange.is_open),
]


# All routes of the teacher, as the application has them.
with mock.patch("motorcade.classroom.app.Starlette") as made:
    make_class_app(ClassServerSettings(library=Path("none"), page=Path("none")), ClassFolder(Path("none")))
TEACHERS = [each for each in made.call_args.kwargs["routes"] if getattr(each, "path", "").startswith("/api/teacher/")]
STREAMS = [each.path.removeprefix("/api/") for each in TEACHERS if isinstance(each, WebSocketRoute)]


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A class for attacks that change nothing in it, with one pupil."""
    with class_room(tmp_path_factory.mktemp("class")) as opened:
        opened.eve = opened.join("Eve")
        yield opened


@pytest.mark.parametrize("name", GUARDED)
def test_the_teachers_requests_answer_no_pupil_and_no_guarded_one_a_stranger(shared, name):
    who, code = (shared.eve, "teacher") if name.startswith("teacher/") else (shared.browser(), "class")
    answer = who.client.post(f"/api/{name}", content="{}")
    assert (answer.status_code, answer.json()["error"]["code"]) == (401, f"{code}-session-needed")


@pytest.mark.parametrize("path", [*(each.path for each in TEACHERS), "/api/teacher/../teacher/freeze"])
@pytest.mark.parametrize("method", ["GET", "POST", "PUT", "DELETE", "OPTIONS"])
def test_no_other_way_leads_to_what_is_the_teachers(shared, path, method):
    assert shared.eve.client.request(method, path).status_code in (401, 404)


@pytest.mark.parametrize("path", [*STREAMS, "teacher/watch?pupil=01", "teacher/nothing"])
def test_the_teachers_streams_refuse_pupils_and_strangers(shared, path):
    for browser in (shared.eve, shared.browser()):
        with pytest.raises(WebSocketDenialResponse) as refused, browser.open(path):
            pass
        assert refused.value.status_code == 401


def test_a_session_that_was_ended_or_made_up_is_nobodys(room):
    mia, thief = room.join("Mia"), room.browser()
    for owner, end, asks, code in (
        (mia, "class/leave", "projects/list", "class-session-needed"),
        (room.teacher, "teacher/sign-out", "teacher/freeze", "teacher-session-needed"),
    ):
        ((name, secret),) = owner.client.cookies.items()
        assert owner.ask(end) == {}
        for value in (secret, "", "01", mia.id, "x" * 5000, "\\"):
            thief.client.cookies.set(name, value)
            assert thief.ask(asks) == code


def test_guessed_projects_of_others_are_not_there(room):
    mia, ben = room.join("Mia"), room.join("Ben")
    mia.save("Robot")
    for name in ("Robot", "../01/Robot", "owners/01/Robot", "01/Robot", "..\\01\\Robot"):
        assert ben.ask("projects/read", name=name) in ("no-project", "bad-project-name")
        assert ben.ask("projects/delete", name=name) in ("no-project", "bad-project-name")
        assert ben.ask("projects/history", name=name) in ("no-project", "bad-project-name")
    assert ben.ask("projects/read", name="Robot", owner="01") == "no-project"
    assert ben.save("Robot") == 1, "a project of one's own"
    assert mia.ask("projects/history", name="Robot") != ben.ask("projects/history", name="Robot")


def test_a_world_of_another_pupil_is_not_taken_over(room):
    mia, ben = room.join("Mia"), room.join("Ben")
    with mia.open(f"world?session={KEY}") as hers:
        hers.set()
        with ben.open(f"world?session={KEY}") as his:
            kind, refused = his.next()
            assert (kind, refused["code"]) == ("error", "bad-session")
        assert ben.client.get(f"/api/world/{KEY}/timeline.csv").json()["error"]["code"] == "no-world"
        hers.send("step")
        assert hers.until("state", lambda state: state["t_ms"])["t_ms"] == 5


def test_a_pupil_has_one_world_and_takes_no_place_from_others(tmp_path):
    with class_room(tmp_path, sessions=SESSIONS._replace(most=2)) as room, ExitStack() as pages:
        eve, mia = room.join("Eve"), room.join("Mia")
        hers = [pages.enter_context(eve.open(f"world?session={number:032x}")) for number in range(3)]
        for page in hers[:2]:
            assert page.until("error")["code"] == "taken-over"
        with mia.open(f"world?session={KEY}") as page:
            page.set()
        hers[2].set()


def test_a_flood_from_one_tablet_or_a_stranger_is_refused_and_others_notice_nothing(room):
    eve, mia, stranger = room.join("Eve"), room.join("Mia"), room.browser()
    for flood, request in ((eve, "capabilities"), (stranger, "class/about")):
        answers = [flood.ask(request) for _ in range(60)]
        assert answers.count("requests-too-fast") == 60 - 40
    assert mia.ask("capabilities")["classroom"] == "pupil"
    assert mia.save("Robot") == 1
    assert mia.ask("class/about")["me"]["name"] == "Mia"
    assert room.browser().ask("class/about")["is_open"]
    assert room.teacher.ask("teacher/freeze", frozen=False) == {}


def test_a_pupil_who_asks_for_much_at_once_keeps_nobody_waiting(room, monkeypatch):
    eve, mia = room.join("Eve"), room.join("Mia")
    goes_on, arrived = threading.Event(), threading.Semaphore(0)
    check = RunningClass.check_request

    def counted(visitors, visitor):
        check(visitors, visitor)
        arrived.release()

    def slow(name, data, context):
        if context.owner == eve.id:
            assert goes_on.wait(DEADLINE_S)
        return respond(name, data, context)

    monkeypatch.setattr(workers, "respond", slow)
    monkeypatch.setattr(RunningClass, "check_request", counted)
    with ThreadPoolExecutor(8) as pool:
        hers = [pool.submit(eve.ask, "capabilities") for _ in range(8)]
        try:
            assert all(arrived.acquire(timeout=DEADLINE_S) for _ in hers)
            assert mia.ask("capabilities")["classroom"] == "pupil"
        finally:
            goes_on.set()
        assert all(answer.result()["classroom"] == "pupil" for answer in hers)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("join", {"code": "A" * 200, "name": "x", "avatar": "bus"}),
        ("join", {"code": 5}),
        ("join", []),
        ("hand", {"raised": True, "pupil": "02"}),
        ("give", {"to": "../..", "name": "x"}),
        ("seen", {"number": "1"}),
        ("mission", {"number": 10**30}),
        ("take", {"name": "x" * 200, "wants": True}),
        ("mat", {"image": "AAAA"}),
        ("nothing", {}),
    ],
)
def test_any_message_gives_a_sentence(shared, name, message):
    answer = shared.eve.client.post(f"/api/class/{name}", content=json.dumps(message))
    assert 400 <= answer.status_code < 500
    assert answer.json()["error"]["sentence"]["zh"]


def test_pupils_cannot_steal_each_others_place_by_giving(room):
    mia, ben = room.join("Mia"), room.join("Ben")
    mia.save("Robot", profile="classroom")
    ben.save("Robot")
    assert mia.ask("class/give", to=ben.id, name="Robot") == "Robot (Mia)"
    assert mia.ask("class/give", to=ben.id, name="Robot") == "Robot (Mia) 2"
    assert ben.names() == ["Robot", "Robot (Mia)", "Robot (Mia) 2"]
    assert mia.ask("class/give", to=ben.id, name="Nothing") == "no-project"
    assert mia.ask("class/give", to="99", name="Robot") == "no-such-pupil"
    answers = [mia.ask("class/give", to=ben.id, name="Robot") for _ in range(10)]
    assert answers[-1] == "gives-too-often"
    with ben.open("class/stream") as page:
        news = page.until("pupil")["news"]
    assert (news[0]["kind"], news[0]["name"], news[0]["sender"]) == ("project", "Robot (Mia)", "Mia")


@pytest.mark.parametrize("path", ["class/stream", *STREAMS, f"world?session={KEY}", "upload"])
def test_a_page_of_another_site_opens_no_stream_with_the_browsers_cookies(shared, path):
    """`tests/server/test_request_filter.py` has more origins."""
    origin = "https://192.168.1.5:7711"
    for browser in (shared.eve, shared.teacher):
        with (
            pytest.raises(WebSocketDenialResponse) as refused,
            browser.client.websocket_connect(f"ws://192.168.1.5:7710/api/{path}", headers={"origin": origin}),
        ):
            pass
        assert refused.value.status_code == 403
        for header, value in (("origin", origin), ("host", "evil.example")):
            asked = browser.client.post("/api/class/about", content="{}", headers={header: value})
            assert asked.json()["error"]["code"] == f"foreign-{header}"


@pytest.mark.parametrize("scheme", ["http", "https"])
def test_no_script_and_no_other_site_gets_a_cookie_and_https_keeps_it_secret(room, scheme):
    joins = json.dumps({"code": room.code, "name": "Mia", "avatar": "bus"})
    answer = room.browser().client.post(f"{scheme}://192.168.1.5:7710/api/class/join", content=joins)
    cookie = answer.headers["set-cookie"].lower()
    assert cookie.startswith("motorcade_class_"), "of this server alone"
    assert cookie.split("=")[1].split(";")[0] not in answer.text.lower()
    kept = {part.strip() for part in cookie.split(";")}
    assert {"httponly", "samesite=strict"} <= kept
    assert ("secure" in kept) == (scheme == "https")


def test_no_page_and_no_redirect_holds_a_secret_and_none_is_sent_to_another_site(shared):
    for browser in (shared.eve, shared.teacher, shared.browser()):
        for path in ("/", "/join", "/teacher", "/wall", "/privacy"):
            answer = browser.client.get(path)
            assert answer.headers["referrer-policy"] == "no-referrer"
            said = answer.text + str(answer.headers)
            assert not any(secret in said for secret in (shared.code, shared.eve.number, FIRST_KEY, PASSWORD))


def test_what_a_pupil_imports_stays_in_the_own_library(room, tmp_path):
    mia, ben = room.join("Mia"), room.join("Ben")
    ben.save("Robot")
    before = sorted(each.name for each in tmp_path.iterdir())
    text = ben.ask("projects/export")["text"]
    for name in ("../../class", "..", "C:\\x", "02/Robot", ""):
        file = json.loads(text)
        file["projects"][0]["name"] = name
        assert mia.ask("projects/import", text=json.dumps(file)) == "no-projects-file"
    assert mia.ask("projects/import", text=text)["projects"][0]["stored_as"] == "Robot"
    assert ben.names() == ["Robot"]
    assert sorted(each.name for each in tmp_path.iterdir()) == before
    assert sorted(each.name.partition("-")[0] for each in (tmp_path / "owners").iterdir()) == ["01", "02"]
