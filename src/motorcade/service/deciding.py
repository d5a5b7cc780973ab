"""What leaders that decide have decided, and what their conditions find now: for blocks, table, stage and 'Why?'.

The engine's events tell which flow words led to a state, and which state its condition ended. Whether a condition is
met now, the brain itself is asked (`motorcade.car.decisions`).
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from motorcade.car import brain, decisions
from motorcade.car.senses import Senses
from motorcade.config.profile import levels_of
from motorcade.engine import agents
from motorcade.engine.events import FLOW as EXECUTED
from motorcade.engine.events import NEXT_WORD, OVER, STATE
from motorcade.engine.moment import Event, unpack_events
from motorcade.engine.simulation import Simulation
from motorcade.errors import Phrase
from motorcade.program.conditions import COMPARISONS, SENSES
from motorcade.service.world_messages import Decided
from motorcade.words.flow import ALWAYS, CALL, CHANCE, CONDITIONS, COUNTER, DECIDES
from motorcade.words.formats import CONTROL, FLOW
from motorcade.words.formats import STATE as STATE_WORD
from motorcade.words.infrared import LOWER_HALF
from motorcade.words.packing import bytes_to_words

# So many leaders at most are looked at: each has conditions that are asked again and again.
_MOST_LEADERS = 20
# What all cars sense is found out at once, which takes too long in a large crowd.
_MOST_CARS = 200
_KINDS = tuple(name for _, name in CONDITIONS)
# No car has so large a radius.
_FAR_MM = 1 << 20


class AskedCondition(NamedTuple):
    """A condition of a word, without whether it has to be met; ``counter`` and ``value`` are 0 where it has none."""

    condition: int
    level: int
    counter: int = 0
    value: int = 0


class Decision(NamedTuple):
    """A condition by which a leader went: what was asked, whether it was met, and when."""

    t_ms: int
    asked: AskedCondition
    is_met: bool


class Deciding:
    """The leaders of a world that decide, from one beginning on.

    Args:
        world: the world; make this object anew where it begins again.
        counters: the names of the counters of its first image, "" for one that the program does not name.
    """

    def __init__(self, world: Simulation, counters: Sequence[str] = ()) -> None:
        self._world = world
        self._counters = counters
        self._levels = levels_of(world.profile)
        words = bytes_to_words(world.images[0]) if world.images else (0,)
        # Pages show the words of the first image: these leaders run it.
        leaders = world.mat.starts.leaders[:: len(world.images) or 1]
        if not words[0] & DECIDES:
            leaders = []
        self._words = words
        self._asked = {index: asked for index, asked in _asked_in(words) if asked.condition != CHANCE}
        # What happened on the way to each leader's present state, and behind it; the state itself is the last of a way.
        self._ways: dict[int, list[Event]] = {car: [] for car in leaders[:_MOST_LEADERS]}
        self._begun: dict[int, list[Event]] = {car: [] for car in self._ways}

    def see(self, rows: bytes) -> None:
        """Take the rows of the events since the last call."""
        if not self._ways:
            return
        for event in unpack_events(rows):
            if event.kind not in (STATE, OVER, EXECUTED) or event.car not in self._ways:
                continue
            self._begun[event.car].append(event)
            if event.kind == STATE:
                self._ways[event.car] = self._begun[event.car]
                self._begun[event.car] = []

    def look(self) -> list[Decided]:
        """Return what each of these leaders has come to."""
        found = []
        for car, events in self._ways.items():
            # The indices of the words that led to the present state, and of the state.
            path = [1 + event.other % NEXT_WORD for event in events if event.kind != OVER]
            found.append(Decided(car, self._world.counters_of(car), self.holding(car), path))
        return found

    def holding(self, car: int) -> list[int]:
        """Return the indices of the words whose condition is met now, whether or not it has to be; not of chance."""
        world = self._world
        if not self._asked or car not in self._ways or world.tick == 0 or world.cars > _MOST_CARS:
            return []
        sensed = _sensed(world, car)
        memory = world.memory_of(car, range(brain.SIZE))
        remembered = bytearray(world.decisions_of(car))
        met = {}
        for asked in set(self._asked.values()):
            word = FLOW.encode(counter=asked.counter, value=asked.value)
            met[asked] = decisions.is_met(
                memory, remembered, asked.condition, asked.level, word & LOWER_HALF, sensed, self._levels
            )
        return [index for index, asked in self._asked.items() if met[asked]]

    def last(self, car: int) -> Decision | None:
        """The last condition by which a leader came to its present state; None where it came by none."""
        for event in reversed(self._ways.get(car, ())):
            decision = _decision_of(event, self._words[0] >> 24)
            # The counter of a repeat has no name: the pupil knows nothing of it.
            if decision and (decision.asked.condition != COUNTER or self._name_of(decision.asked.counter)):
                return decision
        return None

    def decides(self, car: int) -> bool:
        """Whether a car is one of these leaders."""
        return car in self._ways

    def phrase(self, asked: AskedCondition, is_met: bool) -> Phrase:
        """Say that a condition was met, or that it wasn't: 'nothing was nearer than 20 cm'."""
        kind = _KINDS[asked.condition]
        answer = "no"
        if is_met:
            answer = "yes"
        details: dict[str, object] = {}
        if kind == "obstacle":
            details = {"cm": f"{self._levels[brain.AVOID_RADII_MM + asked.level] / 10:g}"}
        elif kind == "voice":
            details = {"word": Phrase(f"voice-{SENSES['voice'][asked.level]}")}
        elif kind == "floor":
            kind = f"floor-{SENSES['floor'][asked.level]}"
        elif kind == "counter":
            kind = f"counter-{COMPARISONS[asked.level]}"
            details = {"counter": self._name_of(asked.counter), "value": asked.value}
        return Phrase(f"asked-{kind}-{answer}", **details)

    def phrase_of(self, index: int) -> Phrase:
        """Say that the condition of a word is met."""
        return self.phrase(self._asked[index], is_met=True)

    def _name_of(self, counter: int) -> str | Phrase:
        if self._counters:
            return self._counters[counter]
        return Phrase("counter-number", number=counter + 1)


