"""The command `motorcade class` in a process of its own, killed in the middle of a lesson."""

import json
import threading
from contextlib import ExitStack
from random import Random

import httpx2 as httpx

from support.class_page import PASSWORD, PROJECT
from support.command_line import refusal
from support.running_studio import started_class
from support.soak import SOAK

PUPILS, KILLS = (30, 10) if SOAK else (3, 1)


def ask(client, path, **message):
    return client.post(f"/api/{path}", json=message)


class Editor:
    """A pupil's page that saves a draft and projects as fast as it may, and notes what was answered."""

    def __init__(self, base, code, name):
        self.client = httpx.Client(base_url=base, timeout=60)
        self.me = ask(self.client, "class/join", code=code, name=name, avatar="bus").json()
        self.number, self.draft, self.projects = 0, -1, {}

    def edit(self, answered):
        """Until the server is gone; ``answered`` is released for each answer."""
        while True:
            self.number += 1
            name, project = f"Robot {self.number % 3}", PROJECT | {"python": f"# {self.number}"}
            try:
                if ask(self.client, "class/draft/write", name=name, project=project).status_code == 200:
                    self.draft = self.number
                if ask(self.client, "projects/write", name=name, project=project).status_code == 200:
                    self.projects[name] = self.number
            except httpx.HTTPError:
                return
            answered.release()

    def expect_all(self):
        """What was answered is there, or what was sent after it."""
        assert ask(self.client, "class/about").json()["me"] == self.me
        found = {"draft": ask(self.client, "class/draft/read").json()["project"]}
        found |= {name: ask(self.client, "projects/read", name=name).json() for name in self.projects}
        for name, number in {"draft": self.draft, **self.projects}.items():
            assert int(found[name]["python"].removeprefix("# ")) >= number, "what was answered is lost"


def whole(file):
    """Whether a file is whole; a version that was only reserved is empty."""
    data = file.read_bytes()
    return not data or json.loads(data) is not None


def test_a_class_that_is_killed_at_any_moment_comes_back_with_all_that_was_answered(tmp_path):
    with started_class(tmp_path) as (process, told), ExitStack() as stack:
        base, chance = told["addresses"][0], Random(7)
        teacher = stack.enter_context(httpx.Client(base_url=base))
        page, _, key = told["teacher"].partition("#")
        assert page == f"{base}teacher"
        assert ask(teacher, "teacher/first-password", key=key, password=PASSWORD).json() == {}
        editors = [Editor(base, told["code"], f"pupil {number}") for number in range(PUPILS)]
        for each in editors:
            stack.callback(each.client.close)
        assert str(tmp_path) in refusal(2, "class", "--host", "127.0.0.1", "--no-browser", "--folder", tmp_path)
        for _ in range(KILLS):
            answered = threading.Semaphore(0)
            editing = [threading.Thread(target=each.edit, args=[answered]) for each in editors]
            for thread in editing:
                thread.start()
            for _ in range(chance.randrange(2 * PUPILS, 5 * PUPILS)):
                assert answered.acquire(timeout=60)
            # The system may let one of them run much later than the others.
            while not all(each.projects and each.draft > 0 for each in editors):
                assert answered.acquire(timeout=60)
            process.kill()
            for thread in editing:
                thread.join()
            assert all(map(whole, tmp_path.rglob("*.json")))
            process, again = stack.enter_context(started_class(tmp_path, base.rpartition(":")[2].strip("/")))
            assert again["code"] == told["code"]
            assert "#" not in again["teacher"], "there is a password"
            assert ask(teacher, "teacher/about").json() == {"has_password": True, "signed_in": True}
            for each in editors:
                each.expect_all()
