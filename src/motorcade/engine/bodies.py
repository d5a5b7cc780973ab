"""Contacts between bodies, what the sensors measure of bodies and people, and how cars move.

**Contact.** Two bodies that overlap push each other apart along the line between their centres, each by half of the
overlap; walls and obstacles push by all of it. The push of every car is computed from where the others are now, then
all pushes are applied at once, never further than the fastest car drives in a tick (the Jacobi variant of
position-based dynamics, Müller et al. 2007). So a car can enter a wall or another body by up to the distance that it
drives in one tick, and by more where a queue of cars presses it.

**Ultrasonic.** The sensor measures the distance from the front of the body to the nearest surface that touches the
cone. **PIR.** The sensor finds a person whose place is within range and sector.
"""

import math

from motorcade.car.board import NOTHING_IN_SIGHT_MM
from motorcade.car.brain import LEFT, RIGHT
from motorcade.engine.backend import in_kernel
from motorcade.engine.cells import cell_of, cells_around
from motorcade.engine.geometry import FAR_UM, FULL_TURN, ahead_of, disc_to_cone, mix, segment_in_cone
from motorcade.engine.state import DRIVEN, CarArrays, Cells, Obstacles, People, Rules
from motorcade.mats.plane import nearest_of_segment

# The displacement of a car is how far it moves in a tick, in x and y, in units of 2^-DISPLACEMENT_BITS µm.
DISPLACEMENT_BITS = 12
_PARTS = (1 << DISPLACEMENT_BITS) - 1
# Cars move by so many ticks at once, so that sums fit into 32 bits and several cars into an instruction.
MOST_TICKS = _PARTS
# How often wheel noise is drawn.
NOISE_MS = 100
# How much farther than necessary a car looks, so that it need not look again soon.
LOOK_BEYOND_UM = 100_000.0
# A car counts on being woken by those that stand so near to touching it.
REST_UM = 100_000.0
# The bit of CarArrays.clear that says that a car was pushed when it last looked for others.
PUSHED = 1 << 16
# Places and displacements are rounded to µm: bodies are at most this much nearer to each other than these say.
ROUNDED_UM = 4.0
# What a car's cone must not reach is kept this far from its tip, since places are rounded to whole µm.
_BEHIND_UM = 1_000.0
# In a narrower cone that is too little.
_NARROW = 0.005
# CarArrays.push holds each coordinate of a push as int16.
_MOST_PUSH_UM = 32_000.0


@in_kernel
def displacement_of(i: int, cars: CarArrays, rules: Rules) -> tuple[float, float, float]:
    """The displacement of car ``i`` in x and y, and its greatest possible length, all in µm a tick."""
    displacement_x = float(cars.displacement_x[i]) / (1 << DISPLACEMENT_BITS)
    displacement_y = float(cars.displacement_y[i]) / (1 << DISPLACEMENT_BITS)
    if slips(cars.wheels[i], rules):
        return displacement_x, displacement_y, rules.fastest
    return displacement_x, displacement_y, math.sqrt(displacement_x * displacement_x + displacement_y * displacement_y)


@in_kernel
def slips(wheels: int, rules: Rules) -> bool:
    """Whether nobody knows how wheels move a car in the next tick; those that stand at once are known to stand."""
    return rules.wheel_noise > 0.0 and (wheels & 3 > 0 or rules.coast > 0.0)


@in_kernel
def spin_of(i: int, cars: CarArrays, rules: Rules) -> float:
    """By how much the heading of car ``i`` changes in a tick with its wheels, in rad; FAR_UM: nobody knows."""
    if slips(cars.wheels[i], rules):
        return FAR_UM
    return abs(float(rules.turns[cars.wheels[i]])) / FULL_TURN * math.tau


@in_kernel
def stands(i: int, cars: CarArrays, rules: Rules) -> bool:
    """Whether car ``i`` keeps its place until it gets another displacement or something pushes it."""
    return cars.displacement_x[i] == 0 and cars.displacement_y[i] == 0 and rules.wheel_noise == 0.0


