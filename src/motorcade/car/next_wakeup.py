"""For how long a car's brain need not run: the time until the clock alone changes something.

Portable. The simulator compiles this file and runs a car's brain only when something can happen to the car, not in
every tick. The arguments are those of `motorcade.car.brain`.
"""

from motorcade.car import brain, decisions, frames
from motorcade.words.positions import FORWARD_AT, MOTOR_DIRECTION_AT
from motorcade.words.ticks import elapsed_ms, later_ms, reached

# Longer than any duration, but less than half of the clock's range, so that it still counts as the future.
NEVER_MS = 1 << 28


def frames_rest_ms(s: list[int], image: brain.ImageWords, free_ms: int, now: int, levels: tuple[int, ...]) -> int:
    """For how many ms after now a leader begins no frame, if the air is free in ``free_ms`` and no sooner."""
    if image[0] >> 16 & 255 == 0:
        return NEVER_MS
    if frames.is_tagged(image):
        slot_ms = frames.dwell_ms(image, levels) - elapsed_ms(now, s[brain.SLOT_STARTED_MS])
        return _in_slot_rest_ms(s, slot_ms, free_ms, now)
    due = s[brain.NEXT_FRAME_MS]
    if reached(due, s[brain.QUIET_MS]) == 0:
        due = s[brain.QUIET_MS]
    return elapsed_ms(due, now)


def tells_rest_ms(
    s: list[int], d: bytearray, image: brain.ImageWords, free_ms: int, now: int, levels: tuple[int, ...]
) -> int:
    """For how many ms after now a leader that tells begins no frame, as `frames_rest_ms` has it for others."""
    slot_ms = NEVER_MS
    if d[decisions.WAITS]:
        slot_ms = decisions.least_slot_ms(levels) - elapsed_ms(now, s[brain.SLOT_STARTED_MS])
    elif d[decisions.TURNS]:
        slot_ms = frames.dwell_ms(image, levels) - elapsed_ms(now, s[brain.SLOT_STARTED_MS])
    if d[decisions.IS_TELLING]:
        return _in_slot_rest_ms(s, slot_ms, free_ms, now)
    return slot_ms


def _in_slot_rest_ms(s: list[int], slot_ms: int, free_ms: int, now: int) -> int:
    """For how many ms after now a leader of tagged words begins no frame; its slot is over in ``slot_ms``."""
    rest = 0
    if reached(now, s[brain.QUIET_MS]) == 0:
        rest = elapsed_ms(s[brain.QUIET_MS], now)
    sending = _sending_rest_ms(s, free_ms, now)
    if sending > rest:
        rest = sending
    if slot_ms < rest:
        return slot_ms
    return rest


def relay_rest_ms(s: list[int], free_ms: int, now: int) -> int:
    """For how many ms after now a follower doesn't begin to pass its word on, if the air is free in ``free_ms``."""
    if s[brain.HOLDS] == 0 or s[brain.WORD] >> FORWARD_AT & 1 == 0:
        return NEVER_MS
    if s[brain.TAG] and s[brain.INTERVAL] == 0:
        return NEVER_MS
    return _sending_rest_ms(s, free_ms, now)


def _sending_rest_ms(s: list[int], free_ms: int, now: int) -> int:
    """For how many ms after now a car with a word to send begins no frame; at least 1."""
    state = s[brain.RELAY]
    due = s[brain.RELAY_MS]
    if state == frames.RESTING:
        due = later_ms(s[brain.INTERVAL_MS], s[brain.INTERVAL])
    elif state != frames.WAITING and state != frames.SCHEDULED:
        return free_ms if free_ms > 0 else 1
    if reached(now, due):
        return 1
    return elapsed_ms(due, now)


def word_rest_ms(s: list[int], now: int, levels: tuple[int, ...]) -> int:
    """For how many ms after now the word changes nothing: neither it nor one of its blocks ends, and it draws nothing.

    The brain need not run for so long, or until the car has a frame to send, if the car receives none and its sensors
    find nothing new.
    """
    running_ms = elapsed_ms(now, s[brain.STARTED_MS])
    forget = NEVER_MS
    if s[brain.HOLDS] and s[brain.TAG] and s[brain.TAG] & brain.FORGOTTEN == 0:
        forget = levels[brain.FORGET_MS] - running_ms
    if s[brain.RUNNING] == 0:
        return forget
    word = s[brain.WORD]
    rest = brain.length_ms(word, levels) - running_ms
    if forget < rest:
        rest = forget
    motor = brain.motor_ms(word, levels)
    if running_ms < motor:
        if motor - running_ms < rest:
            rest = motor - running_ms
        if word >> MOTOR_DIRECTION_AT & 3 == brain.RANDOM_FORWARD:
            step = brain.RANDOM_STEP_MS - running_ms % brain.RANDOM_STEP_MS
            if step < rest:
                rest = step
        leave = brain.LEAVE_LINE_MS - running_ms
        if running_ms < brain.LEAVE_LINE_MS and leave < rest and brain.minds_floor(s, now, levels):
            rest = leave
    led = brain.led_ms(word, levels) - running_ms
    if led > 0 and led < rest:
        rest = led
    avoid = brain.avoid_ms(word, levels) - running_ms
    if avoid > 0 and avoid < rest:
        rest = avoid
    return rest
