"""``motorcade drive remote`` and ``motorcade studio --car`` as their users start them."""

import json
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from websockets.sync.client import connect

from motorcade.drive.certificates import CarKeys, make_keys
from motorcade.drive.keys import server_context
from support.command_line import CTRL_C, refusal, started
from support.driven_car import PATIENT, DrivenCar
from support.picture_server import picture_server
from support.waiting import DEADLINE_S


@contextmanager
def serving(*command: str) -> Iterator[dict]:
    """What the command says once it answers; Ctrl-C ends it."""
    with started(*command, "--port", "0") as (process, told):
        yield told
        process.send_signal(CTRL_C)
        assert process.communicate(timeout=DEADLINE_S) == ("", "")
        assert process.returncode == 0


def listed(url: str, trust: ssl.SSLContext | None = None, sits: str = "") -> list[dict]:
    """The cars of a page, and whether it reaches the one at which it sits."""
    base, _, token = url.partition("?token=")
    socket_url = base.replace("http", "ws", 1).removesuffix("/").removesuffix("/drive") + "/drive/ws"
    cookie = {"Cookie": f"motorcade_{urlsplit(base).port}={token}"}
    with connect(socket_url, ssl=trust, open_timeout=DEADLINE_S, additional_headers=cookie) as line:
        if sits:
            line.send(json.dumps({"do": "join", "car": sits}))
        cars: list[dict] = []
        while not cars or sits:
            told = json.loads(line.recv(DEADLINE_S))
            cars = told["cars"] if told["is"] == "hello" else cars
            if told["is"] == "telemetry" and told["cars"].get(sits, {}).get("state") == "ready":
                sits = ""
        return cars


def test_it_serves_a_page_for_the_cars_that_it_names_and_ends_by_ctrl_c() -> None:
    with DrivenCar(profile=PATIENT) as car, picture_server("files") as camera:
        ada = f"ada=127.0.0.1:{car.port}/{car.telemetry_port}"
        with serving("drive", "remote", ada, "bo=127.0.0.1", "--camera", f"bo={camera.url}") as told:
            assert told["cars"] == ["ada", "bo"]
            assert urlsplit(told["url"]).path == "/drive"
            cars = listed(told["url"], sits="ada")
    assert [(each["name"], each["sees"]) for each in cars] == [("ada", False), ("bo", True)]


def test_with_keys_cars_and_page_are_reached_by_tls(tmp_path: Path) -> None:
    make_keys(tmp_path, [CarKeys("ada"), CarKeys("desk")], ["lin"], datetime.now(UTC))
    trust = ssl.create_default_context(cafile=str(tmp_path / "authority.crt"))
    with DrivenCar(profile=PATIENT, tls=server_context(tmp_path / "car-ada.pem")) as car:
        ada = f"ada=localhost:{car.port}/{car.telemetry_port}"
        keys = ("--keys", str(tmp_path / "driver-lin.pem"), "--https", str(tmp_path / "car-desk.pem"))
        with serving("drive", "remote", ada, "--host", "0.0.0.0", *keys) as told:
            where = urlsplit(told["url"])
            assert where.scheme == "https"
            assert listed(f"https://127.0.0.1:{where.port}/drive?{where.query}", trust, sits="ada")


def test_the_studio_takes_cars_by_address_too(tmp_path: Path) -> None:
    with DrivenCar(profile=PATIENT) as car:
        ada = f"ada=127.0.0.1:{car.port}/{car.telemetry_port}"
        with serving("studio", "--no-browser", "--library", str(tmp_path), "--car", ada) as told:
            assert [each["name"] for each in listed(told["url"], sits="ada")] == ["ada"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["192.168.1.20"], "'192.168.1.20' is not NAME=HOST[:PORT], such as ada=192.168.1.20"),
        (["ada=1.2.3.4", "--host", "0.0.0.0", "--port", "0"], "at 0.0.0.0 others in the network can reach the page"),
        (["ada=1.2.3.4", "--insecure-lan", "--https", "x.pem"], "--https and --insecure-lan exclude"),
        (["ada=1.2.3.4:x"], "'1.2.3.4:x' is not HOST or HOST:PORT"),
        (["ada=1.2.3.4:5005/0"], "'0' is no telemetry port of ada"),
        (["3=1.2.3.4"], "'3' is no name for a car"),
        (["ada=1.2.3.4", "ada=1.2.3.5"], "two cars are called ada"),
        (["ada=1.2.3.4", "--camera", "bo=http://1.2.3.4/"], "--camera is for bo, and no car has that name"),
        (["ada=1.2.3.4", "--camera", "ada=file:///etc/passwd"], "--camera of ada: 'file:///etc/passwd' is no address"),
        (["ada=1.2.3.4", "--keys", "nowhere.pem"], "the keys nowhere.pem can't be read"),
    ],
)
def test_what_can_not_be_is_said_in_a_sentence(arguments: list[str], sentence: str) -> None:
    assert refusal(2, "drive", "remote", *arguments).startswith(sentence)
