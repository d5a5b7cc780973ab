"""What a leader that decides does besides: conditions, flow words, counters, and what it tells its followers.

Functions of integers as in `motorcade.car.brain`, which describes their arguments; another part of a car's brain. A
leader whose image has no flow words never calls them. Source: the protocol's section "A leader that decides".

``d``
    the leader's memory of decisions: SIZE bytes, at the indices below. Followers have none.
``senses``
    what the car senses in this tick.

How it works
============

An image of such a leader is a list of words, and NEXT is the index of the one that comes next. A state begins as any
leader's state and lasts until its length is over, or until its condition ends it. Then the flow words up to the next
state are executed: they take no time, but at most MOST_FLOW_WORDS of them in a tick. While no state runs the car stands
still: RUNNING of the other memory is 0, and STARTED_MS is the time at which the next state begins.

A tell asks for a slot: WAITS is 1 until the slot opens, at once unless the last slot is younger than a fifteenth of the
time after which cars forget its tag.
"""

from motorcade.car.brain import (
    AVOID_RADII_MM,
    FORGET_MS,
    HOLDS,
    RUNNING,
    SLOT,
    SLOT_STARTED_MS,
    STARTED_MS,
    STATE,
    TAG,
    VOICE_STOP,
    WORD,
    ImageWords,
    begin_word,
    draw,
    end_state,
)
from motorcade.car.frames import NO_FRAME, enter_slot, forget_frame, frame_in_slot, open_next_slot
from motorcade.words import uint8, uint16
from motorcade.words.flow import (
    ADD,
    ALWAYS,
    BELOW,
    CALL,
    CHANCE,
    COUNT,
    DECIDES,
    EITHER_DARK,
    FLOOR,
    IN_TURN,
    IS,
    MOST_COUNT,
    OBSTACLE,
    PERSON,
    RANDOM,
    RETURN,
    SET,
    TELL,
    VOICE,
)
from motorcade.words.infrared import LOWER_HALF, NEWER_SLOTS
from motorcade.words.positions import (
    AVOID_ENABLE_AT,
    AVOID_RADIUS_AT,
    CONDITION_AT,
    COUNTER_AT,
    IF_NOT_AT,
    LEVEL_AT,
    OP_AT,
    TARGET_AT,
    UNTIL_AT,
    UNTIL_LEVEL_AT,
    UNTIL_NOT_AT,
    VALUE_AT,
)
from motorcade.words.ticks import elapsed_ms

# For the type checker alone, as in motorcade.car.brain.
MYPY = False
if MYPY:
    from motorcade.car.senses import Senses

# The memory, d.
WORDS = 0  # how many words a leader that decides has; 0 for another
LOOKS = 1  # 1 + the level of the largest radius for which the image needs the ultrasonic sensor; 0: not at all
TELLS = 2  # 1 where the image holds a tell
NEXT = 3  # index of the leader word that comes next; what is from here on begins with 0 in each image
FLOW_LEFT = 4  # how many flow words may still be executed in this tick
VOICES = 5  # bit 0: 'stop' was heard since the state began; bit 1: 'go' was
COUNTS = 6  # the four counters
CALLS = 10  # how many calls will return, at most MOST_CALLS
LAST_CALL = 11  # the place of RETURNS at which the last call is
RETURNS = 12  # where they go on: a ring of MOST_CALLS places, in which a fifth call takes the place of the oldest
IS_TELLING = 16  # 1 from the first tell on
TURNS = 17  # how many follower words are sent in turn; 0: the one of the slot
WAITS = 18  # 1 while a tell waits for its slot
TOLD = 19  # SLOT of that tell
TOLD_TURNS = 20  # TURNS of that tell
SIZE = 21

# The highest bit of a word's upper half says whether it is a flow word.
FLOW_AT = 15
MOST_FLOW_WORDS = 16
MOST_CALLS = 4

# What go_on did.
DONE = 0
BEGUN = 1
EXECUTED = 2


def decides(d: bytearray) -> uint8:
    """Return more than 0 where the leader of the image that was surveyed decides, else 0."""
    return d[WORDS]


def survey(d: bytearray, image: ImageWords, begin: uint16, end: uint16, levels: tuple[int, ...]) -> None:
    """Find out what a new image needs, from the words at indices ``begin`` to ``end`` - 1; the header is at 0.

    Call it for the whole image before `begin`, on a slow chip in several ticks: each word takes it some time.
    """
    if begin == 0:
        d[LOOKS] = 0
        d[TELLS] = 0
        d[WORDS] = 0
        if image[0] & DECIDES:
            d[WORDS] = image[0] >> 24
        begin = 1
    while begin < end and begin <= d[WORDS]:
        _survey_word(d, image[begin], levels)
        begin = begin + 1


