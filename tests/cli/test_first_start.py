"""The studio needs nothing heavy: its cars move where neither Numba nor what records and draws is installed."""

import json
import sys
from urllib.request import Request, urlopen

from websockets.sync.client import ClientConnection, connect

from support.command_line import started
from support.waiting import DEADLINE_S

MISSING = ("numba", "llvmlite", "matplotlib", "pyarrow", "scipy", "mcap")
WORLD = {
    "format": "motorcade-mat/1",
    "name": "a table",
    "car": [{"at_m": [0, 0], "role": "leader"}],
    "crowd": [{"cars": 40, "corner_m": [1, 1], "size_m": [3, 3]}],
}


# The command line in a process where the modules in MISSING can't be imported.
WITHOUT = f"""
import sys
for name in {MISSING!r}:
    sys.modules[name] = None
from motorcade.__main__ import main
main()
"""


def test_cars_of_the_studio_move(tmp_path) -> None:
    program = sys.executable, "-c", WITHOUT
    with started("studio", "--port", "0", "--no-browser", "--library", tmp_path, program=program) as (_, told):
        base, _, token = told["url"].partition("/?token=")
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
