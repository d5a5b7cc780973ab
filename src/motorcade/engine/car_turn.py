"""A car's turn in a tick: its brain runs, it looks at what is near it, and it begins a frame.

A car has its turn only when something can have happened to it: its word has
something new to do (`motorcade.car.next_wakeup`), a frame has ended, or a body may have
come near since it last looked around. The others just go on.
"""

from motorcade.car import brain
from motorcade.car import next_wakeup as rest
from motorcade.engine import bodies, channel, clearance, geometry
from motorcade.engine import counters as tally
from motorcade.engine.counters import Counters
from motorcade.engine.native import in_kernel
from motorcade.engine.state import DRIVEN, NOBODY, Cars, Cells, People, Place, Rules, Voices
from motorcade.words.formats import CONTROL
from motorcade.words.infrared import to_frame
from motorcade.words.ticks import elapsed_ms, later_ms, reached

_PIR_AT = CONTROL.field("pir").low
_SENSES = 1 << _PIR_AT | 1 << CONTROL.field("avoid_enable").low


@in_kernel
def switch_on(begin: int, end: int, seed: int, now: int, part: int, cars: Cars, rules: Rules, told: Counters) -> None:
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
    tick: int,
    said: int,
    first_voice: int,
    last_voice: int,
    cars: Cars,
    cells: Cells,
    place: Place,
    people: People,
    voices: Voices,
    rules: Rules,
    told: Counters,
) -> int:
    """Run the brains of those cars between two indices that are due; gives how many of them began a frame.

    They stand at the beginning of their part of ``cars.order`` then. All hear what is ``said``, those near
    enough also voices ``first_voice`` to ``last_voice`` - 1.
    """
    senders = begin
    everyone = said != brain.NO_VOICE or first_voice < last_voice
    for i in range(begin, end):
        looked = False
        if everyone or reached(now, cars.due[i]):
            word_ms = 0 if everyone else _left_to_word(i, now, cars, rules)
            if word_ms == 0:
                voice = _voice_at(i, said, first_voice, last_voice, cars, voices)
                looked, word_ms = _act(i, world, part, seed, now, tick, voice, cars, cells, place, people, rules, told)
            if _sends(i, part, now, cars, rules, told):
                cars.order[senders] = i
                senders += 1
            _rest(i, now, word_ms, cars, rules)
        if rules.collisions and not looked and clearance.is_due(cars.clear[i], tick):
            _, _, push_x, push_y = _look_around(i, world, 0.0, tick, cars, cells, place, rules)
            _touch(i, part, push_x, push_y, cars, rules, told)
    return senders - begin


@in_kernel
def _left_to_word(i: int, now: int, cars: Cars, rules: Rules) -> int:
    """For how many ms a car that is due has only a word to pass on; 0 where there may be more to do now."""
    s = cars.memory[:, i]
    if cars.program[i] > 0 or s[brain.WORD] & _SENSES:
        return 0
    if cars.heard_from[i] != NOBODY and reached(now, cars.heard_at[i]):
        return 0
    # It was looked at whenever there was something new until a tick ago.
    rest_ms = rest.word_rest_ms(s, later_ms(now, -rules.tick_ms), rules.levels) - rules.tick_ms
    return max(rest_ms, 0)


@in_kernel
def _act(
    i: int,
    world: int,
    part: int,
    seed: int,
    now: int,
    tick: int,
    voice: int,
    cars: Cars,
    cells: Cells,
    place: Place,
    people: People,
    rules: Rules,
    told: Counters,
) -> tuple[bool, int]:
    """Run a car's brain up to its wheels; gives whether it looked around, and for how many ms it may rest."""
    s = cars.memory[:, i]
    _step(i, part, seed, now, cars, rules, told)
    if voice != brain.NO_VOICE:
        brain.hear_voice(s, voice)
    look = float(brain.looks_mm(s, now, rules.levels)) * 1000.0
    away, distance, push_x, push_y = rest.NEVER_MS, geometry.FAR_UM, 0.0, 0.0
    if look > 0.0:
        ticks, distance, push_x, push_y = _look_around(i, world, look, tick, cars, cells, place, rules)
        away = ticks * rules.tick_ms
    sensed = 0
    if people.now_x.shape[1] and s[brain.RUNNING] and s[brain.WORD] >> _PIR_AT & 1:
        sensed, outside = bodies.person_near(i, part, now, cars, people, rules)
        ticks = clearance.whole_ticks(outside / (rules.person_step + rules.fastest))
        away = min(away, ticks * rules.tick_ms)
    wheels = brain.wheels(s, bodies.obstacle_mm(distance, rules), sensed, now, rules.levels)
    if wheels != cars.wheels[i] and cars.wheels[i] != DRIVEN:
        bodies.set_way(i, wheels, cars, rules)
        cars.clear[i] = clearance.on_another_way(cars.clear[i], tick)
        if look > 0.0:
            # The sensor was clear for as long as it went on as before.
            away = 0
    elif look > 0.0 and (bodies.turns(wheels) or rules.wheel_noise > 0.0):
        away = 0
    if look > 0.0:
        _touch(i, part, push_x, push_y, cars, rules, told)
    return look > 0.0, min(away, rest.word_rest_ms(s, now, rules.levels))


