"""A remote's page and its car: driving, telemetry, the emergency stop, pictures, and who is served."""

import asyncio
import gc
import io
import json
from contextlib import ExitStack, contextmanager
from typing import get_args

import pytest
from PIL import Image
from starlette.testclient import TestClient, WebSocketDenialResponse

from motorcade.cameras.broadcast import Camera
from motorcade.car.arbiter import STATES
from motorcade.config.profile import built_in_profile
from motorcade.drive.session import CarControl, ControlSession
from motorcade.drive.stamps import stamp_at
from motorcade.drive.wire import SessionError
from motorcade.server.fleet import SingleCar
from motorcade.server.remote import make_remote
from motorcade.server.remote_messages import CarState
from motorcade.server.request_filter import ServerSettings
from support.mock_board import NEUTRAL, MockDriveBoard
from support.remote_page import RemotePage

HERE = "http://127.0.0.1:7700"
TOKEN = "a-token-that-nobody-guesses"
PROFILE = built_in_profile("classroom")


class Dots:
    """A camera whose pictures have one colour."""

    def jpeg(self):
        file = io.BytesIO()
        Image.new("RGB", (8, 8), "red").save(file, "JPEG")
        return file.getvalue()

    def close(self):
        pass


class RemoteRig:
    """A car and a browser."""

    def __init__(self, client, drive):
        self.client, self.drive, self.wheels = client, drive, drive.board

    def connect(self, path="/drive/ws", **headers):
        host = str(self.client.base_url).removeprefix("http")
        return self.client.websocket_connect(f"ws{host}{path}", headers=headers)

    @contextmanager
    def page(self, **headers):
        with self.connect(**headers) as socket:
            yield OnlyCarPage(socket)


class OnlyCarPage(RemotePage):
    """The page of the only car."""

    def __init__(self, socket):
        super().__init__(socket)
        self.hello = self.until("hello")

    def car(self, holds):
        return super().car("1", holds)

    def drive(self, throttle, steering=0.0, number=0):
        super().drive("1", throttle=throttle, steering=steering, number=number)


@pytest.fixture
def visit():
    """Make a server of one car with these settings."""
    with ExitStack() as opened:

        def visiting(base_url=HERE, camera=None, **settings):
            drive = CarControl(MockDriveBoard(), lambda: 0, PROFILE)
            app = make_remote(ServerSettings(**settings), SingleCar(drive, camera() if camera else None))
            client = opened.enter_context(TestClient(app, base_url=base_url, follow_redirects=False))
            return RemoteRig(client, drive)

        yield visiting


def test_the_stick_moves_the_wheels(visit):
    rig = visit()
    with rig.page() as page:
        page.send("join", car="1")
        page.drive(0.0, number=1)
        page.drive(0.5, -1.0, number=2)
        received = page.car(lambda car: car["speed"])
        assert rig.wheels.setpoint == (180, 1, 128)
        assert (received["state"], received["you"]["drives"]) == ("moving", True)
        page.drive(-1.0, 1.0, number=3)
        assert rig.wheels.setpoint == (0, 0, 255)


def test_a_position_that_a_round_of_the_stamps_held_back_moves_nothing(visit):
    at_s = [100.0]
    rig = visit(clock=lambda: at_s[0])
    with rig.page() as page:
        page.send("join", car="1")
        # Nothing moves before the page has answered the server's clock, nor after one round of the stamps.
        for now_ms, number, throttles in ((0, 1, (0.7, 0.6)), (8188, 3, (1.0, 0.0, 0.5))):
            at_s[0] = 100 + now_ms / 1000
            for each, throttle in enumerate(throttles, number):
                page.send("drive", cars=["1"], throttle=throttle, steering=0.0, number=each, stamp=stamp_at(now_ms))
                assert page.until("received")["stale"] == (each == number)
                clock = each == number and page.until("telemetry", lambda received: received["clock"])["clock"]
                page.send("sync", clock=int(clock), number=each, stamp=stamp_at(now_ms))
    assert [setpoint[2] for _, setpoint in rig.wheels.notes if setpoint[2]] == [153, 128]


def test_a_page_whose_address_is_unknown_drives(visit):
    """The system tells none of a connection that was broken off at once."""
    rig = visit()
    unknown = TestClient(rig.client.app, base_url=HERE, client=None)
    with unknown, RemoteRig(unknown, rig.drive).page() as page:
        page.send("join", car="1")
        page.drive(0.5)
        assert page.car(lambda car: car["speed"])["you"]["drives"]


