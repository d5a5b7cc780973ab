"""Real cars in a remote's page: driven together, without network, driven by others, stopped; and only listed ones."""

import asyncio
import socket
from contextlib import ExitStack, aclosing, contextmanager
from datetime import UTC, datetime
from functools import partial

import pytest
from anyio.from_thread import start_blocking_portal
from starlette.testclient import TestClient

from motorcade.cameras.broadcast import Camera
from motorcade.drive import client as drive_client
from motorcade.drive.certificates import CarKeys, make_keys
from motorcade.drive.keys import client_context, server_context
from motorcade.drive.wire import SessionError
from motorcade.errors import MotorcadeError
from motorcade.server.fleet import IDLE_S, RemoteCar, RemoteCars, is_name
from motorcade.server.remote import make_remote
from motorcade.server.request_filter import ServerSettings
from motorcade.service.messages import sentences
from motorcade.timing import monotonic_ms
from support.driven_car import PATIENT, DrivenCar, deaf_port
from support.fault_proxy import FaultProxy
from support.loop_car import loop_car
from support.mock_clock import mock_clock, pass_time
from support.picture_server import picture_server
from support.remote_page import RemotePage
from support.waiting import until, wait_until

HERE = "127.0.0.1:7700"
FULL = (90, 1, 255)


@pytest.fixture
def ada():
    with DrivenCar(profile=PATIENT) as car:
        yield car


@pytest.fixture
def bo():
    with DrivenCar(profile=PATIENT) as car:
        yield car


@pytest.fixture
def nowhere():
    """A port without a server."""
    with deaf_port() as port:
        yield port


def at(name, car, **more):
    return RemoteCar(name, "127.0.0.1", car.port, car.telemetry_port, **more)


class FleetNetwork:
    """The network between the server and one car, in an event loop of its own; it can be cut."""

    def __init__(self, portal, proxies):
        self._portal, self._proxies = portal, proxies
        self._ends = [proxy.target for proxy in proxies]

    def cut(self, port):
        """End all connections; new ones come out at this port."""
        for proxy in self._proxies:
            proxy.target = "127.0.0.1", port
            self._portal.call(proxy.cut)

    def restore(self):
        """Forward new connections to the car again."""
        for proxy, end in zip(self._proxies, self._ends, strict=True):
            proxy.target = end


@contextmanager
def served(*cars, keys=None):
    """Make a server of real cars; give a function that opens a page, which joins cars and waits for their telemetry."""
    with TestClient(make_remote(ServerSettings(), RemoteCars(cars, keys)), base_url=f"http://{HERE}") as client:

        @contextmanager
        def page(*sits, user=""):
            with client.websocket_connect(f"ws://{HERE}/drive/ws?name={user}") as socket:
                page = RemotePage(socket)
                for car in sits:
                    page.send("join", car=car)
                for car in sits:
                    page.car(car)
                yield page

        page.client = client
        yield page


@pytest.fixture
def pages(ada, bo):
    """Pages of a server of two cars."""
    with served(at("ada", ada), at("bo", bo)) as page:
        yield page


@pytest.fixture
def cuttable(ada, bo):
    """The same, and the network between the server and ada."""
    with start_blocking_portal() as portal, ExitStack() as held:
        ends = [FaultProxy(port) for port in (ada.port, ada.telemetry_port)]
        proxies = [held.enter_context(portal.wrap_async_context_manager(end)) for end in ends]
        with served(RemoteCar("ada", "127.0.0.1", *(proxy.port for proxy in proxies)), at("bo", bo)) as page:
            yield page, FleetNetwork(portal, proxies)


def test_real_cars_are_listed_by_name(ada, bo):
    with served(at("ada", ada, camera="http://127.0.0.1/camera"), at("bo", bo)) as pages, pages() as page:
        listed = page.until("hello")["cars"]
    assert listed == [
        {"car": "ada", "leads": None, "sees": True, "name": "ada"},
        {"car": "bo", "leads": None, "sees": False, "name": "bo"},
    ]


def test_one_stick_drives_several_cars_and_they_stop_when_the_page_leaves(pages, ada, bo):
    with pages("ada", "bo") as page:
        page.push("ada", "bo")
        received = page.car("ada", lambda car: car["driver"])
        assert received["you"]["drives"]
        assert received["driver"] == received["you"]["name"]
        assert ada.board.was_told(FULL)
        assert bo.board.was_told(FULL)
    wait_until(lambda: not ada.board.moves and not bo.board.moves)
    wait_until(lambda: ada.control.telemetry().watchers == bo.control.telemetry().watchers == 0)


