"""The live wall, looking on at a pupil's world, and the shared mat."""

import base64
import json
import math
import struct
from itertools import combinations

import pytest

from motorcade import Followers, Program, compile_program, forward, led, wait
from motorcade.classroom.messages import ClassWall, DrawnWall
from motorcade.classroom.shared_mat import parade
from motorcade.classroom.wall import ShownWorld, WallPictures
from motorcade.engine.moment import moment_bytes, unpack_moment
from motorcade.missions.document import built_in_mission
from motorcade.service.missions import mission_goals
from support.class_page import HERE, PASSWORD, class_room
from support.pictures import pack_moment
from support.world_page import KEY, MAT, OTHER


@pytest.fixture
def room(tmp_path, now):
    def clock():
        now[0] += 0.001
        return now[0]

    with class_room(tmp_path, clock=clock) as opened:
        yield opened


def image(*steps):
    return base64.b64encode(compile_program(Program(list(steps), Followers([led(1, 1)]))).image).decode()


def on_the_wall(data, worlds):
    """What a picture of the wall holds: by place the time and the columns."""
    number = struct.unpack_from("<I", data)[0]
    at, found = 4, {}
    while at < len(data):
        place, cars, t_ms = struct.unpack_from("<HHI", data, at)
        assert cars <= worlds[place]["cars"]
        found[place] = (t_ms, list(unpack_moment(data[at + 8 :], cars).values()))
        at += 8 + moment_bytes(cars)
    assert at == len(data)
    return number, found


def wall_message(page):
    """The next message of the wall: a list, or bytes."""
    message = page._socket.receive()
    if message.get("bytes"):
        page._socket.send_text("{}")
        return message["bytes"]
    return json.loads(message["text"])


def test_the_wall_shows_all_worlds_and_what_changes_in_them(room, now):
    mia, ben = room.join("Mia"), room.join("Ben")
    with (
        room.teacher.open("teacher/wall") as wall,
        mia.open(f"world?session={KEY}") as hers,
        ben.open(f"world?session={OTHER}") as his,
    ):
        assert wall_message(wall)["worlds"] == []
        hers.set()
        hers.until("picture")
        his.set(mat=MAT | {"car": MAT["car"][:2], "name": "small"})
        his.until("picture")
        now[0] += 5
        while len((listed := wall_message(wall))["worlds"]) < 2:
            now[0] += 5
        shown = [(each["pupil"], each["cars"], each["mat"]["name"]) for each in listed["worlds"]]
        assert shown == [(mia.id, 3, "a table"), (ben.id, 2, "small")]
        number, found = on_the_wall(wall_message(wall), listed["worlds"])
        assert number == listed["number"]
        assert [found[place][1][0].tolist() for place in (0, 1)] == [[0, 0.5, 0.5], [0, 0.5]]
        his.send("move", car=1, x_m=-1.5, y_m=0)
        his.until("picture", lambda picture: picture.moment.x_m[1] == -1.5)
        number, found = on_the_wall(wall_message(wall), listed["worlds"])
        assert (list(found), found[1][1][0].tolist()) == ([1], [0, -1.5])


class StillWorld:
    """A world of one car, as the wall meets it; it is in play, and its newest moment is set by the test."""

    cars, radius_m, playing, referee, sent = 1, 0.075, True, None, {}

    def __init__(self):
        self.world = self
        self.moment = self.at(0)

    def at(self, x_m):
        self.moment = pack_moment([x_m], *([[0]] * 6))
        return self.moment

    def newest(self):
        return 0, self.moment

    def leads(self):
        return [0]


def test_a_slow_projector_gets_no_film():
    still = StillWorld()
    wall = WallPictures(lambda: [ShownWorld("01", still, still, MAT)])
    sent = []
    for step in range(6):
        still.at(step)
        sent += wall.answers(step / 5)
    assert [type(answer) for answer in sent] == [ClassWall, bytes, bytes]
    wall.under_way -= 1
    (newest,) = wall.answers(2.0)
    assert on_the_wall(newest, [{"cars": 1}])[1][0][1][0].tolist() == [5], "what it missed is not sent later"
    wall.under_way = 0
    assert wall.answers(2.2) == [], "nothing has changed"


