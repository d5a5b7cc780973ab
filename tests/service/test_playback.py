"""One page's world: its clock, its past, and what it tells."""

from dataclasses import replace

import numpy as np
import pytest

from motorcade import Followers, Mat, Pose, Program, World, compile_program, forward, led, left, open_table, right, wait
from motorcade.errors import MotorcadeError
from motorcade.mats import Starts
from motorcade.service import playback as stage_module
from motorcade.service.history import History
from motorcade.service.pictures import FIRST, HEARD, LOST, MOST_EVENTS, NO_INDEX, PAST, RUNS
from motorcade.service.playback import PICTURE_S, Playback
from support.pictures import Picture

STATES = 2
IMAGE = compile_program(
    Program(
        [forward(3, speed=2), left(1)],
        Followers([led(1, 1), led(2, 1), led(1, 1), led(3, 1)]),
    )
).image
NEAR = [Pose(0, 0), Pose(0.5, 0)]


def stage(poses=NEAR, image=IMAGE, **more) -> Playback:
    return Playback(World(replace(open_table(poses, tick_ms=5), **more), [image], events=True, threads=1))


def play(on: Playback, seconds: float, begin_s: float = 0.0, a_picture_s: float = PICTURE_S) -> list[Picture]:
    """The pictures of a while in which the page is punctual."""
    pictures = []
    for number in range(round(seconds / a_picture_s) + 1):
        on.advance(begin_s + number * a_picture_s)
        pictures.append(Picture(on.picture(number)))
    return pictures


@pytest.mark.parametrize("speed", [0.25, 1, 16])
def test_time_goes_as_fast_as_it_is_told_to(speed: float) -> None:
    on = stage()
    on.play(speed)
    pictures = play(on, 2)
    assert pictures[-1].t_ms == pytest.approx(2000 * speed, abs=5)
    assert on.state()["rate"] == pytest.approx(speed, rel=0.01)
    # At an even pace.
    assert max(np.diff([each.t_ms for each in pictures])) <= speed * 34 + 5


def test_a_stage_stands_still_until_it_plays_and_while_it_pauses() -> None:
    on = stage()
    play(on, 1)
    assert on.now_ms == 0
    on.play(1)
    play(on, 1, 100)
    on.pause()
    play(on, 1, 200)
    on.play(1)
    play(on, 1, 300)
    assert on.now_ms == pytest.approx(2000, abs=10)


def test_a_stage_that_cannot_keep_up_does_less_at_a_time_and_says_how_fast_it_is() -> None:
    """Here a call lasts three times as long as what it simulates."""
    on = stage()
    on.play(1)
    now_s, lasted_s = 0.0, []
    for _ in range(200):
        before_ms = on.now_ms
        on.advance(now_s)
        lasted_s.append((on.now_ms - before_ms) * 3 / 1000)
        on.took(lasted_s[-1])
        now_s += max(PICTURE_S, lasted_s[-1])
    assert max(lasted_s[20:]) < 2 * PICTURE_S
    assert 0.25 < on.state()["rate"] < 0.34


def test_a_stage_that_is_called_late_makes_up_for_it() -> None:
    """Others keep the machine busy; this one's own calls are short."""
    on = stage()
    on.play(1)
    for number in range(50):
        on.advance(number * 0.2)
        on.took(0.002)
    assert on.now_ms == pytest.approx(49 * 200, abs=10)


def test_what_a_short_stop_owes_is_made_up_for_and_a_long_one_is_not() -> None:
    on = stage()
    on.play(1)
    play(on, 1)
    play(on, 1, 1.2)
    assert on.now_ms == pytest.approx(2200, abs=10)
    play(on, 1, 60)
    assert 3200 <= on.now_ms <= 3500


def test_a_slow_picture_holds_all_that_happened_since_the_one_before() -> None:
    quick, slow = stage(), stage()
    quick.play(1)
    slow.play(1)
    told = [event for picture in play(quick, 3) for event in picture.events.tolist()]
    for number in range(91):
        slow.advance(number * PICTURE_S)
    last = Picture(slow.picture(1))
    assert last.events.tolist() == told
    assert last.told("heard")
    assert last.moment.flags[1] & HEARD


def test_steps_are_ticks_and_end_in_a_pause() -> None:
    on = stage()
    on.play(1)
    play(on, 1)
    before = on.now_ms
    on.step(3)
    assert on.now_ms == before + 15
    play(on, 1, 50)
    assert on.now_ms == before + 15


def test_there_is_a_picture_to_show_only_where_something_changed() -> None:
    on = stage()
    Picture(on.picture(0))
    assert not on.changed
    for act in (
        lambda: on.step(1),
        lambda: on.move(1, 1, 1, 0),
        lambda: on.seek(0),
        lambda: on.seek(None),
        lambda: on.furnish(on._world.mat, 900),
        lambda: on.reset(1),
    ):
        act()
        assert on.changed
        on.picture(1)
        assert not on.changed


def test_every_car_shows_the_index_of_its_word_and_equal_words_in_the_order_of_sending() -> None:
    on = stage([*NEAR, Pose(50, 0)])
    assert Picture(on.picture(0)).moment.held.tolist() == [NO_INDEX] * 3
    on.play(1)
    pictures = play(on, 3.9)
    lead, near, far = np.array([picture.moment.held for picture in pictures[6:]]).T.tolist()
    assert list(dict.fromkeys(lead)) == [1, 2]
    assert list(dict.fromkeys(near)) == [STATES + 1, STATES + 2, STATES + 3, STATES + 4]
    assert set(far) == {NO_INDEX}
    assert pictures[-1].moment.flags[1] & RUNS


