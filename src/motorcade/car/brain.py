"""What a car does with a word: plain functions of integers, the same source on every target.

The brain of a car is three files: this one (steps, words, wheels and LED), `motorcade.car.frames` (which frames a car
sends, and what it does with those that it receives) and `motorcade.car.decisions` (a leader that decides).

CPython and MicroPython run these files, the simulator compiles them, and they translate to C line by line. Therefore
they have no classes, no floats, no clock, no input and no output. Times are arguments, in milliseconds that wrap
(`motorcade.words.ticks`). Compiled and in C they allocate nothing. On 32-bit MicroPython an integer from 2^30 up is an
object: a tick in which the brain runs allocates 100 to 500 bytes for words, and `motorcade.car.loop` runs it only when
something is due.

The functions take these arguments:

``s``
    the car's memory: SIZE unsigned integers below 2^32, at the indices below.
``image``
    the image's words, header first; ``(0,)`` for a car without a program.
``levels``
    the profile's integers, at the indices below; `motorcade.car.board.make_levels` makes them.
``now``
    the clock's reading in ms.

Source: seed 000, c1-c9, for the fields; the protocol's section "What a car does with a word" for the behaviour.
"""

from motorcade.words import uint8, uint8_at, uint16_at
from motorcade.words.positions import (
    AVOID_DURATION_AT,
    AVOID_ENABLE_AT,
    AVOID_RADIUS_AT,
    FLOOR_AT,
    LED_DURATION_AT,
    LED_WHICH_AT,
    MOTOR_DIRECTION_AT,
    MOTOR_DURATION_AT,
    MOTOR_ENABLE_AT,
    MOTOR_SPEED_AT,
    PIR_AT,
    VOICE_AT,
)
from motorcade.words.ticks import elapsed_ms, later_ms

# The type of an image in annotations. In C its words are read by a function, so that they may be in an EEPROM.
MYPY = False
if MYPY:
    from collections.abc import Sequence

    from motorcade.car.senses import Senses

    ImageWords = Sequence[int]
else:
    ImageWords = tuple

# A car's memory, s.
WORD = 0  # the word that the car executes or holds
HOLDS: uint8_at = 1  # 1 once there is such a word
STARTED_MS = 2  # when it began
RUNNING: uint8_at = 3  # 1 while the word runs: until its length is over
STOPPED: uint8_at = 4  # 1 after the car heard 'stop', until it hears 'go'
DRAWS: uint16_at = 5  # directions drawn so far in this word, for random forward; 1 after a turn found its line
HEADING: uint8_at = 6  # the last direction drawn: FORWARD, LEFT or RIGHT
RANDOM = 7  # the generator's state, never 0
# A car leads or follows for as long as it is on, so leaders and followers share the following places.
STATE: uint8_at = 8  # leader: index of its present state
SLOT: uint8_at = 9  # leader: index of the follower word that it sends
SLOT_STARTED_MS = 10  # leader: when it began to send that word
NEXT_FRAME_MS = 11  # leader of bare words: when the next frame is due
QUIET_MS = 12  # leader: when its last frame and the gap behind it are over
RELAYED: uint8_at = 13  # leader of bare words: 1 where followers pass words on
LOST_PARITY = 8  # follower: frames dropped for their parity
LOST_RESERVED = 9  # follower: frames dropped for a reserved field
LOST_CHECK = 10  # follower: tagged frames dropped for their check
LOST_REMOTE = 12  # follower: frames of remote controls
RELAY_MS = 11  # follower, leader of tagged words: a time; RELAY decides what it means
RELAY: uint8_at = 13  # follower, leader of tagged words: state of sending, BUSY to RESTING of motorcade.car.frames
# Places for tagged words; with a bare word they are 0.
TAG: uint16_at = 14  # the tag of the held or sent word, 0: bare; beside it FORGOTTEN and a replaced tag
INTERVAL = 15  # length of the present interval in ms; 0 while nothing is to be passed on
INTERVAL_MS = 16  # when the present interval began
SAME_TAG = 17  # follower: frames received with its own tag in this interval
SENT: uint8_at = 17  # leader: how many frames it has sent in this slot; it counts up to OPENING_FRAMES
SIZE = 18

