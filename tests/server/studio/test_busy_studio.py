"""Pictures of one page while another sends all that is heavy, at a running studio: a part of `make soak`."""

import asyncio
import http.client
import json
import struct
import threading
import time
from contextlib import closing, suppress
from itertools import cycle
from math import cos, pi, sin

import pytest
from websockets.asyncio.client import connect

from support.soak import SOAK
from support.world_page import IMAGE, KEY, MAT

__test__ = SOAK
FEWEST_A_SECOND = 25
WARM_S, TIMED_S = 2.0, 15.0
# Forty requests that wait for each other.
PATIENCE_S = 300
EMPTY = {"format": "motorcade-mat/1", "name": "large", "tick_ms": 1}
# 199 bytes, which cost 2 GB once: an area of kilometres, and cars at 1 cm.
FAR = EMPTY | {
    "polygon": [{"corners_m": [[0, 0], [2000, 0], [0, 2000]]}],
    "crowd": [{"cars": 2000, "spacing_m": 0.01, "area": {"from_m": [0, 0], "to_m": [2000, 2000]}}],
}
STAR = [[(5 + 3 * (k % 2)) * cos(k * pi / 199), (5 + 3 * (k % 2)) * sin(k * pi / 199)] for k in range(398)]
CORNERS = EMPTY | {"size_m": [60, 60], "polygon": [{"corners_m": STAR}], "crowd": [{"cars": 1990, "spacing_m": 0.3}]}
CROWD = EMPTY | {"size_m": [12, 12], "edge": "wall", "crowd": [{"cars": 1900, "leaders": 60, "spacing_m": 0.16}]}
HEAVY = [{"do": "set", "image": IMAGE, "mat": mat} for mat in (FAR, CORNERS, CROWD)]
PLAYED = [
    {"do": "set", "image": IMAGE, "mat": CROWD},
    {"do": "play", "speed": 16},
    *[{"do": "watch", "car": 1}] * 60,
    *[{"do": "set_environment", "mat": EMPTY | {"polygon": CORNERS["polygon"]}, "range_mm": 2000}] * 5,
]


async def watch(studio, ended):
    """Count the pictures that a page with a small world gets in a second; then end the others."""
    pictures, began_s = 0, None
    async with page(studio, KEY) as line:
        await line.send(json.dumps({"do": "set", "image": IMAGE, "mat": MAT}))
        await line.send(json.dumps({"do": "play"}))
        async for message in line:
            now_s = time.monotonic()
            began_s = began_s or now_s
            if isinstance(message, bytes):
                pictures += now_s > began_s + WARM_S
                await line.send(json.dumps({"do": "shown", "frame": struct.unpack_from("<I", message, 4)[0]}))
            if now_s > began_s + WARM_S + TIMED_S:
                break
    ended.set()
    return pictures / TIMED_S


def page(studio, key):
    address = f"ws://127.0.0.1:{studio.port}/api/world?session={key}"
    return connect(address, additional_headers=studio.cookie, compression=None, proxy=None, max_size=None)


async def send_again(studio, messages, number, ended):
    """Send messages one after the other; wait for each new world, and draw pictures as a page does."""
    async with page(studio, f"{number:032x}") as line:
        answered = asyncio.Event()

        async def read():
            async for message in line:
                if isinstance(message, bytes):
                    await line.send(json.dumps({"do": "shown", "frame": struct.unpack_from("<I", message, 4)[0]}))
                elif json.loads(message)["is"] in ("hello", "error"):
                    answered.set()

        reading = asyncio.create_task(read())
        for message in cycle(messages):
            answered.clear()
            await line.send(json.dumps(message))
            with suppress(TimeoutError):
                await asyncio.wait_for(answered.wait(), PATIENCE_S if message["do"] == "set" else 0.05)
            if ended.is_set():
                break
        reading.cancel()


def post_again(studio, name, body, ended):
    while not ended.is_set():
        with closing(http.client.HTTPConnection("127.0.0.1", studio.port, timeout=PATIENCE_S)) as line:
            line.request("POST", f"/api/{name}", json.dumps(body), studio.cookie)
            assert line.getresponse().read()


def answer(studio, name, **values):
    with closing(http.client.HTTPConnection("127.0.0.1", studio.port, timeout=PATIENCE_S)) as line:
        line.request("POST", f"/api/{name}", json.dumps(values), studio.cookie)
        return json.loads(line.getresponse().read())


def requests_of(studio):
    """Two requests that cost much: a mission of many cars, and a long text."""
    mission = answer(studio, "mission", id="find-your-way")
    blocks = {key: mission[key] for key in ("leader", "followers")}
    text = "from motorcade import *\nprogram = Program([\n" + "    forward(1),\n" * 5000 + "])\n"
    yield "missions/check", {"mission": {"id": "find-your-way"}, **blocks}
    yield "python-to-blocks", {**blocks, "text": text}


async def pictures_a_second(studio, worlds, posts):
    ended = threading.Event()
    threads = [threading.Thread(target=post_again, args=(studio, *post, ended)) for post in posts]
    for thread in threads:
        thread.start()
    sending = [asyncio.create_task(send_again(studio, messages, k, ended)) for k, messages in enumerate(worlds)]
    try:
        return await watch(studio, ended)
    finally:
        ended.set()
        await asyncio.gather(*sending, return_exceptions=True)
        for thread in threads:
            await asyncio.to_thread(thread.join)


@pytest.mark.parametrize(
    ("worlds", "posts", "least"),
    [
        ([HEAVY], 0, FEWEST_A_SECOND),
        ([HEAVY] * 6, 0, FEWEST_A_SECOND),
        ([PLAYED], 0, FEWEST_A_SECOND),
        ([PLAYED] * 4, 0, FEWEST_A_SECOND),
        ([], 1, FEWEST_A_SECOND),
        # Two cores reach 24 and 21.
        ([], 40, 15),
        ([HEAVY, PLAYED], 4, 15),
    ],
    ids=["a mat", "six mats", "a crowd", "four crowds", "a request", "forty requests", "all"],
)
def test_what_a_page_sends_slows_anothers_pictures_little(studio, worlds, posts, least, record_property):
    alone = asyncio.run(pictures_a_second(studio, [], []))
    if alone < FEWEST_A_SECOND + 3:
        pytest.skip(f"this computer is busy with something else: {alone:.1f} pictures a second of a page alone")
    bodies = list(requests_of(studio)) * 20
    rate = asyncio.run(pictures_a_second(studio, worlds, bodies[:posts]))
    record_property("pictures a second", rate)
    print(f"{rate:.1f} pictures a second, {alone:.1f} alone")
    assert rate >= least
