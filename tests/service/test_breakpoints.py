"""A page's world stops when that happens which its user has chosen, and goes on when it is played again."""

import json

import pytest

from motorcade import Followers, Program, compile_program, forward, led, wait
from motorcade.errors import MotorcadeError
from motorcade.locales import languages
from motorcade.service.breakpoints import LOOK_MS
from motorcade.service.messages import decode
from motorcade.service.world_messages import (
    Play,
    Reset,
    Seek,
    SetWorld,
    State,
    StepWorld,
    StopCondition,
    Stopped,
    StopWhen,
    WorldMessage,
)
from support.session_page import SessionPage, server_world, site_world

# The leader drives into a wall, past a follower that hears it.
STEPS = [forward(3, speed=3), wait(1)]
IMAGE = compile_program(Program(STEPS, Followers([led(1, 1), forward(2, speed=1)], dwell_seconds=3))).image
MAT = {
    "format": "motorcade-mat/1",
    "name": "a table",
    "car": [{"at_m": [0, 0], "role": "leader"}, {"at_m": [0.3, 0.5]}, {"at_m": [0.3, -0.5]}],
    "wall": [{"from_m": [0.6, -1], "to_m": [0.6, 0.2]}, {"from_m": [5, 5], "to_m": [6, 5]}],
    "physics": {"bit_error_rate": 0.01},
}


class PlayingPage(SessionPage):
    """Plays a world as time passes."""

    def __init__(self, make_world):
        super().__init__(make_world, SetWorld(MAT, image=IMAGE))

    def stop_when(self, **condition):
        self.send(StopWhen([StopCondition(**condition)]))

    def play(self, most_s=2.5):
        """Play until the world stops; return why, if it has stopped by itself."""
        self.answers.clear()
        self.send(Play(4))
        self.look(most_s)
        stops = self.take(Stopped)
        assert len(stops) <= 1
        assert not stops or stops[0].t_ms == self.session.world.now_ms
        return stops[0] if stops else None


@pytest.fixture
def page():
    return PlayingPage(server_world)


@pytest.mark.parametrize("make_world", [server_world, site_world])
def test_a_car_that_touches_a_wall_stops_the_world_at_once_and_once_only(make_world):
    page = PlayingPage(make_world)
    page.stop_when(kind="touch", thing="wall", number=0)
    stopped = page.play()
    assert (stopped.car, stopped.others, stopped.condition) == (0, [], 0)
    assert stopped.why["en"] == "car 0 touches a wall."
    assert 0 < page.session.world.simulation.totals()["touching_ms"] <= LOOK_MS
    # It goes on, although the car touches the wall all the time.
    assert page.play(0.3) is None
    assert page.session.world.now_ms > stopped.t_ms + 500


@pytest.mark.parametrize("condition", [{"thing": "wall", "number": 1}, {"thing": "car"}, {"car": 1}])
def test_what_touches_something_else_goes_on(page, condition):
    page.stop_when(kind="touch", **condition)
    assert page.play(2.0) is None


def test_a_car_that_can_go_no_further_is_stuck(page):
    page.stop_when(kind="touch")
    touched = page.play()
    page.session.receive(Reset())
    page.stop_when(kind="stuck", car=0)
    stuck = page.play()
    assert stuck.why["en"] == "car 0 is stuck."
    assert abs(stuck.t_ms - touched.t_ms) <= LOOK_MS


def test_a_lost_message_is_told_with_its_reason(page):
    page.stop_when(kind="lost", car=2)
    stopped = page.play()
    assert (stopped.car, stopped.others) == (2, [0])
    assert stopped.why["en"] == "car 2 lost a message from car 0: bits flipped on the way."
    assert set(stopped.why) == set(languages())
    # The next one stops it again.
    assert page.play().t_ms > stopped.t_ms


@pytest.mark.parametrize("place", [{"disc": [0.5, 0, 0.2]}, {"corners_m": [[0.3, -1], [0.7, -1], [0.7, 1], [0.3, 1]]}])
def test_a_car_enters_a_zone_but_one_that_stands_there_does_not(page, place):
    page.stop_when(kind="zone", name="home", **place)
    stopped = page.play()
    assert (stopped.car, stopped.why["en"]) == (0, "car 0 enters home.")
    # Its middle is 0.3 m from where it began, and drives 0.3 m/s.
    assert stopped.t_ms == pytest.approx(1000, abs=LOOK_MS)
    assert page.play(1.0) is None


@pytest.mark.parametrize(("words", "car", "first_ms"), [([2], 0, 3000), ([1], 0, 0), ([4], 1, 3000), ([9], None, None)])
def test_a_block_that_begins_stops_the_world(page, words, car, first_ms):
    """The image's words are the header, two states of the leader, and two words of the followers."""
    page.stop_when(kind="block", words=words, car=car)
    stopped = page.play()
    assert (stopped and stopped.car) == car
    assert stopped is None or first_ms <= stopped.t_ms < first_ms + 400


def test_several_conditions_stop_it_and_none_after_they_are_taken_away(page):
    both = [StopCondition("block", car=0, words=[1]), StopCondition("touch")]
    page.session.receive(StopWhen(both))
    assert [page.play().condition for _ in both] == [0, 1]
    page.session.receive(StopWhen([]))
    page.session.receive(Reset())
    assert page.play(2.0) is None


def test_a_step_stops_too_and_the_past_can_be_looked_at(page):
    page.stop_when(kind="touch")
    answers = []
    while not any(isinstance(each, Stopped) for each in answers):
        answers += page.session.receive(StepWorld(90))
    now_ms = page.session.world.now_ms
    assert now_ms % 90
    state = page.session.receive(Seek(now_ms - 300))[0]
    assert isinstance(state, State)
    assert now_ms - 400 <= state.shown_ms <= now_ms - 300


def test_a_run_begins_again_at_any_time_with_all_that_was_before(page):
    """So a page plays a run from just before it went wrong."""
    for _ in range(20):
        page.session.receive(StepWorld(100))
    wanted = page.session.world.pictures.moment(is_stored=False)
    state = page.session.receive(Reset(0, until_ms=2000))[0]
    assert (state.t_ms, state.earliest_ms, state.playing) == (2000, 0, False)
    assert page.session.world.pictures.moment(is_stored=False)[: 3 * 4 * 3] == wanted[: 3 * 4 * 3]
    assert page.session.receive(Seek(150))[0].shown_ms == 100


@pytest.mark.parametrize(
    "wrong",
    [
        {"do": "stop-when", "conditions": [{"kind": "zone", "corners_m": [[1]]}]},
        {"do": "reset", "until_ms": -1},
        {"do": "reset", "until_ms": 600_001},
    ],
)
def test_a_zone_that_is_none_and_a_run_of_more_than_ten_minutes_are_refused(wrong):
    with pytest.raises(MotorcadeError, match="message"):
        decode(json.dumps(wrong), WorldMessage)
