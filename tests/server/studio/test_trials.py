"""Pages try programs with other luck at a server: connections and the thread around `motorcade.service.trials`."""

import base64
from contextlib import ExitStack, contextmanager
from itertools import groupby

import pytest
from starlette.websockets import WebSocketDisconnect

from motorcade import compile_program
from motorcade.missions.document import built_in_mission
from motorcade.server.studio.sessions import SessionLimits
from motorcade.service.messages import MissionChoice
from motorcade.service.trials import Explain, Failure, TrialSession, Try
from support.remote_page import PageSocket
from support.world_page import server, visitor_from

MISSION = built_in_mission("forward-and-stop")
IMAGE = base64.b64encode(compile_program(MISSION.solution, MISSION.profile).image).decode()
TRY = {"mission": {"id": MISSION.id}, "image": IMAGE, "runs": 20}


@contextmanager
def trials(client):
    with client.websocket_connect("ws://127.0.0.1:7700/api/trials") as socket:
        yield PageSocket(socket)


def test_a_page_is_told_how_often_its_program_works_with_other_luck(tmp_path) -> None:
    with server(tmp_path) as client, trials(client) as mine:
        for _ in range(2):
            mine.send("try", **TRY)
            assert mine.until("luck") == {"works": 0, "tried": 0, "of": 20, "failed": [], "stars": None}
            assert mine.until("luck", lambda luck: luck["tried"] == 20)["works"] == 20


def test_a_message_that_is_wrong_ends_nothing(tmp_path) -> None:
    with server(tmp_path) as client, trials(client) as mine:
        mine.send("try", **TRY | {"runs": 0})
        assert mine.until("error")["code"] == "bad-message"
        mine.send("try", **TRY)
        assert mine.until("luck", lambda luck: luck["tried"] == 20)["works"] == 20


def test_no_more_pages_try_programs_at_once_than_a_server_has_sessions(tmp_path) -> None:
    with server(tmp_path, sessions=SessionLimits(most=1)) as client, ExitStack() as first:
        first.enter_context(trials(client))
        with trials(client) as second:
            assert second.until("error")["code"] == "too-many-sessions"
            with pytest.raises(WebSocketDisconnect):
                second.until("nothing, until the server hangs up")
        first.close()
        with trials(client) as third:
            third.send("try", **TRY)
            assert third.until("luck", lambda luck: luck["tried"] == 20)


def test_eight_pages_of_one_visitor_get_as_many_turns_as_one_of_another(tmp_path, monkeypatch) -> None:
    turns, runs, receive, advance = [], {}, TrialSession.receive, TrialSession.advance

    def received(session, message):
        runs[session] = message.runs
        return receive(session, message)

    def advanced(session):
        turns.append(runs[session])
        return advance(session)

    monkeypatch.setattr(TrialSession, "receive", received)
    monkeypatch.setattr(TrialSession, "advance", advanced)
    with server(tmp_path) as client, ExitStack() as opened:
        hers = [opened.enter_context(trials(client)) for _ in range(8)]
        for page in hers:
            page.send("try", **TRY | {"runs": 200})
        for page in hers:
            page.until("luck", lambda luck: luck["tried"])
        with trials(visitor_from("192.168.1.7", client)) as mine:
            mine.send("try", **TRY)
            mine.until("luck", lambda luck: luck["tried"] == 20)
        between = [len(list(group)) for number, group in groupby(turns[turns.index(20) :]) if number == 200]
        assert max(between[:-1], default=0) <= 1
        opened.close()
        count = len(turns)
    assert len(turns) <= count + 1, "nothing goes on for pages that have left"


def test_a_run_of_many_cars_is_explained_a_little_at_a_time() -> None:
    """Others wait for one part of it, not for the whole run."""
    crowd = {"cars": 400, "spacing_m": 0.3, "corner_m": [0, 0], "size_m": [12, 12]}
    mat = {"tick_ms": 5, "size_m": [12, 12], "car": [{"at_m": [6, 6], "role": "leader"}], "crowd": [crowd]}
    goal = [{"kind": "travelled", "least_m": 0.1}]
    document = MISSION.document | {"mat": mat, "goal": goal, "zone": [], "seconds": 5, "seeds": [1]}
    for program in ("solution", "near_miss"):
        document.pop(program, None)
    session = TrialSession(500)
    session.receive(Try(MissionChoice(document=document), base64.b64decode(IMAGE), 1))
    while session.is_busy:
        session.advance()
    session.receive(Explain(2))
    parts = 1
    while not (told := session.advance()):
        parts += 1
    assert isinstance(told[0], Failure)
    assert parts >= 10
    assert not session.is_busy
