"""A serial line that loses, doubles, flips and delays bytes or dies, in virtual time, with a car at its other end."""

from collections import deque
from dataclasses import dataclass

from motorcade.car.board import Board
from motorcade.car.loop import Car
from motorcade.sim.levels import levels_of
from motorcade.words.ticks import TICKS_MASK
from motorcade.words.upload import SILENCE_MS
from strategies import CLASSROOM


@dataclass
class Faults:
    """What goes wrong in one direction: chances for each byte, chances for each piece, and when the line dies."""

    dropped: float = 0
    doubled: float = 0
    flipped: float = 0
    late: float = 0
    late_ms: int = 0
    dead_from: int | None = None
    dead_until: int | None = None


class Way:
    """One direction of a line, in which bytes keep their order."""

    def __init__(self, faults, random):
        self._faults = faults
        self._random = random
        self._pieces = deque()
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
            if draw < faults.dropped + faults.flipped:
                byte ^= 1 << random.randrange(8)
            came.append(byte)
            if draw > 1 - faults.doubled:
                came.append(byte)
        at_ms = now_ms + (random.randrange(faults.late_ms) if random.random() < faults.late else 0)
        if self._pieces:
            at_ms = max(at_ms, self._pieces[-1][0])
        if came:
            # The late part of a piece is behind any of its bytes.
            cut = random.randrange(len(came)) if at_ms > now_ms and not self._pieces else 0
            if cut:
                self._pieces.append((now_ms, bytes(came[:cut])))
            self._pieces.append((at_ms, bytes(came[cut:])))

    def take(self, now_ms):
        """What has arrived by ``now_ms``."""
        data = b""
        while self._pieces and self._pieces[0][0] <= now_ms:
            data += self._pieces.popleft()[1]
        return data

    def next_ms(self):
        """When the next bytes arrive; None where none are under way."""
        return self._pieces[0][0] if self._pieces else None


class LineBoard(Board):
    """A leader's board that has a line, a clock and a store, and nothing else."""

    is_leader = True
    levels = levels_of(CLASSROOM)

    def __init__(self, stored, way_there, way_back):
        self.stored = stored
        self.now = 0
        self.last_byte_ms = 0
        self._there, self._back = way_there, way_back

    def now_ms(self):
        return self.now & TICKS_MASK

    def load_image(self):
        return self.stored

    def store_image(self, data):
        self.stored = data

    def read_serial(self):
        data = self._there.take(self.now)
        if data:
            self.last_byte_ms = self.now
        return data

    def write_serial(self, data):
        self._back.put(data, self.now)


def talk_through(talk, stored, there, back, start_ms=0, most_ms=120_000):
    """What the car holds once ``talk`` is over and its last byte has arrived, and when it was over.

    ``stored`` is what the car holds at first, or None. Time leaps to the next moment at which anybody may act.
    """
    board = LineBoard(stored, there, back)
    car, now = Car(board), start_ms
    while talk.outcome is None:
        assert now < start_ms + most_ms, "the talk goes on for ever"
        sent = talk.step(back.take(now), now & TICKS_MASK)
        if sent:
            there.put(sent, now)
        board.now = now
        car.tick()
        due = [now + talk.rest_ms, there.next_ms(), back.next_ms(), board.last_byte_ms + SILENCE_MS]
        now = min(max(each, now + 1) for each in due if each is not None and each > now - 1)
    over_ms = now
    while there.next_ms() is not None:
        now = board.now = max(now, there.next_ms())
        car.tick()
    board.now = now + SILENCE_MS
    car.tick()
    return board.stored, over_ms
