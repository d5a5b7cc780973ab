"""Which requests are served: host names, origins, tokens, sizes and rates."""

import asyncio
import json
from contextlib import closing
from http.client import HTTPConnection, IncompleteRead

import pytest
from starlette.applications import Starlette
from starlette.responses import StreamingResponse
from starlette.routing import Route
from starlette.testclient import TestClient, WebSocketDenialResponse

from motorcade.errors import MotorcadeError
from motorcade.locales import languages
from motorcade.server.request_filter import RequestFilter, ServerSettings
from motorcade.server.studio.app import make_app
from motorcade.server.studio.sessions import Settings
from motorcade.service import programs
from support.served_app import served
from support.waiting import DEADLINE_S

HERE = "http://127.0.0.1:7700"
TOKEN = "a-token-that-nobody-guesses"
WORLD = "/api/world?session=" + "0" * 32


@pytest.fixture
def visit(tmp_path):
    """A browser at a studio with these settings."""

    def visiting(base_url=HERE, **settings):
        settings = {"library": tmp_path, "page": tmp_path, "clock": lambda: 0.0, **settings}
        return TestClient(make_app(Settings(**settings)), base_url=base_url, follow_redirects=False)

    return visiting


@pytest.fixture
def others(visit):
    """A browser elsewhere, at a studio that others may reach."""
    return visit("http://192.168.1.5:7700", token=TOKEN, names=frozenset({"school.local"}))


def code(answer):
    """The status and the code of an error, which has a sentence in every language."""
    error = answer.json()["error"]
    assert set(error["sentence"]) == set(languages())
    assert all(error["sentence"].values())
    return answer.status_code, error["code"]


def world(client, **headers):
    """The page's WebSocket."""
    return client.websocket_connect(f"ws{str(client.base_url).removeprefix('http')}{WORLD}", headers=headers)


def denied(client, **headers):
    """The code with which a WebSocket is refused."""
    with pytest.raises(WebSocketDenialResponse) as refused, world(client, **headers):
        pass
    return refused.value.status_code, json.loads(refused.value.content)["error"]["code"]


@pytest.mark.parametrize(
    "host",
    ["evil.example", "127.0.0.1.evil.example", "0.0.0.0", "192.168.1.5", "user@127.0.0.1", "127.0.0.1/x", "2130706433"],
)
def test_a_foreign_name_is_refused_everywhere_and_those_of_this_computer_at_no_port(visit, host):
    page = visit()
    for path in ("/", "/assets/x.js", "/api/projects"):
        assert code(page.get(path, headers={"host": host})) == (403, "foreign-host")
    assert denied(page, host=host) == (403, "foreign-host")
    two = page.get("/", headers=[("host", "127.0.0.1"), ("host", host)])
    assert code(two) == (403, "foreign-host")
    assert "content-security-policy" in two.headers
    assert f"under the name 127.0.0.1, {host}." in two.json()["error"]["sentence"]["en"]
    assert "under the name ''." in page.get("/", headers={"host": ""}).json()["error"]["sentence"]["en"]
    for own in ("127.0.0.1:7700", "localhost:8000", "LOCALHOST", "127.9.9.9", "[::1]"):
        assert page.post("/api/projects/list", headers={"host": own}).status_code == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:7701", "ftp://127.0.0.1:7700", ""])
def test_a_page_of_another_site_is_refused(visit, origin):
    page = visit()
    assert code(page.post("/api/projects/list", headers={"origin": origin})) == (403, "foreign-origin")
    assert code(page.post("/api/compile", json={"leader": {}}, headers={"origin": origin})) == (403, "foreign-origin")
    assert denied(page, origin=origin) == (403, "foreign-origin")