def _survey_word(d: bytearray, word: int, levels: tuple[int, ...]) -> None:
    """Find out whether a leader word tells something, and how far it needs the ultrasonic sensor."""
    upper: uint16 = word >> 16
    lower: uint16 = word & LOWER_HALF
    if upper >> FLOW_AT:
        op = upper >> OP_AT & 7
        if op == TELL:
            d[TELLS] = 1
        elif op <= CALL and upper >> CONDITION_AT & 15 == OBSTACLE:
            _look(d, lower >> LEVEL_AT & 3, levels)
    else:
        if lower >> UNTIL_AT & 15 == OBSTACLE:
            _look(d, lower >> UNTIL_LEVEL_AT & 3, levels)
        if word >> AVOID_ENABLE_AT & 1:
            _look(d, word >> AVOID_RADIUS_AT & 3, levels)


def _look(d: bytearray, level: uint8, levels: tuple[int, ...]) -> None:
    if levels[AVOID_RADII_MM + level] > looks_mm(d, levels):
        d[LOOKS] = 1 + level


def looks_mm(d: bytearray, levels: tuple[int, ...]) -> int:
    """Return how far the image needs the ultrasonic sensor; 0: not at all."""
    if d[LOOKS] == 0:
        return 0
    return levels[AVOID_RADII_MM + d[LOOKS] - 1]


def begin(s: list[int], d: bytearray, now: int) -> None:
    """Begin an image: its first words are executed in the next tick, and nothing is told before its first tell."""
    s[STATE] = 0
    s[RUNNING] = 0
    s[HOLDS] = 0
    for i in range(SIZE - NEXT):
        d[NEXT + i] = 0
    forget_frame(s, now)


def hear_voice(d: bytearray, voice: uint8) -> None:
    """Take a voice command for the conditions of the running state and of the flow words behind it."""
    d[VOICES] = d[VOICES] | 1 << (voice - VOICE_STOP)


def begin_tick(s: list[int], d: bytearray, now: int) -> None:
    """Let flow words be executed again; call it once in each tick, once a state that `ends_early` is broken off."""
    d[FLOW_LEFT] = MOST_FLOW_WORDS
    if s[RUNNING] == 0:
        s[STARTED_MS] = now


def running_until(s: list[int]) -> uint8:
    """Return the condition that ends the running state; ALWAYS where it has none, or no state runs."""
    if s[RUNNING] == 0:
        return ALWAYS
    return s[WORD] >> UNTIL_AT & 15


def ends_early(s: list[int], d: bytearray, senses: "Senses", levels: tuple[int, ...]) -> uint8:
    """Return 1 where the running state has a condition that ends it with these senses, else 0."""
    until = running_until(s)
    if until == ALWAYS:
        return 0
    lower: uint16 = s[WORD] & LOWER_HALF
    holds = is_met(s, d, until, lower >> UNTIL_LEVEL_AT & 3, lower, senses, levels)
    return 1 if holds != lower >> UNTIL_NOT_AT & 1 else 0


def go_on(
    s: list[int],
    d: bytearray,
    image: ImageWords,
    senses: "Senses",
    now: int,
    levels: tuple[int, ...],
    one_by_one: uint8,
) -> uint8:
    """End the running state if its length is over, execute flow words, and begin a state.

    With ``one_by_one`` it executes one flow word, or begins a state. Call it until it returns DONE: after a late tick
    several states may have ended.

    A word's lower half is found only where it is needed, since that takes a slow chip long.

    Returns:
        BEGUN where a state began, EXECUTED behind one flow word, and DONE where the state goes on, or has to wait.
    """
    if s[RUNNING] and end_state(s, now, levels) == 0:
        return DONE
    index: uint8 = d[NEXT]
    left: uint8 = d[FLOW_LEFT]
    words: uint8 = d[WORDS]
    while left > 0:
        word = image[1 + index]
        upper: uint16 = word >> 16
        behind: uint8 = index + 1
        if behind == words:
            behind = 0
        if upper >> FLOW_AT == 0:
            s[STATE] = index
            d[NEXT] = behind
            d[FLOW_LEFT] = left
            d[VOICES] = 0
            begin_word(s, word, s[STARTED_MS])
            return BEGUN
        left = left - 1
        index = behind
        op = upper >> OP_AT & 7
        if op <= CALL:
            if upper >> CONDITION_AT & 15 == ALWAYS or _holds(s, d, upper, word & LOWER_HALF, senses, levels):
                if op == CALL:
                    place: uint8 = (d[LAST_CALL] + 1) % MOST_CALLS
                    d[LAST_CALL] = place
                    d[RETURNS + place] = behind
                    if d[CALLS] < MOST_CALLS:
                        d[CALLS] = d[CALLS] + 1
                index = upper >> TARGET_AT & 255
        elif op == RETURN:
            index = _return(d)
        else:
            _count_or_tell(s, d, op, upper >> TARGET_AT & 255, word & LOWER_HALF, image)
        if one_by_one:
            d[NEXT] = index
            d[FLOW_LEFT] = left
            return EXECUTED
    d[NEXT] = index
    d[FLOW_LEFT] = 0
    return DONE


