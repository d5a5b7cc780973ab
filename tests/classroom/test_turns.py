"""Real cars in the room: one pupil drives each, and the teacher stops all."""

import asyncio
from collections import Counter
from contextlib import ExitStack, contextmanager, suppress
from functools import partial

from starlette.testclient import TestClient

from motorcade.classroom.running import EmergencyStop
from motorcade.errors import DriveError, MotorcadeError
from motorcade.server.fleet import CombinedFleet, Fleet, RemoteCar
from motorcade.server.remote import make_remote
from motorcade.server.remote_messages import ListedCar
from motorcade.server.request_filter import ServerSettings
from support.class_page import class_room
from support.classrooms import with_pupils
from support.mock_clock import mock_clock, pass_time
from support.remote_page import RemotePage
from support.waiting import wait_until


class Control:
    """A page's connection to a car that notes what it is asked for."""

    def __init__(self, name, asked):
        self.name, self.asked = name, asked

    def steer(self, throttle, steering):
        self.asked.append((self.name, throttle))

    async def act(self, action):
        if self.name == "away":
            raise MotorcadeError("car-out-of-reach")
        self.asked.append((self.name, action))

    def telemetry(self):
        return {}

    def leave(self):
        self.asked.append((self.name, "leave"))


class Cars(Fleet):
    def __init__(self, *names):
        self.names, self.asked, self.stops = names, [], Counter()

    async def listed(self):
        return [ListedCar(name, None, False) for name in self.names]

    async def connect(self, car, page):
        return Control(car, self.asked)


@contextmanager
def pages(room, cars, *pupils):
    """A page of the remote for each of these pupils, connected to the red car."""
    found = []
    with ExitStack() as opened:
        for pupil in pupils:
            fleet = CombinedFleet(None, cars, partial(room.may_drive, pupil))
            client = opened.enter_context(TestClient(make_remote(ServerSettings(), fleet), base_url="http://127.0.0.1"))
            page = RemotePage(opened.enter_context(client.websocket_connect("ws://127.0.0.1/drive/ws")))
            page.send("join", car="red")
            found.append(page)
        yield found


def turned_away(page):
    page.send("drive", cars=["red"], throttle=1.0, steering=0.0)
    assert page.until("error")["code"] == "not-your-turn"


def test_a_pupil_drives_in_turn_and_gives_the_car_back():
    room, cars = with_pupils("Mia", "Ben", cars=["red"]), Cars("red")
    with pages(room, cars, "01", "02") as (hers, his):
        turned_away(hers)
        room.take("01", "red", True)
        hers.drive("red")
        turned_away(his)
        his.send("request", car="red")
        assert his.until("error")["code"] == "not-your-turn"
        his.send("stop", cars=["red"])
        wait_until(lambda: ("red", "stop") in cars.asked)
        assert cars.asked == [("red", 1), ("red", "stop")], "everybody may stop"
        cars.asked.clear()
        room.pass_on("red", "02")
        wait_until(lambda: cars.asked == [("red", 0.0), ("red", "release")])
        his.drive("red", throttle=0.5)
        assert cars.asked[-1] == ("red", 0.5)
        turned_away(hers)


def test_a_page_that_leaves_leaves_each_of_its_cars_although_one_fails(monkeypatch):
    room, cars, leave = with_pupils("Mia", cars=["red", "blue"]), Cars("red", "blue"), Control.leave

    def fails(control):
        leave(control)
        raise OSError("no network")

    monkeypatch.setattr(Control, "leave", fails)
    with suppress(OSError), pages(room, cars, "01") as (hers,):
        hers.send("join", car="blue")
        hers.until("telemetry", lambda told: len(told["cars"]) == 2)
    assert {car for car, did in cars.asked if did == "leave"} == {"red", "blue"}


@mock_clock
async def test_all_cars_are_stopped_although_one_is_away_which_is_stopped_as_soon_as_it_is_back():
    cars = Cars("red", "away", "blue")
    emergency = EmergencyStop(cars)
    assert await emergency.stop() == ["away"]
    assert [each for each in cars.asked if each[1] == "stop"] == [("red", "stop"), ("blue", "stop")]
    assert await emergency.release() == ["away"]
    assert [each for each in cars.asked if each[1] == "clear"] == [("red", "clear"), ("blue", "clear")]
    assert await EmergencyStop(Cars()).stop() == []
    back = asyncio.Event()

    async def stop(car, page):
        await back.wait()
        cars.asked.append((car, "stop"))

    cars = Cars("red")
    cars.stop = stop
    emergency = EmergencyStop(cars)
    assert await emergency.stop() == ["red"]
    back.set()
    await pass_time(0.1)
    assert cars.asked == [("red", "stop")]
    back.clear()
    assert await emergency.stop() == ["red"]
    await emergency.release()
    back.set()
    await pass_time(0.1)
    assert cars.asked.count(("red", "stop")) == 1, "a stop that was lifted comes no more"


@mock_clock
async def test_a_stop_is_lifted_once_the_new_connection_to_the_car_is_there(monkeypatch):
    cars, act, tries = Cars("red"), Control.act, []

    async def connecting(control, action):
        tries.append(action)
        if len(tries) < 3:
            raise DriveError("away", detail="")
        await act(control, action)

    monkeypatch.setattr(Control, "act", connecting)
    assert await EmergencyStop(cars).release() == []
    assert cars.asked == [("red", "clear"), ("red", "leave")]


@mock_clock
async def test_a_release_that_waits_for_a_car_lifts_no_later_stop_of_it(monkeypatch):
    cars, tries = Cars("red"), []

    async def away(control, action):
        tries.append(action)
        raise DriveError("away", detail="")

    monkeypatch.setattr(Control, "act", away)
    emergency = EmergencyStop(cars)
    releasing = asyncio.ensure_future(emergency.release())
    await pass_time(0.5)
    cars.stops["red"] += 1
    tries.clear()
    await pass_time(1.0)
    assert len(tries) <= 1
    await releasing


def test_the_emergency_stop_holds_all_cars(tmp_path):
    with class_room(tmp_path, cars=(RemoteCar("red", "127.0.0.1", 9),)) as room:
        mia = room.join("Mia")
        assert mia.ask("class/take", name="red", wants=True) == {}
        with mia.open("class/stream") as page:
            view = page.until("pupil")
            assert (view["shared"][1], view["stopped"]) == ({"name": "red", "holder": mia.id}, False)
            assert room.teacher.ask("teacher/stop-all") == ["red"]
            assert page.until("pupil", lambda view: view["stopped"])
            room.teacher.ask("teacher/release-all")
            assert not page.until("pupil", lambda view: not view["stopped"])["stopped"]
            room.teacher.ask("teacher/pass-on", name="red", pupil=None)
            assert page.until("pupil", lambda view: view["shared"][1]["holder"] is None)