@in_kernel
def others_near(
    i: int, world: int, begin: int, end: int, cars: CarArrays, cells: Cells, rules: Rules
) -> tuple[float, float, float, float]:
    """Look at the cars that touch car ``i`` of a world, or may touch it soon.

    A car rests where it is in the part from ``begin`` to ``end``, stands, was not pushed when it last looked, and is
    within REST_UM of touching: before it moves it wakes car ``i`` (`motorcade.engine.clearance.wake_near`).

    Returns:
        How far away the nearest is, at least (µm), and the nearest that doesn't rest; and the push, in x and y, of all
        cars that touch it.
    """
    x = float(cars.x[i])
    y = float(cars.y[i])
    near = rules.contact + rules.beyond
    touch = rules.contact * rules.contact
    far = FAR_UM * FAR_UM
    rest = (rules.contact + REST_UM) * (rules.contact + REST_UM) if rules.wheel_noise == 0.0 else 0.0
    first = cells.first[world]
    left, right, bottom, top, columns = cells_around(x, y, near + rules.drift, cells.frame[world])
    # The nearest alone say for how long none can touch: no root, no division and no branch for each car.
    nearest = near * near
    restless = near * near
    for row in range(bottom, top + 1):
        low = first[row * columns + left]
        high = first[row * columns + right + 1]
        may_rest = rest if (low >= begin) & (high <= end) else 0.0
        for j in range(low, high):
            dx = float(cars.x[j]) - x
            dy = float(cars.y[j]) - y
            squared = dx * dx + dy * dy if j != i else far
            moves = int(cars.displacement_x[j]) | int(cars.displacement_y[j]) | int(cars.clear[j]) & PUSHED
            nearest = min(nearest, squared)
            restless = min(restless, far if (moves == 0) & (squared < may_rest) else squared)
    push_x = 0.0
    push_y = 0.0
    if nearest < touch:
        for row in range(bottom, top + 1):
            for j in range(first[row * columns + left], first[row * columns + right + 1]):
                dx = float(cars.x[j]) - x
                dy = float(cars.y[j]) - y
                squared = dx * dx + dy * dy
                if squared < touch and j != i:
                    distance = math.sqrt(squared)
                    overlap = rules.contact - distance
                    if distance == 0.0:
                        # Two cars at the same point are pushed apart along x, in the order of their numbers.
                        distance = 1.0
                        dx = 1.0 if cars.number[i] < cars.number[j] else -1.0
                    push_x -= math.floor(dx * overlap / (2.0 * distance) + 0.5)
                    push_y -= math.floor(dy * overlap / (2.0 * distance) + 0.5)
    return math.sqrt(nearest) - rules.contact, math.sqrt(restless) - rules.contact, push_x, push_y


@in_kernel
def others_ahead(i: int, world: int, look: float, cars: CarArrays, cells: Cells, rules: Rules) -> tuple[float, float]:
    """Look at the cars that the ultrasonic sensor of car ``i``, which sees ``look`` µm far, measures or may soon.

    Returns:
        For how many ticks it stays so that the sensor finds a car, or that it finds none, if this car keeps its wheels;
        and the distance from its front to the nearest car in the cone, within ``look`` or little beyond (FAR_UM: none).
    """
    x = float(cars.x[i])
    y = float(cars.y[i])
    ahead_x, ahead_y = ahead_of(cars.heading[i], rules.cosines)
    near = rules.contact + look + LOOK_BEYOND_UM
    far = near * near
    _, _, own = displacement_of(i, cars, rules)
    gap = LOOK_BEYOND_UM
    obstacle = FAR_UM
    nearest = far
    first = cells.first[world]
    left, right, bottom, top, columns = cells_around(x, y, near + rules.drift, cells.frame[world])
    for row in range(bottom, top + 1):
        # Without branches, several cars at an instruction.
        for j in range(first[row * columns + left], first[row * columns + right + 1]):
            dx = float(cars.x[j]) - x
            dy = float(cars.y[j]) - y
            squared = dx * dx + dy * dy if j != i else far
            nearest = min(nearest, squared)
            ahead = dx * ahead_x + dy * ahead_y - rules.radius
            aside = dy * ahead_x - dx * ahead_y
            away, beside = disc_to_cone(ahead, aside, rules.radius, rules.cone_cos, rules.cone_sin)
            gap = min(gap, max(away - look, beside) if squared < far else FAR_UM)
            obstacle = min(obstacle, max(away, 0.0) if (squared < far) & (beside <= 0.0) else FAR_UM)
    way = own + rules.fastest
    spin = spin_of(i, cars, rules)
    if gap < 0.0:
        # Whatever comes besides, it is seen until it has left the cone or the range.
        return (-gap - ROUNDED_UM) / (way + (rules.contact + look) * spin), obstacle
    if spin > 0.0:
        gap = math.sqrt(nearest) - rules.contact - look
    return (gap - ROUNDED_UM) / way, obstacle


