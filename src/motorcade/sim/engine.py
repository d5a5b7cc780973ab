"""The engine: all cars of a world, or of many worlds, by the brain's own functions.

A tick, in this order: every car's brain runs; the frames that were begun spread;
everyone moves. No car sees what another did in the same tick, so neither their
order nor the number of threads has a meaning. Positions are integers, sums of
them are exact, and every random draw is a function of (seed, car, time).

A car is looked at only when something can have happened to it: its word has
something new to do (`motorcade.car.rest`), a frame has ended, or a body may have
come near since it last looked around. The others just go on.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

from motorcade.car import brain, rest
from motorcade.sim import bodies, channel, compiled, geometry, state, tally
from motorcade.sim import cells as grid
from motorcade.sim.compiled import in_kernel
from motorcade.sim.state import MOST_PARTS, NOBODY, Cars, Cells, Ints, People, Place, Rules, Voices
from motorcade.sim.tally import Tally
from motorcade.words.formats import CONTROL
from motorcade.words.infrared import to_frame
from motorcade.words.ticks import TICKS_MASK, elapsed_ms, later_ms, reached

_PIR_AT = CONTROL.field("pir").low


@in_kernel
def switch_on(begin: int, end: int, seed: int, now: int, part: int, cars: Cars, rules: Rules, told: Tally) -> None:
    """What every car does in its first tick."""
    for i in range(begin, end):
        s = cars.memory[:, i]
        brain.switch_on(s, (seed * 1_000_003 + int(cars.number[i])) & 0xFFFFFFFF, now)
        if cars.program[i] > 0:
            image = rules.images[int(cars.program[i]) - 1]
            if brain.leader_start(s, image, now):
                tally.tell(told, part, now, cars.number[i], tally.STATE, 0, s[brain.WORD], 0)


@in_kernel
def think(
    begin: int,
    end: int,
    world: int,
    part: int,
    seed: int,
    now: int,
    said: int,
    cars: Cars,
    cells: Cells,
    place: Place,
    people: People,
    voices: Voices,
    rules: Rules,
    told: Tally,
) -> int:
    """Run the brains of those cars between two indices that are due; gives how many of them began a frame.

    They stand at the beginning of their part of ``cars.order`` then.
    """
    senders = begin
    first_voice, last_voice = _voices_until(now - rules.tick_ms, voices), _voices_until(now, voices)
    everyone = said != brain.NO_VOICE or first_voice < last_voice
    for i in range(begin, end):
        if reached(now, cars.due[i]) == 0 and not everyone:
            continue
        s = cars.memory[:, i]
        _step(i, part, seed, now, cars, rules, told)
        if everyone:
            _listen(i, s, said, first_voice, last_voice, cars, voices)
        look = float(brain.looks_mm(s, now, rules.levels)) * 1000.0
        looks = look > 0.0 or (rules.collisions and reached(now, cars.clear[i]))
        distance, push_x, push_y = geometry.FAR_UM, 0.0, 0.0
        if looks:
            ticks, seen, push_x, push_y = bodies.others_near(i, world, look, cars, cells, rules)
            place_ticks, distance, other_x, other_y = bodies.place_near(i, look, cars, place, rules)
            distance, push_x, push_y = min(distance, seen), push_x + other_x, push_y + other_y
            cars.clear[i] = later_ms(now, _whole_ticks(min(ticks, place_ticks)) * rules.tick_ms)
        sensed, away = 0, rest.NEVER_MS
        if people.now_x.shape[1] and s[brain.RUNNING] and s[brain.WORD] >> _PIR_AT & 1:
            sensed, outside = bodies.person_near(i, part, cars, people, rules)
            away = _whole_ticks(outside / (rules.person_step + rules.fastest)) * rules.tick_ms
        obstacle_mm = bodies.obstacle_mm(distance, rules)
        wheels = brain.wheels(s, obstacle_mm, sensed, now, rules.levels)
        if wheels != cars.wheels[i]:
            bodies.set_way(i, wheels, cars, rules)
            # It was clear for as long as it went on as before.
            cars.clear[i] = now
        elif look > 0.0 and (bodies.turns(wheels) or rules.wheel_noise > 0.0):
            cars.clear[i] = now
        if push_x != 0.0 or push_y != 0.0:
            bodies.keep_push(i, push_x, push_y, cars, rules)
            told.counts[part, tally.TOUCHING_MS] += rules.tick_ms
        if _sends(i, part, now, cars, rules, told):
            cars.order[senders] = i
            senders += 1
        _rest(i, now, away, cars, rules)
    return senders - begin


@in_kernel
def _step(i: int, part: int, seed: int, now: int, cars: Cars, rules: Rules, told: Tally) -> None:
    s, number = cars.memory[:, i], cars.number[i]
    if cars.program[i] > 0:
        image = rules.images[int(cars.program[i]) - 1]
        while brain.leader_step(s, image, now, rules.levels):
            tally.tell(told, part, s[brain.STARTED_MS], number, tally.STATE, 0, s[brain.WORD], s[brain.STATE])
        return
    if brain.follower_step(s, now, rules.levels):
        over = later_ms(s[brain.STARTED_MS], brain.length_ms(s[brain.WORD], rules.levels))
        tally.tell(told, part, over, number, tally.OVER, 0, s[brain.WORD], 0)
    if cars.heard_from[i] != NOBODY and reached(now, cars.heard_at[i]):
        _hear(i, part, seed, now, cars, rules, told)


@in_kernel
def _hear(i: int, part: int, seed: int, now: int, cars: Cars, rules: Rules, told: Tally) -> None:
    s, number, sender = cars.memory[:, i], cars.number[i], cars.heard_from[i]
    frame = channel.received(i, seed, now, cars, rules.flips)
    result = brain.follower_hears(s, frame, now, rules.levels)
    cars.heard_from[i] = NOBODY
    if result == brain.BAD_PARITY:
        tally.lose(told, part, now, number, tally.PARITY, frame, sender)
    elif result == brain.BAD_RESERVED:
        tally.lose(told, part, now, number, tally.RESERVED, frame, sender)
    elif result == brain.DEAF:
        tally.lose(told, part, now, number, tally.DEAFNESS, frame, sender)
    else:
        told.counts[part, tally.HEARD] += 1
        if frame != cars.heard[i]:
            told.counts[part, tally.UNDETECTED] += 1
        tally.tell(told, part, now, number, tally.HEARD_FRAME, 0, frame & 0xFFFFFFFE, sender)
        if result == brain.BEGUN:
            tally.tell(told, part, now, number, tally.START, 0, s[brain.WORD], 0)


@in_kernel
def _voices_until(at_ms: int, voices: Voices) -> int:
    """How many of the voices have been heard by a moment."""
    low, high = 0, voices.at_ms.shape[0]
    while low < high:
        middle = (low + high) // 2
        if voices.at_ms[middle] <= at_ms:
            low = middle + 1
        else:
            high = middle
    return low


@in_kernel
def _listen(i: int, s: Any, said: int, first: int, last: int, cars: Cars, voices: Voices) -> None:
    heard = said
    for k in range(first, last):
        dx, dy = float(cars.x[i]) - voices.x[k], float(cars.y[i]) - voices.y[k]
        if dx * dx + dy * dy <= voices.radius[k] * voices.radius[k]:
            heard = voices.word[k]
    if heard != brain.NO_VOICE:
        brain.hear_voice(s, heard)


@in_kernel
def _whole_ticks(ticks: float) -> int:
    return int(min(max(ticks, 1.0), 1000.0))


@in_kernel
def _sends(i: int, part: int, now: int, cars: Cars, rules: Rules, told: Tally) -> int:
    s = cars.memory[:, i]
    if cars.program[i] > 0:
        image = rules.images[int(cars.program[i]) - 1]
        if brain.leader_sends(s, image, now, rules.levels) == 0:
            return 0
        word = brain.sent_word(s, image)
    else:
        if brain.follower_sends(s, channel.air_is_busy(i, now, cars), now, rules.levels) == 0:
            return 0
        word = s[brain.WORD]
    tally.tell(told, part, now, cars.number[i], tally.FRAME, 0, word, 0)
    channel.begin_frame(i, to_frame(word), now, part, cars, rules, told)
    return 1


@in_kernel
def _rest(i: int, now: int, away: int, cars: Cars, rules: Rules) -> None:
    """Set when the car has to be looked at next."""
    s = cars.memory[:, i]
    wait = away
    if rules.collisions or brain.looks_mm(s, now, rules.levels):
        wait = min(wait, elapsed_ms(cars.clear[i], now))
    if cars.program[i] > 0:
        wait = min(wait, rest.leader_rest_ms(s, rules.images[int(cars.program[i]) - 1], now, rules.levels))
    else:
        busy = channel.air_is_busy(i, now, cars)
        wait = min(wait, rest.follower_rest_ms(s, busy, now, rules.levels))
        if busy and rest.follower_rest_ms(s, 0, now, rules.levels) < wait:
            # It waits for the air to be free.
            free = cars.air_until[i]
            if reached(cars.sends_until[i], free):
                free = cars.sends_until[i]
            wait = min(wait, elapsed_ms(free, now))
        if cars.heard_from[i] != NOBODY:
            wait = min(wait, elapsed_ms(cars.heard_at[i], now))
    cars.due[i] = later_ms(now, max(wait, 1))


@in_kernel
def walk(part: int, now: int, people: People) -> None:
    """Bring the people to where they are now."""
    for k in range(people.now_x.shape[1]):
        people.now_x[part, k], people.now_y[part, k] = bodies.person_at(k, now, people)


@in_kernel
def sort(world: int, begin: int, end: int, cars: Cars, cells: Cells, rules: Rules) -> None:
    """Bring a world's cars into the order of their cells."""
    grid.fit(world, begin, end, cars, cells, rules.cell)
    grid.order_by_cell(world, begin, end, cars, cells)
    for field in range(grid.fields(cars)):
        grid.gather(begin, end, field, cars)
        grid.put_back(begin, end, field, cars)
    cars.push[begin:end] = 0


