"""Which infrared frames a car sends, and what it does with those that it receives; a part of its brain.

Functions of integers as in `motorcade.car.brain`, which describes their arguments. A slot is the time in which a leader
sends one follower word. A bare word is sent again and again during its slot. Each car begins a tagged word once,
however often it receives the word, and cars pass it on as RFC 6206 (Trickle) describes. Source: the protocol's sections
"What a car does with a word" and "Tagged words".
"""

from motorcade.car.brain import (
    DWELLS_MS,
    FIRST_INTERVAL_MS,
    FORGOTTEN,
    GAP_MS,
    HOLDS,
    INTERVAL,
    INTERVAL_MS,
    LAST_INTERVAL_MS,
    LOST_CHECK,
    LOST_PARITY,
    LOST_REMOTE,
    LOST_RESERVED,
    NEXT_FRAME_MS,
    QUIET_MS,
    REDUNDANCY,
    RELAY,
    RELAY_MS,
    RELAY_PERIOD_MS,
    RELAYED,
    REPLACED_TAG_AT,
    RUNNING,
    SAME_TAG,
    SENSE_MS,
    SENT,
    SLOT,
    SLOT_STARTED_MS,
    TAG,
    TAG_MASK,
    UNIT_US,
    WORD,
    ImageWords,
    begin_word,
    break_off,
    draw,
)
from motorcade.words import uint8
from motorcade.words.flow import TAGGED
from motorcade.words.infrared import (
    air_us,
    check_is_good,
    is_remote_control,
    next_tag,
    parity_is_even,
    tag_is_newer,
    tag_of,
    tagged_frame,
    to_frame,
    word_of,
)
from motorcade.words.positions import ACCEPT_IR_AT, CHECK_BITS, FORWARD_AT
from motorcade.words.ticks import elapsed_ms, later_ms, reached

# States of sending, in RELAY.
BUSY = 0  # waits for the air to be free
SENSING = 1  # the air has been free since RELAY_MS
WAITING = 2  # sends at RELAY_MS if the air is free then
SCHEDULED = 3  # begins to sense at RELAY_MS
LISTENING = 4  # senses since RELAY_MS, and sends at once if the air stays free
RESTING = 5  # sends no more in this interval

# A leader sends a new tagged word OPENING_FRAMES times within OPENING_MS. Then it repeats it as a follower would.
OPENING_FRAMES = 3
OPENING_MS = 500

# In place of a frame: each has an even number of ones.
NO_FRAME = 1

# What a follower did with a frame.
BEGUN = 0
IGNORED = 1
BAD_PARITY = 2
BAD_RESERVED = 3
DEAF = 4  # the running word does not accept infrared
BAD_CHECK = 5
REMOTE = 6  # a remote control sent it


def dwell_ms(image: ImageWords, levels: tuple[int, ...]) -> int:
    """Return how long a leader with ``image`` sends each follower word."""
    dwell = image[0] >> 8 & 255
    level = 0
    while dwell >> level > 1:
        level = level + 1
    return levels[DWELLS_MS + level]


def frame_ms(frame: int, levels: tuple[int, ...]) -> int:
    """Return how long a frame occupies the air, in whole milliseconds."""
    return (air_us(frame, levels[UNIT_US]) + 999) // 1000


def leader_begin(s: list[int], image: ImageWords, now: int) -> None:
    """Begin to send the follower words of a leader's image."""
    at = 1 + (image[0] >> 24)
    end = at + (image[0] >> 16 & 255)
    # One operation a word: it takes a microcontroller long with integers from 2^30 up.
    words = 0
    while at < end:
        words = words | image[at]
        at = at + 1
    s[RELAYED] = words >> FORWARD_AT & 1
    s[SLOT] = 0
    s[SLOT_STARTED_MS] = now
    s[NEXT_FRAME_MS] = now
    forget_frame(s, now)
    # A new image counts on, since followers would ignore its words with tags that look old.
    if is_tagged(image) and image[0] >> 16 & 255:
        open_next_slot(s, image)
    else:
        s[TAG] = 0