def test_a_car_that_hears_nothing_but_collisions_shows_that_it_lost_frames() -> None:
    starts = Starts.of([Pose(-0.3, 0), Pose(0.3, 0), Pose(0, 0.2)], [True, True, False])
    on = stage(starts=starts)
    on.step(100)
    shown = Picture(on.picture(0)).moment
    assert (shown.flags & LOST > 0).tolist() == [False, False, True]
    assert (Picture(on.picture(1)).moment.flags & LOST).tolist() == [0, 0, 0]
    on.watch(2)
    assert on.car()["lost"]["collision"] > 0


def test_the_past_is_shown_as_it_was() -> None:
    on = stage()
    seen = {}
    for _ in range(30):
        on.step(20)
        picture = Picture(on.picture(0))
        seen[picture.t_ms] = picture
    on.play(1)
    on.seek(2040)
    assert not on.playing
    past = Picture(on.picture(0))
    assert (past.t_ms, past.flags & PAST) == (2000, PAST)
    for mine, its in zip(past.moment, seen[2000].moment, strict=True):
        assert np.array_equal(mine, its)
    assert past.events.tolist() == [each for each in seen[2000].events.tolist() if each[0] > 1900]
    on.seek(None)
    assert Picture(on.picture(1)).t_ms == 3000


def test_the_past_is_bounded_and_its_beginning_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage_module, "History", lambda: History(moment_bytes=2000, event_bytes=2000))
    on = stage()
    on.play(16)
    play(on, 4)
    earliest = on.state()["earliest_ms"]
    assert on.now_ms - 1500 < earliest <= on.now_ms
    on.seek(0)
    assert Picture(on.picture(0)).t_ms == earliest == on.state()["shown_ms"]
    assert sum(batch.nbytes for batch in on.events()) <= 2000


def test_whoever_looks_anew_is_told_all_that_happened() -> None:
    on = stage()
    on.play(1)
    told = [event for picture in play(on, 2) for event in picture.events.tolist()]
    on.look_anew()
    anew = Picture(on.picture(0))
    assert anew.flags & FIRST
    assert anew.events.tolist() == told
    assert not Picture(on.picture(1)).flags & FIRST


def test_events_that_nobody_fetches_take_no_more_room_than_a_picture_has() -> None:
    on = stage([Pose(0, 0), *(Pose(0.3 + place % 6 * 0.1, place // 6 * 0.1) for place in range(30))])
    on.play(16)
    for number in range(90):
        on.advance(number * PICTURE_S)
    assert sum(map(len, on._new)) < 2 * MOST_EVENTS
    assert len(Picture(on.picture(0)).events) == MOST_EVENTS
    assert sum(map(len, on.events())) > 2 * MOST_EVENTS


def test_reset_begins_anew_and_the_same_seed_gives_the_same() -> None:
    on = stage(physics=replace(Mat("", Starts.of([], [])).physics, wheel_noise=0.2))
    ends = []
    for seed in (1, 2, 1):
        on.reset(seed)
        assert (on.now_ms, on.playing, on.state()["counts"]["frames"]) == (0, False, 0)
        on.step(400)
        ends.append(Picture(on.picture(0)).moment.x_m.tolist())
    assert ends[0] == ends[2] != ends[1]


def test_a_watched_car_tells_what_it_holds_and_hears() -> None:
    on = stage()
    assert on.car() is None
    on.watch(1)
    assert on.car()["word"] is None
    on.step(60)
    told = on.car()
    assert told["values"]["led_which"] == 1
    assert told["values"]["accept_ir"] == 1
    assert (told["index"], told["runs"], told["leads"]) == (STATES + 1, True, False)
    assert told["hears"] == {"word": told["word"], "car": 0, "t_ms": told["hears"]["t_ms"]}
    assert told["heard"] == on.state()["counts"]["heard"] > 0
    assert 0 < told["since_ms"] < 300
    on.watch(0)
    assert on.car()["word"] == IMAGE[4:8].hex()
    assert on.car()["frames"] == on.state()["counts"]["frames"] > 0
    on.watch(None)
    assert on.car() is None
    with pytest.raises(MotorcadeError, match="0 to 1"):
        on.watch(2)


def test_said_words_furniture_and_moves_reach_the_world() -> None:
    on = stage(image=compile_program(Program([right(3, speed=2)], [wait(1)])).image)
    on.furnish(Mat("wall", Starts.of([], []), walls=((0.25, -1, 0.25, 1),)), 1000)
    on.step(100)
    assert Picture(on.picture(0)).told("heard") == []
    on.move(1, 0, 0.4, 90)
    on.step(100)
    shown = Picture(on.picture(0))
    assert shown.told("heard")
    assert (shown.moment.y_m[1], shown.moment.heading[1]) == pytest.approx((0.4, np.pi / 2))


def test_what_is_kept_becomes_a_film() -> None:
    on = stage()
    on.step(400)
    frames = list(on.frames(1))
    assert [frame.t_ms for frame in frames] == list(range(1000, 2001, 100))
    assert frames[-1].word[0] == int.from_bytes(IMAGE[4:8])
    assert frames[-1].runs.tolist() == [True, True]
    assert on.about().every_ms == 100
