"""What a car is asked besides taking an image. Both ends make and read such requests here.

Portable. Source: seed 000, h3, which is reserved for extensions.

A **check request** announces the checksum of the next image, so that the car accepts no other (docs/adr/0014 gives the
reasons). It is six words: a header that announces two states and three follower words and has 254 in its reserved
field, and those five control words, each with one byte in its reserved field: the image's CRC-32 and a number. A car
that ignores reserved fields takes them for an image in which nothing moves. The car answers
``OK check=<8 hex><2 hex> holds=<8 hex> sum=<8 hex>``: the checksum and the number of the request, the CRC-32 of the
image that the car holds, and the CRC-32 of the line up to there.

A **request** is 48 bytes (docs/cars.md): a header with 253 in its reserved field, and 44 bytes of text: who are you,
blink, take a name, stop, go. No byte is below 32, so a request that lost bytes, or came with some twice, never holds an
image's header; and no image and no check request holds the header of a request. A car that knows no such request waits
for the 481 words that the header announces, or refuses it; it keeps its program. The car answers one line of UTF-8,
``OK car=<kind><2 hex> <fields> sum=<CRC-32 of the line up to there>``, or ``ERR <reason>``.
"""

from binascii import crc32
from collections import namedtuple

from motorcade.words.packing import WORD_BYTES, pack

CHECK_HEADER = 0x020301FE
CHECK_WORDS = 6
CHECK_BYTES = CHECK_WORDS * WORD_BYTES
# How long a car waits for the announced image, counted from the last byte that came.
CHECK_LASTS_MS = 10000
# Bits that have no effect while motor and avoidance are off. They keep every byte of a
# word above zero, whereas the words of an image end in a zero byte. So a request that
# lost some bytes, or came with some bytes twice, is never an image.
MARKS = 0x01010802
PAYLOAD_AT = 2

REQUEST_HEADER = 0xF0F0F0FD
REQUEST_BEGINS = REQUEST_HEADER.to_bytes(4, "big")
REQUEST_BYTES = 48
# Where the text of a request ends and its CRC-32 begins: eight bytes, each 64 plus a hexadecimal digit.
SUM_AT = 40
# The text of a request: its kind, a number of two hexadecimal digits, a name.
KIND_AT = 4
_NAME_AT = 8
NAME_BYTES = SUM_AT - _NAME_AT
BLINK_MS = 5000
ASK, BLINK, NAME, STOP, GO = REQUEST_KINDS = ("a", "b", "n", "s", "g")

# The reason for which a car that keeps no name refuses one.
KEEPS_NO_NAME = "name-not-kept"

Request = namedtuple("Request", ("kind", "number", "name"))
"""A request: one of REQUEST_KINDS, a number of two hexadecimal digits (text) that the answer repeats, and a name."""


def check_request(checksum: int, number: int) -> bytes:
    """Return the request that announces an image with the CRC-32 ``checksum``.

    ``number`` (0 to 255) distinguishes requests.
    """
    payload = pack(checksum) + bytes([number])
    return pack(CHECK_HEADER) + b"".join([pack(MARKS | byte << PAYLOAD_AT) for byte in payload])


def check_words(checksum: int, number: int) -> bytes:
    """Return the beginning of the answer to a check request with this checksum and number."""
    return f"OK check={checksum:08x}{number:02x}".encode()


def ready_line(beginning: bytes, held: bytes) -> bytes:
    """Return the whole answer of a car that holds the image ``held``; ``beginning`` comes from `check_words`."""
    return _with_sum(beginning + f" holds={crc32(held):08x}".encode())


def held_checksum(line: bytes, beginning: bytes) -> int | None:
    """Return the CRC-32 of the image that the car holds, from its answer; None where the line is no such answer."""
    answer = _answer_in(line, beginning)
    begin, _, checksum = (answer or b"").partition(b" holds=")
    try:
        return int(checksum, 16) if begin == beginning else None
    except ValueError:
        return None


