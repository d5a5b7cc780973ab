"""The engine: all cars of a world, or of many worlds, by the brain's own functions.

A tick, in this order: every car's brain runs; the frames that were begun spread;
everyone moves. No car sees what another did in the same tick, so neither their
order nor the number of threads has a meaning. Positions are integers, sums of
them are exact, and every random draw is a function of (seed, car, time).
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

from motorcade.car import brain
from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.engine import bicycle, bodies, channel, clearance, geometry, state
from motorcade.engine import car_turn as turn
from motorcade.engine import cells as grid
from motorcade.engine import counters as tally
from motorcade.engine import native as compiled
from motorcade.engine.counters import Counters
from motorcade.engine.native import in_kernel
from motorcade.engine.state import MOST_PARTS, Cars, Cells, Driven, Ints, People, Place, Rules, Voices
from motorcade.words.ticks import TICKS_MASK, later_ms

ALL = -1


@in_kernel
def sort(world: int, begin: int, end: int, cars: Cars, cells: Cells, driven: Driven, rules: Rules) -> None:
    """Bring a world's cars into the order of their cells."""
    grid.fit(world, begin, end, cars, cells, rules.cell)
    grid.order_by_cell(world, begin, end, cars, cells)
    for field in range(grid.fields(cars)):
        grid.gather(begin, end, field, cars)
        grid.put_back(begin, end, field, cars)
    cars.push[begin:end] = 0
    bicycle.find(world, begin, end, cars, driven)


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
        driven: Driven,
        rules: Rules,
        told: Counters,
    ) -> None:
        """Worlds side by side, each stepped by one thread."""
        _ = fingerprint
        for world in numba.prange(seeds.shape[0]):
            begin, end, seed = world * per_world, (world + 1) * per_world, seeds[world]
            heard = turn.voices_until((first_tick - 1) * rules.tick_ms, voices)
            for tick in range(first_tick, first_tick + ticks):
                now = tick * rules.tick_ms & TICKS_MASK
                voice = said if tick == first_tick else brain.NO_VOICE
                if tick == 0:
                    turn.switch_on(begin, end, seed, now, world, cars, rules, told)
                if tick % rules.sort_every == 0:
                    sort(world, begin, end, cars, cells, driven, rules)
                bicycle.set_out(world, seed, tick, cars, driven, rules)
                first_voice = heard
                while heard < voices.at_ms.shape[0] and voices.at_ms[heard] <= now:
                    heard += 1
                senders = turn.think(
                    begin,
                    end,
                    world,
                    world,
                    seed,
                    now,
                    tick,
                    voice,
                    first_voice,
                    heard,
                    cars,
                    cells,
                    place,
                    people,
                    voices,
                    rules,
                    told,
                )
                rows = int(cells.frame[world, grid.ROWS])
                for k in range(begin, begin + senders):
                    channel.spread_frame(cars.order[k], world, 0, rows, now, world, cars, cells, place, rules, told)
                bodies.move(begin, end, seed, tick, cars, rules)
                bicycle.turn_round(world, cars, driven)

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
        driven: Driven,
        rules: Rules,
        told: Counters,
    ) -> None:
        """One world in strips of rows of cells, several threads at work on each tick."""
        _ = fingerprint
        seed, first, frame = seeds[0], cells.first[0], cells.frame[0]
        senders, strips = cells.strips[0], cells.strips[1]
        heard = turn.voices_until((first_tick - 1) * rules.tick_ms, voices)
        for tick in range(first_tick, first_tick + ticks):
            now = tick * rules.tick_ms & TICKS_MASK
            voice = said if tick == first_tick else brain.NO_VOICE
            if tick == 0:
                turn.switch_on(0, per_world, seed, now, 0, cars, rules, told)
            if tick % rules.sort_every == 0:
                grid.fit(0, 0, per_world, cars, cells, rules.cell)
                grid.order_by_cell(0, 0, per_world, cars, cells)
                for field in range(grid.fields(cars)):
                    for part in numba.prange(MOST_PARTS):
                        grid.gather(*_share(part, per_world), field, cars)
                    for part in numba.prange(MOST_PARTS):
                        grid.put_back(*_share(part, per_world), field, cars)
                cars.push[:] = 0
                bicycle.find(0, 0, per_world, cars, driven)
            bicycle.set_out(0, seed, tick, cars, driven, rules)
            rows, columns = int(frame[grid.ROWS]), int(frame[grid.COLUMNS])
            # A frame begun in one strip reaches the next one at most.
            reach = int((rules.range + 2.0 * rules.drift) * frame[grid.PER_UM]) + 2
            parts = min(max(rows // reach, 1), MOST_PARTS)
            for part in range(parts + 1):
                strips[part] = rows * part // parts
            first_voice = heard
            while heard < voices.at_ms.shape[0] and voices.at_ms[heard] <= now:
                heard += 1
            for part in numba.prange(parts):
                senders[part] = turn.think(
                    first[strips[part] * columns],
                    first[strips[part + 1] * columns],
                    0,
                    part,
                    seed,
                    now,
                    tick,
                    voice,
                    first_voice,
                    heard,
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
            bicycle.turn_round(0, cars, driven)

    return run


def _wake_kernel(fingerprint: str) -> Callable[..., None]:
    def wake(
        tick: int, put: int, per_world: int, worlds: int, cars: Cars, cells: Cells, driven: Driven, rules: Rules
    ) -> None:
        """Let every car look around in its next tick: nothing of what it knew of its surroundings may hold any more.

        The car at ``put`` sets out anew, as it was put elsewhere; with ALL every car.
        """
        _ = fingerprint
        now = tick * rules.tick_ms & TICKS_MASK
        for world in range(worlds):
            begin, end = world * per_world, (world + 1) * per_world
            for i in range(begin, end):
                if put in (ALL, i):
                    bodies.set_way(i, cars.wheels[i], cars, rules)
                cars.due[i] = now
                cars.clear[i] = clearance.due_now(tick)
            sort(world, begin, end, cars, cells, driven, rules)

    return wake


def _leds_kernel(fingerprint: str) -> Callable[..., None]:
    def read_leds(begin: int, now: int, cars: Cars, rules: Rules, leds: Any) -> None:
        """The LED that each car of a world lights, in the order of the arrays."""
        _ = fingerprint
        for k in range(leds.shape[0]):
            leds[k] = brain.lit_led(cars.memory[:, begin + k], now, rules.levels)

    return read_leds


def give_back(i: int, tick: int, cars: Cars, rules: Rules) -> None:
    """Let car ``i``'s brain have its wheels again; called between two ticks, and never compiled.

    Where they depend on what the car senses, or where its program is at the next tick, its turn in that sets them.
    """
    now = tick * rules.tick_ms & TICKS_MASK
    memory, levels = cars.memory[:, i].tolist(), tuple(rules.levels.tolist())
    wheels = brain.wheels(memory, NOTHING_IN_SIGHT_MM, 0, later_ms(now, -rules.tick_ms), levels)
    bodies.set_way(i, wheels, cars, rules)
    cars.due[i] = now
    cars.clear[i] = clearance.due_now(tick)


_ROOMS = (bicycle, bodies, grid, channel, clearance, geometry, state, tally, turn)
_SOURCES = (*(Path(str(each.__file__)) for each in _ROOMS), Path(__file__))
run_many = compiled.compiled(_worlds_kernel, _SOURCES, parallel=True)
run_one = compiled.compiled(_worlds_kernel, _SOURCES, parallel=False)
run_large = compiled.compiled(_large_kernel, _SOURCES, parallel=True)
wake = compiled.compiled(_wake_kernel, _SOURCES, parallel=False)
read_leds = compiled.compiled(_leds_kernel, _SOURCES, parallel=False)