def forget_frame(s: list[int], now: int) -> None:
    """Forget the last frame of a car: it is over within a second, so a later end was set more than six days ago."""
    if elapsed_ms(s[QUIET_MS], now) > 1000:
        s[QUIET_MS] = now


def is_tagged(image: ImageWords) -> uint8:
    """Return 1 where the follower words of ``image`` travel with a tag, else 0."""
    return 1 if image[0] & TAGGED else 0


def leader_frame(s: list[int], image: ImageWords, air_is_busy: uint8, now: int, levels: tuple[int, ...]) -> int:
    """Return the frame of its follower word ``s[SLOT]`` that the leader begins now, or NO_FRAME.

    ``air_is_busy`` is 1 while the car senses a carrier; a leader of bare words ignores it.
    """
    header = image[0]
    follower_words = header >> 16 & 255
    if follower_words == 0:
        return NO_FRAME
    if header & TAGGED:
        enter_slot(s, image, follower_words, now, levels)
        return frame_in_slot(s, image, air_is_busy, now, levels)
    if reached(now, s[NEXT_FRAME_MS]) == 0 or reached(now, s[QUIET_MS]) == 0:
        return NO_FRAME
    enter_slot(s, image, follower_words, now, levels)
    frame = to_frame(_slot_word(s, image))
    s[QUIET_MS] = later_ms(now, frame_ms(frame, levels) + levels[GAP_MS])
    if s[RELAYED] == 0:
        s[NEXT_FRAME_MS] = s[QUIET_MS]
    while s[RELAYED] and reached(now, s[NEXT_FRAME_MS]):
        s[NEXT_FRAME_MS] = later_ms(s[NEXT_FRAME_MS], levels[RELAY_PERIOD_MS])
    return frame


def _slot_word(s: list[int], image: ImageWords) -> int:
    """Return the follower word of a leader's present slot."""
    return image[1 + (image[0] >> 24) + s[SLOT]]


def enter_slot(s: list[int], image: ImageWords, count: uint8, now: int, levels: tuple[int, ...]) -> None:
    """Go on to the slot that ``now`` is in, where the first ``count`` follower words are sent in turn."""
    dwell = dwell_ms(image, levels)
    while elapsed_ms(now, s[SLOT_STARTED_MS]) >= dwell:
        s[SLOT_STARTED_MS] = later_ms(s[SLOT_STARTED_MS], dwell)
        s[SLOT] = s[SLOT] + 1
        if s[SLOT] == count:
            s[SLOT] = 0
        if s[TAG]:
            open_next_slot(s, image)


def open_next_slot(s: list[int], image: ImageWords) -> None:
    """Give the tagged word of the slot, which has begun, the next tag, and make its first frame due."""
    s[TAG] = next_tag(s[TAG], _slot_word(s, image))
    s[SENT] = 0
    s[INTERVAL] = 0
    s[RELAY] = SCHEDULED
    s[RELAY_MS] = s[SLOT_STARTED_MS]


def frame_in_slot(s: list[int], image: ImageWords, air_is_busy: uint8, now: int, levels: tuple[int, ...]) -> int:
    """Return the frame of its present slot that a leader of tagged words begins now, or NO_FRAME.

    It sends a new word at once and twice more within OPENING_MS. Then it repeats the word as a follower does, but
    counts no frames of others, because a leader receives none. Where the air is busy it sends as soon as the air is
    free. So it comes before the followers, which wait for a random time.
    """
    if reached(now, s[QUIET_MS]) == 0:
        return NO_FRAME
    if _is_time_to_send(s, now, levels) == 0:
        return NO_FRAME
    begins = 1 if s[INTERVAL] == 0 and s[SENT] == 0 and s[RELAY] == LISTENING else 0
    if begins == 0 or air_is_busy:
        begins = _finds_air_free(s, air_is_busy, 1, now, levels)
    if begins == 0:
        return NO_FRAME
    frame = tagged_frame(_slot_word(s, image), s[TAG])
    s[QUIET_MS] = later_ms(now, frame_ms(frame, levels) + levels[GAP_MS])
    s[RELAY] = RESTING
    if s[INTERVAL] == 0:
        _go_on_opening(s, levels)
    return frame


