"""What the words of a leader that decides may hold: states that a condition may end, and flow words without a length.

Portable: a car's receiver checks each leader word of an upload by `word_fault`, and so does `motorcade.words.image`.
Where the bits are is in `motorcade.words.formats`. Source: the protocol's section "A leader that decides".
"""

from motorcade.words import uint8

# The header's reserved field: the follower words travel with a tag, the leader decides.
TAGGED = 1
DECIDES = 2

# What a flow word does.
JUMP = 0
CALL = 1
RETURN = 2
COUNT = 3
TELL = 4
# What a condition asks.
ALWAYS = 0
OBSTACLE = 1
PERSON = 2
VOICE = 3
FLOOR = 4
COUNTER = 5
CHANCE = 6
# Levels of the condition floor, and of counter.
EITHER_DARK = 0
LEFT_DARK = 1
RIGHT_DARK = 2
BOTH_DARK = 3
IS = 0
BELOW = 1
ABOVE = 2
# What count does, in its level.
SET = 0
ADD = 1
TAKE = 2
RANDOM = 3
# The target of a tell that goes on through the follower words.
IN_TURN = 255
# There are so many counters, from 0 to MOST_COUNT each.
COUNTERS = 4
MOST_COUNT = 255

OPS = ((JUMP, "jump"), (CALL, "call"), (RETURN, "return"), (COUNT, "count"), (TELL, "tell"))
_SENSED = ((OBSTACLE, "obstacle"), (PERSON, "person"), (VOICE, "voice"), (FLOOR, "floor"))
UNTIL_CONDITIONS = ((ALWAYS, "none"),) + _SENSED
CONDITIONS = ((ALWAYS, "always"),) + _SENSED + ((COUNTER, "counter"), (CHANCE, "chance"))

# The highest level of each condition, two bits each, those of ALWAYS the lowest: 0, 3, 0, 1, 3, 2, 0.
_HIGHEST_LEVELS = 3 << 2 | 1 << 6 | 3 << 8 | 2 << 10

# What is wrong with a leader word; 0: nothing.
BAD_FIELD = 1  # a value that has no meaning, or a bit that is 0
BAD_TARGET = 2  # no such leader or follower word
BAD_LEVEL = 3  # the condition has no such level
BAD_COUNT = 4  # a tell in turn counts more follower words than there are
UNTAGGED = 5  # a tell where the follower words travel without a tag


def highest_level(condition: uint8) -> uint8:
    """Return the highest level of a condition, 0 to CHANCE."""
    return _HIGHEST_LEVELS >> condition * 2 & 3


def word_fault(
    first: uint8,
    second: uint8,
    third: uint8,
    fourth: uint8,
    leader_words: uint8,
    follower_words: uint8,
    is_tagged: uint8,
) -> uint8:
    """Return what is wrong with a leader word whose leader decides, BAD_FIELD to UNTAGGED; 0 where nothing is.

    The word comes as its four bytes, the most significant first, since a chip is slow with integers from 2^30 up. The
    other arguments are of the image: how many leader words and follower words it has, and 1 where those have a tag.
    """
    if first < 128:
        until: uint8 = (third & 7) << 1 | fourth >> 7
        if until > FLOOR or fourth & 15:
            return BAD_FIELD
        return BAD_LEVEL if fourth >> 4 & 3 > highest_level(until) else 0
    op = first >> 4 & 7
    condition: uint8 = second & 15
    if op > TELL or condition > CHANCE or third & 6 or fourth & 1:
        return BAD_FIELD
    target: uint8 = (first & 15) << 4 | second >> 4
    if op == TELL:
        return _tell_fault(target, (third & 1) << 7 | fourth >> 1, follower_words, is_tagged)
    if op > CALL:
        return 0
    if target >= leader_words:
        return BAD_TARGET
    return BAD_LEVEL if third >> 5 & 3 > highest_level(condition) else 0


def _tell_fault(target: uint8, value: uint8, follower_words: uint8, is_tagged: uint8) -> uint8:
    """Return what is wrong with a tell; 0 where nothing is."""
    if is_tagged == 0:
        return UNTAGGED
    if target == IN_TURN:
        return BAD_COUNT if value > follower_words else 0
    return BAD_TARGET if target >= follower_words else 0