# Added to the tag of a word that was begun FORGET_MS ago: a frame with any other tag, or a bare one, replaces it.
FORGOTTEN = 32
TAG_MASK = 31
# A car that took a word only because it had forgotten its tag remembers that tag here. Neighbours that forget later
# still send it, and it may count as newer.
REPLACED_TAG_AT = 8
# The profile's integers, levels.
DURATIONS_MS = 0  # 4 of them
DWELLS_MS = 4  # 8
AVOID_RADII_MM = 12  # 4
IDLE_STATE_MS = 16
UNIT_US = 17
GAP_MS = 18
RELAY_PERIOD_MS = 19
SENSE_MS = 20
FIRST_INTERVAL_MS = 21
LAST_INTERVAL_MS = 22
REDUNDANCY = 23
FORGET_MS = 24

# Directions as in a control word. The state of the wheels is direction * 4 + speed level.
FORWARD = 0
LEFT = 1
RIGHT = 2
RANDOM_FORWARD = 3
STILL = 0
NO_LED = 4
RANDOM_STEP_MS = 500
# Over dark floor: the left floor sensor, the right one.
DARK_LEFT = 1
DARK_RIGHT = 2
# A turn to a line begins by leaving the line that is under the car.
LEAVE_LINE_MS = 200

# What a microphone heard.
NO_VOICE = 0
VOICE_STOP = 1
VOICE_GO = 2


def motor_ms(word: int, levels: tuple[int, ...]) -> int:
    """Return how long ``word`` drives the motor."""
    if word >> MOTOR_ENABLE_AT & 1:
        return levels[DURATIONS_MS + (word >> MOTOR_DURATION_AT & 3)]
    return 0


def led_ms(word: int, levels: tuple[int, ...]) -> int:
    """Return how long ``word`` lights its LED."""
    return levels[DURATIONS_MS + (word >> LED_DURATION_AT & 3)]


def avoid_ms(word: int, levels: tuple[int, ...]) -> int:
    """Return how long ``word`` avoids obstacles."""
    if word >> AVOID_ENABLE_AT & 1:
        return levels[DURATIONS_MS + (word >> AVOID_DURATION_AT & 3)]
    return 0


def length_ms(word: int, levels: tuple[int, ...]) -> int:
    """Return how long ``word`` lasts: as long as its longest block; the idle time where no block has a duration."""
    length = motor_ms(word, levels)
    other = led_ms(word, levels)
    if other > length:
        length = other
    other = avoid_ms(word, levels)
    if other > length:
        length = other
    if length > 0:
        return length
    return levels[IDLE_STATE_MS]


def switch_on(s: list[int], number: int, now: int) -> None:
    """Clear the memory, and seed the random generator with the car's number.

    The number is multiplied, so that consecutive numbers give very different seeds.
    """
    for i in range(SIZE):
        s[i] = 0
    s[QUIET_MS] = now
    s[RANDOM] = ((number + 1) * 0x9E3779B1) & 0xFFFFFFFF
    if s[RANDOM] == 0:
        s[RANDOM] = 1


def draw(s: list[int]) -> int:
    """Return the next 32 random bits: Marsaglia's xorshift, 13, 17, 5."""
    x = s[RANDOM]
    x = x ^ (x << 13 & 0xFFFFFFFF)
    x = x ^ x >> 17
    x = x ^ (x << 5 & 0xFFFFFFFF)
    s[RANDOM] = x
    return x


def leader_start(s: list[int], image: ImageWords, now: int) -> uint8:
    """Begin a leader's states. Return 1 where its first state began, 0 for a leader without states."""
    s[STATE] = 0
    s[RUNNING] = 0
    s[HOLDS] = 0
    if image[0] >> 24 == 0:
        return 0
    begin_word(s, image[1], now)
    return 1