@in_kernel
def obstacles_near(
    i: int, look: float, push_x: float, push_y: float, cars: CarArrays, obstacles: Obstacles, rules: Rules
) -> tuple[float, float, float, float, float, float]:
    """Look at walls and obstacles around car ``i``, which other cars push by ``push_x`` and ``push_y``.

    However many cars push, they never push a car into a wall that it touches. In a corner only the walls push it.

    Returns:
        For how many ticks nothing can touch this car if it keeps its displacement; for how many whatever that is; for
        how many its sensor sees nothing else if it keeps its wheels; the distance that the sensor measures up to
        ``look`` (FAR_UM: nothing in the cone); and the push, in x and y, of everything that touches it.
    """
    displacement_x, displacement_y, own = displacement_of(i, cars, rules)
    around = rules.radius + look
    near = around + LOOK_BEYOND_UM
    # To a car that stands nothing here changes.
    ticks = (LOOK_BEYOND_UM - ROUNDED_UM) / own if own > 0.0 else FAR_UM
    obstacle = FAR_UM
    away_x = 0.0
    away_y = 0.0
    sees = ticks
    stays = 0.0
    spin = spin_of(i, cars, rules)
    touched = 0
    pressed = 0
    along_x = push_x
    along_y = push_y
    gap = LOOK_BEYOND_UM
    x = float(cars.x[i])
    y = float(cars.y[i])
    cell = cell_of(x, y, obstacles.frame)
    segments = obstacles.segments.shape[0]
    for k in range(obstacles.first[cell], obstacles.first[cell + 1]):
        if obstacles.away[k] >= near:
            break
        item = obstacles.items[k]
        thick = 0.0
        if item < segments:
            wall = obstacles.segments[item]
            near_x, near_y = nearest_of_segment(x, y, wall[0], wall[1], wall[2], wall[3])
            dx = near_x - x
            dy = near_y - y
        else:
            disc = obstacles.discs[item - segments]
            dx = disc[0] - x
            dy = disc[1] - y
            thick = disc[2]
        squared = dx * dx + dy * dy
        if squared >= (near + thick) * (near + thick):
            continue
        distance = math.sqrt(squared)
        surface = distance - thick
        if own > 0.0:
            # On a straight line the speed of approach never grows; with wheel noise no line is straight.
            along = displacement_x * dx + displacement_y * dy
            closing = own if rules.wheel_noise > 0.0 else along / max(distance, 1.0)
            ticks = min(ticks, (surface - rules.radius - ROUNDED_UM) / max(closing, 1.0))
        gap = min(gap, surface - rules.radius)
        if look > 0.0:
            if own > 0.0 or spin > 0.0:
                free = surface - rules.radius
                if rules.cone_sin > _NARROW and spin == 0.0:
                    # What is beside the cone of a car that drives straight on never comes into it.
                    free, _, _ = _obstacle_in_cone(i, item, _BEHIND_UM, look, cars, obstacles, rules)
                    free -= _BEHIND_UM
                sees = min(sees, (free - look - ROUNDED_UM) / max(own, 1.0))
            if surface < look + rules.radius:
                seen, depth, reach = _obstacle_in_cone(i, item, 0.0, look, cars, obstacles, rules)
                obstacle = min(obstacle, seen)
                if seen <= look:
                    stays = max(stays, (depth - ROUNDED_UM) / max(own + (reach + rules.radius) * spin, 1.0))
        if surface < rules.radius and distance > 0.0 and rules.collisions:
            share = (rules.radius - surface) / distance
            away_x -= math.floor(dx * share + 0.5)
            away_y -= math.floor(dy * share + 0.5)
            touched += 1
            into = (push_x * dx + push_y * dy) / squared
            if into > 0.0:
                pressed = 1
                along_x = push_x - into * dx
                along_y = push_y - into * dy
    if pressed:
        push_x, push_y = (along_x, along_y) if touched == 1 else (0.0, 0.0)
    push_x, push_y = math.floor(push_x + 0.5) + away_x, math.floor(push_y + 0.5) + away_y
    if obstacle <= look:
        sees = stays
    return ticks, (gap - ROUNDED_UM) / rules.fastest, sees, obstacle, push_x, push_y


