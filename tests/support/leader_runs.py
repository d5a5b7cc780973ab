"""Two plain readings of a leader that decides, to be compared: its program as a tree, and its words.

Both give, for each tick, what the car does then and what it has told its followers. Neither knows the compiler. A tick
in which more than MOST_FLOW_WORDS decisions follow each other ends a run: there only the words stand still.
"""

from collections.abc import Sequence
from random import Random
from typing import Any, NamedTuple

from motorcade.car.senses import Senses
from motorcade.config.profile import Profile
from motorcade.program.conditions import All, AnyOf, Chance, Counted, Not
from motorcade.program.flow_steps import ChangeStep, DoStep, IfStep, SetStep, TellStep
from motorcade.program.model import Program
from motorcade.program.parts import ENDLESS_MS, cut, parts_of
from motorcade.program.steps import RepeatStep
from motorcade.words.flow import IN_TURN
from motorcade.words.formats import CONTROL
from motorcade.words.image import Image
from support.deciding_leader import MOST_FLOW_WORDS, OFF, DecidingLeader

TICK_MS = 50
_MOTOR_AT, _LED_AT, _AVOID_AT = (CONTROL.field(f"{name}_duration").low for name in ("motor", "led", "avoid"))
_FLAGS = sum(CONTROL.field(name).word_mask for name in ("voice", "pir"))
_FLOOR = CONTROL.field("floor").word_mask
_MOTOR = sum(CONTROL.field(f"motor_{name}").word_mask for name in ("enable", "direction", "speed"))
_LED = CONTROL.field("led_which").word_mask
_AVOID = sum(CONTROL.field(f"avoid_{name}").word_mask for name in ("enable", "radius"))


class DecidingWorld:
    """What a car senses, by its seed, in ticks that come late now and then; and its draws."""

    def __init__(self, seed: int, profile: Profile) -> None:
        self.profile = profile
        self.now = 0
        self.voice = 0
        self.heard = 0
        self.obstacle_mm, self.person, self.floor = OFF
        self.counters: dict[Any, int] = {}
        self.decided = 0
        self._random = Random(seed)
        self._draws = Random(seed + 1)

    def tick(self) -> None:
        random = self._random
        self.now += TICK_MS + (random.randrange(8) == 0) * random.randrange(60)
        if self.now // 700 != getattr(self, "_period", -1):
            self._period = self.now // 700
            self.obstacle_mm = random.randrange(80, 480)
            self.person = int(random.random() < 0.4)
            self.floor = random.randrange(4)
        self.voice = 0
        if random.random() < 0.02:
            self.voice = 1 + random.randrange(2)
            self.heard |= self.voice
        self.decided = 0

    def draw(self) -> int:
        return self._draws.getrandbits(32)

    def senses(self, sense: str, level: int) -> bool:
        if sense == "obstacle":
            return self.obstacle_mm < self.profile.avoid_radii_mm[level]
        if sense == "person":
            return self.person > 0
        if sense == "voice":
            return self.heard >> level & 1 > 0
        return (self.floor > 0, self.floor & 1 > 0, self.floor & 2 > 0, self.floor == 3)[level]

    def compares(self, counter: Any, comparison: str, number: int) -> bool:
        value = self.counters.get(counter, 0)
        return {"is": value == number, "below": value < number, "above": value > number}[comparison]

    def count(self, counter: Any, how: int, value: int) -> None:
        now = self.counters.get(counter, 0)
        if how == 3:
            value = self.draw() // 256 % (value + 1)
        self.counters[counter] = (value, min(255, now + value), max(0, now - value), value)[how]

    def decide(self) -> None:
        self.decided += 1
        if self.decided > MOST_FLOW_WORDS:
            raise TooManyDecisionsError


class TooManyDecisionsError(Exception):
    pass


class Doing(NamedTuple):
    """The wheels, LED and avoidance that are on, and what the car listens for."""

    motor: int | None
    led: int | None
    avoid: int | None
    flags: int


def doing(parts: Sequence[tuple[int, int, int]], flags: int, passed_ms: int) -> Doing:
    """Return what a car does of parts (bits, place of their duration, duration) after a time."""
    on: dict[int, int] = {low: bits for bits, low, duration_ms in parts if passed_ms < duration_ms}
    motor = on.get(_MOTOR_AT)
    if motor is None:
        flags &= ~_FLOOR
    else:
        flags |= motor & _FLOOR
        motor &= _MOTOR
    return Doing(motor, on.get(_LED_AT), on.get(_AVOID_AT), flags)


class Act(NamedTuple):
    parts: Sequence[tuple[int, int, int]]
    flags: int
    length_ms: int
    until: Any
    pieces_ms: Sequence[int]


