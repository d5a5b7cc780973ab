"""A first visit: the page shows a recorded world until Python takes it over, bit for bit and without a jump.

The page's own code runs in Node (`support/first_world.mjs`), and Python's shell on this computer.
"""

import json
import subprocess
import sys
from base64 import b64decode, b64encode
from functools import cache
from pathlib import Path

import pytest
from scripts.opening_recording import opening_recording

from motorcade import Followers, Program, compile_program, left
from motorcade.browser.shell import Shell
from motorcade.browser.site import OPENING, zip_of
from motorcade.browser.storage import BrowserStorage
from motorcade.config.profile import built_in_profile
from motorcade.engine.events import LOST
from motorcade.engine.moment import moment_bytes, unpack_events
from motorcade.mats.document import mat_of
from motorcade.missions.check import open_worlds_here
from motorcade.program.blocks_reader import program_of
from motorcade.service.documents import example, opening
from motorcade.service.history import FIRST, HEADER_BYTES, header_of
from motorcade.service.messages import Blocks, decode
from motorcade.service.programs import compile_blocks
from motorcade.service.world_messages import SetWorld
from support.pictures import Picture
from support.session_page import server_world
from support.soak import SOAK

SCRIPT = Path(__file__).parents[1] / "support" / "first_world.mjs"
KEY = "ab" * 16
PLAY, PAUSE = {"do": "play", "speed": 1}, {"do": "pause"}
MOVE = {"do": "move", "car": 1, "x_m": 0.5, "y_m": 0.5, "heading_deg": 90}
# A call of the page's timer, as the page has it.
FRAME_MS = 50
# So long the recordings are.
SECONDS = 6
PROJECTS = {"opening": opening(), "herd": example("herd"), "ripple": example("ripple")}


def set_of(project):
    """The message by which a page sets the world of a project."""
    compiled = compile_blocks(Blocks(project.leader, project.followers, project.profile))
    program = {"image": b64encode(compiled.image).decode(), "counters": compiled.counters, "profile": project.profile}
    return {"do": "set", "seed": 0, "mat": project.mat, "range_mm": project.range_mm, "mission": None, **program}


