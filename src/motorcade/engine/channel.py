"""Infrared between cars, frame by frame, and voices.

A frame reaches every car that is within range, within the sender's beam and in its line of sight when the frame begins.
Walls, obstacles and the bodies of other cars block the line of sight. The frame occupies the air at the receiver for
its air time.

**Half duplex.** A car that sends during any part of a frame doesn't receive it.

**Collision.** Where two frames overlap at a receiver, both are lost. With a capture ratio, a frame is received if its
power there is at least that many times the power of the loudest other one. Power falls with the square of the distance.
"The loudest" is the loudest since the air there was last free, as with the gain control of a receiver.

**Bit errors.** Each bit flips with the same probability on its way to one receiver. Parity detects every odd number of
flips and no even number.
"""

import math
from typing import Literal, get_args

from motorcade.car import frames
from motorcade.engine import events
from motorcade.engine.backend import in_kernel
from motorcade.engine.cells import cell_of, cells_around, cells_between, disturb
from motorcade.engine.geometry import FAR_UM, ahead_of, cross, is_shaded, mix
from motorcade.engine.state import NOBODY, SPARE, Around, Arrays, CarArrays, Floats, Now, Obstacles, Rules, Voices
from motorcade.words.ticks import elapsed_ms, later_ms, reached

Reach = Literal["reaches", "too-far", "outside-beam", "hidden"]
REACHES: tuple[Reach, ...] = get_args(Reach)
# Indices into REACHES.
IN_REACH, TOO_FAR, OUTSIDE_BEAM, HIDDEN = range(4)


@in_kernel
def air_is_busy(i: int, now: int, cars: CarArrays) -> int:
    """1 while a frame of another car, or its own, is on the air around car ``i``."""
    return 1 - reached(now, cars.air_until[i]) * reached(now, cars.sends_until[i])


@in_kernel
def free_in_ms(i: int, now: int, cars: CarArrays) -> int:
    """In how many ms the air around car ``i`` will be free if no other frame begins; 0 where it is free."""
    if air_is_busy(i, now, cars) == 0:
        return 0
    free = cars.air_until[i]
    if reached(cars.sends_until[i], free):
        free = cars.sends_until[i]
    return elapsed_ms(free, now)


@in_kernel
def begin_frame(i: int, frame: int, arrays: Arrays, now: Now) -> None:
    """Let car ``i`` begin a frame, which ``heard`` then holds; a frame that the car was receiving is lost."""
    cars = arrays.cars
    counters = arrays.counters
    if cars.heard_from[i] != NOBODY:
        events.record_loss(
            counters, now.part, now.ms, cars.number[i], events.SENDING, cars.heard[i], cars.heard_from[i]
        )
        cars.heard_from[i] = NOBODY
    cars.heard[i] = frame
    cars.sends_until[i] = later_ms(now.ms, frames.frame_ms(frame, arrays.rules.levels))
    counters.counts[now.part, events.FRAMES] += 1


@in_kernel
def spread_frame(j: int, low: int, high: int, arrays: Arrays, now: Now) -> None:
    """Let the frame that car ``j`` has begun reach the receivers at the indices ``low`` to ``high`` - 1."""
    cars = arrays.cars
    rules = arrays.rules
    around = arrays.around
    share = now.share
    x = float(cars.x[j])
    y = float(cars.y[j])
    far = rules.range + rules.radius + 1.0
    wide = far + rules.drift
    frame = arrays.cells.frame[now.world]
    first = arrays.cells.first[now.world]
    left, right, bottom, top, columns = cells_around(x, y, wide, frame)
    if first[bottom * columns] >= high or first[(top + 1) * columns] <= low:
        return
    # List all cars around it once; those that don't belong there are overwritten, because a processor can't foresee
    # which these are. A few cars that shade nothing aren't listed.
    count = 0
    room = around.x.shape[1] - SPARE
    inside = 0
    body = rules.radius * rules.radius
    is_listed = rules.line_of_sight > 0 or columns > 1
    for row in range(bottom, top + 1 if is_listed else bottom):
        for i in range(first[row * columns + left], first[row * columns + right + 1]):
            dx = float(cars.x[i]) - x
            dy = float(cars.y[i]) - y
            squared = dx * dx + dy * dy
            at = min(count, room)
            around.x[share, at] = dx
            around.y[share, at] = dy
            around.car[share, at] = i
            count += (squared <= far * far) & (i != j)
            inside += (squared < body) & (i != j)
    is_listed = is_listed and count <= room
    base = 0
    if not is_listed:
        base = first[bottom * columns]
        count = first[(top + 1) * columns] - base
    # The bodies are tested several at once, so their number is a multiple of that.
    for k in range(count, count + SPARE if is_listed else count):
        around.x[share, k] = FAR_UM
        around.y[share, k] = FAR_UM
    near = cell_of(x, y, arrays.obstacles.frame)
    ahead_x, ahead_y = ahead_of(cars.heading[j], rules.cosines)
    for k in range(count):
        i = int(around.car[share, k]) if is_listed else base + k
        dx = float(cars.x[i]) - x
        dy = float(cars.y[i]) - y
        squared = dx * dx + dy * dy
        if squared > rules.range * rules.range or i < low or i >= high or i == j:
            continue
        distance = math.sqrt(squared)
        if dx * ahead_x + dy * ahead_y < rules.beam_cos * distance:
            continue
        if rules.line_of_sight:
            if _is_hidden(x, y, x + dx, y + dy, distance, near, arrays.obstacles):
                continue
            if is_listed:
                # A body that the sender is inside of shades all others.
                if inside > (squared < body) or _is_hidden_by_listed(dx, dy, squared, count, share, around, rules):
                    continue
            elif _is_hidden_by_cars(i, j, now.world, arrays):
                continue
        _arrive(i, j, int(distance), arrays, now)


