"""Pages' worlds at a server: sessions, threads and queues around `motorcade.service.world_session`."""

import asyncio
import csv
import io
import json
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import count, pairwise

import pytest
from starlette.websockets import WebSocketDisconnect

from motorcade.errors import MotorcadeError
from motorcade.server.page_socket import PageSocket
from motorcade.server.request_filter import ServerSettings
from motorcade.server.studio import driving, sessions, workers
from motorcade.server.studio.sessions import SessionLimits, do_in_turn
from motorcade.service.history import FIRST
from motorcade.service.world_messages import Play, State
from motorcade.service.world_session import WorldSession
from support.mock_clock import mock_clock
from support.waiting import DEADLINE_S
from support.world_page import KEY, MAT, OTHER, SET, THIRD, page, server, visitor_from


def test_a_page_sets_a_world_and_sees_it_drive(client) -> None:
    with page(client) as mine:
        assert mine.until("hello") == {"session": KEY, "cars": 0, "resumed": False}
        assert mine.set() == {
            "session": KEY,
            "resumed": False,
            "cars": 3,
            "leads": [0],
            "tick_ms": 5,
            "radius_m": 0.075,
            "range_m": 1.0,
        }
        first = mine.until("picture")
        assert (first.t_ms, first.flags, first.cars) == (0, FIRST, 3)
        mine.send("play", speed=16)
        driven = mine.until("picture", lambda picture: picture.t_ms > 500)
        assert driven.moment.x_m[0] > 0.05
        assert mine.until("state", lambda state: state["counts"]["heard"] > 0)["playing"]
        mine.send("pause")
        assert not mine.until("state", lambda state: not state["playing"])["playing"]


def test_the_world_of_a_page_that_stays_away_is_dropped(client, monkeypatch) -> None:
    monkeypatch.setattr(sessions, "GRACE_S", 0)
    with page(client) as mine:
        mine.set()
    client.portal.call(lambda: None)
    with page(client) as mine:
        assert not mine.until("hello")["resumed"]


def test_as_many_worlds_are_computed_at_once_as_there_are_processors(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    together, receive = threading.Barrier(3), WorldSession.receive

    def meet(session, message):
        if isinstance(message, Play):
            together.wait(DEADLINE_S)
        return receive(session, message)

    with server(tmp_path) as client, ExitStack() as held:
        pages = [held.enter_context(page(client, key)) for key in (KEY, OTHER, THIRD)]
        for shown in pages:
            shown.set()
        monkeypatch.setattr(WorldSession, "receive", meet)
        for shown in pages:
            shown.send("play", speed=1)
        for shown in pages:
            assert shown.until("state", lambda state: state["playing"])


def test_a_second_page_with_the_session_takes_it_over(client, monkeypatch) -> None:
    monkeypatch.setattr(sessions, "GRACE_S", 0)
    with page(client) as first:
        first.set()
        with page(client) as second:
            assert second.until("hello")["cars"] == 3
            assert first.until("error")["code"] == "taken-over"
            with pytest.raises(WebSocketDisconnect):
                first.until("nothing, until the server hangs up")
            second.send("step")
            assert second.until("state", lambda state: state["t_ms"])["t_ms"] == 5
            # The first one's end takes nothing from the second.
            with page(client) as third:
                assert third.until("hello")["resumed"]
                assert second.until("error")["code"] == "taken-over"


@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        ("[" * 100_000, "bad-message", ""),
        (json.dumps({"do": "move", "car": 99, "x_m": 1, "y_m": 1}), "bad-world", "car is 99"),
        (json.dumps(SET | {"mat": MAT | {"crowd": [{"cars": 1998}]}}), "too-many-cars", "2,000"),
        (json.dumps({"do": "say", "word": "x" * (1 << 20)}), "message-too-long", "smaller"),
    ],
)
def test_an_invalid_message_is_refused_in_every_language_and_the_world_goes_on(client, text, code, says) -> None:
    with page(client) as mine:
        mine.set()
        mine._socket.send_text(text)
        error = mine.until("error")
        assert error["code"] == code
        assert says in error["sentence"]["en"]
        assert "。" in error["sentence"]["zh"]
        mine._socket.send_bytes(b"\0")
        assert mine.until("error")["code"] == "bad-message"
        mine.send("step")
        assert mine.until("state", lambda state: state["t_ms"])["t_ms"] == 5