def leader_step(s: list[int], image: ImageWords, now: int, levels: tuple[int, ...]) -> uint8:
    """Begin the next state if the length of the present one is over. Return 1 then, else 0.

    Call it until it returns 0: after a late tick several states may have ended. Each state begins exactly when the one
    before it ended.
    """
    leader_states = image[0] >> 24
    if leader_states == 0:
        return 0
    if end_state(s, now, levels) == 0:
        return 0
    s[STATE] = s[STATE] + 1
    if s[STATE] == leader_states:
        s[STATE] = 0
    begin_word(s, image[1 + s[STATE]], s[STARTED_MS])
    return 1


def end_state(s: list[int], now: int, levels: tuple[int, ...]) -> uint8:
    """End a leader's state if its length is over: the next one begins at STARTED_MS. Return 1 then, else 0."""
    length = length_ms(s[WORD], levels)
    if elapsed_ms(now, s[STARTED_MS]) < length:
        return 0
    draw_headings(s, length, levels)
    s[RUNNING] = 0
    s[STARTED_MS] = later_ms(s[STARTED_MS], length)
    return 1


def break_off(s: list[int], now: int, levels: tuple[int, ...]) -> None:
    """End a word now, whatever its length is: make the draws that were due before now."""
    running_ms = elapsed_ms(now, s[STARTED_MS])
    if running_ms > 0:
        draw_headings(s, running_ms - 1, levels)
    s[RUNNING] = 0


def follower_step(s: list[int], now: int, levels: tuple[int, ...]) -> uint8:
    """End the word that a follower runs if its length is over. Return 1 then, else 0.

    It also forgets the tag of a word that was begun FORGET_MS ago.
    """
    if s[TAG] and s[TAG] & FORGOTTEN == 0 and elapsed_ms(now, s[STARTED_MS]) >= levels[FORGET_MS]:
        s[TAG] = s[TAG] & TAG_MASK | FORGOTTEN
        s[INTERVAL] = 0
    if s[RUNNING] == 0:
        return 0
    length = length_ms(s[WORD], levels)
    if elapsed_ms(now, s[STARTED_MS]) < length:
        return 0
    draw_headings(s, length, levels)
    s[RUNNING] = 0
    return 1


def hear_voice(s: list[int], voice: uint8) -> None:
    """Take what the microphone heard; it has an effect only while a word with the bit voice runs."""
    if s[RUNNING] and s[WORD] >> VOICE_AT & 1:
        if voice == VOICE_STOP:
            s[STOPPED] = 1
        if voice == VOICE_GO:
            s[STOPPED] = 0


def looks_mm(s: list[int], now: int, levels: tuple[int, ...]) -> int:
    """Return the distance below which an obstacle matters now; 0 while none does: the sensor can then stay off."""
    word = s[WORD]
    running_ms = elapsed_ms(now, s[STARTED_MS])
    if s[RUNNING] == 0 or running_ms >= avoid_ms(word, levels) or running_ms >= motor_ms(word, levels):
        return 0
    if word >> MOTOR_SPEED_AT & 3 == 0:
        return 0
    return levels[AVOID_RADII_MM + (word >> AVOID_RADIUS_AT & 3)]


def minds_floor(s: list[int], now: int, levels: tuple[int, ...]) -> uint8:
    """Return 1 while dark or light floor can change what the wheels do, else 0."""
    word = s[WORD]
    if s[RUNNING] == 0 or word >> FLOOR_AT & 1 == 0 or word >> MOTOR_SPEED_AT & 3 == 0:
        return 0
    return 1 if elapsed_ms(now, s[STARTED_MS]) < motor_ms(word, levels) else 0