@in_kernel
def _obstacle_in_cone(
    i: int, item: int, back: float, look: float, cars: CarArrays, obstacles: Obstacles, rules: Rules
) -> tuple[float, float, float]:
    """Look at a wall or an obstacle in the cone of a sensor that is ``back`` µm behind a car's own.

    Returns:
        Its distance, FAR_UM where it isn't in the cone; how deep a place of it is in what the sensor sees up to
        ``look``; and how far that place, or the far side of an obstacle, is from the sensor at most.
    """
    ahead_x, ahead_y = ahead_of(cars.heading[i], rules.cosines)
    front_x = float(cars.x[i]) + (rules.radius - back) * ahead_x
    front_y = float(cars.y[i]) + (rules.radius - back) * ahead_y
    segments = obstacles.segments.shape[0]
    thick = 0.0
    if item >= segments:
        disc = obstacles.discs[item - segments]
        dx = disc[0] - front_x
        dy = disc[1] - front_y
        thick = disc[2]
        ahead = dx * ahead_x + dy * ahead_y
        aside = dy * ahead_x - dx * ahead_y
        away, beside = disc_to_cone(ahead, aside, thick, rules.cone_cos, rules.cone_sin)
        distance = max(away, 0.0) if beside <= 0.0 else FAR_UM
    else:
        wall = obstacles.segments[item]
        ahead_0 = (wall[0] - front_x) * ahead_x + (wall[1] - front_y) * ahead_y
        aside_0 = (wall[1] - front_y) * ahead_x - (wall[0] - front_x) * ahead_y
        ahead_1 = (wall[2] - front_x) * ahead_x + (wall[3] - front_y) * ahead_y
        aside_1 = (wall[3] - front_y) * ahead_x - (wall[2] - front_x) * ahead_y
        distance = segment_in_cone(ahead_0, aside_0, ahead_1, aside_1, rules.cone_cos, rules.cone_sin)
        # The nearest place is often at the edge of the cone.
        ahead, aside = nearest_of_segment(distance, 0.0, ahead_0, aside_0, ahead_1, aside_1)
        away, beside = disc_to_cone(ahead, aside, 0.0, rules.cone_cos, rules.cone_sin)
    return distance, -max(away - look, beside), away + thick


@in_kernel
def obstacle_mm(distance: float, rules: Rules) -> int:
    """The reading of the ultrasonic sensor for a distance in µm."""
    if distance >= FAR_UM:
        return NOTHING_IN_SIGHT_MM
    whole = int(distance) // 1000
    return whole if whole <= rules.ultrasonic_range_mm else NOTHING_IN_SIGHT_MM


@in_kernel
def set_push(i: int, push_x: float, push_y: float, cars: CarArrays, rules: Rules) -> None:
    """Store how contacts push car ``i``, until it moves."""
    whole_x, whole_y = whole_push(i, push_x, push_y, cars, rules)
    cars.push[i] = (whole_x & 0xFFFF) << 16 | (whole_y & 0xFFFF)