def test_an_unreachable_car_has_a_reason_and_delays_no_other(bo, nowhere):
    with served(RemoteCar("ada", "127.0.0.1", nowhere), at("bo", bo)) as pages, pages("ada", "bo") as page:
        why = page.car("ada", lambda car: car["why"])["why"]
        assert why["en"].startswith(f"No car answers at 127.0.0.1:{nowhere} (")
        assert why["zh"].startswith(f"127.0.0.1:{nowhere} 处没有小车回答（")
        page.drive("ada", "bo")
        page.push("bo")
        page.send("request", car="ada")
        assert page.until("error")["sentence"]["en"].startswith("No car answers")


def test_a_car_without_network_stops_and_needs_a_released_stick_while_others_drive_on(
    cuttable, ada, bo, nowhere, monkeypatch
):
    pages, between = cuttable
    with pages("ada", "bo") as page:
        page.push("ada", "bo")
        between.cut(nowhere)
        page.car("ada", lambda car: car["state"] == "away" and car["why"])
        wait_until(lambda: not ada.board.moves)
        page.drive("ada", "bo")
        page.car("bo", lambda car: car["state"] == "moving")
        with monkeypatch.context() as patch:
            # So that no command expires, however late a busy machine repeats it.
            now_ms = monotonic_ms()
            patch.setattr(drive_client, "to_ticks", lambda seconds: now_ms)
            page.drive("ada", "bo")
            between.restore()
            count = len(ada.board.notes)
            seen = [page.car("ada", lambda car: car["state"] != "away")["state"]]
            for _ in range(10):
                page.drive("ada", "bo")
                seen.append(page.car("ada")["state"])
        assert set(seen) == {"failsafe"}
        assert not ada.board.has_moved(since=count)
        page.push("ada", "bo")


def test_others_are_shown_which_user_of_this_server_drives_and_waits(pages, bo):
    with pages("bo", user="Lin") as lin, pages("bo", user="Mei") as mei:
        lin.push("bo")
        mei.send("request", car="bo")
        received = mei.car("bo", lambda car: car["driver"] and car["wanted_by"])
        names = [received[key].partition(" · ")[0] for key in ("driver", "wanted_by")]
        assert names == ["Lin", "Mei"]


def test_the_emergency_stop_reaches_all_cars_and_unreachable_ones_later(cuttable, ada, bo, nowhere):
    pages, between = cuttable
    with pages("ada", "bo") as page:
        page.push("ada", "bo")
        between.cut(nowhere)
        page.car("ada", lambda car: car["why"])
        # One at which the page doesn't sit doesn't keep it from the others.
        page.send("stop", cars=["cy", "ada", "bo"])
        assert page.until("error")["code"] == "car-not-listed"
        page.car("bo", lambda car: car["state"] == "stopped")
        between.restore()
        page.car("ada", lambda car: car["state"] == "stopped")
        for car in ("ada", "bo"):
            page.send("clear", car=car)
            page.car(car, lambda car: car["state"] == "failsafe")
        page.push("ada", "bo")


def test_a_page_reaches_only_listed_cars(ada, bo):
    with served(at("ada", ada)) as pages, pages() as page:
        for car in (f"127.0.0.1:{bo.port}", f"bo=127.0.0.1:{bo.port}", "bo", ""):
            page.send("join", car=car)
            assert page.until("error")["code"] == "car-not-listed"
    assert not bo.server.commands


def test_driver_and_car_authenticate_with_keys(tmp_path):
    make_keys(tmp_path, [CarKeys("ada")], ["lin"], datetime.now(UTC))
    with DrivenCar(profile=PATIENT, tls=server_context(tmp_path / "car-ada.pem")) as car:
        keys = client_context(tmp_path / "driver-lin.pem")
        with served(at("ada", car), at("bo", car), keys=keys) as pages, pages("ada", "bo") as page:
            page.push("ada")
            assert page.car("ada")["driver"].startswith("lin:")
            why = page.car("bo", lambda received: received["why"])["why"]
            assert "doesn't show the certificate that your keys expect" in why["en"]
            assert "没有出示你的密钥所期望的证书" in why["zh"]


def test_all_pages_share_one_connection_to_a_camera(nowhere):
    async def look(url):
        camera = await RemoteCars([RemoteCar("ada", "127.0.0.1", nowhere, camera=url)]).camera("ada")
        async with aclosing(camera.pictures(30)) as one, aclosing(camera.pictures(30)) as other:
            return [[await anext(viewer) for _ in range(3)] for viewer in (one, other)]

    with picture_server("stream") as server:
        seen = asyncio.run(look(server.url))
        assert all(picture.isdigit() for pictures in seen for picture in pictures)
        assert len(server.asked) == 1