def watches(s: list[int], now: int, levels: tuple[int, ...]) -> uint8:
    """Return 1 while the running word reacts to an obstacle, a person or the floor, else 0."""
    if s[RUNNING] and s[WORD] >> PIR_AT & 1:
        return 1
    if minds_floor(s, now, levels):
        return 1
    return 1 if looks_mm(s, now, levels) else 0


def wheels(s: list[int], senses: "Senses", now: int, levels: tuple[int, ...]) -> uint8:
    """Return the state of the wheels now: direction * 4 + speed level, STILL for standing still.

    ``senses`` has what the sensors tell: a large distance where the ultrasonic sensor finds nothing or is off.
    """
    word = s[WORD]
    speed = word >> MOTOR_SPEED_AT & 3
    if s[RUNNING] == 0 or speed == 0:
        return STILL
    running_ms = elapsed_ms(now, s[STARTED_MS])
    if running_ms >= motor_ms(word, levels):
        return STILL
    direction = word >> MOTOR_DIRECTION_AT & 3
    if direction == RANDOM_FORWARD:
        draw_headings(s, running_ms, levels)
        direction = s[HEADING]
    if s[STOPPED]:
        return STILL
    if senses.person and word >> PIR_AT & 1:
        return STILL
    if running_ms < avoid_ms(word, levels):
        if senses.obstacle_mm < levels[AVOID_RADII_MM + (word >> AVOID_RADIUS_AT & 3)]:
            return RIGHT * 4 + speed
    if word >> FLOOR_AT & 1:
        return _over_floor(s, direction, speed, senses.dark_floor, running_ms)
    return direction * 4 + speed


def _over_floor(s: list[int], direction: uint8, speed: uint8, dark: int, running_ms: int) -> uint8:
    """Return the state of the wheels of a word with the bit floor: follow a line, turn to one, or stay on dark.

    A turn that has found its line stands until the motor's time is over; ``s[DRAWS]`` remembers it.
    """
    if s[WORD] >> MOTOR_DIRECTION_AT & 3 == RANDOM_FORWARD:
        return STILL if dark else direction * 4 + speed
    if direction == FORWARD:
        if dark == DARK_LEFT:
            return LEFT * 4 + speed
        if dark == DARK_RIGHT:
            return RIGHT * 4 + speed
        return FORWARD * 4 + speed
    if dark and running_ms >= LEAVE_LINE_MS:
        s[DRAWS] = 1
    return STILL if s[DRAWS] else direction * 4 + speed


def lit_led(s: list[int], now: int, levels: tuple[int, ...]) -> uint8:
    """Return the LED that is on now, 0 to 3, or NO_LED."""
    if s[RUNNING] and elapsed_ms(now, s[STARTED_MS]) < led_ms(s[WORD], levels):
        return s[WORD] >> LED_WHICH_AT & 3
    return NO_LED


def begin_word(s: list[int], word: int, now: int) -> None:
    """Begin ``word`` now."""
    s[WORD] = word
    s[STARTED_MS] = now
    s[RUNNING] = 1
    s[DRAWS] = 0
    if word >> VOICE_AT & 1 == 0:
        s[STOPPED] = 0


def draw_headings(s: list[int], running_ms: int, levels: tuple[int, ...]) -> None:
    """Make the draws that were due in the first ``running_ms`` of the word.

    Draws are counted, not timed. So a car draws the same numbers at whatever times its ticks happen, and also where it
    stood still for a while.
    """
    word = s[WORD]
    if word >> MOTOR_DIRECTION_AT & 3 != RANDOM_FORWARD:
        return
    end_ms = motor_ms(word, levels)
    if running_ms < end_ms:
        end_ms = running_ms + 1
    while s[DRAWS] * RANDOM_STEP_MS < end_ms:
        s[DRAWS] = s[DRAWS] + 1
        quarter = draw(s) >> 30
        s[HEADING] = FORWARD
        if quarter == 2:
            s[HEADING] = LEFT
        if quarter == 3:
            s[HEADING] = RIGHT
