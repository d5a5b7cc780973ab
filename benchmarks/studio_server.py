"""Measure what the studio's server needs to show worlds. Run ``python benchmarks/studio_server.py``.

Simulated pages watch a server in a process of its own and confirm every picture at once. 'Lag' is how far a picture's
time lies behind the real time since the first one. It includes the delays of the pages, which share this machine.
"""

import argparse
import asyncio
import base64
import json
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import psutil
from rich.console import Console
from rich.table import Table
from swarm import result
from websockets.asyncio.client import ClientConnection, connect

from motorcade import Followers, Program, compile_program, forward, led, left, right, together

WARM_S = 3.0
TIMED_S, QUICK_S = 15.0, 5.0
STUDIOS, FOLLOWERS = 50, 1000
CORE_GOAL, PICTURES_GOAL, LAG_GOAL_S = 0.5, 29.0, 0.25
SERVER = """
import sys
from pathlib import Path
from motorcade.drive.listener import bind
from motorcade.server.running import serve_alone
from motorcade.server.studio.app import make_app
from motorcade.server.studio.sessions import SessionLimits, Settings
port = int(sys.argv[1])
# All pages come from one address here.
settings = Settings(library=Path(sys.argv[2]), port=port, sessions=SessionLimits(most_of_one_visitor=64))
serve_alone(make_app(settings), settings, bind("127.0.0.1", port, "studio"), lambda: None)
"""
PARADE = compile_program(
    Program(
        [together(forward(3, speed=2), led(1, 1)), left(1)],
        Followers([together(forward(2, speed=1), led(2, 1)), right(2)], forward=True),
    )
).image


Rows = Iterator[tuple[str, str, str, str]]


@dataclass
class Page:
    """A simulated page that watches a world, and what it received since `reset`.

    Attributes:
        key: the session of the page.
        followers: how many cars follow the leader.
        pictures, received: how many pictures and bytes came.
        lags_s: the lag of each picture.
        began: the real time of the first picture in s, and its time in the world in ms.
    """

    key: str
    followers: int
    pictures: int = 0
    received: int = 0
    lags_s: list[float] = field(default_factory=list)
    began: tuple[float, int] | None = None

    def mat(self) -> dict[str, Any]:
        side_m = max(0.5 * self.followers**0.5, 3.0)
        crowd = {"cars": self.followers + 1, "leaders": 1, "spacing_m": 0.4}
        return {
            "format": "motorcade-mat/1",
            "name": "hall",
            "size_m": [side_m, side_m],
            "edge": "wall",
            "crowd": [crowd],
        }

    async def watch(self, port: int) -> None:
        async with connect(f"ws://127.0.0.1:{port}/api/world?session={self.key}", compression=None) as connection:
            image = base64.b64encode(PARADE).decode()
            await connection.send(json.dumps({"do": "set", "image": image, "mat": self.mat()}))
            await connection.send(json.dumps({"do": "play", "speed": 1}))
            async for message in connection:
                await self._receive(connection, message)

    async def _receive(self, connection: ClientConnection, message: str | bytes) -> None:
        if isinstance(message, str):
            if json.loads(message)["is"] == "error":
                raise RuntimeError(message)
            return
        number, t_ms = struct.unpack_from("<II", message, 4)
        now_s = time.perf_counter()
        if self.began is None:
            self.began = now_s, t_ms
        self.pictures += 1
        self.received += len(message)
        self.lags_s.append(now_s - self.began[0] - (t_ms - self.began[1]) / 1000)
        await connection.send(json.dumps({"do": "shown", "frame": number}))

    def reset(self) -> None:
        self.pictures = self.received = 0
        self.lags_s, self.began = [], None


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


async def wait_for_server(server: subprocess.Popen[bytes], port: int) -> None:
    while server.poll() is None:
        try:
            _, writer = await asyncio.open_connection("127.0.0.1", port)
        except OSError:
            await asyncio.sleep(0.1)
        else:
            writer.close()
            return
    raise RuntimeError("the server ended")


async def server_load(pages: list[Page], seconds: float) -> float:
    """Let the pages watch for ``seconds``; return the share of one core that the server used."""
    port = free_port()
    with tempfile.TemporaryDirectory() as library:
        server = subprocess.Popen([sys.executable, "-c", SERVER, str(port), library])
        try:
            await wait_for_server(server, port)
            watching = [asyncio.create_task(page.watch(port)) for page in pages]
            while not all(page.pictures for page in pages):
                await asyncio.sleep(0.1)
                for failed in (task for task in watching if task.done()):
                    failed.result()
            await asyncio.sleep(WARM_S)
            for page in pages:
                page.reset()
            process = psutil.Process(server.pid)
            before, began_s = process.cpu_times(), time.perf_counter()
            await asyncio.sleep(seconds)
            after, lasted_s = process.cpu_times(), time.perf_counter() - began_s
            for task in watching:
                task.cancel()
            await asyncio.gather(*watching, return_exceptions=True)
        finally:
            server.terminate()
            server.wait()
    return (after.user + after.system - before.user - before.system) / lasted_s


def crowd_rows(seconds: float) -> Rows:
    page = Page("0" * 32, FOLLOWERS)
    share = asyncio.run(server_load([page], seconds))
    rate = page.pictures / seconds
    name = f"{FOLLOWERS:,} followers"
    yield f"{name}: one core's share", f"{share:.0%}", f"≤ {CORE_GOAL:.0%}", result(share, CORE_GOAL, least=False)
    yield f"{name}: pictures a second", f"{rate:.1f}", f"≥ {PICTURES_GOAL:g}", result(rate, PICTURES_GOAL)
    yield f"{name}: MB a second", f"{page.received / seconds / 1e6:.2f}", "", ""
    yield f"{name}: worst lag", f"{max(page.lags_s) * 1000:.0f} ms", "", ""


def studio_rows(seconds: float) -> Rows:
    pages = [Page(f"{number:032x}", 5) for number in range(STUDIOS)]
    share = asyncio.run(server_load(pages, seconds))
    lag_s = max(max(page.lags_s) for page in pages)
    slowest = min(page.pictures for page in pages) / seconds
    name, goal = f"{STUDIOS} studios of 6 cars", f"≤ {LAG_GOAL_S * 1000:g} ms"
    yield f"{name}: worst lag", f"{lag_s * 1000:.0f} ms", goal, result(lag_s, LAG_GOAL_S, least=False)
    yield f"{name}: the slowest's pictures a second", f"{slowest:.1f}", "", ""
    yield f"{name}: one core's share", f"{share:.0%}", "", ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shorter, less steady")
    seconds = QUICK_S if parser.parse_args().quick else TIMED_S
    table = Table("", "figure", "goal", "result", title=f"The studio's server, each for {seconds:g} s")
    for row in (*crowd_rows(seconds), *studio_rows(seconds)):
        table.add_row(*row)
    Console().print(table)


if __name__ == "__main__":
    main()
