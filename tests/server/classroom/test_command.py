"""The command `motorcade class` in a process of its own, killed in the middle of a lesson."""

import subprocess
import threading

import httpx2 as httpx
import pytest

from motorcade.server.classroom.folder import ClassFolder
from support.class_page import PASSWORD, PROJECT
from support.class_process import COMMAND, started


def ask(client, path, **message):
    return client.post(f"/api/{path}", json=message)


def test_a_class_that_is_killed_comes_back_with_all_that_was_answered(tmp_path):
    with started(tmp_path) as (process, told):
        base = told["addresses"][0]
        with httpx.Client(base_url=base) as teacher, httpx.Client(base_url=base) as mia:
            desk, _, key = told["desk"].partition("#")
            assert desk == f"{base}desk"
            assert ask(teacher, "desk/first-password", key=key, password=PASSWORD).json() == {}
            joined = ask(mia, "class/join", code=told["code"], name="Mia", avatar="bus").json()
            second = subprocess.run([*COMMAND, "--folder", str(tmp_path)], capture_output=True, text=True, timeout=60)
            assert second.returncode == 2
            assert str(tmp_path) in second.stderr
            answered, dying = {}, threading.Event()

            def save():
                for number in range(10_000):
                    name, project = f"Robot {number % 7}", PROJECT | {"python": f"# {number}"}
                    try:
                        answer = ask(mia, "projects/write", name=name, project=project)
                    except httpx.HTTPError:
                        return
                    if answer.status_code == 200:
                        answered[name] = number
                    if number == 20:
                        dying.set()

            saving = threading.Thread(target=save)
            saving.start()
            assert dying.wait(60)
            process.kill()
            saving.join()
            with started(tmp_path, base.rpartition(":")[2].strip("/")) as (_, again):
                assert again["code"] == told["code"]
                assert "#" not in again["desk"], "there is a password"
                assert ask(mia, "class/about").json()["me"] == joined
                assert ask(teacher, "desk/about").json() == {"has_password": True, "signed_in": True}
                for name, number in answered.items():
                    text = ask(mia, "projects/read", name=name).json()["python"]
                    assert int(text.removeprefix("# ")) >= number, "an answered version is lost"
            assert len(answered) == 7


@pytest.mark.parametrize("data", ["", "{", '{"format": "motorcade-class/2", "code": "x"}'])
def test_a_damaged_class_is_refused_and_left_as_it_is(tmp_path, data):
    (tmp_path / "class.json").write_text(data)
    with pytest.raises(Exception, match=r"class\.json"):
        ClassFolder(tmp_path).load(lambda most: 0)
    assert (tmp_path / "class.json").read_text() == data