@pytest.mark.parametrize("headers", [{}, {"origin": HERE}, {"origin": "https://127.0.0.1:7700"}])
def test_the_studios_own_page_is_served(visit, headers):
    page = visit()
    assert page.post("/api/compile", json={"leader": {}}, headers=headers).status_code == 200
    with world(page, **headers) as socket:
        assert socket.receive_json()["is"] == "hello"


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_another_site_may_link_to_the_page_but_not_send_requests(visit, site):
    page = visit()
    assert page.get("/", headers={"sec-fetch-site": site}).status_code == 503
    assert code(page.post("/api/ports", headers={"sec-fetch-site": site})) == (403, "foreign-origin")
    assert page.post("/api/projects/list", headers={"sec-fetch-site": "same-origin"}).status_code == 200


def chunks(count):
    for _ in range(count):
        yield b" " * 1024


def test_a_body_is_bounded_also_where_it_comes_in_pieces(visit):
    page = visit(most_body=64 * 1024)
    fits = b'{"leader": {}}'.ljust(64 * 1024)
    assert page.post("/api/compile", content=fits).status_code == 200
    assert code(page.post("/api/compile", content=fits + b" ")) == (413, "body-too-large")
    assert code(page.post("/api/compile", content=chunks(65))) == (413, "body-too-large")
    assert code(page.post("/api/projects/write", content=chunks(65))) == (413, "body-too-large")
    assert code(page.post("/api/compile", content=chunks(64))) == (400, "bad-message")


@pytest.mark.parametrize("length", ["-1", "1048577", "9" * 5000, "\N{SUPERSCRIPT TWO}"])
def test_an_invalid_or_too_large_length_is_refused(visit, length):
    headers = {b"content-length": length.encode()}
    answer = visit().request("POST", "/api/compile", headers=headers)
    assert answer.status_code == 413


def test_an_address_that_sends_too_fast_is_refused_and_the_others_are_served(visit):
    now_s = [0.0]
    page = visit(requests_a_second=10, clock=lambda: now_s[0])
    other = TestClient(page.app, base_url=HERE, client=("10.0.0.2", 1))
    assert [page.post("/api/projects/list").status_code for _ in range(21)] == [200] * 20 + [429]
    assert code(page.get("/")) == (429, "requests-too-fast")
    assert denied(page) == (429, "requests-too-fast")
    assert other.post("/api/projects/list").status_code == 200
    now_s[0] = 1.9
    assert page.post("/api/projects/list").status_code == 429
    now_s[0] = 2.0
    assert [page.post("/api/projects/list").status_code for _ in range(21)] == [200] * 20 + [429]


def test_without_the_token_nothing_is_served_but_the_reason(others):
    shown = others.get("/")
    assert shown.status_code == 401
    assert all(MotorcadeError("token-needed").sentence(language) in shown.text for language in languages())
    assert code(others.post("/api/projects/list")) == (401, "token-needed")
    assert code(others.post("/api/projects/write", json={"leader": {}})) == (401, "token-needed")
    assert denied(others) == (401, "token-needed")


def test_the_token_becomes_a_cookie_that_scripts_cannot_read(others):
    answer = others.get("/", params={"token": TOKEN})
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    cookie = answer.headers["set-cookie"]
    # Each studio of a computer has its own.
    assert cookie.startswith("motorcade_7700=")
    assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(cookie.split("; "))
    assert others.post("/api/projects/list").status_code == 200
    with world(others) as socket:
        assert socket.receive_json()["is"] == "hello"


@pytest.mark.parametrize("wrong", ["", TOKEN[:-1], TOKEN + "x", "\N{PILE OF POO}"])
def test_a_wrong_token_is_refused(others, wrong):
    shown = others.get("/", params={"token": wrong})
    assert shown.status_code == 403
    assert MotorcadeError("wrong-token").sentence() in shown.text
    assert code(others.post("/api/projects/list", headers={"cookie": b"motorcade_7700=" + wrong.encode()}))[0] == 401
    assert code(others.post("/api/projects/list", params={"token": TOKEN})) == (401, "token-needed")


@pytest.mark.parametrize("host", ["school.local:7700", "School.local", "[fe80::1]:7700", "10.0.0.1"])
def test_others_may_use_its_names_and_addresses(others, host):
    assert others.get("/", headers={"host": host, "cookie": f"motorcade_7700={TOKEN}"}).status_code == 503
    assert code(others.get("/", headers={"host": "evil.example"})) == (403, "foreign-host")