def _go_on_opening(s: list[int], levels: tuple[int, ...]) -> None:
    """Schedule the frame after one of the first OPENING_FRAMES of a slot."""
    s[SENT] = s[SENT] + 1
    s[RELAY] = SCHEDULED
    if s[SENT] < OPENING_FRAMES:
        part_ms = OPENING_MS // (OPENING_FRAMES - 1)
        wait_ms = part_ms * (s[SENT] - 1) + part_ms // 2 + (draw(s) >> 8) % (part_ms // 2)
        s[RELAY_MS] = later_ms(s[SLOT_STARTED_MS], wait_ms)
    else:
        s[INTERVAL] = levels[FIRST_INTERVAL_MS]
        s[INTERVAL_MS] = later_ms(s[SLOT_STARTED_MS], OPENING_MS)
        s[RELAY_MS] = later_ms(s[INTERVAL_MS], (draw(s) >> 8) % s[INTERVAL])


def follower_hears(s: list[int], frame: int, now: int, levels: tuple[int, ...]) -> uint8:
    """Take a frame that ended now; call follower_step first. Return the result, BEGUN to REMOTE."""
    if s[RUNNING] and s[WORD] >> ACCEPT_IR_AT & 1 == 0:
        return DEAF
    if is_remote_control(frame):
        s[LOST_REMOTE] = s[LOST_REMOTE] + 1
        return REMOTE
    if parity_is_even(frame) == 0:
        s[LOST_PARITY] = s[LOST_PARITY] + 1
        return BAD_PARITY
    if tag_of(frame):
        return _hears_tagged(s, frame, now, levels)
    if frame & CHECK_BITS:
        s[LOST_RESERVED] = s[LOST_RESERVED] + 1
        return BAD_RESERVED
    if s[TAG] and s[TAG] & FORGOTTEN == 0:
        return IGNORED
    word = word_of(frame)
    if s[RUNNING] and s[WORD] == word:
        return IGNORED
    if s[TAG]:
        s[TAG] = 0
        s[RELAY] = BUSY
    _replace(s, word, now, levels)
    return BEGUN


def _hears_tagged(s: list[int], frame: int, now: int, levels: tuple[int, ...]) -> uint8:
    """Take a tagged frame: begin its word if the tag is newer than the car's own; count it if the tag is the same."""
    if check_is_good(frame) == 0:
        s[LOST_CHECK] = s[LOST_CHECK] + 1
        return BAD_CHECK
    tag = tag_of(frame)
    own_tag = s[TAG] & TAG_MASK
    is_newer = 1
    if own_tag:
        is_newer = tag_is_newer(tag, own_tag)
    if tag == s[TAG] >> REPLACED_TAG_AT:
        is_newer = 0
    if is_newer or (s[TAG] & FORGOTTEN and tag != own_tag):
        _replace(s, word_of(frame), now, levels)
        s[TAG] = tag
        if is_newer == 0:
            s[TAG] = tag | own_tag << REPLACED_TAG_AT
        s[INTERVAL] = 0
        if s[WORD] >> FORWARD_AT & 1:
            s[INTERVAL] = levels[FIRST_INTERVAL_MS]
            s[INTERVAL_MS] = now
            s[SAME_TAG] = 1
            s[RELAY] = SCHEDULED
            s[RELAY_MS] = later_ms(now, (draw(s) >> 8) % s[INTERVAL])
        return BEGUN
    if s[INTERVAL] == 0:
        return IGNORED
    if tag == own_tag:
        s[SAME_TAG] = s[SAME_TAG] + 1
    elif s[INTERVAL] > levels[FIRST_INTERVAL_MS]:
        # The sender has an older word: pass the own word on soon.
        _begin_interval(s, levels[FIRST_INTERVAL_MS], now)
    return IGNORED