def test_the_queue_of_a_page_that_reads_nothing_is_bounded_and_has_the_newest_state() -> None:
    sent = []

    class SessionSocket:
        async def send_text(self, text: str) -> None:
            sent.append(json.loads(text))

        async def close(self) -> None:
            sent.append("closed")

    waiting = PageSocket(SessionSocket(), ServerSettings(), (State,))
    for t_ms in range(1000):
        waiting.put(State(True, 1.0, t_ms, None, 0, 0, {}, 1.0, []))
        waiting.refuse(MotorcadeError("no-world"))
    waiting.refuse(MotorcadeError("taken-over"), closing=True)
    asyncio.run(waiting.send_all())
    assert len(sent) < 100
    assert [each["t_ms"] for each in sent[:-1] if each["is"] == "state"] == [999]
    assert (sent[-2]["code"], sent[-1]) == ("taken-over", "closed"), "the reason comes, whatever waited before it"


@pytest.mark.parametrize("key", ["x" * 32, KEY + "0"])
def test_a_page_without_a_valid_session_is_disconnected(client, key) -> None:
    with page(client, key) as mine:
        assert mine.until("error")["code"] == "bad-session"
        with pytest.raises(WebSocketDisconnect):
            mine.next()


@pytest.mark.parametrize(
    ("limits", "code"),
    [
        (SessionLimits(most=1), "too-many-sessions"),
        (SessionLimits(most=9, most_of_one_visitor=1), "too-many-sessions-of-one"),
    ],
)
def test_where_all_places_are_taken_pages_that_left_or_are_idle_give_way(tmp_path, limits, code) -> None:
    times_s = [0.0]
    with server(tmp_path, sessions=limits, clock=lambda: times_s[0]) as client:
        with page(client) as mine:
            mine.set()
            with page(client, OTHER) as its:
                assert its.until("error")["code"] == code
        with page(client, OTHER) as its:
            assert its.until("hello")["cars"] == 0
            its.set()
            times_s[0] += sessions.IDLE_S - 1
            # Whatever a page sends shows that it is used.
            its.send("step")
            its.until("state", lambda state: state["t_ms"])
            times_s[0] += 2
            with page(client, THIRD) as newcomer:
                assert newcomer.until("error")["code"] == code
            times_s[0] += sessions.IDLE_S
            with page(client, THIRD) as newcomer:
                assert newcomer.set()["cars"] == 3
                error = its.until("error")
                assert error["code"] == "session-was-idle"
                assert "10 minutes" in error["sentence"]["en"]
                with pytest.raises(WebSocketDisconnect):
                    its.next()
                newcomer.send("step")
                newcomer.until("state", lambda state: state["t_ms"] == 5)


def test_a_visitor_with_many_sessions_takes_none_from_others(tmp_path) -> None:
    limits = SessionLimits(most=3, most_of_one_visitor=2)
    with server(tmp_path, sessions=limits) as client:
        other = visitor_from("10.0.0.9", client)
        with page(other) as theirs:
            theirs.set()
            theirs.send("step")
        for key in (OTHER, THIRD, "b" * 32):
            with page(client, key) as mine:
                mine.set()
        # Its own first session gave way, and not the older one of the other visitor.
        with page(other) as theirs:
            assert theirs.until("hello")["resumed"]
        with page(client, OTHER) as mine:
            assert not mine.until("hello")["resumed"]


def test_a_page_that_sends_too_fast_is_disconnected(tmp_path) -> None:
    with server(tmp_path, messages_a_second=5, clock=lambda: 0.0) as client, page(client) as mine:
        for _ in range(11):
            mine.send("shown", frame=0)
        assert mine.until("error")["code"] == "too-many-messages"
        with pytest.raises(WebSocketDisconnect):
            mine.next()


class Held:
    """What takes until the test has tried everything else."""

    def __init__(self) -> None:
        self._begun, self._ended, self._is_late = threading.Event(), threading.Event(), []

    def take_long(self) -> None:
        self._begun.set()
        self._is_late.append(not self._ended.wait(DEADLINE_S))

    @contextmanager
    def meanwhile(self):
        """Run the block while something takes long; the block must not wait for that."""
        assert self._begun.wait(DEADLINE_S)
        try:
            yield
            assert not self._is_late
        finally:
            self._ended.set()


@pytest.fixture
def held() -> Held:
    return Held()


