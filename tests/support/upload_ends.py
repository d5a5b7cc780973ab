"""A car's shell around its end of an upload, and what comes to it: images, in any pieces."""

from itertools import pairwise

from hypothesis import strategies as st

from motorcade.words import request, upload
from motorcade.words.image import Image, image_words
from motorcade.words.packing import WORD_BYTES, bytes_to_words, words_to_bytes

NO_PROGRAM = bytes(4)
OLD = bytes.fromhex("01000000 6a800000")
NEW = bytes.fromhex("02000000 65800000 6a800000")
NEW_OK = b"OK words=3 crc32=325d103a\n"
CHECK_OF_NEW = request.check_request(0x325D103A, 7)
BAD_HEADER = bytes.fromhex("00010300")  # a dwell with two bits
BAD_WORD = bytes.fromhex("01000000 40000001")  # a word with its parity bit

LAST_TICK = 1_073_741_823
STARTS_MS = st.sampled_from([0, 12_345, LAST_TICK - 700, LAST_TICK])


@st.composite
def images(draw):
    # Control words as an image holds them: bits 11-1 (reserved) and 0 (parity) are 0.
    row = st.lists(st.integers(0, 0x1FFFFF).map(lambda upper_bits: upper_bits << 11), max_size=5)
    leader, followers = draw(row), draw(row)
    tagged = draw(st.integers(0, 1)) if followers else 0
    return words_to_bytes(image_words(Image(leader, followers, draw(st.integers(0, 7)), tagged)))


programs = images().filter(lambda image: image != NO_PROGRAM)


@st.composite
def pieces(draw, data):
    """``data`` as it may come, cut anywhere."""
    cuts = sorted(draw(st.sets(st.integers(1, len(data) - 1), max_size=8)))
    return [data[begin:end] for begin, end in pairwise([0, *cuts, len(data)])]


class ReceivingCar:
    """A car's shell: does what its end says, and keeps what it answers."""

    def __init__(self, stored=NO_PROGRAM, most_words=511):
        self.stored = stored
        self._end = upload.CarEnd(most_words)

    def take(self, data, now_ms):
        """Receive ``data``; gives the events' kinds and all that the car sends back."""
        kinds, answer = [], b""
        for event in events_of(self._end, [(data, 0)], now_ms):
            kinds.append(event.kind)
            if event.kind == upload.IMAGE:
                self.stored = event.image
            if event.kind == upload.READBACK:
                answer += self.stored
            elif event.kind == upload.CHECK:
                answer += request.ready_line(event.answer, self.stored)
            else:
                answer += event.answer
        return kinds, answer


def events_of(end, arrivals, now_ms):
    """All that ``end`` reports while the arrivals come, each after its pause."""
    events: list[upload.CarEvent] = []
    for data, pause_ms in arrivals:
        now_ms = now_ms + pause_ms & LAST_TICK
        end.receive_data(data, now_ms)
        events += iter(end.next_event, None)
    return events


def outcome_of(end, data, now_ms):
    """The kind of the outcome of ``end`` once it has ``data``; None while there is none."""
    end.receive_data(data, now_ms)
    return end.outcome and end.outcome.kind


def read_check(sent: bytes) -> tuple[int, int] | None:
    """The checksum and the number of a check request, read as a car does but without its receiver.

    None where it was damaged on the way.
    """
    words = bytes_to_words(sent[WORD_BYTES : request.CHECK_BYTES])
    if any(word & (0xFFFFFFFF ^ 0xFF << request.PAYLOAD_AT) != request.MARKS for word in words):
        return None
    payload = bytes(word >> request.PAYLOAD_AT & 0xFF for word in words)
    return int.from_bytes(payload[:WORD_BYTES], "big"), payload[WORD_BYTES]