def _with_sum(answer: bytes) -> bytes:
    """Return the line of an answer, with the CRC-32 of the line up to there."""
    return answer + f" sum={crc32(answer):08x}\n".encode()


def _answer_in(line: bytes, beginning: bytes) -> bytes | None:
    """Return the answer that begins so, without its sum; None where there is none or it was changed on the way."""
    text, _, checksum = line.rstrip().rpartition(b" sum=")
    at = text.find(beginning)
    return text[at:] if at >= 0 and checksum == f"{crc32(text[at:]):08x}".encode() else None


def car_request(kind: str, number: int, name: str = "") -> bytes:
    """Return a request; ``number`` is 0 to 255, ``name`` has at most NAME_BYTES bytes of UTF-8, none of them spaces."""
    text = f"{kind}{number:02x} ".encode() + name.encode()
    text = text + b" " * (SUM_AT - KIND_AT - len(text))
    digits = [64 + (crc32(text) >> shift & 15) for shift in range(28, -4, -4)]
    return REQUEST_BEGINS + text + bytes(digits)


def read_request(data: bytes) -> Request | None:
    """Return the request in REQUEST_BYTES bytes; None where they were changed on the way."""
    checksum = 0
    for digit in data[SUM_AT:REQUEST_BYTES]:
        checksum = checksum << 4 | digit & 15
    if data[:KIND_AT] != REQUEST_BEGINS or checksum != crc32(data[KIND_AT:SUM_AT]):
        return None
    try:
        number = str(data[KIND_AT + 1 : KIND_AT + 3], "ascii")
        name = str(data[_NAME_AT:SUM_AT], "utf-8").strip(" ")
    except ValueError:
        return None
    return Request(chr(data[KIND_AT]), number, name)


def split_requests(data: bytes) -> "tuple[bytes, list[bytes], bytes]":
    """Take requests out of the bytes of a stream: the bytes of an upload, whole requests, the beginning of one.

    No upload holds the header of a request, so that stands at the beginning of one wherever it is.
    """
    requests = []
    at = data.find(REQUEST_BEGINS)
    while at >= 0 and len(data) - at >= REQUEST_BYTES:
        requests.append(data[at : at + REQUEST_BYTES])
        data = data[:at] + data[at + REQUEST_BYTES :]
        at = data.find(REQUEST_BEGINS)
    if at < 0:
        # No upload ends like the header of a request begins.
        at = len(data)
        while at > 0 and len(data) - at < len(REQUEST_BEGINS) - 1 and data[at - 1] == REQUEST_BEGINS[0]:
            at -= 1
    return data[:at], requests, data[at:]


def is_car_name(name: str) -> bool:
    """Whether a car may have this name: 1 to 32 bytes of UTF-8, letters, digits, '-' and '_'.

    MicroPython can't tell which other characters are letters: there all above ASCII count.
    """
    for character in name:
        if ord(character) < 128 and not (character.isalpha() or character.isdigit() or character in "-_"):
            return False
    return 0 < len(name.encode()) <= NAME_BYTES


def checksum_text(image: bytes) -> str:
    """Return an image's CRC-32 as the answers of cars have it."""
    return f"{crc32(image):08x}"


def answer_line(request: Request, fields: "tuple[tuple[str, str], ...]") -> bytes:
    """Return a car's answer to ``request``; ``fields`` are names and values without spaces; empty ones are left out."""
    line = f"OK car={request.kind}{request.number}"
    for name, value in fields:
        if value:
            line = line + f" {name}={value}"
    return _with_sum(line.encode())


def read_answer(line: bytes) -> "dict[str, str] | None":
    """Return the fields of a car's answer, without its end of line; None where it is none or was changed on the way.

    The field ``car`` is the kind and the number of the request. All are text that a stranger may have sent.
    """
    answer = _answer_in(line, b"OK car=")
    try:
        parts = str(answer[3:], "utf-8").split(" ") if answer else []
    except ValueError:
        return None
    return {part.partition("=")[0]: part.partition("=")[2] for part in parts} or None