def test_a_slow_world_does_not_delay_a_fast_one(client, monkeypatch, held) -> None:
    heavy = MAT | {"tick_ms": 1, "size_m": [12, 12], "crowd": [{"cars": 1900, "leaders": 60}]}
    advance = WorldSession.simulate

    def take_long(session: WorldSession, now_s: float) -> None:
        # The server's loop itself draws what was quick the last time, as standing still is.
        if session.playing and threading.current_thread().name.startswith("AnyIO worker"):
            held.take_long()
        advance(session, now_s)

    monkeypatch.setattr(WorldSession, "simulate", take_long)
    with page(client) as its, page(client, OTHER) as mine:
        its.set(mat=heavy)
        its.send("play", speed=16)
        with held.meanwhile():
            mine.set()
            for ticks in range(1, 11):
                mine.send("step")
                mine.until("state", lambda state, ticks=ticks: state["t_ms"] == 5 * ticks)
        its.until("state", lambda state: state["t_ms"])


def test_no_picture_of_a_page_waits_while_many_others_build_large_worlds(client, monkeypatch, held) -> None:
    build = driving.open_world

    def take_long(message, **rest):
        if message.seed == 99:
            held.take_long()
        return build(message, **rest)

    monkeypatch.setattr(driving, "open_world", take_long)
    # Each picture of the page is made in a thread.
    monkeypatch.setattr(sessions, "_QUICK_S", 0)
    others = [f"{number:032x}" for number in range(4)]
    with page(client) as mine, ExitStack() as stack:
        mine.set()
        for key in others:
            stack.enter_context(page(client, key))._socket.send_text(json.dumps(SET | {"seed": 99}))
        with held.meanwhile():
            mine.send("play")
            for _ in range(5):
                mine.send("shown", frame=mine.until("picture").number)
            mine.send("move", car=2, x_m=1, y_m=1)
            mine.until("picture", lambda picture: picture.moment.x_m[2] == 1)


def test_requests_that_take_long_keep_no_other_waiting(client, monkeypatch, held) -> None:
    allowed = {}

    def take_long(name, data, context, most_s, given_up):
        allowed[name] = most_s
        if name == "missions/check":
            held.take_long()
        return b"{}"

    monkeypatch.setattr(workers, "answer_in_process", take_long)
    with ThreadPoolExecutor(8) as pool:
        asked = [pool.submit(client.post, "/api/missions/check", json={}) for _ in range(8)]
        with held.meanwhile():
            assert client.post("/api/profiles").status_code == 200
            assert client.post("/api/open", json={"text": ""}).status_code == 200
            assert client.post("/api/projects/import", json={"text": ""}).status_code == 200
    assert {each.result().status_code for each in asked} == {200}
    assert allowed == {"missions/check": 30.0, "open": 1.0, "projects/import": 10.0}


def test_the_events_of_a_run_are_a_table(client) -> None:
    with page(client) as mine:
        mine.set()
        mine.send("step", ticks=100)
        mine.until("state", lambda state: state["t_ms"])
        answer = client.get(f"/api/world/{KEY}/timeline.csv")
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert answer.headers["content-type"].startswith("text/csv")
    assert {row["event"] for row in rows} == {"state", "frame", "heard", "start"}
    first = {"t_ms": "0", "car": "0", "event": "state", "why": "", "word": rows[0]["word"], "other": "0", "tag": "0"}
    assert rows[0] == first
    assert rows[0]["word"].startswith("0x6")


# Worlds that are late


def test_a_world_that_takes_long_goes_on_in_steps_that_are_short_for_the_others(tmp_path) -> None:
    # By this clock each step takes a second.
    seconds = count()
    with server(tmp_path, clock=lambda: float(next(seconds))) as client, page(client) as mine:
        tick_ms = mine.set()["tick_ms"]
        mine.send("play", speed=16)
        # A page that a busy computer wakes late misses pictures, but hardly all of a thousand.
        times_ms = (mine.until("picture").t_ms for _ in range(1000))
        assert any(later - earlier == tick_ms for earlier, later in pairwise(times_ms))


@mock_clock
async def test_where_all_worlds_are_late_requests_come_between_and_pictures_are_equally_many():
    turns, pictures = asyncio.Lock(), [0] * 50

    def draw(world):
        pictures[world] += 1

    async def play(world):
        while True:
            await do_in_turn(turns, partial(draw, world))

    playing = [asyncio.create_task(play(world)) for world in range(50)]
    for _ in range(1000):
        await asyncio.sleep(0)
    before = sum(pictures)
    # A request takes some rounds of the loop: its bytes, a thread, its answer.
    for _ in range(6):
        await asyncio.sleep(0)
    assert sum(pictures) - before <= 6
    assert before >= 400
    assert max(pictures) - min(pictures) <= 1
    for task in playing:
        task.cancel()
