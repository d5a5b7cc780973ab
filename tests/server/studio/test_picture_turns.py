"""Worlds that are late take turns: requests come between them, and all get equally many pictures."""

import asyncio
from functools import partial

from motorcade.server.studio.sessions import do_in_turn
from support.mock_clock import mock_clock


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
