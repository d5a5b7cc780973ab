"""A world in play: its time, its past, and its pictures."""

from dataclasses import replace

import numpy as np
import pytest

from motorcade import Followers, Mat, Pose, Program, compile_program, forward, led, left, open_table, right, wait
from motorcade.engine.moment import EVENT_BYTES, HEARD, LOST, NO_INDEX, RUNS
from motorcade.mats import Starts
from motorcade.service.history import FIRST, MOST_EVENTS, PAST, PAST_BYTES
from motorcade.service.studio_world import StudioWorld
from motorcade.service.world_messages import Move, Reset, SetEnvironment, StepWorld, Watch
from motorcade.service.world_session import PICTURE_S, WorldSession
from support.pictures import Picture
from support.worlds import CrowdedWorld

STATES = 2
IMAGE = compile_program(
    Program([forward(3, speed=2), left(1)], Followers([led(1, 1), led(2, 1), led(1, 1), led(3, 1)]))
).image
EMPTY_MAT = {"format": "motorcade-mat/1", "name": "empty"}
NEAR = [Pose(0, 0), Pose(0.5, 0)]


def playback(poses=NEAR, image=IMAGE, past_bytes=PAST_BYTES, **more) -> WorldSession:
    world = CrowdedWorld(replace(open_table(poses, tick_ms=5), **more), [image], events=True, threads=1)
    session = WorldSession("", lambda message: None, past_bytes)
    session.begin(StudioWorld(world))
    return session


def play(on: WorldSession, seconds: float, begin_s: float = 0.0, a_picture_s: float = PICTURE_S) -> list[Picture]:
    """The pictures of a time in which the page calls punctually."""
    pictures = []
    for number in range(round(seconds / a_picture_s) + 1):
        on.simulate(begin_s + number * a_picture_s)
        pictures.append(Picture(on.picture(number)))
    return pictures


@pytest.mark.parametrize("speed", [0.25, 1, 16])
def test_time_passes_at_the_chosen_speed_and_an_even_pace(speed: float) -> None:
    on = playback()
    on.play(speed)
    pictures = play(on, 2)
    assert pictures[-1].t_ms == pytest.approx(2000 * speed, abs=5)
    assert on.state().rate == pytest.approx(speed, rel=0.01)
    assert max(np.diff([each.t_ms for each in pictures])) <= speed * 34 + 5


def test_time_stands_still_before_play_and_during_a_pause() -> None:
    on = playback()
    play(on, 1)
    assert on.world.now_ms == 0
    on.play(1)
    play(on, 1, 100)
    on.pause()
    play(on, 1, 200)
    on.play(1)
    play(on, 1, 300)
    assert on.world.now_ms == pytest.approx(2000, abs=10)


def test_a_slow_computer_simulates_less_in_each_call_and_shows_its_rate() -> None:
    """A call lasts three times as long as the time that it simulates."""
    on = playback()
    on.play(1)
    now_s, lasted_s = 0.0, []
    for _ in range(200):
        before_ms = on.world.now_ms
        on.simulate(now_s)
        lasted_s.append((on.world.now_ms - before_ms) * 3 / 1000)
        on.adapt_to(lasted_s[-1])
        now_s += max(PICTURE_S, lasted_s[-1])
    assert max(lasted_s[20:]) < 2 * PICTURE_S
    assert 0.25 < on.state().rate < 0.34


def test_time_catches_up_after_late_calls() -> None:
    """Other programs keep the computer busy, while the calls themselves are short."""
    on = playback()
    on.play(1)
    for number in range(50):
        on.simulate(number * 0.2)
        on.adapt_to(0.002)
    assert on.world.now_ms == pytest.approx(49 * 200, abs=10)


def test_time_catches_up_after_a_short_stop_and_not_after_a_long_one() -> None:
    on = playback()
    on.play(1)
    play(on, 1)
    play(on, 1, 1.2)
    assert on.world.now_ms == pytest.approx(2200, abs=10)
    play(on, 1, 60)
    assert 3200 <= on.world.now_ms <= 3500


def test_a_late_picture_has_all_events_since_the_one_before() -> None:
    quick, slow = playback(), playback()
    quick.play(1)
    slow.play(1)
    events = [event for picture in play(quick, 3) for event in picture.events]
    for number in range(91):
        slow.simulate(number * PICTURE_S)
    last = Picture(slow.picture(1))
    assert last.events == events
    assert last.happened("heard")
    assert last.moment.flags[1] & HEARD


def test_a_step_is_so_many_ticks_and_then_a_pause() -> None:
    on = playback()
    on.play(1)
    play(on, 1)
    before = on.world.now_ms
    on.receive(StepWorld(3))
    assert on.world.now_ms == before + 15
    play(on, 1, 50)
    assert on.world.now_ms == before + 15


def test_changed_is_set_by_what_changes_the_picture_and_cleared_by_the_picture() -> None:
    on = playback()
    Picture(on.picture(0))
    assert not on.has_news
    for act in (
        lambda: on.receive(StepWorld(1)),
        lambda: on.receive(Move(1, 1, 1, 0)),
        lambda: on.seek(0),
        lambda: on.seek(None),
        lambda: on.receive(SetEnvironment(EMPTY_MAT, 900)),
        lambda: on.receive(Reset(1)),
    ):
        act()
        assert on.has_news
        on.picture(1)
        assert not on.has_news