@pytest.mark.parametrize("path", ["/", "/api/nothing", "/assets/x.js"])
def test_every_answer_has_the_security_headers(visit, path):
    answer = visit().get(path)
    policy = dict(each.strip().split(" ", 1) for each in answer.headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'self'"
    assert "script-src" not in policy
    assert not any(source in " ".join(policy.values()) for source in ("http", "*", "unsafe-eval"))
    assert policy["frame-ancestors"] == "'none'"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert "access-control-allow-origin" not in answer.headers


def test_a_browser_caches_only_what_never_changes(visit, tmp_path):
    (tmp_path / "assets").mkdir()
    (tmp_path / "index.html").write_text("<!doctype html>")
    (tmp_path / "assets" / "x-1a2b.js").write_text("// " + "x" * 5000)
    page = visit()
    assert page.get("/").headers["cache-control"] == "no-cache"
    assert page.post("/api/projects/list").headers["cache-control"] == "no-store"
    script = page.get("/assets/x-1a2b.js")
    assert "immutable" in script.headers["cache-control"]
    assert script.headers["content-encoding"] == "gzip"


def test_a_long_answer_is_sent_compressed(visit):
    """The kinds of cars are part of what a page loads first."""
    page = visit()
    assert page.post("/api/profiles").headers["content-encoding"] == "gzip"
    assert "content-encoding" not in page.post("/api/projects/list").headers


@pytest.mark.parametrize("path", ["/../secret", "/%2e%2e/secret", "/x/%2e%2e/%2e%2e/secret"])
def test_no_path_leads_out_of_the_pages_folder(visit, tmp_path, path):
    (tmp_path / "page").mkdir()
    (tmp_path / "page" / "index.html").write_text("<!doctype html>")
    (tmp_path / "secret").write_text("not yours")
    assert code(visit(page=tmp_path / "page").get(path)) == (404, "not-found")


def test_an_unexpected_exception_is_an_error_without_its_traceback(visit, monkeypatch):
    def fail():
        raise RuntimeError("a secret of the server")

    monkeypatch.setattr(programs, "built_in_profiles", fail)
    page = TestClient(visit().app, base_url=HERE, raise_server_exceptions=False)
    answer = page.post("/api/profiles")
    assert code(answer) == (500, "internal")
    assert answer.headers["content-type"] == "application/json"
    assert not any(word in answer.text for word in ("secret", "RuntimeError", "Traceback"))


@pytest.mark.parametrize("path", ["/api/projects/list", "/api/nothing"])
def test_a_request_is_refused_unless_its_method_is_post(visit, tmp_path, path):
    (tmp_path / "index.html").write_text("<!doctype html>")
    answer = visit(page=tmp_path).get(path)
    assert code(answer) == (405, "bad-request")
    assert answer.headers["allow"] == "POST"


def test_a_page_that_is_not_built_is_replaced_by_instructions(visit):
    answer = visit().get("/")
    assert answer.status_code == 503
    assert "make page" in answer.text


def test_a_stream_of_somebody_who_is_out_ends_and_nothing_is_logged(capfd):
    known = ["mia"]

    async def pictures():
        while True:
            yield b"picture"
            await asyncio.sleep(0.01)

    def make():
        app = Starlette(routes=[Route("/camera", lambda request: StreamingResponse(pictures()))])
        return RequestFilter(app, ServerSettings(), lambda connection, holder: None, lambda _: (known[0], False))

    with served(make) as address, closing(HTTPConnection(*address, timeout=DEADLINE_S)) as connection:
        connection.request("GET", "/camera")
        answer = connection.getresponse()
        assert answer.read(7) == b"picture"
        known[0] = ""
        with pytest.raises((IncompleteRead, ConnectionError)):
            answer.read()
        answer.close()
    assert capfd.readouterr().err == ""