class Visit:
    """A first visit to a project.

    Attributes:
        told: the last answer of each kind that the page got.
        pictures: all that the page got, as bytes.
        worlds: those that Python has built.
    """

    def __init__(self, node, archive):
        self._node = node
        self._now_s = 0.0
        self.worlds = []
        self._shell = Shell(BrowserStorage(), lambda: self._now_s, self._open_worlds)
        self._is_open = False
        self.told, self.pictures = {}, []
        self._do(begin=str(archive))

    def _open_worlds(self, *asked):
        self.worlds.append(open_worlds_here(*asked))
        return self.worlds[-1]

    def say(self, *messages):
        for message in messages:
            self._do(send=json.dumps(message))

    def pass_time(self, duration_ms):
        for _ in range(duration_ms // FRAME_MS):
            self._now_s += FRAME_MS / 1000
            self._do(advance_ms=FRAME_MS)

    def start_python(self):
        self._is_open = True
        self._answer(self._shell.open(1, "world", KEY), open=True)

    def lose_python(self):
        """Python has not started, and begins again."""
        self._do(lose=True)

    def _do(self, **order):
        self._node.stdin.write(json.dumps(order) + "\n")
        got = json.loads(self._node.stdout.readline())
        for each in got["page"]:
            if isinstance(each, str):
                answer = json.loads(each)
                self.told[answer["is"]] = answer
            else:
                self.pictures.append(b64decode(each[0]))
                self._do(send=json.dumps({"do": "shown", "frame": header_of(self.pictures[-1]).number}))
        for each in got["python"]:
            self._answer(self._shell.receive(1, each))
        if self._is_open and 0 <= self._shell.wait_s(1) <= 0:
            self._answer(self._shell.advance(1))

    def _answer(self, sent, **order):
        texts = [each for each in sent if isinstance(each, str)]
        pictures = [b64encode(each).decode() for each in sent if isinstance(each, bytes)]
        if sent or order:
            self._do(texts=texts, pictures=pictures, **order)


@pytest.fixture(scope="module")
def node():
    """The page's code, by which one visit after another goes: it takes seconds to load."""
    command = [str(Path(sys.executable).with_name("node")), str(SCRIPT)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, encoding="utf-8", bufsize=1) as process:
        yield process
        process.stdin.close()


@pytest.fixture(scope="module")
def archive_of(tmp_path_factory):
    """Stores the recording of a project, and says where it is."""

    @cache
    def stored(name):
        archive = tmp_path_factory.mktemp(name) / "opening.zip"
        archive.write_bytes(zip_of({"opening.json": opening_recording(PROJECTS[name], SECONDS).encode()}))
        return archive

    return stored


@pytest.fixture
def visit(node, archive_of, request):
    name = getattr(request, "param", "opening")
    made = Visit(node, archive_of(name))
    made.message = set_of(PROJECTS[name])
    return made


def assert_continues(visit):
    """All pictures and their events are those of a world that Python has run from the beginning."""
    world, events = server_world(decode(json.dumps(visit.message), SetWorld)), []
    for data in visit.pictures:
        header = header_of(data)
        assert header.t_ms >= world.now_ms
        events += unpack_events(world.run(header.t_ms - world.now_ms))
        at = HEADER_BYTES + moment_bytes(header.cars)
        assert data[HEADER_BYTES:at] == world.pictures.moment(is_stored=False), header.t_ms
        assert header.lost == sum(each.kind == LOST and each.t_ms >= header.t_ms - 5000 for each in events)
    shown = [each for data in visit.pictures for each in Picture(data).events]
    assert shown == events
    assert sum(header_of(data).flags & FIRST > 0 for data in visit.pictures) == 1


@pytest.mark.parametrize("visit", PROJECTS, indirect=True)
def test_python_takes_the_world_over_at_a_tick(visit):
    """Cars drive before Python is ready, and go on as if Python had driven them from the beginning."""
    visit.say(visit.message)
    assert visit.told["state"]["playing"] is False
    visit.say(PLAY)
    visit.pass_time(3000)
    assert header_of(visit.pictures[-1]).t_ms > 2500
    assert visit.worlds == []
    before = len(visit.pictures)
    visit.start_python()
    visit.pass_time(3000)
    assert header_of(visit.pictures[-1]).t_ms > 5500
    assert visit.told["state"]["playing"] is True
    assert_continues(visit)
    # All before it came from the page's own world.
    [world] = visit.worlds
    assert world.now_ms >= header_of(visit.pictures[-1]).t_ms
    assert len(visit.pictures) > before + 10


def test_pause_speed_and_a_new_beginning_need_no_python(visit):
    visit.say(visit.message, {"do": "play", "speed": 4})
    visit.pass_time(1000)
    visit.say(PAUSE)
    paused_ms = visit.told["state"]["t_ms"]
    assert paused_ms > 3000
    visit.pass_time(500)
    assert visit.told["state"]["t_ms"] == paused_ms
    visit.say({"do": "reset", "seed": 0})
    assert (visit.told["state"]["t_ms"], visit.told["state"]["playing"]) == (0, False)
    visit.pictures.clear()
    visit.say(PLAY)
    visit.pass_time(500)
    visit.say(PAUSE)
    paused_ms = visit.told["state"]["t_ms"]
    visit.start_python()
    visit.pass_time(500)
    # A paused world is taken over, too, and stays paused.
    assert [world.now_ms for world in visit.worlds] == [paused_ms]
    visit.say(PLAY)
    visit.pass_time(500)
    assert visit.worlds[0].now_ms > paused_ms


def test_a_world_whose_recording_has_ended_waits_for_python(visit):
    visit.say(visit.message, PLAY)
    visit.pass_time((SECONDS + 2) * 1000)
    assert header_of(visit.pictures[-1]).t_ms == SECONDS * 1000
    visit.start_python()
    visit.pass_time(1000)
    assert header_of(visit.pictures[-1]).t_ms > (SECONDS + 0.5) * 1000
    assert_continues(visit)


def test_the_shipped_recording_is_that_of_the_opening():
    assert OPENING.read_text(encoding="utf-8") == opening_recording()


def test_what_only_python_can_do_happens_at_the_tick_at_which_it_was_asked_for(visit):
    visit.say(visit.message, PLAY)
    visit.pass_time(1000)
    visit.say({"do": "watch", "car": 1}, MOVE)
    visit.pass_time(1000)
    moved_ms = header_of(visit.pictures[-1]).t_ms
    assert moved_ms < 1100
    visit.start_python()
    visit.pass_time(1000)
    world = server_world(decode(json.dumps(visit.message), SetWorld))
    world.run(moved_ms)
    world.move(*(MOVE[name] for name in ("car", "x_m", "y_m", "heading_deg")))
    last = header_of(visit.pictures[-1])
    assert last.t_ms > moved_ms + 500
    world.run(last.t_ms - moved_ms)
    at = HEADER_BYTES + moment_bytes(last.cars)
    assert visit.pictures[-1][HEADER_BYTES : at - last.cars] == world.pictures.moment(is_stored=False)[: -last.cars]
    assert visit.told["car"]["car"] == 1


@pytest.mark.parametrize("is_ready", [False, True])
def test_another_world_than_the_openings_is_pythons(visit, is_ready):
    """The user has opened another project, or changed the blocks, before Python was ready or just then."""
    visit.say(visit.message, PLAY)
    visit.pass_time(500)
    other = visit.message | {"mat": {**visit.message["mat"], "car": visit.message["mat"]["car"][:3]}}
    if is_ready:
        visit.start_python()
    visit.say(other, PLAY)
    if not is_ready:
        visit.pass_time(500)
        visit.start_python()
    visit.pass_time(1000)
    assert visit.told["hello"]["cars"] == 3
    assert visit.told["state"]["playing"] is True
    assert visit.worlds[-1].now_ms > 500
    assert header_of(visit.pictures[-1]).cars == 3


def test_python_that_begins_again_takes_the_world_over_then(visit):
    visit.say(visit.message, PLAY)
    visit.pass_time(500)
    visit.lose_python()
    visit.pass_time(500)
    visit.start_python()
    visit.pass_time(500)
    assert_continues(visit)
    assert len(visit.worlds) == 1


# What the tour asks for: twelve followers that turn where they stand, and pass the word on.
TURNS = Program([], Followers([left(1, 2)], forward=True))
TABLE = {
    "format": "motorcade-mat/1",
    "name": "Table",
    "size_m": [4, 3],
    "edge": "wall",
    "car": [{"at_m": [2.3, 1.5], "role": "leader"}],
    "crowd": [{"cars": 12, "corner_m": [0.8, 1.05], "size_m": [1.2, 0.9], "spacing_m": 0.3}],
}


@pytest.mark.parametrize("shown", ["town", "tour"])
def test_no_car_of_a_first_visit_touches_anything_for_a_minute(shown):
    program, mat, range_mm = TURNS, TABLE, None
    if shown == "town":
        town = opening()
        program = program_of(town.leader, town.followers, town.profile)
        mat, range_mm = town.mat, town.range_mm
    profile = built_in_profile("classroom")
    image = compile_program(program, profile).image
    world = open_worlds_here(mat_of(mat, "mat"), [image], profile, range(100 if SOAK else 20), False)
    world.set_environment(world.mat, range_mm)
    world.run(60_000)
    assert [seed for seed in world.seeds if world.totals(seed)["touching_ms"]] == []