@in_kernel
def _look_around(
    i: int, world: int, look: float, tick: int, cars: Cars, cells: Cells, place: Place, rules: Rules
) -> tuple[int, float, float, float]:
    """Look at what may be near a car by now, and at everything where its ultrasonic sensor sees as far as ``look``.

    Gives for how many ticks all of that can't come to matter, what the sensor sees, and how others and the place push
    the car.
    """
    others, place_too = clearance.others_due(cars.clear[i], tick), clearance.place_due(cars.clear[i], tick)
    if look > 0.0:
        others, place_too = True, True
    ticks, place_ticks, anyhow, place_anyhow = geometry.FAR_UM, geometry.FAR_UM, 0.0, 0.0
    seen, distance, push_x, push_y = geometry.FAR_UM, geometry.FAR_UM, 0.0, 0.0
    if others:
        ticks, anyhow, seen, push_x, push_y = bodies.others_near(i, world, look, cars, cells, rules)
    if place_too:
        place_ticks, place_anyhow, distance, push_x, push_y = bodies.place_near(
            i, look, push_x, push_y, cars, place, rules
        )
    free, place_free, pushed = ticks, place_ticks, 0
    if push_x != 0.0 or push_y != 0.0:
        cars.clear[i] = clearance.on_another_way(cars.clear[i], tick + 1)
        free, place_free, pushed = anyhow, place_anyhow, 1
    if others:
        half = clearance.half(tick + clearance.whole_ticks(free), pushed)
        cars.clear[i] = clearance.with_others(cars.clear[i], half)
    if place_too:
        half = clearance.half(tick + clearance.whole_ticks(place_free), pushed)
        cars.clear[i] = clearance.with_place(cars.clear[i], half)
    return clearance.whole_ticks(min(ticks, place_ticks)), min(distance, seen), push_x, push_y


@in_kernel
def _touch(i: int, part: int, push_x: float, push_y: float, cars: Cars, rules: Rules, told: Counters) -> None:
    if push_x != 0.0 or push_y != 0.0:
        bodies.keep_push(i, push_x, push_y, cars, rules)
        told.counts[part, tally.TOUCHING_MS] += rules.tick_ms


@in_kernel
def _step(i: int, part: int, seed: int, now: int, cars: Cars, rules: Rules, told: Counters) -> None:
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
def _hear(i: int, part: int, seed: int, now: int, cars: Cars, rules: Rules, told: Counters) -> None:
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
def voices_until(at_ms: int, voices: Voices) -> int:
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
def _voice_at(i: int, said: int, first: int, last: int, cars: Cars, voices: Voices) -> int:
    """The last word that car ``i`` hears of what is said everywhere and of voices ``first`` to ``last`` - 1."""
    heard = said
    for k in range(first, last):
        dx, dy = float(cars.x[i]) - voices.x[k], float(cars.y[i]) - voices.y[k]
        if dx * dx + dy * dy <= voices.radius[k] * voices.radius[k]:
            heard = voices.word[k]
    return heard


@in_kernel
def _sends(i: int, part: int, now: int, cars: Cars, rules: Rules, told: Counters) -> int:
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
def _rest(i: int, now: int, wait: int, cars: Cars, rules: Rules) -> None:
    """Set when the car has to be looked at next, in ``wait`` ms at the latest."""
    s = cars.memory[:, i]
    if cars.program[i] > 0:
        image = rules.images[int(cars.program[i]) - 1]
        wait = min(wait, rest.frames_rest_ms(s, image, now))
    else:
        busy = channel.air_is_busy(i, now, cars)
        relay = rest.relay_rest_ms(s, 0, now)
        if busy and s[brain.RELAY] != brain.WAITING and relay < rest.NEVER_MS:
            # It waits for the air to be free.
            free = cars.air_until[i]
            if reached(cars.sends_until[i], free):
                free = cars.sends_until[i]
            relay = elapsed_ms(free, now)
        wait = min(wait, relay)
        if cars.heard_from[i] != NOBODY:
            wait = min(wait, elapsed_ms(cars.heard_at[i], now))
    cars.due[i] = later_ms(now, max(wait, 1))
