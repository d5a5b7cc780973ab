"""What a page downloads of a run: events as a table, and films."""

import asyncio
import base64
import csv
import io

import pytest

from motorcade import World
from motorcade.mats.document import mat_of
from motorcade.server.studio.app import recording_of
from motorcade.service.studio_world import StudioWorld
from motorcade.service.world_messages import Step
from motorcade.service.world_session import WorldSession
from support.waiting import until
from support.world_page import IMAGE, KEY, MAT, OTHER, page, server


@pytest.fixture
def client(tmp_path):
    with server(tmp_path) as served:
        yield served


def test_the_timeline_is_a_table(client) -> None:
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


def test_a_run_becomes_a_film(client) -> None:
    with page(client) as mine:
        mine.set()
        assert client.get(f"/api/world/{KEY}/run.gif").json()["error"]["code"] == "nothing-to-draw"
        mine.send("step", ticks=100)
        mine.until("state", lambda state: state["t_ms"])
        answer = client.get(f"/api/world/{KEY}/run.gif?seconds=0.3")
    assert answer.content.startswith(b"GIF89a")
    assert "run.gif" in answer.headers["content-disposition"]


def test_of_many_films_few_wait_and_none_is_drawn_for_a_client_that_left(client, monkeypatch) -> None:
    drawn, finish, hang_up = [], asyncio.Event(), asyncio.Event()

    async def draw(run, file):
        drawn.append(file)
        await finish.wait()
        return b"film"

    async def get(leaves: bool) -> int:
        """Request a film as a server's client does; give the status, 0 for one that left."""
        messages = [{"type": "http.request"}]
        statuses = []

        async def receive():
            if messages:
                return messages.pop()
            await (hang_up if leaves else asyncio.Event()).wait()
            return {"type": "http.disconnect"}

        async def send(message):
            statuses.append(message.get("status"))

        path = f"/api/world/{KEY}/run.gif"
        scope = {"type": "http", "method": "GET", "path": path, "query_string": b"", "scheme": "http"}
        await client.app(scope | {"headers": [(b"host", b"127.0.0.1:7700")], "client": ("127.0.0.1", 1)}, receive, send)
        return statuses[0]

    async def flood() -> tuple[int, int]:
        requests = [asyncio.create_task(get(leaves=True)) for _ in range(50)]
        await until(lambda: drawn)
        await until(lambda: sum(request.done() for request in requests) == 46)
        hang_up.set()
        await asyncio.gather(*requests)
        finish.set()
        return [request.result() for request in requests].count(503), await get(leaves=False)

    monkeypatch.setattr("motorcade.server.studio.app._film", draw)
    with page(client) as mine:
        mine.set()
        mine.send("step", ticks=100)
        mine.until("state", lambda state: state["t_ms"])
        assert client.portal.call(flood) == (46, 200)
    assert len(drawn) == 2


@pytest.mark.parametrize("file", ["timeline.csv", "run.gif"])
def test_a_world_that_does_not_exist_has_no_downloads(client, file) -> None:
    answer = client.get(f"/api/world/{OTHER}/{file}")
    assert (answer.status_code, answer.json()["error"]["code"]) == (404, "no-world")


def test_stored_moments_become_a_recording() -> None:
    image = base64.b64decode(IMAGE)
    session = WorldSession("", lambda message: None)
    session.begin(StudioWorld(World(mat_of(MAT, "a table"), [image], events=True, threads=1)))
    session.receive(Step(100))
    session.receive(Step(100))
    run = recording_of(session, 0.5)
    frames = list(run.moments())
    assert [frame.t_ms for frame in frames] == list(range(500, 1001, 100))
    last = session.world.simulation.snapshot().in_single_precision()
    for name in ("x_m", "word", "runs", "sends", "led"):
        assert getattr(frames[-1], name).tolist() == getattr(last, name).tolist(), name
    assert run.about.every_ms == 100
