"""The library's projects, over HTTP."""

from urllib.parse import quote

import pytest
from starlette.testclient import TestClient

from motorcade import Followers, Program, led, read_program, wait
from motorcade.program.blocks import blocks_of
from motorcade.server.studio.app import make_app
from motorcade.server.studio.settings import Settings

MAT = {"format": "motorcade-mat/1", "name": "a table", "car": [{"at_m": [0, 0], "role": "leader"}]}


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "library"


@pytest.fixture
def page(folder, tmp_path):
    return TestClient(make_app(Settings(library=folder, page=tmp_path)), base_url="http://127.0.0.1:7700")


def project(seconds, mat=MAT, range_mm=700):
    leader, followers = blocks_of(Program([wait(seconds, id="w")], Followers([led(1, 1)])))
    return {"leader": leader, "followers": followers, "profile": "classroom", "mat": mat, "range_mm": range_mm}


def url(name):
    return f"/api/projects/{quote(name, safe='')}"


def code(answer):
    return answer.status_code, answer.json()["error"]["code"]


@pytest.mark.parametrize("name", ["square", "我的程序", "50% + a? #1 & b;c", "deleted", "versions", "CON", "a b"])
def test_what_is_saved_comes_back_as_it_was(page, name):
    assert page.put(url(name), json=project(1)).json() == {"version": 1}
    assert page.put(url(name), json=project(2)).json() == {"version": 2}
    assert page.get(url(name)).json() == {"name": name, **project(2)}
    assert page.get(url(name), params={"version": 1}).json() == {"name": name, **project(1)}
    listed = page.get("/api/projects").json()
    assert [(each["name"], each["versions"]) for each in listed] == [(name, 2)]
    versions = page.get(f"{url(name)}/versions").json()
    assert [each["version"] for each in versions] == [2, 1]
    assert versions[0]["saved_at"] == listed[0]["saved_at"]


def test_a_save_on_the_disk_is_a_project_file(page, folder):
    page.put(url("a"), json=project(1))
    (file,) = folder.rglob("*.motorcade.json")
    assert read_program(file.read_bytes()) == Program([wait(1, id="w")], Followers([led(1, 1)]))


def test_a_project_without_a_mat_or_a_finished_program_is_kept_too(page):
    unfinished = {**project(1, mat=None), "leader": {"blocks": {"blocks": [{"type": "motorcade_leader", "next": 3}]}}}
    page.put(url("a"), json=unfinished)
    assert page.get(url("a")).json() == {"name": "a", **unfinished}


def test_a_deleted_project_is_gone(page):
    page.put(url("a"), json=project(1))
    answer = page.delete(url("a"))
    assert (answer.status_code, answer.content) == (204, b"")
    assert page.get("/api/projects").json() == []
    for gone in (page.get(url("a")), page.get(f"{url('a')}/versions"), page.delete(url("a"))):
        assert code(gone) == (404, "no-project")


def test_a_damaged_save_says_so_and_the_others_are_there(page, folder):
    page.put(url("a"), json=project(1))
    page.put(url("a"), json=project(2))
    page.put(url("b"), json=project(3))
    next(folder.glob("a-*/000002*")).write_bytes(b'{"format": \xff')
    assert code(page.get(url("a"))) == (409, "damaged-version")
    assert page.get(url("a"), params={"version": 1}).json() == {"name": "a", **project(1)}
    assert sorted(each["name"] for each in page.get("/api/projects").json()) == ["a", "b"]
    # The next save heals it.
    assert page.put(url("a"), json=project(4)).json() == {"version": 3}
    assert page.get(url("a")).status_code == 200


@pytest.mark.parametrize("version", ["x", "-1", "1.5", "", "1" * 5000, "\N{SUPERSCRIPT TWO}"])
def test_a_version_that_is_no_number(page, version):
    page.put(url("a"), json=project(1))
    assert code(page.get(url("a"), params={"version": version})) == (400, "bad-message")


def test_a_version_that_is_not_there(page):
    page.put(url("a"), json=project(1))
    assert code(page.get(url("a"), params={"version": 7})) == (404, "no-version")


@pytest.mark.parametrize("name", ["x" * 61, "a\nb", "%2e%2e", "a\\b", " "])
def test_a_bad_name_is_refused(page, folder, name):
    if name == "%2e%2e":
        answer = page.put(f"/api/projects/{name}", json=project(1))
    else:
        answer = page.put(url(name), json=project(1))
    assert code(answer)[1] in ("bad-name", "not-found", "bad-request")
    assert not folder.exists()


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"{}", b'{"leader": 1}', b'{"leader": {}, "mat": []}'])
def test_what_is_no_project_is_not_saved(page, folder, body):
    assert code(page.put(url("a"), content=body)) == (400, "bad-message")
    assert not folder.exists()
