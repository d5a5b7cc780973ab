"""Store until which tick nothing can come near enough to a car to matter.

There are two such ticks: one for other cars, one for walls and round obstacles, which do not move. One number,
the field ``clear`` of a car, holds both, 15 bits of each. A sixteenth bit says that the tick holds however the car is
pushed and steered; without the bit it holds only while the car keeps its displacement.
"""

from motorcade.car.brain import WORD
from motorcade.engine import bodies, cells, events
from motorcade.engine.backend import in_kernel
from motorcade.engine.geometry import FAR_UM
from motorcade.engine.state import DRIVEN, Arrays, Now
from motorcade.words.positions import FLOOR_AT

# The stored ticks are 15 bits, so what is stored must be less than half of their range ahead.
MOST_TICKS = 16_000
_HALF = 0xFFFF
# The sixteenth bits of both halves.
_ANYHOW = 0x00010001
# The sign bit of a difference of two 15-bit ticks: set while the stored tick lies ahead.
_AHEAD = 0x4000
_TICKS = 0x7FFF


@in_kernel
def half(tick: int, anyhow: int) -> int:
    """One half: the 15 lowest bits of a tick, and whether (1 or 0) it holds for any displacement."""
    return (tick << 1 | anyhow) & _HALF


@in_kernel
def due_now(tick: int) -> int:
    """Both halves for a car that has to look around at ``tick``."""
    return half(tick, 0) << 16 | half(tick, 0)


@in_kernel
def with_others(clear: int, others: int) -> int:
    """``clear`` with a new half for the other cars."""
    return others << 16 | int(clear) & _HALF


@in_kernel
def with_obstacles(clear: int, obstacles: int) -> int:
    """``clear`` with a new half for obstacles."""
    return int(clear) >> 16 << 16 | obstacles


@in_kernel
def for_any_displacement(clear: int, tick: int) -> int:
    """The part of ``clear`` that still holds when the car's displacement changes in the tick before ``tick``."""
    mask = (int(clear) & _ANYHOW) * _HALF
    return int(clear) & mask | due_now(tick) & ~mask & 0xFFFFFFFF


@in_kernel
def others_due(clear: int, tick: int) -> bool:
    """Whether another car may be near by now."""
    return (tick - (int(clear) >> 17)) & _AHEAD == 0


@in_kernel
def obstacles_due(clear: int, tick: int) -> bool:
    """Whether a wall or an obstacle may be near by now."""
    return (tick - (int(clear) >> 1)) & _AHEAD == 0


@in_kernel
def is_due(clear: int, tick: int) -> bool:
    """Whether anything may be near by now."""
    return (tick - (int(clear) >> 17)) & (tick - (int(clear) >> 1)) & _AHEAD == 0


@in_kernel
def ticks_clear(clear: int, tick: int) -> int:
    """For how many ticks from this one on nothing can be near; 0 or less where something may be near by now."""
    others = (int(clear) >> 17) - tick - 1
    obstacles = (int(clear) >> 1) - tick - 1
    return min(_signed(others), _signed(obstacles)) + 1


@in_kernel
def _signed(ticks: int) -> int:
    return ((ticks + _AHEAD) & _TICKS) - _AHEAD


@in_kernel
def whole_ticks(ticks: float) -> int:
    """In how many ticks something can be new that is not new within ``ticks``: at least one, at most MOST_TICKS."""
    return int(min(max(ticks + 1.0, 1.0), float(MOST_TICKS)))


