"""A page's session with its world, with the test's clock and without a server."""

from dataclasses import replace

import pytest

from motorcade import Followers, Mat, Pose, Program, World, compile_program, forward, led, left
from motorcade.errors import MotorcadeError
from motorcade.mats import Starts
from motorcade.service.studio_world import StudioWorld
from motorcade.service.world_messages import (
    CarDetails,
    Move,
    Pause,
    Play,
    Refused,
    SetWorld,
    Shown,
    State,
    StepWorld,
    Watch,
    WorldHello,
)
from motorcade.service.world_session import CAR_S, HIDDEN_AFTER_S, HIDDEN_STEP_S, PICTURE_S, STATE_S
from motorcade.words.infrared import check_of, tagged_frame
from support.pictures import Picture
from support.session_page import SessionPage, server_world
from support.strategies import CLASSROOM

IMAGE = compile_program(Program([forward(3, speed=2), left(1)], Followers([led(1, 1)]))).image
MAT = {
    "format": "motorcade-mat/1",
    "name": "a table",
    "tick_ms": 5,
    "car": [{"at_m": [0, 0], "role": "leader"}, {"at_m": [0.5, 0]}],
}


@pytest.fixture
def page() -> SessionPage:
    return SessionPage(server_world, SetWorld(MAT, IMAGE))


def test_before_the_first_world_there_are_no_cars() -> None:
    page = SessionPage(server_world)
    assert page.answers == [WorldHello("0" * 32, False, 0)]
    assert page.session.wait_s(0.0) is None
    with pytest.raises(MotorcadeError, match="no world"):
        page.send(Play())


def test_a_paused_world_is_shown_once(page: SessionPage) -> None:
    page.look(1)
    assert len(page.take(Picture)) == 1
    assert page.session.wait_s(page.now_s) is None


def test_a_world_in_play_sends_30_pictures_and_4_states_a_second(page: SessionPage) -> None:
    page.send(Play())
    page.look(1)
    page.take(Picture)
    page.look(10)
    answers = list(page.answers)
    assert len([each for each in answers if isinstance(each, Picture)]) == pytest.approx(10 / PICTURE_S, abs=2)
    assert len([each for each in answers if isinstance(each, State)]) == pytest.approx(10 / STATE_S, rel=0.2)
    assert page.take(State)[-1].t_ms == pytest.approx(11_000, abs=300)
    page.send(Pause())
    page.look(1)
    page.take(Picture)
    page.look(10)
    assert page.answers == []


def test_a_world_whose_car_comes_to_the_end_of_the_plane_stops_and_says_why(page: SessionPage) -> None:
    """Places end 2,147 m from 0; a car that a page moves may stand 2,000 m from it."""
    fast = replace(CLASSROOM, speeds_mm_s=(0, 1, 2, 90_000), body=replace(CLASSROOM.body, diameter_mm=1900))
    image = compile_program(Program([forward(3, speed=3)])).image
    mat = Mat("a plane", Starts.of([Pose(1990, 0)], [True]), 5)
    page.session.begin(StudioWorld(World(mat, [image], fast, events=True)))
    page.send(Play())
    page.look(5)
    told = page.take(Refused)
    assert [each.code for each in told] == ["car-left-plane"]
    assert not page.session.playing
    with pytest.raises(MotorcadeError, match="2,147 m"):
        page.send(StepWorld())


def test_a_tagged_frame_is_sent_as_word_tag_and_check(page: SessionPage) -> None:
    # One slot of two seconds: a word that lights an LED and is passed on.
    page.send(SetWorld(MAT, bytes.fromhex("01010201 65800000 c0280000")))
    page.send(Watch(1))
    page.send(Play())
    page.look(1)
    details = page.take(CarDetails)[-1]
    last = details.last_frame
    assert (details.word, last.word, last.tag, last.car) == ("c0280000", "c0280000", 1, 0)
    assert last.check == check_of(tagged_frame(0xC0280000, 1))
    assert details.lost["check"] == 0


def test_the_details_of_a_watched_car_come_ten_times_a_second(page: SessionPage) -> None:
    page.send(Watch(1))
    page.send(Play())
    page.take(CarDetails)
    page.look(10)
    assert len(page.take(CarDetails)) == pytest.approx(10 / CAR_S, rel=0.35)


def test_a_page_that_draws_nothing_gets_two_pictures_and_then_the_newest(page: SessionPage) -> None:
    page.is_slow = True
    page.send(Play())
    page.look(1)
    assert [picture.number for picture in page.take(Picture)] == [1, 2]
    page.send(Shown(2))
    page.look(PICTURE_S * 2)
    (newest,) = [picture for picture in page.take(Picture) if picture.number == 3]
    assert newest.t_ms > 900


def test_the_world_of_a_page_in_the_background_goes_on_in_few_steps(page: SessionPage) -> None:
    page.send(Play())
    page.look(1)
    page.is_slow = True
    page.look(HIDDEN_AFTER_S + 1)
    page.steps = 0
    page.look(10)
    assert page.steps == pytest.approx(10 / HIDDEN_STEP_S, abs=1)
    assert page.take(State)[-1].t_ms == pytest.approx(14_000, abs=500), "in real time"
    page.is_slow = False
    page.send(Shown(1000))
    page.look(1 + HIDDEN_STEP_S)
    assert len(page.take(Picture)) >= 1 / PICTURE_S, "the page is seen again"


def test_a_picture_that_was_never_sent_can_not_be_drawn(page: SessionPage) -> None:
    page.is_slow = True
    page.send(Shown(1000))
    page.send(Play())
    page.look(1)
    assert len(page.take(Picture)) == 2


def test_a_page_that_connects_again_finds_its_world(page: SessionPage) -> None:
    page.send(StepWorld(100))
    page.look(1)
    page.take(Picture)
    page.answers += page.session.connect()
    hello, state = page.answers
    assert (hello.resumed, hello.cars, state.t_ms) == (True, 2, 500)
    page.look(1)
    (picture,) = page.take(Picture)
    assert (picture.number, picture.t_ms) == (1, 500)


@pytest.mark.parametrize("message", [Watch(2), Move(2, 0.0, 0.0)])
def test_a_message_about_a_car_that_does_not_exist_is_refused(page: SessionPage, message) -> None:
    with pytest.raises(MotorcadeError) as refusal:
        page.send(message)
    assert refusal.value.code == "bad-world"
    assert "0 to 1" in str(refusal.value)
    page.send(StepWorld(1))
    assert page.take(State)[-1].t_ms == 5
