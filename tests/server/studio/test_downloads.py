"""What a page downloads of a run: events as a table."""

import csv
import io

import pytest

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


def test_a_world_that_does_not_exist_has_no_timeline(client) -> None:
    answer = client.get(f"/api/world/{OTHER}/timeline.csv")
    assert (answer.status_code, answer.json()["error"]["code"]) == (404, "no-world")
