"""A page at the studio's server without a socket, as the server meets it: its WebSocket and what it sends."""

import base64
import json
from contextlib import contextmanager

from starlette.testclient import TestClient

from motorcade import Followers, Program, compile_program, forward, led, left
from motorcade.server.studio.app import make_app
from motorcade.server.studio.sessions import Settings
from support.remote_page import PageSocket

KEY = "0123456789abcdef" * 2
OTHER = "f" * 32
THIRD = "a" * 32
IMAGE = base64.b64encode(
    compile_program(Program([forward(3, speed=2), left(1)], Followers([led(1, 1)]))).image
).decode()
MAT = {
    "format": "motorcade-mat/1",
    "name": "a table",
    "tick_ms": 5,
    "car": [{"at_m": [0, 0], "role": "leader"}, {"at_m": [0.5, 0]}, {"at_m": [0.5, 0.5]}],
}
SET = {"do": "set", "image": IMAGE, "mat": MAT, "profile": "classroom", "seed": 1}


class WorldPage(PageSocket):
    """A page of the studio."""

    def set(self, **changes):
        self._socket.send_text(json.dumps(SET | changes))
        return self.until("hello", lambda hello: not hello["resumed"] and hello["cars"])


@contextmanager
def server(tmp_path, **changes):
    settings = Settings(library=tmp_path, page=tmp_path, **changes)
    with TestClient(make_app(settings), base_url="http://127.0.0.1:7700") as client:
        yield client


def visitor_from(address, client):
    """The same server, in the same event loop, for a visitor at another address."""
    visitor = TestClient(client.app, base_url=client.base_url, client=(address, 50_000))
    visitor.portal = client.portal
    return visitor


@contextmanager
def page(client, key=KEY):
    with client.websocket_connect(f"ws://127.0.0.1:7700/api/world?session={key}") as socket:
        yield WorldPage(socket)
