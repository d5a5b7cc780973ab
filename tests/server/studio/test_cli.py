"""The command `motorcade studio`, and its server in a process of its own."""

import json
import socket
import ssl
import stat
import sys
from collections import deque
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from unittest import mock

import httpx2 as httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from motorcade.cli import pages
from motorcade.drive.certificates import CarKeys, make_keys
from support.command_line import refusal
from support.running_studio import started, stop
from support.waiting import DEADLINE_S

SESSION = "0" * 32


def answer(studio, path, body=b"{}", **headers):
    """The status and the JSON of an answer."""
    answered = httpx.post(f"{studio.base}api/{path}", content=body, headers=studio.cookie | headers, timeout=DEADLINE_S)
    return answered.status_code, answered.json()


def test_the_printed_address_answers(studio):
    assert answer(studio, "projects/list") == (200, [])
    assert studio.base == f"http://127.0.0.1:{studio.port}/"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps a user's files from others by other means")
def test_other_users_of_the_computer_need_the_token_and_cannot_read_it(studio):
    assert answer(studio, "projects/list", Cookie="")[0] == 401
    assert answer(studio, "projects/list", Cookie=f"motorcade_{studio.port}=guessed")[0] == 401
    with pytest.raises(InvalidStatus):
        connect(f"ws://127.0.0.1:{studio.port}/api/world?session={SESSION}")
    assert stat.S_IMODE((Path(studio.library) / ".token").stat().st_mode) == 0o600


def half_sent(running):
    """Break off a request, and wait until the server has seen it."""
    with socket.create_connection(("127.0.0.1", running.port)) as line:
        head = f"POST /api/open HTTP/1.1\r\nHost: 127.0.0.1\r\nCookie: {running.cookie['Cookie']}\r\n"
        line.sendall(f"{head}Content-Length: 90\r\n\r\n{{".encode())
    # It has begun a process that answers, and the log of the one before is written.
    assert answer(running, "open", b'{"text": ""}')[0] == 400


def test_projects_are_stored_ctrl_c_ends_the_server_without_output_and_the_address_stays_good(tmp_path):
    with started(tmp_path / "mine") as running:
        assert answer(running, "projects/write", b'{"name": "a", "project": {"leader": {}}}') == (
            200,
            {"version": 1, "stays": True},
        )
        with connect(
            f"ws://127.0.0.1:{running.port}/api/world?session={SESSION}", additional_headers=running.cookie
        ) as page:
            assert json.loads(page.recv())["is"] == "hello"
            half_sent(running)
            assert stop(running.process) == ("", "")
        assert running.process.returncode == 0
    assert running.library == str(tmp_path / "mine")
    assert len(list((tmp_path / "mine").rglob("*.motorcade.json"))) == 1
    with started(tmp_path / "mine") as again:
        tokens = [each.cookie["Cookie"].partition("=")[2] for each in (running, again)]
    assert tokens[0] == tokens[1] != ""


def test_a_used_port_is_refused_with_a_sentence(studio):
    said = refusal(2, "studio", "--port", studio.port, "--no-browser", "--library", studio.library)
    assert said.startswith(f"port {studio.port} is taken. Perhaps the studio runs already: open {studio.url}")


@pytest.mark.parametrize(("host", "page"), [("0.0.0.0", "http://127.0.0.1:{}/"), ("::", "http://[::1]:{}/")])
def test_a_used_port_at_all_addresses_names_a_page_that_can_be_opened(tmp_path, host, page):
    with socket.create_server((host, 0), family=socket.AF_INET6 if ":" in host else socket.AF_INET) as other:
        port = other.getsockname()[1]
        said = refusal(2, "studio", "--host", host, "--port", port, "--no-browser", "--library", tmp_path)
    assert f"open {page.format(port)}" in said


@pytest.mark.parametrize("host", ["no.such.host.invalid", "", "a b", "192.0.2.1", "\N{PILE OF POO}" * 64])
def test_an_address_of_another_computer_is_refused_with_a_sentence(host):
    said = refusal(2, "studio", "--host", host, "--port", "0", "--no-browser")
    assert said.startswith(("--host", "the studio can't listen"))


def test_other_computers_need_https_and_the_printed_token(tmp_path):
    make_keys(tmp_path / "keys", [CarKeys("desk")], [], datetime.now(UTC))
    trust = ssl.create_default_context(cafile=str(tmp_path / "keys" / "authority.crt"))
    with started(tmp_path, "--host", "0.0.0.0", "--https", str(tmp_path / "keys" / "car-desk.pem")) as running:
        assert running.url.startswith("https://")
        shown = running.url.partition("/?")[2]
        assert len(shown) > len("token=") + 20
        with httpx.Client(base_url=f"https://127.0.0.1:{running.port}", verify=trust, timeout=DEADLINE_S) as browser:
            assert browser.post("/api/projects/list").status_code == 401
            assert browser.get(f"/?{shown}").status_code == 303
            assert browser.post("/api/projects/list").json() == []
        with socket.create_connection(("127.0.0.1", running.port), 60) as plain, suppress(ConnectionError):
            plain.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert b"HTTP" not in plain.recv(1000)


def test_without_https_other_computers_reach_the_page_only_where_that_is_asked_for(tmp_path):
    studio = ("studio", "--host", "0.0.0.0", "--port", "0", "--no-browser", "--library", str(tmp_path))
    said = refusal(2, *studio)
    assert said.startswith("at 0.0.0.0 others in the network can reach the page")
    assert "--https" in said
    assert "--insecure-lan" in said
    both = ("--insecure-lan", "--https", "car-desk.pem")
    assert "--https" in refusal(2, *studio, *both)


def test_an_endless_message_is_refused(studio):
    with connect(
        f"ws://127.0.0.1:{studio.port}/api/world?session={'1' * 32}", additional_headers=studio.cookie
    ) as page:
        with suppress(ConnectionClosed):
            page.send(" " * (1 << 20) + " ")
        # What was on its way already comes first; then the connection's end.
        with pytest.raises(ConnectionClosed) as closed:
            deque(iter(partial(page.recv, timeout=DEADLINE_S), None))
    assert closed.value.rcvd.code == 1009


@pytest.mark.parametrize(
    ("system", "display", "opens"),
    [("linux", "DISPLAY", True), ("linux", "WAYLAND_DISPLAY", True), ("linux", "OTHER", False), ("win32", "X", True)],
)
def test_a_browser_is_opened_where_it_has_a_window(monkeypatch, system, display, opens):
    threads = []
    monkeypatch.setattr(pages.threading, "Thread", lambda **how: threads.append(how) or mock.Mock())
    monkeypatch.setattr(pages.sys, "platform", system)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(display, "0")
    pages.open_browser("http://127.0.0.1:7700/")
    assert [how["args"] for how in threads] == [("http://127.0.0.1:7700/",)] * opens
