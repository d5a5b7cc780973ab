"""A remote that drives the cars of a page's world: the list, drivers, and the world meanwhile."""

import io
from contextlib import aclosing, contextmanager
from types import SimpleNamespace

import pytest
from anyio import CapacityLimiter
from PIL import Image

from motorcade.drive.wire import SessionError
from motorcade.engine.state import DRIVEN
from motorcade.errors import MotorcadeError
from motorcade.server.fleet import RemoteCar
from motorcade.server.studio.driving import PageWorld, SessionFleet
from motorcade.service.world_messages import SetWorld
from support.driven_car import PATIENT, DrivenCar
from support.remote_page import PageSocket, RemotePage
from support.rooms import in_loop
from support.world_page import KEY, OTHER, server

HERE = "127.0.0.1:7700"
MAT = {
    "format": "motorcade-mat/1",
    "name": "three",
    "size_m": [4, 3],
    "tick_ms": 20,
    "car": [{"at_m": [1, 1]}, {"at_m": [1.5, 1.5], "role": "leader"}, {"at_m": [1, 2]}],
}
# The leader drives for three seconds, again and again, and tells its followers to turn right.
TWO = {**MAT, "car": MAT["car"][:2]}
IMAGE = "AQEBAGWAAAC1AAAA"


class DrivingPage(PageSocket):
    """The studio's page, which has set a world.

    Attributes:
        wheels: what each car's wheels do in the newest picture.
    """

    def __init__(self, socket):
        super().__init__(socket)
        self.wheels = [0] * len(MAT["car"])
        self.send("set", mat=MAT, image=IMAGE)
        self.until("hello", lambda hello: hello["cars"])

    def next(self):
        kind, values = super().next()
        if kind == "picture":
            self.wheels = values.moment.wheels.tolist()
        return kind, values

    def car(self, number, holds):
        """The details of a car when something holds of them."""
        self.send("watch", car=number)
        return self.until("car", lambda car: car["car"] == number and holds(car))


@contextmanager
def page(client, key=KEY):
    with client.websocket_connect(f"ws://{HERE}/api/world?session={key}") as socket:
        yield DrivingPage(socket)


@contextmanager
def remote(client, key=KEY):
    with client.websocket_connect(f"ws://{HERE}/drive/ws?session={key}") as socket:
        yield RemotePage(socket)


def push_until_seen(driver, studio, *cars):
    """Drive until a new picture shows that these cars move as steered."""
    studio.wheels = [0] * len(studio.wheels)
    while not all(studio.wheels[car] > DRIVEN for car in cars):
        driver.push(*map(str, cars))
        studio.until("picture")


def test_leaders_are_listed_first_and_all_have_cameras(client):
    with page(client), remote(client) as driver:
        listed = driver.until("hello")["cars"]
    assert [(each["car"], each["leads"], each["sees"]) for each in listed] == [
        ("1", True, True),
        ("0", False, True),
        ("2", False, True),
    ]


def test_a_driven_leader_continues_to_send_and_resumes_its_program(client):
    with page(client) as studio, remote(client) as driver:
        studio.send("play")
        driver.send("join", car="1")
        assert driver.car("1", lambda car: True)["state"] == "program"
        driver.push("1", throttle=0.5)
        frames = studio.car(1, lambda car: car["frames"] > 0)["frames"]
        assert studio.car(1, lambda car: car["frames"] > frames)["frames"]
        assert studio.car(0, lambda car: car["heard"] > 0)["heard"]
        driver.send("resume", car="1")
        driver.car("1", lambda car: car["state"] == "program")


def driven_and_left(client, studio, car="1"):
    """Drive a car, then leave."""
    studio.send("play")
    with remote(client) as driver:
        driver.send("join", car=car)
        push_until_seen(driver, studio, int(car))
    studio.until("state", lambda state: state["driven"] == [int(car)])


def test_a_car_stands_still_after_its_driver_left_until_it_is_resumed(client):
    with page(client) as studio, remote(client) as later:
        driven_and_left(client, studio)
        # Whoever sits there next finds it standing, and may tell it.
        later.send("join", car="1")
        assert later.car("1", lambda car: True)["state"] in ("failsafe", "ready")
        later.send("resume", car="1")
        later.car("1", lambda car: car["state"] == "program")
        studio.until("state", lambda state: not state["driven"])


def test_a_car_stops_by_itself_also_where_another_page_has_left_it(client):
    """Its driver's page stays, and says nothing any more."""
    with page(client) as studio, remote(client) as driver, remote(client) as onlooker:
        studio.send("play")
        for car in ("1", "0"):
            onlooker.send("join", car=car)
        driver.send("join", car="1")
        onlooker.send("leave", car="1")
        onlooker.until("telemetry", lambda told: set(told["cars"]) == {"0"})
        driver.push("1")
        driver.car("1", lambda car: car["state"] == "failsafe")


def test_the_studios_page_resumes_a_car_without_pages(client):
    with page(client) as studio, remote(client) as later:
        driven_and_left(client, studio)
        studio.send("resume", car=1)
        studio.until("state", lambda state: not state["driven"])
        with remote(client) as stopper:
            stopper.send("join", car="1")
            stopper.send("stop", cars=["1"])
            stopper.car("1", lambda car: car["state"] == "stopped")
        studio.send("resume", car=1)
        later.send("join", car="1")
        assert later.car("1", lambda car: True)["state"] == "program"
        # One that nobody ever drove needs no telling.
        studio.send("resume", car=2)
        studio.until("state", lambda state: not state["driven"])