def _worlds_kernel(fingerprint: str) -> Callable[..., None]:
    def run(
        first_tick: int,
        ticks: int,
        said: int,
        per_world: int,
        seeds: Ints,
        cars: Cars,
        cells: Cells,
        place: Place,
        people: People,
        voices: Voices,
        rules: Rules,
        told: Tally,
    ) -> None:
        """Worlds side by side, each stepped by one thread."""
        _ = fingerprint
        for world in numba.prange(seeds.shape[0]):
            begin, end, seed = world * per_world, (world + 1) * per_world, seeds[world]
            for tick in range(first_tick, first_tick + ticks):
                now = tick * rules.tick_ms & TICKS_MASK
                voice = said if tick == first_tick else brain.NO_VOICE
                if tick == 0:
                    switch_on(begin, end, seed, now, world, cars, rules, told)
                if tick % rules.sort_every == 0:
                    sort(world, begin, end, cars, cells, rules)
                walk(world, now, people)
                senders = think(
                    begin, end, world, world, seed, now, voice, cars, cells, place, people, voices, rules, told
                )
                rows = int(cells.frame[world, grid.ROWS])
                for k in range(begin, begin + senders):
                    channel.spread_frame(cars.order[k], world, 0, rows, now, world, cars, cells, place, rules, told)
                bodies.move(begin, end, seed, tick, cars, rules)

    return run


