"""A car may be left alone for as long as `motorcade.car.next_wakeup` says: nothing would have happened meanwhile."""

from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.car import brain
from motorcade.car import next_wakeup as rest
from motorcade.car.board import NOTHING_IN_SIGHT_MM, make_levels
from motorcade.config.profile import levels_of
from motorcade.words.formats import CONTROL
from motorcade.words.image import bytes_to_words
from motorcade.words.infrared import to_frame
from motorcade.words.ticks import elapsed_ms, later_ms
from support.strategies import BRISK, images, words

LEVELS = levels_of(BRISK)
# With a relay period shorter than a frame, and times that fall on no round number.
HASTY = make_levels(
    (0, 130, 999, 1501), (90, 170, 333, 500, 701, 1200, 1999, 4001), (1, 150, 151, 499), 37, 500, 0, 40, 2
)
DURATION_MS = 3000
NOISE = st.integers(0, (1 << 32) - 1)


@dataclass(frozen=True)
class Change:
    """What is new at a car at a moment: a frame or a voice, and whether air, way and sight are free from then on."""

    frame: int | None
    voice: int
    air_is_busy: int
    obstacle_mm: int
    person: int


changes = st.builds(
    Change,
    st.none() | words().map(to_frame) | NOISE,
    st.sampled_from([brain.NO_VOICE, brain.NO_VOICE, brain.VOICE_STOP, brain.VOICE_GO]),
    st.integers(0, 1),
    st.sampled_from([NOTHING_IN_SIGHT_MM, 50, 250]),
    st.integers(0, 1),
)
# What a car senses until the first change.
CALM = Change(None, brain.NO_VOICE, 0, NOTHING_IN_SIGHT_MM, 0)


@dataclass
class BareCar:
    """A brain that is called for one moment, and what it did there."""

    image: tuple[int, ...]
    levels: tuple[int, ...]
    memory: list[int] = field(default_factory=lambda: [0] * brain.SIZE)

    def act(self, now: int, at: Change, is_new: bool) -> tuple:
        """What it shows from now on, and what it does now."""
        s = self.memory
        done: list[object] = []
        if self.image:
            while brain.leader_step(s, self.image, now, self.levels):
                done.append(("state", s[brain.STATE]))
        else:
            if brain.follower_step(s, now, self.levels):
                done.append("over")
            if is_new and at.frame is not None:
                done.append(("heard", brain.follower_hears(s, at.frame, now, self.levels)))
        if is_new and at.voice:
            brain.hear_voice(s, at.voice)
        obstacle_mm = at.obstacle_mm if brain.looks_mm(s, now, self.levels) else NOTHING_IN_SIGHT_MM
        shown = brain.wheels(s, obstacle_mm, at.person, now, self.levels), brain.lit_led(s, now, self.levels)
        if self.image and brain.leader_sends(s, self.image, now, self.levels):
            done.append(("sends", brain.sent_word(s, self.image)))
        if not self.image and brain.follower_sends(s, at.air_is_busy, now, self.levels):
            done.append(("sends", s[brain.WORD]))
        return shown, brain.looks_mm(s, now, self.levels), done

    def rest_ms(self, now: int, at: Change) -> int:
        if self.image:
            frames_ms = rest.frames_rest_ms(self.memory, self.image, now)
        else:
            frames_ms = rest.relay_rest_ms(self.memory, at.air_is_busy, now)
        return min(rest.word_rest_ms(self.memory, now, self.levels), frames_ms)


@pytest.mark.parametrize("leads", [True, False], ids=["leader", "follower"])
@given(st.data())
def test_a_brain_called_when_its_rest_is_over_does_what_one_does_that_is_called_each_millisecond(
    leads: bool, data: st.DataObject
) -> None:
    image = bytes_to_words(data.draw(images(states=1, followers=1))) if leads else ()
    levels = data.draw(st.sampled_from([LEVELS, HASTY]))
    news = data.draw(st.dictionaries(st.integers(1, DURATION_MS - 1), changes, max_size=6))
    began_ms = data.draw(st.sampled_from([0, 1_000_000, (1 << 30) - 1000]))
    number = data.draw(NOISE)
    prompt, lazy = BareCar(image, levels), BareCar(image, levels)
    for car in (prompt, lazy):
        brain.switch_on(car.memory, number, began_ms)
        if image:
            brain.leader_start(car.memory, image, began_ms)
    at, due_ms, shown = CALM, 0, []
    for t_ms in range(DURATION_MS):
        now, is_new = later_ms(began_ms, t_ms), t_ms in news
        at = news.get(t_ms, at)
        seen, looks_mm, done = prompt.act(now, at, is_new)
        if t_ms >= due_ms or is_new:
            *shown, seldom_done = lazy.act(now, at, is_new)
            rest_ms = lazy.rest_ms(now, at)
            assert rest_ms > 0
            due_ms = t_ms + rest_ms
        else:
            seldom_done = []
        assert (shown, seldom_done, lazy.memory) == ([seen, looks_mm], done, prompt.memory), t_ms


DRIVE_800 = CONTROL.encode(accept_ir=1, motor_enable=1, motor_speed=1, motor_duration=2)
PASSED_ON = CONTROL.encode(accept_ir=1, forward=1, led_duration=3)


def follower(word: int) -> list[int]:
    memory = [0] * brain.SIZE
    brain.switch_on(memory, 1, 0)
    brain.follower_hears(memory, to_frame(word), 0, LEVELS)
    return memory


@pytest.mark.parametrize(("word", "rest_ms"), [(DRIVE_800, 800), (PASSED_ON, 1200)])
def test_a_car_rests_until_its_word_has_something_new_to_do(word: int, rest_ms: int) -> None:
    memory = follower(word)
    assert rest.word_rest_ms(memory, 0, LEVELS) == rest_ms
    assert rest.word_rest_ms(memory, 100, LEVELS) == rest_ms - 100


def test_a_car_with_a_word_to_pass_on_rests_while_others_send() -> None:
    memory = follower(PASSED_ON)
    assert rest.relay_rest_ms(memory, 1, 0) == rest.NEVER_MS
    assert rest.relay_rest_ms(memory, 0, 0) == 1


def test_a_car_that_waits_for_its_turn_to_send_rests_until_then() -> None:
    memory = follower(PASSED_ON)
    now = 0
    while memory[brain.RELAY] != brain.WAITING:
        assert not brain.follower_sends(memory, 0, now, LEVELS)
        now += 1
    assert 1 < rest.relay_rest_ms(memory, 0, now) == elapsed_ms(memory[brain.RELAY_MS], now)


def test_a_car_with_nothing_to_do_rests_for_days() -> None:
    memory = [0] * brain.SIZE
    brain.switch_on(memory, 1, 0)
    assert rest.word_rest_ms(memory, 0, LEVELS) == rest.NEVER_MS
    assert rest.relay_rest_ms(memory, 0, 0) == rest.NEVER_MS
    assert rest.frames_rest_ms(memory, (0,), 0) == rest.NEVER_MS
