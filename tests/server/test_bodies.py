"""What requests carry and what they are answered with: little of it is in memory at a time."""

import asyncio
import json
from contextlib import suppress

import pytest
from starlette.requests import ClientDisconnect, Request

from motorcade.server.http import Bodies
from motorcade.server.studio.library import FolderStorage
from motorcade.service.documents import example, project_text
from motorcade.service.library import export_all, export_answer
from support.mock_clock import mock_clock

MOST_BYTES = 128 << 20
LARGE, SMALL = 40 << 20, 1 << 20


def request_of(size, parts=8, leaves=False):
    """A request with a body of so many bytes."""
    sent = [{"type": "http.request", "body": bytes(size // parts), "more_body": True} for _ in range(parts)]
    last = {"type": "http.disconnect"} if leaves else {"type": "http.request", "body": b"", "more_body": False}
    messages = iter([*sent, last])

    async def receive():
        return next(messages)

    return Request({"type": "http", "method": "POST"}, receive)


@pytest.mark.parametrize(("size", "count"), [(LARGE, 4), (SMALL, 50)])
@mock_clock
async def test_all_bodies_in_memory_together_are_bounded_and_each_has_its_turn(size, count):
    bodies, loaded, most, goes_on = Bodies(), [], [], asyncio.Event()

    async def work():
        async with bodies.loaded(request_of(size)) as data:
            loaded.append(len(data))
            most.append(sum(loaded))
            await goes_on.wait()
            loaded.remove(len(data))
        return len(data)

    tasks = [asyncio.create_task(work()) for _ in range(count)]
    await asyncio.sleep(1)
    goes_on.set()
    assert await asyncio.gather(*tasks) == [size] * count
    assert max(most) <= MOST_BYTES / 2


@mock_clock
async def test_a_sender_that_leaves_takes_no_place():
    bodies = Bodies()
    for _ in range(3):
        with suppress(ClientDisconnect):
            async with bodies.loaded(request_of(LARGE, leaves=True)):
                raise AssertionError
    async with bodies.loaded(request_of(LARGE)) as data:
        assert len(data) == LARGE


class Counted(FolderStorage):
    """Counts what is read."""

    reads = 0

    def read(self, *arguments):
        self.reads += 1
        return super().read(*arguments)


def test_an_export_is_read_as_it_is_sent(tmp_path):
    storage = Counted(tmp_path)
    for number in range(20):
        storage.write_version("", f"Robot {number}", project_text(example("parade")).encode() + b"\n" * number)
    storage.add_stars("", "forward-and-stop", [1])
    pieces = export_answer(storage, "")
    begun = [next(pieces) for _ in range(6)]
    assert storage.reads < 4
    answer = json.loads(b"".join([*begun, *pieces]))
    assert answer == {"text": export_all(storage, "").text, "left_out": []}
    file = json.loads(answer["text"])
    assert (len(file["projects"]), file["stars"], file["missions"]) == (20, {"forward-and-stop": [1]}, [])
