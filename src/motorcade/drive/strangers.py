"""Tell drive commands from what other programs send to a car's ports, and tell the car's console of it.

Any program may find a car's port, and a command is only four bytes: one in 23 random ones are a command. So a car
believes a connection by its first words alone (`motorcade.drive.channels`), and names here what others speak.
"""

import re
from collections import OrderedDict
from collections.abc import Callable

from motorcade.drive.motors import check_commands
from motorcade.drive.stamps import STAMP_MASK
from motorcade.drive.wire import SPEED_MASK, WORDS
from motorcade.errors import MotorcadeError, Phrase
from motorcade.sockets import network_of
from motorcade.timing import RateLimit
from motorcade.words.field import WordError
from motorcade.words.ticks import elapsed_ms

_PROTOCOLS = (
    ("stranger-tls", re.compile(rb"\x16\x03[\x00-\x04]")),
    ("stranger-http", re.compile(rb"(GET|HEAD|POST|PUT|DELETE|PATCH|CONNECT|PRI) ")),
    ("stranger-ssh", re.compile(rb"SSH-")),
)
_OTHER_ORDER = {"big": "little", "little": "big"}
_SHOWN_BYTES = 8
# The same sentence about the same client is not said again before it was left out for so long.
_QUIET_MS = 60_000
_MOST_KNOWN = 200
_MOST_A_MINUTE = 20


def may_begin(words: list[int]) -> bool:
    """Whether a client's first words, one or two of them, may be a driver's; all of them are commands.

    A stamp fills the bits that are 0 otherwise and mark a command. Who stamps begins with speed 0, since nothing
    stamped moves a car whose clock isn't answered; and who begins without stamps goes on without.
    """
    stamps = [word & STAMP_MASK for word in words]
    return not stamps[0] or (not words[0] & SPEED_MASK and all(stamps))


def who_speaks(data: bytes, byte_order: str, problem: MotorcadeError | None = None) -> Phrase:
    """Say what a client speaks that sends no commands to the port for them, or no requests to the other one.

    Args:
        data: what came from it.
        byte_order: of this car's commands, "big" or "little".
        problem: why one of its words is no command, or what it sent no request; None where the first command has a
            stamp and a speed.
    """
    for key, begins in _PROTOCOLS:
        if begins.match(data):
            return Phrase(key)
    other = _OTHER_ORDER[byte_order]
    if problem and _are_commands(data, byte_order):
        return Phrase("stranger-commands")
    if problem and _are_commands(data, other):
        count = len(data) // WORDS[other].size
        return Phrase("stranger-byte-order", count=count, reason=problem, order=other)
    begin = data[:_SHOWN_BYTES]
    if begin.isascii() and begin.decode("ascii").isprintable():
        shown = begin.decode("ascii")
    else:
        shown = begin.hex(" ")
    return Phrase("stranger-other", reason=problem or Phrase("stranger-first-word"), data=shown)


def _are_commands(data: bytes, byte_order: str) -> bool:
    word = WORDS[byte_order]
    words = [number for (number,) in word.iter_unpack(data[: len(data) // word.size * word.size])]
    try:
        check_commands(words)
    except WordError:
        return False
    return bool(words)


class Refusals:
    """Say on a car's console why it doesn't obey a client, each reason once, and not too much in all.

    Args:
        clock: gives the time in ms (`motorcade.words.ticks`).

    Attributes:
        say: is called with a sentence; it must not block.
    """

    def __init__(self, clock: Callable[[], int]) -> None:
        self.say: Callable[[Phrase], None] = lambda sentence: None
        self._clock = clock
        # When each was last due, the oldest first, by client and sentence.
        self._known: OrderedDict[tuple[str, str], int] = OrderedDict()
        self._rate = RateLimit(_MOST_A_MINUTE, 60_000)

    def tell(self, client: str, name: str, why: Phrase) -> None:
        """Say why ``client``, an address or a name in a certificate, is refused; ``name`` is what others are shown."""
        kind, now = (network_of(client), why.key), self._clock()
        before = self._known.pop(kind, None)
        self._known[kind] = now
        if len(self._known) > _MOST_KNOWN:
            self._known.popitem(last=False)
        is_new = before is None or elapsed_ms(now, before) > _QUIET_MS
        if is_new and self._rate.allows(now):
            self.say(Phrase("client-refused", client=name, why=why))
