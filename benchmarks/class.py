"""Measure a class: pupils with running worlds who edit, and the live wall. Run ``python benchmarks/class.py``.

The server is a process of its own; pupils are simulated, each at an address of its own of this computer (127.0.1.2 and
so on, which Linux has), and confirm every picture at once. They share the machine with the server. 'Edit to words' is
the time of a request `compile` as a page meets it, while all that runs.

``--browsers 3`` makes the last three pupils real pages in a headless Chromium, which draws without a graphics processor
and shares the machine too: there a picture is a moment of the world that the page has drawn, and 'edit to words' is
the time from a changed block to the words in the page.
"""

import argparse
import asyncio
import base64
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import httpx2 as httpx
import msgspec
import psutil
from rich.console import Console
from rich.table import Table
from studio_server import PARADE, free_port
from swarm import result
from websockets.asyncio.client import connect

from motorcade.service.documents import example

CARS, EDIT_EVERY_S, WARM_S = 20, 2.0, 4.0
# The limit of a figure, for how many pupils it holds, and whether the figure is to be at least that.
GOALS = {
    "pictures a second, the slowest page": (25, 30, True),
    "edit to words, p95, ms": (150, 100, False),
    "server, MB": (600, 30, False),
    "browsers, pictures a second, the slowest": (25, 30, True),
    "browsers, edit to words, p95, ms": (150, 100, False),
    "everyone back after kill -9, s": (5, 100, False),
}
PASSWORD = "benchmark"
SIDE_M = 3.0


@dataclass
class Pupil:
    """A simulated pupil, and what was measured since `reset`."""

    number: int
    client: httpx.AsyncClient
    pictures: int = 0
    edits_s: list[float] = field(default_factory=list)
    refused: int = 0

    @property
    def address(self) -> str:
        return f"127.0.{1 + self.number // 250}.{1 + self.number % 250}"

    async def join(self, code: str) -> None:
        answer = await self.ask("class/join", code=code, name=f"pupil {self.number}", avatar="bus")
        answer.raise_for_status()

    async def ask(self, path: str, **message: object) -> httpx.Response:
        return await self.client.post(f"/api/{path}", json=message)

    def socket(self, path: str) -> connect:
        base = str(self.client.base_url).replace("http", "ws", 1)
        cookies = "; ".join(f"{name}={value}" for name, value in self.client.cookies.items())
        return connect(
            f"{base}api/{path}",
            compression=None,
            local_addr=(self.address, 0),
            additional_headers={"Cookie": cookies},
            max_size=None,
        )

    async def play(self) -> None:
        mat = {
            "format": "motorcade-mat/1",
            "name": "hall",
            "size_m": [SIDE_M, SIDE_M],
            "edge": "wall",
            "crowd": [{"cars": CARS, "leaders": 1, "spacing_m": 0.4}],
        }
        async with self.socket(f"world?session={self.number:032x}") as world:
            await world.send(json.dumps({"do": "set", "image": base64.b64encode(PARADE).decode(), "mat": mat}))
            await world.send(json.dumps({"do": "play", "speed": 1}))
            async for message in world:
                if isinstance(message, bytes):
                    self.pictures += 1
                    await world.send(json.dumps({"do": "shown", "frame": int.from_bytes(message[4:8], "little")}))

    async def listen(self) -> None:
        async with self.socket("class/stream") as stream:
            async for _ in stream:
                pass

    async def edit(self, blocks: dict[str, Any]) -> None:
        await asyncio.sleep(EDIT_EVERY_S * (self.number % 17) / 17)
        while True:
            began_s = time.perf_counter()
            answer = await self.ask("compile", **blocks)
            self.edits_s.append(time.perf_counter() - began_s)
            self.refused += answer.status_code != 200
            await self.ask("class/draft/write", name="draft", project=blocks)
            await asyncio.sleep(max(EDIT_EVERY_S - (time.perf_counter() - began_s), 0.0))

    def reset(self) -> None:
        self.pictures, self.edits_s, self.refused = 0, [], 0


async def show_wall(teacher: Pupil, seen: list[int]) -> None:
    async with teacher.socket("teacher/wall") as wall:
        async for message in wall:
            if isinstance(message, bytes):
                seen.append(len(message))
                await wall.send("{}")


async def show_class(teacher: Pupil) -> None:
    async with teacher.socket("teacher/stream") as stream:
        async for _ in stream:
            pass


def begin(folder: str, port: int) -> tuple[subprocess.Popen[str], dict[str, Any]]:
    command = [sys.executable, "-m", "motorcade", "class", "--host", "127.0.0.1", "--no-browser", "--json"]
    server = subprocess.Popen([*command, "--folder", folder, "--port", str(port)], stdout=subprocess.PIPE, text=True)
    assert server.stdout
    return server, json.loads(server.stdout.readline())


def person(number: int, base: str) -> Pupil:
    pupil = Pupil(number, None)  # type: ignore[arg-type]
    transport = httpx.AsyncHTTPTransport(local_address=pupil.address)
    pupil.client = httpx.AsyncClient(base_url=base, transport=transport, timeout=30)
    return pupil


