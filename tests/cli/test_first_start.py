"""What starts needs nothing heavy: the simulator runs where neither Numba nor what records and draws is installed."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer
from urllib.request import Request, urlopen

from websockets.sync.client import ClientConnection, connect

from support.command_line import PARADE
from support.waiting import DEADLINE_S

MISSING = ("numba", "llvmlite", "matplotlib", "pyarrow", "scipy", "mcap")
WORLD = {
    "format": "motorcade-mat/1",
    "name": "a table",
    "car": [{"at_m": [0, 0], "role": "leader"}],
    "crowd": [{"cars": 40, "corner_m": [1, 1], "size_m": [3, 3]}],
}


@contextmanager
def started(*arguments: str) -> Iterator[subprocess.Popen]:
    """The command in a process where the modules in MISSING can't be imported."""
    code = f"import sys\nfor name in {MISSING!r}:\n    sys.modules[name] = None\n"
    code += f"sys.argv = {['motorcade', *arguments]!r}\nfrom motorcade.__main__ import main\nmain()"
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8") as process:
        patience = Timer(DEADLINE_S, process.kill)
        patience.start()
        try:
            yield process
        finally:
            patience.cancel()
            process.kill()


def test_a_simulation_runs() -> None:
    with started("simulate", str(PARADE), "--seconds", "2", "--json") as process:
        told = json.loads(process.stdout.read())
    assert told["cars"][0]["x"] > 0.1


def test_a_car_can_be_driven() -> None:
    with started("drive", "serve", "--port", "0", "--json") as process:
        assert json.loads(process.stdout.readline())["port"] > 0


def test_cars_of_the_studio_move(tmp_path) -> None:
    with started("studio", "--port", "0", "--no-browser", "--json", "--library", str(tmp_path)) as process:
        base, _, token = json.loads(process.stdout.readline())["url"].partition("/?token=")
        cookie = {"Cookie": f"motorcade_{base.rpartition(':')[2]}={token}"}
        headers = {"Content-Type": "application/json", "Origin": base, **cookie}
        request = Request(f"{base}/api/capabilities", b"{}", headers)
        with urlopen(request, timeout=DEADLINE_S) as answer:
            told = json.load(answer)
        assert told["downloads"] is True
        address = f"{base.replace('http', 'ws')}/api/world?session={'0' * 32}"
        with connect(address, origin=base, additional_headers=cookie, max_size=None) as page:
            page.send(json.dumps({"do": "set", "mat": WORLD, "seed": 1}))
            while until(page, "hello")["cars"] != 41:
                pass
            page.send(json.dumps({"do": "step", "ticks": 100}))
            while until(page, "state")["t_ms"] != 100:
                pass


def until(page: ClientConnection, kind: str) -> dict:
    """The next message of a kind; pictures are left out."""
    while True:
        text = page.recv(DEADLINE_S)
        if isinstance(text, str) and (message := json.loads(text))["is"] == kind:
            return message
