"""A serial line that loses, doubles and flips bytes or dies, in virtual time, with a car at its other end."""

from collections import deque
from dataclasses import dataclass

from motorcade.car.loop import Car
from motorcade.words.image import announced_words
from motorcade.words.packing import WORD_BYTES, unpack
from motorcade.words.ticks import TICKS_MASK
from motorcade.words.upload import SILENCE_MS, error_line, ok_line
from support.mock_board import MockBoard


@dataclass
class Faults:
    """What goes wrong in one direction: chances for each byte, and for certain.

    ``dead_from``, ``dead_until`` and ``flipped_at`` count bytes from 1; the bits in ``stuck`` arrive as zeros.
    """

    dropped: float = 0
    doubled: float = 0
    flipped: float = 0
    dead_from: int | None = None
    dead_until: int | None = None
    flipped_at: tuple[int, ...] = ()
    stuck: int = 0


class Way:
    """One direction of a line, in which bytes keep their order."""

    def __init__(self, faults, random):
        self._faults = faults
        self._random = random
        self._pieces: deque[tuple[int, bytes]] = deque()
        self._count = 0

    def put(self, data, now_ms):
        """Send ``data`` at ``now_ms``, which never wraps here."""
        faults, random = self._faults, self._random
        came = bytearray()
        for byte in data:
            self._count += 1
            if faults.dead_from is not None and faults.dead_from < self._count <= (faults.dead_until or 1 << 30):
                continue
            draw = random.random()
            if draw < faults.dropped:
                continue
            if draw < faults.dropped + faults.flipped or self._count in faults.flipped_at:
                byte ^= 1 << random.randrange(8)
            byte &= ~faults.stuck
            came.append(byte)
            if draw > 1 - faults.doubled:
                came.append(byte)
        if came:
            self._pieces.append((now_ms, bytes(came)))

    def take(self, now_ms):
        """What has arrived by ``now_ms``."""
        data = b""
        while self._pieces and self._pieces[0][0] <= now_ms:
            data += self._pieces.popleft()[1]
        return data

    def next_ms(self):
        """When the next bytes arrive; None where none are under way."""
        return self._pieces[0][0] if self._pieces else None


class LineBoard(MockBoard):
    """A leader's board at the end of two ways."""

    def __init__(self, stored, there, back):
        super().__init__(stored)
        self._there, self._back = there, back

    def now_ms(self):
        return self.clock_ms & TICKS_MASK

    def read_serial(self):
        return self._there.take(self.clock_ms)

    def write_serial(self, data):
        self._back.put(data, self.clock_ms)


class RealCar:
    """The loop of every car, at the end of two ways."""

    def __init__(self, stored, there, back, most_words=511):
        self._board = LineBoard(stored, there, back)
        self._board.most_words = most_words
        self._car = Car(self._board)

    @property
    def holds(self):
        return self._board.image

    def tick(self, now_ms):
        self._board.clock_ms = now_ms
        self._car.tick()


class SimpleCar:
    """A car of somebody else's: takes what its header announces, tells by ``judge`` whether to keep it, and answers.

    ``judge`` gives the reason for which it refuses an image, or None.
    """

    def __init__(self, stored, there, back, judge):
        self.holds = stored
        self._there, self._back, self._judge = there, back, judge
        self._buffer, self._last_ms, self._refuses = b"", 0, False

    def tick(self, now_ms):
        data = self._there.take(now_ms)
        if now_ms - self._last_ms >= SILENCE_MS:
            self._buffer, self._refuses = b"", False
        if not data:
            return
        self._last_ms = now_ms
        self._buffer += b"" if self._refuses else data
        while len(self._buffer) >= WORD_BYTES:
            length = WORD_BYTES * announced_words(unpack(self._buffer[:WORD_BYTES]))
            if len(self._buffer) < length:
                return
            self._take(self._buffer[:length], now_ms)
            self._buffer = b"" if self._refuses else self._buffer[length:]

    def _take(self, image, now_ms):
        reason = self._judge(image)
        self._refuses = reason is not None
        if reason is None:
            self.holds = image
        self._back.put(ok_line(image) if reason is None else error_line(reason), now_ms)


def talk_through(talk, car, there, back, most_ms=120_000):
    """Let an uploader talk with a car until it is done and the last byte has arrived.

    Time leaps to the next moment at which anybody may act.
    """
    now, last_byte_ms = 0, 0
    while talk.outcome is None:
        assert now < most_ms, "the talk goes on for ever"
        there.put(talk.step(back.take(now), now & TICKS_MASK), now)
        if there.next_ms() == now:
            last_byte_ms = now
        car.tick(now)
        moments = [there.next_ms(), back.next_ms(), now + talk.rest_ms]
        moments += [last_byte_ms + SILENCE_MS] if last_byte_ms + SILENCE_MS > now else []
        now = min(max(each, now + 1) for each in moments if each is not None)
    while there.next_ms() is not None:
        now = max(now, there.next_ms())
        car.tick(now)
    car.tick(now + SILENCE_MS)