@in_kernel
def _is_hidden_by_listed(
    dx: float, dy: float, squared: float, count: int, share: int, around: Around, rules: Rules
) -> bool:
    """Whether a listed car that the sender isn't inside of shades the line of sight from it to another listed car.

    As `motorcade.engine.geometry.is_shaded`, with the sender at 0.
    """
    body = rules.radius * rules.radius
    # The other car shades itself.
    shades = 0
    for k in range((count + SPARE - 1) // SPARE * SPARE):
        to_x = around.x[share, k]
        to_y = around.y[share, k]
        from_x = to_x - dx
        from_y = to_y - dy
        aside = to_x * dy - to_y * dx
        dot = to_x * dx + to_y * dy
        between = (dot > 0.0) & (dot < squared) & (aside * aside < body * squared)
        shades += between | (from_x * from_x + from_y * from_y < body)
    return shades > 1


@in_kernel
def reach(sender: int, receiver: int, world: int, arrays: Arrays) -> int:
    """Whether a frame of one car would reach another now: an index into REACHES.

    It is TOO_FAR where nothing but the distance prevents it. Cars are numbered by their place in ``arrays``.
    """
    cars = arrays.cars
    rules = arrays.rules
    dx = float(cars.x[receiver]) - float(cars.x[sender])
    dy = float(cars.y[receiver]) - float(cars.y[sender])
    squared = dx * dx + dy * dy
    distance = math.sqrt(squared)
    ahead_x, ahead_y = ahead_of(cars.heading[sender], rules.cosines)
    if dx * ahead_x + dy * ahead_y < rules.beam_cos * distance:
        return OUTSIDE_BEAM
    if rules.line_of_sight:
        ax = float(cars.x[sender])
        ay = float(cars.y[sender])
        bx = float(cars.x[receiver])
        by = float(cars.y[receiver])
        cell = cell_of(ax, ay, arrays.obstacles.frame)
        if _is_hidden(ax, ay, bx, by, distance, cell, arrays.obstacles):
            return HIDDEN
        if _is_hidden_by_cars(receiver, sender, world, arrays):
            return HIDDEN
    return TOO_FAR if squared > rules.range * rules.range else IN_REACH


@in_kernel
def _arrive(i: int, j: int, distance: int, arrays: Arrays, now: Now) -> None:
    """A frame of car ``j`` begins to reach car ``i``."""
    cars = arrays.cars
    counters = arrays.counters
    capture = arrays.rules.capture
    loudest = int(cars.loudest[i])
    is_free = reached(now.ms, cars.air_until[i])
    is_covered = is_free == 0 and not _is_louder(distance, loudest, capture)
    number = cars.number[i]
    sender = cars.number[j]
    if cars.program[i] != 0:
        # A leader receives no frames; it only finds that the air is busy.
        pass
    elif reached(now.ms, cars.sends_until[i]) == 0:
        events.record_loss(counters, now.part, now.ms, number, events.SENDING, cars.heard[j], sender)
    else:
        if cars.heard_from[i] != NOBODY and not _is_louder(loudest, distance, capture):
            events.record_loss(counters, now.part, now.ms, number, events.COLLISION, cars.heard[i], cars.heard_from[i])
            cars.heard_from[i] = NOBODY
        if is_covered:
            events.record_loss(counters, now.part, now.ms, number, events.COLLISION, cars.heard[j], sender)
        else:
            cars.heard[i] = cars.heard[j]
            cars.heard_at[i] = cars.sends_until[j]
            cars.heard_from[i] = sender
            if reached(cars.due[i], cars.sends_until[j]):
                cars.due[i] = cars.sends_until[j]
                disturb(i, arrays, now)
    if is_free or distance < loudest:
        cars.loudest[i] = distance
    if reached(cars.sends_until[j], cars.air_until[i]):
        cars.air_until[i] = cars.sends_until[j]


@in_kernel
def _is_louder(distance: int, other: int, capture: float) -> bool:
    # Of two senders at one point neither is louder.
    is_far = float(other) * float(other) >= capture * float(distance) * float(distance)
    return capture > 0.0 and other > distance and is_far


@in_kernel
def _is_hidden_by_cars(i: int, j: int, world: int, arrays: Arrays) -> bool:
    """Whether a car blocks the line of sight between cars ``j`` and ``i``."""
    cars = arrays.cars
    cells = arrays.cells
    rules = arrays.rules
    ax = float(cars.x[j])
    ay = float(cars.y[j])
    bx = float(cars.x[i])
    by = float(cars.y[i])
    first = cells.first[world]
    wide = rules.radius + rules.drift
    left, right, bottom, top, columns = cells_between(
        min(ax, bx), min(ay, by), max(ax, bx), max(ay, by), wide, cells.frame[world]
    )
    hidden = False
    for row in range(bottom, top + 1):
        for k in range(first[row * columns + left], first[row * columns + right + 1]):
            shades = is_shaded(ax, ay, bx, by, float(cars.x[k]), float(cars.y[k]), rules.radius)
            hidden |= shades & (k != i) & (k != j)
    return hidden


@in_kernel
def _is_hidden(ax: float, ay: float, bx: float, by: float, distance: float, cell: int, obstacles: Obstacles) -> bool:
    """Whether a wall or an obstacle blocks the line of sight from a, which is in ``cell``, to b."""
    segments = obstacles.segments.shape[0]
    for k in range(obstacles.first[cell], obstacles.first[cell + 1]):
        if obstacles.away[k] > distance:
            break
        item = obstacles.items[k]
        if item < segments:
            wall = obstacles.segments[item]
            if cross(ax, ay, bx, by, wall[0], wall[1], wall[2], wall[3]):
                return True
        else:
            disc = obstacles.discs[item - segments]
            if is_shaded(ax, ay, bx, by, disc[0], disc[1], disc[2]):
                return True
    return False


@in_kernel
def received(i: int, seed: int, now: int, cars: CarArrays, flips: Floats) -> int:
    """The frame that ends at car ``i`` now, with the bits that flipped on its way."""
    frame = int(cars.heard[i])
    chance = float(mix(seed ^ 0x5F3759DF, cars.number[i], now))
    count = 0
    while count < 32 and chance >= flips[count]:
        count += 1
    draws = 0
    left = count
    flipped = 0
    while left > 0:
        draws += 1
        bit = mix(seed + draws, cars.number[i], now) >> 27
        if flipped >> bit & 1 == 0:
            flipped |= 1 << bit
            left -= 1
    return frame ^ flipped


@in_kernel
def voices_until(at_ms: int, voices: Voices) -> int:
    """How many of the mat's voices are spoken at ``at_ms`` or before."""
    low = 0
    high = voices.at_ms.shape[0]
    while low < high:
        middle = (low + high) // 2
        if voices.at_ms[middle] <= at_ms:
            low = middle + 1
        else:
            high = middle
    return low


@in_kernel
def voice_at(i: int, arrays: Arrays, now: Now) -> int:
    """The last word that car ``i`` hears in this tick, NO_VOICE for none."""
    cars = arrays.cars
    voices = arrays.voices
    word = now.said
    for k in range(now.first_voice, now.last_voice):
        dx = float(cars.x[i]) - voices.x[k]
        dy = float(cars.y[i]) - voices.y[k]
        if dx * dx + dy * dy <= voices.radius[k] * voices.radius[k]:
            word = voices.word[k]
    return word
