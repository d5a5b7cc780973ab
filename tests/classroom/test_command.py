"""The command `motorcade class` in a process of its own, killed in the middle of a lesson."""

import httpx2 as httpx

from support.class_page import PASSWORD, PROJECT
from support.command_line import refusal
from support.running_studio import started_class


def test_a_class_that_is_killed_comes_back_with_all_that_was_answered(tmp_path):
    """`tests/faults` kills it at any moment."""

    def ask(path, **message):
        answer = client.post(f"/api/{path}", json=message)
        assert answer.status_code == 200
        return answer.json()

    with started_class(tmp_path) as (process, told):
        base = told["addresses"][0]
        with httpx.Client(base_url=base, timeout=60) as client:
            page, _, key = told["teacher"].partition("#")
            assert page == f"{base}teacher"
            ask("teacher/first-password", key=key, password=PASSWORD)
            assert str(tmp_path) in refusal(2, "class", "--host", "127.0.0.1", "--no-browser", "--folder", tmp_path)
            me = ask("class/join", code=told["code"], name="Mia", avatar="bus")
            ask("class/draft/write", name="Robot", project=PROJECT)
            ask("projects/write", name="Robot", project=PROJECT)
            process.kill()
            port = base.rpartition(":")[2].strip("/")
            with started_class(tmp_path, port) as (_, again):
                assert again["code"] == told["code"]
                assert "#" not in again["teacher"], "there is a password"
                assert ask("teacher/about") == {"has_password": True, "signed_in": True}
                assert ask("class/about")["me"] == me
                assert ask("class/draft/read")["name"] == "Robot"
                assert ask("projects/read", name="Robot")["leader"] == PROJECT["leader"]