@in_kernel
def _share(part: int, count: int) -> tuple[int, int]:
    return count * part // MOST_PARTS, count * (part + 1) // MOST_PARTS


def _large_kernel(fingerprint: str) -> Callable[..., None]:
    def run(
        first_tick: int,
        ticks: int,
        said: int,
        per_world: int,
        seeds: Ints,
        cars: Cars,
        cells: Cells,
        place: Place,
        people: People,
        voices: Voices,
        rules: Rules,
        told: Tally,
    ) -> None:
        """One world in strips of rows of cells, several threads at work on each tick."""
        _ = fingerprint
        seed, first, frame = seeds[0], cells.first[0], cells.frame[0]
        senders, strips = cells.strips[0], cells.strips[1]
        for tick in range(first_tick, first_tick + ticks):
            now = tick * rules.tick_ms & TICKS_MASK
            voice = said if tick == first_tick else brain.NO_VOICE
            if tick == 0:
                switch_on(0, per_world, seed, now, 0, cars, rules, told)
            if tick % rules.sort_every == 0:
                grid.fit(0, 0, per_world, cars, cells, rules.cell)
                grid.order_by_cell(0, 0, per_world, cars, cells)
                for field in range(grid.fields(cars)):
                    for part in numba.prange(MOST_PARTS):
                        grid.gather(*_share(part, per_world), field, cars)
                    for part in numba.prange(MOST_PARTS):
                        grid.put_back(*_share(part, per_world), field, cars)
                cars.push[:] = 0
            rows, columns = int(frame[grid.ROWS]), int(frame[grid.COLUMNS])
            # A frame begun in one strip reaches the next one at most.
            reach = int((rules.range + 2.0 * rules.drift) * frame[grid.PER_UM]) + 2
            parts = min(max(rows // reach, 1), MOST_PARTS)
            for part in range(parts + 1):
                strips[part] = rows * part // parts
            for part in range(parts):
                walk(part, now, people)
            for part in numba.prange(parts):
                senders[part] = think(
                    first[strips[part] * columns],
                    first[strips[part + 1] * columns],
                    0,
                    part,
                    seed,
                    now,
                    voice,
                    cars,
                    cells,
                    place,
                    people,
                    voices,
                    rules,
                    told,
                )
            for part in numba.prange(parts):
                for other in range(max(part - 1, 0), min(part + 2, parts)):
                    begin = first[strips[other] * columns]
                    for k in range(begin, begin + senders[other]):
                        channel.spread_frame(
                            cars.order[k], 0, strips[part], strips[part + 1], now, part, cars, cells, place, rules, told
                        )
            for part in numba.prange(parts):
                begin, end = first[strips[part] * columns], first[strips[part + 1] * columns]
                bodies.move(begin, end, seed, tick, cars, rules)

    return run


def _leds_kernel(fingerprint: str) -> Callable[..., None]:
    def read_leds(begin: int, now: int, cars: Cars, rules: Rules, leds: Any) -> None:
        """The LED that each car of a world lights, in the order of the arrays."""
        _ = fingerprint
        for k in range(leds.shape[0]):
            leds[k] = brain.lit_led(cars.memory[:, begin + k], now, rules.levels)

    return read_leds


_SOURCES = (*(Path(str(each.__file__)) for each in (bodies, grid, channel, geometry, state, tally)), Path(__file__))
run_many = compiled.compiled(_worlds_kernel, _SOURCES, parallel=True)
run_one = compiled.compiled(_worlds_kernel, _SOURCES, parallel=False)
run_large = compiled.compiled(_large_kernel, _SOURCES, parallel=True)
read_leds = compiled.compiled(_leds_kernel, _SOURCES, parallel=False)
