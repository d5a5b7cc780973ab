"""The kernels: they step all cars of a world, or of many worlds, with the brain's own functions.

A tick runs in this order: every car has its turn, the frames that cars began reach the receivers, and all cars move. In
its turn no car sees what another car does in the same tick, so neither the order of the cars nor the number of threads
changes a result. Positions are integers, sums of them are exact, and every random draw is a function of (seed, car,
time).

A car has its turn only when something can have happened to it: its word does something new
(`motorcade.car.next_wakeup`), a frame has ended, or a body may have come near since it last looked around. The other
cars keep their wheels and their displacement. A world goes from such a tick to the next one at once: in between all
cars only move on.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from motorcade.car import brain, decisions, frames, next_wakeup, step
from motorcade.engine import (
    agents,
    bicycle,
    bodies,
    cells,
    channel,
    clearance,
    events,
    floor,
    resting,
    showing,
)
from motorcade.engine.backend import in_kernel, methods_in_kernel
from motorcade.engine.geometry import FAR_UM
from motorcade.engine.judging import Asked, judge, judge_world, next_moment
from motorcade.engine.state import DRIVEN, MOST_PARTS, NOBODY, Arrays, ForBrain, Ints, Now, Words
from motorcade.words.flow import FLOOR, OBSTACLE, PERSON
from motorcade.words.positions import AVOID_ENABLE_AT, FLOOR_AT, MOTOR_SPEED_AT, PIR_AT, UNTIL_AT, UNTIL_LEVEL_AT
from motorcade.words.ticks import TICKS_MASK, elapsed_ms, later_ms, reached

_NEVER = next_wakeup.NEVER_MS
# The bits of a word that reacts to something that is sensed; those of a condition are 0 in other words than states.
_SENSES = 1 << PIR_AT | 1 << FLOOR_AT | 1 << AVOID_ENABLE_AT | 15 << UNTIL_AT


class Sensed(NamedTuple):
    """What a car senses, as `motorcade.car.senses.Senses`, and what its look around found besides.

    Attributes:
        obstacle_ms, person_ms: for how many ms the one and the other can't change; NEVER_MS where it doesn't look.
        push_x, push_y: how other cars and obstacles push it, in µm.
        floor_um, floor_ahead_um: how far its floor sensors can move before they see something else; see
            `motorcade.engine.floor`.
    """

    obstacle_mm: int
    person: int
    dark_floor: int
    obstacle_ms: int
    person_ms: int
    push_x: float
    push_y: float
    floor_um: float
    floor_ahead_um: float


@methods_in_kernel
class CarTurn(NamedTuple):
    """The turn of one car, as the ``car`` of `motorcade.car.step`."""

    leads: bool
    memory: ForBrain
    decisions: ForBrain
    image: ForBrain
    levels: ForBrain
    notes_flow: int
    i: int
    arrays: Arrays
    now: Now

    def note(self, kind: int, at_ms: int, word: int, detail: int) -> None:
        """Store an event."""
        number = self.arrays.cars.number[self.i]
        events.record(self.arrays.counters, self.now.part, at_ms, number, kind, 0, word, detail)

    def note_end(self) -> None:
        """Store that a state is over because of its condition."""
        self.note(events.OVER, self.now.ms, self.memory[brain.WORD], self.memory[brain.STATE])

    def note_flow(self, index: int) -> None:
        """Store that a flow word was executed; not those of a tick in which the car can't go on to a state."""
        s, d, number = self.memory, self.decisions, self.arrays.cars.number[self.i]
        counters, part, at_ms = self.arrays.counters, self.now.part, s[brain.STARTED_MS]
        other = int(index) + events.NEXT_WORD * int(d[decisions.NEXT])
        self.note(events.FLOW, at_ms, self.image[1 + int(index)], other)
        if d[decisions.FLOW_LEFT] == 0:
            events.forget_flow(counters, part, at_ms, number)

    def received_frames(self) -> range:
        """The frame that ends now: a range of one number, or none, because no list can be made in a kernel."""
        cars, i = self.arrays.cars, self.i
        if cars.heard_from[i] == NOBODY or not reached(self.now.ms, cars.heard_at[i]):
            return range(0)
        frame = channel.received(i, self.now.seed, self.now.ms, cars, self.arrays.rules.flips)
        return range(frame, frame + 1)

    def note_frame(self, frame: int, result: int) -> None:
        """Count a frame that the brain has processed, and store the event: received or lost."""
        cars, counters, i, part, now = self.arrays.cars, self.arrays.counters, self.i, self.now.part, self.now.ms
        number, sender, why = cars.number[i], cars.heard_from[i], 0
        cars.heard_from[i] = NOBODY
        if result == frames.BAD_PARITY:
            why = events.PARITY
        elif result == frames.BAD_RESERVED:
            why = events.RESERVED
        elif result == frames.BAD_CHECK:
            why = events.CHECK
        elif result == frames.REMOTE:
            why = events.REMOTE
        elif result == frames.DEAF:
            why = events.DEAF
        if why:
            events.record_loss(counters, part, now, number, why, frame, sender)
        else:
            counters.counts[part, events.FRAMES_HEARD] += 1
            if frame != cars.heard[i]:
                counters.counts[part, events.UNDETECTED] += 1
            self.note(events.HEARD, now, frame & 0xFFFFFFFE, sender)

    def heard_voice(self) -> int:
        """The voice command that the car hears in this tick, NO_VOICE for none."""
        return channel.voice_at(self.i, self.arrays, self.now)

    def sense(self, looks_mm: int) -> Sensed:
        """Look around where the ultrasonic sensor is on, and for people and at the floor where the word asks for it.

        A leader that decides may ask for them in words that this tick still brings.
        """
        s, rules, people = self.memory, self.arrays.rules, self.arrays.people
        obstacle_ms, person_ms, distance, push_x, push_y = _NEVER, _NEVER, FAR_UM, 0.0, 0.0
        asked = s[brain.WORD] if _minds_senses(s, self.now.ms, self.levels) else 0
        if self.leads and decisions.decides(self.decisions):
            asked = _SENSES
        if looks_mm > 0:
            look = float(looks_mm) * 1000.0
            ticks, distance, push_x, push_y = clearance.look_around(self.i, look, self.arrays, self.now)
            obstacle_ms = ticks * rules.tick_ms
        person, dark, any_um, ahead_um = 0, 0, FAR_UM, FAR_UM
        if people.now_x.shape[1] and asked >> PIR_AT & 1:
            person, free = bodies.person_near(self.i, self.now.part, self.now.ms, self.arrays.cars, people, rules)
            person_ms = clearance.whole_ticks(free) * rules.tick_ms
        if self.arrays.floor.shape[0] and asked >> FLOOR_AT & 1:
            dark, any_um, ahead_um = floor.look_down(self.i, self.arrays.cars, self.arrays.floor, rules)
        seen_mm = bodies.obstacle_mm(distance, rules)
        return Sensed(seen_mm, person, dark, obstacle_ms, person_ms, push_x, push_y, any_um, ahead_um)

    def set_outputs(self, wheels: int, senses: Sensed) -> tuple[bool, int]:
        """Set the wheels; return whether the car looked around, and for how many ms it needs no turn.

        The LED follows from the memory (`motorcade.car.brain.lit_led`), so nothing has to be set.
        """
        i, cars, rules = self.i, self.arrays.cars, self.arrays.rules
        away, floor_um = min(senses.obstacle_ms, senses.person_ms), senses.floor_um
        decides = self.leads and decisions.decides(self.decisions)
        if decides:
            away, floor_um = self.unchanged_ms(senses)
        if clearance.set_wheels(i, wheels, self.arrays, self.now) and away < _NEVER:
            # That time was computed for the wheels that the car had.
            away = 0
        clearance.push(i, senses.push_x, senses.push_y, self.arrays, self.now)
        if floor_um < FAR_UM:
            ticks = floor.ticks_unchanged(cars.wheels[i], floor_um, senses.floor_ahead_um, rules)
            away = min(away, ticks * rules.tick_ms)
        if senses.push_x != 0.0 or senses.push_y != 0.0 or (decides and self.goes_on_next_tick(senses)):
            away = 0
        return senses.obstacle_ms < _NEVER, min(away, next_wakeup.word_rest_ms(self.memory, self.now.ms, self.levels))

    def unchanged_ms(self, senses: Sensed) -> tuple[int, float]:
        """For how many ms nothing that the running state asks for can change, but for the floor; and its floor_um.

        A leader that decides has looked as far as any word of its image asks for, which may be farther than the state.
        """
        s, away, floor_um = self.memory, next_wakeup.NEVER_MS, FAR_UM
        word, until, look_mm = s[brain.WORD], decisions.running_until(s), brain.looks_mm(s, self.now.ms, self.levels)
        if until == OBSTACLE:
            look_mm = max(look_mm, self.levels[brain.AVOID_RADII_MM + (word >> UNTIL_LEVEL_AT & 3)])
        if look_mm > 0:
            away = senses.obstacle_ms
            if look_mm < decisions.looks_mm(self.decisions, self.levels):
                ticks, _, _, _ = clearance.look_around(self.i, float(look_mm) * 1000.0, self.arrays, self.now)
                away = ticks * self.arrays.rules.tick_ms
            if senses.obstacle_mm < look_mm:
                # It may come nearer than the other distance that the state asks for.
                away = 0
        if until == PERSON or word >> PIR_AT & 1:
            away = min(away, senses.person_ms)
        if until == FLOOR or word >> FLOOR_AT & 1:
            floor_um = senses.floor_um
        return away, floor_um

    def goes_on_next_tick(self, senses: Sensed) -> bool:
        """Whether a leader that decides executes words in its next tick: no state runs, or its condition ends it.

        Where the car may turn, or somebody drives it, what a state waits for may be sensed at any time.
        """
        s, wheels = self.memory, self.arrays.cars.wheels[self.i]
        # What is sensed has the fields of Senses, and others.
        if s[brain.RUNNING] == 0 or decisions.ends_early(s, self.decisions, senses, self.levels):  # type: ignore[arg-type]
            return True
        until = decisions.running_until(s)
        return wheels == DRIVEN and until in (OBSTACLE, PERSON, FLOOR)

    def air_is_busy(self) -> int:
        """1 while frames are on the air around the car."""
        return channel.air_is_busy(self.i, self.now.ms, self.arrays.cars)

    def send_frame(self, frame: int) -> None:
        """Begin to send the 32 bits of ``frame``."""
        self.note(events.FRAME, self.now.ms, frame & 0xFFFFFFFE, 0)
        channel.begin_frame(self.i, frame, self.arrays, self.now)


