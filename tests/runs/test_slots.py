"""How many followers began the word of each slot, counted while a run goes on."""

from statistics import median_low

import numpy as np
import pytest

from motorcade.config.profile import built_in_profile
from motorcade.engine.events import EVENT, START
from motorcade.mats import Mat, Physics, Pose, open_table
from motorcade.mats.model import Starts
from motorcade.runs.running import Slot, SlotCounts, simulate
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image, image_words
from motorcade.words.infrared import slot_tags
from motorcade.words.packing import words_to_bytes

# LED 0 and LED 1 for 1 s each, passed on; a dwell of 2 s.
WORDS = tuple(CONTROL.encode(accept_ir=1, forward=1, led_which=led, led_duration=1) for led in (0, 1))
DWELL_MS = 2000


def image(tagged: int, words: tuple[int, ...] = WORDS) -> bytes:
    return words_to_bytes(image_words(Image((0x40000000,), words, 1 if words else -1, tagged)))


def chain(cars: int) -> Mat:
    return open_table([Pose(0.9 * place, 0) for place in range(cars)], tick_ms=5)


def slots_of(events, tagged: bool, slot: int, followers: range) -> tuple[int, int, int]:
    """Followers that began the word of a slot once, more than once and never, from the list of all events."""
    begun = dict.fromkeys(followers, 0)
    for event in events:
        at_slot = int(event["t_ms"]) // DWELL_MS
        if event["kind"] != START:
            continue
        if tagged:
            is_its = event["other"] == slot % 31 + 1 and 0 <= at_slot - slot < 16
        else:
            word = WORDS[slot % len(WORDS)]
            is_its = event["word"] == word and at_slot in (slot, slot + 1)
        begun[int(event["car"])] += bool(is_its)
    once, again = (sum(count == 1 for count in begun.values()), sum(count > 1 for count in begun.values()))
    return once, again, len(begun) - once - again


# Tags begin again after 31 slots.
@pytest.mark.parametrize(("tagged", "seconds"), [(0, 20), (1, 80)], ids=["bare", "tagged"])
def test_slots_count_the_beginnings_among_the_events(tagged: int, seconds: int) -> None:
    run = simulate(image(tagged), seconds=seconds, mat=chain(5))
    assert [slot.begin_ms for slot in run.slots] == list(range(0, 1000 * seconds, DWELL_MS))
    for number, slot in enumerate(run.slots):
        assert (slot.leader, slot.tag) == (0, number % 31 + 1 if tagged else 0)
        counted = (slot.once, slot.again, slot.never)
        assert counted == slots_of(run.events, bool(tagged), number, range(1, 5)), slot


def test_each_follower_of_a_chain_begins_each_tagged_word_once_and_lags_are_those_of_the_first_beginnings() -> None:
    run = simulate(image(1), seconds=20, mat=chain(4))
    assert {(slot.once, slot.again, slot.never) for slot in run.slots[:-1]} == {(3, 0, 0)}
    for slot in run.slots:
        begun = [int(event["t_ms"]) for event in run.events if event["kind"] == START and event["other"] == slot.tag]
        assert slot.lag_p50_ms == median_low(begun) - slot.begin_ms
        assert slot.lag_p95_ms == max(begun) - slot.begin_ms


def test_slots_are_counted_for_more_cars_than_are_recorded_and_for_each_leader() -> None:
    place = [(0.2 * (k % 40), 0.2 * (k // 40)) for k in range(1200)]
    leads = [k in (0, 600) for k in range(1200)]
    x_m, y_m = np.array(place).T
    starts = Starts(x_m, y_m, np.zeros(1200), np.array(leads))
    mat = Mat("hall", starts, 20, physics=Physics(collisions=False, line_of_sight=False))
    run = simulate(image(1), seconds=4, mat=mat)
    assert run.recording is None
    assert [(slot.leader, slot.tag) for slot in run.slots] == [(0, 1), (600, 1), (0, 2), (600, 2)]
    assert all(slot.once + slot.again + slot.never == 1198 for slot in run.slots)
    assert run.slots[0].once > 1000


def test_a_tag_that_the_leader_passes_over_belongs_to_no_slot() -> None:
    # Its frames with the tags 19 and 31 would end as a remote control's do.
    drives = CONTROL.encode(accept_ir=1, forward=1, motor_enable=1, motor_direction=2, motor_speed=3, motor_duration=3)
    run = simulate(image(1, (drives, WORDS[0])), seconds=80, mat=chain(3))
    tags = [slot.tag for slot in run.slots]
    assert tags[17:20] == [18, 20, 21]
    assert tags == slot_tags((drives, WORDS[0]), 40)
    assert {(slot.once, slot.again, slot.never) for slot in run.slots[:-1]} == {(2, 0, 0)}


def test_a_word_that_is_begun_late_counts_for_its_slot_until_its_tag_comes_again() -> None:
    counts = SlotCounts(image(1), chain(2), built_in_profile("classroom"))
    counts.write_events(30 * DWELL_MS + 1, np.zeros(0, EVENT))
    begun = np.zeros(1, EVENT)
    for name, value in (("t_ms", 30 * DWELL_MS + 500), ("kind", START), ("car", 1), ("other", 1)):
        begun[name] = value
    counts.write_events(30 * DWELL_MS + 1000, begun)
    first = counts.slots(DWELL_MS)[0]
    assert (first.tag, first.once, first.lag_p50_ms) == (1, 1, 30 * DWELL_MS + 500)


def test_a_word_that_nobody_begins_has_no_lag() -> None:
    far = open_table([Pose(0, 0), Pose(9, 0)])
    assert simulate(image(1), seconds=1, mat=far).slots == [Slot(0, 1, 0, 0, 0, 1, None, None)]


def test_there_are_no_slots_without_followers_or_words_for_them() -> None:
    assert simulate(image(0, ()), followers=3, seconds=1).slots == []
    assert simulate(image(1), followers=0, seconds=1).slots == []
