"""Uploads through lines that damage whatever they carry: the car holds the old image or the new one, as was said.

`tests/faults` has real lines, stores and processes in a simulated room.
"""

from collections import Counter
from random import Random

import pytest
from hypothesis import settings

from motorcade.upload.transfer import EITHER, NEW, OLD, UploadTransfer
from motorcade.words.image import Image, image_words, words_to_bytes
from motorcade.words.upload import VERIFIED
from support.faulty_line import Faults, RealCar, Way, talk_through

# 4,000; many more in `make soak`.
UPLOADS = 100 * settings().max_examples
PARTS = 10
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