def test_the_car_stands_still_when_its_page_leaves(visit):
    rig = visit()
    with rig.page() as page:
        page.send("join", car="1")
        page.drive(1.0)
    assert rig.wheels.setpoint == NEUTRAL
    assert rig.drive.telemetry().watchers == 0


def test_what_a_page_has_asked_for_is_forgotten_when_it_is_done(visit):
    """A page may stay for days."""
    with visit().page() as page:
        page.send("join", car="1")
        for _ in range(100):
            page.send("release", car="1")
        page.drive(0.0)
        # Not isinstance: it looks through a weak proxy, which another test has left, at what is gone.
        done = [found for found in gc.get_objects() if issubclass(type(found), asyncio.Task) and found.done()]
    assert len(done) < 50


def test_a_page_must_join_a_car_to_drive_it(visit):
    rig = visit()
    with rig.page() as page:
        page.drive(1.0)
        page.send("request", car="1")
        assert page.until("error")["code"] == "not-at-car"
    assert not rig.wheels.has_moved()


def test_one_page_drives_and_the_others_watch_until_it_releases(visit):
    rig = visit()
    with rig.page() as one, rig.page() as other:
        for page in (one, other):
            page.send("join", car="1")
        one.drive(1.0, number=1)
        other.drive(-1.0, number=2)
        assert rig.wheels.setpoint == (90, 1, 255)
        assert other.car(lambda car: car["you"]["watching"])["driver"] == one.hello["you"]
        other.send("request", car="1")
        assert other.car(lambda car: car["wanted_by"])["you"]["waits"]
        one.send("release", car="1")
        assert other.car(lambda car: car["driver"] == other.hello["you"])["you"]["drives"]


def test_every_page_may_stop_the_car_and_it_stays_stopped(visit):
    rig = visit()
    with rig.page() as driver, rig.page() as watcher, rig.page() as other:
        for page in (driver, watcher):
            page.send("join", car="1")
        driver.drive(1.0, number=1)
        # Also one that has not joined.
        other.send("stop", cars=["1"])
        watcher.car(lambda car: car["state"] == "stopped")
        driver.drive(1.0, number=2)
        assert rig.wheels.setpoint == NEUTRAL
        watcher.send("clear", car="1")
        watcher.car(lambda car: car["state"] == "failsafe")
        driver.drive(0.0, number=3)
        driver.drive(1.0, number=4)
        assert rig.wheels.setpoint == (90, 1, 255)


def test_a_full_car_refuses_another_driver_in_every_language_but_not_its_stop(visit):
    rig = visit()
    full = SessionError("full", sessions=9)
    for number in range(9):
        ControlSession(rig.drive, f"watcher {number}", f"192.168.1.{number}").take_place()
    with rig.page() as page:
        page.send("join", car="1")
        page.send("drive", cars=["1"], throttle=1.0, steering=0.0, number=1)
        assert page.until("error")["sentence"] == {language: full.sentence(language) for language in ("en", "zh")}
        page.send("stop", cars=["1"])
        page.car(lambda car: car["state"] == "stopped")
        page.send("join", car="2")
        assert page.until("error")["code"] == "car-not-listed"


def test_twenty_pages_that_only_look_leave_all_places_free(visit):
    rig = visit()
    with ExitStack() as open_pages:
        looking = [open_pages.enter_context(rig.page()) for _ in range(20)]
        for page in looking:
            page.send("join", car="1")
        for page in looking:
            page.car(lambda car: car["state"])
        assert rig.drive.telemetry().watchers == 0
        page.drive(0.5, number=1)
        assert page.car(lambda car: car["speed"])["you"]["drives"]


@pytest.mark.parametrize(
    "said",
    [
        "?",
        '{"do": "fly"}',
        '{"do": "drive", "cars": ["1"], "throttle": 1.01, "steering": 0}',
        '{"do": "drive", "cars": ["1"], "throttle": 1, "steering": 0, "word": 311209984}',
        '{"do": "join", "car": "' + "1" * 41 + '"}',
        "[" * 5000,
    ],
)
def test_an_invalid_message_is_refused_and_changes_nothing(visit, said):
    rig = visit()
    with rig.page() as page:
        page.send("join", car="1")
        page._socket.send_text(said)
        assert page.until("error")["code"] in ("bad-message", "message-too-deep")
        page.drive(0.5, number=1)
    assert [setpoint for _, setpoint in rig.wheels.notes if setpoint[2]] == [(90, 1, 128)]