def test_only_worlds_that_are_seen_are_sent():
    worlds = [StillWorld() for _ in range(3)]
    shown = [ShownWorld(f"0{k}", world, world, MAT) for k, world in enumerate(worlds)]
    wall = WallPictures(lambda: shown)

    def places(now_s):
        wall.under_way = 0
        return [[*on_the_wall(each, [{"cars": 1}] * 3)[1]] for each in wall.answers(now_s) if isinstance(each, bytes)]

    assert places(0.0) == [[0, 1, 2]]
    for world in worlds:
        world.at(1)
    wall.receive(DrawnWall(number=1, seen=[1, 9]))
    assert (places(0.1), places(0.2)) == ([[1]], [])
    wall.receive(DrawnWall(drawn=False, number=9, seen=[]))
    wall.receive(DrawnWall(drawn=False, number=1, seen=[0, 1]))
    assert places(0.3) == [[0]], "what scrolls into view is sent as it is now"
    shown.pop()
    assert places(1.5) == [[0, 1]], "in a new list all count as seen until the page says otherwise"


def test_the_list_is_sent_at_most_once_a_second():
    still = StillWorld()
    mats = [MAT | {"name": str(number)} for number in range(10)]
    now = iter(mats)
    wall = WallPictures(lambda: [ShownWorld("01", still, still, next(now))])
    sent = []
    for step in range(10):
        still.at(step)
        wall.under_way = 0
        sent += map(type, wall.answers(step / 5))
    assert sent.count(ClassWall) == 2
    assert sent.count(bytes) == 2, "no picture refers to a list that the page doesn't have"


def test_the_wall_goes_on_when_its_page_has_drawn_what_came(room, now):
    mia = room.join("Mia")
    address = f"ws{HERE.removeprefix('http')}/api/teacher/wall"
    with mia.open(f"world?session={KEY}") as hers, room.teacher.client.websocket_connect(address) as wall:
        hers.set()
        for step in range(4):
            hers.until("picture", lambda picture, t_ms=100 * step: picture.t_ms == t_ms)
            hers.send("shown", frame=step + 1)
            while not wall.receive().get("bytes"):
                pass
            wall.send_json({"drawn": True})
            hers.send("step", ticks=20)


def test_the_teacher_looks_on_at_one_pupils_world(room, now):
    mia = room.join("Mia")
    with mia.open(f"world?session={KEY}") as hers, room.teacher.open(f"teacher/watch?pupil={mia.id}") as watching:
        assert watching.until("wall")["worlds"] == []
        hers.set()
        hers.until("picture")
        assert watching.until("wall")["worlds"][0]["pupil"] == mia.id
        assert watching.until("hello")["cars"] == 3
        assert watching.until("picture").number == 1
        watching.send("play")
        assert watching.until("error")["code"] == "bad-message"
        watching.send("shown", frame=1)
        hers.send("step", ticks=20)
        hers.until("picture", lambda picture: picture.t_ms == 100)
        kinds = []
        while "picture" not in kinds:
            kind, told = watching.next()
            kinds.append(kind)
        assert (told.t_ms, told.number) == (100, 2)
        assert "wall" not in kinds, "a page forgets what a world showed with each list"
        room.teacher.ask("teacher/remove", pupil=mia.id)
        assert watching.until("wall")["worlds"] == []
    with room.teacher.open("teacher/watch?pupil=99") as watching:
        assert watching.until("error")["code"] == "no-such-pupil"


def test_programs_meet_on_the_shared_mat_and_goals_judge_them(room, now):
    pupils = [room.join(name) for name in ("Mia", "Ben", "Lin")]
    mia, ben, lin = pupils
    assert mia.ask("class/mat", image=image(forward(1))) == "mat-is-closed"
    assert room.teacher.ask("teacher/mat/start") == "mat-is-empty"
    assert room.teacher.ask("teacher/mat/open", followers=1, places=2) == {}
    assert room.teacher.ask("teacher/mat/start") == "mat-is-empty"
    assert mia.ask("class/mat", image=image(forward(60, speed=3))) == {}
    assert lin.ask("class/mat", image=image(wait(1))) == {}
    assert ben.ask("class/mat", image=image(wait(1))) == "mat-is-full"
    assert lin.ask("class/mat", image=None) == {}
    assert ben.ask("class/mat", image=image(wait(60))) == {}
    with ben.open("class/stream") as page:
        assert page.until("pupil")["mat"]["entries"] == [mia.id, ben.id]
    with room.teacher.open("teacher/mat") as shown:
        assert shown.until("wall")["worlds"] == []
        assert room.teacher.ask("teacher/mat/start") == {}
        (world,) = shown.until("wall")["worlds"]
        assert (world["cars"], world["leads"], world["mat"]["size_m"]) == (4, [0, 2], [6.25, 2.5])
        hello = shown.until("hello", lambda hello: hello["cars"])
        assert (hello["cars"], hello["leads"]) == (4, [0, 2])
        # Nothing is earned before a car drives.
        assert [goal["progress"] for goal in shown.until("goals")["goals"]] == ["open", "open", "open"]
        now[0] += 1
        driven = shown.until("picture", lambda picture: picture.t_ms >= 100)
        while driven.moment.x_m[0] == driven.moment.x_m[2] - 2.5:
            now[0] += 0.2
            driven = shown.until("picture")
        assert driven.moment.x_m[0] > 1.875
        assert driven.moment.x_m[2] == 1.875 + 2.5, "Ben's car has a program of its own"
        shown.send("step")
        assert shown.until("error")["code"] == "not-in-this-world"
        shown.send("pause")
        assert not shown.until("state", lambda state: not state["playing"])["playing"]
    with room.teacher.open("teacher/mat") as again:
        assert again.until("wall")["worlds"] == [world], "a page that is loaded again has the mat too"
    assert mia.ask("class/mat", image=None) == "mat-is-closed"
    assert room.teacher.ask("teacher/mat/close") == {}
    with room.teacher.open("teacher/stream") as shown:
        assert shown.until("class")["mat"]["state"] == "closed"