@in_kernel
def whole_push(i: int, push_x: float, push_y: float, cars: CarArrays, rules: Rules) -> tuple[int, int]:
    """The push in whole µm, limited so that the car goes no further than the fastest car drives."""
    displacement_x, displacement_y, _ = displacement_of(i, cars, rules)
    sum_x = displacement_x + push_x
    sum_y = displacement_y + push_y
    length = math.sqrt(sum_x * sum_x + sum_y * sum_y)
    if length > rules.fastest:
        push_x = sum_x * rules.fastest / length - displacement_x
        push_y = sum_y * rules.fastest / length - displacement_y
    return int(min(max(push_x, -_MOST_PUSH_UM), _MOST_PUSH_UM)), int(min(max(push_y, -_MOST_PUSH_UM), _MOST_PUSH_UM))


@in_kernel
def person_at(k: int, now: int, people: People) -> tuple[float, float]:
    """The place of person ``k``: on the straight line between two points of the path."""
    first = people.first[k]
    last = people.first[k + 1] - 1
    at = now
    if people.repeats[k] and people.at_ms[last] > 0:
        at = now % people.at_ms[last]
    point = first
    while point < last and people.at_ms[point + 1] <= at:
        point += 1
    if point == last:
        return people.x[last], people.y[last]
    part = float(at - people.at_ms[point]) / float(people.at_ms[point + 1] - people.at_ms[point])
    x = people.x[point] + part * (people.x[point + 1] - people.x[point])
    y = people.y[point] + part * (people.y[point + 1] - people.y[point])
    return math.floor(x + 0.5), math.floor(y + 0.5)


@in_kernel
def person_near(i: int, part: int, now: int, cars: CarArrays, people: People, rules: Rules) -> tuple[int, float]:
    """Whether car ``i`` senses a person, and for how many ticks that stays so if it keeps its wheels."""
    if people.walked_ms[part] != now:
        people.walked_ms[part] = now
        for k in range(people.now_x.shape[1]):
            people.now_x[part, k], people.now_y[part, k] = person_at(k, now, people)
    x = float(cars.x[i])
    y = float(cars.y[i])
    ahead_x, ahead_y = ahead_of(cars.heading[i], rules.cosines)
    reach = rules.pir_range * rules.pir_range
    ticks = FAR_UM
    sensed = 0
    walk = rules.person_step + rules.fastest
    spin = spin_of(i, cars, rules)
    for k in range(people.now_x.shape[1]):
        dx = people.now_x[part, k] - x
        dy = people.now_y[part, k] - y
        squared = dx * dx + dy * dy
        distance = math.sqrt(squared)
        ticks = min(ticks, (abs(distance - rules.pir_range) - ROUNDED_UM) / walk)
        if squared <= reach:
            inside = dx * ahead_x + dy * ahead_y - rules.pir_cos * distance
            sensed |= inside >= 0.0
            # For each µm that somebody moves this changes by 2 µm at most. What is rounded are cosines, too.
            ticks = min(ticks, (abs(inside) - 8.0 * ROUNDED_UM) / (2.0 * walk + spin * distance))
    return sensed, ticks


@in_kernel
def turns(wheels: int) -> bool:
    """Whether wheels turn the car on the spot."""
    return (wheels >> 2 == LEFT or wheels >> 2 == RIGHT) and wheels & 3 > 0


@in_kernel
def set_displacement(i: int, wheels: int, cars: CarArrays, rules: Rules) -> None:
    """Set the wheels of car ``i`` and its displacement: straight along the heading, or none when it turns.

    Where cars roll on, the displacement stays until they move: `_slip` sets it, and slows down those that stand.
    """
    cars.wheels[i] = wheels
    if rules.coast > 0.0:
        return
    length = 0.0
    if not turns(wheels):
        length = rules.speeds[wheels & 3]
    _set_displacement_along(i, length, cars, rules)