def test_a_failing_camera_is_an_error_in_both_languages(nowhere, monkeypatch):
    monkeypatch.setattr("motorcade.server.fleet.Camera", partial(Camera, patience_s=0.2))
    url = f"http://127.0.0.1:{nowhere}/camera?token=secret"
    with served(RemoteCar("ada", "127.0.0.1", nowhere, camera=url), RemoteCar("bo", "127.0.0.1", nowhere)) as pages:
        answer = pages.client.get("/camera/snapshot.jpg?car=ada")
        assert answer.status_code == 503
        received = answer.json()["error"]["sentence"]
        assert received["en"].startswith(f"The camera at http://127.0.0.1:{nowhere}/camera gives no picture")
        assert received["zh"].startswith(f"http://127.0.0.1:{nowhere}/camera 处的摄像头没有图像")
        for car, code in (("bo", "no-camera-here"), ("cy", "car-not-listed"), (url, "car-not-listed")):
            answer = pages.client.get("/camera/snapshot.jpg", params={"car": car})
            assert answer.json()["error"]["code"] == code


@mock_clock
async def test_a_page_is_told_how_old_telemetry_is_until_its_car_is_away():
    async with loop_car() as car, FaultProxy(car.telemetry_port) as telling:
        control = await RemoteCars([RemoteCar("ada", "127.0.0.1", car.port, telling.port)]).connect("ada", "page")
        await until(lambda: "state" in control.telemetry())
        you = control.telemetry()["you"]
        assert (you["drives"], you["waits"]) == (False, False)
        telling.hold(True)
        await until(lambda: control.telemetry()["silent_ms"] > 1000)
        assert control.telemetry()["state"] == "ready"
        await until(lambda: "state" not in control.telemetry())
        control.leave()


@mock_clock
async def test_only_a_stop_that_is_lifted_waits_no_longer_for_a_car_that_is_away():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        control = await RemoteCars([RemoteCar("ada", *taken.getsockname())]).connect("ada", "page")
        stopping = asyncio.ensure_future(control.act("stop"))
        for action, is_over in (("release", False), ("clear", True)):
            await pass_time(1)
            with pytest.raises(MotorcadeError):
                await control.act(action)
            await pass_time(3)
            assert stopping.done() == is_over
        control.leave()


@mock_clock
async def test_a_page_gives_a_car_back_at_once():
    async with loop_car() as car:
        control = await RemoteCars([at("ada", car)]).connect("ada", "page")
        await until(lambda: control.steer(0.0, 0.5) or car.control.telemetry().driver)
        await control.act("release")
        assert car.control.telemetry().driver is None
        control.leave()


@mock_clock
async def test_at_most_nine_pages_connect_to_a_car_and_an_idle_one_gives_way():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        cars = RemoteCars([RemoteCar("ada", *taken.getsockname())])
        controls = [await cars.connect("ada", f"page {number}") for number in range(9)]
        with pytest.raises(MotorcadeError) as full:
            await cars.connect("ada", "one more")
        controls.pop().leave()
        controls.append(await cars.connect("ada", "one more"))
        await pass_time(IDLE_S)
        for control in controls[1:]:
            control.steer(0.5, 0.0)
        await pass_time(0.1)
        controls.append(await cars.connect("ada", "another"))
        codes = [control.telemetry().get("why") for control in controls]
        given_up = [number for number, why in enumerate(codes) if why == sentences(MotorcadeError("place-given-up"))]
        for control in controls:
            control.leave()
    assert full.value.sentence("zh") == SessionError("full", sessions=9).sentence("zh")
    assert given_up == [0]


def test_a_stop_gets_through_though_its_page_leaves_at_once(pages, ada, bo):
    with pages() as page:
        page.send("stop", cars=["ada", "bo"])
    wait_until(lambda: ada.control.telemetry().state == bo.control.telemetry().state == "stopped")


def test_a_page_without_a_place_stops_the_car(pages, ada):
    with ExitStack() as open_pages:
        others = [open_pages.enter_context(pages("ada")) for _ in range(9)]
        others[0].push("ada")
        late = open_pages.enter_context(pages())
        late.send("join", car="ada")
        assert late.until("error")["code"] == "full"
        late.send("stop", cars=["ada"])
        wait_until(lambda: ada.control.telemetry().state == "stopped")


@pytest.mark.parametrize(
    ("text", "good"), [("ada", True), ("红车-2", True), ("7", False), ("", False), ("a b", False), ("a" * 41, False)]
)
def test_a_name_is_a_word_and_not_a_number(text, good):
    assert is_name(text) == good
