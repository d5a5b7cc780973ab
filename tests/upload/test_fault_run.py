"""Uploads through lines that damage whatever they carry: the car holds the old image or the new one, as was said."""

import contextlib
import sys
from collections import Counter
from random import Random

import pytest
from hypothesis import settings

from motorcade.boards.computer import ImageStore, simulated_car
from motorcade.boards.lines import Line, PseudoTerminal, TcpPort
from motorcade.errors import MotorcadeError
from motorcade.upload import check_request as asking
from motorcade.upload import serial_port
from motorcade.upload import transfer as talk
from motorcade.upload.transfer import EITHER, NEW, OLD, UploadTransfer
from motorcade.words import upload
from motorcade.words.image import Image, image_words, words_to_bytes
from motorcade.words.upload import VERIFIED
from support.faulty_line import Faults, RealCar, Way, talk_through
from support.socket_lines import without_pauses
from support.strategies import CLASSROOM

# 4,000; many more in `make soak`.
UPLOADS = 100 * settings().max_examples
PARTS = 10
UPLOADS_OF_A_LINE = 6
PTY = pytest.param("pty", marks=pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals"))
# Chances for each byte: of a good line, of one that is bad now and then, of a bad one.
CHANCES = (0, 0, 0.002, 0.02)


def drawn_image(random):
    """An image of up to 15 words, or now and then of up to 511."""
    most = 255 if random.random() < 0.02 else 7
    leader = [random.getrandbits(20) << 12 & 0x7FFFFFFF for _ in range(random.randint(0, most))]
    followers = [random.getrandbits(20) << 12 for _ in range(random.randint(0, most))]
    return words_to_bytes(image_words(Image(leader, followers, random.randrange(8), 0)))


def drawn_faults(random):
    faults = Faults(*(random.choice(CHANCES) for _ in range(3)))
    if random.random() < 0.3:
        faults.late, faults.late_ms = random.choice((0.05, 0.5)), random.choice((50, 600, 3000))
    if random.random() < 0.2:
        faults.dead_from = random.randrange(120)
        if random.random() < 0.5:
            faults.dead_until = faults.dead_from + random.randrange(60)
    return faults


def upload_once(seed):
    """What the car held before, what was sent, what it holds then, and the talk."""
    random = Random(seed)
    old, new = drawn_image(random), drawn_image(random)
    there, back = (Way(drawn_faults(random), random) for _ in range(2))
    start_ms = random.getrandbits(30)
    for way in (there, back):
        way.put(random.randbytes(random.choice((0, 0, 40))), start_ms - random.randrange(700))
    upload_talk = UploadTransfer(new, random.choice((9600, 115200)), number=random.randrange(256))
    car = RealCar(old, there, back)
    talk_through([upload_talk], car, there, [back], start_ms)
    return old, new, car.holds, upload_talk


@pytest.mark.parametrize("part", range(PARTS))
def test_after_any_fault_the_car_holds_the_old_image_or_the_new_one_and_the_uploader_has_said_which(part):
    ended = Counter()
    for seed in range(part, UPLOADS, PARTS):
        old, new, held, done = upload_once(seed)
        allowed = {NEW: (new,), OLD: (old,), EITHER: (old, new)}.get(done.holds, ())
        assert held in allowed, f"seed {seed}: said {done.holds}, and the car holds {held.hex()}"
        assert (done.outcome.kind == VERIFIED) == (done.holds == NEW), f"seed {seed}"
        ended[done.holds, held == new] += 1
    assert min(ended[NEW, True], ended[OLD, False], ended[EITHER, True], ended[EITHER, False]) > 0


class FaultyLine(Line):
    """A car's real line, and faults in both directions on top."""

    def __init__(self, line, random, there, back):
        self._line, self._random, self._ways = line, random, (there, back)
        self.wait, self.close = line.wait, line.close

    @property
    def sender(self):
        return self._line.sender

    def read(self):
        return self._damaged(self._line.read(), self._ways[0])

    def write(self, data):
        self._line.write(self._damaged(data, self._ways[1]))

    def _damaged(self, data, faults):
        way = Way(faults, self._random)
        way.put(data, 0)
        return way.take(0)


@contextlib.contextmanager
def a_car(kind, store, random, most):
    """The address of a simulated car at a line whose bytes have faults by chances up to ``most``."""
    line = PseudoTerminal() if kind == "pty" else TcpPort("127.0.0.1", 0)
    faults = [Faults(*(random.choice((0, most / 4, most)) for _ in range(3))) for _ in range(2)]
    with contextlib.closing(line), simulated_car(FaultyLine(line, random, *faults), store, CLASSROOM):
        yield line.address


@pytest.mark.soak
@pytest.mark.parametrize("kind", [PTY, "tcp"])
def test_the_same_holds_on_real_lines_in_real_time(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(upload, "SILENCE_MS", 40)
    monkeypatch.setattr(talk, "SETTLE_MS", 60)
    monkeypatch.setattr(upload, "ANSWER_WITHIN_MS", 150)
    monkeypatch.setattr(asking, "ANSWER_WITHIN_MS", 150)
    without_pauses(monkeypatch)
    store, said = ImageStore(tmp_path / "car.image"), Counter()
    for seed in range(UPLOADS_OF_A_LINE):
        random = Random(seed)
        old, new = drawn_image(random), drawn_image(random)
        store.save(old)
        # The first line has no faults, so that one upload succeeds.
        with a_car(kind, store, random, 0.02 if seed else 0.0) as port:
            try:
                serial_port.upload(port, new, 115200)
                holds = NEW
            except MotorcadeError as problem:
                holds = problem.details["holds"].key.removeprefix("car-holds-")
        said[holds] += 1
        assert store.load() in {NEW: (new,), OLD: (old,), EITHER: (old, new)}[holds], f"seed {seed}"
    assert said[NEW]