def minded(world: Simulation, car: int) -> Phrase | None:
    """Return why a car stands or turns while its word drives; None where it does what the word says.

    That is the sense without which its wheels would turn otherwise, asked of the brain itself.
    """
    levels = levels_of(world.profile)
    sensed = _sensed(world, car)
    memory = world.memory_of(car, range(brain.SIZE))
    values = CONTROL.decode(memory[brain.WORD])
    unheard = [*memory]
    unheard[brain.STOPPED] = 0
    light = sensed.dark_floor
    if values.motor_direction == brain.RANDOM_FORWARD:
        light = 0
    # Each sense is taken away beside those before it, in the order in which the brain asks them.
    without = (
        ("voice", unheard, sensed),
        ("person", unheard, Senses(sensed.obstacle_mm, 0, sensed.dark_floor)),
        ("obstacle", unheard, Senses(_FAR_MM, 0, sensed.dark_floor)),
        ("floor", unheard, Senses(_FAR_MM, 0, light)),
    )
    does = brain.wheels([*memory], sensed, world.now_ms, levels)
    for sense, remembered, senses in without:
        if brain.wheels([*remembered], senses, world.now_ms, levels) != does:
            cm = levels[brain.AVOID_RADII_MM + values.avoid_radius] / 10
            return Phrase(f"why-minds-{sense}", **({"cm": f"{cm:g}"} if sense == "obstacle" else {}))
    return None


def _sensed(world: Simulation, car: int) -> Senses:
    """Return what a car senses now."""
    senses = memoryview(world.backend.read(world.read_senses())).cast("q")[car * agents.SENSED :]
    return Senses(senses[agents.OBSTACLE_MM], senses[agents.PERSON], senses[agents.DARK_FLOOR])


def doing(word: int) -> Phrase:
    """Say what a car does by a control word: 'It turns right'."""
    values = CONTROL.decode(word)
    what = "stands"
    if values.motor_enable and values.motor_speed:
        what = ("forward", "left", "right", "random")[values.motor_direction]
        if values.floor and what == "forward":
            what = "line"
    elif values.led_duration:
        what = "lights"
    return Phrase(f"doing-{what}")


def _asked_in(words: Sequence[int]) -> Iterator[tuple[int, AskedCondition]]:
    """Yield the condition of each leader word that has one, by its index in the image."""
    for index, word in enumerate(words[1 : 1 + (words[0] >> 24)], 1):
        asked = _asked_by(word)
        if asked.condition != ALWAYS:
            yield index, asked


def _asked_by(word: int) -> AskedCondition:
    if word >> 31 == 0:
        state = STATE_WORD.decode(word)
        return AskedCondition(state.until, state.until_level)
    flow = FLOW.decode(word)
    if flow.op > CALL:
        return AskedCondition(ALWAYS, 0)
    if flow.condition != COUNTER:
        return AskedCondition(flow.condition, flow.level)
    return AskedCondition(flow.condition, flow.level, flow.counter, flow.value)


def _decision_of(event: Event, leader_words: int) -> Decision | None:
    """The condition that decided at an event of an image with so many leader words; None where there was none."""
    if event.kind == OVER:
        return Decision(event.t_ms, _asked_by(event.word), not STATE_WORD.decode(event.word).until_not)
    if event.kind != EXECUTED:
        return None
    asked = _asked_by(event.word)
    flow = FLOW.decode(event.word)
    following, index = divmod(event.other, NEXT_WORD)
    # A jump to the word behind it decides nothing.
    if asked.condition == ALWAYS or flow.target == (index + 1) % leader_words:
        return None
    return Decision(event.t_ms, asked, (following == flow.target) != bool(flow.if_not))