def _holds(
    s: list[int], d: bytearray, upper: uint16, lower: uint16, senses: "Senses", levels: tuple[int, ...]
) -> uint8:
    """Return 1 where the condition of a jump or a call, given as its halves, lets it be executed, else 0."""
    holds = is_met(s, d, upper >> CONDITION_AT & 15, lower >> LEVEL_AT & 3, lower, senses, levels)
    return 1 if holds != lower >> IF_NOT_AT & 1 else 0


def _count_or_tell(s: list[int], d: bytearray, op: uint8, target: uint8, lower: uint16, image: ImageWords) -> None:
    """Execute a flow word that goes on at the word behind it."""
    if op == COUNT:
        _count(s, d, lower)
    else:
        _tell(d, target, lower >> VALUE_AT & 255, image)


def _return(d: bytearray) -> uint8:
    """Return the index at which the last call goes on; without a call that of the first word."""
    if d[CALLS] == 0:
        return 0
    d[CALLS] = d[CALLS] - 1
    place = d[LAST_CALL]
    d[LAST_CALL] = (place + MOST_CALLS - 1) % MOST_CALLS
    return d[RETURNS + place]


def is_met(
    s: list[int], d: bytearray, condition: uint8, level: uint8, lower: uint16, senses: "Senses", levels: tuple[int, ...]
) -> uint8:
    """Return 1 where a condition holds, else 0; a flow word's lower half has the counter and the value."""
    if condition == OBSTACLE:
        return 1 if senses.obstacle_mm < levels[AVOID_RADII_MM + level] else 0
    if condition == PERSON:
        return 1 if senses.person else 0
    if condition == VOICE:
        return d[VOICES] >> level & 1
    if condition == FLOOR:
        if level == EITHER_DARK:
            return 1 if senses.dark_floor else 0
        # The levels left, right and both are the sensors that have to be over dark floor.
        return 1 if senses.dark_floor & level == level else 0
    value: uint8 = lower >> VALUE_AT & 255
    if condition == CHANCE:
        return 1 if draw(s) >> 24 < value else 0
    counted = d[COUNTS + (lower >> COUNTER_AT & 3)]
    if level == IS:
        return 1 if counted == value else 0
    if level == BELOW:
        return 1 if counted < value else 0
    return 1 if counted > value else 0


def _count(s: list[int], d: bytearray, lower: uint16) -> None:
    """Execute a count: set or change one of the counters."""
    place: uint8 = COUNTS + (lower >> COUNTER_AT & 3)
    how = lower >> LEVEL_AT & 3
    value: uint8 = lower >> VALUE_AT & 255
    if how == SET:
        d[place] = value
    elif how == RANDOM:
        d[place] = (draw(s) >> 8) % (value + 1)
    elif how == ADD:
        room: uint8 = MOST_COUNT - d[place]
        d[place] = d[place] + (value if value < room else room)
    else:
        d[place] = d[place] - (value if value < d[place] else d[place])


def _tell(d: bytearray, target: uint8, value: uint8, image: ImageWords) -> None:
    """Execute a tell: ask for a slot; of several tells that wait the last one counts."""
    turns: uint8 = 0
    if target == IN_TURN:
        target = 0
        turns = value
        if turns == 0:
            turns = image[0] >> 16 & 255
    d[WAITS] = 1
    d[TOLD] = target
    d[TOLD_TURNS] = turns


def least_slot_ms(levels: tuple[int, ...]) -> int:
    """Return how long a slot lasts at least: a tag tells only NEWER_SLOTS slots from older ones."""
    return (levels[FORGET_MS] + NEWER_SLOTS - 1) // NEWER_SLOTS


def change_slot(s: list[int], d: bytearray, image: ImageWords, now: int, levels: tuple[int, ...]) -> None:
    """Open the slot of a tell that waits, or go on to the slot that ``now`` is in where words are told in turn.

    Call it before the words of a tick and behind them: what is told in a tick comes behind the slots up to then.
    """
    if d[WAITS]:
        # A leader without a tag has sent nothing that a new tag could be taken for.
        if s[TAG] and elapsed_ms(now, s[SLOT_STARTED_MS]) < least_slot_ms(levels):
            return
        d[WAITS] = 0
        d[IS_TELLING] = 1
        d[TURNS] = d[TOLD_TURNS]
        s[SLOT] = d[TOLD]
        s[SLOT_STARTED_MS] = now
        open_next_slot(s, image)
    elif d[TURNS]:
        enter_slot(s, image, d[TURNS], now, levels)


def leader_frame(
    s: list[int], d: bytearray, image: ImageWords, air_is_busy: uint8, now: int, levels: tuple[int, ...]
) -> int:
    """Return the frame of its follower word ``s[SLOT]`` that a leader that tells begins now, or NO_FRAME."""
    change_slot(s, d, image, now, levels)
    if d[IS_TELLING] == 0:
        return NO_FRAME
    return frame_in_slot(s, image, air_is_busy, now, levels)


def watches(s: list[int], d: bytearray) -> uint8:
    """Return 1 while a car whose sensors must be read again and again needs each tick, else 0."""
    return 1 if s[RUNNING] == 0 or d[LOOKS] or running_until(s) != ALWAYS else 0
