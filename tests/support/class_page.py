"""A class's server without a socket, and the browsers in its room."""

import errno
import json
from contextlib import contextmanager
from typing import Any
from unittest import mock

from starlette.testclient import TestClient

from motorcade.classroom import names
from motorcade.classroom.app import make_class_app
from motorcade.classroom.folder import ClassFolder
from motorcade.classroom.network import Network
from motorcade.classroom.running import ClassServerSettings
from support.world_page import WorldPage

HERE = "http://192.168.1.5:7710"
FIRST_KEY, PASSWORD = "a-first-key", "correct horse"
PROJECT: dict[str, Any] = {"leader": {}, "followers": None, "profile": "classroom"}
# How a request that changes the class fails on a full disk: the second where the class's clock could store nothing
# while the request was under way, and undid what it had changed.
NOT_STORED = ("cant-save", "undone-meanwhile")


def no_room(path, data):
    """Be `motorcade.config.files.replace_file` on a full disk."""
    raise OSError(errno.ENOSPC, "No space left on device")


class ClassBrowser:
    """A browser in the room, with cookies of its own, at the server of a class."""

    def __init__(self, client, address):
        self.client = TestClient(
            client.app, base_url=HERE, client=(address, 50_000), follow_redirects=False, raise_server_exceptions=False
        )
        self.client.portal = client.portal

    def ask(self, path, message=None, **values):
        """The answer to a request; the code of the error where it is refused."""
        answer = self.client.post(f"/api/{path}", content=json.dumps(values if message is None else message))
        data = answer.json()
        return data if answer.status_code == 200 else data["error"]["code"]

    @contextmanager
    def open(self, path):
        """A WebSocket."""
        with self.client.websocket_connect(f"ws{HERE.removeprefix('http')}/api/{path}") as socket:
            yield WorldPage(socket)

    def save(self, name, **changes):
        """The number of the version that was saved."""
        return self.ask("projects/write", name=name, project=PROJECT | changes)["version"]

    def names(self):
        return sorted(each["name"] for each in self.ask("projects/list"))


class PagedRoom:
    """A class: its teacher, and pupils who join."""

    def __init__(self, client):
        self._client = client
        self._addresses = 10
        self.teacher = self.browser()

    def browser(self, address=None):
        self._addresses += 1
        return ClassBrowser(self._client, address or f"192.168.1.{self._addresses}")

    def sign_in(self):
        assert self.teacher.ask("teacher/first-password", key=FIRST_KEY, password=PASSWORD) == {}
        return self.teacher

    @property
    def code(self):
        return self.teacher.ask("teacher/addresses")["code"]

    def join(self, name, address=None):
        pupil = self.browser(address)
        joined = pupil.ask("class/join", code=self.code, name=name, avatar="bus")
        assert isinstance(joined, dict), joined
        pupil.id, pupil.number = joined["id"], joined["number"]
        return pupil


@contextmanager
def class_room(folder, signs_in=True, files=None, **changes):
    """A class in a folder; the teacher has set the password and is signed in, unless there is no first key."""
    here = Network(["192.168.1.5"], 7710)
    given = {"clock": lambda: 0.0, "unix_s": lambda: 0.0, "first_key": FIRST_KEY, "network": here}
    settings = ClassServerSettings(library=folder, page=folder, **{"port": 7710, **given, **changes})
    files = files or ClassFolder(folder)
    # To store a password takes 50 ms in earnest: test_classroom.py looks at that.
    cheap = mock.patch.object(names, "_COST", 2)
    with cheap, files.opened(), TestClient(make_class_app(settings, files), base_url=HERE) as client:
        room = PagedRoom(client)
        if settings.first_key and signs_in:
            room.sign_in()
        yield room