# Opens pages of pupils, given the server's address and the class's code.
OpenPages = Callable[[str, str], AbstractAsyncContextManager[list[Any]]]


async def measure(pupils_count: int, seconds: float, browsers: int, open_pages: OpenPages) -> dict[str, Any]:
    blocks = msgspec.to_builtins(example("parade"))
    blocks = {name: blocks[name] for name in ("leader", "followers", "profile")}
    with tempfile.TemporaryDirectory() as folder:
        server, told = begin(folder, free_port())
        try:
            base = told["addresses"][0]
            teacher = person(0, base)
            await teacher.ask("teacher/first-password", key=told["teacher"].partition("#")[2], password=PASSWORD)
            pupils = [person(number, base) for number in range(1, pupils_count - browsers + 1)]
            for pupil in pupils:
                await pupil.join(told["code"])
            seen: list[int] = []
            jobs = [show_wall(teacher, seen), show_class(teacher)]
            jobs += [job for pupil in pupils for job in (pupil.play(), pupil.listen(), pupil.edit(blocks))]
            tasks = [asyncio.create_task(job) for job in jobs]
            while not all(pupil.pictures for pupil in pupils):
                await asyncio.sleep(0.1)
                for failed in (task for task in tasks if task.done()):
                    failed.result()
            await asyncio.sleep(WARM_S)
            stack = AsyncExitStack()
            pages = await stack.enter_async_context(open_pages(base, told["code"]))
            tasks += [asyncio.create_task(page.edit(EDIT_EVERY_S)) for page in pages]
            if pages:
                await asyncio.sleep(WARM_S)
            for pupil in pupils:
                pupil.reset()
            for page in pages:
                await page.reset()
            seen.clear()
            process = psutil.Process(server.pid)
            began_s, cpu = time.perf_counter(), process.cpu_times()
            await asyncio.sleep(seconds)
            took_s = time.perf_counter() - began_s
            used = process.cpu_times()
            edits = sorted(each for pupil in pupils for each in pupil.edits_s)
            found = {
                "pupils": pupils_count,
                "pictures a second, the slowest page": min(pupil.pictures for pupil in pupils) / took_s,
                "edit to words, p95, ms": edits[int(0.95 * len(edits))] * 1000,
                "edit to words, median, ms": edits[len(edits) // 2] * 1000,
                "edits refused": sum(pupil.refused for pupil in pupils),
                "wall, pictures a second": len(seen) / took_s,
                "wall, kB a second": sum(seen) / took_s / 1000,
                "server, MB": process.memory_info().rss / 1e6,
                "server, CPU, ms for each picture": 1000
                * (used.user + used.system - cpu.user - cpu.system)
                / sum(pupil.pictures for pupil in pupils),
                "server, cores": (used.user + used.system - cpu.user - cpu.system) / took_s,
            }
            for failed in (task for task in tasks if task.done()):
                failed.result()
            if pages:
                times = sorted([each for page in pages for each in await page.edits_ms()])
                found |= {
                    "browsers, pictures a second, the slowest": min(page.pictures for page in pages) / took_s,
                    "browsers, edit to words, p95, ms": times[int(0.95 * len(times))],
                    "browsers, edit to words, median, ms": times[len(times) // 2],
                    "browsers, edits": len(times),
                }
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await stack.aclose()
            server.kill()
            server.wait()
            began_s = time.perf_counter()
            server, _ = begin(folder, int(base.rpartition(":")[2].strip("/")))
            back = await asyncio.gather(*(pupil.ask("class/draft/read") for pupil in pupils))
            found["everyone back after kill -9, s"] = time.perf_counter() - began_s
            assert all(answer.json()["name"] == "draft" for answer in back)
            return found
        finally:
            server.kill()
            server.wait()


def pages_of(browsers: int) -> OpenPages:
    """A function that opens pages in browsers; without them, no browser is needed."""
    if not browsers:
        return lambda base, code: nullcontext([])
    from class_pages import prepare, pupils_pages

    return partial(pupils_pages, prepare(), browsers, CARS)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--pupils", type=int, nargs="*", default=[30, 100])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--browsers", type=int, default=0, help="so many of the pupils are pages in a browser")
    options = parser.parse_args()
    table = Table("", *(str(count) for count in options.pupils), "goal")
    open_pages = pages_of(options.browsers)
    found = [asyncio.run(measure(count, options.seconds, options.browsers, open_pages)) for count in options.pupils]
    for name in found[0]:
        limit, most_pupils, least = GOALS.get(name, (None, 0, True))
        shown = [f"{each[name]:.4g}" for each in found]
        for place, each in enumerate(found):
            if limit is not None and each["pupils"] <= most_pupils:
                shown[place] += f" {result(each[name], limit, least=least)}"
        goal = "" if limit is None else f"{'≥' if least else '≤'} {limit}, up to {most_pupils} pupils"
        table.add_row(name, *shown, goal)
    Console().print(table)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    main()