@pytest.mark.parametrize("followers", range(11))
def test_all_cars_of_a_parade_begin_on_its_mat_and_apart(followers):
    document = parade(7, followers)
    mat = document["mat"]
    places = [tuple(car["at_m"]) for car in mat["car"]]
    assert all(0 < x_m < mat["size_m"][0] and 0 < y_m < mat["size_m"][1] for x_m, y_m in places)
    assert [car.get("role") for car in mat["car"]] == ["leader", *[None] * followers] * 7
    assert document["seconds"] == 60
    nearest_m = 0.3 if followers else 2.5
    assert min(math.dist(*pair) for pair in combinations(places, 2)) == pytest.approx(nearest_m)
    # Two rows of six places: no larger than the rows of followers want.
    assert mat["size_m"] == pytest.approx([6.5 * max(2.5, 0.3 * (followers + 1)), 5.0])


def test_a_parade_goes_on_without_a_page_of_its_own_and_names_stay_at_their_cars(room, now):
    ids = [f"0{number}" for number in range(1, 7)]
    assert room.teacher.ask("teacher/mat/open", followers=10, places=6) == {}
    for name in ids:
        assert room.join(name).ask("class/mat", image=image(forward(60, speed=3))) == {}
    with room.teacher.open("teacher/wall") as wall:
        assert wall_message(wall)["worlds"] == []
        assert room.teacher.ask("teacher/mat/start") == {}
        now[0] += 5
        listed = wall_message(wall)["worlds"]
        assert [(each["pupil"], each["cars"], len(each["leads"])) for each in listed] == [("", 66, 6)]
        t_ms = 0
        while not t_ms:
            now[0] += 0.2
            t_ms, columns = on_the_wall(wall_message(wall), listed)[1][0]
        assert len(columns[0]) == 66
    assert room.teacher.ask("teacher/remove", pupil="01") == {}
    for entries in (ids, ids[1:]):
        with room.teacher.open("teacher/stream") as shown:
            assert shown.until("class")["mat"]["entries"] == entries
        assert room.teacher.ask("teacher/mat/start") == {}


def test_a_mission_on_the_shared_mat_has_as_many_places_as_leaders(room):
    mia, ben = room.join("Mia"), room.join("Ben")
    assert room.teacher.ask("teacher/mat/open", mission={"id": "no-such"}) == "no-mission"
    assert room.teacher.ask("teacher/mat/open", mission={"id": "follow-me"}) == {}
    assert mia.ask("class/mat", image=image(forward(1))) == {}
    assert ben.ask("class/mat", image=image(forward(1))) == "mat-is-full"
    assert room.teacher.ask("teacher/mat/start") == {}
    with room.teacher.open("teacher/stream") as shown:
        view = shown.until("class")["mat"]
    assert (view["state"], view["mission"], view["places"]) == ("running", "follow-me", 1)
    with room.teacher.open("teacher/mat") as shown:
        (world,) = shown.until("wall", lambda wall: wall["worlds"])["worlds"]
    assert [zone["title"]["en"] for zone in world["zones"]] == ["the field"]
    # The goals' own sentences stand below the mat.
    assert [goal["text"]["zh"] for goal in world["goals"]] == [
        goal.text["zh"] for goal in mission_goals(built_in_mission("follow-me"))
    ]
    assert room.teacher.ask("teacher/end", password=PASSWORD) == {}