@in_kernel
def _minds_senses(s: ForBrain, now: int, levels: ForBrain) -> bool:
    """Whether the wheels of a car that doesn't decide may depend on what it senses: its word moves them now."""
    moves = s[brain.RUNNING] > 0 and s[brain.STOPPED] == 0 and s[brain.WORD] >> MOTOR_SPEED_AT & 3 > 0
    return moves and elapsed_ms(now, s[brain.STARTED_MS]) < brain.motor_ms(s[brain.WORD], levels)


@in_kernel
def _turn_of(i: int, arrays: Arrays, now: Now) -> CarTurn:
    cars, rules = arrays.cars, arrays.rules
    leads = cars.program[i] > 0
    image = rules.images[int(cars.program[i]) - 1 if leads else 0]
    remembered = arrays.decisions[int(cars.heard_at[i]) if leads else 0]
    return CarTurn(leads, cars.memory[:, i], remembered, image, rules.levels, 1, i, arrays, now)


@in_kernel
def _switch_on(begin: int, end: int, arrays: Arrays, now: Now) -> None:
    """Switch on the cars of a world, between two indices, in their first tick."""
    cars, levels = arrays.cars, arrays.rules.levels
    # Each world has as many leaders.
    row = now.world * (arrays.decisions.shape[0] // arrays.cells.first.shape[0])
    for i in range(begin, end):
        if cars.program[i] > 0:
            cars.heard_at[i] = row
            row += 1
        car = _turn_of(i, arrays, now)
        brain.switch_on(car.memory, (now.seed * 1_000_003 + int(cars.number[i])) & 0xFFFFFFFF, now.ms)
        if car.leads:
            decisions.survey(car.decisions, car.image, 0, 1 + int(car.image[0] >> 24), levels)
            step.begin_program(car, now.ms)


@in_kernel
def step_cars(arrays: Arrays, now: Now) -> int:
    """Run the turn of those cars that are due.

    Returns:
        How many of them began a frame; ``cars.order`` lists their indices from ``now.begin`` on.
    """
    senders, low = 0, now.begin
    while low < now.end:
        low, turns, looks = resting.list_due(low, arrays, now)
        senders += _step_listed(turns, looks, now.begin + senders, arrays, now)
    return senders


@in_kernel
def _step_listed(turns: int, looks: int, first_sender: int, arrays: Arrays, now: Now) -> int:
    """Do the work of `step_cars` for the cars that are listed."""
    cars, rules, around, share = arrays.cars, arrays.rules, arrays.around, now.share
    senders, is_loud = 0, resting.is_loud(now)
    for k in range(turns):
        i, looked = int(around.car[share, k]), False
        hears = is_loud and channel.voice_at(i, arrays, now) != brain.NO_VOICE
        if hears or reached(now.ms, cars.due[i]):
            car = _turn_of(i, arrays, now)
            word_ms = 0 if hears else _only_sends_ms(car)
            if word_ms == 0:
                looked, word_ms = step.act(car, now.ms)
            if step.send(car, now.ms):
                cars.order[first_sender + senders] = i
                senders += 1
            _set_due(car, word_ms)
        around.looks[share, looks] = i
        looks += (not looked) & clearance.is_due(cars.clear[i], now.tick) & (rules.collisions > 0)
    for k in range(looks):
        i = int(around.looks[share, k])
        _, _, push_x, push_y = clearance.look_around(i, 0.0, arrays, now)
        clearance.push(i, push_x, push_y, arrays, now)
        if (push_x != 0.0 or push_y != 0.0) and cars.memory[brain.WORD, i] & _SENSES:
            # Its sensors move otherwise than was computed.
            cars.due[i] = later_ms(now.ms, 1)
    return senders


@in_kernel
def _only_sends_ms(car: CarTurn) -> int:
    """For how many ms a car that is due can do nothing but begin a frame; 0 where there may be more to do now."""
    s, i, cars, rules, now = car.memory, car.i, car.arrays.cars, car.arrays.rules, car.now.ms
    if car.leads or (s[brain.WORD] & _SENSES and _minds_senses(s, now, rules.levels)):
        return 0
    if cars.heard_from[i] != NOBODY and reached(now, cars.heard_at[i]):
        return 0
    # Until one tick ago the car had a turn whenever there was something new, so this counts from there.
    rest_ms = next_wakeup.word_rest_ms(s, later_ms(now, -rules.tick_ms), rules.levels) - rules.tick_ms
    return max(rest_ms, 0)


@in_kernel
def _set_due(car: CarTurn, wait: int) -> None:
    """Set when the car's next turn is due: in ``wait`` ms at the latest."""
    s, i, cars, now = car.memory, car.i, car.arrays.cars, car.now.ms
    free_ms = channel.free_in_ms(i, now, cars)
    if car.leads and car.decisions[decisions.TELLS]:
        wait = min(wait, next_wakeup.tells_rest_ms(s, car.decisions, car.image, free_ms, now, car.levels))
    elif car.leads:
        wait = min(wait, next_wakeup.frames_rest_ms(s, car.image, free_ms, now, car.levels))
    else:
        wait = min(wait, next_wakeup.relay_rest_ms(s, free_ms, now))
        if cars.heard_from[i] != NOBODY:
            wait = min(wait, elapsed_ms(cars.heard_at[i], now))
    cars.due[i] = later_ms(now, max(wait, 1))


def run(
    share: int, shares: int, until: int, said_at: int, said: int, seeds: Ints, arrays: Arrays, asked: Asked
) -> None:
    """Step the worlds of one of several shares, one after the other, each from its own tick to tick ``until``.

    So a world that has come there stays as it is, and a call can be repeated where it is unknown whether it was made.
    In tick ``said_at``, the first or one before, every car hears ``said``. Each world is judged at its moments before
    ``until``.
    """
    cars, voices, rules, driven = arrays.cars, arrays.voices, arrays.rules, arrays.driven
    counts = arrays.counters.counts
    worlds = seeds.shape[0]
    per_world = cars.x.shape[0] // worlds
    for world in range(worlds * share // shares, worlds * (share + 1) // shares):
        begin, end, seed = world * per_world, (world + 1) * per_world, seeds[world]
        first_tick = counts[world, events.TICK]
        spoken = channel.voices_until((first_tick - 1) * rules.tick_ms, voices)
        cells.wake_all(begin, end, share, arrays)
        tick = first_tick
        sort_at = first_tick + -first_tick % rules.sort_every
        judge_at = next_moment(tick - 1, asked.every_ms, rules.tick_ms) if asked.every_ms > 0 else until
        while tick < until:
            if tick == judge_at:
                judge_world(world, tick, cars, rules, asked.questions, asked.answers)
                judge_at = next_moment(tick, asked.every_ms, rules.tick_ms)
            ms = tick * rules.tick_ms & TICKS_MASK
            first_voice = spoken
            while spoken < voices.at_ms.shape[0] and voices.at_ms[spoken] <= ms:
                spoken += 1
            voice = said if tick == said_at else brain.NO_VOICE
            now = Now(world, world, share, seed, tick, ms, voice, first_voice, spoken, begin, end)
            if tick == 0:
                _switch_on(begin, end, arrays, now)
            if tick == sort_at:
                resting.sort(world, begin, end, share, arrays)
                sort_at += rules.sort_every
            bicycle.set_out(arrays, now)
            senders = step_cars(arrays, now)
            for k in range(begin, begin + senders):
                channel.spread_frame(cars.order[k], begin, end, arrays, now)
            ticks = _ticks_to_next(min(until, sort_at, judge_at), arrays, now)
            resting.move(ticks, arrays, now)
            bicycle.turn_round(world, cars, driven)
            tick += ticks
        counts[world, events.TICK] = max(first_tick, until)


@in_kernel
def _ticks_to_next(most: int, arrays: Arrays, now: Now) -> int:
    """After how many ticks of a world, at tick ``most`` at the latest, anything else happens than that cars move on."""
    rules, voices = arrays.rules, arrays.voices
    next_tick = min(resting.settle(arrays, now), most)
    if next_tick > now.tick + 1 and now.last_voice < voices.at_ms.shape[0]:
        next_tick = min(next_tick, (voices.at_ms[now.last_voice] + rules.tick_ms - 1) // rules.tick_ms)
    if arrays.driven.shape[1] > 0:
        return 1
    return max(next_tick - now.tick, 1)


ORDER, SORT, SET_OUT, STEP, SPREAD, MOVE, TURN = range(7)
# Phases of a tick of a large world that each strip has of its own.
STRIP_PHASES = (STEP, SPREAD, MOVE)


def run_large(
    share: int, shares: int, phase: int, tick: int, said: int, seeds: Ints, scratch: Words, arrays: Arrays
) -> None:
    """Run a share of one phase of a tick of one world, which is cut into strips of rows of cells.

    A strip may begin one of STRIP_PHASES when its neighbours have ended the phase before; the other phases begin when
    all have.

    Args:
        share: of SORT, which of as many shares as ``shares``; of STRIP_PHASES, which strip. The other phases have one.
        phase: ORDER and SORT sort the cars; SET_OUT begins the ticks until the next sort, and each tick where somebody
            drives a car, and TURN ends it.
        scratch: (shares of SORT, cars), which a sort overwrites.
    """
    cars, cell_lists, driven, rules = arrays.cars, arrays.cells, arrays.driven, arrays.rules
    count, seed = cars.x.shape[0], seeds[0]
    senders, strips, first, frame = cell_lists.strips[0], cell_lists.strips[1], cell_lists.first[0], cell_lists.frame[0]
    ms = tick * rules.tick_ms & TICKS_MASK
    first_voice = channel.voices_until((tick - 1) * rules.tick_ms, arrays.voices)
    spoken = channel.voices_until(tick * rules.tick_ms, arrays.voices)
    rows, columns = int(frame[cells.ROWS]), int(frame[cells.COLUMNS])
    whole = Now(0, 0, 0, seed, tick, ms, said, first_voice, spoken, 0, count)
    if phase == ORDER:
        if tick == 0:
            _switch_on(0, count, arrays, whole)
        cells.fit(0, 0, count, cars, cell_lists, rules.cell)
        cells.order_by_cell(0, 0, count, cars, cell_lists)
    elif phase == SORT:
        fields = cells.fields(cars)
        for field in range(fields * share // shares, fields * (share + 1) // shares):
            cells.gather(0, count, field, scratch[share], cars)
            cells.put_back(0, count, field, scratch[share], cars)
    elif phase == SET_OUT:
        if tick % rules.sort_every == 0:
            cells.clear_push(0, count, cars)
            bicycle.find(0, 0, count, cars, driven)
        bicycle.set_out(arrays, whole)
        # What a car looks at or sends to is in its strip or in the next one.
        reach = int(rules.strip * frame[cells.PER_UM]) + 2
        parts = min(max(rows // reach, 1), arrays.counters.counts.shape[0])
        senders[MOST_PARTS] = parts
        for part in range(parts + 1):
            strips[part] = rows * part // parts
            if 0 < part < parts and tick % rules.sort_every == 0:
                # No car counts on being woken by a car of another strip.
                for i in range(first[(strips[part] - 1) * columns], first[(strips[part] + 1) * columns]):
                    cars.clear[i] = clearance.with_others(cars.clear[i], clearance.half(tick, 0))
        for part in range(parts):
            begin, end = int(first[strips[part] * columns]), int(first[strips[part + 1] * columns])
            cells.wake_all(begin, end, part, arrays)
    elif phase == TURN:
        bicycle.turn_round(0, cars, driven)
    else:
        begin, end = int(first[strips[share] * columns]), int(first[strips[share + 1] * columns])
        now = Now(0, share, share, seed, tick, ms, said, first_voice, spoken, begin, end)
        if phase == STEP:
            senders[share] = step_cars(arrays, now)
        elif phase == SPREAD:
            for other in range(max(share - 1, 0), min(share + 2, int(senders[MOST_PARTS]))):
                begun = first[strips[other] * columns]
                for k in range(begun, begun + senders[other]):
                    channel.spread_frame(cars.order[k], begin, end, arrays, now)
        else:
            resting.settle(arrays, now)
            resting.move(1, arrays, now)


# All kernels, by name.
KERNELS: Mapping[str, Callable[..., None]] = {
    kernel.__name__: kernel
    for kernel in (
        *(run, run_large, resting.wake, judge),
        bicycle.give_back,
        agents.begin_words,
        agents.read_obstacle,
        agents.read_senses,
        agents.observe,
        showing.read_moment,
        showing.pack_picture,
        showing.sort_events,
        showing.note_events,
        showing.find_nearest,
        cells.count_walls,
        cells.list_walls,
    )
}
