"""Let cars rest in groups, so that what nothing happens to costs nothing.

Cars that stand one after the other in the arrays are a group (`motorcade.engine.cells.GROUP`); where cars are sorted by
cells they are near each other. For each group is known before which tick none of its cars has a turn or looks around,
and whether any of them moves. A tick leaves out groups that rest, and groups that stand while cars move. Where all
groups of a world rest, it goes to the next tick in which anything is due at once: in between its cars only move on, by
a product of integers.

What shortens the rest of a car between its turns is a frame that reaches it or a neighbour that sets out; both call
`motorcade.engine.cells.disturb`. What is known of groups lasts for one call of the kernels, and until cars are sorted.
"""

from motorcade.car import brain
from motorcade.engine import bicycle, bodies, cells, clearance
from motorcade.engine.backend import in_kernel
from motorcade.engine.cells import GROUP
from motorcade.engine.state import Arrays, Now
from motorcade.words.ticks import TICKS_MASK, reached

ALL = -1
RESTORED = -2
# Where more than one in so many cars of a group is due in a tick, the group is busy.
_BUSY = 16
_HALF_CLOCK = (TICKS_MASK + 1) // 2


@in_kernel
def list_due(low: int, arrays: Arrays, now: Now) -> tuple[int, int, int]:
    """List cars from ``low`` on that have a turn, and others that look around, as many as there is room for.

    They are listed before anything is done, because a processor can't foresee which of them are due.

    Returns:
        Up to which car they are listed, and how many of either.
    """
    cars = arrays.cars
    rules = arrays.rules
    around = arrays.around
    share = now.share
    turns = 0
    looks = 0
    listed = 0
    room = around.looks.shape[1]
    loud = is_loud(now)
    # The displacement of a driven car changes without a turn.
    all_awake = loud or arrays.driven.shape[1] > 0
    while low < now.end and (listed == 0 or listed + GROUP <= room):
        group = (low - now.begin) // GROUP
        high = min(low + GROUP, now.end)
        before = turns + looks
        if all_awake or around.wakes[share, group] <= now.tick:
            # Several cars at an instruction; none of those that have had their turn in this tick is listed here.
            for i in range(low, high):
                has_turn = loud | (reached(now.ms, cars.due[i]) > 0)
                looks_around = (not has_turn) & clearance.is_due(cars.clear[i], now.tick) & (rules.collisions > 0)
                cars.order[i] = 2 * looks_around + has_turn
            for i in range(low, high):
                around.car[share, turns] = i
                around.looks[share, looks] = i
                turns += cars.order[i] & 1
                looks += cars.order[i] >> 1
            listed += high - low
            # A busy group hardly ever rests in the next tick; one of a few cars does after a turn of one of them.
            is_busy = (turns + looks - before) * _BUSY > max(high - low, _BUSY)
            around.wakes[share, group] = now.tick + 1 if is_busy else 0
            around.moves[share, group] = 1
        low = high
    return low, turns, looks


@in_kernel
def is_loud(now: Now) -> bool:
    """Whether anything is said in this tick."""
    return now.said != brain.NO_VOICE or now.first_voice < now.last_voice


@in_kernel
def settle(arrays: Arrays, now: Now) -> int:
    """Find out for how long groups rest, after the turns of a tick; return the next tick in which any car is due."""
    around = arrays.around
    share = now.share
    next_tick = now.tick + bodies.MOST_TICKS
    moves = 0
    for low in range(now.begin, now.end, GROUP):
        group = (low - now.begin) // GROUP
        if around.wakes[share, group] <= now.tick:
            _settle_group(low, group, arrays, now)
        next_tick = min(next_tick, around.wakes[share, group])
        moves |= around.moves[share, group]
    if arrays.rules.wheel_noise > 0.0 and moves:
        # It turns what moves in every tick.
        return now.tick + 1
    return next_tick


@in_kernel
def _settle_group(low: int, group: int, arrays: Arrays, now: Now) -> None:
    """Store when a group wakes up, at the next tick or later, and whether it moves."""
    cars = arrays.cars
    rules = arrays.rules
    around = arrays.around
    share = now.share
    next_tick = now.tick + 1
    next_ms = next_tick * rules.tick_ms
    clear = bodies.MOST_TICKS
    moves = 0
    rest_ms = clear * rules.tick_ms
    # Several cars at an instruction.
    for i in range(low, min(low + GROUP, now.end)):
        rest_ms = min(rest_ms, ((int(cars.due[i]) - next_ms + _HALF_CLOCK) & TICKS_MASK) - _HALF_CLOCK)
        clear = min(clear, clearance.ticks_clear(cars.clear[i], next_tick))
        moves |= int(cars.displacement_x[i]) | int(cars.displacement_y[i]) | int(cars.push[i]) | int(cars.wheels[i]) & 3
    if rules.collisions == 0:
        clear = bodies.MOST_TICKS
    # A division takes as long as a car.
    if rest_ms > 0 and clear > 0:
        next_tick += min((rest_ms + rules.tick_ms - 1) // rules.tick_ms, clear)
    around.wakes[share, group] = next_tick
    around.moves[share, group] = moves != 0


@in_kernel
def move(ticks: int, arrays: Arrays, now: Now) -> None:
    """Move the cars of groups that move by some ticks, in which nothing else happens to them."""
    moves = arrays.around.moves
    share = now.share
    low = now.begin
    while low < now.end:
        high = low
        while high < now.end and moves[share, (high - now.begin) // GROUP]:
            high = min(high + GROUP, now.end)
        if high > low:
            bodies.move(low, high, now.seed, now.tick, ticks, arrays.cars, arrays.rules)
        low = high + GROUP


@in_kernel
def sort(world: int, begin: int, end: int, share: int, arrays: Arrays) -> None:
    """Sort the cars of a world by their cells, and let none rest where this changes their order."""
    cars = arrays.cars
    cells.fit(world, begin, end, cars, arrays.cells, arrays.rules.cell)
    cells.order_by_cell(world, begin, end, cars, arrays.cells)
    if not cells.is_in_order(begin, end, cars):
        for field in range(cells.fields(cars)):
            cells.gather(begin, end, field, cars.push, cars)
            cells.put_back(begin, end, field, cars.push, cars)
        cells.wake_all(begin, end, share, arrays)
    cells.clear_push(begin, end, cars)
    bicycle.find(world, begin, end, cars, arrays.driven)


def wake(tick: int, moved: int, worlds: int, arrays: Arrays) -> None:
    """Make every car look around in its next tick, because its surroundings have changed.

    The car at index ``moved`` also gets the displacement of its new heading. With ALL every car gets its own, but
    none does where wheels have noise. With RESTORED, after a saved world was loaded, none does, and a car keeps the
    time of its next turn.
    """
    cars = arrays.cars
    rules = arrays.rules
    now = tick * rules.tick_ms & TICKS_MASK
    per_world = cars.x.shape[0] // worlds
    for world in range(worlds):
        begin = world * per_world
        end = (world + 1) * per_world
        for i in range(begin, end):
            if moved == i or (moved == ALL and rules.wheel_noise == 0.0):
                bodies.set_displacement(i, cars.wheels[i], cars, rules)
            if moved != RESTORED:
                cars.due[i] = now
            cars.clear[i] = clearance.due_now(tick)
        sort(world, begin, end, 0, arrays)