@in_kernel
def _set_displacement_along(i: int, length: float, cars: CarArrays, rules: Rules) -> None:
    length = length * (1 << DISPLACEMENT_BITS)
    ahead_x, ahead_y = ahead_of(cars.heading[i], rules.cosines)
    cars.displacement_x[i] = math.floor(length * ahead_x + 0.5)
    cars.displacement_y[i] = math.floor(length * ahead_y + 0.5)


@in_kernel
def _slip(i: int, seed: int, now: int, cars: CarArrays, rules: Rules) -> None:
    """Apply wheel noise: the speed of each wheel is off by a normally distributed share, drawn every NOISE_MS.

    With wheel speeds l and r, the car drives (l + r) / 2 and turns by (r - l) / wheel base. A car whose wheels differ
    by themselves turns while it drives on, and one that is told to stand rolls on.
    """
    wheels = int(cars.wheels[i])
    speed = rules.speeds[wheels & 3]
    if speed == 0.0:
        if rules.coast > 0.0 and wheels != DRIVEN:
            cars.displacement_x[i] = int(float(cars.displacement_x[i]) * rules.coast)
            cars.displacement_y[i] = int(float(cars.displacement_y[i]) * rules.coast)
        return
    bits = mix(seed, cars.number[i], now // NOISE_MS)
    left = 1.0 + rules.wheel_noise * rules.normals[bits & 1023]
    right = 1.0 + rules.wheel_noise * rules.normals[bits >> 10 & 1023]
    if turns(wheels):
        # When a car turns on the spot, one wheel goes back as fast as the other goes forward.
        speed = 0.0
    spin = float(rules.turns[wheels]) / rules.wheel_turn / 2.0
    left, right = left * (speed - spin), right * (speed + spin)
    turned = math.floor((right - left) * rules.wheel_turn + 0.5)
    cars.heading[i] = (int(cars.heading[i]) + turned) & 0xFFFFFFFF
    _set_displacement_along(i, (left + right) / 2.0, cars, rules)


@in_kernel
def move(begin: int, end: int, seed: int, tick: int, ticks: int, cars: CarArrays, rules: Rules) -> None:
    """Move the cars between two indices by a tick, or by as many, at most MOST_TICKS, as nothing happens to them.

    A displacement has a finer resolution than 1 µm. Its whole µm are spread over the ticks, so that a car is within
    1 µm of its exact place after any number of ticks.
    """
    if rules.wheel_noise > 0.0:
        for i in range(begin, end):
            _slip(i, seed, tick * rules.tick_ms, cars, rules)
            push = int(cars.push[i])
            if push != 0:
                # No car goes further than the fastest one drives: others count on it.
                set_push(i, float(_signed(push >> 16)), float(_signed(push & 0xFFFF)), cars, rules)
    phase, ticks = tick & _PARTS, ticks & _PARTS
    for i in range(begin, end):
        push = int(cars.push[i])
        cars.x[i] = cars.x[i] + _whole_um(int(cars.displacement_x[i]), phase, ticks) + _signed(push >> 16)
        cars.y[i] = cars.y[i] + _whole_um(int(cars.displacement_y[i]), phase, ticks) + _signed(push & 0xFFFF)
        cars.push[i] = 0
    if rules.wheel_noise == 0.0:
        for i in range(begin, end):
            cars.heading[i] = (int(cars.heading[i]) + rules.turns[cars.wheels[i]] * ticks) & 0xFFFFFFFF


@in_kernel
def _whole_um(displacement: int, phase: int, ticks: int) -> int:
    """The whole µm of some ticks, of which the first is ``phase`` ticks after all of its parts made whole ones."""
    part = displacement & _PARTS
    parts = (part * (phase + ticks) >> DISPLACEMENT_BITS) - (part * phase >> DISPLACEMENT_BITS)
    return (displacement >> DISPLACEMENT_BITS) * ticks + parts


@in_kernel
def _signed(bits: int) -> int:
    return (bits ^ 0x8000) - 0x8000