@in_kernel
def look_around(i: int, look: float, arrays: Arrays, now: Now) -> tuple[int, float, float, float]:
    """Look at what may be near a car by now, or at everything around it where its ultrasonic sensor is on.

    Args:
        i: the index of the car.
        look: how far its ultrasonic sensor sees, in µm; 0.0 where the sensor is off.
        arrays, now: the world and the tick.

    Returns:
        For how many ticks it stays so that the sensor finds something up to ``look``, or nothing, if the car keeps its
        wheels; the distance that it measures (µm); and the push of other cars and obstacles on the car, in x and y
        (µm).
    """
    cars = arrays.cars
    rules = arrays.rules
    world = now.world
    tick = now.tick
    others = others_due(cars.clear[i], tick)
    obstacles_too = obstacles_due(cars.clear[i], tick)
    if look > 0.0:
        # What is beyond the sensor's range isn't found; it measures whole mm.
        look = min(look, float(rules.ultrasonic_range_mm + 1) * 1000.0)
        others = True
        obstacles_too = True
    gap = FAR_UM
    restless_gap = FAR_UM
    obstacle_ticks = FAR_UM
    obstacle_anyhow = 0.0
    ticks = FAR_UM
    seen = FAR_UM
    distance = FAR_UM
    push_x = 0.0
    push_y = 0.0
    if others and rules.collisions:
        gap, restless_gap, push_x, push_y = bodies.others_near(i, world, now.begin, now.end, cars, arrays.cells, rules)
    if (push_x != 0.0 or push_y != 0.0) and int(cars.clear[i]) & 1 == 0:
        # A car that stands may touch a wall, which doesn't push it but holds it.
        obstacles_too = True
    if obstacles_too:
        obstacle_ticks, obstacle_anyhow, ticks, distance, push_x, push_y = bodies.obstacles_near(
            i, look, push_x, push_y, cars, arrays.obstacles, rules
        )
    is_pushed = push_x != 0.0 or push_y != 0.0
    # Who follows a line soon turns, and counts as pushed.
    pushed = int(is_pushed or (arrays.floor.shape[0] > 0 and cars.memory[WORD, i] >> FLOOR_AT & 1 != 0))
    if pushed and bodies.stands(i, cars, rules) and int(cars.clear[i]) & bodies.PUSHED == 0:
        wake_near(i, arrays, now)
    if is_pushed:
        # Cars that look after this one in this tick see that it doesn't rest.
        cars.clear[i] = for_any_displacement(cars.clear[i], tick + 1) | bodies.PUSHED
    if look > 0.0:
        ahead_ticks, seen = bodies.others_ahead(i, world, look, cars, arrays.cells, rules)
        if seen <= look < distance:
            ticks = ahead_ticks
        elif seen <= look:
            ticks = max(ticks, ahead_ticks)
        elif distance > look:
            ticks = min(ticks, ahead_ticks)
    _, _, own = bodies.displacement_of(i, cars, rules)
    # What holds for the fastest car, holds for any displacement.
    anyhow = pushed | (own > rules.fastest - 1.0)
    if others:
        free = (gap - bodies.ROUNDED_UM) / (2.0 * rules.fastest)
        if pushed == 0:
            if anyhow:
                own = rules.fastest
            closing = own + rules.fastest
            free = (restless_gap - bodies.ROUNDED_UM) / closing
            if own > 0.0 and gap < restless_gap:
                # When one of those that rest sets out, this car is still near enough to be woken, or it looks soon.
                soon = bodies.REST_UM / closing - 1.0
                free = min(free, (gap - bodies.ROUNDED_UM) / own, soon)
        cars.clear[i] = with_others(cars.clear[i], half(tick + whole_ticks(free), anyhow))
    if obstacles_too:
        anyhow = pushed | bodies.slips(cars.wheels[i], rules)
        until = half(tick + whole_ticks(obstacle_anyhow if anyhow else obstacle_ticks), anyhow)
        cars.clear[i] = with_obstacles(cars.clear[i], until)
    return whole_ticks(ticks), min(distance, seen), push_x, push_y


@in_kernel
def wake_near(i: int, arrays: Arrays, now: Now) -> None:
    """Let the cars that count on it that car ``i`` stands look for others in the next tick, because it sets out."""
    cars = arrays.cars
    rules = arrays.rules
    if rules.collisions == 0:
        return
    x, y, near, first = (
        float(cars.x[i]),
        float(cars.y[i]),
        rules.contact + bodies.REST_UM,
        arrays.cells.first[now.world],
    )
    left, right, bottom, top, columns = cells.cells_around(x, y, near + rules.drift, arrays.cells.frame[now.world])
    for row in range(bottom, top + 1):
        low = first[row * columns + left]
        high = first[row * columns + right + 1]
        for j in range(max(low, now.begin), min(high, now.end)):
            dx = float(cars.x[j]) - x
            dy = float(cars.y[j]) - y
            if dx * dx + dy * dy < near * near and not others_due(cars.clear[j], now.tick + 1):
                cars.clear[j] = with_others(cars.clear[j], half(now.tick + 1, 0))
                cells.disturb(j, arrays, now)


@in_kernel
def set_wheels(i: int, wheels: int, arrays: Arrays, now: Now) -> bool:
    """Set the wheels of car ``i`` unless somebody drives it; return whether they are others than before."""
    cars = arrays.cars
    rules = arrays.rules
    if wheels == cars.wheels[i] or cars.wheels[i] == DRIVEN:
        return False
    stood = bodies.stands(i, cars, rules)
    bodies.set_displacement(i, wheels, cars, rules)
    if stood and not bodies.stands(i, cars, rules):
        wake_near(i, arrays, now)
    cars.clear[i] = for_any_displacement(cars.clear[i], now.tick)
    return True


@in_kernel
def is_stuck(i: int, tick: int, arrays: Arrays) -> bool:
    """Whether what car ``i`` of the only world touches takes more than three quarters of its displacement in this tick.

    It looks only where something may be near: elsewhere nothing pushes the car.
    """
    cars = arrays.cars
    rules = arrays.rules
    push_x = 0.0
    push_y = 0.0
    if rules.collisions and others_due(cars.clear[i], tick):
        _, _, push_x, push_y = bodies.others_near(i, 0, 0, 0, cars, arrays.cells, rules)
    if obstacles_due(cars.clear[i], tick) or push_x != 0.0 or push_y != 0.0:
        _, _, _, _, push_x, push_y = bodies.obstacles_near(i, 0.0, push_x, push_y, cars, arrays.obstacles, rules)
    if push_x == 0.0 and push_y == 0.0:
        return False
    whole_x, whole_y = bodies.whole_push(i, push_x, push_y, cars, rules)
    displacement_x, displacement_y, _ = bodies.displacement_of(i, cars, rules)
    along = displacement_x * (displacement_x + whole_x) + displacement_y * (displacement_y + whole_y)
    return 4.0 * along < displacement_x * displacement_x + displacement_y * displacement_y


@in_kernel
def push(i: int, push_x: float, push_y: float, arrays: Arrays, now: Now) -> None:
    """Store a push until the cars move, and count the time in which the car touches something."""
    if push_x != 0.0 or push_y != 0.0:
        bodies.set_push(i, push_x, push_y, arrays.cars, arrays.rules)
        arrays.counters.counts[now.part, events.TOUCHING_MS] += arrays.rules.tick_ms
