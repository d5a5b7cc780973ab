"""Nothing happens at a car for as long as `motorcade.car.next_wakeup` says."""

from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motorcade.car import brain, frames, next_wakeup, step
from motorcade.car.board import NOTHING_IN_SIGHT_MM, make_levels
from motorcade.car.senses import NOTHING, Senses
from motorcade.config.profile import levels_of
from motorcade.words.formats import CONTROL
from motorcade.words.infrared import to_frame
from motorcade.words.packing import bytes_to_words
from motorcade.words.ticks import elapsed_ms, later_ms
from support.radio_hall import RadioCar
from support.strategies import BRISK, images, tagged_frames, words

LEVELS = levels_of(BRISK)
# A relay period shorter than a frame, and times that are no round numbers.
HASTY = make_levels(
    (0, 130, 999, 1501),
    (90, 170, 333, 500, 701, 1200, 1999, 4001),
    (1, 150, 151, 499),
    37,
    (500, 0, 40, 2, 31, 333, 1, 4100),
)
DURATION_MS = 3000
NOISE = st.integers(0, (1 << 32) - 1)


@dataclass(frozen=True)
class SenseChange:
    """The inputs of a car that change at a moment: a frame or a voice now, all others from then on."""

    frame: int | None
    voice: int
    air_is_busy: int
    obstacle_mm: int
    person: int
    dark_floor: int


changes = st.builds(
    SenseChange,
    st.none() | words().map(to_frame) | tagged_frames() | NOISE,
    st.sampled_from([brain.NO_VOICE, brain.NO_VOICE, brain.VOICE_STOP, brain.VOICE_GO]),
    st.integers(0, 1),
    st.sampled_from([NOTHING_IN_SIGHT_MM, 50, 250]),
    st.integers(0, 1),
    st.integers(0, 3),
)
# The inputs until the first change.
CALM = SenseChange(None, brain.NO_VOICE, 0, NOTHING_IN_SIGHT_MM, 0, 0)


@dataclass
class BareCar(RadioCar):
    """A car without a board, for `motorcade.car.step`, and what it did in its last step."""

    inputs: SenseChange = CALM
    is_new: bool = False
    now_ms: int = 0
    done: list[object] = field(default_factory=list)

    def step(self, now: int, inputs: SenseChange, is_new: bool) -> tuple:
        """What it shows from now on, and what it does now."""
        self.now_ms, self.inputs, self.is_new, self.done = now, inputs, is_new, []
        shown = step.act(self, now)
        step.send(self, now)
        return shown, brain.looks_mm(self.memory, now, self.levels), self.done

    def note(self, kind: int, at_ms: int, word: int, detail: int) -> None:
        self.done.append((kind, word, detail))

    def received_frames(self) -> list[int]:
        return [self.inputs.frame] if self.is_new and self.inputs.frame is not None else []

    def note_frame(self, frame: int, result: int) -> None:
        self.done.append(("heard", result))

    def heard_voice(self) -> int:
        return self.inputs.voice if self.is_new else brain.NO_VOICE

    def sense(self, looks_mm: int) -> Senses:
        seen_mm = self.inputs.obstacle_mm if looks_mm else NOTHING.obstacle_mm
        return Senses(seen_mm, self.inputs.person, self.inputs.dark_floor)

    def set_outputs(self, wheels: int, senses: Senses) -> tuple[int, int]:
        return wheels, brain.lit_led(self.memory, self.now_ms, self.levels)

    def air_is_busy(self) -> int:
        return self.inputs.air_is_busy

    def send_frame(self, frame: int) -> None:
        self.done.append(("sends", frame))

    def rest_ms(self, now: int, inputs: SenseChange) -> int:
        free_ms = next_wakeup.NEVER_MS if inputs.air_is_busy else 0
        if self.image:
            frames_ms = next_wakeup.frames_rest_ms(self.memory, self.image, free_ms, now, self.levels)
        else:
            frames_ms = next_wakeup.relay_rest_ms(self.memory, free_ms, now)
        return min(next_wakeup.word_rest_ms(self.memory, now, self.levels), frames_ms)


@pytest.mark.parametrize("leads", [True, False], ids=["leader", "follower"])
@given(st.data())
def test_a_car_stepped_only_when_due_equals_one_stepped_each_millisecond(leads: bool, data: st.DataObject) -> None:
    image = bytes_to_words(data.draw(images(states=1, followers=1))) if leads else ()
    levels = data.draw(st.sampled_from([LEVELS, HASTY]))
    news = data.draw(st.dictionaries(st.integers(1, DURATION_MS - 1), changes, max_size=6))
    began_ms = data.draw(st.sampled_from([0, 1_000_000, (1 << 30) - 1000]))
    number = data.draw(NOISE)
    prompt, lazy = BareCar(number, image, levels), BareCar(number, image, levels)
    for car in (prompt, lazy):
        car.switch_on(began_ms)
    at, due_ms, shown = CALM, 0, []
    for t_ms in range(DURATION_MS):
        now, is_new = later_ms(began_ms, t_ms), t_ms in news
        at = news.get(t_ms, at)
        seen, looks_mm, done = prompt.step(now, at, is_new)
        if t_ms >= due_ms or is_new:
            *shown, seldom_done = lazy.step(now, at, is_new)
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
    frames.follower_hears(memory, to_frame(word), 0, LEVELS)
    return memory


@pytest.mark.parametrize(("word", "rest_ms"), [(DRIVE_800, 800), (PASSED_ON, 1200)])
def test_a_car_rests_until_its_word_changes_something(word: int, rest_ms: int) -> None:
    memory = follower(word)
    assert next_wakeup.word_rest_ms(memory, 0, LEVELS) == rest_ms
    assert next_wakeup.word_rest_ms(memory, 100, LEVELS) == rest_ms - 100


def test_a_car_with_a_word_to_pass_on_rests_while_others_send() -> None:
    memory = follower(PASSED_ON)
    assert next_wakeup.relay_rest_ms(memory, 700, 0) == 700
    assert next_wakeup.relay_rest_ms(memory, 0, 0) == 1


def test_a_car_never_wakes_to_pass_on_a_word_that_it_keeps_for_itself() -> None:
    assert next_wakeup.relay_rest_ms(follower(DRIVE_800), 0, 0) == next_wakeup.NEVER_MS


def test_a_car_that_waits_to_send_rests_until_then() -> None:
    memory = follower(PASSED_ON)
    now = 0
    while memory[brain.RELAY] != frames.WAITING:
        assert frames.follower_frame(memory, 0, now, LEVELS) == frames.NO_FRAME
        now += 1
    assert 1 < next_wakeup.relay_rest_ms(memory, 0, now) == elapsed_ms(memory[brain.RELAY_MS], now)


def test_a_car_with_nothing_to_do_rests_for_days() -> None:
    memory = [0] * brain.SIZE
    brain.switch_on(memory, 1, 0)
    assert next_wakeup.word_rest_ms(memory, 0, LEVELS) == next_wakeup.NEVER_MS
    assert next_wakeup.relay_rest_ms(memory, 0, 0) == next_wakeup.NEVER_MS
    assert next_wakeup.frames_rest_ms(memory, (0,), 0, 0, LEVELS) == next_wakeup.NEVER_MS