def run_tree(program: Program, seed: int, ticks: int, profile: Profile) -> list[Any]:
    """What the car does in each tick, read from the program's steps."""
    world = DecidingWorld(seed, profile)
    told: list[Any] = [None]

    def holds(condition: Any) -> bool:
        match condition:
            case Not(inner):
                return not holds(inner)
            case All(conditions):
                return all(map(holds, conditions))
            case AnyOf(conditions):
                return any(map(holds, conditions))
        world.decide()
        match condition:
            case Counted(name, comparison, number):
                return world.compares(name, comparison, number)
            case Chance(percent):
                return world.draw() >> 24 < round(percent * 2.56)
        return world.senses(condition.sense, condition.level)

    def walk(steps):
        for step in steps:
            match step:
                case RepeatStep(times=None, until=None):
                    while True:
                        yield from walk(step.steps)
                        world.decide()
                case RepeatStep(times=None):
                    while not holds(step.until):
                        yield from walk(step.steps)
                        world.decide()
                case RepeatStep():
                    for _ in range(step.times or 1):
                        yield from walk(step.steps)
                case IfStep():
                    if step.then or step.otherwise:
                        yield from walk(step.then if holds(step.when) else step.otherwise)
                case SetStep():
                    world.decide()
                    world.count(step.counter, 3 if step.to is None else 0, step.random or step.to or 0)
                case ChangeStep():
                    world.decide()
                    world.count(step.counter, 1 if step.by >= 0 else 2, abs(step.by))
                case TellStep():
                    world.decide()
                    told[0] = step.step and parts_of(step.step)
                case DoStep():
                    yield from walk(program.functions[step.function])
                case _:
                    yield act_of(step, profile)

    def over_and_over():
        while True:
            yield from walk(program.leader)
            world.decide()

    acts, began = over_and_over(), 0
    act: Act | None = None
    seen: list[Any] = []
    boundary = 0
    for number in range(ticks):
        if number:
            world.tick()
        end = world.now
        try:
            if act:
                if act.until is not None and world.now > began and holds_now(world, act.until):
                    act = None
                elif world.now - began >= act.length_ms:
                    end = began + act.length_ms
                    act = None
                else:
                    passed = boundaries(act, world.now - began)
                    if passed != boundary:
                        boundary, world.heard = passed, 0
            while act is None:
                act = next(acts)
                began, boundary, world.heard = end, 0, 0
                if world.now - began >= act.length_ms:
                    end, act = began + act.length_ms, None
                else:
                    boundary = boundaries(act, world.now - began)
        except TooManyDecisionsError:
            break
        assert act
        seen.append((doing(act.parts, act.flags, world.now - began), told[0]))
    return seen


def holds_now(world: DecidingWorld, until: Any) -> bool:
    """Whether the condition at the end of a step holds, which takes no flow word."""
    wanted = True
    while isinstance(until, Not):
        until, wanted = until.condition, not wanted
    return world.senses(until.sense, until.level) == wanted


def act_of(step: Any, profile: Profile) -> Act:
    parts = parts_of(step)
    timed = [part for part in parts if part.duration_low >= 0]
    flags = sum(part.bits for part in parts if part.duration_low < 0)
    finite = tuple(part.duration_ms for part in timed if part.duration_ms < ENDLESS_MS)
    length_ms = max((part.duration_ms for part in timed), default=0) or profile.idle_state_ms
    return Act(timed, flags, length_ms, step.until, cut(finite, profile.durations_ms[1:], profile.durations_ms) or ())


def boundaries(act: Act, passed_ms: int) -> int:
    """How many of the states of a step are over."""
    count = at = 0
    for piece in act.pieces_ms:
        at += piece
        if at > passed_ms:
            return count
        count += 1
    return count + (passed_ms - at) // 3000


def run_words(image: Image, seed: int, ticks: int, profile: Profile) -> list[Any]:
    """What the car does in each tick, read from the words by the oracle of the tests of the car."""
    world = DecidingWorld(seed, profile)
    leader = DecidingLeader(image, profile, world.draw, world.now)
    seen = []
    for number in range(ticks):
        if number:
            world.tick()
        found = leader.tick(world.now, world.voice, Senses(world.obstacle_mm, world.person, world.floor))
        if found.state is None:
            break
        parts, flags = parts_in(image.leader[found.state], profile)
        told = None if leader.turn else found.told
        if leader.waiting is not None:
            told = None if leader.waiting[0] == IN_TURN else leader.waiting[0]
        does = doing(parts, flags, world.now - found.began_ms)
        seen.append((does, None if told is None else image.followers[told]))
    return seen


def parts_in(word: int, profile: Profile) -> tuple[list[tuple[int, int, int]], int]:
    parts = [(word & _LED, _LED_AT, profile.durations_ms[word >> _LED_AT & 3])]
    if word & CONTROL.field("motor_enable").word_mask:
        parts.append((word & _MOTOR, _MOTOR_AT, profile.durations_ms[word >> _MOTOR_AT & 3]))
    if word & CONTROL.field("avoid_enable").word_mask:
        parts.append((word & _AVOID, _AVOID_AT, profile.durations_ms[word >> _AVOID_AT & 3]))
    return parts, word & (_FLAGS | _FLOOR)