def test_the_studios_page_cannot_resume_a_driven_car(client):
    with page(client) as studio, remote(client) as driver:
        studio.send("play")
        driver.send("join", car="1")
        driver.push("1")
        studio.send("resume", car=1)
        assert SessionError("not-yours").sentence("zh") == studio.until("error")["sentence"]["zh"]
        driver.push("1")


@pytest.mark.parametrize("change", [{"do": "reset", "seed": 3}, {"do": "set", "mat": TWO, "image": IMAGE}])
def test_a_new_run_gives_back_the_cars_without_pages(client, change):
    with page(client) as studio, remote(client) as driver, remote(client) as stopper:
        driven_and_left(client, studio)
        driver.send("join", car="0")
        push_until_seen(driver, studio, 0)
        studio.send(**change)
        studio.until("state", lambda state: state["driven"] == [0] and state["t_ms"] < 1000)
        # But the emergency stop holds until somebody lifts it.
        stopper.send("join", car="1")
        stopper.send("stop", cars=["1"])
        stopper.car("1", lambda car: car["state"] == "stopped")
        stopper.send("leave", car="1")
        studio.send(**change)
        studio.until("state", lambda state: state["driven"] == [0, 1])


def test_a_driver_continues_after_a_reset_and_in_another_world(client):
    with page(client) as studio, remote(client) as driver:
        studio.send("play")
        driver.send("join", car="1")
        push_until_seen(driver, studio, 1)
        for change in ({"do": "reset", "seed": 3}, {"do": "set", "mat": TWO, "image": IMAGE}):
            studio.send(**change)
            studio.send("play")
            # What is under way of the world before.
            studio.until("state", lambda state: state["playing"] and state["t_ms"] < 1000)
            push_until_seen(driver, studio, 1)
        driver.send("join", car="2")
        assert driver.until("error")["code"] == "car-not-listed"


def test_the_session_must_be_named_where_there_are_several(client):
    with page(client):
        with remote(client, "") as driver:
            assert driver.until("hello")["cars"]
        with page(client, OTHER), remote(client, "") as driver:
            assert driver.until("error")["code"] == "no-world"


@pytest.mark.parametrize("car", ["3", "-1", "", "²"])
def test_an_unlisted_car_is_refused(client, car):
    with page(client), remote(client) as driver:
        driver.send("join", car=car)
        assert driver.until("error")["code"] == "car-not-listed"
        assert client.get(f"/camera/snapshot.jpg?session={KEY}&car={car}").status_code == 404


def test_each_car_has_its_own_camera_in_a_playing_and_a_paused_world(client):
    with page(client) as studio:
        first, leader = (picture(client, car) for car in (0, 1))
        assert first != leader
        studio.send("move", car=0, x_m=3, y_m=2, heading_deg=180)
        studio.until("state")
        assert picture(client, 0) != first
        studio.send("play")
        assert picture(client, 1)


@in_loop
async def test_a_world_has_sixteen_cameras_at_most():
    async def cars(job):
        return 20

    fleet = SessionFleet(SimpleNamespace(work=cars))
    held = [await fleet.camera(str(car)) for car in range(16)]
    assert await fleet.camera("3") is held[3]
    with pytest.raises(MotorcadeError, match="16"):
        await fleet.camera("16")


@in_loop
async def test_the_camera_of_a_car_that_a_new_world_lacks_goes_on_when_the_car_is_back():
    world = PageWorld(KEY, "127.0.0.1", 100, CapacityLimiter(1))
    three, two = (world.make_world(SetWorld(mat)) for mat in (MAT, TWO))
    world.begin(three)
    async with aclosing((await world.fleet.camera("2")).pictures(30)) as pictures:
        assert await anext(pictures)
        world.begin(two)
        with pytest.raises(MotorcadeError, match="2"):
            await world.view(2)
        world.begin(three)
        assert await anext(pictures)


def picture(client, car):
    answer = client.get(f"/camera/snapshot.jpg?session={KEY}&car={car}")
    assert answer.status_code == 200, answer.text
    assert Image.open(io.BytesIO(answer.content)).format == "JPEG"
    return answer.content


def test_real_cars_are_listed_after_simulated_ones_and_driven_with_them(tmp_path):
    with DrivenCar(profile=PATIENT) as car:
        ada = RemoteCar("ada", "127.0.0.1", car.port, car.telemetry_port)
        with server(tmp_path, cars=(ada,)) as client:
            # Also where there is no world, or several, but never in one that isn't there.
            with remote(client, "") as driver:
                assert [each["name"] for each in driver.until("hello")["cars"]] == ["ada"]
            with remote(client) as driver:
                assert driver.until("error")["code"] == "no-world"
            with page(client) as studio, remote(client) as driver:
                assert [each["car"] for each in driver.until("hello")["cars"]] == ["1", "0", "2", "ada"]
                driver.send("join", car="1")
                driver.send("join", car="ada")
                assert driver.car("1")["paused"]
                assert not driver.car("ada")["paused"]
                driver.send("start")
                driver.car("1", lambda car: not car["paused"])
                driver.push("1", "ada")
                driver.send("stop", cars=["1", "ada"])
                for name in ("1", "ada"):
                    driver.car(name, lambda car: car["state"] == "stopped")
                assert picture(client, 1)
                assert (
                    client.get(f"/camera/snapshot.jpg?session={KEY}&car=ada").json()["error"]["code"]
                    == "no-camera-here"
                )
                studio.until("state", lambda state: state["driven"] == [1])
