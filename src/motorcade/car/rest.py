"""How long a car's brain may be left alone: when time by itself next changes anything.

Portable, and compiled into the simulator, which so looks at each car when
something can happen to it, and not at every tick. Arguments as in `motorcade.car.brain`.
"""

from motorcade.car import brain
from motorcade.words.formats import CONTROL
from motorcade.words.ticks import elapsed_ms, reached

# Longer than anything takes, short enough for the clock to tell it from the past.
NEVER_MS = 1 << 28

_FORWARD_AT = CONTROL.field("forward").low
_MOTOR_DIRECTION_AT = CONTROL.field("motor_direction").low


def leader_rest_ms(s: list[int], image: tuple[int, ...], now: int, levels: tuple[int, ...]) -> int:
    """For how many ms a leader need not be looked at after now, where nothing new reaches its sensors."""
    rest = _word_rest_ms(s, now, levels)
    if image[0] >> 16 & 255:
        due = s[brain.NEXT_FRAME_MS]
        if reached(due, s[brain.QUIET_MS]) == 0:
            due = s[brain.QUIET_MS]
        if elapsed_ms(due, now) < rest:
            rest = elapsed_ms(due, now)
    return rest


def follower_rest_ms(s: list[int], air_is_busy: int, now: int, levels: tuple[int, ...]) -> int:
    """For how many ms a follower need not be looked at after now.

    That holds where it hears no frame, nothing new reaches its other sensors
    and the air stays as busy as it is.
    """
    rest = _word_rest_ms(s, now, levels)
    if s[brain.HOLDS] == 0 or s[brain.WORD] >> _FORWARD_AT & 1 == 0:
        return rest
    if s[brain.RELAY] == brain.WAITING:
        if elapsed_ms(s[brain.RELAY_MS], now) < rest:
            rest = elapsed_ms(s[brain.RELAY_MS], now)
    elif air_is_busy == 0:
        rest = 1
    return rest


def _word_rest_ms(s: list[int], now: int, levels: tuple[int, ...]) -> int:
    """How long it is until the word does something new: a block or the word is over, or a direction is drawn."""
    if s[brain.RUNNING] == 0:
        return NEVER_MS
    word = s[brain.WORD]
    running_ms = elapsed_ms(now, s[brain.STARTED_MS])
    rest = brain.length_ms(word, levels) - running_ms
    motor = brain.motor_ms(word, levels)
    if running_ms < motor:
        if motor - running_ms < rest:
            rest = motor - running_ms
        if word >> _MOTOR_DIRECTION_AT & 3 == brain.RANDOM_FORWARD:
            step = brain.RANDOM_STEP_MS - running_ms % brain.RANDOM_STEP_MS
            if step < rest:
                rest = step
    led = brain.led_ms(word, levels) - running_ms
    if led > 0 and led < rest:
        rest = led
    avoid = brain.avoid_ms(word, levels) - running_ms
    if avoid > 0 and avoid < rest:
        rest = avoid
    return rest
