"""Random inputs for conformance.py. Portable: CPython and MicroPython draw the same inputs."""

from motorcade.words.flow import COUNTER, DECIDES, IN_TURN, TAGGED, TELL, highest_level
from motorcade.words.infrared import tagged_frame, to_frame
from motorcade.words.packing import words_to_bytes
from motorcade.words.positions import UNUSED_BITS


def draw_word(random, for_leader=False):
    """Return a control word as in an image, with any fields at any level."""
    word = random.bits() & ~UNUSED_BITS
    if for_leader:
        return word & 0x7FFFFFFF | 0x40000000
    # Otherwise half of the words would end all listening, and most would be passed on.
    if not random.one_in(8):
        word |= 0x80000000
    if not random.one_in(3):
        word &= 0xBFFFFFFF
    return word


def draw_leader_word(random, leader_words, follower_words, tagged):
    """Return a state or a flow word of a leader that decides; one of 64 may be a word that no car takes."""
    word = draw_word(random, for_leader=True)
    if random.one_in(2):
        condition = random.below(COUNTER)
        level = random.below(highest_level(condition) + 1)
        return word | condition << 7 | random.below(2) << 6 | level << 4
    op = random.pick((0, 0, 0, 1, 2, 3, 3, TELL, TELL))
    condition, value = random.below(7), random.pick((0, 1, 2, 100, 255))
    level, target = random.below(highest_level(condition) + 1), random.below(leader_words)
    if op == 3:
        level = random.below(4)
    if op == TELL and not tagged:
        op = 2
    if op == TELL:
        target = random.below(follower_words)
        if random.one_in(2):
            target, value = IN_TURN, random.below(follower_words + 1)
    word = 1 << 31 | op << 28 | target << 20 | condition << 16 | random.below(2) << 15 | level << 13
    word = word | random.below(2) << 11 | value << 1
    return word ^ 1 << random.below(31) if random.one_in(64) else word


def draw_image(random):
    leader = [draw_word(random, for_leader=True) for _ in range(random.below(9))]
    followers = [draw_word(random) for _ in range(random.below(6))]
    # A dwell has one bit where there are follower words.
    dwell, tagged = 1 << random.below(8), random.below(2)
    header = len(leader) << 24 | len(followers) << 16 | dwell << 8 | tagged * TAGGED if followers else len(leader) << 24
    if leader and random.one_in(2):
        header = header | DECIDES
        leader = [draw_leader_word(random, len(leader), len(followers), header & TAGGED) for _ in leader]
    return words_to_bytes((header,) + tuple(leader + followers))  # noqa: RUF005 - MicroPython has no [*a]


def draw_frame(random, held, tag):
    """Return a frame for a follower whose word is ``held``, with a tag in half of the cases, often one near ``tag``."""
    kind = random.below(8)
    if kind == 0:
        return to_frame(held)
    frame = to_frame(draw_word(random))
    if random.one_in(2):
        near = (tag + random.pick((0, 0, 0, 1, 1, 2, 15, 16, 30))) % 31 + 1
        frame = tagged_frame(frame, near if random.one_in(2) else random.between(1, 31))
    if kind == 1:
        return frame ^ 1 << random.below(32)
    if kind == 2:
        return to_frame(frame | random.bits() & (UNUSED_BITS - 1))
    if kind == 3:
        # As a remote control's: a command and its complement.
        return frame & 0xFFFFFF00 | 255 - (frame >> 8 & 255)
    return frame


def damaged(random, data):
    """Return ``data``, in half of the cases with one bit wrong, cut off, or with bytes added before or after it."""
    kind = random.below(8)
    at = random.below(len(data) + 1)
    if kind == 0 and at < len(data):
        return data[:at] + bytes([data[at] ^ 1 << random.below(8)]) + data[at + 1 :]
    if kind == 1:
        return data[:at]
    if kind == 2:
        return data + bytes([random.below(256) for _ in range(4)])
    if kind == 3:
        return bytes([random.below(256) for _ in range(random.between(1, 4))]) + data
    return data
