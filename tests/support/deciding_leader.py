"""The protocol's section "A leader that decides", written a second time: the oracle for `motorcade.car.decisions`.

Random numbers come from a function of the caller, times don't wrap, and nothing is packed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from hypothesis import strategies as st

from motorcade.car.senses import Senses
from motorcade.config.profile import Profile
from motorcade.words.formats import FLOW, STATE
from motorcade.words.image import Image, image_words
from support.strategies import LEVELS, words

MOST_FLOW_WORDS = 16
MOST_CALLS = 4
TELLS_AGAIN_AFTER = 15
OFF = Senses(1 << 20, 0, 0)


@dataclass
class Seen:
    """What such a leader does in a tick."""

    state: int | None
    began_ms: int
    counters: tuple[int, ...]
    told: int | None
    told_ms: int
    slots: int


@dataclass
class DecidingLeader:
    """A leader with an image, which begins at ``now_ms``."""

    image: Image
    profile: Profile
    draw: Callable[[], int]
    now_ms: int
    at: int = 0
    state: Any = None
    number: int = 0
    began_ms: int = 0
    heard: set[int] = field(default_factory=set)
    counters: list[int] = field(default_factory=lambda: [0, 0, 0, 0])
    calls: list[int] = field(default_factory=list)
    began: list[tuple[int, int]] = field(default_factory=list)
    # Tells: the one that waits, those told in turn, the word of the slot, when it began, how many slots there were.
    waiting: tuple[int, int] | None = None
    turn: Sequence[int] = ()
    told: int | None = None
    told_ms: int = 0
    slots: int = 0

    def tick(self, now_ms: int, voice: int, senses: Senses) -> Seen:
        """Do all that is due; ``voice`` is 0 for none, 1 for stop, 2 for go."""
        self.now_ms = now_ms
        if voice:
            self.heard.add(voice - 1)
        self._change_slots()
        self._decide(senses)
        self._change_slots()
        state = None if self.state is None else self.number
        return Seen(state, self.began_ms, tuple(self.counters), self.told, self.told_ms, self.slots)

    def _decide(self, senses: Senses) -> None:
        if self.state is not None and self._is_ended_by_its_condition(senses):
            self.state = None
        ended_ms, left = self.now_ms, MOST_FLOW_WORDS
        while True:
            if self.state is not None:
                if self.now_ms < self.began_ms + self._length_ms():
                    return
                ended_ms, self.state = self.began_ms + self._length_ms(), None
            if not left:
                return
            word = self.image.leader[self.at]
            index, self.at = self.at, (self.at + 1) % len(self.image.leader)
            if word >> 31:
                left -= 1
                self._do(FLOW.decode(word), senses)
            else:
                self.state, self.number, self.began_ms = STATE.decode(word), index, ended_ms
                self.heard.clear()
                self.began.append((index, ended_ms))

    def _is_ended_by_its_condition(self, senses: Senses) -> bool:
        state = self.state
        if not state.until:
            return False
        return self._holds(state.until, state.until_level, 0, 0, senses) != bool(state.until_not)

    def _length_ms(self) -> int:
        state, durations = self.state, self.profile.durations_ms
        blocks = [durations[state.led_duration]]
        blocks += [durations[state.motor_duration]] if state.motor_enable else []
        blocks += [durations[state.avoid_duration]] if state.avoid_enable else []
        return max(blocks) or self.profile.idle_state_ms

    def _holds(self, condition: int, level: int, counter: int, value: int, senses: Senses) -> bool:
        left, right = senses.dark_floor & 1, senses.dark_floor >> 1
        if condition == 6:
            return self.draw() // (1 << 24) < value
        counted = self.counters[counter]
        return bool(
            {
                1: senses.obstacle_mm < self.profile.avoid_radii_mm[level],
                2: senses.person,
                3: level in self.heard,
                4: (left or right, left, right, left and right)[level],
                5: (counted == value, counted < value, counted > value, None)[level],
            }[condition]
        )

    def _do(self, word: Any, senses: Senses) -> None:
        if word.op == 2:
            self.at = self.calls.pop() if self.calls else 0
        elif word.op == 3:
            counted = self.counters[word.counter]
            if word.level == 3:
                changed = self.draw() // 256 % (word.value + 1)
            else:
                changed = (word.value, min(counted + word.value, 255), max(counted - word.value, 0))[word.level]
            self.counters[word.counter] = changed
        elif word.op == 4:
            self.waiting = (word.target, word.value)
        elif not word.condition or (
            self._holds(word.condition, word.level, word.counter, word.value, senses) != bool(word.if_not)
        ):
            if word.op == 1:
                self.calls = [*self.calls, self.at][-MOST_CALLS:]
            self.at = word.target

    def _change_slots(self) -> None:
        least_ms = -(-self.profile.infrared.forget_ms // TELLS_AGAIN_AFTER)
        if self.waiting is not None and (self.told is None or self.now_ms - self.told_ms >= least_ms):
            target, count = self.waiting
            self.waiting, self.turn = None, ()
            if target == 255:
                self.turn, target = range(count or len(self.image.followers)), 0
            self.told, self.told_ms = target, self.now_ms
            self.slots += 1
        dwell_ms = self.profile.dwell_ms[self.image.dwell_level]
        while self.waiting is None and self.told is not None and self.turn and self.now_ms - self.told_ms >= dwell_ms:
            self.told, self.told_ms = (self.told + 1) % len(self.turn), self.told_ms + dwell_ms
            self.slots += 1


@st.composite
def deciding_images(draw: st.DrawFn, draws: bool = True, tells: bool = True, most: int = 10) -> Image:
    """Any image of a leader that decides; without ``draws`` no word draws a number for a condition or a counter."""
    follower_words = draw(st.lists(words(), min_size=1, max_size=3)) if tells else []
    count = draw(st.integers(1, most))
    conditions = [1, 2, 3, 4, 5, 6] if draws else [1, 2, 3, 4, 5]
    leader = []
    for _ in range(count):
        ops = ["state"] * 3 + ["jump"] * 3 + ["call", "return", "count"] + (["tell"] if tells else [])
        op = draw(st.sampled_from(ops))
        target = draw(st.integers(0, count - 1))
        value = draw(st.sampled_from([0, 1, 2, 128, 255]))
        condition = draw(st.sampled_from([0, *conditions]))
        level = draw(st.integers(0, (0, 3, 0, 1, 3, 2, 0)[condition]))
        asked = {"condition": condition, "level": level, "if_not": draw(st.integers(0, 1)), "value": value}
        if op == "state":
            until = draw(st.sampled_from([0, 0, 1, 2, 3, 4]))
            ends = {"until_not": draw(st.integers(0, 1)), "until_level": draw(st.integers(0, (0, 3, 0, 1, 3)[until]))}
            acts = STATE.decode(draw(words(leads=True)))._asdict()
            leader.append(STATE.encode(**{**acts, "until": until, **ends}))
        elif op == "jump":
            leader.append(FLOW.encode(op=0, target=target, counter=draw(LEVELS), **asked))
        elif op == "call":
            leader.append(FLOW.encode(op=1, target=target, counter=draw(LEVELS), **asked))
        elif op == "return":
            leader.append(FLOW.encode(op=2))
        elif op == "count":
            how = draw(st.integers(0, 3 if draws else 2))
            leader.append(FLOW.encode(op=3, counter=draw(st.integers(0, 1)), level=how, value=value))
        elif draw(st.booleans()):
            leader.append(FLOW.encode(op=4, target=255, value=draw(st.integers(0, len(follower_words)))))
        else:
            leader.append(FLOW.encode(op=4, target=draw(st.integers(0, len(follower_words) - 1))))
    image = Image(tuple(leader), tuple(follower_words), draw(st.integers(0, 7)) if tells else -1, int(tells), 1)
    assert image_words(image)
    return image