# Pictures


def test_the_camera_sends_pictures_one_after_the_other(visit):
    """Read the first parts of an endless answer."""
    rig = visit(camera=lambda: Camera(Dots(), rate_hz=200))
    seen, enough = [], asyncio.Event()

    async def send(message):
        seen.append(message)
        if len(seen) == 4:
            enough.set()

    headers = [(b"host", b"127.0.0.1:7700")]
    scope = {"type": "http", "method": "GET", "path": "/camera", "query_string": b"rate=30", "headers": headers}
    scope |= {"http_version": "1.1", "scheme": "http", "client": ("127.0.0.1", 1), "root_path": "", "asgi": {}}

    async def receive():
        await enough.wait()
        return {"type": "http.disconnect"}

    rig.client.portal.call(rig.client.app, scope, receive, send)
    start = {name.decode(): value.decode() for name, value in seen[0]["headers"]}
    assert start["content-type"] == "multipart/x-mixed-replace; boundary=motorcade-picture"
    head, _, picture = seen[1]["body"].partition(b"\r\n\r\n")
    assert head.splitlines()[:2] == [b"--motorcade-picture", b"Content-Type: image/jpeg"]
    assert int(head.rpartition(b" ")[2]) == len(picture) - 2
    assert Image.open(io.BytesIO(picture)).size == (8, 8)


def test_a_snapshot_is_one_picture(visit):
    answer = visit(camera=lambda: Camera(Dots())).client.get("/camera/snapshot.jpg")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/jpeg")
    assert answer.headers["cache-control"] == "no-store"
    assert Image.open(io.BytesIO(answer.content)).size == (8, 8)


@pytest.mark.parametrize(
    ("path", "status", "code"),
    [
        ("/camera/snapshot.jpg?car=7", 404, "car-not-listed"),
        ("/nowhere/at/all", 404, "not-found"),
        *((f"/camera?rate={rate}", 400, "bad-request") for rate in ("0", "31", "nan", "many")),
    ],
)
def test_an_address_without_content_is_refused(visit, path, status, code):
    assert visit().client.get("/camera").json()["error"]["code"] == "no-camera-here"
    answer = visit(camera=lambda: Camera(Dots())).client.get(path)
    assert (answer.status_code, answer.json()["error"]["code"]) == (status, code)


# Who is served


def denied(rig, path="/drive/ws", **headers):
    with pytest.raises(WebSocketDenialResponse) as refused, rig.connect(path, **headers):
        pass
    return refused.value.status_code, json.loads(refused.value.content)["error"]["code"]


def test_a_page_of_another_site_drives_nothing(visit):
    rig = visit()
    assert denied(rig, origin="http://evil.example") == (403, "foreign-origin")
    assert denied(rig, **{"sec-fetch-site": "cross-site"}) == (403, "foreign-origin")
    with rig.page(origin=HERE) as page:
        page.send("join", car="1")
    assert rig.client.get("/camera", headers={"sec-fetch-site": "cross-site"}).status_code == 403


def test_another_machine_needs_the_token(visit):
    rig = visit("http://192.168.1.5:7700", token=TOKEN, camera=lambda: Camera(Dots()))
    assert denied(rig) == (401, "token-needed")
    assert denied(rig, f"/drive/ws?token={TOKEN}") == (401, "token-needed")
    assert rig.client.get("/camera/snapshot.jpg").status_code == 401
    assert rig.client.get("/camera/snapshot.jpg?token=x").status_code == 401
    # A program without cookies, such as a player of films.
    assert rig.client.get(f"/camera/snapshot.jpg?token={TOKEN}").status_code == 200
    assert rig.client.get("/drive?token=x").status_code == 403
    shown = rig.client.get(f"/drive?token={TOKEN}")
    assert (shown.status_code, shown.headers["location"]) == (303, "/drive")
    with rig.page() as page:
        page.send("join", car="1")
    shown = visit("https://192.168.1.5:7700", token=TOKEN).client.get(f"/drive?token={TOKEN}")
    assert "Secure" in shown.headers["set-cookie"].split("; ")


def test_the_first_page_is_the_remote(visit):
    answer = visit().client.get("/")
    assert (answer.status_code, answer.headers["location"]) == (307, "/drive")


def test_the_page_knows_every_state_of_a_car():
    assert get_args(CarState) == (*(name for name, _ in STATES), "away")