def test_every_car_has_the_index_of_its_word_and_equal_words_count_in_the_order_of_sending() -> None:
    on = playback([*NEAR, Pose(50, 0)])
    assert Picture(on.picture(0)).moment.index.tolist() == [NO_INDEX] * 3
    on.play(1)
    pictures = play(on, 3.9)
    lead, near, far = np.array([picture.moment.index for picture in pictures[6:]]).T.tolist()
    assert list(dict.fromkeys(lead)) == [1, 2]
    assert list(dict.fromkeys(near)) == [STATES + 1, STATES + 2, STATES + 3, STATES + 4]
    assert set(far) == {NO_INDEX}
    assert pictures[-1].moment.flags[1] & RUNS


def test_a_car_that_receives_only_collisions_has_the_flag_lost() -> None:
    starts = Starts.of([Pose(-0.3, 0), Pose(0.3, 0), Pose(0, 0.2)], [True, True, False])
    on = playback(starts=starts)
    on.receive(StepWorld(100))
    shown = Picture(on.picture(0)).moment
    assert (shown.flags & LOST > 0).tolist() == [False, False, True]
    assert (Picture(on.picture(1)).moment.flags & LOST).tolist() == [0, 0, 0]
    on.receive(Watch(2))
    assert on.car().lost["collision"] > 0


def test_a_picture_of_the_past_equals_the_picture_of_then() -> None:
    on = playback()
    seen = {}
    for _ in range(30):
        on.receive(StepWorld(20))
        picture = Picture(on.picture(0))
        seen[picture.t_ms] = picture
    on.play(1)
    on.seek(2040)
    assert not on.playing
    past = Picture(on.picture(0))
    assert (past.t_ms, past.flags & PAST) == (2000, PAST)
    for mine, its in zip(vars(past.moment).values(), vars(seen[2000].moment).values(), strict=True):
        assert np.array_equal(mine, its)
    assert past.events == [each for each in seen[2000].events if each[0] > 1900]
    on.seek(None)
    assert Picture(on.picture(1)).t_ms == 3000


def test_the_past_is_bounded_and_the_state_has_its_beginning() -> None:
    on = playback(past_bytes=(2000, 2000))
    on.play(16)
    play(on, 4)
    earliest = on.state().earliest_ms
    assert on.world.now_ms - 1500 < earliest <= on.world.now_ms
    on.seek(0)
    assert Picture(on.picture(0)).t_ms == earliest == on.state().shown_ms
    assert sum(map(len, on.events())) <= 2000


def test_a_new_page_gets_all_events() -> None:
    on = playback()
    on.play(1)
    events = [event for picture in play(on, 2) for event in picture.events]
    on.connect()
    anew = Picture(on.picture(0))
    assert anew.flags & FIRST
    assert anew.events == events
    assert not Picture(on.picture(1)).flags & FIRST


def test_a_picture_has_the_newest_events_and_the_history_all() -> None:
    on = playback([Pose(0, 0), *(Pose(0.3 + place % 6 * 0.1, place // 6 * 0.1) for place in range(30))])
    on.play(16)
    for number in range(90):
        on.simulate(number * PICTURE_S)
    assert len(Picture(on.picture(0)).events) == MOST_EVENTS
    assert sum(map(len, on.events())) > 2 * MOST_EVENTS * EVENT_BYTES


def test_reset_begins_again_and_the_same_seed_gives_the_same_run() -> None:
    on = playback(physics=replace(Mat("", Starts.of([], [])).physics, wheel_noise=0.2))
    ends = []
    for seed in (1, 2, 1):
        on.receive(Reset(seed))
        assert (on.world.now_ms, on.playing, on.state().counts["frames"]) == (0, False, 0)
        on.receive(StepWorld(400))
        ends.append(Picture(on.picture(0)).moment.x_m.tolist())
    assert ends[0] == ends[2] != ends[1]


def test_the_details_of_a_watched_car() -> None:
    on = playback()
    assert on.car() is None
    on.receive(Watch(1))
    assert on.car().word is None
    on.receive(StepWorld(60))
    details = on.car()
    assert (details.values["led_which"], details.values["accept_ir"]) == (1, 1)
    assert (details.index, details.runs, details.leads) == (STATES + 1, True, False)
    on.receive(Watch(None))
    assert on.car() is None


def test_furniture_and_moves_reach_the_world() -> None:
    on = playback(image=compile_program(Program([right(3, speed=2)], [wait(1)])).image)
    on.receive(SetEnvironment(EMPTY_MAT | {"wall": [{"from_m": [0.25, -1], "to_m": [0.25, 1]}]}, 1000))
    on.receive(StepWorld(100))
    assert Picture(on.picture(0)).happened("heard") == []
    on.receive(Move(1, 0, 0.4, 90))
    on.receive(StepWorld(100))
    shown = Picture(on.picture(0))
    assert shown.happened("heard")
    assert (shown.moment.y_m[1], shown.moment.heading[1]) == pytest.approx((0.4, np.pi / 2))
