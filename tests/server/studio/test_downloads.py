"""What a page downloads of a run: events as a table, and films."""

import asyncio
import csv
import io

import pytest

from support.waiting import until
from support.world_page import KEY, OTHER, page, server


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
