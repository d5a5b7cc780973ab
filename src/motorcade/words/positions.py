"""Where the fields of words are, as numbers: a car needs no more of the formats.

Portable. Written by scripts/generate.py from `motorcade.words.formats`; don't edit.
"""

# The lowest bit of each field of a control word.
ACCEPT_IR_AT = 31
FORWARD_AT = 30
MOTOR_ENABLE_AT = 29
MOTOR_DIRECTION_AT = 27
MOTOR_SPEED_AT = 25
MOTOR_DURATION_AT = 23
LED_WHICH_AT = 21
LED_DURATION_AT = 19
AVOID_ENABLE_AT = 18
AVOID_RADIUS_AT = 16
AVOID_DURATION_AT = 14
VOICE_AT = 13
PIR_AT = 12
FLOOR_AT = 11
# The same of what ends a state of a leader that decides.
UNTIL_AT = 7
UNTIL_NOT_AT = 6
UNTIL_LEVEL_AT = 4
# The same of a flow word, in its upper half (up to the condition) or its lower half, of 16 bits each: a chip is slow
# with integers from 2^30 up.
OP_AT = 12
TARGET_AT = 4
CONDITION_AT = 0
IF_NOT_AT = 15
LEVEL_AT = 13
COUNTER_AT = 11
VALUE_AT = 1
# The bits of a control word that are 0 in an image.
UNUSED_BITS = 0x000007FF
# The bits of a frame's check.
CHECK_BITS = 0x0000003E
# The largest value of a header's reserved field that has a meaning.
MOST_RESERVED = 3
# The lowest bit of a drive command's speed, and the command that stands still with its wheels straight.
DRIVE_SPEED_AT = 11
DRIVE_NEUTRAL = 0x15A80000