def _replace(s: list[int], word: int, now: int, levels: tuple[int, ...]) -> None:
    """Let a follower begin ``word``, whatever it ran before."""
    if s[RUNNING]:
        break_off(s, now, levels)
    s[HOLDS] = 1
    begin_word(s, word, now)


def follower_frame(s: list[int], air_is_busy: uint8, now: int, levels: tuple[int, ...]) -> int:
    """Return the frame of ``s[WORD]`` that a follower which passes its word on begins now, or NO_FRAME.

    ``air_is_busy`` is 1 while the car senses a carrier or sends one itself. A tagged word is passed on as RFC 6206
    (Trickle) describes: once in each interval, unless enough others nearby sent the same tag in it.
    """
    if s[HOLDS] == 0 or s[WORD] >> FORWARD_AT & 1 == 0:
        s[RELAY] = BUSY
        return NO_FRAME
    if s[TAG] == 0:
        if _finds_air_free(s, air_is_busy, levels[RELAY_PERIOD_MS], now, levels):
            return to_frame(s[WORD])
        return NO_FRAME
    if s[INTERVAL] == 0 or _is_time_to_send(s, now, levels) == 0:
        return NO_FRAME
    if s[SAME_TAG] >= levels[REDUNDANCY]:
        s[RELAY] = RESTING
        return NO_FRAME
    # While the air is busy, many cars wait, and most of them need not send: enough others do. So waits are long.
    if _finds_air_free(s, air_is_busy, s[INTERVAL] * 2, now, levels) == 0:
        return NO_FRAME
    s[RELAY] = RESTING
    return tagged_frame(s[WORD], s[TAG] & TAG_MASK)


def _is_time_to_send(s: list[int], now: int, levels: tuple[int, ...]) -> uint8:
    """Return 1 from that time of an interval on at which a tagged word is due to be sent, else 0."""
    if s[RELAY] == RESTING:
        if elapsed_ms(now, s[INTERVAL_MS]) < s[INTERVAL]:
            return 0
        interval = s[INTERVAL] * 2
        if interval > levels[LAST_INTERVAL_MS]:
            interval = levels[LAST_INTERVAL_MS]
        _begin_interval(s, interval, now)
    if s[RELAY] == SCHEDULED:
        if reached(now, s[RELAY_MS]) == 0:
            return 0
        s[RELAY] = LISTENING
        s[RELAY_MS] = now
    if s[RELAY] == WAITING:
        return reached(now, s[RELAY_MS])
    return 1


def _begin_interval(s: list[int], interval: int, now: int) -> None:
    """Begin an interval of ``interval`` ms; the frame is due at a random time in its second half."""
    s[INTERVAL] = interval
    s[INTERVAL_MS] = now
    s[SAME_TAG] = 0
    s[RELAY] = SCHEDULED
    half = interval // 2
    s[RELAY_MS] = later_ms(now, half + (draw(s) >> 8) % (interval - half))


def _finds_air_free(s: list[int], air_is_busy: uint8, wait_ms: int, now: int, levels: tuple[int, ...]) -> uint8:
    """Return 1 where a frame may begin now, else 0.

    Once the air has been free for SENSE_MS, the car draws a wait below ``wait_ms`` and sends if the air is still free
    when the wait is over. In the state LISTENING it sends without this wait.
    """
    if s[RELAY] != WAITING:
        if air_is_busy:
            s[RELAY] = BUSY
            return 0
        if s[RELAY] == BUSY:
            s[RELAY] = SENSING
            s[RELAY_MS] = now
        if elapsed_ms(now, s[RELAY_MS]) < levels[SENSE_MS]:
            return 0
        if s[RELAY] == LISTENING:
            return 1
        s[RELAY] = WAITING
        s[RELAY_MS] = later_ms(now, (draw(s) >> 8) % wait_ms)
    if reached(now, s[RELAY_MS]) == 0:
        return 0
    s[RELAY] = BUSY
    if air_is_busy:
        return 0
    return 1
