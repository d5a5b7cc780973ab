"""Uploads to emulated chips by the project's own uploader, in the chips' time."""

import random

from motorcade.upload.transfer import ReadbackTransfer, Transfer, UploadTransfer
from motorcade.words.flow import CALL, CHANCE, COUNT, JUMP, RETURN, TELL
from motorcade.words.formats import FLOW, STATE
from motorcade.words.image import Image, image_words
from motorcade.words.packing import words_to_bytes
from motorcade.words.upload import IMAGE
from motorcade.words.uploader import VERIFIED
from support.emulated_chips import Chip, ChipWorld
from support.faulty_line import Faults, Way

BAUD = 115200
_LONGEST_MS = 60_000


def run(world: ChipWorld, chip: Chip, transfer: Transfer, faults: Faults | None = None) -> Transfer:
    """Run a transfer to its end, over a line with ``faults``."""
    there, back = (Way(faults or Faults(), random.Random(seed)) for seed in (0, 1))
    end_ms = world.now_ms + _LONGEST_MS
    while transfer.outcome is None:
        back.put(chip.received(), world.now_ms)
        there.put(transfer.step(back.take(world.now_ms), world.now_ms), world.now_ms)
        if data := there.take(world.now_ms):
            chip.send(data)
        world.run(1)
        assert world.now_ms < end_ms, "the transfer doesn't end"
    return transfer


def upload(world: ChipWorld, chip: Chip, image: bytes) -> int:
    """Upload an image; returns how many ms it took."""
    begin_ms = world.now_ms
    done = run(world, chip, UploadTransfer(image, BAUD))
    assert done.outcome
    assert done.outcome.kind == VERIFIED, done.outcome
    assert done.holds == "new"
    return world.now_ms - begin_ms


def flow_image_of(words: int) -> bytes:
    """Return an image that keeps a leader busy: flow words by chance, all calls, and a tell before each state."""
    followers = (0xC0280000, 0xC0480000, 0xC0680000)
    count = min(words - 1 - len(followers), 255)
    leader = []
    for index in range(count):
        op = (JUMP, CALL, JUMP, RETURN, COUNT)[index % 5]
        target = (index * 7 + 1) % count
        word = FLOW.encode(op=op, target=target, condition=CHANCE, value=128, counter=index % 4, level=0)
        leader.append(word)
        if op == COUNT:
            leader[-1] = FLOW.encode(op=COUNT, counter=index % 4, level=3, value=99)
    for index in range(3, count - 1, 37):
        leader[index : index + 2] = [FLOW.encode(op=TELL, target=index % 3), STATE.encode(forward=1, until=1)]
    return words_to_bytes(image_words(Image(tuple(leader), followers, 0, 1, 1)))


def held_image(world: ChipWorld, chip: Chip) -> bytes:
    """Read back the image."""
    done = run(world, chip, ReadbackTransfer(BAUD))
    assert done.outcome
    assert done.outcome.kind == IMAGE, done.outcome
    image: bytes = done.outcome.detail
    return image


def image_of(words: int, seed: int = 0) -> bytes:
    """An image with so many words, its leader's states drawn at random."""
    draw = random.Random(seed)
    states = [0x40000000 | draw.getrandbits(18) << 12 for _ in range(words - 1)]
    leaders = min(len(states), 255)
    followers = len(states) - leaders
    header = leaders << 24 | followers << 16 | (0x100 if followers else 0)
    return words_to_bytes((header, *states))
