"""Pages try programs with other luck at a server: connections and the thread around `motorcade.service.trials`."""

import base64
from contextlib import ExitStack, contextmanager

import pytest
from starlette.websockets import WebSocketDisconnect

from motorcade import compile_program
from motorcade.missions.document import built_in_mission
from motorcade.server.studio.sessions import SessionLimits
from support.remote_page import PageSocket
from support.world_page import server

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
            assert mine.until("luck") == {"works": 0, "tried": 0, "of": 20, "failed": []}
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
