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
# The same of what ends a state of a leader that decides, and of a flow word.
UNTIL_AT = 7
UNTIL_NOT_AT = 6
UNTIL_LEVEL_AT = 4
OP_AT = 28
TARGET_AT = 20
CONDITION_AT = 16
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
