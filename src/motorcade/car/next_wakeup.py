"""How long a car's brain can be left alone: the time until the clock alone changes something.

Portable, and compiled into the simulator, which gives a car its turn only when something can happen to it, and not in
every tick. The arguments are those of `motorcade.car.brain`.
"""

from motorcade.car import brain
from motorcade.words.formats import CONTROL
from motorcade.words.ticks import elapsed_ms, reached

# Longer than any duration, and short enough that the wrapping clock still takes it for the future.
NEVER_MS = 1 << 28

_FORWARD_AT = CONTROL.field("forward").low
_MOTOR_DIRECTION_AT = CONTROL.field("motor_direction").low


def frames_rest_ms(s: list[int], image: tuple[int, ...], now: int) -> int:
    """For how many ms after now a leader begins no frame."""
    if image[0] >> 16 & 255 == 0:
        return NEVER_MS
    due = s[brain.NEXT_FRAME_MS]
    if reached(due, s[brain.QUIET_MS]) == 0:
        due = s[brain.QUIET_MS]
    return elapsed_ms(due, now)


def relay_rest_ms(s: list[int], air_is_busy: int, now: int) -> int:
    """For how many ms after now a follower doesn't begin to pass its word on, if the air stays as busy as it is."""
    if s[brain.HOLDS] == 0 or s[brain.WORD] >> _FORWARD_AT & 1 == 0:
        return NEVER_MS
    if s[brain.RELAY] == brain.WAITING:
        return elapsed_ms(s[brain.RELAY_MS], now)
    return NEVER_MS if air_is_busy else 1


def word_rest_ms(s: list[int], now: int, levels: tuple[int, ...]) -> int:
    """For how many ms after now the word changes nothing: neither it nor one of its blocks ends, and it draws nothing.

    A car may rest for so long, or until it has a frame to send, if it receives none and its sensors find nothing new.
    """
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
