"""Requests in processes of their own: bounded CPU time, and an end when nobody waits any more."""

import asyncio
import json

import psutil
import pytest

from motorcade.errors import MotorcadeError
from motorcade.server.studio import workers
from motorcade.server.studio.library import FolderStorage
from motorcade.server.studio.workers import Workers
from motorcade.service.requests import Context
from support.waiting import DEADLINE_S, wait_until

# Python's reader of TOML takes the square of a key's parts for each line, those of the table's name included: seconds
# for the most that is read.
TABLE = ".".join("a" * 98)
LINES = "".join("a." * 98 + f"k{number} = 1\n" for number in range(5_000))
ENDLESS = json.dumps({"text": f'format = "motorcade-mission/1"\n[{TABLE}]\n{LINES}'}).encode()


def busy():
    """The processes that this one has started and that compute."""
    return {
        each.pid for each in psutil.Process().children() if sum(each.cpu_times()[:2]) > 1 and each.status() == "running"
    }


@pytest.fixture
def context(tmp_path):
    return Context(None, FolderStorage(tmp_path), list)


def test_a_request_gets_no_more_cpu_time_than_it_may_take(context):
    with pytest.raises(MotorcadeError) as refused:
        asyncio.run(Workers().answer("missions/open", ENDLESS, context, 0.2))
    assert refused.value.code == "request-too-heavy"


def test_a_process_that_ends_while_it_starts_is_a_refusal(context, monkeypatch):
    monkeypatch.setattr(workers, "_waiting", [])
    # It ends at once, as one does that gets no memory.
    monkeypatch.setattr(workers, "_serve", id)
    with pytest.raises(MotorcadeError) as refused:
        asyncio.run(Workers().answer("missions/open", b"{}", context, DEADLINE_S))
    assert refused.value.code == "request-too-heavy"


def test_a_request_is_given_up_when_its_sender_leaves(context):
    async def ask_and_leave():
        asked = asyncio.create_task(Workers().answer("missions/open", ENDLESS, context, DEADLINE_S * 10))
        await asyncio.to_thread(wait_until, busy, deadline_s=DEADLINE_S)
        pids = busy()
        asked.cancel()
        await asyncio.gather(asked, return_exceptions=True)
        return pids

    pids = asyncio.run(ask_and_leave())
    # A process that another test began may have warmed up meanwhile: it computed too, and lives on.
    wait_until(lambda: not pids & busy(), deadline_s=DEADLINE_S)


def test_a_process_stores_by_the_server_and_its_errors_are_the_servers(context):
    async def ask(name, message):
        return json.loads(await Workers().answer(name, json.dumps(message).encode(), context, DEADLINE_S))

    project = json.loads(asyncio.run(Workers().answer("example", b'{"name": "parade"}', context, DEADLINE_S)))
    sent = {"name": "Robot", "project": project}
    assert asyncio.run(ask("projects/write", sent))["version"] == 1
    assert [each.name for each in context.storage.list("")] == ["Robot"]
    with pytest.raises(MotorcadeError) as refused:
        asyncio.run(ask("projects/read", {"name": "Rover"}))
    assert refused.value.code == "no-project"
